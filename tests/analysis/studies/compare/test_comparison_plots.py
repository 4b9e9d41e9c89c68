"""Plots and tables of a comparison: every run under its own name, every number under its own."""

from pathlib import Path

import numpy as np
import pytest
from helpers import artists
from helpers.artists import bars, heat_maps, levels, named, points, same
from helpers.made_runs import DOFS, SAMPLES, START, STEP, energies, made
from pyarrow import csv
from scipy.stats import rankdata

from auv_analysis import summarize
from auv_analysis.report.digest import digest
from auv_analysis.studies.compare import plots
from auv_analysis.studies.compare.ranking import Entry, comparison_table, rank, write_table
from auv_analysis.studies.compare.report import findings, overview, six_table

pytestmark = pytest.mark.usefixtures('approved')

NAMES = [f'{scenario}/{controller}' for scenario in 'abc' for controller in ('cl', 'gvc', 'pid')]


def entry(name: str, seed: int) -> Entry:
    scenario, law = name.split('/')
    run = made(law, {'pid': 'cl'}.get(law, law), seed, scenario=scenario, faults=())
    run.nu[:] *= 1.0 + seed
    run.tau[:] *= 1.0 + 0.3 * seed
    run.nu[150:] = run.nu_d[150:] + 1e-4 * seed  # settles, but for the third
    run.nu[-1] += 9.0 * (seed == 3)
    return Entry(name, scenario, 'v', law, law, 'made', summarize(run), digest(run))


@pytest.fixture(scope='module')
def many() -> list[Entry]:
    return [entry(name, seed) for seed, name in enumerate(NAMES, start=1)]


@pytest.fixture(scope='module')
def few(many) -> list[Entry]:
    return [*many[1:5], Entry('lost', 'a', 'v', 'cl', 'cl', 'made', {}, None, 'it diverges')]


def drawn_of(entries, folder: Path):
    table = comparison_table(entries)
    with artists.captured() as found:
        plots.draw(entries, table, rank(table), folder)
    return found, table


@pytest.fixture(scope='module')
def small(few, tmp_path_factory):
    return drawn_of(few, tmp_path_factory.mktemp('few'))


@pytest.fixture(scope='module')
def large(many, tmp_path_factory):
    return drawn_of(many, tmp_path_factory.mktemp('many'))


def test_energy_bars_are_shares_and_dots_are_means(small, few) -> None:
    figure = small[0]['kinetic_energy']
    left, right = figure.axes
    found = bars(left, figure.legends[0])
    assert list(found) == [rf'$\xi_{i + 1}$ {dof}' for i, dof in enumerate(DOFS)]
    (dots,) = [points(line) for line in artists.lines(right)]
    for place, one in enumerate(few):
        energy = one.summary['kinetic_energy'] if one.summary else None
        shares = energy['shares_percent'] if energy else [0.0] * 6
        for i, parts in enumerate(found.values()):
            ends = sum(shares[:i]), sum(shares[: i + 1])
            assert parts[place] == pytest.approx((place, *ends))
        mean = energy['mean'] if energy else np.nan
        assert (dots[0][place], dots[1][place]) == pytest.approx((mean, place), nan_ok=True)
    assert artists.ticks(left, 'y') == dict(enumerate(e.name for e in few))
    assert (left.get_xlabel(), right.get_xlabel()) == ('share (%)', 'mean kinetic energy (J)')
    assert left.get_ylim() == (len(few) - 0.5, -0.5)


def _ranks(table) -> tuple[list[str], dict[str, dict[str, float]]]:
    """Measures in the table -> run -> its rank, 1 the smallest; of runs that came to an end."""
    rows = [row for row in table.to_pylist() if not row['failure']]
    names = [
        n for n in table.column_names if n.startswith('overall.') or n == 'kinetic_energy.mean'
    ]
    found = {}
    for name in names:
        values = [np.inf if row[name] is None else row[name] for row in rows]
        ranks = rankdata(values)
        found[name] = {row['run']: float(r) for row, r in zip(rows, ranks, strict=True)}
    return [row['run'] for row in rows], found


def test_ranks_are_those_of_the_values_of_each_run(small) -> None:
    figures, table = small
    runs, ranks = _ranks(table)
    found = rank(table)
    assert len(found.measures) >= 14
    for run, mine in zip(found.runs, found.ranks, strict=True):
        assert mine.tolist() == [ranks[m.name][run] for m in found.measures]
    mean = {run: np.mean([ranks[m.name][run] for m in found.measures]) for run in runs}
    assert found.runs == sorted(runs, key=lambda run: mean[run])
    (shown,) = heat_maps(figures['ranking']).values()
    assert list(dict.fromkeys(run for run, _ in shown)) == found.runs


