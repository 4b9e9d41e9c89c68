"""Which values of a sweep are packed as columns of numbers, without a scenario for each.

Gains, the vehicle's numbers, relative model errors, set-points and initial states are; any other
value makes a scenario of its own, checked like a file. Both ways give the same numbers, and what a
column cannot vouch for goes the long way.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.scenario.changes import bounds, split
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.fleet import Keys
from auv_dynamics.files.yaml_files import LARGEST
from auv_gvc_controller.laws.law import SHIPPED

RELATIVE = ('mass', 'added_mass', 'damping', 'buoyancy')  # errors of a plant
NUMERIC = (
    'rigid_body', 'inertia_matrix', 'hydrostatics', 'added_mass', 'damping', 'lift', 'environment',
)  # fmt: skip
TERM = ('amplitude', 'omega', 'phase')
SHAPES = ((6,), (6, 6))  # of what stands for a matrix, beside a number where that may stand


def in_columns(scenario: Scenario, controller: str, path: str, values: np.ndarray) -> bool:
    """Whether values of this path are packed as a column.

    Parameters
    ----------
    scenario, controller : that are changed
    path : of `changes`
    values : (B, ...) that stand there

    """
    if values.dtype.kind not in 'iuf' or path == 'vehicle':
        return False
    keys = split(path)
    head, rest = keys[0], keys[1:]
    if head == 'controllers':
        return rest[0] == controller and _gain_fits(scenario, controller, rest[1:], values)
    if head == 'vehicle':
        return _vehicle_fits(scenario, rest, values)
    if head == 'disturbance':
        apart = scenario.vehicle.M_RB is not None
        return apart and len(rest) == 2 and rest[1] in RELATIVE and values.ndim == 1
    if head == 'setpoint':
        return values.ndim == 1 and _setpoint_fits(scenario.data['setpoint'], rest)
    return head == 'seed' or (head == 'initial' and _fits(scenario.data, keys, values, ()))


def _setpoint_fits(spec: Mapping[str, Any], keys: Keys) -> bool:
    """A number of a degree of freedom that has a set-point, of a term that there is."""
    entry = spec.get(str(keys[0]))
    if 'file' in spec or entry is None:
        return False
    match keys[1:]:
        case ('offset',):
            return True
        case ('terms', int(j), name):
            return j < len(entry.get('terms', [])) and name in TERM
    return False


def _gain_fits(scenario: Scenario, controller: str, keys: Keys, values: np.ndarray) -> bool:
    entry = scenario.data['controllers'][controller]
    known = keys and keys[0] in entry and keys[0] not in ('law', 'anti_windup')
    return bool(known and entry['law'] in SHIPPED and _fits(entry, keys, values, (*SHAPES, ())))


def _vehicle_fits(scenario: Scenario, keys: Keys, values: np.ndarray) -> bool:
    """Not where more than M, D and g depends on the vehicle, nor for what is no number."""
    thrusters = scenario.data.get('actuators', {}).get('thrusters', False)
    currents = any(spec['kind'] == 'current' for spec in scenario.data['disturbance'])
    numeric = keys[0] in NUMERIC
    return (
        numeric
        and not (thrusters or currents)
        and _fits(scenario.vehicle_data, keys, values, SHAPES)
    )


def _fits(data: Any, keys: Keys, values: np.ndarray, shapes: Sequence[tuple[int, ...]]) -> bool:
    """Whether values stand where numbers stood, in the same shape or another one that may."""
    try:
        for key in keys:
            data = data[key]
        there = np.shape(np.asarray(data, float))
    except (KeyError, IndexError, TypeError, ValueError):
        return False
    shape = values.shape[1:]
    return shape == there or (shape in shapes and there in shapes)


def within(scenario: Scenario, path: str, values: np.ndarray) -> np.ndarray:
    """(B,) whether each value of a column is one that the schema takes."""
    allowed = bounds(scenario, path)
    if allowed is None:
        return np.zeros(len(values), bool)
    flat = np.reshape(values, (len(values), -1)).astype(float)
    inside = (flat > allowed[0]) & (flat < allowed[1]) & (np.abs(flat) < LARGEST)
    return inside.all(axis=1)
