"""Results: stored once, every view says the same, every pointer leads to the number shown."""

import io
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from helpers.report_pages import at
from rich.console import Console

from auv_analysis.metrics.quantities import Quantity, quantity
from auv_analysis.output.new_files import known
from auv_analysis.output.text import MISSING, Maths
from auv_analysis.report.results import (
    Column,
    Results,
    described,
    document_table,
    make_table,
    numbers_of,
    terminal,
    view_of_file,
)

ROWS = [
    {'controller': '<a>', 'effort.rms.surge': 1234.5, 'share': 0.25, 'verdict': 'good', 'n': 3},
    {'controller': 'b', 'effort.rms.surge': None, 'share': float('nan'), 'verdict': '', 'n': 12000},
]
SHOWN = {
    'controller': 'controller',
    'effort.rms.surge': Column(quantity('effort.rms.surge'), group='input'),
    'share': Column('share', scale=100.0, decimals=1, kind='verdict'),
    'n': 'count',
}


@pytest.fixture(name='results')
def results_fixture() -> Results:
    results = Results('study', {'seed': 7})
    results.add('draws', 'What was drawn.', ROWS, SHOWN)
    return results


def test_results_are_written_once_with_unknown_as_null(results: Results, tmp_path: Path) -> None:
    paths = results.write(tmp_path)
    assert [path.name for path in paths] == ['study.json', 'draws.parquet']
    document = json.loads(paths[0].read_text())
    assert document == {'seed': 7}
    table = parquet.read_table(paths[1])
    assert table.to_pylist()[0] == ROWS[0]
    assert table['share'].null_count == 1
    about = table.schema.field('effort.rms.surge').metadata
    assert about[b'unit'] == b'N'
    assert about[b'meaning'].startswith(b'root mean square')


def test_all_that_is_known_of_a_quantity_is_stored_beside_its_column() -> None:
    what = Quantity('s', 'J', 'energy', '(23)', 'what it holds')
    schema = make_table('t', 'All.', [{'E': 1.0}], {'E': what}).data.schema
    assert schema.field('E').metadata == {
        b'symbol': b's', b'unit': b'J', b'label': b'energy', b'equation': b'(23)',
        b'meaning': b'what it holds',
    }  # fmt: skip


def test_columns_are_stored_in_the_order_in_which_they_are_shown() -> None:
    table = make_table('t', 'All.', [{'c': 3, 'b': 2, 'a': None}], {'a': 'a', 'b': 'b'})
    assert table.data.column_names == ['a', 'b', 'c']
    assert [head.numeric for head in table.columns] == [True, True], 'unknown, but numbers'


def test_every_pointer_leads_to_the_number_that_is_shown(results: Results, tmp_path: Path) -> None:
    paths = results.write(tmp_path)
    table = parquet.read_table(paths[1]).to_pylist()
    shown = [*numbers_of(results.tables.values())]
    assert len(shown) == 4
    for row in shown:
        file, _, place = row['source'].partition(':')
        place, _, factor = place.partition('*')
        column, _, index = place.removesuffix(']').partition('[')
        assert file == 'draws.parquet'
        assert table[int(index)][column] * float(factor or 1) == row['value']


def test_a_share_is_shown_in_percent_with_its_verdict(results: Results) -> None:
    (first, second) = results.tables['draws'].rows
    assert (first[2].text, first[2].value, first[2].kind) == ('25.0', 25.0, 'good')
    assert first[3].text == '3'
    assert [cell.text for cell in second] == ['b', MISSING, MISSING, '12\u202f000']
    assert [head.unit for head in results.tables['draws'].columns] == ['', 'N', '%', '']


def test_the_terminal_shows_the_same_table(results: Results) -> None:
    table = results.tables['draws']
    console = Console(width=100, file=io.StringIO(), markup=False)
    console.print(terminal(table))
    printed = console.file.getvalue()
    assert '1\u202f234' in printed
    assert [line[0] for line in printed.splitlines()] == ['c', '<', 'b'], 'from the left edge'


