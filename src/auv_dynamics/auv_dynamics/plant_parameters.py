"""The plant's disturbances as ROS parameters: `disturbance.names` and per name its values."""

from typing import Any

from rclpy.node import Node

from auv_dynamics.disturbance import KINDS
from auv_dynamics.files import InputError
from auv_dynamics.ros.parameters import declare, given
from auv_dynamics.signals import DOFS, harmonic_spec


def disturbance_specs(node: Node) -> list[dict[str, Any]]:
    """Declare the disturbances of a node and return them as a scenario writes them."""
    names = declare(node, 'disturbance.names', list[str], None, 'disturbances, added up') or []
    return [_spec(node, name) for name in names]


def _spec(node: Node, name: str) -> dict[str, Any]:
    prefix = f'disturbance.{name}.'
    kind = declare(node, f'{prefix}kind', str, '', 'kind of disturbance', one_of=list(KINDS))
    if kind == 'herman2018':
        sign = declare(node, f'{prefix}exponent_sign', float, -1.0, 'sign of the exponents of (39)')
        if sign not in (-1.0, 1.0):
            raise InputError(node.get_name(), f'{prefix}exponent_sign', '-1 or 1', sign)
        return {'kind': kind, 'exponent_sign': sign}
    return {'kind': kind, **harmonic_parameters(node, prefix, 'N, N m')}


def harmonic_parameters(node: Node, prefix: str, unit: str) -> dict[str, Any]:
    """Declare `<prefix><dof>.{offset, amplitude, omega, phase}` and return them as a mapping."""
    columns: dict[str, Any] = {}
    for dof in DOFS:
        columns[f'{dof}.offset'] = declare(
            node, f'{prefix}{dof}.offset', float, 0.0, f'constant part, {unit}'
        )
        for key, what in (('amplitude', unit), ('omega', 'rad/s'), ('phase', 'rad')):
            values = declare(node, f'{prefix}{dof}.{key}', list[float], None, f'{what}, per term')
            columns[f'{dof}.{key}'] = values or []
    try:
        spec = harmonic_spec(columns)
    except ValueError as error:
        raise InputError(node.get_name(), prefix.rstrip('.'), str(error), 'other lengths') from None
    used = {dof for dof in DOFS if given(node, f'{prefix}{dof}.')}
    return {dof: entry for dof, entry in spec.items() if dof in used}
