"""Entries of a scenario as values of ROS parameters."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_analysis.scenario import Scenario
from auv_dynamics.current import AXES
from auv_dynamics.files import matrix6
from auv_dynamics.signals import harmonic_columns


def fault_values(scenario: Scenario) -> dict[str, Any]:
    """Parameters of the faults of a scenario."""
    parameters: dict[str, Any] = {}
    names = []
    for i, fault in enumerate(scenario.faults.entries, start=1):
        names.append(f'f{i}_{fault.kind}')
        parameters |= {f'faults.{names[-1]}.{key}': _value(v) for key, v in fault.spec.items()}
    return {**parameters, 'faults.names': names}


def _value(value: Any) -> str | float | list[float]:
    if isinstance(value, str):
        return value
    return flat(value) if np.ndim(value) else float(value)


def disturbance_values(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters of a disturbance, without what they begin with."""
    values = {
        'herman2018': {'exponent_sign': float(spec.get('exponent_sign', -1))},
        'harmonic': harmonic_columns(spec),
        'current': harmonic_columns(spec, tuple(AXES)),
        'model_error': {},
    }[spec['kind']]
    for key in ('mass', 'added_mass', 'damping', 'buoyancy'):
        if key in spec:
            values[key] = float(spec[key])
    for key in ('scale', 'dM', 'dD', 'velocity'):
        if key in spec:
            values[key] = flat(spec[key])
    return {'kind': spec['kind'], **values}


def flat(value: Any) -> list[float]:
    """Shortest list of numbers that a parameter takes: as it is, 36 for a matrix."""
    if np.ndim(value) < 2:
        return [float(number) for number in np.atleast_1d(value)]
    return matrix6(value).ravel().tolist()
