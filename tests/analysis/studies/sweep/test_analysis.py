"""What is found in the rows of a sweep, where the figures are known functions of what varies."""

import numpy as np
import pytest
from helpers.made_sweeps import DAMPING, ENERGY, K_D, SETTLED, SIMPLE, make_sweep, rows
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import f_oneway, rankdata, spearmanr

from auv_analysis.report.plots import distribution, new_figure
from auv_analysis.studies.sweep.analysis import Analysis, analysed, explained, influence
from auv_analysis.studies.sweep.dataset import by_group, open_sweep
from auv_analysis.studies.sweep.quantiles import (
    Ordered,
    ordered,
    quantiles,
    spread,
    thinned,
    varying,
)
from auv_dynamics.vehicle import DOFS


def test_figures_that_never_differ_are_named_not_analysed(results: Analysis) -> None:
    assert [m.name for m in results.measures] == [ENERGY, SETTLED, 'overall.effort.max.angular']
    assert results.fixed['overall.effort.rms.linear'] == pytest.approx(np.sqrt(3))


def test_whether_a_row_settles_is_a_figure_too(results: Analysis) -> None:
    (row,) = rows(results, 'influence', figure=SETTLED, controller='gvc', path=K_D)
    assert row['explained_percent'] > 80
    assert row['spearman'] < -0.8, 'a larger gain settles, and what does not is late'


def test_what_matters_is_found_rising_or_not(results: Analysis) -> None:
    (energy,) = rows(results, 'influence', figure=ENERGY, controller='gvc', path=K_D)
    assert energy['spearman'] == pytest.approx(1.0)
    assert energy['explained_percent'] > 99
    (bent,) = rows(results, 'influence', figure='overall.effort.max.angular', controller='gvc',
                   path=DAMPING)  # fmt: skip
    assert abs(bent['spearman']) < 0.15
    assert bent['explained_percent'] > 95
    (none,) = rows(results, 'influence', figure=ENERGY, controller='gvc', path='integrator')
    assert (none['spearman'], none['explained_percent']) == (None, 0.0)
    assert {v.path for v in results.pair} == {K_D, DAMPING}


def test_a_path_of_another_controller_has_no_say(results: Analysis) -> None:
    paths = {row['path'] for row in rows(results, 'influence', controller='gvc')}
    assert 'controllers.cl.k_I' not in paths
    assert 'controllers.cl.k_I' in {r['path'] for r in rows(results, 'influence', controller='cl')}


def test_spearman_is_that_of_scipy(results: Analysis) -> None:
    varied = next(v for v in results.factors if v.path == DAMPING)
    mine = results.sweep.finished['cl']
    (row,) = rows(results, 'influence', figure=ENERGY, controller='cl', path=DAMPING)
    expected = spearmanr(varied.numbers[mine], results.values[ENERGY][mine]).statistic
    assert row['spearman'] == pytest.approx(expected)


def test_groups_along_a_path_hold_its_quantiles(results: Analysis) -> None:
    found = rows(results, 'dependence', figure=ENERGY, controller='gvc', path=K_D)
    assert sum(row['rows'] for row in found) == 800
    assert [row['from'] for row in found] == sorted(row['from'] for row in found)
    for row in found:
        assert row['from'] ** 2 <= row['smallest'] <= row['median'] <= row['to'] ** 2
        assert row['median'] == pytest.approx(row['middle'] ** 2, rel=0.05)


def test_controllers_in_the_same_rollouts(results: Analysis) -> None:
    (row,) = rows(results, 'paired', figure=ENERGY)
    assert (row['controller'], row['other'], row['rollouts']) == ('gvc', 'cl', 800)
    assert (row['smaller_percent'], row['equal_percent']) == (100.0, 0.0)
    assert (row['ratio'], row['effect']) == (pytest.approx(1 / 1.5), -1.0)
    (same,) = rows(results, 'paired', figure='overall.effort.max.angular')
    assert same['equal_percent'] == 100.0


def test_how_often_either_controller_is_the_smaller(tmp_path) -> None:
    sizes = {'gvc': np.array([1.0, 1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0]), 'cl': 2.0 * np.ones(8)}
    made = make_sweep(
        tmp_path, SIMPLE, lambda controller, _, index: {ENERGY: sizes[controller][index % 8]}
    )
    (row,) = rows(analysed(open_sweep(made)), 'paired', figure=ENERGY)
    parts = (row['smaller_percent'], row['equal_percent'], row['larger_percent'])
    assert parts == (50.0, 12.5, 37.5)


def test_two_paths_together(results: Analysis) -> None:
    cells = rows(results, 'together', figure=ENERGY, controller='gvc')
    assert sum(cell['rows'] for cell in cells) == 800
    first = {cell['value'] for cell in cells}
    assert len(first) <= 10
    assert all(cell['median'] is None or 1 <= cell['median'] <= 9 for cell in cells)
    settled = {cell['median'] for cell in rows(results, 'together', figure=SETTLED)}
    assert settled == {1.0, None}, 'half of a cell never settles: no time says when'


