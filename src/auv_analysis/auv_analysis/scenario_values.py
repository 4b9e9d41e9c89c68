"""A scenario's values: defaults filled in, times that fit together, the vehicle's file."""

import copy
import os
from pathlib import Path
from typing import Any

from auv_analysis.folder import NAMES, ROLLOUTS, STAGING
from auv_dynamics.config import shipped_by_name
from auv_dynamics.files import InputError

NANOSECONDS = 10**9
MOST_STEPS = 10_000_000  # some 10 GB of arrays


def resolved(data: dict[str, Any]) -> dict[str, Any]:
    """Copy of a checked scenario's contents with every default filled in."""
    data = copy.deepcopy(data)
    for key, value in (('format', 1), ('integrator', 'ode5'), ('seed', 0), ('initial', {})):
        data.setdefault(key, value)
    data['seed'] = int(data['seed'])
    data['duration'], data['step'] = float(data['duration']), float(data['step'])
    for key in ('eta', 'nu'):
        data['initial'][key] = [float(x) for x in data['initial'].get(key, [0.0] * 6)]
    disturbance = data.get('disturbance', [])
    data['disturbance'] = disturbance if isinstance(disturbance, list) else [disturbance]
    if data.get('faults') == []:
        del data['faults']
    return data


def check_names(data: dict[str, Any], path: Path) -> None:
    """Refuse a controller whose results would take the place of our own files."""
    for name in data['controllers']:
        if name in (*NAMES, STAGING, ROLLOUTS):
            expected = 'names that are not those of our own files'
            raise InputError(path, 'controllers', expected, name)


def check_time(data: dict[str, Any], path: Path) -> None:
    """Refuse a step that is no whole number of ns, and a duration that is no multiple of it."""
    step_ns = data['step'] * NANOSECONDS
    if round(step_ns) < 1 or abs(step_ns - round(step_ns)) > 1e-6 * max(1.0, step_ns * 1e-9):
        raise InputError(path, 'step', 'a whole number of nanoseconds', f'{data["step"]!r} s')
    steps = data['duration'] / data['step']
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-9 * steps:
        expected = f'a multiple of step ({data["step"]:g} s)'
        raise InputError(path, 'duration', expected, f'{data["duration"]!r} s')
    if steps > MOST_STEPS:
        raise InputError(path, 'duration', f'at most {MOST_STEPS} steps', f'{steps:.0f}')


def vehicle_path_of(vehicle: str, scenario: Path) -> Path:
    """Path of a vehicle as a scenario file names it: relative to it, absolute or a bare name."""
    relative = scenario.parent / vehicle
    is_path = Path(vehicle).suffix in ('.yaml', '.yml') or len(Path(vehicle).parts) != 1
    if os.path.isfile(relative) or is_path:
        return relative
    try:
        return shipped_by_name('vehicles', vehicle)
    except InputError as error:
        raise InputError(scenario, 'vehicle', error.expected, vehicle) from None
