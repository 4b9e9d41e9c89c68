"""Many runs side by side: the table, the ranking, the figures that scale, the report."""

import csv
import json
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import yaml
from pyarrow import parquet

from auv_analysis import cli, load_scenario, simulate, summarize
from auv_analysis.comparison import figures, lines
from auv_analysis.comparison.entries import Entry, comparison_table
from auv_analysis.comparison.ranking import rank
from auv_analysis.measures import BY_NAME
from auv_analysis.report.sketching import sketch
from auv_analysis.summary import band_of

SETTLED = 'overall.velocity_error.settling_time'
SCENARIO = load_scenario('case1')
SHORT = replace(SCENARIO, data=SCENARIO.data | {'duration': 6.0})


def entry(name: str, scenario, controller: str) -> Entry:
    run = simulate(scenario, controller)
    names = run.scenario, run.vehicle.name, controller, run.law
    return Entry(name, *names, 'simulated now', summarize(run), sketch(run))


@pytest.fixture(scope='module')
def entries() -> list[Entry]:
    lauv = load_scenario('case1_lauv')
    lauv = replace(lauv, data=lauv.data | {'duration': 3.0})
    known = [(SHORT, 'gvc'), (SHORT, 'cl'), (lauv, 'gvc'), (lauv, 'cl')]
    found = [entry(f'{s.name}/{c}', s, c) for s, c in known]
    lost = Entry('lost', 'lost', 'lauv', 'cl', 'cl', 'simulated now', {}, None, 'it diverges')
    return [*found, lost]


@pytest.fixture(scope='module')
def table(entries):
    return comparison_table(entries)


def test_a_row_per_run_with_every_figure(entries, table) -> None:
    rows = table.to_pylist()
    assert [row['run'] for row in rows] == [e.name for e in entries]
    for row, known in zip(rows, entries, strict=True):
        if known.summary:
            assert row['effort.max.heave'] == known.summary['effort']['max'][2]
            assert row['samples'] == known.summary['samples']
    assert rows[-1]['failure'] == 'it diverges'
    assert {row['duration'] for row in rows} == {6.0, 3.0, None}
    assert rows[-1]['kinetic_energy.mean'] is None


def test_ranks_are_by_value_and_what_never_settles_is_last(entries, table) -> None:
    ranking = rank(table)
    assert 'lost' not in ranking.runs
    names = [m.name for m in ranking.measures]
    rows = {row['run']: row for row in table.to_pylist()}
    for j, measure in enumerate(ranking.measures):
        values = [rows[run][measure.name] for run in ranking.runs]
        known = [(value, r) for value, r in zip(values, ranking.ranks[:, j], strict=True)
                 if value is not None]  # fmt: skip
        assert [r for _, r in sorted(known)] == sorted(r for _, r in known)
    for run, settled in zip(ranking.runs, ranking.ranks[:, names.index(SETTLED)], strict=True):
        assert (rows[run][SETTLED] is None) == run.endswith('/cl')
        assert settled == 3.5 if run.endswith('/cl') else settled < 3
    assert list(ranking.mean_rank) == sorted(ranking.mean_rank)


def test_ratios_are_powers_of_two_of_the_median(table) -> None:
    ranking = rank(table)
    j = [m.name for m in ranking.measures].index('kinetic_energy.mean')
    assert np.nanmedian(2.0 ** ranking.ratios[:, j]) == pytest.approx(1.0, rel=0.5)
    expected = np.log2(ranking.values[:, j] / np.median(ranking.values[:, j]))
    np.testing.assert_allclose(ranking.ratios[:, j], expected)


def test_equal_runs_have_nothing_to_rank(entries) -> None:
    ranking = rank(comparison_table([entries[0], replace(entries[0], name='again')]))
    assert ranking.measures == []
    assert ranking.runs == ['case1/gvc', 'again']


def test_error_still_to_come_is_the_largest_ratio_from_then_on(entries) -> None:
    run = simulate(SHORT, 'cl')
    band = band_of(np.abs(run.nu_d).max(axis=0))
    ratio = (np.abs(run.nu_d - run.nu) / band).max(axis=1)
    rest = np.maximum.accumulate(ratio[::-1])[::-1]
    t, drawn = lines.still_to_come(entries[1].sketch)
    assert np.all(np.diff(drawn) <= 0)
    inside = t > 0
    exact = rest[np.searchsorted(run.t, t[inside] - 1e-9)]
    np.testing.assert_allclose(drawn[inside], exact, rtol=0.02)


def test_it_falls_below_one_where_the_run_settles(entries) -> None:
    for known in (entries[0], entries[2]):
        t, ratio = lines.still_to_come(known.sketch)
        settled = max(known.summary['velocity_error']['settling_time'])
        first = t[np.argmax(ratio <= 1.0)]
        assert first == pytest.approx(settled, abs=0.05)


def test_lines_are_told_apart() -> None:
    looks = [(look['color'], str(look['linestyle'])) for look in map(lines.look, range(8))]
    assert len({colour for colour, _ in looks}) == lines.MOST_LINES == 8


