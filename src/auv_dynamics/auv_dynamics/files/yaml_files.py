"""YAML and JSON files: read within bounds and checked against a JSON schema."""

import contextlib
import copy
import json
import math
import re
from collections.abc import Iterator
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from auv_dynamics.files.errors import InputError, first_line, reason, shorten
from auv_dynamics.files.nearest import meant, one_of

if TYPE_CHECKING:
    import jsonschema

MOST_ENTRIES = 100_000  # of a text, with its aliases written out
LONGEST_TEXT = 4 << 20  # characters
BEYOND = 1e300  # integers are infinite, as floats are beyond 1.8e308
FAST_LEVELS = 50  # below which one may say that these are too many


class _Loader(yaml.SafeLoader):
    """Scalars of YAML 1.2's core schema: `1e-3` is a number, `on` a word; a key stands once."""

    yaml_implicit_resolvers = {}  # noqa: RUF012  not PyYAML's: 1:30 is not 90, 010 not 8


class _FastLoader(getattr(yaml, 'CSafeLoader', yaml.SafeLoader)):  # type: ignore[misc]
    """The same by libyaml, in an eighth of the time; it says less of what is wrong."""

    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers


for _tag, _pattern, _first in (
    ('bool', r'true|True|TRUE|false|False|FALSE', 'tTfF'),
    ('null', r'~|null|Null|NULL|', ['~', 'n', 'N', '']),
    ('int', r'[-+]?(?:0|[1-9]\d*)', '-+0123456789'),
    ('float', r'[-+]?(?:\.\d+|(?:0|[1-9]\d*)(?:\.\d*)?)(?:[eE][-+]?\d+)?', '-+.0123456789'),
    ('float', r'[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)', '-+.'),
    ('merge', r'<<', '<'),
):
    _Loader.add_implicit_resolver(
        f'tag:yaml.org,2002:{_tag}', re.compile(f'^(?:{_pattern})$'), list(_first)
    )


