"""Rates of noisy signals with their error: the Savitzky-Golay filter for uneven stamps.

At equal steps the weights are those of scipy.signal.savgol_coeffs. That filter knows no other
steps, and values that are first interpolated to equal ones have a noise that is not white.

Four things make the error. White noise of the signal, whose variance shows in the residuals of the
shortest window, is passed on with the filter's gain. The noise of what was integrated to get the
signal passes another gain. The bias of the filter is taken to be what two orders more would
change, less the noise in that. What the signal may itself be off goes through the same filter.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

ORDER = 3  # of the polynomials
SMALLEST = 9  # samples of a window
AT_ONCE = 1 << 17  # samples of windows that are worked on together


class Rates(NamedTuple):
    """Rates (m, k) at some times, and what is known of their error.

    Attributes
    ----------
    rate : (m, k) of the fitted polynomials, unit of the values per s
    gain : (m,) sum of squared weights, 1/s2: what becomes of the variance of white noise
    change, change_gain : the same of what two orders more would add: an estimate of the bias
    inner_gain : (m,) what becomes of the variance of white noise in that whose integral the values
        are, no unit

    """

    rate: np.ndarray
    gain: np.ndarray
    change: np.ndarray
    change_gain: np.ndarray
    inner_gain: np.ndarray


def nearest(times: np.ndarray, at: np.ndarray, count: int) -> np.ndarray:
    """Index (m,) of the first of the `count` samples that reach least far from each time.

    Parameters
    ----------
    times : (n,) rising, n at least `count`
    at : (m,)

    """
    last = count - 1
    twice_middles = times[: len(times) - last] + times[last:]
    later = np.clip(np.searchsorted(twice_middles, 2.0 * at), 0, len(twice_middles) - 1)
    earlier = np.maximum(later - 1, 0)
    # of the window whose middle is before the time and the one whose middle is behind it
    reach = [np.maximum(at - times[i], times[i + last] - at) for i in (earlier, later)]
    return np.where(reach[0] <= reach[1], earlier, later)


def windows(times: np.ndarray, at: np.ndarray, count: int) -> Iterator[tuple[slice, np.ndarray]]:
    """Slices of the times `at`, and indices (m, count) of the samples `nearest` to each of them."""
    rows = max(AT_ONCE // count, 1)
    for i in range(0, len(at), rows):
        here = slice(i, i + rows)
        yield here, nearest(times, at[here], count)[:, None] + np.arange(count)


def weights(
    times: np.ndarray, at: np.ndarray, near: np.ndarray, *orders: int, rate: bool
) -> list[np.ndarray]:
    """Weights of the samples in the value, or the rate, of the fitted polynomials.

    Parameters
    ----------
    times : (n,) rising, s
    at : (m,) times of interest, s
    near : (m, count) indices of the samples of each window, more of them than each order
    orders : of the polynomials
    rate : whether the first derivative is asked for, else the value

    Returns
    -------
    weights : (m, count) for each order, those of a rate in 1/s

    """
    window = times[near]
    middle = window.mean(axis=1, keepdims=True)
    scale = (window[:, -1:] - window[:, :1]) / 2.0
    V = _powers((window - middle) / scale, max(orders))
    asked = _powers((at[:, None] - middle) / scale, max(orders))[:, 0]
    if rate:
        asked[:, 1:] = asked[:, :-1] * np.arange(1, max(orders) + 1) / scale
        asked[:, 0] = 0.0
    A = V.swapaxes(1, 2) @ V
    solved = [_solved(A[:, :n, :n], asked[:, :n, None]) for n in np.add(orders, 1)]
    return [(V[..., : x.shape[1]] @ x)[..., 0] for x in solved]


def _solved(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solution of A x = b, A (m, n, n) symmetric; of a singular one the least that is nearest."""
    try:
        return np.linalg.solve(A, b)
    except np.linalg.LinAlgError:  # samples in a heap, and one far away
        return np.asarray(np.linalg.pinv(A, hermitian=True) @ b)


def _powers(x: np.ndarray, order: int) -> np.ndarray:
    """1, x, x^2, ... along a last axis of its own; multiplied, which is far faster than `**`."""
    result = np.ones((*x.shape, order + 1))
    for k in range(order):
        np.multiply(result[..., k], x, out=result[..., k + 1])
    return result


def rates(
    times: np.ndarray, values: np.ndarray, at: np.ndarray, count: int, *, bias: bool = True
) -> Rates:
    """Rates of local polynomials of order 3, and what order 5 would change.

    Parameters
    ----------
    times, values : (n,) rising s and (n, k), n at least `SMALLEST`
    at : (m,) s
    count : samples of a window; all samples where there are fewer
    bias : whether that change is asked for, which takes half of the time; else it is NaN

    """
    count = min(count, len(times))
    orders = (ORDER, ORDER + 2) if bias else (ORDER,)
    found, change = np.full((2, len(at), values.shape[1]), np.nan)
    gain, change_gain, inner_gain = np.full((3, len(at)), np.nan)
    for here, near in windows(times, at, count):
        window = values[near]
        w, *finer = weights(times, at[here], near, *orders, rate=True)
        more = [(change, change_gain, one - w) for one in finer]
        # the weights of a rate sum up to zero, so that it is one of differences: by their sums
        apart = np.diff(times[near], axis=1)
        inner_gain[here] = ((np.cumsum(w[:, :-1], axis=1) * apart) ** 2).sum(axis=1)
        for result, squares, by in ((found, gain, w), *more):
            result[here] = np.einsum('mc,mck->mk', by, window)
            squares[here] = np.einsum('mc,mc->m', by, by)
    return Rates(found, gain, change, change_gain, inner_gain)