def test_rows_that_settle_in_half(results: Analysis) -> None:
    name = 'velocity_error.settling_time.heave'
    (row,) = rows(results, 'quantiles', figure=name, controller='gvc')
    share = np.mean(results.factors[0].numbers[results.sweep.finished['gvc']] > 2.0)
    assert (row['rows'], row['known'] / row['rows']) == (800, pytest.approx(share))
    assert row['high'] is None, 'of a time, what does not exist is late'
    assert row['largest'] == 1.0


def test_best_rows_are_the_smallest(results: Analysis) -> None:
    found = analysed(results.sweep, ENERGY).tables['best']
    mine = [row for row in found if row['controller'] == 'cl']
    assert [row['rank'] for row in mine] == list(range(1, 11))
    assert mine[0][ENERGY] == np.nanmin(results.values[ENERGY][results.sweep.finished['cl']])
    assert mine[0][ENERGY] == pytest.approx(1.5 * mine[0][K_D] ** 2)
    energies = [row[ENERGY] for row in mine]
    assert energies == sorted(energies)
    table = results.sweep.table(['index', 'seed', K_D, DAMPING]).to_pylist()
    for row in mine:
        given = next(r for r in table if r['index'] == row['rollout'])
        assert {key: row[key] for key in ('seed', K_D, DAMPING)} == {
            key: given[key] for key in ('seed', K_D, DAMPING)
        }


def test_what_varies_says_its_unit(results: Analysis) -> None:
    said = {v.path: (v.unit, v.meaning) for v in results.factors}
    assert 'velocity gain' in said[K_D][1]
    assert [v.labels for v in results.factors if v.path == 'integrator'] == [['ode5', 'rk4']]


# the parts


@QUICK
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_explained_share_is_that_of_the_f_test(seed, groups) -> None:
    """1 - MS_within / MS_total, which F = MS_between / MS_within gives another way."""
    rng = np.random.default_rng(seed)
    codes = np.concatenate([np.arange(groups), rng.integers(0, groups, 60)])
    ranks = rng.normal(size=len(codes)) + 0.5 * codes
    F = f_oneway(*by_group(ranks, codes, groups)).statistic
    n = len(codes)
    expected = (groups - 1) * (F - 1) / ((groups - 1) * F + n - groups)
    assert explained(ranks, codes) == pytest.approx(max(expected, 0.0), abs=1e-9)


@QUICK
@given(arrays(float, st.integers(1, 600), elements=st.floats(-5, 5)))
def test_quantiles_are_values_and_a_drawn_distribution_keeps_them(values) -> None:
    levels = [0.05, 0.5, 0.95]
    at = quantiles(values, levels)
    assert set(at) <= set(values)
    assert np.mean(values <= at[1]) >= 0.5
    few = thinned(values)
    assert len(few) == min(len(values), 201)
    assert set(few) <= set(values)
    for value in at:
        assert np.mean(few <= value) == pytest.approx(np.mean(values <= value), abs=0.006)
    assert (few.min(), few.max()) == (values.min(), values.max())


def test_a_time_that_does_not_exist_is_late() -> None:
    assert spread(np.array([1.0, 2.0, np.nan]), 's')['median'] == 2.0
    assert spread(np.array([1.0, 2.0, np.nan]), 'N')['median'] == 1.0
    assert spread(np.full(2, np.nan), 's')['median'] is None


@pytest.mark.parametrize(('unit', 'high'), [('s', None), ('N', 33.0)])
def test_a_spread_has_all_its_numbers(unit: str, high: float | None) -> None:
    rng = np.random.default_rng(0)
    values = rng.permutation([*np.arange(1.0, 35.0), *[np.nan] * 6])
    latest = 40 if unit == 's' else 34  # of so many the level is taken
    levels = {'low': 0.05, 'quarter': 0.25, 'median': 0.5, 'three_quarters': 0.75}
    at = {name: float(np.ceil(level * latest)) for name, level in levels.items()}
    assert spread(values, unit) == {
        'rows': 40, 'known': 34, 'smallest': 1.0, **at, 'high': high, 'largest': 34.0, 'mean': 17.5,
    }  # fmt: skip


@pytest.mark.parametrize('unit', ['s', 'N'])
def test_ranks_are_those_of_scipy_and_equal_ones_share_theirs(unit: str) -> None:
    values = np.array([3.0, 1.0, np.nan, 3.0, 2.0, 3.0, 1.0, np.nan])
    late = np.where(np.isnan(values), np.inf, values)
    found = Ordered.of(values, unit)
    expected = rankdata(late) if unit == 's' else rankdata(values, nan_policy='omit')
    np.testing.assert_array_equal(found.ranks, expected)
    np.testing.assert_array_equal(found.ascending, values[found.places] if unit == 'N'
                                  else late[found.places])  # fmt: skip
    groups = found.groups(np.array([0, 1, 1, 2, 2, 0, 2, 2]), 4)
    assert [list(group) for group in groups] == [
        [3.0, 3.0], [1.0, np.inf] if unit == 's' else [1.0],
        [1.0, 2.0, 3.0, np.inf] if unit == 's' else [1.0, 2.0, 3.0], [],
    ]  # fmt: skip


