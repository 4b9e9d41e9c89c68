"""The plant's disturbances, actuators and sensors as ROS parameters, as a scenario writes them."""

import math
from typing import Any

from rclpy.node import Node

from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.current import AXES
from auv_dynamics.plant.disturbance import KINDS
from auv_dynamics.ros.parameters import declare, harmonic_parameters

NAMES = 'disturbance.names'
ALL_KINDS = (*KINDS, 'model_error', 'current')
RELATIVE = ('mass', 'added_mass', 'damping', 'buoyancy')


def disturbance_specs(node: Node) -> list[dict[str, Any]]:
    """Declare the disturbances of a node and return them as a scenario writes them."""
    declare(node, NAMES, list[str], None, 'names of the disturbances; their sum acts')
    return [_spec(node, f'{prefix}.') for prefix in disturbance_prefixes(node)]


def disturbance_prefixes(node: Node) -> list[str]:
    """How the parameters of each disturbance begin, in their order; after `disturbance_specs`."""
    names = node.get_parameter_or(NAMES, None)
    return [f'disturbance.{name}' for name in (names.value if names is not None else None) or []]


def _spec(node: Node, prefix: str) -> dict[str, Any]:
    kind = declare(node, f'{prefix}kind', str, '', 'kind of disturbance', one_of=ALL_KINDS)
    if kind == 'herman2018':
        sign = declare(
            node, f'{prefix}exponent_sign', float, -1.0, '-1 or 1, sign of the exponents of (39)'
        )
        if sign not in (-1.0, 1.0):
            raise InputError(node.get_name(), f'{prefix}exponent_sign', '-1 or 1', sign)
        return {'kind': kind, 'exponent_sign': sign, **_matrices(node, prefix, ('scale',))}
    if kind == 'model_error':
        spec: dict[str, Any] = {'kind': kind, **_matrices(node, prefix, ('dM', 'dD'))}
        for key in RELATIVE:
            value = declare(
                node, f'{prefix}{key}', float, None, f'relative error of {key}', at_least=-1.0
            )
            if value is not None:
                spec[key] = value
        return spec
    if kind == 'current':
        velocity = numbers(
            node, f'{prefix}velocity', 'constant velocity of the water, m/s, NED', (3,)
        )
        waves = harmonic_parameters(node, prefix, 'm/s', tuple(AXES))
        return {'kind': kind, **({'velocity': velocity} if velocity else {}), **waves}
    return {'kind': kind, **harmonic_parameters(node, prefix, 'N, N m')}


def actuator_spec(node: Node) -> dict[str, Any] | None:
    """Declare `actuators.*` and return them as a scenario writes them; None when there are none."""
    spec: dict[str, Any] = {}
    for key, unit in (('limit', 'saturation, N, N m'), ('rate', 'rate limit, N/s, N m/s')):
        values = numbers(node, f'actuators.{key}', unit, (1, 6))
        if values and min(values) <= 0:
            raise InputError(node.get_name(), f'actuators.{key}', 'positive numbers', values)
        spec[key] = (values[0] if len(values) == 1 else values) if values else None
    for key, text in (('lag', 'time constant of a first-order lag, s'), ('delay', 'dead time, s')):
        spec[key] = declare(node, f'actuators.{key}', float, None, text, at_least=0.0)
    text = 'allocate the wrench to the thrusters of the vehicle file'
    spec['thrusters'] = declare(node, 'actuators.thrusters', bool, None, text)
    return what_is_given(spec)


def sensor_spec(node: Node) -> dict[str, Any] | None:
    """Declare `sensors.*` and return them as a scenario writes them; None when there are none."""
    spec: dict[str, Any] = {}
    for key, unit, count, most in (
        ('velocity_noise', 'm/s, rad/s', 6, 10),
        ('attitude_noise', 'rad', 3, 10),
    ):
        values = numbers(node, f'sensors.{key}', f'standard deviation, {unit}', (1, count))
        if values and not all(0 <= value <= most for value in values):
            raise InputError(node.get_name(), f'sensors.{key}', f'numbers from 0 to {most}', values)
        spec[key] = (values[0] if len(values) == 1 else values) if values else None
    text = 'probability that a sample is lost'
    spec['drop_out'] = declare(
        node, 'sensors.drop_out', float, None, text, at_least=0.0, at_most=1.0
    )
    return what_is_given(spec)


def what_is_given(spec: dict[str, Any]) -> dict[str, Any] | None:
    """The entries that are not None; None when there are none."""
    return {key: value for key, value in spec.items() if value is not None} or None


def numbers(node: Node, name: str, text: str, lengths: tuple[int, ...]) -> list[float]:
    """Declare a list of finite numbers of one of some lengths; empty when it is not given."""
    values = declare(node, name, list[float], None, text) or []
    if values and len(values) not in lengths:
        expected = f'{" or ".join(map(str, lengths))} numbers'
        raise InputError(node.get_name(), name, expected, f'{len(values)} numbers')
    if not all(map(math.isfinite, values)):
        raise InputError(node.get_name(), name, 'finite numbers', values)
    return values


def _matrices(node: Node, prefix: str, keys: tuple[str, ...]) -> dict[str, list[float]]:
    found = {
        key: numbers(node, f'{prefix}{key}', '6x6: 1, 6 (diagonal) or 36 numbers', (1, 6, 36))
        for key in keys
    }
    return {key: value for key, value in found.items() if value}