def test_many_runs_are_multiples_of_the_median(large) -> None:
    figures, table = large
    ((label, found),) = heat_maps(figures['ranking']).items()
    assert label == 'log2 of value / median of the runs'
    by_label = {m.label: m.name for m in rank(table).measures}
    rows = {row['run']: row for row in table.to_pylist()}
    for (run, measure), value in found.items():
        name = by_label[measure]
        known = [row[name] for row in rows.values() if row[name] is not None]
        own = rows[run][name]
        expected = np.nan if own is None else np.log2(own / np.median(known))
        assert value == pytest.approx(expected, nan_ok=True, abs=1e-9)
    assert len(found) == 9 * len(by_label)


def _to_come(one: Entry) -> tuple[np.ndarray, np.ndarray]:
    """Time since the start and the largest error to come, in multiples of its band."""
    run = made(one.law, one.law, NAMES.index(one.name) + 1)
    seed = NAMES.index(one.name) + 1
    run.nu[:] *= 1.0 + seed
    run.nu[150:] = run.nu_d[150:] + 1e-4 * seed
    run.nu[-1] += 9.0 * (seed == 3)
    band = np.maximum(0.02 * np.abs(run.nu_d).max(axis=0), 0.005)
    ratio = (np.abs(run.nu_d - run.nu) / band).max(axis=1)[1:]
    return run.t[1:] - START, np.array([ratio[k:].max() for k in range(SAMPLES - 1)])


def test_errors_still_to_come_are_those_of_their_runs(small, few) -> None:
    figure = small[0]['errors']
    panels = [axes for axes in figure.axes if axes.lines]
    assert [axes.get_title(loc='left') for axes in panels] == ['a', 'b']
    for axes in panels:
        shown = named(axes, figure.legends[0])
        mine = {
            e.controller: e for e in few if e.scenario == axes.get_title(loc='left') and e.digest
        }
        assert {label for label, curves in shown.items() if curves} == set(mine)
        for label, one in mine.items():
            (curve,) = shown[label]
            same(curve, *_to_come(one))
        assert levels(axes) == [1.0]
        assert (axes.get_xscale(), axes.get_yscale()) == ('log', 'log')
    assert figure.get_supxlabel() == '$t$ (s)'
    assert figure.get_supylabel() == 'error still to come / band'


def test_rows_of_colours_are_the_errors_to_come_of_their_runs(many, tmp_path) -> None:
    entries = [*many, *(entry(f'd/{name}', 20) for name in ('cl', 'gvc'))]
    spread = [Entry(e.name, f's{i}', 'v', f'c{i}', e.law, '', e.summary, e.digest)
              for i, e in enumerate(entries)]  # fmt: skip
    figure = plots.errors(spread)[0]
    axes = figure.axes[0]
    (mesh,) = axes.collections
    values = np.ma.filled(mesh.get_array(), np.nan).reshape(len(entries), -1)
    edges = mesh.get_coordinates()[:, 0, 1].tolist()
    assert edges == [row - 0.5 for row in range(len(entries) + 1)]
    times = np.geomspace(STEP, 12.0, values.shape[1])
    assert artists.ticks(axes, 'y') == dict(enumerate(e.name for e in entries))
    for row, one in zip(values, many, strict=False):
        t, ratio = _to_come(one)
        at = ratio[np.searchsorted(t, times - 1e-9)]
        expected = np.where(at >= 1.0, np.log10(at), np.nan)
        assert row == pytest.approx(expected, nan_ok=True)
    assert axes.get_xlabel() == '$t$ (s)'
    assert axes.get_xscale() == 'log'
    assert figure.axes[1].get_ylabel() == 'log10 of the error still to come / band'


def test_no_plot_is_without_an_oracle(small) -> None:
    assert set(small[0]) == {'ranking', 'errors', 'kinetic_energy'}


def test_the_overview_shows_each_measure_under_its_head(small, few) -> None:
    table = overview(small[1])
    heads = [(head.group, head.label, head.unit) for head in table.columns]
    assert heads[:7] == [('', name, unit) for name, unit in (
        ('run', ''), ('scenario', ''), ('vehicle', ''), ('controller', ''), ('law', ''),
        ('duration', 's'), ('step', 's'),
    )]  # fmt: skip
    wanted = {  # head -> of the summary
        ('kinetic energy', 'J'): lambda s: s['kinetic_energy']['mean'],
        ('settled', 's'): lambda s: _latest(s['velocity_error']['settling_time']),
    }
    for name, group, key, units in (
        ('RMS error', 'velocity_error', 'rms', ('m/s', 'rad/s')),
        ('RMS w', 'lumped_error', 'rms', ('N', 'N m')),
        ('RMS input', 'effort', 'rms', ('N', 'N m')),
    ):
        for half, (word, unit) in enumerate(zip(('linear', 'angular'), units, strict=True)):
            wanted[f'{name}, {word}', unit] = lambda s, g=group, k=key, h=half: np.linalg.norm(
                s[g][k][3 * h : 3 * h + 3]
            )
    for name, group, key, units in (
        ('error after 2 s', 'velocity_error', 'max_after_2s', ('m/s', 'rad/s')),
        ('Δξ', 'coupling', 'delta_xi_max', ('m/s', 'rad/s')),
        ('Δπ', 'coupling', 'delta_pi_max', ('N', 'N m')),
        ('peak input', 'effort', 'max', ('N', 'N m')),
    ):
        for half, (word, unit) in enumerate(zip(('linear', 'angular'), units, strict=True)):
            wanted[f'{name}, {word}', unit] = lambda s, g=group, k=key, h=half: max(
                s[g][k][3 * h : 3 * h + 3]
            )
    assert {(label, unit) for _, label, unit in heads[7:]} == set(wanted)
    for one, row in zip(few, table.rows, strict=True):
        words = [cell.text for cell in row[:5]]
        assert words == [one.name, one.scenario, one.vehicle, one.controller, one.law]
        if not one.summary:
            assert {cell.text for cell in row[5:]} == {'–'}
            continue
        assert [cell.value for cell in row[5:7]] == pytest.approx([12.0, STEP])
        for (_, label, unit), cell in zip(heads[7:], row[7:], strict=True):
            expected = wanted[label, unit](one.summary)
            assert cell.value == (None if expected is None else pytest.approx(expected))


