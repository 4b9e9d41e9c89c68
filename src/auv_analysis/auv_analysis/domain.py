"""Which ROS domain a run uses, and that nobody else's vehicle is on it."""

import os
import random
import socket

from auv_dynamics.refusal import InputError, shorten

LARGEST = 101  # above it, DDS ports fall into the range that the system hands out
VARIABLE = 'ROS_DOMAIN_ID'


def chosen_domain(option: int | str | None) -> tuple[int, bool]:
    """Domain id, and whether it was picked here because nobody asked for one.

    Parameters
    ----------
    option : of the command line; none: $ROS_DOMAIN_ID, else a free one

    Raises
    ------
    InputError : not a number from 0 to 101

    """
    if option is not None:
        return _checked(option, '--domain-id'), False
    if os.environ.get(VARIABLE):
        return _checked(os.environ[VARIABLE], VARIABLE), False
    candidates = list(range(1, LARGEST + 1))
    random.shuffle(candidates)
    return next((domain for domain in candidates if is_free(domain)), 1), True


def joined_domain(option: int | str | None) -> int:
    """Domain id of a graph that is there already.

    Parameters
    ----------
    option : of the command line; none: $ROS_DOMAIN_ID, else 0 as for every ROS program

    Raises
    ------
    InputError : not a number from 0 to 101

    """
    asked = option is not None or os.environ.get(VARIABLE)
    return chosen_domain(option)[0] if asked else 0


def _checked(value: object, name: str) -> int:
    try:
        domain = int(str(value))
    except ValueError:
        domain = -1
    if not 0 <= domain <= LARGEST:
        raise InputError(name, '', f'a whole number from 0 to {LARGEST}', shorten(value))
    return domain


def is_free(domain: int) -> bool:
    """Whether the first participant's port of a domain is unused (DDSI-RTPS 9.6.1.1)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('127.0.0.1', 7400 + 250 * domain + 10))
        except OSError:
            return False
    return True
