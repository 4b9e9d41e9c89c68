"""The filter of rates: SciPy's at equal steps, exact on polynomials, honest of its gain."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.signal import savgol_coeffs, savgol_filter

from auv_analysis.metrics import local_polynomials
from auv_analysis.metrics.local_polynomials import (
    ORDER,
    SMALLEST,
    Stretch,
    filtered,
    given_window,
    narrow_window,
    nearest,
    rates,
    residuals,
    variance,
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
    brief = rates(t, values, t, count, bias=False)
    for name in ('rate', 'gain', 'inner_gain'):
        assert_allclose(getattr(brief, name), getattr(found, name), rtol=1e-9, atol=1e-9)
    assert np.isnan([*brief.change.ravel(), *brief.change_gain]).all()


def test_samples_in_a_heap_and_one_far_away_are_no_error() -> None:
    t = np.append(0.02 * np.arange(SMALLEST - 1), 1e9)
    assert np.isfinite(rates(t, t[:, None], t, SMALLEST).rate).all()


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


def test_the_variance_of_noise_is_that_of_all_signals_together() -> None:
    rng, t = np.random.default_rng(12), 0.01 * np.arange(5000)
    signals = [(t, size * rng.normal(size=(5000, 1))) for size in (0.1, 0.3)]
    assert_allclose(variance(signals), (0.1**2 + 0.3**2) / 2.0, rtol=0.1)


def test_a_value_is_that_of_the_fitted_polynomial() -> None:
    t = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.55, 0.7, 0.9, 1.0])
    (w,) = weights(t, np.array([0.4]), np.arange(9)[None], 3, rate=False)
    expected = np.polyval(np.polyfit(t, np.sin(5 * t), 3), 0.4)
    assert (w @ np.sin(5 * t))[0] == pytest.approx(expected, abs=1e-12)


def test_windows_that_are_worked_on_one_after_the_other_give_the_same(monkeypatch) -> None:
    rng = np.random.default_rng(9)
    t, values = np.cumsum(rng.uniform(0.01, 0.05, 70)), rng.normal(size=(70, 2))
    at = np.linspace(t[0], t[-1], 23)
    whole = (*rates(t, values, at, 13), *residuals(t, values))
    monkeypatch.setattr(local_polynomials, 'AT_ONCE', 4 * 13)
    for one, other in zip((*rates(t, values, at, 13), *residuals(t, values)), whole, strict=True):
        assert_allclose(one, other, rtol=1e-12)


@pytest.mark.parametrize(('window', 'count'), [(0.5, 25), (0.53, 27), (0.51, 25), (0.1, 9)])
def test_a_window_has_an_odd_number_of_samples_and_nine_at_least(window, count) -> None:
    assert given_window(window, 0.02).tolist() == [count] * 6


def stretch(t: np.ndarray, y: np.ndarray, **known: np.ndarray) -> Stretch:
    """A signal, of which nothing is doubtful but what is said; asked for between its samples."""
    nothing = {'doubt': np.zeros_like(y), 'spread': np.zeros_like(y)}
    return Stretch(t=t, y=y, at=t[20:-20] + 0.013, **(nothing | known))


@pytest.mark.parametrize(('longest', 'wide'), [(1001, 27), (40, 19)])
def test_what_is_noise_gets_a_wide_window_and_what_moves_fast_a_narrow_one(
    longest, wide, monkeypatch
) -> None:
    """Tried are 9, 13, 19, 27, 37 and, if allowed, 51 samples of 260; taken is the last but two."""
    monkeypatch.setattr(local_polynomials, 'LONGEST', longest)
    t = 0.02 * np.arange(260)
    y = np.random.default_rng(10).normal(size=(260, 6))
    y[:, [1, 4]] = ((t > 2.6) * np.sin(12.0 * t))[:, None]  # in the end alone
    some = [stretch(t, y), stretch(t[:190], y[:190])]
    assert narrow_window(some).tolist() == [wide, 9, wide, wide, 9, wide]


def test_an_error_is_made_of_what_was_integrated_and_of_what_the_signal_is_off() -> None:
    """Of two stretches, each column with a window of its own: a line is exact under any of them."""
    slopes, doubts = np.arange(1.0, 7.0), np.array([0.0, 0.3, 0.1, 0.0, 0.2, 0.4])
    spreads, counts = np.array([0.5, 0.0, 0.2, 0.3, 0.1, 0.4]), np.array([9, 13, 9, 21, 13, 9])
    times = 0.02 * np.arange(100), 5.0 + np.cumsum(np.resize([0.01, 0.03], 80))
    some = [
        stretch(t, np.outer(t, slopes), doubt=np.outer(t, doubts), spread=np.tile(spreads, (k, 1)))
        for t, k in zip(times, (100, 80), strict=True)
    ]
    rate, error = filtered(some, counts, 0.02)
    assert_allclose(rate, np.tile(slopes, (60 + 40, 1)), rtol=1e-6)
    expected = []
    for one in some:
        inner = np.stack([rates(one.t, one.y, one.at, n).inner_gain for n in counts], axis=1)
        expected.append(np.sqrt(inner * spreads + doubts**2))
    assert_allclose(error, np.concatenate(expected), rtol=1e-4)


def test_an_error_is_also_what_white_noise_leaves_and_two_orders_more_would_change() -> None:
    """Noise of one column; another one bends so fast that the bias is most of its error."""
    t = 0.02 * np.arange(400)
    y = np.zeros((400, 6))
    y[:, 2] = 0.1 * np.random.default_rng(11).normal(size=400)
    y[:, 5] = np.sin(12.0 * t)
    one = stretch(t, y)
    rate, error = filtered([one], np.full(6, 13), 0.02)
    assert not error[:, [0, 1, 3, 4]].any()
    found = rates(t, y, one.at, 13)
    assert (error[:, 2] / (0.1 * np.sqrt(found.gain))).min() == pytest.approx(1.0, abs=0.1)
    off = rate[:, 5] - 12.0 * np.cos(12.0 * one.at)
    shown, real = (np.sqrt((part**2).mean()) for part in (error[:, 5], off))
    assert shown == pytest.approx(real, rel=0.2)
    assert np.ptp(error[13:-13, 5]) < 0.2 * shown, 'it is smoothed over the window'


def bending(growth: float) -> Stretch:
    """A sine that bends so fast that its error is a bias, and grows by so much per s."""
    t = 0.02 * np.arange(400)
    return stretch(t, (np.exp(growth * t) * np.sin(12.0 * t))[:, None] * np.ones(6))


def test_a_bias_is_smoothed_over_the_window_however_densely_it_is_asked_for() -> None:
    dense = replace(bending(0.0), at=np.arange(5.0, 7.0, 0.005))
    _, error = filtered([dense], np.full(6, 13), 0.005)
    assert np.ptp(error[60:-60]) < 0.1 * error.mean()


def test_the_error_at_the_begin_has_nothing_of_the_end() -> None:
    _, error = filtered([bending(1.0)], np.full(6, 13), 0.02)
    assert error[:50].max() < 0.5 * error[-50:].min()
