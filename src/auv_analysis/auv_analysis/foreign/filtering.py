"""Rates of noisy signals with their error: which window, and how sure the result is.

Four things make the error. White noise of the signal, whose variance shows in the residuals of the
shortest window, is passed on with the filter's gain. The noise of what was integrated to get the
signal passes another gain. The bias of the filter is taken to be what two orders more would
change, less the noise in that. What the signal may itself be off goes through the same filter.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from auv_analysis.foreign.local_polynomials import SMALLEST, Rates, rates, residuals

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
            doubt = rates(one.t, one.doubt[:, columns], one.at, count).rate
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
