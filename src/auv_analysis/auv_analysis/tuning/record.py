"""What a closed loop costs, reduced while it runs: no sample is kept."""

from typing import Any, NamedTuple

import numpy as np

from auv_analysis.simulation.records import Sample
from auv_analysis.simulation.reduction import at_start, keep_divergence, keep_last
from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, select
from auv_dynamics.kernel.six import (
    Six,
    Vector,
    diag,
    sub,
    upper,
    upper_T,
    vector,
)
from auv_gvc_controller.laws.model import ControlModel


class Cost(NamedTuple):
    """What is gathered of a run's samples; per vehicle, in a batch as lanes.

    Attributes
    ----------
    late : index of the first sample after the transient
    Upsilon, Upsilon_inv, N : of the vehicle file's M, (4), (9)
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
        known = at_start(model, band, step, like)
        return cls(**{name: known.get(name, like(1, 0.0)) for name in cls._fields})

    @staticmethod
    def fill_record(record: 'Cost', k: int, sample: Sample) -> None:
        """Add sample k: M = U^-T N U^-1 makes both forms sums of squares."""
        error = sub(sample.nu_d, vector(sample.x, 7))
        in_xi, in_pi = upper(record.Upsilon_inv, error), upper_T(record.Upsilon, sample.applied)
        energy = half_product(diag(record.N, in_xi), in_xi)
        effort = half_product(quotient(in_pi, record.N), in_pi)
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
def half_product(a: Vector, b: Vector) -> Number:
    """Half of a^T b."""
    whole = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
    return 0.5 * whole


@helper
def quotient(a: Vector, N: Vector) -> Six:
    """N^-1 a with the diagonal N (6,)."""
    return (a[0] / N[0], a[1] / N[1], a[2] / N[2], a[3] / N[3], a[4] / N[4], a[5] / N[5])
