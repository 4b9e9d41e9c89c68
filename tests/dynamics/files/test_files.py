"""Files that are no YAML mapping: one line that names file, expected and found, never a traceback.

The reader is called directly here; `test_bad_files` goes through the command.
"""

import copy
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st

from auv_analysis import load_scenario
from auv_dynamics import load_vehicle
from auv_dynamics.files import yaml_files
from auv_dynamics.files.errors import (
    MARK,
    InputError,
    first_line,
    named_line,
    printable,
    reason,
    shorten,
)
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import (
    check,
    matrix6,
    parse_any_yaml,
    read_text,
    read_yaml,
    validate,
    yaml_text,
)
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

BOMB = 'a: &a [x, x, x, x, x, x, x, x, x]\n' + ''.join(
    f'{new}: &{new} [{", ".join([f"*{old}"] * 9)}]\n'
    for old, new in zip('abcde', 'bcdef', strict=True)
)
TEXTS = {  # what it is -> text, what the line must say was found
    'empty': ('', 'nothing'),
    'comment only': ('# nothing yet\n', 'nothing'),
    'scalar': ('hello\n', 'hello'),
    'list': ('- a\n- b\n', "['a', 'b']"),
    'unbalanced': ('name: [1, 2\nfoo: }\n', "','"),
    'unclosed quote': ('name: "x\n', 'end of stream'),
    'tab': ('name: x\n\tfoo: 1\n', 'line 2'),
    'NUL': ('name: a\0b\n', '#x0000'),
    'control character': ('name: a\x07b\n', '#x0007'),
    'doubled key': ('name: a\nname: b\n', 'line 2'),
    'doubled key below': ('rigid_body:\n  mass: 1\n  mass: 2\n', 'line 3'),
    'number as key': ('1: a\n', 'found 1'),
    'list as key': ('? [a]\n: b\n', "['a']"),
    'unknown alias': ('a: *b\n', "'b'"),
    'alias of itself': ('a: &a {b: *a}\n', 'recursive'),
    'merge key': ('base: &b {x: 1}\nfoo:\n  <<: *b\n', '<<'),
    'python tag': ('name: !!python/object/apply:os.getcwd []\n', 'python/object'),
    'tag of ours': ('name: !foo bar\n', '!foo'),
    'map tag on a scalar': ('name: !!map 5\n', ''),
    'map tag on a list': ('name: !!map [a]\n', ''),
    'bool tag on a word': ('name: !!bool perhaps\n', ''),
    'int tag on nothing': ('name: !!int ""\n', ''),
    'float tag on a word': ('name: !!float abc\n', ''),
    'timestamp tag on a word': ('name: !!timestamp abc\n', ''),
    'float tag on what is too large': (f'name: !!float "{":".join("1" * 400)}"\n', ''),
    'too many digits': (f'name: {"9" * 5000}\n', ''),
    'two documents': ('name: a\n---\nname: b\n', 'another document'),
    'other version': ('%YAML 9.9\n---\nname: x\n', 'version'),
    'deep list': ('[' * 700 + ']' * 700, ''),
    'deep mapping': ('{a: ' * 700 + '}' * 700, ''),
    'not UTF-8': ('name: café\n'.encode('latin-1'), 'UTF-8'),
    'UTF-16': ('name: x\n'.encode('utf-16'), 'UTF-8'),
    'binary': (bytes(range(256)), 'UTF-8'),
}  # fmt: skip
VALUES = [
    None, True, False, 0, -1, 1.5, 1e299, 1e200, 1e-300, float('nan'), float('inf'), 10**400,
    '', 'x', 'x' * 5000, '1', 'rexrov', '..', 'a\nb', [], [1], [1] * 6, [[1] * 6] * 6, [None] * 6,
    [[]], [{}], {}, {'x': 1}, {'file': 'x'}, {'kind': 'herman2018'}, [[1] * 3] * 3, [1e200] * 6,
]  # fmt: skip


def one_line(error: InputError, *words: str) -> None:
    text = str(error)
    assert len(text.splitlines()) == 1
    assert len(text) < 600
    for word in ('expected', 'found', *words):
        assert word in text


