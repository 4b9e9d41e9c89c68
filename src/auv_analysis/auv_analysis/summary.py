"""The figures of a run, as written to summary.json."""

from typing import Any

import numpy as np

from auv_analysis.coupling import delta_pi, delta_xi, structural_zeros
from auv_analysis.energy import kinetic_energy, shares
from auv_analysis.lyapunov import lyapunov
from auv_analysis.run import Run
from auv_gvc_controller.gains import body_gains
from auv_gvc_controller.laws import make_gains
from auv_gvc_controller.model import control_model

TRANSIENT = 2.0  # s, after which the paper reads off the errors
BAND = 0.02  # of the peak of nu_d: settled
SMALLEST_BAND = 0.005  # m/s, rad/s


def summarize(run: Run, window: tuple[float, float] | None = None) -> dict[str, Any]:
    """Figures of a run as a plain dict, ready for JSON.

    Parameters
    ----------
    run : of `simulate` or `load_run`
    window : (from, to) in s over whose samples energy is averaged; none: the whole run

    Returns
    -------
    summary : the keys of `summary.json`; what is not known is None, never NaN

    """
    model = control_model(run.vehicle)
    Upsilon, Upsilon_inv = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    gains = [None, None]
    if run.gains:
        gains = [K.tolist() for K in body_gains(make_gains(run.law, run.gains), model)]
    error = run.nu_d - run.nu
    return {
        'scenario': run.scenario,
        'law': run.law,
        'source': run.source,
        'duration': run.duration,
        'step': run.step,
        'samples': len(run.t),
        'kinetic_energy': _energy(run, Upsilon_inv, model.N, window),
        'velocity_error': {
            'rms': _rms(error),
            'max_after_2s': _max_after_transient(run.t, error),
            'settling_time': settling_time(run.t, error, run.nu_d),
        },
        'lumped_error': _lumped_error(run),
        'coupling': {
            'delta_xi_max': _max(delta_xi(Upsilon_inv, run.nu)),
            'delta_pi_max': _max(delta_pi(Upsilon, run.tau)),
            'structural_zeros': structural_zeros(Upsilon, Upsilon_inv),
        },
        'effort': {'rms': _rms(run.tau), 'max': _max(run.tau)},
        'gains': {'K_D': gains[0], 'K_f': gains[1]},
        'decomposition': {'Upsilon': Upsilon.tolist(), 'N': model.N.tolist()},
        'lyapunov': lyapunov(run, model),
        'notes': list(run.notes),
    }


def lumped_error(run: Run) -> np.ndarray | None:
    """W = f - F in the body frame, (n + 1, 6) in N, N m; None where F is not known."""
    return None if run.disturbance is None else run.disturbance_estimate - run.disturbance


def band_of(peak: np.ndarray) -> np.ndarray:
    """Band of a settled error for the peak (6,) of abs(nu_d), m/s and rad/s."""
    return np.maximum(BAND * peak, SMALLEST_BAND)


def settling_time(t: np.ndarray, error: np.ndarray, nu_d: np.ndarray) -> list[float | None]:
    """Time from which each error stays within its band; None when it ends outside.

    The band is 2 % of the peak of nu_d of that degree of freedom, at least 0.005 m/s or rad/s.

    Parameters
    ----------
    t : (n,) s
    error, nu_d : (n, 6) m/s, rad/s

    """
    band = band_of(np.abs(nu_d).max(axis=0))
    times: list[float | None] = []
    for i in range(6):
        outside = np.flatnonzero(np.abs(error[:, i]) > band[i])
        if len(outside) == 0:
            times.append(float(t[0]))
        elif outside[-1] == len(t) - 1:
            times.append(None)
        else:
            times.append(float(t[outside[-1] + 1]))
    return times


def _energy(
    run: Run, Upsilon_inv: np.ndarray, N: np.ndarray, window: tuple[float, float] | None
) -> dict[str, Any]:
    first, last = window or (float(run.t[0]), float(run.t[-1]))
    inside = (run.t >= first - run.step / 2) & (run.t <= last + run.step / 2)
    if inside.sum() < 2:
        return {
            'mean': None,
            'mean_by_component': None,
            'shares_percent': None,
            'window': [first, last],
        }
    components = kinetic_energy(Upsilon_inv, N, run.nu[inside]).mean(axis=0)
    return {
        'mean': float(components.sum()),
        'mean_by_component': components.tolist(),
        'shares_percent': shares(components).tolist(),
        'window': [float(run.t[inside][0]), float(run.t[inside][-1])],
    }


def _lumped_error(run: Run) -> dict[str, Any]:
    w = lumped_error(run)
    if w is None:
        return {'rms': None, 'max_after_2s': None}
    return {'rms': _rms(w), 'max_after_2s': _max_after_transient(run.t, w)}


def _rms(values: np.ndarray) -> list[float]:
    return np.sqrt(np.mean(values**2, axis=0)).tolist()


def _max(values: np.ndarray) -> list[float]:
    return np.abs(values).max(axis=0).tolist()


def _max_after_transient(t: np.ndarray, values: np.ndarray) -> list[float] | None:
    after = t >= t[0] + TRANSIENT - 1e-9
    return _max(values[after]) if after.any() else None
