"""Scenario keys and ROS parameters, one from the other as the scenario's schema describes them.

A key of a mapping within a mapping is joined by a dot, a matrix is its 36 numbers, and a list of
mappings, the terms of a harmonic, becomes one list of numbers for each key of theirs.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import schema, validate

SCHEMA = Path(__file__).with_name('scenario.schema.json')
Node = Mapping[str, Any]  # of the schema
TYPES = {'boolean': bool, 'integer': int, 'number': float, 'string': str, 'array': list[float]}


class Parameter(NamedTuple):
    """A ROS parameter that stands for a key, or for a column of a list of mappings.

    Attributes
    ----------
    name : below the parameter's group
    kind : bool, int, float, str or list[float]
    text : title and description
    range : `at_least` and `at_most`, as far as there are such

    """

    name: str
    kind: Any
    text: str
    range: Mapping[str, Any]


def part(key: str) -> Node:
    """Schema of a key of a scenario; of an entry where the key has a list of them."""
    node = schema(SCHEMA)['properties'][key]
    return node.get('then', node).get('items', node)


def _properties(node: Node, kind: Any = None) -> dict[str, Node]:
    """Key -> schema of what may stand in a mapping, of one kind where there are several."""
    found = dict(node.get('properties') or node.get('else', {}).get('properties', {}))
    for branch in node.get('allOf', ()):
        if branch['if']['properties']['kind']['const'] == kind:
            found |= {k: v for k, v in branch['then']['properties'].items() if v is not True}
    return found


def _columns(node: Node) -> dict[str, Node]:
    """Key -> schema of the mappings that a list consists of; none where it is no such list."""
    return _properties(node.get('items', {}))


def _type(node: Node) -> Any:
    if 'enum' in node:
        return str if isinstance(node['enum'][0], str) else float
    options = [_type(option) for option in node.get('anyOf', ())]
    if options:
        return list[float] if list[float] in options else options[0]
    return TYPES[node['type']]


def parameters_of(node: Node, kind: Any = None) -> Iterator[Parameter]:
    """Every parameter of a mapping of the schema, of one `kind` where there are several."""
    for key, inner in _properties(node, kind).items():
        if columns := _columns(inner):
            for name, of in columns.items():
                yield Parameter(name, list[float], _said(name, of), {})
        elif inner_keys := list(parameters_of(inner)):
            yield from (one._replace(name=f'{key}.{one.name}') for one in inner_keys)
        else:
            bounds = {'at_least': 'minimum', 'at_most': 'maximum'}
            known = {name: float(inner[word]) for name, word in bounds.items() if word in inner}
            yield Parameter(key, _type(inner), _said(key, inner), known)


def _said(key: str, node: Node) -> str:
    words = (node[word] for word in ('title', 'description') if word in node)
    return f'{key}: {"; ".join(words)}'


def flattened(node: Node, spec: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters, name -> value, of a checked mapping that this node of the schema describes."""
    flat: dict[str, Any] = {}
    known = _properties(node, spec.get('kind'))
    in_columns = any(map(_columns, known.values()))  # then what stands beside them is written out
    for key, inner in known.items():
        value = spec.get(key, inner.get('default') if in_columns else None)
        if columns := _columns(inner):
            for name, of in columns.items() if value else ():
                flat[name] = [float(term.get(name, of.get('default'))) for term in value]
        elif value is not None and _properties(inner):
            below = flattened(inner, value)
            flat |= {f'{key}.{name}': number for name, number in below.items()}
        elif value is not None:
            kind = _type(inner)
            flat[key] = numbers(value) if kind == list[float] else kind(value)
    return flat


def numbers(value: Any) -> list[float]:
    """A number, a list or a matrix as a list: of one, as it is, row by row."""
    return [float(number) for number in np.ravel(value)]


def nested(node: Node, values: Mapping[str, Any], source: object, place: str) -> dict[str, Any]:
    """Invert `flattened`, and check what comes out.

    Parameters
    ----------
    node : of the schema
    values : name -> value, None or absent: not given
    source, place : file or node, and the name of the mapping in it, for errors

    Raises
    ------
    InputError : it is not what the schema describes

    """
    spec = _nested(node, values, source, place)
    try:
        if spec or 'kind' in _properties(node):
            validate(spec, dict(node), source)
    except InputError as error:
        key = f'{place}.{error.key}' if error.key else place
        raise InputError(source, key, error.expected, error.found) from None
    return spec


def _nested(node: Node, values: Mapping[str, Any], source: object, place: str) -> dict[str, Any]:
    spec: dict[str, Any] = {}
    for key, inner in _properties(node, values.get('kind')).items():
        value = values.get(key)
        if columns := _columns(inner):
            value = _terms(columns, values, source, place)
        elif _properties(inner):
            start = f'{key}.'
            below = {k.removeprefix(start): v for k, v in values.items() if k.startswith(start)}
            value = _nested(inner, below, source, f'{place}.{key}')
        elif isinstance(value, list):
            value = _shaped(value, inner)
        if value not in (None, '', [], {}):
            spec[key] = value
    return spec


def _terms(
    columns: Mapping[str, Node], values: Mapping[str, Any], source: object, place: str
) -> list[dict[str, float]]:
    lists = {name: list(values.get(name) or []) for name in columns}
    count = max(map(len, lists.values()))
    for name, of in columns.items():
        lists[name] = lists[name] or [of['default']] * count if 'default' in of else lists[name]
    if any(len(column) != count for column in lists.values()):
        lengths = ', '.join(f'{name} {len(column)}' for name, column in lists.items())
        expected = f'{", ".join(columns)} of equal length'
        raise InputError(source, place, expected, lengths)
    return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]


def _shaped(value: list[float], node: Node) -> Any:
    """Numbers as a scenario writes them: one, where it may stand alone, or a matrix in rows."""
    if len(value) == 1 and 'anyOf' in node:
        return value[0]
    return np.reshape(value, (6, 6)).tolist() if len(value) == 36 else value
