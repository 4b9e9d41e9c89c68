"""What the schemas of scenario and vehicle files say of the value at a dotted path."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import jsonschema
import numpy as np

from auv_analysis.changes import (
    VEHICLE,
    Parts,
    below_vehicle,
    check_container,
    of_vehicle,
    split,
)
from auv_analysis.scenario import SCHEMA, Scenario
from auv_dynamics.files import InputError, dotted, schema
from auv_dynamics.nearest import one_of
from auv_dynamics.vehicle_file import SCHEMA as VEHICLE_SCHEMA

UNIT = re.compile(r'\(([^()]+)\)$')  # ends a title: 'a positive number (kg)'


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
            _nodes_of(scenario, path)


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
    for node in _nodes_of(scenario, path):
        if node.keys() & {'enum', 'const', 'multipleOf'} or node.get('type') == 'integer':
            return None
        if node.get('type') == 'number':
            least, most = node.get('minimum', -np.inf), node.get('maximum', np.inf)
            low = max(low, node.get('exclusiveMinimum', -np.inf), np.nextafter(least, -np.inf))
            high = min(high, node.get('exclusiveMaximum', np.inf), np.nextafter(most, np.inf))
    return float(low), float(high)


def _nodes_of(scenario: Scenario, path: str) -> list[dict[str, Any]]:
    """What the schemas say of the entry at a path; InputError where nothing can stand there."""
    if of_vehicle(path):
        root, data, file = schema(VEHICLE_SCHEMA), scenario.vehicle_data, scenario.vehicle_path
        return _nodes_at(root, data, split(below_vehicle(path)), file)
    return _nodes_at(schema(SCHEMA), scenario.data, split(path), scenario.path)


def _nodes_at(root: dict[str, Any], data: Any, parts: Parts, file: object) -> list[dict[str, Any]]:
    nodes = list(_applicable(root, root, data))
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
            below = [_property(node, part) for node in nodes]
            data = data.get(part)
        nodes = [node for inner in below for node in _applicable(inner, root, data)]
    return nodes


def _property(node: Mapping[str, Any], key: str) -> Any:
    return node.get('properties', {}).get(key, node.get('additionalProperties'))


def _applicable(node: Any, root: dict[str, Any], data: Any) -> Iterator[dict[str, Any]]:
    """Nodes of a schema that say something about `data`, references and conditions followed."""
    if not isinstance(node, dict):
        return
    yield node
    if '$ref' in node:
        yield from _applicable(root['$defs'][node['$ref'].rsplit('/', 1)[-1]], root, data)
    for inner in (*node.get('allOf', ()), *node.get('anyOf', ())):
        yield from _applicable(inner, root, data)
    if 'if' in node:
        holds = jsonschema.Draft202012Validator(node['if']).is_valid(data)
        yield from _applicable(node.get('then' if holds else 'else'), root, data)


def said_of(data: Any, vehicle: Any, path: str) -> tuple[str, str]:
    """Unit and description of the value at a path; '' what the schemas do not say.

    Parameters
    ----------
    data, vehicle : contents of a scenario file and of its vehicle file
    path : see `changed_scenario`

    """
    try:
        if of_vehicle(path):
            root, place = schema(VEHICLE_SCHEMA), split(below_vehicle(path))
            nodes = _nodes_at(root, vehicle, place, 'vehicle')
        else:
            nodes = _nodes_at(schema(SCHEMA), data, split(path), 'scenario')
    except (InputError, IndexError, KeyError, TypeError):
        return '', ''
    titles = [node['title'] for node in nodes if 'title' in node]
    units = [found[1] for found in map(UNIT.search, titles) if found]
    descriptions = [node['description'] for node in nodes if 'description' in node]
    return (units or [''])[0], (descriptions or [''])[0]
