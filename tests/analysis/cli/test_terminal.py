"""Summaries in a terminal of 80 columns: every figure in its place, and what is not known."""

import io
from argparse import Namespace
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from auv_analysis.cli import analyze
from auv_analysis.cli.scenario_runs import summary_tables
from auv_analysis.output.text import number
from auv_analysis.studies.compare import report as comparing
from auv_dynamics.vehicle import DOFS

COLUMNS = [
    ('velocity_error', 'rms'), ('velocity_error', 'max_after_2s'),
    ('velocity_error', 'settling_time'), ('lumped_error', 'rms'), ('lumped_error', 'max_after_2s'),
    ('effort', 'rms'), ('effort', 'max'),
]  # fmt: skip
COUPLINGS = [('coupling', 'delta_xi_max'), ('coupling', 'delta_pi_max')]
NO_ZEROS = {'delta_xi': [], 'delta_pi': []}


def summary(*, zeros: dict[str, list[str]] = NO_ZEROS, **changes: Any) -> dict[str, Any]:
    """A summary in which no two figures are equal; `velocity_error__rms=...` changes one."""
    numbers = iter(range(101, 1000))
    found: dict[str, Any] = {
        'law': 'gvc', 'source': 'bag', 'duration': 30.0, 'step': 0.01, 'notes': [],
        'velocity_error': {}, 'lumped_error': {}, 'effort': {},
        'settling': {'residual': [0.011, 0.021, 0.031, 0.041, 0.051, 0.061], 'dwell': 1.5},
        'coupling': {'structural_zeros': zeros},
        'kinetic_energy': {
            'mean': 402.45, 'mean_by_component': [next(numbers) / 10 for _ in DOFS],
            'shares_percent': [50.0, 25.0, 12.5, 6.25, 6.25, 0.0], 'window': [0.0, 10.0],
        },
    }  # fmt: skip
    for part, key in (*COLUMNS, *COUPLINGS):
        found[part][key] = [next(numbers) / 1000 for _ in DOFS]
    for place, value in changes.items():
        part, _, key = place.partition('__')
        found[part] = {**found[part], key: value} if key else value
    return found


def text_of(summaries: dict[str, dict[str, Any]], width: int = 80) -> str:
    console = Console(file=io.StringIO(), width=width)
    console.print(summary_tables(summaries))
    return console.file.getvalue()


def rows(text: str) -> list[list[list[str]]]:
    """Words of the lines that begin with a degree of freedom, table by table."""
    lines = [[word for word in line.split(' ') if word] for line in text.splitlines()]
    found = [line[1:] for line in lines if line and line[0] in DOFS]
    assert len(found) % 6 == 0
    return [found[i : i + 6] for i in range(0, len(found), 6)]


def test_every_figure_stands_in_its_row_and_column() -> None:
    made = summary()
    tracking, couplings = rows(text_of({'gvc': made}))
    for i, _ in enumerate(DOFS):
        assert tracking[i] == [number(made[part][key][i]) for part, key in COLUMNS]
        energy = made['kinetic_energy']
        expected = [number(made[part][key][i]) for part, key in COUPLINGS]
        expected += [number(energy['mean_by_component'][i])]
        assert couplings[i][:3] == expected
        assert couplings[i][3] == f'{energy["shares_percent"][i]:.2f}'


def test_units_window_and_set_up_are_said() -> None:
    text = text_of({'mine': summary()})
    lines = text.splitlines()
    assert lines[0].strip() == 'mine: law gvc, 30 s in steps of 0.01 s, by bag'
    heads = [' '.join(line.split()) for line in (*lines[1:4], *lines[10:13])]
    assert heads == [
        'error error settled w = f - F w = f - F tau tau',
        'rms max > 2 s rms max > 2 s rms max',
        'm,rad/s m,rad/s s N,N m N,N m N,N m N,N m',
        'delta_xi delta_pi energy share',
        'max max mean',
        'm,rad/s N,N m J %',
    ]
    assert 'not settled' not in text
    for words in ('m,rad/s', 'kinetic energy 402.45 J, mean over 0 to 10 s', 'max > 2 s'):
        assert words in text


@pytest.mark.parametrize(
    ('kind', 'name'), [('unexplained', 'F by (1)'), ('required_wrench', 'required')]
)
def test_what_was_estimated_has_a_table_of_its_own(kind: str, name: str) -> None:
    keys = 'mean', 'rms', 'max', 'error_rms'
    made = {key: [10.0 * i + k for i, _ in enumerate(DOFS)] for k, key in enumerate(keys, 1)}
    made['mean'][2] = -1234567.0  # of a ship; a column too wide
    text = text_of({'gvc': summary(**{kind: made})})
    assert ' '.join(text.splitlines()[19].split()) == ' '.join([name] * 4)
    assert text.splitlines()[20].split() == ['mean', 'rms', 'max', 'error']
    expected = [[number(made[key][i]) for key in keys] for i, _ in enumerate(DOFS)]
    assert rows(text)[2] == expected


