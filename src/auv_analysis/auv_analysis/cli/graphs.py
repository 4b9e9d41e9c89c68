"""What commands share that join a node graph: domain, reach, namespace, numbers of options."""

import math
import os
import re
from collections.abc import Callable

from auv_analysis.graph.domain import VARIABLE
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.security import HERE, RANGE, stay_local


def join_domain(domain: int) -> None:
    """Set the environment of the middleware, as far as the user has not."""
    os.environ[VARIABLE] = str(domain)
    stay_local()


def place_of(domain: int, namespace: str = '/') -> str:
    """Domain, namespace and reach in words."""
    where = os.environ[RANGE]
    reach = f'this machine only ({RANGE}={HERE})' if where == HERE else f'{RANGE}={where}'
    return f'{short_place(domain, namespace)}, {reach}'


def short_place(domain: int, namespace: str) -> str:
    """Domain and namespace in words."""
    inside = '' if namespace == '/' else f', namespace {namespace}'
    return f'{VARIABLE}={domain}{inside}'


def checked_namespace(text: str) -> str:
    """Namespace of an option, with its slash."""
    namespace = '/' + text.strip('/')
    if not re.fullmatch(r'/|(/[A-Za-z_][A-Za-z0-9_]*)+', namespace):
        raise InputError('--namespace', '', 'a ROS namespace such as /auv1', text)
    return namespace


def checked_topic(text: str, option: str) -> str:
    """Topic of an option, relative to the namespace or absolute."""
    if not re.fullmatch(r'/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*', text):
        raise InputError(option, '', 'a ROS topic such as odom or /auv1/odom', text)
    return text


def positive(text: str | None, name: str, most: float = math.inf) -> float | None:
    """Positive number of an option, None where it is not given."""
    limit = '' if most == math.inf else f', at most {most:g}'
    return _number(text, name, f'a number above 0{limit}', lambda value: 0 < value <= most)


def not_negative(text: str | None, name: str, others: str = '') -> float | None:
    """Number of an option from 0 on, None where it is not given; `others`: what else is taken."""
    return _number(text, name, f'a number of at least 0{others}', lambda value: value >= 0)


def _number(
    text: str | None, name: str, expected: str, fits: Callable[[float], bool]
) -> float | None:
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and fits(value)):
        raise InputError(name, '', expected, text)
    return value
