"""Vehicles, scenarios and runs that the tests of the reference share."""

from copy import deepcopy
from functools import cache
from pathlib import Path

import herman_reference as reference
import numpy as np
import yaml

CONFIG = Path(__file__).parents[2] / 'config'
DENSE_M_A = np.array(
    [
        [10, 1, 0, 0, 0, 0.5],
        [1, 20, 2, 0, 0, 0],
        [0, 2, 30, 0, 0, 0],
        [0, 0, 0, 5, 0.3, 0],
        [0, 0, 0, 0.3, 15, 1],
        [0.5, 0, 0, 0, 1, 25],
    ]
)
CONSTANT = {'kind': 'current', 'velocity': [0.5, -0.3, 0.2]}
VARYING = CONSTANT | {
    'east': {'offset': 0.1, 'terms': [{'amplitude': 0.4, 'omega': 0.7, 'phase': 0.3}]},
    'down': {'terms': [{'amplitude': 0.2, 'omega': 1.3}]},
}
ERRORS = {'kind': 'model_error', 'mass': 0.1, 'added_mass': -0.3, 'damping': 0.5, 'buoyancy': 0.02}


PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
CL = {'law': 'cl', 'k_D': 4000.0, 'k_I': 500.0, 'Lambda': 0.8, 'Gamma': 3000.0}
PID = {'law': 'pid', 'k_P': 4000.0, 'k_I': 2000.0, 'k_D': 50.0}
SMC = {'law': 'smc', 'k_D': 4000.0, 'Lambda': 0.8, 'Gamma': 9000.0, 'k_S': 100.0, 'phi': 0.05}
TURNED = {'eta': [1.0, -2.0, 3.0, 0.4, -0.5, 2.5], 'nu': [0.4, -0.3, 0.2, 0.1, -0.2, 0.3]}


def file_of(name: str, folder: str = 'vehicles') -> dict:
    return deepcopy(parsed(name, folder))


@cache
def parsed(name: str, folder: str) -> dict:
    return yaml.safe_load((CONFIG / folder / f'{name}.yaml').read_text(encoding='utf-8'))


def off_centre() -> dict:
    """RexROV with its centre of gravity off in all axes and asymmetric damping."""
    vehicle = file_of('rexrov')
    vehicle['rigid_body']['center_of_gravity'] = [0.12, -0.07, 0.2]
    linear = np.diag(vehicle['damping']['linear'])
    linear[1, 5], linear[5, 1] = 80.0, -20.0
    vehicle['damping']['linear'] = linear.tolist()
    return vehicle


def sphere(mass: float = 10.0, added: float = 5.0) -> dict:
    """Neutral, without damping, M_A the same in all directions."""
    return {
        'rigid_body': {
            'mass': mass,
            'center_of_gravity': [0.0] * 3,
            'inertia': np.eye(3).tolist(),
            'inertia_reference': 'cg',
        },
        'added_mass': [added] * 3 + [0.0] * 3,
        'hydrostatics': {'volume': mass / 1000.0, 'center_of_buoyancy': [0.0] * 3},
    }


def wave(offset: float, amplitude: float, omega: float, phase: float = 0.0) -> dict:
    return {'offset': offset, 'terms': [{'amplitude': amplitude, 'omega': omega, 'phase': phase}]}


SIX = {
    'surge': wave(0.3, 0.4, 0.5), 'sway': wave(-0.1, 0.2, 0.7, 1.0), 'heave': wave(0.1, 0.3, 0.4),
    'roll': wave(0.0, 0.2, 0.9), 'pitch': wave(0.02, 0.15, 0.8, 2.0), 'yaw': wave(0.1, 0.2, 0.6),
}  # fmt: skip


def run(vehicle, entry, hold='continuous', attitude='euler', **changes):
    scenario = {'duration': 1.0, 'step': 0.01, 'controllers': {'one': entry}, 'setpoint': SIX}
    return reference.simulate(vehicle, scenario | changes, 'one', hold, attitude=attitude)