def _unique_mapping(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[str, Any]:
    if not isinstance(node, yaml.MappingNode):
        raise yaml.constructor.ConstructorError(problem='no mapping', problem_mark=node.start_mark)
    seen: dict[str, Any] = {}
    for key_node, value_node in node.value:
        if key_node.tag == 'tag:yaml.org,2002:merge':
            mark = key_node.start_mark
            raise InputError(mark.name, f'line {mark.line + 1}', 'keys written out', 'merge key <<')
        key = loader.construct_object(key_node, deep=True)
        if not isinstance(key, str):
            mark = key_node.start_mark
            raise InputError(mark.name, f'line {mark.line + 1}', 'a word as key', key)
        if key in seen:
            mark = key_node.start_mark
            raise InputError(mark.name, key, 'each key once', f'again in line {mark.line + 1}')
        seen[key] = loader.construct_object(value_node, deep=True)
    return seen


def _bounded_int(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    value = loader.construct_yaml_int(node)
    return value if abs(value) < BEYOND else math.inf if value > 0 else -math.inf


for _each in (_Loader, _FastLoader):
    _each.add_constructor('tag:yaml.org,2002:map', _unique_mapping)
    _each.add_constructor('tag:yaml.org,2002:int', _bounded_int)


class _Dumper(yaml.SafeDumper):
    """Quotes what is no word to the loader here, such as 1e3, or to one of YAML 1.1, such as on."""


for _first, _entries in _Loader.yaml_implicit_resolvers.items():
    for _tag, _pattern in _entries:
        _Dumper.add_implicit_resolver(_tag, _pattern, [_first])


def yaml_text(data: Any, **options: Any) -> str:
    """YAML that reads back as it is; entries in the order of `data`, options as PyYAML's."""
    usual: dict[str, Any] = {'sort_keys': False, 'default_flow_style': None, 'width': 100}
    return yaml.dump(data, Dumper=_Dumper, **usual | options)


def parse_yaml(text: str, path: object, kind: str) -> dict[str, Any]:
    """Mapping in a YAML text; InputError, which names `path`, when there is none."""
    data = parse_any_yaml(text, path)
    if not isinstance(data, dict):
        raise InputError(path, '', f'a mapping with the keys of a {kind} file', data)
    return data


def parse_any_yaml(text: str, path: object) -> Any:
    """Contents of a YAML text; InputError, which names `path`, when it is none or too large."""
    if len(text) > LONGEST_TEXT:
        found = f'{len(text)} characters'
        raise InputError(path, '', f'YAML of at most {LONGEST_TEXT} characters', found)
    return copy.deepcopy(_parsed(text, str(path)))


@lru_cache(maxsize=8)  # a command reads its vehicle's file several times
def _parsed(text: str, path: str) -> Any:
    with contextlib.suppress(Exception):  # what is wrong is said below
        data = _FastLoader(text).get_single_data()
        if _is_small(data, FAST_LEVELS):
            return data
    try:
        loader = _Loader(text)
        loader.name = path
        data = loader.get_single_data()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f'line {mark.line + 1}, column {mark.column + 1}' if mark else ''
        problem = re.sub('^(but )?found ', '', error.problem or 'an error')
        raise InputError(path, where, 'valid YAML', problem) from None
    except InputError:
        raise
    except RecursionError:
        raise InputError(path, '', 'valid YAML', 'too many levels') from None
    except (
        yaml.YAMLError,
        ValueError,
        TypeError,
        LookupError,
        AttributeError,
        OverflowError,
    ) as error:
        # PyYAML's constructors of tagged scalars raise what their conversions raise
        raise InputError(path, '', 'valid YAML', first_line(error)) from None
    if not _is_small(data):
        expected = f'at most {MOST_ENTRIES} entries with all aliases written out'
        raise InputError(path, '', expected, 'more')
    return data


def _is_small(data: Any, levels: float = math.inf) -> bool:
    """Whether there are few entries; empty lists, of which a list may have many, are entries."""
    left, todo = MOST_ENTRIES, [iter((data,))]
    while todo:
        for value in todo[-1]:
            left -= 1
            if left < 0 or len(todo) > levels:
                return False
            if isinstance(value, dict | list | tuple):
                todo.append(iter(value.values() if isinstance(value, dict) else value))
                break
        else:
            todo.pop()
    return True


LARGEST = 1e100  # products of a few such numbers are still finite
LARGEST_FILE = 1 << 28  # bytes of a text file
PIECE = 1 << 22  # bytes that are read at once
MOST_NAMES = 1000  # of a folder, among which one may be meant
MOST_SOUND = 1000  # contents that are remembered
_SOUND = set[int]()  # hashes of what broke no schema


def read_text(path: Path, kind: str) -> str:
    """Text of a file; InputError when it is missing, a folder, unreadable or not UTF-8."""
    beside = ''
    try:
        data = b''
        with path.open('rb') as file:  # a device does not say how long it is
            while len(data) <= LARGEST_FILE and (piece := file.read(PIECE)):
                data += piece
        if len(data) <= LARGEST_FILE:
            return data.decode('utf-8-sig').replace('\r\n', '\n').replace('\r', '\n')
        found = f'more than {LARGEST_FILE} bytes'
    except FileNotFoundError:
        found, beside = 'no such file', meant(path.name, _names(path.parent))
    except UnicodeDecodeError as error:
        found = f'bytes that are not UTF-8 (offset {error.start})'
    except OSError as error:
        found = reason(error)
    except ValueError as error:  # NUL in the name
        found = str(error)
    raise InputError(path, '', f'a {kind} file{beside}', found)


def _names(folder: Path) -> list[str]:
    """Names in a folder, as far as a look at it is quick."""
    try:
        return [path.name for path in islice(folder.iterdir(), MOST_NAMES)]
    except OSError:
        return []


def read_yaml(path: Path, kind: str) -> dict[str, Any]:
    """Mapping in a YAML file; InputError when it cannot be read or is no mapping."""
    return parse_yaml(read_text(path, kind), path, kind)


@lru_cache
def schema(path: Path) -> dict[str, Any]:
    """Parse a JSON schema file, what it refers to in place of the references: far faster."""
    root = json.loads(path.read_text(encoding='utf-8'))

    def whole(node: Any) -> Any:
        if isinstance(node, list):
            return [whole(one) for one in node]
        if not isinstance(node, dict):
            return node
        if '$ref' in node:
            node = {**root['$defs'][node['$ref'].removeprefix('#/$defs/')], **node}
        return {key: whole(inner) for key, inner in node.items() if key != '$ref'}

    return whole(root)


def check(data: dict[str, Any], schema_path: Path, file: object) -> None:
    """Raise InputError for the first entry of `data` that breaks the schema or is not finite.

    Every node of our schemas has a `title` that says in words what is expected there.
    """
    contents = hash((schema_path, repr(data)))
    if contents not in _SOUND:  # a sweep asks a thousand times about one vehicle
        validate(data, schema(schema_path), file)
        if len(_SOUND) >= MOST_SOUND:
            _SOUND.clear()
        _SOUND.add(contents)


def validate(data: dict[str, Any], root: dict[str, Any], file: object) -> None:
    """`check` by a schema that has been read."""
    import jsonschema  # slow to load, and most nodes read no such file

    _check_finite(data, file)
    validator = jsonschema.Draft202012Validator(root)
    # unknown keys first (a misspelt key also leaves a missing one), else in the schema's order
    order = {'additionalProperties': 0, 'unevaluatedProperties': 0, 'required': 2}
    errors = sorted(validator.iter_errors(data), key=lambda error: order.get(error.validator, 1))
    if errors:
        raise _as_input_error(errors[0], root, file)


def dotted(path: Any) -> str:
    """Key path as a reader writes it: rigid_body.inertia[0][2]."""
    text = ''
    for part in path:
        text += f'[{part}]' if isinstance(part, int) else f'.{part}' if text else str(part)
    return text


def _as_input_error(
    error: 'jsonschema.ValidationError', root: dict[str, Any], file: object
) -> InputError:
    # of an alternative (6 numbers or 6x6) only an entry that is no number at all is named itself
    for inner in sorted(error.context or [], key=lambda e: -len(e.absolute_path)):
        deeper = len(inner.absolute_path) > len(error.absolute_path)
        listed = isinstance(inner.instance, list)
        if deeper and inner.validator == 'type' and not (listed or is_number(inner.instance)):
            error = inner
            break
    path = list(error.absolute_path)
    if error.validator == 'additionalProperties':
        known = list(error.schema.get('properties', {}))
        unknown = next(key for key in error.instance if key not in known)
        if len(known) == 1:
            return InputError(file, dotted(path), f'{known[0]} alone', f'{unknown} beside it')
        return InputError(file, dotted([*path, unknown]), one_of(unknown, known), 'an unknown key')
    if error.validator == 'required':
        missing = next(key for key in error.validator_value if key not in error.instance)
        title = error.schema.get('properties', {}).get(missing, {}).get('title', 'a value')
        return InputError(file, dotted([*path, missing]), title, 'nothing')
    value = error.instance
    found = _shape(value) if isinstance(value, list) else shorten(value)
    words = error.validator_value if error.validator == 'enum' else ()
    likely = meant(value, (word for word in words if isinstance(word, str)))
    return InputError(file, dotted(path), f'{_title(error, root)}{likely}', found)


def _title(error: 'jsonschema.ValidationError', root: dict[str, Any]) -> str:
    """Title of the innermost schema node on the way to the error that has one."""
    node: Any = root
    title = root.get('title', '')
    for part in error.absolute_schema_path:
        node = node[part]
        if isinstance(node, dict) and isinstance(node.get('title'), str):
            title = node['title']
    return title or error.message


def _shape(value: list[Any]) -> str:
    if all(map(is_number, value)):
        return f'{len(value)} numbers {shorten(value)}'
    if all(isinstance(v, list) for v in value):
        lengths = sorted({len(v) for v in value})
        if len(lengths) == 1:
            return f'{len(value)}x{lengths[0]} {shorten(value)}'
        return f'{len(value)} rows of {lengths[0]} to {lengths[-1]} entries'
    return shorten(value)


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from _leaves(entry, (*path, key))
    elif isinstance(value, list):
        for i, entry in enumerate(value):
            yield from _leaves(entry, (*path, i))
    else:
        yield path, value


def _check_finite(data: dict[str, Any], file: object) -> None:
    for path, value in _leaves(data):
        if isinstance(value, str) and any('\ud800' <= letter <= '\udfff' for letter in value):
            raise InputError(file, dotted(path), 'whole characters', value)
        if is_number(value) and not abs(value) <= LARGEST:
            huge = f', at most {LARGEST:g}' if abs(value) < float('inf') else ''
            expected = f'a finite number{huge}'
            raise InputError(file, dotted(path), expected, value)


def is_number(value: Any) -> bool:
    """Whether a value is a number: no text, even of digits, and no truth value."""
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def matrix6(value: Any) -> np.ndarray:
    """(6, 6) matrix of a scalar (times identity), six numbers (diagonal), 36 or 6x6."""
    array = np.asarray(value, float)
    if array.ndim == 0 or array.shape == (1,):
        return float(array.reshape(())) * np.eye(6)
    if array.shape == (6,):
        return np.diag(array)
    if array.shape in ((36,), (6, 6)):
        return array.reshape(6, 6).copy()
    raise ValueError(f'expected 1, 6 or 36 numbers, found shape {array.shape}')
