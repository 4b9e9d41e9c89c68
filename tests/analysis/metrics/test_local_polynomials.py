"""The filter of rates: SciPy's at equal steps, exact on polynomials, honest of its gain."""

import numpy as np
import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.signal import savgol_coeffs, savgol_filter

from auv_analysis.metrics.local_polynomials import (
    ORDER,
    SMALLEST,
    nearest,
    rates,
    residuals,
    weights,
)


@pytest.mark.parametrize('count', [9, 15, 41])
def test_at_equal_steps_it_is_scipys(count: int) -> None:
    step = 0.04
    t = step * np.arange(200)
    values = np.random.default_rng(2).normal(size=(200, 3))
    found = rates(t, values, t, count)
    expected = savgol_filter(values, count, ORDER, deriv=1, delta=step, axis=0, mode='interp')
    assert_allclose(found.rate, expected, atol=1e-9)
    gain = (savgol_coeffs(count, ORDER, deriv=1, delta=step) ** 2).sum()
    assert_allclose(found.gain[count:-count], gain, rtol=1e-9)
    more = savgol_filter(values, count, ORDER + 2, deriv=1, delta=step, axis=0, mode='interp')
    assert_allclose(found.change, more - expected, atol=1e-7)


@st.composite
def uneven(draw: st.DrawFn) -> np.ndarray:
    """Rising times whose steps differ by up to a factor of a hundred."""
    count = draw(st.integers(SMALLEST, 60))
    steps = draw(st.lists(st.floats(0.01, 1.0), min_size=count, max_size=count))
    return np.cumsum(steps)


@QUICK
@given(uneven(), st.integers(SMALLEST, 80), st.integers(0, ORDER))
def test_polynomials_of_its_order_are_met_at_any_steps(t, count, power) -> None:
    at = np.linspace(t[0], t[-1], 17)
    middle = t.mean()
    found = rates(t, ((t - middle) ** power)[:, None], at, count)
    expected = power * (at - middle) ** max(power - 1, 0) if power else np.zeros(17)
    scale = max(np.abs(expected).max(), 1.0)
    assert_allclose(found.rate[:, 0], expected, atol=1e-6 * scale)
    assert_allclose(found.change[:, 0], 0.0, atol=1e-3 * scale)


@QUICK
@given(uneven(), st.integers(SMALLEST, 30))
def test_the_window_is_the_one_about_the_time(t, count) -> None:
    count = min(count, len(t))
    at = np.linspace(t[0], t[-1], 23)
    first = nearest(t, at, count)
    for time, i in zip(at, first, strict=True):
        reach = max(abs(time - t[i]), abs(t[i + count - 1] - time))
        others = [max(abs(time - t[j]), abs(t[j + count - 1] - time))
                  for j in (i - 1, i + 1) if 0 <= j <= len(t) - count]  # fmt: skip
        assert all(reach <= other + 1e-12 for other in others)


def test_gains_are_those_of_noise() -> None:
    """Variances over many draws, of noise in the values and in what they are the integral of."""
    rng = np.random.default_rng(7)
    t = np.cumsum(rng.uniform(0.01, 0.05, 60))
    at = t[[5, 20, 30, 50]]
    draws = 4000
    noise = rng.normal(size=(60, draws))
    found = rates(t, noise, at, 21)
    assert_allclose(found.rate.var(axis=1), found.gain, rtol=0.1)
    assert_allclose(found.change.var(axis=1), found.change_gain, rtol=0.1)
    area = np.cumsum(np.vstack([np.zeros(draws), noise[1:] * np.diff(t)[:, None]]), axis=0)
    assert_allclose(rates(t, area, at, 21).rate.var(axis=1), found.inner_gain, rtol=0.1)


def test_residuals_tell_the_variance_of_noise_whatever_moves_slowly() -> None:
    rng = np.random.default_rng(8)
    t = np.cumsum(rng.uniform(0.005, 0.015, 5000))
    values = np.stack([np.sin(t), t**2], axis=1) + [0.01, 0.3] * rng.normal(size=(5000, 2))
    squares, freedom = residuals(t, values)
    assert_allclose(np.sqrt(squares / freedom), [0.01, 0.3], rtol=0.05)


def test_a_value_is_that_of_the_fitted_polynomial() -> None:
    t = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.55, 0.7, 0.9, 1.0])
    (w,) = weights(t, np.array([0.4]), np.arange(9)[None], 3, rate=False)
    expected = np.polyval(np.polyfit(t, np.sin(5 * t), 3), 0.4)
    assert (w @ np.sin(5 * t))[0] == pytest.approx(expected, abs=1e-12)