def test_bars_are_as_long_as_the_shares() -> None:
    _, couplings = rows(text_of({'gvc': summary()}))
    lengths = [len(''.join(row[4:])) for row in couplings]
    assert lengths == [12, 6, 3, 2, 2, 0]  # of 24 columns; a half is drawn as one


def test_a_zero_of_the_structure_is_named_and_no_other() -> None:
    zeros = {'delta_xi': ['yaw'], 'delta_pi': ['surge', 'sway']}
    made = summary(zeros=zeros, coupling__delta_xi_max=[0.0] * 6)
    text = text_of({'gvc': made})
    _, couplings = rows(text)
    assert [row[0] for row in couplings] == ['0', '0', '0', '0', '0', 'zero']
    assert [row[1] == 'zero' for row in couplings] == [True, True, *[False] * 4]
    assert 'zero in every motion: delta_xi of yaw; delta_pi of surge and sway' in text
    assert 'in every motion' not in text_of({'gvc': summary()})


def test_what_is_not_known_is_a_dash() -> None:
    unknown: dict[str, Any] = dict.fromkeys((f'{part}__{key}' for part, key in COLUMNS[3:5]))
    energy = dict.fromkeys(('mean', 'mean_by_component', 'shares_percent'))
    made = summary(
        **unknown,
        velocity_error__max_after_2s=None,
        velocity_error__settling_time=[1.0, None, 2.0, None, 3.0, 4.0],
        kinetic_energy={**energy, 'window': [0.0, 10.0]},
    )
    text = text_of({'gvc': made, 'cl': summary()})
    tracking, couplings, _, _ = rows(text)
    for i, row in enumerate(tracking):
        assert row[1] == row[3] == row[4] == '–'
        assert (row[2] == '–') == (i in (1, 3))
        assert couplings[i][2:] == ['–', '–']
    assert 'sway (0.021 m/s) and roll (0.041 rad/s)' in ' '.join(text.split())
    assert 'None' not in text
    assert 'nan' not in text
    assert text.count('kinetic energy') == 1, 'of the other run only'
    assert text.splitlines()[-2].split() == ['gvc', '–', '–', '–']


def test_several_runs_are_compared_by_their_worst() -> None:
    worst = [0.1, 0.2, 0.5, 0.3, 0.4, 0.1]
    runs = {
        'one': summary(velocity_error__max_after_2s=worst),
        'two': summary(velocity_error__max_after_2s=worst[::-1]),
    }
    lines = [line.split() for line in text_of(runs).splitlines()[-2:]]
    settled = number(max(runs['one']['velocity_error']['settling_time']))
    assert lines[0] == ['one', '402.45', settled, '0.500', 'm/s', 'heave']
    assert lines[1] == ['two', '402.45', settled, '0.500', 'rad/s', 'roll']
    assert 'energy, J' not in text_of({'one': runs['one']})


def test_of_many_runs_the_comparison_alone_is_shown(tmp_path, monkeypatch, capsys) -> None:
    summaries = {'one': summary(), 'diverged': None, 'two': summary()}
    read, concluded = [SimpleNamespace(scenario='s')], lambda *_, **__: summaries
    monkeypatch.setattr(comparing, 'entries_of', lambda *_: read)
    monkeypatch.setattr(comparing, 'conclude_comparison', concluded)
    given = {'vehicle': None, 'out': tmp_path / 'out', 'overwrite': False, 'map': None}
    assert analyze._many([], Namespace(**given, no_report=True)) == summaries
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[:2] for line in lines[-2:]] == [['one', '402.45'], ['two', '402.45']]


def test_notes_and_names_are_shown_as_they_are() -> None:
    text = text_of({'[red]x[/red]': summary(notes=['dropped [bold] steps'])})
    assert text.startswith('[red]x[/red]: law')
    assert 'note: dropped [bold] steps' in text


@QUICK
@given(st.lists(st.floats(0, 1e8), min_size=6, max_size=6))
def test_whatever_the_numbers_eighty_columns_hold_them(values: list[float]) -> None:
    filled = {f'{part}__{key}': values for part, key in (*COLUMNS, *COUPLINGS)}
    text = text_of({'gvc': summary(**filled), 'cl': summary(**filled)})
    assert max(map(len, text.splitlines())) <= 80
    assert '…' not in text, 'nothing is cut off'
    for row, value in zip(rows(text)[0], values, strict=True):
        assert len(row) == len(COLUMNS)
        assert set(row) <= {number(value, digits) for digits in (3, 2, 1)}