@pytest.mark.usefixtures('unrendered')
@pytest.mark.parametrize('copies', [1, 5])
def test_figures_scale_with_the_number_of_runs(entries, copies: int, tmp_path: Path) -> None:
    many = [replace(e, name=f'{e.name}_{i}', controller=f'{e.controller}_{i}')
            for i in range(copies) for e in entries]  # fmt: skip
    table = comparison_table(many)
    drawn = figures.draw(many, table, rank(table), tmp_path / 'figures')
    assert set(drawn) == {'ranking', 'errors', 'kinetic_energy', *figures.SIX}
    few = copies == 1
    assert ('falls below the dotted 1' in drawn['errors'].caption) is few
    assert ('Equal values share a rank' in drawn['ranking'].caption) is few
    assert ('powers of two' in drawn['ranking'].caption) is not few


def test_structural_zeros_are_told_from_what_is_zero(entries, table) -> None:
    always = figures.structural(table, 'coupling.delta_xi_max')
    assert always[0].tolist() == [False] * 4 + [True] * 2
    assert always[2].all()
    assert not always[4].any()
    assert not figures.structural(table, 'effort.rms').any()


# the command


@pytest.fixture
def scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Short scenarios of different durations, one of which diverges under cl."""
    monkeypatch.chdir(tmp_path)
    names = {'one': 0.4, 'two': 0.2, 'wild': 0.4}
    for name, duration in names.items():
        data = SCENARIO.data | {'name': name, 'duration': duration, 'vehicle': 'lauv'}
        data['controllers'] = dict(data['controllers'])
        if name == 'wild':
            data['controllers']['cl'] = data['controllers']['cl'] | {'k_D': 1e9}
        (tmp_path / f'{name}.yaml').write_text(yaml.safe_dump(data, sort_keys=False))
    return [f'{name}.yaml' for name in names]


@pytest.mark.usefixtures('unrendered')
def test_command_compares_scenarios_by_name(scenarios, capsys) -> None:
    cli.main(['analyze', *scenarios, '--json'])
    captured = capsys.readouterr()
    summaries = json.loads(captured.out)
    assert list(summaries) == ['one/gvc', 'one/cl', 'two/gvc', 'two/cl', 'wild/gvc', 'wild/cl']
    assert summaries['wild/cl'] is None
    assert summaries['one/gvc'] == summarize(simulate(load_scenario('one.yaml'), 'gvc'))
    out = Path('runs/analyze_one_two_wild')
    assert json.loads((out / 'summary.json').read_text()) == summaries
    rows = list(csv.DictReader((out / 'comparison.csv').open()))
    assert [row['run'] for row in rows] == list(summaries)
    assert float(rows[2]['duration']) == 0.2
    report = unescape((out / 'report.html').read_text(encoding='utf-8')).replace('\xa0', ' ')
    assert 'Durations differ: 0.4 s (3 runs) and 0.2 s (2 runs)' in report
    assert '1 of 6 runs diverged and have no figures: wild/cl.' in report
    assert 'lauv has a diagonal M: Upsilon = I, nothing is coupled by inertia.' in report
    assert any('wild/cl' in line and 'diverges' in line for line in captured.err.splitlines())


@pytest.mark.usefixtures('unrendered')
def test_every_number_of_the_report_is_in_the_table(scenarios) -> None:
    cli.main(['analyze', *scenarios])
    out = Path('runs/analyze_one_two_wild')
    table = parquet.read_table(out / 'comparison.parquet').to_pylist()
    numbers = parquet.read_table(out / 'numbers.parquet').to_pylist()
    assert len(numbers) > 200
    for number in numbers:
        file, _, place = number['source'].partition(':')
        name, _, row = place.removesuffix(']').rpartition('[')
        assert (file, table[int(row)][name]) == ('comparison.parquet', number['value'])
    assert {f'rank.{name}' for name in BY_NAME} & set(table[0])


def test_all_diverged_is_a_failure(scenarios, capsys, monkeypatch) -> None:
    from auv_analysis.comparison import compare
    from auv_analysis.simulation import DivergedError

    def diverge(*_):
        raise DivergedError('it diverges')

    monkeypatch.setattr(compare, 'open_source', diverge)
    with pytest.raises(SystemExit) as end:
        cli.main(['analyze', *scenarios])
    assert end.value.code == 1
    assert (
        capsys.readouterr().err.splitlines()[-1] == 'all of 6 runs failed, the first: it diverges'
    )
    assert not Path('runs').exists()


@pytest.mark.parametrize(
    ('line', 'words'),
    [
        ('sweep one.yaml', 'sweep: expected a sweep alone'),
        ('sweep --by speed', r'--by: expected one of kinetic_energy.mean'),
        ('one.yaml two.yaml --out taken', 'taken: --out: expected a new folder'),
        ('one.yaml gone.yaml', 'gone.yaml'),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(scenarios, line: str, words: str, capsys) -> None:
    for name in ('sweep', 'taken'):
        Path(name).mkdir()
        (Path(name) / 'sweep.json').write_text('{}')
    with pytest.raises(SystemExit) as end:
        cli.main(['analyze', *line.split()])
    lines_ = capsys.readouterr().err.splitlines()
    assert (end.value.code, len(lines_)) == (2, 1), lines_
    assert words in lines_[0]
