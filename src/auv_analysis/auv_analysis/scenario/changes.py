"""Dotted paths into a scenario and its vehicle: grammar, changes, what the schemas say."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from auv_analysis.scenario.scenario import Scenario, scenario_from, vehicle_path_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.files.yaml_files import (
    dotted,
    read_text,
    read_yaml,
    schema,
)
from auv_dynamics.plant.parameters import SCHEMA
from auv_dynamics.vehicle.vehicle_file import SCHEMA as VEHICLE_SCHEMA

VEHICLE = 'vehicle'
INSIDE = f'{VEHICLE}.'  # begins a path into the vehicle file
KEY = r"(?:^|(?<=.)\.)(?:([^.\[\]'\s]+)|'([^']+)')"
PART = re.compile(rf'{KEY}|\[(0|[1-9]\d{{0,8}})\]')
UNIT = re.compile(r'\(([^()]+)\)$')  # ends a title: 'a positive number (kg)'
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
        which = f'[0] or another index before {part}'
        expected = which if isinstance(data, list) else f'a mapping that has {part}'
        raise InputError(file, dotted(parts[:depth]), expected, data)


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
        elif path.startswith(INSIDE):
            vehicle = changed(vehicle, path.removeprefix(INSIDE), value, vehicle_path)
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


def check_paths(scenario: Scenario, paths: Iterable[str]) -> None:
    """Refuse paths at which nothing can stand, before any value is known.

    Parameters
    ----------
    scenario : of `load_scenario`
    paths : see `changed_scenario`

    Raises
    ------
    InputError : naming the file, the path, and the known keys with the nearest one

    """
    for path in paths:
        if path != VEHICLE:
            _nodes_in(scenario, path)


def bounds(scenario: Scenario, path: str) -> tuple[float, float] | None:
    """Open interval of the finite numbers that the schema lets stand at a path.

    Parameters
    ----------
    scenario : of `load_scenario`
    path : see `changed_scenario`

    Returns
    -------
    bounds : below and above every such number; None where the schema asks for more than bounds

    """
    low, high = -np.inf, np.inf
    for node in _nodes_in(scenario, path):
        if node.keys() & {'enum', 'const', 'multipleOf'} or node.get('type') == 'integer':
            return None
        if node.get('type') == 'number':
            least, most = node.get('minimum', -np.inf), node.get('maximum', np.inf)
            low = max(low, node.get('exclusiveMinimum', -np.inf), np.nextafter(least, -np.inf))
            high = min(high, node.get('exclusiveMaximum', np.inf), np.nextafter(most, np.inf))
    return float(low), float(high)


def _nodes_of(
    data: Any, vehicle: Any, path: str, file: object = 'scenario', vehicle_file: object = 'vehicle'
) -> list[dict[str, Any]]:
    """What the schemas say of the entry at a path; InputError where nothing can stand there."""
    if path.startswith(INSIDE):
        return _nodes_at(schema(VEHICLE_SCHEMA), vehicle, split(path)[1:], vehicle_file)
    return _nodes_at(schema(SCHEMA), data, split(path), file)


def _nodes_in(scenario: Scenario, path: str) -> list[dict[str, Any]]:
    files = scenario.path, scenario.vehicle_path
    return _nodes_of(scenario.data, scenario.vehicle_data, path, *files)


def _nodes_at(root: dict[str, Any], data: Any, parts: Parts, file: object) -> list[dict[str, Any]]:
    nodes = list(_applicable(root, data))
    for depth, part in enumerate(parts):
        if isinstance(part, int):
            check_container(data, parts, depth, file)
            below = [node['items'] for node in nodes if 'items' in node]
            data = data[part]
        else:
            data = {} if data is None else data  # absent, and the schema knows it
            check_container(data, parts, depth, file)
            known = dict.fromkeys(k for node in nodes for k in node.get('properties', ()))
            known |= dict.fromkeys(data)
            if part not in known:
                expected = one_of(part, known) if known else 'a single value'
                raise InputError(file, dotted(parts[: depth + 1]), expected, part)
            below = [
                node.get('properties', {}).get(part, node.get('additionalProperties'))
                for node in nodes
            ]
            data = data.get(part)
        nodes = [node for inner in below for node in _applicable(inner, data)]
    return nodes


def _applicable(node: Any, data: Any) -> Iterator[dict[str, Any]]:
    """Nodes of a schema that say something about `data`, conditions followed."""
    if not isinstance(node, dict):
        return
    yield node
    for inner in (*node.get('allOf', ()), *node.get('anyOf', ())):
        yield from _applicable(inner, data)
    if 'if' in node:
        import jsonschema  # slow to load

        holds = jsonschema.Draft202012Validator(node['if']).is_valid(data)
        yield from _applicable(node.get('then' if holds else 'else'), data)


def said_of(data: Any, vehicle: Any, path: str) -> tuple[str, str]:
    """Unit and description of the value at a path; '' what the schemas do not say.

    Parameters
    ----------
    data, vehicle : contents of a scenario file and of its vehicle file
    path : see `changed_scenario`

    """
    try:
        nodes = _nodes_of(data, vehicle, path)
    except (InputError, IndexError, KeyError, TypeError):
        return '', ''
    titles = [node['title'] for node in nodes if 'title' in node]
    units = [found[1] for found in map(UNIT.search, titles) if found]
    descriptions = [node['description'] for node in nodes if 'description' in node]
    return (units or [''])[0], (descriptions or [''])[0]
