"""The plant's faults as ROS parameters, as a scenario writes them."""

from typing import Any

from rclpy.node import Node

from auv_dynamics.files.errors import InputError
from auv_dynamics.nodes.plant_parameters import numbers, what_is_given
from auv_dynamics.plant.faults import KINDS
from auv_dynamics.ros.parameters import declare
from auv_dynamics.vehicle import DOFS

NAMES = 'faults.names'
LONGEST_DELAY = 10.0  # s, as in the scenario's schema


def fault_specs(node: Node) -> tuple[list[dict[str, Any]], list[str]]:
    """Declare the faults of a node; as a scenario writes them, and how their parameters begin."""
    names = declare(node, NAMES, list[str], None, 'names of the faults') or []
    places = [f'faults.{name}' for name in names]
    return [_spec(node, f'{place}.') for place in places], places


def _spec(node: Node, prefix: str) -> dict[str, Any]:
    kind = declare(node, f'{prefix}kind', str, '', 'kind of fault', one_of=KINDS)
    spec: dict[str, Any] = {'kind': kind}
    for key, what in (('from', 'begin, s'), ('to', 'end, s')):
        spec[key] = declare(node, f'{prefix}{key}', float, None, what, at_least=0.0)
    spec |= _OF_KIND[kind](node, prefix)
    return what_is_given(spec) or {}


def _share(node: Node, prefix: str, key: str, what: str) -> dict[str, float | None]:
    return {key: declare(node, f'{prefix}{key}', float, None, what, at_least=0.0, at_most=1.0)}


def _drop_out(node: Node, prefix: str) -> dict[str, Any]:
    return _share(node, prefix, 'probability', 'probability that a sample is lost; default 1')


def _delay(node: Node, prefix: str) -> dict[str, Any]:
    text = 'dead time, s, a multiple of step'
    delay = declare(node, f'{prefix}delay', float, None, text, at_least=0.0, at_most=LONGEST_DELAY)
    return {'delay': _required(node, prefix, 'delay', delay, 'a number of seconds')}


def _bias(node: Node, prefix: str) -> dict[str, Any]:
    velocity = numbers(node, f'{prefix}velocity', 'bias of nu, m/s and rad/s', (6,))
    attitude = numbers(
        node, f'{prefix}attitude', 'bias of the attitude, rad, about the body axes', (3,)
    )
    _required(node, prefix, 'velocity', velocity or attitude, 'velocity or attitude')
    return {'velocity': velocity or None, 'attitude': attitude or None}


def _thruster(node: Node, prefix: str) -> dict[str, Any]:
    name = declare(node, f'{prefix}thruster', str, None, 'name of a thruster of the vehicle file')
    name = _required(node, prefix, 'thruster', name, 'a thruster of the vehicle file')
    return {'thruster': name, **_what_is_left(node, prefix, 'thrust that it is stuck at, N')}


def _actuator(node: Node, prefix: str) -> dict[str, Any]:
    axis = declare(node, f'{prefix}axis', str, '', 'degree of freedom', one_of=DOFS)
    return {
        'axis': axis,
        **_what_is_left(node, prefix, 'force or moment that it is stuck at, N or N m'),
    }


def _wrench_loss(node: Node, prefix: str) -> dict[str, Any]:
    timeout = declare(
        node, f'{prefix}timeout', float, None, 's after which a lost wrench is zero', at_least=0.0
    )
    return {
        'timeout': timeout,
        **_share(node, prefix, 'probability', 'probability that a wrench is lost; default 1'),
    }


_OF_KIND = {
    'sensor_drop_out': _drop_out,
    'sensor_delay': _delay,
    'sensor_bias': _bias,
    'thruster': _thruster,
    'actuator': _actuator,
    'wrench_loss': _wrench_loss,
}


def _what_is_left(node: Node, prefix: str, text: str) -> dict[str, Any]:
    """`efficiency` or `stuck`, exactly one of them."""
    left = _share(node, prefix, 'efficiency', 'fraction of its output that is left')
    left['stuck'] = declare(node, f'{prefix}stuck', float, None, text)
    found = [key for key, value in left.items() if value is not None]
    if len(found) != 1:
        words = ' and '.join(found) or 'neither'
        raise InputError(node.get_name(), prefix.rstrip('.'), 'efficiency or stuck', words)
    return left


def _required(node: Node, prefix: str, key: str, value: Any, expected: str) -> Any:
    if not value:
        raise InputError(node.get_name(), f'{prefix}{key}', expected, None)
    return value
