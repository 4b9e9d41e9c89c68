"""YAML that nobody has to trust: safe, bounded in size, with aliases written out and counted."""

import re
from typing import Any

import yaml

from auv_dynamics.refusal import InputError, first_line

MOST_ENTRIES = 100_000  # of a text, with its aliases written out
LONGEST_TEXT = 4 << 20  # characters


class _Loader(yaml.SafeLoader):
    """Scalars of YAML 1.2's core schema: `1e-3` is a number, `on` a word; a key stands once."""

    yaml_implicit_resolvers = {}  # noqa: RUF012  not PyYAML's: 1:30 is not 90, 010 not 8


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


def _unique_mapping(loader: _Loader, node: yaml.MappingNode) -> dict[str, Any]:
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


_Loader.add_constructor('tag:yaml.org,2002:map', _unique_mapping)


def parse_yaml(text: str, path: object, kind: str) -> dict[str, Any]:
    """Mapping in a YAML text; InputError, which names `path`, when there is none."""
    data = parse_any_yaml(text, path)
    if not isinstance(data, dict):
        raise InputError(path, '', f'a mapping with the keys of a {kind} file', data)
    return data


def parse_any_yaml(text: str, path: object) -> Any:
    """What a YAML text holds; InputError, which names `path`, when it is none or too large."""
    if len(text) > LONGEST_TEXT:
        found = f'{len(text)} characters'
        raise InputError(path, '', f'YAML of at most {LONGEST_TEXT} characters', found)
    try:
        loader = _Loader(text)
        loader.name = str(path)
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
    except (yaml.YAMLError, ValueError, TypeError, LookupError) as error:
        # PyYAML's constructors of tagged scalars raise what their conversions raise
        raise InputError(path, '', 'valid YAML', first_line(error)) from None
    if not _is_small(data):
        expected = f'at most {MOST_ENTRIES} entries with all aliases written out'
        raise InputError(path, '', expected, 'more')
    return data


def _is_small(data: Any) -> bool:
    """Whether there are few entries; empty lists, of which a list may have many, are entries."""
    left, todo = MOST_ENTRIES, [iter((data,))]
    while todo:
        for value in todo[-1]:
            left -= 1
            if left < 0:
                return False
            if isinstance(value, dict | list | tuple):
                todo.append(iter(value.values() if isinstance(value, dict) else value))
                break
        else:
            todo.pop()
    return True