def _latest(times):
    return None if None in times else max(times)


def test_tables_of_six_have_a_column_per_degree_of_freedom(small, few) -> None:
    table = six_table(small[1], 'effort.max')
    assert [(head.label, head.unit) for head in table.columns] == [
        ('run', ''), ('surge', 'N'), ('sway', 'N'), ('heave', 'N'), ('roll', 'N m'),
        ('pitch', 'N m'), ('yaw', 'N m'),
    ]  # fmt: skip
    assert table.caption == 'Largest magnitude of the input τ.'
    for family in ('effort.max', 'coupling.delta_pi_max', 'velocity_error.settling_time'):
        group, key = family.split('.')
        for one, row in zip(few[:-1], six_table(small[1], family).rows, strict=False):
            assert row[0].text == one.name
            assert [cell.value for cell in row[1:]] == one.summary[group][key]


def test_ranks_are_written_beside_their_runs(small, tmp_path: Path) -> None:
    table = small[1]
    write_table(table, rank(table), tmp_path)
    written = csv.read_csv(tmp_path / 'comparison.csv').to_pylist()
    _, ranks = _ranks(table)
    for measure in rank(table).measures:
        for row in written:
            assert row[f'rank.{measure.name}'] == ranks[measure.name].get(row['run'])


def _row(run: str, settled: float | None, **about) -> dict:
    usual = {'duration': 3.0, 'step': 0.1, 'failure': None}
    return {
        'run': run, 'overall.velocity_error.settling_time': settled,
        'overall.velocity_error.rms.linear': 1.0, **usual, **about,
    }  # fmt: skip


def test_runs_of_one_name_and_other_set_points_are_told_of(few) -> None:
    told = [sentence.text for sentence in findings(few, [])]
    assert told == [
        f'Not all 2 runs of {name} have the same set-point: only the name is the same.'
        for name in 'ab'
    ]


def said(*rows) -> list[str]:
    return [sentence.text for sentence in findings([], rows)]


def test_sentences_count_what_settles_differs_and_fails() -> None:
    a, b, c = _row('a', 2.5), _row('b', 1.25), _row('c', None)
    assert said(a, b, c) == [
        'In 2 of 3 runs all six velocity errors settle, the first b after 1.25 s, '
        'the last a after 2.50 s.'
    ]
    assert said(a, c) == ['In 1 of 2 runs all six velocity errors settle: a after 2.50 s.']
    assert said(c) == ['In none of 1 runs do all six velocity errors settle.']
    assert said(_row('x', None, **{'overall.velocity_error.rms.linear': None})) == []
    differing = said(a | {'duration': 5.0}, a, b | {'step': 0.2})[1]
    assert differing == (
        'Durations differ: 3 s (2 runs) and 5 s (1 runs); steps differ: 0.1 s (2 runs) and '
        '0.2 s (1 runs); means and root mean squares are those of each whole run.'
    )
    assert len(said(a | {'duration': 0.3}, a | {'duration': 3 * 0.1})) == 1, 'that is rounding'
    for many, end in ((6, '5 s (1 runs) and 6 s (1 runs); '), (7, '6 s (1 runs) and others; ')):
        text = said(*(a | {'duration': i + 1.0} for i in range(many)))[1]
        assert f'{end}means and root mean squares' in text
    failed = [_row(f'f{i}', None, failure='lost') for i in range(7)]
    assert said(a, failed[0])[1] == '1 of 2 runs failed and have no figures: f0.'
    assert said(a, *failed)[1].endswith(': f0, f1, f2, f3, f4, f5 and others.')
    assert '6 of 7 runs' in said(a, *failed[:6])[1]
    assert said(a, *failed[:6])[1].endswith('f4 and f5.')


def test_energies_of_made_runs_differ() -> None:
    """What the oracles rest on: no two columns are alike."""
    run = made('a', 'cl', 1)
    assert len(set(np.round(energies(run.nu).mean(axis=0), 6))) == 6


def test_without_set_points_no_error_is_drawn() -> None:
    figure, title, caption = plots.errors([])
    assert figure is None
    assert caption == f'{title}: without set-points there is none.'
