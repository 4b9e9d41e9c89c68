"""What laws are compared by: a number for each of error, effort, rest and speed.

Metres and radians, newtons and newton metres are added up by the inertia, so that no weights are
chosen: an error is a kinetic energy, as in (30), and an effort the kinetic energy per second
squared that a wrench gives to the vehicle at rest. Both are the same in every body frame.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auv_analysis.metrics.summary import (
    SETTLED,
    TRANSIENT,
    has_settled,
    settling_time,
)
from auv_analysis.runs.run import Run
from auv_analysis.tuning.record import Cost


class Measures(NamedTuple):
    """Measures of B closed loops, each (B,); NaN where a loop diverged.

    Attributes
    ----------
    error : mean of 1/2 nu_err^T M nu_err over the run, J
    weighted_error : the same, weighted by the time since the start, J
    effort : mean of 1/2 tau^T M^-1 tau over the run, tau the wrench applied, J/s2
    late_error : largest of the error's energy 2 s after the start, J
    peak_effort : largest of the effort's form, J/s2
    settling : from when on all errors stay in their bands, s; infinite where one has not settled

    """

    error: np.ndarray
    weighted_error: np.ndarray
    effort: np.ndarray
    late_error: np.ndarray
    peak_effort: np.ndarray
    settling: np.ndarray

    def part(self, keep: np.ndarray | slice) -> 'Measures':
        """Those that a mask, indices or a slice keep."""
        return Measures(*(values[keep] for values in self))


def measures_of(cost: Cost, samples: int, step: float) -> Measures:
    """Measures of closed loops.

    Parameters
    ----------
    cost : of B runs, arrays (B, 1) and (B, 6)
    samples : n + 1 of each run
    step : s

    Returns
    -------
    measures : Measures of (B,) arrays

    """
    inside = has_settled(cost.outside, samples)
    settled = np.where(inside, (cost.outside + 1) * step, np.inf)
    late = cost.late_error if samples > cost.late else np.nan * cost.late_error
    values = (
        cost.error[:, 0] / samples,
        cost.moment[:, 0] / (samples * (samples - 1) / 2),
        cost.effort[:, 0] / samples,
        late[:, 0],
        cost.peak_effort[:, 0],
        settled.max(axis=1),
    )
    diverged = np.isfinite(cost.diverged[:, 0])
    return Measures(*(np.where(diverged, np.nan, value) for value in values))


@dataclass(frozen=True)
class Meaning:
    """A measure in words: a short name, its unit, and one line for a reader without the paper."""

    label: str
    unit: str
    text: str


MEANINGS = {
    'weighted_error': Meaning(
        'time-weighted error',
        'J',
        'mean of ½ Δνᵀ M Δν, the kinetic energy of the velocity error, weighted by the time since '
        'the start (ITSE)',
    ),
    'error': Meaning('error', 'J', 'the same without the weight (ISE)'),
    'effort': Meaning(
        'effort',
        'J/s²',
        'mean of ½ τᵀ M⁻¹ τ: the kinetic energy that the wrench alone would give the vehicle '
        'from rest in a second',
    ),
    'late_error': Meaning(f'error after {TRANSIENT:g} s', 'J', 'largest ½ Δνᵀ M Δν from then on'),
    'peak_effort': Meaning('peak effort', 'J/s²', 'largest ½ τᵀ M⁻¹ τ'),
    'settling': Meaning('settled', 's', f'time from which every error stays within {SETTLED}'),
}


def measures_of_run(run: Run) -> Measures:
    """The same measures (1,) from the samples of a run, with M and its inverse as they stand.

    Parameters
    ----------
    run : of `simulate`

    """
    M = run.vehicle.M
    error, tau, k = run.nu_d - run.nu, run.tau_applied, np.arange(len(run.t))
    energy = 0.5 * np.einsum('ni,ij,nj->n', error, M, error)
    effort = 0.5 * np.einsum('ni,in->n', tau, np.linalg.solve(M, tau.T))
    late = energy[run.t >= TRANSIENT - 1e-9]
    times = settling_time(run.t, error, run.nu_d)
    settled = max(np.inf if t is None else t for t in times)
    values = (
        energy.mean(), (k * energy).sum() / k.sum(), effort.mean(),
        late.max() if len(late) else np.nan, effort.max(), settled,
    )  # fmt: skip
    return Measures(*(np.array([value]) for value in values))