@pytest.mark.parametrize('name', TEXTS)
def test_text_that_is_no_mapping_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    path = tmp_path / 'odd.yaml'
    text, found = TEXTS[name]
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError) as caught:
        read_yaml(path, 'vehicle')
    one_line(caught.value, str(path), found)
    assert not re.search('found (but )?found', str(caught.value))


def test_alias_bomb_is_refused_for_what_it_is(tmp_path: Path) -> None:
    path = tmp_path / 'bomb.yaml'
    path.write_text(BOMB)  # half a million leaves out of 300 bytes; three lines more never end
    with pytest.raises(InputError, match=r': expected .*alias') as caught:
        load_vehicle(path)
    one_line(caught.value, str(path))


def test_plain_aliases_are_fine(tmp_path: Path) -> None:
    path = tmp_path / 'shared.yaml'
    path.write_text('a: &six [1, 2, 3, 4, 5, 6]\nb: *six\n')
    assert read_yaml(path, 'vehicle')['b'] == [1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize('tag', ['', '!!int '])
def test_integers_beyond_every_float_are_infinite(tag: str) -> None:
    read = parse_any_yaml(f'a: {tag}{"9" * 400}\nb: {tag}-{"9" * 400}\nc: {2**70}\n', 'a text')
    assert read == {'a': math.inf, 'b': -math.inf, 'c': 2**70}


def test_what_was_read_may_be_changed_and_is_read_anew() -> None:
    text = 'a: {b: [1]}\n'
    parse_any_yaml(text, 'a text')['a']['b'].append(2)
    assert parse_any_yaml(text, 'a text') == {'a': {'b': [1]}}


@pytest.mark.parametrize('text', ['1e-3', '1E+3', '-2.5e3', '.5e-1', '12e0', '+1.e2'])
def test_exponents_are_numbers(text: str, tmp_path: Path) -> None:
    path = tmp_path / 'number.yaml'
    path.write_text(f'step: {text}\n')
    assert read_yaml(path, 'scenario')['step'] == float(text)


@pytest.mark.parametrize(
    'word', ['1e3', '7e10', '1.5e-3', '12e0', 'on', 'null', '010', '1:30', '.5', 'x']
)
def test_what_is_written_reads_back(word: str) -> None:
    """As words here, and to readers of YAML 1.1."""
    data = {word: [word, 1e3, 1e-5, True, None], 'x': {word: word}}
    text = yaml_text(data)
    assert parse_any_yaml(text, 'a text') == data
    assert yaml.safe_load(text) == data


def test_half_a_character_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / 'half.yaml'
    text = shipped('vehicles', 'rexrov').read_text(encoding='utf-8')
    path.write_text(text.replace('name: rexrov', 'name: "gi\\uD800"'))
    with pytest.raises(InputError, match='name: expected whole characters') as caught:
        load_vehicle(path)
    one_line(caught.value, str(path))


@pytest.mark.parametrize('end', ['\n', '\r\n', '\r'])
def test_lines_end_as_on_any_system(end: str, tmp_path: Path) -> None:
    path = tmp_path / 'lines.yaml'
    path.write_bytes(end.join(['name: x', 'seed: 1', '']).encode())
    assert read_text(path, 'scenario') == 'name: x\nseed: 1\n'


def test_a_text_that_is_too_long_is_refused_before_it_is_read() -> None:
    with pytest.raises(InputError, match='YAML of at most 4194304 characters, found 4194305'):
        parse_any_yaml('#' * ((4 << 20) + 1), 'a text')


@pytest.mark.parametrize(('most', 'piece'), [(20, 4), (19, 19), (20, 64), (19, 64)])
def test_a_file_is_read_in_pieces_as_far_as_it_may_be_long(most, piece, tmp_path, monkeypatch):
    monkeypatch.setattr(yaml_files, 'LARGEST_FILE', most)
    monkeypatch.setattr(yaml_files, 'PIECE', piece)
    path = tmp_path / 'long.yaml'
    path.write_text('name: twenty letters')
    if most == 20:
        assert read_text(path, 'vehicle') == 'name: twenty letters'
    else:
        with pytest.raises(InputError, match=r'a vehicle file, found more than 19 bytes'):
            read_text(path, 'vehicle')


def test_entries_and_levels_are_counted(monkeypatch) -> None:
    monkeypatch.setattr(yaml_files, 'MOST_ENTRIES', 60)
    for entries in (58, 59):  # beside the list and what it is in
        text = f'{{few: [{", ".join(map(str, range(entries)))}]}}'
        if entries == 58:
            assert parse_any_yaml(text, 'f') == {'few': list(range(58))}
        else:
            with pytest.raises(InputError, match='at most 60 entries with all aliases'):
                parse_any_yaml(text, 'f')


def test_a_path_is_taken_as_it_is_and_a_bare_name_is_looked_up(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for path in ('a.yaml', 'a.yml', 'there/rexrov'):
        assert shipped('vehicles', path) == Path(path)
    known = shipped('vehicles', 'rexrov')
    assert (known.name, known.is_file()) == ('rexrov.yaml', True)
    (tmp_path / 'rexrov').touch()
    assert shipped('vehicles', 'rexrov') == Path('rexrov')


def test_what_was_found_is_shown_in_short() -> None:
    assert shorten([1234] * 10) == repr([1234] * 10), 'sixty characters'
    assert shorten([12345] * 10) == f'{[12345] * 10!r:.57}...'
    error = InputError('a\x1b[2J', 'key', 'less', 'm' * 201)
    assert error.found == f'{"m" * 197}...'
    assert str(error) == f'a\N{REPLACEMENT CHARACTER}[2J: key: expected less, found {error.found}'
    assert str(InputError('a', '', 'less', None)) == 'a: expected less, found nothing'
    words = ['rexrov', 'a: b/c', '1', 'end ', 'w' * 57, 'w' * 58]
    assert [shorten(word) for word in words] == [
        'rexrov', 'a: b/c', "'1'", "'end '", 'w' * 57, f"'{'w' * 26}...{'w' * 26}'"
    ]  # fmt: skip
    assert first_line(ValueError('a\nb')) == 'a'
    assert first_line(ValueError()) == 'ValueError'
    assert named_line(ValueError('a\nb')) == 'ValueError: a'
    signs = '\x07\u202e\ud800\ue000\u2028\u2029'
    assert printable(f'a{signs}\n\u00e9') == 'a' + len(signs) * MARK + '\n\u00e9'
    assert reason(OSError(13, 'Permission denied')) == 'permission denied'
    assert reason(OSError('Odd')) == 'odd'


NUMBER = {'title': 'a number', 'type': 'number'}
THREE = {'title': 'a file', 'type': 'object', 'required': ['a'], 'additionalProperties': False,
         'properties': dict.fromkeys('abc', NUMBER)}  # fmt: skip


@pytest.mark.parametrize(
    ('data', 'said'),
    [
        ({'b': 'x', 'd': 1}, 'd: expected one of a, b, c.*, found an unknown key'),
        ({'b': 'x'}, 'b: expected a number, found x'),
        ({'b': 1}, 'a: expected a number, found nothing'),
        ({'a': math.inf}, 'a: expected a finite number, found inf'),
        ({'a': 2e100}, r'a: expected a finite number, at most 1e\+100'),
        ({'a': [[1, 2, 3]] * 2}, r'a: expected a number, found 2x3 \['),
        ({'a': [[1], [1, 2, 3], [1, 2]]}, 'found 3 rows of 1 to 3 entries'),
    ],
)
def test_the_first_of_several_errors_is_what_explains_the_others(data: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        validate(data, THREE, 'f')
    validate({'a': 1e100}, THREE, 'f')
    nested = THREE | {'properties': {'c': THREE, 'a': NUMBER}}
    with pytest.raises(InputError, match='c: expected a file'):
        validate({'a': 'x', 'c': 1}, nested, 'f')
    with pytest.raises(InputError, match=r'c\.d: expected one of a, b, c'):
        validate({'a': 'x', 'c': {'a': 1, 'd': 1}}, nested, 'f')


def test_a_matrix_is_a_copy_of_its_own() -> None:
    given = np.arange(36.0).reshape(6, 6)
    assert not np.shares_memory(matrix6(given), given)
    for same in (given, given.ravel(), given.tolist()):
        np.testing.assert_array_equal(matrix6(same), given)
    for one in (3, [3.0]):
        np.testing.assert_array_equal(matrix6(one), 3.0 * np.eye(6))


def test_byte_order_mark_is_no_part_of_the_first_key(tmp_path: Path) -> None:
    path = tmp_path / 'windows.yaml'
    path.write_text('name: x\r\nseed: 1\r\n', encoding='utf-8-sig', newline='')
    assert read_yaml(path, 'scenario') == {'name': 'x', 'seed': 1}


def _place(kind: str, folder: Path) -> Path:
    path = folder / 'place.yaml'
    if kind == 'folder':
        path.mkdir()
    elif kind == 'broken link':
        path.symlink_to('gone.yaml')
    elif kind == 'link to itself':
        path.symlink_to('place.yaml')
    elif kind == 'long name':
        path = folder / ('n' * 300 + '.yaml')
    elif kind == 'long bare name':
        path = Path('n' * 5000)
    elif kind == 'NUL in the name':
        path = folder / 'a\0b.yaml'
    elif kind == 'below a file':
        path.write_text('')
        path /= 'x.yaml'
    return path


@pytest.mark.parametrize(
    'kind',
    ['missing', 'folder', 'broken link', 'link to itself', 'long name', 'long bare name',
     'NUL in the name', 'below a file'],
)  # fmt: skip
@pytest.mark.parametrize('load', [load_vehicle, load_scenario])
def test_path_that_is_no_file_is_refused(kind: str, load: Any, tmp_path: Path) -> None:
    path = _place(kind, tmp_path)
    with pytest.raises(InputError, match='expected a') as caught:
        load(path)
    assert len(str(caught.value).splitlines()) == 1


def _paths(value: Any, path: tuple = ()) -> Iterator[tuple]:
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for key, entry in entries:
        yield (*path, key)
        if isinstance(entry, dict | list):
            yield from _paths(entry, (*path, key))


def _load(kind: str, name: str) -> dict[str, Any]:
    return yaml.safe_load(shipped(kind, name).read_text(encoding='utf-8'))


FILES = [
    _load('vehicles', 'rexrov'),
    _load('vehicles', 'herman2018'),
    _load('scenarios', 'case1'),
]


@QUICK
@given(st.data())
@pytest.mark.parametrize('which', range(3))
def test_any_entry_replaced_by_anything_loads_or_is_refused(
    which: int, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    contents = copy.deepcopy(FILES[which])
    *parents, last = data.draw(st.sampled_from(list(_paths(contents))))
    place = contents
    for key in parents:
        place = place[key]
    place[last] = data.draw(st.sampled_from(VALUES))
    try:
        if 'rigid_body' in FILES[which]:
            vehicle_from_dict(contents, 'odd.yaml')
        else:
            path = tmp_path_factory.getbasetemp() / 'odd.yaml'
            path.write_text(yaml.safe_dump(contents))
            load_scenario(path)
    except InputError as error:
        one_line(error, 'odd.yaml')


@pytest.mark.parametrize('largest', [1e100, 1e150, 1e200, 1e299])
def test_absurd_centre_of_gravity_is_refused(largest: float) -> None:
    contents = copy.deepcopy(FILES[0])
    contents['rigid_body']['center_of_gravity'] = [largest, 0.0, 0.0]
    with pytest.raises(InputError) as caught:
        vehicle_from_dict(contents, 'odd.yaml')
    one_line(caught.value, 'odd.yaml')


def test_what_is_sound_is_so_by_one_schema(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was checked is remembered: by which schema, and nothing that was refused."""
    monkeypatch.setattr(yaml_files, 'MOST_SOUND', 2)
    monkeypatch.setattr(yaml_files, '_SOUND', remembered := set())
    paths = {}
    for kind in ('number', 'string'):
        entry = {'title': f'a {kind}', 'type': kind}
        paths[kind] = tmp_path / f'{kind}.json'
        paths[kind].write_text(json.dumps({'title': 'a file', 'properties': {'x': entry}}))
    check({'x': 1}, paths['number'], 'f')
    with pytest.raises(InputError, match='f: x: expected a number, found True'):
        check({'x': True}, paths['number'], 'f')
    for x in (1, '1', 2.0, '2', 3, 1, '1'):
        kind = 'string' if isinstance(x, str) else 'number'
        other = {'string': 'number', 'number': 'string'}[kind]
        for _ in range(2):
            check({'x': x}, paths[kind], 'f')
            with pytest.raises(InputError, match=f'f: x: expected a {other}, found'):
                check({'x': x}, paths[other], 'f')
            assert 0 < len(remembered) <= 2
