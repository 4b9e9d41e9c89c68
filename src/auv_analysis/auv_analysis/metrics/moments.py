"""Sums and largest magnitudes of a run's signals, in one go over its samples.

A signal is formed from the sample at hand and only its sums are kept.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

import numpy as np

from auv_analysis.metrics.signals import NAMES, Maps, signals
from auv_analysis.runs.run import Run, Windows

SIMULATED = 'simulate'  # source of a run that this process computed


def add_columns(
    nu: np.ndarray, nu_d: np.ndarray, tau: np.ndarray, f: np.ndarray, F: np.ndarray, maps: Maps,
    sums: np.ndarray, squares: np.ndarray, peaks: np.ndarray,
) -> None:  # fmt: skip
    """Add samples, flat arrays (6 n,), to what (7, 6) is known of those before them: as columns."""
    nu, nu_d, tau, f, F = (np.ascontiguousarray(a.reshape(-1, 6).T) for a in (nu, nu_d, tau, f, F))
    with np.errstate(over='ignore'):  # infinite, which a figure says as not known
        for s, signal in enumerate(signals(nu, nu_d, tau, f, F, maps)):
            for i, values in enumerate(signal):
                sums[s, i] += values.sum()
                squares[s, i] += values @ values
                peaks[s, i] = max(peaks[s, i], np.abs(values).max(initial=0.0))


def _compiled() -> Any:
    """What adds samples where numba is loaded anyway, since a simulation has just run.

    Of a recording, `add_columns` adds an hour in less time than numba takes to load, and without
    the 100 MB that it takes.
    """
    from auv_analysis.metrics.compiled_moments import add_compiled
    from auv_dynamics.kernel import LANES

    return add_compiled if LANES else add_columns


def known_or_zero(values: np.ndarray) -> np.ndarray:
    """The same (n, 6) with zeros for what was not recorded, so that it spoils nothing else."""
    unknown = np.isnan(values[:1]).any(axis=0)
    return np.where(unknown, 0.0, values) if unknown.any() else values


def _zeros() -> np.ndarray:
    return np.zeros((len(NAMES), 6))


@dataclass
class Moments:
    """Moments of some samples; the rows are those of `NAMES`.

    Attributes
    ----------
    count : number of samples
    first, last : their times, s
    sums, squares, peaks : (7, 6) sums, sums of squares and largest magnitudes

    """

    count: int = 0
    first: float = np.inf
    last: float = -np.inf
    sums: np.ndarray = field(default_factory=_zeros)
    squares: np.ndarray = field(default_factory=_zeros)
    peaks: np.ndarray = field(default_factory=_zeros)

    def add(self, run: Run, maps: Maps) -> None:
        """Add the samples of a block, (n, 6) each."""
        known = run.disturbance_estimate if run.disturbance is None else run.disturbance
        values = run.nu, run.nu_d, run.tau, run.disturbance_estimate, known
        nu, nu_d, tau, f, F = (
            np.ascontiguousarray(known_or_zero(v), float).ravel() for v in values
        )
        self.count += len(run.t)
        self.first, self.last = min(self.first, run.t[0]), max(self.last, run.t[-1])
        adding = _compiled() if run.source == SIMULATED else add_columns
        adding(nu, nu_d, tau, f, F, maps, self.sums, self.squares, self.peaks)

    def joined(self, other: 'Moments') -> 'Moments':
        """Moments of these samples and those of the other together."""
        return Moments(
            self.count + other.count,
            min(self.first, other.first),
            max(self.last, other.last),
            self.sums + other.sums,
            self.squares + other.squares,
            np.maximum(self.peaks, other.peaks),
        )

    def mean(self, signal: int) -> np.ndarray:
        """Mean (6,) of a signal."""
        return self.sums[signal] / self.count

    def rms(self, signal: int) -> list[float]:
        """Root mean squares of a signal."""
        return np.sqrt(self.squares[signal] / self.count).tolist()

    def peak(self, signal: int) -> list[float]:
        """Largest magnitudes of a signal."""
        return self.peaks[signal].tolist()


class Tally:
    """Moments of the parts of a run between some times.

    Parameters
    ----------
    maps : of its vehicle
    times : s; a sample at one of them belongs to the part behind it

    """

    def __init__(self, maps: Maps, times: Iterable[float]):
        self._maps, self._windows = maps, Windows(times)
        self._parts = [Moments() for _ in range(self._windows.parts)]

    def add(self, block: Run) -> None:
        """Add the next samples."""
        for i, inside in self._windows.split(block.t):
            self._parts[i].add(block.part(inside), self._maps)

    def between(self, first: float | None = None, last: float | None = None) -> Moments:
        """Moments of the samples from one of the times up to another; None: of the run's end."""
        parts = (self._parts[i] for i in self._windows.between(first, last))
        return reduce(Moments.joined, parts, Moments())
