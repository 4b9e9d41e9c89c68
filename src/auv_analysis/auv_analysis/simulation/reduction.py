"""The figures of `summary.json`, reduced while the loop runs: no sample is kept."""

from typing import Any, NamedTuple

import numpy as np

from auv_analysis.metrics.energy import shares
from auv_analysis.metrics.settling import TRANSIENT, has_settled
from auv_analysis.metrics.signals import signals
from auv_analysis.simulation.closed_loop import Sample
from auv_dynamics.files.yaml_files import LARGEST
from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, select
from auv_dynamics.kernel.six import (
    Six,
    Vector,
    add,
    add_products,
    fill_vector,
    keep_largest,
    vector,
)
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import ControlModel


class Figures(NamedTuple):
    """What is gathered of a run's samples; per vehicle, in a batch as lanes.

    Attributes
    ----------
    late : index of the first sample after the transient
    Upsilon, Upsilon_inv, N : of the vehicle file's M, (4), (9)
    band : (6,) of a settled error, m/s and rad/s
    energy : (6,) sum of 1/2 N_i xi_i^2, (30)
    error_squares, error_late : (6,) sum of squares and largest after the transient of nu_d - nu
    outside : (6,) index of the last sample outside the band, -1 where there is none
    w_squares, w_late : (6,) the same two of w = f - F
    delta_xi, delta_pi : (6,) largest, (33) and (34)
    tau_squares, tau : (6,) sum of squares and largest of the command
    diverged : (1,) index of the first sample that is not finite, inf where there is none

    """

    late: int
    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray
    band: np.ndarray
    energy: np.ndarray
    error_squares: np.ndarray
    error_late: np.ndarray
    outside: np.ndarray
    w_squares: np.ndarray
    w_late: np.ndarray
    delta_xi: np.ndarray
    delta_pi: np.ndarray
    tau_squares: np.ndarray
    tau: np.ndarray
    diverged: np.ndarray

    @classmethod
    def start(cls, model: ControlModel, band: np.ndarray, step: float, like: Any) -> 'Figures':
        """Figures before the first sample.

        Parameters
        ----------
        model : of the vehicles, (6,) and (36,) or lanes of them
        band : (6,) or lanes
        step : s
        like : function that makes an array of (n,) or lanes of it, all of one number

        """
        known = at_start(model, band, step, like)
        return cls(**{name: known.get(name, like(6, 0.0)) for name in cls._fields})

    @staticmethod
    def fill_record(record: 'Figures', k: int, sample: Sample) -> None:
        """Add sample k."""
        nu = vector(sample.x, 7)
        error, w, tau, delta_xi, delta_pi, energy, _ = signals(
            nu, sample.nu_d, sample.tau, sample.f, sample.F, record
        )
        fill_vector(record.energy, 0, add(vector(record.energy, 0), energy))
        add_products(record.error_squares, error, error)
        add_products(record.w_squares, w, w)
        add_products(record.tau_squares, tau, tau)
        keep_largest(record.delta_xi, delta_xi)
        keep_largest(record.delta_pi, delta_pi)
        keep_largest(record.tau, tau)
        if k >= record.late:
            keep_largest(record.error_late, error)
            keep_largest(record.w_late, w)
        keep_last(record.outside, error, record.band, float(k))
        keep_divergence(record.diverged, k, sample)


def at_start(model: ControlModel, band: np.ndarray, step: float, like: Any) -> dict[str, Any]:
    """What every record has before the first sample; the parameters are those of `Figures.start`.

    Returns
    -------
    known : `late`, `Upsilon`, `Upsilon_inv`, `N`, `band`, `outside` and `diverged` of `Figures`

    """
    return {
        'late': int(np.ceil((TRANSIENT - 1e-9) / step)),
        'Upsilon': model.Upsilon,
        'Upsilon_inv': model.Upsilon_inv,
        'N': model.N,
        'band': band,
        'outside': like(6, -1.0),
        'diverged': like(1, np.inf),
    }


