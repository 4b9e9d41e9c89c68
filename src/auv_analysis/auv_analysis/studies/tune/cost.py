"""Error, effort and settling of closed loops: the measures that laws are tuned and compared by.

Metres and radians, newtons and newton metres are added up by the inertia, so that no weights are
chosen: an error is a kinetic energy, as in (30), and an effort the kinetic energy per second
squared that a wrench gives to the vehicle at rest. Both are the same in every body frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.metrics.settling import TRANSIENT, has_settled, settling_time
from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import run_batch
from auv_analysis.simulation.closed_loop import Sample
from auv_analysis.simulation.reduction import at_start, keep_divergence, keep_last
from auv_analysis.simulation.rollouts import batch_of
from auv_analysis.simulation.variants import Variants, merged, packed_variants
from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, select
from auv_dynamics.kernel.six import Vector, sub, upper, upper_T, vector
from auv_gvc_controller.laws.model import ControlModel


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


class Cost(NamedTuple):
    """Cost of a run, reduced while it runs; per vehicle, in a batch as lanes.

    Attributes
    ----------
    late : index of the first sample after the transient
    Upsilon, Upsilon_inv, N : of the vehicle file's M, (4), (9)
    N_inv : (6,) inverse of N
    band : (6,) of a settled error, m/s and rad/s
    error, moment : (1,) sum of 1/2 nu_err^T M nu_err, and of that times the sample's index
    late_error : (1,) its largest after the transient
    effort, peak_effort : (1,) sum of 1/2 tau^T M^-1 tau of the applied wrench, and its largest
    outside : (6,) index of the last sample outside the band, -1 where there is none
    diverged : (1,) index of the first sample that is not finite, inf where there is none

    """

    late: int
    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray
    N_inv: np.ndarray
    band: np.ndarray
    error: np.ndarray
    moment: np.ndarray
    late_error: np.ndarray
    effort: np.ndarray
    peak_effort: np.ndarray
    outside: np.ndarray
    diverged: np.ndarray

    @classmethod
    def start(cls, model: ControlModel, band: np.ndarray, step: float, like: Any) -> 'Cost':
        """Cost before the first sample; the parameters are those of `Figures.start`."""
        known = at_start(model, band, step, like) | {'N_inv': 1.0 / model.N}
        return cls(**{name: known.get(name, like(1, 0.0)) for name in cls._fields})

    @staticmethod
    def fill_record(record: 'Cost', k: int, sample: Sample) -> None:
        """Add sample k: M = U^-T N U^-1 makes both forms sums of squares."""
        error = sub(sample.nu_d, vector(sample.x, 7))
        in_xi, in_pi = upper(record.Upsilon_inv, error), upper_T(record.Upsilon, sample.applied)
        energy = half_form(record.N, in_xi)
        effort = half_form(record.N_inv, in_pi)
        record.error[0] = record.error[0] + energy
        record.moment[0] = record.moment[0] + float(k) * energy
        record.effort[0] = record.effort[0] + effort
        peak = record.peak_effort[0]
        record.peak_effort[0] = select(effort > peak, effort, peak)
        if k >= record.late:
            largest = record.late_error[0]
            record.late_error[0] = select(energy > largest, energy, largest)
        keep_last(record.outside, error, record.band, float(k))
        keep_divergence(record.diverged, k, sample)


@helper
def half_form(weights: Vector, a: Vector) -> Number:
    """Half of the sum of squares of a (6,), each with its weight."""
    first = weights[0] * a[0] * a[0] + weights[1] * a[1] * a[1] + weights[2] * a[2] * a[2]
    last = weights[3] * a[3] * a[3] + weights[4] * a[4] * a[4] + weights[5] * a[5] * a[5]
    return 0.5 * (first + last)


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


def measures_of_run(run: Run) -> Measures:
    """The same measures (1,) from the samples of a run, with M and its inverse as they stand."""
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


def joined(parts: Sequence[Measures]) -> Measures:
    """Measures of several groups of closed loops as one."""
    return Measures(*map(np.concatenate, zip(*parts, strict=True)))


def measured(
    scenario: Scenario, controller: str, gains: Mapping[str, np.ndarray], hold: Hold, threads: int
) -> Measures:
    """Measures (B,) of a scenario's closed loop with gains (B, ...)."""
    count = len(next(iter(gains.values()))) if gains else 1
    columns = {f"controllers.'{controller}'.{gain}": v for gain, v in gains.items()}
    rows, seeds = np.arange(count), np.full(count, scenario.data['seed'])
    variants, good = packed_variants(scenario, controller, columns, rows, seeds)
    found = _run(variants, hold, threads)
    return Measures(*(np.where(good, values, np.nan) for values in found))


def of_each(scenario: Scenario, hold: Hold) -> dict[str, Measures]:
    """Measures (1,) of each controller of a scenario; those of one law run in one batch."""
    groups: dict[Any, list[tuple[str, Variants]]] = {}
    row, seeds = np.zeros(1, int), np.array([scenario.data['seed']])
    for name in scenario.controllers:
        variants, _ = packed_variants(scenario, name, {}, row, seeds)
        groups.setdefault(variants.structure, []).append((name, variants))
    found: dict[str, Measures] = {}
    for members in groups.values():
        measures = _run(merged([variants for _, variants in members]), hold)
        for i, (name, _) in enumerate(members):
            found[name] = measures.part(slice(i, i + 1))
    return found


def _run(variants: Variants, hold: Hold, threads: int = 1) -> Measures:
    batch = replace(batch_of(variants, hold), record=Cost)
    return measures_of(run_batch(batch, threads), batch.steps + 1, batch.step)
