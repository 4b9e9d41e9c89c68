"""Designs and indices: functions whose indices are known, and intervals that keep their word."""

import numpy as np
import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.studies.sweep.indices import SensitivityPlan, spreads

A, B = 7.0, 0.1  # of Ishigami's function


def ishigami(points: np.ndarray) -> np.ndarray:
    x = np.pi * points.T
    return np.sin(x[0]) + A * np.sin(x[1]) ** 2 + B * x[2] ** 4 * np.sin(x[0])


def known_indices() -> tuple[np.ndarray, np.ndarray]:
    """Of Ishigami & Homma 1990, from its variances."""
    V1 = 0.5 * (1 + B * np.pi**4 / 5) ** 2
    V2, V13 = A**2 / 8, B**2 * np.pi**8 * 8 / 225
    V = V1 + V2 + V13
    return np.array([V1, V2, 0.0]) / V, np.array([V1 + V13, V2, V13]) / V


def test_indices_of_ishigami() -> None:
    design = SensitivityPlan('sobol', ('a', 'b', 'c'), 2048, 0)
    found = design.indices(ishigami(design.points))
    for name, expected in zip(('S1', 'ST'), known_indices(), strict=True):
        assert_allclose(found[name], expected, atol=0.02)
        assert (np.abs(found[name] - expected) <= 1.5 * found[f'{name}_conf'] + 1e-3).all()


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3).filter(lambda c: max(map(abs, c)) > 0.5))
@QUICK
def test_a_linear_function_has_the_squares_of_its_slopes(slopes: list[float]) -> None:
    design = SensitivityPlan('sobol', ('a', 'b', 'c'), 512, 3)
    found = design.indices(design.points @ slopes)
    shares = np.square(slopes) / np.square(slopes).sum()
    assert_allclose(found['ST'], shares, atol=0.02)
    assert_allclose(found['S1'], shares, atol=0.05)
    assert_allclose(found['slope'], slopes, atol=1e-9)


def test_what_hardly_ever_answers_has_indices_of_zero_and_no_warning() -> None:
    design = SensitivityPlan('sobol', ('a', 'b'), 8, 0)
    row = np.arange(len(design.points))
    y = np.where(row % 4 % 3, row, 0.0)  # always the same in the rows A and B
    assert_array_equal(design.indices(y)['S1'], [0.0, 0.0])


def test_morris_of_a_linear_function() -> None:
    design = SensitivityPlan('morris', ('a', 'b', 'c'), 8, 0)
    found = design.indices(design.points @ [1.0, -2.0, 0.0] + 5.0)
    assert_allclose(found['mu_star'], [2.0, 4.0, 0.0], atol=1e-12)  # from -1 to 1
    assert_allclose(found['sigma'], 0.0, atol=1e-12)
    assert_allclose(found['slope'], [1.0, -2.0, 0.0], atol=1e-12)


@pytest.mark.parametrize('method', ['sobol', 'morris'])
@pytest.mark.parametrize('seed', [0, 5])
def test_a_seed_gives_the_same_points_and_intervals(method, seed) -> None:
    first, again = (SensitivityPlan(method, ('a', 'b', 'c'), 16, seed) for _ in range(2))
    assert_array_equal(first.points, again.points)
    y = ishigami(first.points)
    for name, values in first.indices(y).items():
        assert_array_equal(values, again.indices(y)[name])
    assert not np.array_equal(
        first.points, SensitivityPlan(method, first.names, 16, seed + 1).points
    )


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        (('sobol', ('a',), 6, 0), 'power of two'),
        (('sobol', ('a',), 1, 0), 'power of two'),
        (('morris', ('a',), 1, 0), 'at least 2'),
        (('sobol', (), 8, 0), 'at least one factor'),
        (('fast', ('a',), 8, 0), 'sobol or morris'),
    ],
)
def test_a_design_that_says_nothing_is_refused(values, words) -> None:
    with pytest.raises(ValueError, match=words):
        SensitivityPlan(*values)


@pytest.mark.parametrize('method', ['sobol', 'morris'])
def test_spreads_are_standard_deviations(method) -> None:
    design = SensitivityPlan(method, ('a', 'b'), 256, 1)
    answers = design.points @ np.array([[1.0, 0.5, 0.0], [0.0, 0.5, 0.1]])
    found = spreads(design, answers)
    one = np.sqrt(1 / 3) if method == 'sobol' else np.sqrt((1 + 1 / 9) / 2)
    assert_allclose(found['spread'], one * np.array([1.0, np.sqrt(0.5), 0.1]), rtol=0.05)
    assert (found['spread_low'] < found['spread']).all()
    assert (found['spread'] < found['spread_high']).all()
    assert_array_equal(found['rank'], [1, 2, 3])
    assert_array_equal(found['rank_low'], [1, 2, 3])
    assert_array_equal(found['rank_high'], [1, 2, 3])


def test_the_interval_of_a_spread_holds_it_as_often_as_it_says() -> None:
    true, inside = np.sqrt(1 / 3), 0
    for seed in range(60):
        design = SensitivityPlan('sobol', ('a',), 32, seed)
        design.__dict__['points'] = np.random.default_rng(seed).uniform(-1, 1, (96, 1))
        found = spreads(design, design.points)
        inside += bool(found['spread_low'][0] <= true <= found['spread_high'][0])
    assert inside >= 50  # 57 expected


def test_places_are_paired() -> None:
    """An answer that is always a little more than another one is first for sure."""
    design = SensitivityPlan('sobol', ('a', 'b'), 64, 2)
    y = design.points @ [1.0, 1.0]
    found = spreads(design, np.column_stack([y, 1.02 * y, design.points[:, 0] * 1.41]))
    assert found['spread_low'][1] < found['spread_high'][0]  # their intervals overlap
    assert (found['rank'][1], found['rank_low'][1], found['rank_high'][0]) == (1, 1, 3)
    assert found['rank'][0] > found['rank'][1]
    assert not np.array_equal(found['rank_low'], found['rank_high'])  # the third is not sure