def residuals(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, float]:
    """Squares (k,) of the residuals of local polynomials, and their degrees of freedom.

    The one divided by the other is the variance of white noise on (n, k) values at rising times,
    whatever polynomial of order 3 lies under every `SMALLEST` of them.
    """
    squares, freedom = np.zeros(values.shape[1]), 0.0
    for here, near in windows(times, times, SMALLEST):
        (w,) = weights(times, times[here], near, ORDER, rate=False)
        smooth = np.einsum('mc,mck->mk', w, values[near])
        squares += ((values[here] - smooth) ** 2).sum(axis=0)
        own = np.arange(len(times))[here] - near[:, 0]
        freedom += float((1.0 - w[np.arange(len(w)), own]).sum())
    return squares, freedom


GROWTH = 1.35  # from one window that is tried to the next
LONGEST = 1001  # samples of a window
PROBES = 500  # times at which windows are compared
NARROWER = 2  # windows: of two errors of one size, that which is mostly noise is the better known


@dataclass(frozen=True, eq=False)
class Stretch:
    """A signal without gaps, and the times at which its rate is asked for.

    Attributes
    ----------
    t : (k,) s
    y : (k, 6) the signal
    doubt : (k, 6) how much of y may be error
    spread : (k, 6) variance of white noise in that whose integral y is, unit of y squared per s2
    at : (m,) s

    """

    t: np.ndarray
    y: np.ndarray
    doubt: np.ndarray
    spread: np.ndarray
    at: np.ndarray


def variance(signals: Iterable[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Variance (k,) of white noise in signals: times (n,) and values (n, k) of each."""
    left = [residuals(t, values) for t, values in signals]
    squares = np.sum([squares for squares, _ in left], axis=0)
    return squares / max(sum(freedom for _, freedom in left), 1.0)


def given_window(window: float, period: float) -> np.ndarray:
    """Samples (6,) of a window in s, for samples a period apart."""
    return np.full(6, max(2 * round((window / period - 1) / 2) + 1, SMALLEST))


def narrow_window(stretches: Sequence[Stretch]) -> np.ndarray:
    """Samples (6,) of the window: somewhat fewer than that with the least mean square error."""
    noise = variance((one.t, one.y) for one in stretches)
    longest = min(max(len(one.t) for one in stretches) // 4, LONGEST)
    counts = [SMALLEST]
    while counts[-1] * GROWTH < longest:
        counts.append(2 * round(counts[-1] * GROWTH / 2) + 1)
    every = -(-sum(len(one.at) for one in stretches) // PROBES)
    errors = []
    for count in counts:
        known, change = zip(
            *(_parts(one, one.at[::every], slice(None), count, noise)[1:] for one in stretches),
            strict=True,
        )
        bias = np.concatenate(change).mean(axis=0)
        errors.append(np.concatenate(known).mean(axis=0) + np.maximum(bias, 0.0))
    return np.array(counts)[np.maximum(np.argmin(errors, axis=0) - NARROWER, 0)]


def filtered(
    stretches: Sequence[Stretch], counts: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Rates at the times asked for and their standard errors, (n, 6) each.

    Parameters
    ----------
    stretches : one after the other
    counts : (6,) samples of the window of each column
    step : s between the times

    """
    noise = variance((one.t, one.y) for one in stretches)
    values, errors = [], []
    for one in stretches:
        found, error = np.empty((2, len(one.at), 6))
        for count in np.unique(counts).tolist():
            columns = np.flatnonzero(counts == count)
            rate, known, change = _parts(one, one.at, columns, count, noise)
            wide = max(round(count * float(np.median(np.diff(one.t))) / step), 1)
            bias = np.maximum(uniform_filter1d(change, wide, axis=0, mode='nearest'), 0.0)
            doubt = rates(one.t, one.doubt[:, columns], one.at, count, bias=False).rate
            found[:, columns], error[:, columns] = rate, np.sqrt(known + bias + doubt**2)
        values.append(found)
        errors.append(error)
    return np.concatenate(values), np.concatenate(errors)


def _parts(
    one: Stretch, at: np.ndarray, columns: np.ndarray | slice, count: int, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rate, its variance by noise, and its squared bias less the noise in that: may be negative."""
    found: Rates = rates(one.t, one.y[:, columns], at, count)
    by_noise = found.gain[:, None] * noise[columns]
    spread = np.stack([np.interp(at, one.t, column) for column in one.spread[:, columns].T], axis=1)
    inner = found.inner_gain[:, None] * spread
    return (
        found.rate,
        by_noise + inner,
        found.change**2 - found.change_gain[:, None] * noise[columns],
    )
