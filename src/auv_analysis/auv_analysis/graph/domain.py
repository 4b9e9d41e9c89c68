"""The ROS domain of a command: which one it joins, and that no other run is on it."""

import fcntl
import os
import random
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from auv_dynamics.files.errors import InputError, shorten
from auv_dynamics.ros.security import HERE, RANGE, stay_local

LARGEST = 101  # above it, DDS ports fall into the range that the system hands out
VARIABLE = 'ROS_DOMAIN_ID'
PARTICIPANTS = 10  # of a graph that is looked for
ANNOUNCED = (
    4.0  # s in which others are found: Fast DDS repeats an announcement that was lost after 3
)


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


@contextmanager
def own_domain(option: int | str | None) -> Iterator[tuple[int, bool]]:
    """`chosen_domain`, kept from other runs of this user as long as this lasts.

    Raises
    ------
    InputError : no such domain, or another run is on the one that was asked for

    """
    for _ in range(LARGEST):
        domain, picked = chosen_domain(option)
        path = Path(tempfile.gettempdir()) / f'auv_gvc_{os.getuid()}_domain_{domain}.lock'
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            break
        except BlockingIOError:
            os.close(handle)
            if not picked:
                expected = 'a domain that no other auv run is on'
                raise InputError(f'{VARIABLE}={domain}', '', expected, 'one in use') from None
    else:
        raise InputError(VARIABLE, '', 'a free domain', 'none')
    try:
        yield domain, picked
    finally:
        os.close(handle)


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
    """Whether the ports of a domain's first participants are unused.

    The very first one may have left before the others.
    """
    return all(map(_is_unused, ports(domain)))


def ports(domain: int) -> list[int]:
    """UDP ports of a domain's first participants (DDSI-RTPS 9.6.1.1)."""
    return [7400 + 250 * domain + 10 + 2 * i for i in range(PARTICIPANTS)]


def _is_unused(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('127.0.0.1', port))
        except OSError:
            return False
    return True


def join_domain(option: int | None) -> int:
    """Let the middleware join a domain: set its environment, as far as the user has not.

    Parameters
    ----------
    option : see `joined_domain`

    """
    domain = joined_domain(option)
    os.environ[VARIABLE] = str(domain)
    stay_local()
    return domain


def place_of(domain: int, namespace: str = '/', *, with_range: bool = True) -> str:
    """Domain and namespace in words, and how far nodes are heard."""
    inside = '' if namespace == '/' else f', namespace {namespace}'
    place = f'{VARIABLE}={domain}{inside}'
    if not with_range:
        return place
    where = os.environ[RANGE]
    heard = f'this machine only ({RANGE}={HERE})' if where == HERE else f'{RANGE}={where}'
    return f'{place}, {heard}'