@pytest.mark.parametrize(
    ('values', 'unit', 'found'),
    [
        ([[1.0, 1.0], [1.0]], 's', False),
        ([[1.0], [1.0 + 1e-9]], 'N', True),
        ([[1.0], [1.0 + 1e-14]], 'N', False),
        ([[-1e15, -1e15 - 10.0]], 'N', False),
        ([[1.0, np.nan]], 'N', False),
        ([[1.0], [np.nan]], 's', True),
        ([[np.nan], [np.nan]], 's', False),
        ([[0.0, 0.0]], 'N', False),
    ],
)
def test_whether_a_figure_varies(values: list[list[float]], unit: str, found: bool) -> None:
    assert varying([np.array(part) for part in values], unit) is found


def test_what_some_rows_do_not_have_is_judged_by_the_others(tmp_path) -> None:
    def partly(controller, values, index):
        there = np.where(index % 3, values[K_D] ** 2, np.nan)
        return {f'velocity_error.max_after_2s.{dof}': there for dof in DOFS[:3]}

    found = analysed(open_sweep(make_sweep(tmp_path, SIMPLE, partly, range(3))))
    name = 'overall.velocity_error.max_after_2s.linear'
    (row,) = rows(found, 'influence', figure=name, controller='gvc', path=K_D)
    assert row['spearman'] == pytest.approx(1.0)
    (other,) = rows(found, 'influence', figure=name, controller='gvc', path=DAMPING)
    mine = found.sweep.finished['gvc'][~np.isnan(found.values[name][found.sweep.finished['gvc']])]
    damping = next(factor for factor in found.factors if factor.path == DAMPING)
    assert other['spearman'] == pytest.approx(
        spearmanr(damping.numbers[mine], found.values[name][mine]).statistic
    )
    (word,) = rows(found, 'influence', figure=name, controller='gvc', path='integrator')
    assert word['spearman'] is None
    (pair,) = rows(found, 'paired', figure=name)
    assert pair['rollouts'] == 400
    cells = rows(found, 'together', figure=name, controller='cl')
    assert (sum(c['rows'] for c in cells), sum(c['known'] for c in cells)) == (600, 400)


def test_rows_that_failed_have_no_say(tmp_path) -> None:
    def failing(controller, values, index):
        status = np.where(index % 2, 'ok', 'diverged').astype(object)
        return {'status': status, ENERGY: np.where(index % 2, 5.0, 99.0)}

    found = analysed(open_sweep(make_sweep(tmp_path, SIMPLE, failing, range(1))), ENERGY)
    assert found.fixed[ENERGY] == 5.0
    (row,) = rows(found, 'quantiles', figure=ENERGY, controller='cl')
    assert (row['rows'], row['known'], row['largest']) == (100, 100, 5.0)
    assert {row[ENERGY] for row in found.tables['best']} == {5.0}


@pytest.mark.parametrize(
    ('ranks', 'codes', 'known'),
    [
        (np.arange(8.0), [0, 0, 0, 0, 1, 1, 1, 1], True),
        (np.arange(7.0), [0, 0, 0, 0, 1, 1, 1], False),
        (np.arange(8.0), [2] * 8, False),
        (np.full(8, 4.5), [0, 0, 0, 0, 1, 1, 1, 1], False),
        (np.arange(8.0), list(range(8)), False),
        (np.arange(9.0), [*range(8), 7], True),
        (np.arange(8.0), [0, 0, 0, 0, 9, 9, 9, 9], True),
    ],
)
def test_influence_needs_some_rows_in_some_groups(ranks, codes, known: bool) -> None:
    assert (influence(ranks, np.array(codes), None) is not None) is known


def test_the_commonest_reasons_come_first(tmp_path) -> None:
    def failing(controller, values, index):
        which = np.searchsorted([0, 2, 5, 9, 20, 26], index % 50, side='right')  # 24, 11, 6, ...
        status = np.where(which > 3, 'diverged', 'refused').astype(object)
        return {'status': status, 'reason': np.array([f'r{k}' for k in which], object)}

    sweep = open_sweep(make_sweep(tmp_path, SIMPLE, failing, range(1)))
    assert Analysis(sweep, [], {}).reasons() == [
        {'status': status, 'reason': reason, 'rows': 8 * rows}
        for status, reason, rows in (('diverged', 'r6', 24), ('diverged', 'r4', 11),
                                     ('diverged', 'r5', 6), ('refused', 'r3', 4),
                                     ('refused', 'r2', 3))
    ]  # fmt: skip


def test_a_distribution_of_times_ends_where_the_rest_never_settles() -> None:
    axes = new_figure(1.0).subplots()
    times = ordered(np.array([1.0, 2.0, np.nan, np.nan]), 's')
    distribution(axes, {'gvc': thinned(times)}, {})
    assert axes.lines[0].get_xydata()[-1].tolist() == [2.0, 0.5]