@helper
def keep_divergence(diverged: np.ndarray, k: int, sample: Sample) -> None:
    """Index k where sample k is the first that is not finite, in place."""
    good = size_of(sample) < LARGEST
    first = select(diverged[0] < k, diverged[0], float(k))
    diverged[0] = select(good, diverged[0], first)


@helper
def keep_last(last: np.ndarray, a: Vector, band: Vector, k: float) -> None:
    """Index k where a is outside its band, by component and in place."""
    last[0] = select(abs(a[0]) > band[0], k, last[0])
    last[1] = select(abs(a[1]) > band[1], k, last[1])
    last[2] = select(abs(a[2]) > band[2], k, last[2])
    last[3] = select(abs(a[3]) > band[3], k, last[3])
    last[4] = select(abs(a[4]) > band[4], k, last[4])
    last[5] = select(abs(a[5]) > band[5], k, last[5])


@helper
def sizes(a: Vector) -> Six:
    """Absolute values, by component."""
    return (abs(a[0]), abs(a[1]), abs(a[2]), abs(a[3]), abs(a[4]), abs(a[5]))


@helper
def size_of(sample: Sample) -> Number:
    """Sum of the absolute values of a sample; NaN or inf where one is not finite."""
    x, state = sample.x, sample.state
    total = sizes(sample.tau)  # six sums that do not wait for each other
    total = add(total, sizes(sample.applied))
    total = add(total, sizes(sample.f))
    total = add(total, sizes(sample.F))
    total = add(total, sizes(vector(x, 0)))
    total = add(total, sizes(vector(x, 7)))
    whole = state.shape[0] // 6 * 6
    for i in range(0, whole, 6):
        total = add(total, sizes(vector(state, i)))
    rest = abs(x[6])
    for i in range(whole, state.shape[0]):
        rest = rest + abs(state[i])
    return total[0] + total[1] + total[2] + total[3] + total[4] + total[5] + rest


SIX = (
    'kinetic_energy.mean_by_component', 'kinetic_energy.shares_percent', 'velocity_error.rms',
    'velocity_error.max_after_2s', 'velocity_error.settling_time', 'lumped_error.rms',
    'lumped_error.max_after_2s', 'coupling.delta_xi_max', 'coupling.delta_pi_max', 'effort.rms',
    'effort.max',
)  # fmt: skip
COLUMNS = ('diverged_at', 'kinetic_energy.mean', *(f'{name}.{dof}' for name in SIX for dof in DOFS))


def columns(found: Figures, samples: int, step: float) -> dict[str, np.ndarray]:
    """Figures as columns, named like the keys of `summary.json`.

    Parameters
    ----------
    found : of B runs, arrays (B, 6) and (B, 1)
    samples : n + 1 of each run
    step : s

    Returns
    -------
    columns : name -> (B,); NaN where a run diverged or a figure does not exist

    """
    energy = found.energy / samples
    late = samples > found.late
    inside = has_settled(found.outside, samples)
    settled = np.where(inside, (found.outside + 1) * step, np.nan)
    six = (
        energy,
        shares(energy),
        np.sqrt(found.error_squares / samples),
        found.error_late if late else np.nan * found.error_late,
        settled,
        np.sqrt(found.w_squares / samples),
        found.w_late if late else np.nan * found.w_late,
        found.delta_xi,
        found.delta_pi,
        np.sqrt(found.tau_squares / samples),
        found.tau,
    )
    diverged = np.isfinite(found.diverged[:, 0])
    result = {'diverged_at': np.where(diverged, found.diverged[:, 0] * step, np.nan)}
    result['kinetic_energy.mean'] = np.where(diverged, np.nan, energy.sum(axis=1))
    for name, values in zip(SIX, six, strict=True):
        for i, dof in enumerate(DOFS):
            result[f'{name}.{dof}'] = np.where(diverged, np.nan, values[:, i])
    return result
