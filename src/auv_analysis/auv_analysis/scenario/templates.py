"""Commented templates of a vehicle, a scenario and a law of one's own, made of the shipped ones."""

import importlib.util
import json
import keyword
import re
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from auv_analysis.scenario.scaling import GAINS, SCALE, scaled_case1, scaled_gains
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_text, read_yaml, yaml_text
from auv_dynamics.plant.parameters import SCHEMA
from auv_dynamics.vehicle.vehicle_file import SCHEMA as VEHICLE_SCHEMA
from auv_dynamics.vehicle.vehicle_file import load_vehicle

WIDTH = 98  # columns of a comment
SHORT = 110  # columns of a value in one line


def annotated(data: Mapping[str, Any], root: Mapping[str, Any]) -> str:
    """YAML text with a comment above each key; what may be there as well is an option behind a #.

    An option is a line that begins with # and no blank: without the # it is part of the file.

    Parameters
    ----------
    data : contents of the file
    root : JSON schema, whose titles, descriptions, defaults and examples make comments and options

    """
    lines: list[str] = []
    for key, value in root['properties'].items():
        one = {name: data[name] for name in (key,) if name in data}
        lines += ['', *_Annotator(root).mapping(one, {'properties': {key: value}})]
    return ''.join(f'{line}\n' for line in lines)


class _Annotator:
    """Lines of text for values and the nodes of a schema that describe them."""

    def __init__(self, root: Mapping[str, Any]):
        self._root = root

    def mapping(self, data: Mapping[str, Any], node: Mapping[str, Any]) -> Iterator[str]:
        for key, inner in _properties(node).items():
            example = inner['examples'][0] if 'examples' in inner else inner.get('default')
            if key in data:
                yield from _comment(self._said(inner, data[key]))
                yield from self._entry(key, data[key], inner)
                yield from _more(data[key], example)
            elif example is not None:
                yield from _comment(self._said(inner, example))
                yield from (f'#{line}' for line in _lines(key, example))
            elif 'description' in inner:
                yield from _comment([f'{key}, absent here: {_annotated(inner)}'])

    def _entry(self, key: str, value: Any, node: Mapping[str, Any]) -> Iterator[str]:
        if isinstance(value, Mapping) and _properties(node):
            yield f'{key}:'
            yield from (f'  {line}' for line in self.mapping(value, node))
        else:
            yield from _lines(key, value)

    def _said(self, node: Mapping[str, Any], value: Any) -> Iterator[str]:
        """What a schema says of a value, and of the entries that it consists of."""
        follows = isinstance(value, Mapping) and _properties(node)  # a comment for each key
        if text := node.get('description') if follows else _annotated(node):
            yield text
        entries = node.get('then', node)
        entry = self._resolved(entries.get('items') or entries.get('additionalProperties'))
        for key, inner in _properties(entry).items():
            if isinstance(inner, Mapping) and 'enum' not in inner:
                yield f'- {key}: {_annotated(inner)}'
        for branch in entry.get('allOf', ()):
            kind = branch['if']['properties']['kind']['const']
            own = {k: v for k, v in _properties(branch['then']).items() if v is not True}
            keys = [f'{key}, {text}' if (text := _annotated(v)) else key for key, v in own.items()]
            yield f'- kind {kind}: {"; ".join(keys)}'

    def _resolved(self, node: Any) -> Mapping[str, Any]:
        if not isinstance(node, Mapping):
            return {}
        name = node.get('$ref', '').rpartition('/')[2]
        return {**self._root['$defs'].get(name, {}), **node}


def _properties(node: Mapping[str, Any]) -> Mapping[str, Any]:
    return node.get('properties') or node.get('else', {}).get('properties') or {}


def _annotated(node: Mapping[str, Any]) -> str:
    return '; '.join(node[part] for part in ('title', 'description') if part in node)


def _comment(texts: Any) -> Iterator[str]:
    for text in texts:
        yield from textwrap.wrap(text, WIDTH, initial_indent='# ', subsequent_indent='# ')


def _more(value: Any, example: Any) -> Iterator[str]:
    """Options for a list that is there: kinds that the example has and the list has not."""
    if not (isinstance(value, list) and isinstance(example, list)):
        return
    there = [entry.get('kind') for entry in value if isinstance(entry, Mapping)]
    for entry in example:
        if isinstance(entry, Mapping) and 'kind' in entry and entry['kind'] not in there:
            yield f'#  - {_flow(entry)}'


