"""Figures of changed vehicles that move as in a run; complex numbers pass through."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.design.bodies import decomposed
from auv_analysis.design.couplings import COUPLINGS, Sizes, effort_of, shares_of
from auv_analysis.design.motion import Motion
from auv_analysis.design.space import Space

EVERY = tuple(range(len(COUPLINGS)))


class Figures(NamedTuple):
    """What a change is judged by; any number of leading axes.

    Attributes
    ----------
    ratios : (..., m) largest magnitudes of some couplings, after by before
    shares : (..., 12) of `shares_of`
    effort : (...,) mean of tau^T M^-1 tau, after by before
    unrest : (...,) how much worse the vehicle is at rest, see `Space.unrest`
    size : (...,) of the change, see `Space.size`
    definite : (...,) whether M is positive definite

    """

    ratios: np.ndarray
    shares: np.ndarray
    effort: Any
    unrest: Any
    size: Any
    definite: Any


class Signals(NamedTuple):
    """Of changed vehicles: delta_xi beside delta_pi (..., n, 12), xi, pi, tau (..., n, 6), N."""

    deformed: np.ndarray
    xi: np.ndarray
    pi: np.ndarray
    tau: np.ndarray
    N: np.ndarray


@dataclass(frozen=True, eq=False)
class Prediction:
    """What changes of a vehicle would do to its couplings if it moved as in a run.

    Attributes
    ----------
    space : the changes
    motion : samples of a run
    before : sizes of the couplings of the unchanged vehicle
    smooth : (12,) its smooth largest magnitudes; none: from the motion, which must be its own

    """

    space: Space
    motion: Motion
    before: Sizes
    smooth: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        """Fill in what the unchanged vehicle does in its own motion."""
        if not len(self.smooth):
            peaks = smooth_peak(self.signals(self.space.unchanged).deformed)
            object.__setattr__(self, 'smooth', np.where(peaks > 0, peaks, np.inf))

    @cached_property
    def M_inv(self) -> np.ndarray:
        """Inverse of the unchanged M, by which the effort is weighed."""
        return np.linalg.inv(self.space.vehicle.M)

    def figures(self, x: np.ndarray, targets: tuple[int, ...] = EVERY) -> Figures:
        """Figures of changes (..., 13), real or complex; `targets` are places in `COUPLINGS`."""
        (deformed, xi, pi, tau, N), weights = self.signals(x), self.motion.weights
        return Figures(
            ratios=smooth_peak(deformed[..., targets]) / self.smooth[list(targets)],
            shares=shares_of(deformed[..., :6], deformed[..., 6:], N, xi, pi, weights),
            effort=effort_of(tau, self.M_inv, weights) / self.before.by_effort,
            unrest=self.space.unrest(x),
            size=self.space.size(x),
            definite=(N.real > 0).all(axis=-1),
        )

    def ratios(self, x: np.ndarray) -> np.ndarray:
        """Predicted largest magnitudes (12,) after a change (13,), by those before; 0 by 0 is 0."""
        peaks = np.abs(self.signals(x).deformed).max(axis=-2)
        return peaks / np.where(self.before.peaks > 0, self.before.peaks, np.inf)

    def signals(self, x: np.ndarray) -> Signals:
        """Signals of changes (..., 13) at the samples of the motion."""
        change = self.space.difference(x)
        Upsilon, inverse, N = decomposed(self.space.vehicle.M + change.M)
        tau, nu = self.motion.inputs(change.row), self.motion.nu
        xi, pi = nu @ np.swapaxes(inverse, -2, -1), tau @ Upsilon
        return Signals(np.concatenate([xi - nu, pi - tau], axis=-1), xi, pi, tau, N)


def smooth_peak(signals: np.ndarray) -> np.ndarray:
    """(mean of s^8)^(1/8) over the samples of signals: (..., n, m) to (..., m).

    Zero, with a zero derivative, where a signal is zero throughout.
    """
    mean = (((signals**2) ** 2) ** 2).mean(axis=-2)
    still = np.abs(mean) < np.finfo(float).tiny
    return np.where(still, 0.0, (mean + still) ** 0.125)
