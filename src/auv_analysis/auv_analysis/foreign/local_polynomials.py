"""Polynomials fitted to the samples about a time: the Savitzky-Golay filter for uneven stamps.

At equal steps the weights are those of scipy.signal.savgol_coeffs. That filter knows no other
steps, and values that are first interpolated to equal ones have a noise that is not white.
"""

from typing import NamedTuple

import numpy as np

ORDER = 3  # of the polynomials
SMALLEST = 9  # samples of a window
AT_ONCE = 1 << 20  # samples of windows that are worked on together


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


def weights(
    times: np.ndarray, at: np.ndarray, first: np.ndarray, count: int, order: int, rate: bool
) -> np.ndarray:
    """Weights of the samples in the value, or the rate, of the fitted polynomial.

    Parameters
    ----------
    times : (n,) rising, s
    at : (m,) times of interest, s
    first : (m,) index of the first sample of each window
    count : samples of a window, above `order`
    order : of the polynomials
    rate : whether the first derivative is asked for, else the value

    Returns
    -------
    weights : (m, count), those of a rate in 1/s

    """
    window = times[first[:, None] + np.arange(count)]
    middle = window.mean(axis=1, keepdims=True)
    scale = (window[:, -1:] - window[:, :1]) / 2.0
    V = _powers((window - middle) / scale, order)
    asked = _powers((at[:, None] - middle) / scale, order)[:, 0]
    if rate:
        asked[:, 1:] = asked[:, :-1] * np.arange(1, order + 1) / scale
        asked[:, 0] = 0.0
    solved = np.linalg.solve(V.swapaxes(1, 2) @ V, asked[..., None])
    return (V @ solved)[..., 0]


def _powers(x: np.ndarray, order: int) -> np.ndarray:
    """1, x, x^2, ... along a last axis of its own; multiplied, which is far faster than `**`."""
    result = np.ones((*x.shape, order + 1))
    for k in range(order):
        np.multiply(result[..., k], x, out=result[..., k + 1])
    return result


def rates(times: np.ndarray, values: np.ndarray, at: np.ndarray, count: int) -> Rates:
    """Rates of local polynomials of order 3, and what order 5 would change.

    Parameters
    ----------
    times, values : (n,) rising s and (n, k), n at least `SMALLEST`
    at : (m,) s
    count : samples of a window; all samples where there are fewer

    """
    count = min(count, len(times))
    found, change = np.empty((2, len(at), values.shape[1]))
    gain, change_gain, inner_gain = np.empty((3, len(at)))
    rows = max(AT_ONCE // count, 1)
    for i in range(0, len(at), rows):
        here = slice(i, i + rows)
        first = nearest(times, at[here], count)
        window = values[first[:, None] + np.arange(count)]
        w = weights(times, at[here], first, count, ORDER, rate=True)
        more = weights(times, at[here], first, count, ORDER + 2, rate=True) - w
        # the weights of a rate sum up to zero, so that it is one of differences: by their sums
        apart = np.diff(times[first[:, None] + np.arange(count)], axis=1)
        inner_gain[here] = ((np.cumsum(w[:, :-1], axis=1) * apart) ** 2).sum(axis=1)
        for result, squares, by in ((found, gain, w), (change, change_gain, more)):
            result[here] = np.einsum('mc,mck->mk', by, window)
            squares[here] = np.einsum('mc,mc->m', by, by)
    return Rates(found, gain, change, change_gain, inner_gain)


def residuals(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, float]:
    """Squares (k,) of the residuals of local polynomials, and their degrees of freedom.

    The one divided by the other is the variance of white noise on (n, k) values at rising times,
    whatever polynomial of order 3 lies under every `SMALLEST` of them.
    """
    squares, freedom = np.zeros(values.shape[1]), 0.0
    rows = max(AT_ONCE // SMALLEST, 1)
    for i in range(0, len(times), rows):
        here = np.arange(i, min(i + rows, len(times)))
        first = nearest(times, times[here], SMALLEST)
        w = weights(times, times[here], first, SMALLEST, ORDER, rate=False)
        smooth = np.einsum('mc,mck->mk', w, values[first[:, None] + np.arange(SMALLEST)])
        squares += ((values[here] - smooth) ** 2).sum(axis=0)
        freedom += float((1.0 - w[np.arange(len(here)), here - first]).sum())
    return squares, freedom
