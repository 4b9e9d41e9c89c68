"""Settling of an error: the transient, the band, the dwell time in it."""

from collections.abc import Iterable

import numpy as np

TRANSIENT = 2.0  # s, after which the paper reads off the errors
BAND = 0.02  # of the peak of nu_d: settled
SMALLEST_BAND = 0.005  # m/s, rad/s
DWELL = 5  # % of the run at its end that a settled error stays in its band
SHORTEST_DWELL = 10  # steps
BAND_TEXT = f'{100 * BAND:g} % of the peak of the set-point, at least {SMALLEST_BAND:g}'
SETTLED = f'{BAND_TEXT}, and dwells there for the last {DWELL} % of the run or longer'


def band_of(peak: np.ndarray) -> np.ndarray:
    """Band of a settled error for the peak (6,) of abs(nu_d), m/s and rad/s."""
    return np.maximum(BAND * peak, SMALLEST_BAND)


def settling_time(t: np.ndarray, error: np.ndarray, nu_d: np.ndarray) -> list[float | None]:
    """Time from which each error stays within its band; None where it has not settled.

    The band is 2 % of the peak of nu_d of that degree of freedom, at least 0.005 m/s or rad/s. An
    error has settled when it is inside at the end and has been for the dwell time (IEEE Std 181:
    settling needs a specified duration inside): one that only happens to end inside has not.

    Parameters
    ----------
    t : (n,) s
    error, nu_d : (n, 6) m/s, rad/s

    """
    return settling_times([(t, error)], len(t), band_of(np.abs(nu_d).max(axis=0)))[0]


def dwell(samples: int) -> int:
    """Steps that a settled error stays in its band: 5 % of a run, 10 at least, no more than all."""
    return min(max(-(-DWELL * (samples - 1) // 100), SHORTEST_DWELL), samples - 1)


def has_settled(outside: np.ndarray, samples: int) -> np.ndarray:
    """Whether errors dwell in their bands at the end of a run.

    Parameters
    ----------
    outside : index of the last sample outside the band, -1 where there is none
    samples : of the run

    """
    return samples - 2 - outside >= dwell(samples)


def settling_times(
    blocks: Iterable[tuple[np.ndarray, np.ndarray]], samples: int, band: np.ndarray
) -> tuple[list[float | None], list[float]]:
    """Settling times and largest errors of the final dwell time, of consecutive blocks.

    Parameters
    ----------
    blocks : times (n,) and errors (n, 6), m/s and rad/s
    samples : of all blocks
    band : (6,) of a settled error

    """
    entered, outside, residual = np.full(6, np.nan), np.full(6, -1), np.zeros(6)
    seen, last = 0, samples - 1 - dwell(samples)
    for t, error in blocks:
        size = np.abs(error)
        far = size > band
        for i in range(6):
            where = np.flatnonzero(far[:, i])
            begin = where[-1] + 1 if len(where) else 0
            if len(where):
                outside[i], entered[i] = seen + where[-1], np.nan
            if np.isnan(entered[i]) and begin < len(t):
                entered[i] = t[begin]
        residual = np.maximum(residual, size[max(last - seen, 0) :].max(axis=0, initial=0.0))
        seen += len(t)
    settled = has_settled(outside, samples)
    times = [float(t) if inside else None for t, inside in zip(entered, settled, strict=True)]
    return times, residual.tolist()
