"""CSV files with named columns, read as bags are."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.foreign_bags import SECOND, loaded, simulated
from helpers.foreign_logs import HEAD, HEADS, columns, text_of
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.csv_logs import Span, Table, column_spans
from auv_analysis.bag.foreign_messages import read_sources
from auv_analysis.bag.foreign_topics import read_mapping
from auv_analysis.bag.metadata import files_of
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError

ANGLES = dict(zip(('phi', 'theta', 'psi'), ('roll', 'pitch', 'yaw'), strict=True))
MAP: dict[str, Any] = {
    'frames': 'ned_fsd', 'stamp': {'field': 't [ms]', 'units': 'ms'}, 'vehicle': 'rexrov',
    'odometry': {'topic': 'dive', 'units': 'deg',
                 'fields': {**ANGLES, **{c: c for c in ('x', 'y', 'z', *'uvwpqr')}}},
    'wrench': {'topic': 'dive', 'fields': {c: c for c in 'XYZKMN'}}, 'step': 0.01,
}  # fmt: skip


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=1.0)


def times_and_speeds(path: Path, notes: list[str] | None = None) -> np.ndarray:
    with Table(path) as table:
        blocks = [*table.blocks([] if notes is None else notes)]
    return np.array([np.concatenate([block.column(name) for block in blocks]) for name in 'tu'])


def mapped(keys: dict[str, Any], folder: Path) -> Path:
    file = folder / 'map.yaml'
    file.write_text(yaml.safe_dump(keys))
    return file


@pytest.mark.parametrize('head', HEADS)
def test_a_file_with_all_columns(head, run, tmp_path) -> None:
    begin, separator, end = HEADS[head]
    path = tmp_path / 'dive.csv'
    path.write_bytes((begin + text_of(columns(run), separator, end)).encode())
    found = loaded(path, mapped(MAP, tmp_path))
    assert_allclose(found.t, run.t, atol=1e-9)
    assert_allclose(found.nu, run.nu, atol=1e-12)
    assert_allclose(found.eta, run.eta, atol=1e-12)
    assert_allclose(found.tau, run.tau, rtol=1e-12)
    assert 'dive: phi, theta, psi in deg, turned into rad' in found.notes
    assert not [note for note in found.notes if 'without stamp' in note]


def test_a_folder_of_files_each_with_its_time(run, tmp_path) -> None:
    rows, folder = columns(run), tmp_path / 'dive'
    folder.mkdir()
    head = ','.join(HEAD[:13])
    (folder / 'state.csv').write_text(f'{head}\n{text_of(rows[:, :13])}')
    force = np.column_stack([rows[:, 0] / 1e3, rows[:, 13:]])
    (folder / 'force.tsv').write_text('time\tX\tY\tZ\tK\tM\tN\n' + text_of(force, '\t'))
    keys = MAP | {
        'odometry': MAP['odometry'] | {'topic': 'state'},
        'wrench': MAP['wrench'] | {'topic': 'force', 'stamp': 'time'},
    }
    found = loaded(folder, mapped(keys, tmp_path))
    assert_allclose(found.nu, run.nu, atol=1e-12)
    assert_allclose(found.tau, run.tau, rtol=1e-12)
    assert files_of(folder) == [folder / 'force.tsv', folder / 'state.csv']
    assert survey(folder).types == {'force': 'csv', 'state': 'csv'}


def test_two_files_of_one_name_are_refused(tmp_path) -> None:
    for name in ('state.csv', 'state.tsv'):
        (tmp_path / name).write_text('t,u\n0,1\n')
    with pytest.raises(InputError, match=r'state: expected one CSV file of each name, found state'):
        survey(tmp_path)


def test_empty_cells_are_no_values(run, tmp_path) -> None:
    """Signals of several rates in one file: velocity every fourth line, rates in all others."""
    cells = [line.split(',') for line in text_of(columns(run)).splitlines()]
    for i, line in enumerate(cells):
        empty = range(10, 13) if i % 4 == 0 else range(7, 10)
        for k in empty:
            line[k] = ('', 'NaN', '-', 'n/a')[i % 4]
    path = tmp_path / 'dive.csv'
    path.write_text('\n'.join(','.join(line) for line in [HEAD, *cells]))
    fields = MAP['odometry']['fields']
    keys = {key: value for key, value in MAP.items() if key != 'odometry'}
    keys |= {
        'pose': MAP['odometry'] | {'fields': {c: fields[c] for c in ('x', 'y', 'z', *ANGLES)}},
        'twist': [{'topic': 'dive', 'fields': {c: c for c in 'uvw'}},
                  {'topic': 'dive', 'fields': {c: c for c in 'pqr'}}],
    }  # fmt: skip
    read = read_sources(path, read_mapping(None, keys), notes := [])
    assert_array_equal(read['twist[0]'].rows[:, :3], run.nu[::4, :3])
    others = np.arange(run.samples) % 4 > 0
    assert_array_equal(read['twist[1]'].rows[:, 3:], run.nu[others, 3:])
    assert_array_equal(read['twist[1]'].stamps, np.round(run.t[others] * 1e3 + 5e3) * 10**6)
    assert 'dive: 75 of 101 messages were left out' in '\n'.join(notes)


@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'utf-16'])
def test_decimals_with_a_comma(encoding, tmp_path) -> None:
    path = tmp_path / 'x.csv'
    path.write_text('t;u\n0,5;-1,25e-1\n1;2.5\n', encoding)
    assert_array_equal(times_and_speeds(path), [[0.5, 1.0], [-0.125, 2.5]])


def test_columns_have_counts_and_ranges(tmp_path) -> None:
    path = tmp_path / 'x.csv'
    lines = '0,auto,,1', '// pause', '1,auto,3,inf', '# dive', '2,hold,-4,2', '% end'
    path.write_text('\n'.join(['t,mode,u,v', *lines, '']))
    notes: list[str] = []
    with Table(path) as table:
        spans = column_spans(table, notes)
    assert spans == {'t': Span(3, 0, 2), 'u': Span(2, -4, 3), 'v': Span(2, 1, 2)}
    assert survey(path).counts == {'x': 3}


def test_words_for_nothing_are_no_number(tmp_path) -> None:
    path = tmp_path / 'x.csv'
    words = 'null', 'NA', ' None ', 'N/A', '-', 'NaN', ''
    path.write_text('\n'.join(['t,u', *(f'{i},{word}' for i, word in enumerate(words)), '9,3', '']))
    with Table(path) as table:
        assert column_spans(table, [])['u'] == Span(1, 3, 3)


def test_a_line_that_was_cut_off_is_left_out(tmp_path) -> None:
    path = tmp_path / 'x.csv'
    path.write_text('t,u,v\n0,1,2\n1,3')
    notes: list[str] = []
    assert_array_equal(times_and_speeds(path, notes), [[0], [1]])
    assert notes == ['x.csv: its last line is cut off, and left out']


@pytest.mark.parametrize(('text', 'line'), [
    ('', r'x.csv: line 0: expected a line with the names of the columns.*, found none'),
    ('# only\n', 'expected a line with the names'),
    ('1,2,3\n4,5,6\n', r'line 1: expected a line with the names.*found 1,2,3'),
    ('t,u,u\n0,1,2\n', r'line 1: expected each name once, found u'),
    ('t,,u\n0,1,2\n', 'line 1: expected a line with the names'),
    ('t,u,v\n0,1,2\n1,3\n2,3,4\n', r'x.csv: line 3: expected 3 cells, one per column, found 2'),
    ('t,u,v\n0,1,2\n# pause\n1,x y,4\n', r'line 4, column u: expected a number, or nothing, found'),
    ('t,u,v\n0,on,2\n1,3,4\n', r'line 2, column u: expected a number, or nothing, found on'),
    ('t,u,v\n0,-nan,2\n1,on,4\n', r'line 3, column u: expected a number, or nothing, found on'),
    ('t,u,v\n0,"1,2\n1,3,4\n', r'line 3: expected 3 cells'),
    ('t,u,w\n0,1,2\n', r'twist.fields.v: expected a path in its messages: t, u, w.*, found v$'),
    ('t,u,v\n', r'x: expected messages, found none'),
    (f't,u,v\n0,1,{"9" * (1 << 21)}\n', r'line 2: expected at most \d+ characters, found more'),
])  # fmt: skip
def test_files_that_cannot_be_read_are_refused_in_one_line(text, line, tmp_path) -> None:
    path = tmp_path / 'x.csv'
    path.write_text(text)
    keys = {'pose': {'topic': 'x', 'fields': {'z': 'u'}}, 'wrench': 'x', 'stamp': 't',
            'twist': {'topic': 'x', 'fields': {'u': 'u', 'v': 'v'}}}  # fmt: skip
    keys['wrench'] = {'topic': 'x', 'fields': {'X': 'u'}}
    with pytest.raises(InputError, match=line) as refusal:
        read_sources(path, read_mapping(None, keys), [])
    assert str(refusal.value).startswith(str(path))


def test_a_file_without_a_column_of_time_is_refused(run, tmp_path) -> None:
    path = tmp_path / 'dive.csv'
    path.write_text(HEADS['plain'][0] + text_of(columns(run)))
    keys = {key: value for key, value in MAP.items() if key != 'stamp'}
    with pytest.raises(InputError, match=r'odometry.stamp: expected the column with the time'):
        loaded(path, mapped(keys, tmp_path))


def test_stamps_may_be_fractions_of_seconds_since_an_epoch(tmp_path) -> None:
    path = tmp_path / 'x.csv'
    path.write_text('t,u\n1700000000.25,1\n,2\n1700000000.5,3\n')
    keys = {'pose': {'topic': 'x', 'fields': {'z': 'u'}}, 'stamp': 't',
            'twist': {'topic': 'x', 'fields': {'u': 'u'}},
            'wrench': {'topic': 'x', 'fields': {'X': 'u'}}}  # fmt: skip
    read = read_sources(path, read_mapping(None, keys), [])['twist']
    assert_array_equal(read.stamps, [1700000000 * SECOND + k * SECOND // 4 for k in (1, 2)])
    assert_array_equal(read.rows[:, 0], [1.0, 3.0])


def test_names_of_columns_may_have_dots_and_what_is_mapped_signs_and_numbers(tmp_path) -> None:
    path = tmp_path / 'x.csv'
    path.write_text('t,pos.x,pos.y,v\n0,1,2,3\n1,4,5,6\n')
    keys = {'pose': {'topic': 'x', 'fields': {'x': 'pos.x', 'y': 'pos.y'}}, 'stamp': 't',
            'twist': {'topic': 'x', 'fields': {'v': '-v', 'w': 0.25}}}  # fmt: skip
    read = read_sources(path, read_mapping(None, keys), [])
    assert_array_equal(read['pose'].rows[:, :2], [[1, 2], [4, 5]])
    assert_array_equal(read['twist'].rows[:, 1:3], [[-3, 0.25], [-6, 0.25]])


def test_a_long_table_is_read_in_parts_and_its_lines_are_known(tmp_path) -> None:
    """Parts of numbers alone, with an empty cell and with a text."""
    path, t = tmp_path / 'x.csv', np.arange(30_000)
    lines = [f'{i},{i / 8},run' if i % 7000 else f'{i},,"run, again"' for i in t]
    path.write_text('\n'.join(['t,u,mode', *lines, '']))
    assert_array_equal(times_and_speeds(path), [t, np.where(t % 7000, t / 8, np.nan)])
    with Table(path) as table:
        assert column_spans(table, []) == {
            't': Span(30_000, 0, 29_999),
            'u': Span(29_995, 0.125, 3749.875),
        }
    path.write_text('\n'.join(['t,u,mode', *lines[:20_000], '5,1e,run', *lines[20_000:], '']))
    with pytest.raises(InputError, match=r'line 20002, column u: expected a number, or nothing, f'):
        times_and_speeds(path)


def test_a_time_without_its_unit_is_refused_in_one_line(run, tmp_path) -> None:
    """Nanoseconds since 1970 that are read as seconds are times of no year."""
    path = tmp_path / 'dive.csv'
    path.write_text('t,u\n' + ''.join(f'{1_700_000_000_000_000_000 + k},0\n' for k in range(3)))
    keys = {
        'vehicle': 'rexrov',
        'frames': 'ned_fsd',
        'twist': {'topic': 'dive', 'stamp': 't', 'fields': {'u': 'u'}},
    }
    line = 'twist.stamp: expected times before the year 2116, in s, found none'
    with pytest.raises(InputError, match=line):
        read_sources(path, read_mapping(None, keys), [])
