"""Whiteness of residuals: a number for each velocity, and a sentence."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import chi2

from auv_analysis.output.text import join, number
from auv_analysis.studies.identify.record import Segment, even_period
from auv_dynamics.vehicle import DOFS

LAGS = 20  # of the autocorrelation, at most
SLOW = 1.0  # Hz
CERTAIN = 0.01  # probability by chance, of all velocities together
LITTLE = 0.05  # autocorrelation: less is no finding, however certain
MUCH = 1.5  # times the power of white noise
LOUD = 2.0  # of the power of the noise: as much beside it


def whiteness(pairs: Sequence[tuple[Segment, np.ndarray]], step: float) -> list[dict[str, Any]]:
    """Rows: dof, rms, ljung_box, p, largest, slow, slow_if_white, verdict.

    Autocorrelations r_k are taken inside segments, of n_k pairs each; sum n_k r_k^2 is chi-square
    distributed for white noise (Ljung and Box, 1978). `largest` is that of all r_k, `slow` the
    share of the power below 1 Hz; the verdict is 'white', 'slow' or 'coloured'.

    Parameters
    ----------
    pairs : segments with their residuals (r, 9) in deviations of the noise
    step : s

    """
    rows: list[dict[str, Any]] = []
    for i, dof in enumerate(DOFS):
        some = at_even_rate(pairs, i, step, 2 * LAGS + 2)
        if some:
            rows.append({'dof': dof, **_of(some)})
    least = CERTAIN / max(len(rows), 1)
    for row in rows:
        is_white = row['p'] > least or abs(row['largest']) < LITTLE
        is_slow = row['slow'] > MUCH * row['slow_if_white']
        row['verdict'] = 'white' if is_white else 'slow' if is_slow else 'coloured'
    return rows


def at_even_rate(
    pairs: Sequence[tuple[Segment, np.ndarray]], i: int, step: float, least: int
) -> list[tuple[np.ndarray, float]]:
    """Residuals of velocity i, and their period in s, of segments that have `least` and lack none.

    Pairs and step as of `whiteness`.
    """
    return [
        (e[there, i], period * step) for segment, e in pairs
        for there in [np.isfinite(segment.nu[:, i])]
        for period in [even_period(segment.at[there])]
        if period and there.sum() >= least
    ]  # fmt: skip


def _of(some: Sequence[tuple[np.ndarray, float]]) -> dict[str, float]:
    """Numbers of the residuals (r,) of one velocity, each with its period in s."""
    every = np.concatenate([e for e, _ in some])
    power = float((every**2).mean())
    lags = np.arange(1, LAGS + 1)
    counts = np.array([sum(len(e) - k for e, _ in some) for k in lags])
    sums = np.array([sum(float(e[k:] @ e[:-k]) for e, _ in some) for k in lags])
    r = sums / counts / max(power, 1e-300)
    statistic = float((counts * r**2).sum())
    slow, below = np.zeros(2), np.zeros(2)
    for e, period in some:
        lines = np.abs(np.fft.rfft(e)) ** 2
        lines[1 : (len(e) + 1) // 2] *= 2.0
        doubled = np.r_[1.0, np.full(len(lines) - 1, 2.0)]
        is_slow = np.fft.rfftfreq(len(e), period) < 0.999 * SLOW  # on it, rounding decides
        slow += lines[is_slow].sum(), lines.sum()
        below += doubled[is_slow].sum(), doubled.sum()
    return {
        'rms': power**0.5,
        'ljung_box': statistic,
        'p': float(chi2.sf(statistic, LAGS)),
        'largest': float(r[np.argmax(np.abs(r))]),
        'slow': float(slow[0] / max(slow[1], 1e-300)),
        'slow_if_white': float(below[0] / below[1]),
    }


def told(rows: Sequence[Mapping[str, Any]], *, current: bool = False) -> str:
    """Sentence on the residuals of a model with or without a current."""
    coloured = [row for row in rows if row['verdict'] != 'white']
    if not rows:
        return 'Whether the residuals are white cannot be told: no even rate, or too short'
    if not coloured:
        return 'The residuals are white: the model explains all but noise'
    worst = max(coloured, key=lambda row: row['slow'] / row['slow_if_white'])
    names = join([row['dof'] for row in coloured])
    if worst['verdict'] == 'coloured':
        return (f'The residuals are not white in {names}: autocorrelation up to '
                f'{number(max(abs(row["largest"]) for row in coloured), 2)}')  # fmt: skip
    return (
        f'The residuals are not white in {names}: in {worst["dof"]} '
        f'{number(100 * worst["slow"], 2)} % of their power lies below {SLOW:g} Hz, of white noise '
        f'{number(100 * worst["slow_if_white"], 2)} %; something slow acts that the model lacks'
        f'{"" if current else ", as a current would (--free current)"}: intervals may be too narrow'
    )


def reservation(rows: Sequence[Mapping[str, Any]]) -> str:
    """What a verdict on the model must say of slow residuals; empty where noise outweighs them."""
    slow = [row for row in rows if row['verdict'] == 'slow' and row['rms'] ** 2 > LOUD]
    if not slow:
        return ''
    worst = max(slow, key=lambda row: row['rms'])
    return (
        f'; but something slow acts that it lacks, {number(worst["rms"], 2)} times the noise in '
        f'{worst["dof"]}: coefficients may be off by more than their intervals'
    )
