"""Values of a scenario and its vehicle addressed by dotted paths, and scenarios changed by them."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_analysis.scenario import Scenario, scenario_from
from auv_analysis.scenario_values import vehicle_path_of
from auv_dynamics.files import InputError, dotted, read_text, read_yaml

VEHICLE = 'vehicle'
KEY = r"(?:^|(?<=.)\.)(?:([^.\[\]'\s]+)|'([^']+)')"
PART = re.compile(rf'{KEY}|\[(0|[1-9]\d{{0,8}})\]')
GRAMMAR = 'keys and [indices], such as disturbance[0].sway.terms[1].amplitude'

Parts = tuple[str | int, ...]


def split(path: str) -> Parts:
    """Keys and indices of a dotted path.

    Parameters
    ----------
    path : such as `disturbance[1].added_mass`; a key with a dot in it stands in quotes:
        `controllers.'gvc.2'.k_D`

    Returns
    -------
    parts : such as ('disturbance', 1, 'added_mass')

    Raises
    ------
    InputError : it is no such path

    """
    parts: list[str | int] = []
    end = 0
    while end < len(path) or not parts:
        match = PART.match(path, end)
        if match is None or (match[3] and not parts):
            raise InputError('path', '', GRAMMAR, path)
        parts.append(int(match[3]) if match[3] else match[1] or match[2])
        end = match.end()
    return tuple(parts)


def changed(
    data: Mapping[str, Any], path: str, value: Any, file: object = 'path'
) -> dict[str, Any]:
    """Copy of nested mappings and lists with one value replaced; what is not on its way is shared.

    Parameters
    ----------
    data : contents of a scenario or vehicle file
    path : see `split`; a key that is absent is added: the file's schema says whether it may
    value : a number, text, list or mapping, of Python or of NumPy
    file : named in errors

    Returns
    -------
    changed : of the same shape

    Raises
    ------
    InputError : the path leads to an entry that a list does not have, or through a single value

    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    return _replaced(data, split(path), 0, value, file)


def _replaced(data: Any, parts: Parts, depth: int, value: Any, file: object) -> Any:
    if depth == len(parts):
        return value
    part = parts[depth]
    check_container(data, parts, depth, file)
    if isinstance(part, int):
        copy = list(data)
        copy[part] = _replaced(data[part], parts, depth + 1, value, file)
        return copy
    inner = data.get(part, {}) if depth + 1 < len(parts) else None
    return {**data, part: _replaced(inner, parts, depth + 1, value, file)}


def check_container(data: Any, parts: Parts, depth: int, file: object) -> None:
    """Refuse the part at `depth` where what it is looked up in is not of its kind."""
    part = parts[depth]
    if isinstance(part, int):
        if not isinstance(data, list):
            raise InputError(file, dotted(parts[:depth]), f'a list that has [{part}]', data)
        if part >= len(data):
            expected = f'an index below {len(data)}'
            raise InputError(file, dotted(parts[: depth + 1]), expected, str(part))
    elif not isinstance(data, Mapping):
        raise InputError(file, dotted(parts[:depth]), f'a mapping that has {part}', data)


def changed_scenario(scenario: Scenario, values: Mapping[str, Any]) -> Scenario:
    """Scenario with values replaced, checked as if it had been written so.

    Parameters
    ----------
    scenario : of `load_scenario`
    values : path -> value. `vehicle` replaces the vehicle, by a file's path (relative to the
        scenario), a shipped bare name or the contents of a vehicle file; `vehicle.*` replaces
        values of the vehicle file; all others those of the scenario. A mapping or list is
        replaced before what is in it.

    Returns
    -------
    changed : Scenario; of its attachments only `setpoint.csv` is kept

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    data = dict(scenario.data)
    vehicle, vehicle_path = scenario.vehicle_data, scenario.vehicle_path
    for path in sorted(values, key=lambda path: len(split(path))):
        value = values[path]
        if path == VEHICLE and isinstance(value, Mapping):
            vehicle = dict(value)
        elif path == VEHICLE:
            vehicle_path = vehicle_path_of(str(value), scenario.path)
            data, vehicle = {**data, VEHICLE: str(value)}, read_yaml(vehicle_path, 'vehicle')
        elif of_vehicle(path):
            vehicle = changed(vehicle, below_vehicle(path), value, vehicle_path)
        else:
            data = changed(data, path, value, scenario.path)
    texts = _from_file(data, scenario)
    return scenario_from(data, vehicle, scenario.path, vehicle_path, texts)


def _from_file(data: dict[str, Any], scenario: Scenario) -> dict[str, str]:
    """Text of the set-point's file, which may be another one now; its path is made absolute."""
    file = data['setpoint'].get('file') if isinstance(data['setpoint'], dict) else None
    if not isinstance(file, str):
        return {}
    if file == scenario.data['setpoint'].get('file'):
        return {'setpoint.csv': scenario.attachments['setpoint.csv']}
    csv = scenario.path.parent / file
    data['setpoint'] = {**data['setpoint'], 'file': str(csv.resolve())}
    return {'setpoint.csv': read_text(csv, 'CSV set-point')}


def of_vehicle(path: str) -> bool:
    """Whether a path leads into the vehicle file."""
    return path.startswith(f'{VEHICLE}.')


def below_vehicle(path: str) -> str:
    """Path within the vehicle file."""
    return path.removeprefix(f'{VEHICLE}.')
