"""Many runs side by side: the table, the ranking, the figures that scale, the report."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace as Made

import numpy as np
import pyarrow as pa
import pytest
from helpers.artists import angles
from pyarrow import csv, parquet

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.metrics.measures import MEASURES
from auv_analysis.metrics.settling import band_of
from auv_analysis.report.digest import digest
from auv_analysis.studies.compare import plots
from auv_analysis.studies.compare.ranking import Entry, comparison_table, rank, write_table

SETTLED = 'overall.velocity_error.settling_time'
SCENARIO = load_scenario('case1')
SHORT = replace(SCENARIO, data=SCENARIO.data | {'duration': 6.0})


def entry(name: str, scenario, controller: str) -> Entry:
    run = simulate(scenario, controller)
    names = run.scenario, run.vehicle.name, controller, run.law
    return Entry(name, *names, 'simulated now', summarize(run), digest(run))


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
    names = ['run', 'scenario', 'vehicle', 'controller', 'law', 'origin', 'hold', 'failure']
    assert table.column_names[:8] == names
    assert [row['hold'] for row in rows] == [e.digest and e.digest.hold for e in entries]
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
    mean = np.nanmean(ranking.ranks, axis=1).tolist()
    assert mean == sorted(mean)


def test_ranks_and_ratios_by_hand() -> None:
    known = {
        'kinetic_energy.mean': [8.0, 2.0, 4.0, 0.0, None],
        'overall.effort.rms.linear': [1.0, 3.0, 1.0, 2.0, 9.0],
        SETTLED: [None, 5.0, 3.0, None, None],  # of which the last has nothing to follow
        'overall.velocity_error.rms.linear': [1.0, 1.0, 1.0, 1.0, None],
    }
    table = pa.table({
        'run': [*'abcd', 'free', 'lost'],
        'failure': [None] * 5 + ['it diverges'],
        **{m.name: [*known.get(m.name, [7.0] * 5), None] for m in MEASURES},
    })  # fmt: skip
    found, nan = rank(table), np.nan
    assert list(found.runs) == ['c', 'd', 'b', 'a', 'free']  # of 5.5, 7.5, 8, 9, 15 thirds
    ranks, ratios = (
        {m.name: dict(zip(found.runs, column, strict=True))
         for m, column in zip(found.measures, columns.T, strict=True)}
        for columns in (found.ranks, found.ratios)
    )  # fmt: skip
    for name, expected in (
        ('kinetic_energy.mean', [4, 2, 3, 1, nan]), (SETTLED, [3.5, 2, 1, 3.5, nan]),
        ('overall.effort.rms.linear', [1.5, 4, 1.5, 3, 5]),
    ):  # fmt: skip
        of = ranks.pop(name)
        np.testing.assert_array_equal([of[run] for run in (*'abcd', 'free')], expected)
    assert not ranks
    of = ratios['kinetic_energy.mean']
    np.testing.assert_array_equal([of[r] for r in (*'abcd', 'free')], [1, -1, 0, nan, nan])


def test_the_table_that_is_written_has_each_rank_beside_its_run(table, tmp_path: Path) -> None:
    ranking = rank(table)
    write_table(table, ranking, tmp_path)
    for written in (parquet.read_table(tmp_path / 'comparison.parquet'),
                    csv.read_csv(tmp_path / 'comparison.csv')):  # fmt: skip
        rows = {row['run']: row for row in written.to_pylist()}
        for j, measure in enumerate(ranking.measures):
            ranks = {run: row[f'rank.{measure.name}'] for run, row in rows.items()}
            assert ranks.pop('lost') is None
            assert ranks == dict(zip(ranking.runs, ranking.ranks[:, j], strict=True))


def test_equal_runs_have_nothing_to_rank(entries) -> None:
    ranking = rank(comparison_table([entries[0], replace(entries[0], name='again')]))
    assert ranking.measures == []
    assert ranking.runs == ['case1/gvc', 'again']


def test_it_falls_below_one_where_the_run_settles(entries) -> None:
    for known in (entries[0], entries[2]):
        t, ratio = plots.still_to_come(known.digest)
        settled = max(known.summary['velocity_error']['settling_time'])
        first = t[np.argmax(ratio <= 1.0)]
        assert first == pytest.approx(settled, abs=0.05)


@pytest.mark.parametrize('unknown', [[], [1, 4]])
def test_what_is_still_to_come_is_the_largest_of_all_later_errors(unknown: list[int]) -> None:
    rng = np.random.default_rng(3)
    lines = [(np.sort(rng.choice(50, 7, replace=False)) * 1.0, rng.normal(size=7))
             for _ in range(6)]  # fmt: skip
    peak = np.arange(1.0, 7.0)
    for i in unknown:
        lines[i], peak[i] = (lines[i][0], np.full(7, np.nan)), np.nan
    run = Made(line=lambda signal, i, part: lines[i], part=lambda signal: Made(peak=peak))
    t, ratio = plots.still_to_come(run)
    assert list(t) == sorted({time for times, _ in lines for time in times})
    for now, found in zip(t, ratio, strict=True):
        later = [np.abs(error[times >= now]) / width
                 for (times, error), width in zip(lines, band_of(peak), strict=True)]  # fmt: skip
        assert found == np.nanmax([0.0, *np.concatenate(later)])


def test_a_failure_is_a_text_in_a_table_without_any(entries) -> None:
    assert comparison_table(entries[:1]).schema.field('failure').type == pa.string()


def test_lines_are_told_apart() -> None:
    looks = [(look['color'], str(look['linestyle'])) for look in map(plots.look, range(8))]
    assert len({colour for colour, _ in looks}) == plots.MOST_LINES == 8


@pytest.mark.usefixtures('unrendered')
@pytest.mark.parametrize('copies', [1, 5])
def test_figures_scale_with_the_number_of_runs(entries, copies: int, tmp_path: Path) -> None:
    many = [replace(e, name=f'{e.name}_{i}', controller=f'{e.controller}_{i}')
            for i in range(copies) for e in (*entries[:2], entries[-1])]  # fmt: skip
    table = comparison_table(many)
    drawn = plots.draw(many, table, rank(table), tmp_path / 'figures')
    assert set(drawn) == {'ranking', 'errors', 'kinetic_energy'}
    few = copies == 1
    assert ('falls below the dotted 1' in drawn['errors'].caption) is few
    assert 'powers of two' in drawn['ranking'].caption


def test_a_grid_of_panels_is_drawn_of_twelve_scenarios_at_most(entries) -> None:
    for count, shape in ((5, (2, 3)), (12, (3, 4)), (13, None)):
        many = [replace(entries[0], name=f's{i}/gvc', scenario=f's{i}') for i in range(count)]
        figure, _, caption = plots.errors(many)
        assert ('falls below the dotted 1' in caption) == (shape is not None)
        if shape:
            assert figure.axes[0].get_subplotspec().get_gridspec().get_geometry() == shape
    left = figure.axes[0].collections[0].get_array().compressed()
    assert 0.0 <= left.min() < np.log10(2.0), 'in colour down to the band'


def test_rows_last_from_the_first_sample_to_the_end_of_the_longest_run() -> None:
    def run(*times: float) -> Made:
        line, peak = (np.array(times), 0.005 * np.array([4.0, 2.0, 1.0])), Made(peak=np.zeros(6))
        return Made(knows_setpoint=True, line=lambda *_: line, part=lambda _: peak)

    runs = [run(0.2, 1.0, 4.0), run(0.1, 1.0, 2.0), run(0.2, 1.0, 8.0), *[run(0.2, 1, 3)] * 6]
    free = Entry('s/free', 's', 'v', 'cl', 'cl', '', {}, Made(knows_setpoint=False))
    nine = [Entry(f's/{k}', 's', 'v', 'cl', 'cl', '', {}, one) for k, one in enumerate(runs)]
    assert 'falls below the dotted 1' in plots.errors([free, *nine[:8]])[2]
    figure, _, caption = plots.errors([free, *nine])
    assert 'Each row is a run' in caption
    (mesh,) = figure.axes[0].collections
    x = mesh.get_coordinates()[0, :, 0]
    assert (x[0], x[-1]) == pytest.approx((0.1, 8.0))
    hidden = np.ma.getmaskarray(mesh.get_array()).reshape(9, -1)
    times = np.geomspace(0.1, 8.0, hidden.shape[1])
    np.testing.assert_array_equal(hidden[:4], times > np.array([[4.0], [2.0], [9.0], [3.0]]))


def test_a_line_ends_where_its_error_is_zero() -> None:
    run = simulate(SHORT, 'gvc')
    nu = np.where(run.t[:, None] > 3.0, run.nu_d, run.nu)
    one = replace(entry('case1/gvc', SHORT, 'gvc'), digest=digest(replace(run, nu=nu)))
    t, ratio = plots.errors([one])[0].axes[0].lines[0].get_data()
    assert t.max() == pytest.approx(3.0)
    assert ratio.min() > 0
    error = np.where(run.t[:, None] > 3.0, 1e-9, 1e9) * (run.nu_d - run.nu)
    one = replace(one, digest=digest(replace(run, nu=run.nu_d - error)))
    assert plots.errors([one])[0].axes[0].get_ylim() == (1e-3, 1e4)


def test_a_ranking_has_a_row_of_numbers_for_each_run(entries) -> None:
    many = [replace(entries[i % 2], name=f'{i}') for i in range(9)]
    figure, *_ = plots._ranking(rank(comparison_table(many)))
    assert angles(figure.axes[0]) == {90.0}
    numbers = [text.get_text() for text in figure.axes[0].texts]
    assert {len(number.partition('.')[2]) for number in numbers if number != '0'} == {1}


def test_equal_runs_are_not_ranked(entries) -> None:
    same = [replace(entries[0], name=f'{i}') for i in range(9)]
    figure, _, caption = plots._ranking(rank(comparison_table(same)))
    assert (figure, caption) == (None, 'Ranking: no measure differs between the runs.')


def test_colours_of_a_ranking_end_at_sixteen_times_the_median(entries) -> None:
    many = [replace(entries[i % 2], name=f'{i}') for i in range(9)]
    ranking = rank(comparison_table(many))
    largest = np.nanmax(np.abs(ranking.ratios))
    for widest, end in ((100.0, 4.0), (1.25, 2.0), (1e-6, 1.0)):
        far = replace(ranking, ratios=widest / largest * ranking.ratios)
        assert plots._ranking(far)[0].axes[0].images[0].get_clim() == (-end, end)


def test_runs_that_differ_in_nothing_have_no_measures_to_be_ranked_by(entries) -> None:
    ranking = rank(comparison_table([replace(entries[0], name=name) for name in ('a', 'b')]))
    assert (list(ranking.measures), ranking.ranks.shape) == ([], (2, 0))