def _lines(key: str, value: Any) -> Iterator[str]:
    """A key and its value: in one line where that is short, else a line for each entry."""
    entries: Any = value.items() if isinstance(value, Mapping) else value
    nested = isinstance(value, list) and any(isinstance(v, list | Mapping) for v in value)
    named = isinstance(value, Mapping) and any(isinstance(v, Mapping) for v in value.values())
    if nested:
        yield f'{key}:'
        for entry in entries:
            yield from _block(f'  - {_flow(entry)}', [entry])
    elif named:
        yield f'{key}:'
        for name, entry in entries:
            yield from _block(f'  {name}: {_flow(entry)}', {name: entry})
    else:
        yield from _block(f'{key}: {_flow(value)}', {key: value}, '')


def _block(line: str, value: Any, indent: str = '  ') -> Iterator[str]:
    """A line, or where it is long the same value over several."""
    if len(line) <= SHORT:
        yield line
    else:
        text = yaml_text(value, width=SHORT)
        yield from textwrap.indent(text.rstrip(), indent).split('\n')


def _flow(value: Any) -> str:
    # in a list, which adds nothing else than its brackets
    return yaml_text([value], default_flow_style=True, width=10**6)[1:-2]


STARTING = 'bluerov2_heavy'  # has thrusters and M_RB apart from M_A, so that every option applies
OWN_LAW = 'own_law'
NAME = re.compile(r'[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}')
CLASS = re.compile(r'^class (\w+)\(', re.M)
OPTIONS = (
    'A line that begins with # and no blank is an option: take the # away to use it.',
    'Errors name file, key, expected and found.',
)


def checked_name(kind: str, text: str) -> str:
    """Name of what is to be made: of a file, for a law also of a module.

    Raises
    ------
    InputError : it cannot be one, or a module of that name is there already

    """
    name = text.removesuffix('.yaml').removesuffix('.py')
    if not NAME.fullmatch(name):
        raise InputError('NAME', '', 'a word without blanks or slashes', text)
    if kind == 'law':
        if not name.isidentifier() or keyword.iskeyword(name):
            raise InputError('NAME', '', 'the name of a Python module, such as my_law', text)
        if not Path(f'{name}.py').exists() and importlib.util.find_spec(name) is not None:
            raise InputError('NAME', '', 'a name that no Python module has', text)
    return name


def vehicle_files(name: str) -> dict[str, str]:
    """File name -> text of a vehicle of one's own, with the numbers of a shipped one."""
    data = read_yaml(shipped('vehicles', STARTING), 'vehicle')
    data |= {'name': name, 'source': f'the numbers of {STARTING}: say where yours come from'}
    about = (
        f'A vehicle of your own, with the numbers of {STARTING} to be replaced; SI units.',
        'Symbols of SNAME (1950) and Fossen: nu = (u, v, w, p, q, r) in surge, sway, heave,',
        'roll, pitch, yaw; M nu_dot + C(nu) nu + D(nu) nu + g(eta) = tau, M = M_RB + M_A.',
    )
    return {f'{name}.yaml': _text(data, VEHICLE_SCHEMA, about)}


def scenario_files(name: str, vehicle: str | None) -> dict[str, str]:
    """File name -> text of a scenario of one's own: case 1 scaled to a vehicle."""
    vehicle = vehicle or STARTING
    data = scaled_case1(vehicle) | {'name': name, 'vehicle': vehicle}
    data |= {'disturbance': [data['disturbance']], 'controllers': scaled_gains(vehicle)}
    first = "A scenario of your own: the paper's case 1, scaled to the vehicle; SI units."
    about = (first, *GAINS, 'Of the disturbance:', *SCALE)
    return {f'{name}.yaml': _text(data, SCHEMA, about)}


def law_files(name: str, vehicle: str | None) -> dict[str, str]:
    """File name -> text of a law of one's own and of a scenario that compares it."""
    path = shipped('laws', OWN_LAW)
    module = read_text(path.with_suffix('.py'), 'law')
    found = CLASS.search(module)
    own = ''.join(word.capitalize() for word in name.split('_'))
    shown = re.sub(rf'\b{found[1]}\b', own, module) if found else module
    data = read_yaml(path, 'scenario')
    data |= {'name': name} | ({'vehicle': vehicle} if vehicle else {})
    load_vehicle(data['vehicle'])
    for entry in data['controllers'].values():
        if entry['law'].startswith(f'{OWN_LAW}:'):
            entry['law'] = f'{name}:{own}'
    data['disturbance'] = [data['disturbance']]
    about = (f'Compares the law of {name}.py with a shipped one; SI units.',)
    return {f'{name}.py': shown, f'{name}.yaml': _text(data, SCHEMA, about)}


def _text(data: dict[str, Any], schema_path: Path, about: tuple[str, ...]) -> str:
    lines = [f'# yaml-language-server: $schema={schema_path.as_uri()}', '#']
    lines += [f'# {line}' for line in (*about, *OPTIONS)]
    as_written = json.loads(schema_path.read_text(encoding='utf-8'))  # references stay
    return '\n'.join(lines) + '\n' + annotated(data, as_written)