LOOKS = {
    'name': 'what', 'note': Column('', look='below'), 'law': Column('law', look='maths'),
    'rated': Column('rated', look='badge'), 'is_so': 'so', 'several': 'several',
    'whole': Column('whole', look='plain'), 'none': 'none', 'far': described('far', 'it', 'm'),
    'bad': Column('far', group='not', kind='how'),
}  # fmt: skip
LOOKED = {
    'name': 'one', 'note': 'of x_d', 'law': 'k_D', 'rated': 'good', 'is_so': True,
    'several': [2.5, 4.0], 'whole': 1500.0, 'none': 0, 'far': 1234.5, 'bad': 0.0, 'how': 'bad',
}  # fmt: skip


def test_each_look_of_a_cell() -> None:
    table = make_table('t', 'T.', [LOOKED], LOOKS, anchor='at')
    ((first, law, rated, *words, whole, none, far, bad),) = table.rows
    assert (first.text, first.remark, first.anchor) == ('one', 'of x_d', 'at-one')
    assert [type(text) for text in (first.text, first.remark, law.text)] == [str, Maths, Maths]
    assert (rated.text, rated.kind) == ('good', 'badge')
    assert [cell.text for cell in words] == ['yes', '2.50, 4.00']
    assert [cell.text for cell in (whole, none, far, bad)] == ['1\u202f500', '0', '1\u202f234', '0']
    assert [cell.kind for cell in (whole, none, far, bad)] == ['', 'zero', '', 'bad']
    assert [head.meaning for head in table.meanings] == ['it']
    assert table.heads == [('', 8), ('not', 1)]
    plain = make_table('t', 'T.', [{'word': 'w', 'how': None}], {'word': Column('w', kind='how')})
    assert plain.rows[0][0].kind == '', 'not known'


def test_a_terminal_says_units_and_colours_verdicts() -> None:
    shown = terminal(make_table('t', 'T.', [LOOKED], LOOKS), title=True)
    assert shown.title == 'T.'
    assert terminal(make_table('t', 'T.', [LOOKED], LOOKS)).title is None
    assert [column.header for column in shown.columns][-2:] == ['far, m', 'not far']
    assert [column.justify for column in shown.columns] == ['left'] * 5 + ['right'] * 4
    assert [next(iter(c.cells)).style for c in shown.columns][-3:] == ['dim', '', 'red']
    good = terminal(make_table('t', 'T.', [LOOKED | {'how': 'good'}], LOOKS))
    assert next(iter(good.columns[-1].cells)).style == 'green'


def test_a_table_of_a_document_points_into_it() -> None:
    results = Results('study', {'a/b': {'c~': [1.0, 2.0]}, 'none': None})
    rows = [{'x': ('a/b', 'c~', 1), 'word': 'w'}, {'x': ('none', 'gone'), 'word': 'v'}]
    table = document_table(results, 't', 'T.', rows, {'x': 'x', 'word': 'word'}, stub=2)
    assert (table.name, table.caption) == ('t', 'T.')
    (row,) = numbers_of([table])
    assert (row['row'], row['value']) == ('2.00, w', 2.0)
    file, _, pointer = row['source'].partition(':')
    assert file == 'study.json'
    assert at(results.to_json(), pointer) == 2.0
    assert table.rows[1][0].text == MISSING


def test_a_view_of_a_file_points_to_the_rows_it_shows() -> None:
    table = view_of_file('t', 'T.', [(7, {'x': 1.5}), (3, {'x': 2.5})], {'x': 'x'}, 'f.parquet')
    assert (table.name, table.caption) == ('t', 'T.')
    assert [row['source'] for row in numbers_of([table])] == ['f.parquet:x[7]', 'f.parquet:x[3]']


def test_json_knows_no_infinity_and_no_array() -> None:
    found = known({'a': np.array([[1.0, np.nan]]), 'b': (float('inf'), 2), 'c': np.float64(3.0)})
    assert found == {'a': [[1.0, None]], 'b': [None, 2], 'c': 3.0}
