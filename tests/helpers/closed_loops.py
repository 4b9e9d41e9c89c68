"""Closed loops for tests: ours and the independent implementation's, of a changed scenario."""

from copy import deepcopy
from dataclasses import replace
from functools import cache

import herman_reference as reference
import numpy as np
import yaml

from auv_analysis import load_scenario, simulate
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}


def wave(offset: float, amplitude: float, omega: float, phase: float = 0.0) -> dict:
    return {'offset': offset, 'terms': [{'amplitude': amplitude, 'omega': omega, 'phase': phase}]}


SIX = {
    'surge': wave(0.3, 0.4, 0.5), 'sway': wave(-0.1, 0.2, 0.7, 1.0), 'heave': wave(0.1, 0.3, 0.4),
    'roll': wave(0.0, 0.2, 0.9), 'pitch': wave(0.02, 0.15, 0.8, 2.0), 'yaw': wave(0.1, 0.2, 0.6),
}  # fmt: skip
HARMONIC = {'kind': 'harmonic', 'sway': wave(25.0, 40.0, 0.8), 'pitch': wave(-8.0, 5.0, 1.5, 0.4)}
DENSE = 0.1 * np.ones((6, 6)) + np.diag([1.0, 1.1, 0.9, 1.2, 0.8, 1.0])
PER_AXIS = {'k_D': [8, 10, 12, 6, 9, 11], 'k_I': [1, 2, 3, 4, 5, 6],
            'Lambda': [0.5, 0.6, 0.7, 0.8, 0.9, 1], 'Gamma': [30, 40, 50, 60, 70, 80]}  # fmt: skip
FULL = {'k_D': (9.0 * DENSE).tolist(), 'k_I': (2.0 * DENSE).tolist(),
        'Lambda': (0.7 * DENSE).tolist(), 'Gamma': (40.0 * DENSE).tolist()}  # fmt: skip
TURNED = {'eta': [1.0, -2.0, 3.0, 0.4, -0.5, 2.5], 'nu': [0.4, -0.3, 0.2, 0.1, -0.2, 0.3]}


case = cache(load_scenario)


def file_of(vehicle: str) -> dict:
    return deepcopy(read(vehicle))


@cache
def read(vehicle: str) -> dict:
    return yaml.safe_load(shipped('vehicles', vehicle).read_text(encoding='utf-8'))


def pair(law, hold, vehicle, **changes):
    """(ours, theirs) of one controller of case1 with some of its entries replaced."""
    base = case(changes.pop('base', 'case1'))
    values = changes.pop('gains', None)
    data = base.data | {'duration': 0.3} | changes
    if values is not None:
        data['controllers'] = {law: values | {'law': law}}
    scenario = replace(base, vehicle=vehicle_from_dict(vehicle, 'vehicle.yaml'), data=data)
    return simulate(scenario, law, hold), reference.simulate(vehicle, data, law, hold)
