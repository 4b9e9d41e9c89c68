"""Kinetic energy and its shares in generalised velocity components, equation (30)."""

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number

NEGLIGIBLE = 1e-12  # an entry below this is a zero of the structure of M


def depends_on_known(weights: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Rows (m,) of a linear map (m, k) that need none of the components (k,) not known."""
    return ~np.any((np.abs(weights) > NEGLIGIBLE) & ~known, axis=1)


def mapped(weights: np.ndarray, signals: np.ndarray) -> np.ndarray:
    """Linear map (m, k) of signals (..., k): NaN where it needs one that is NaN throughout."""
    known = ~np.isnan(signals.reshape(-1, signals.shape[-1])[:1]).any(axis=0)
    if known.all():
        return signals @ weights.T
    found = np.where(known, signals, 0.0) @ weights.T
    return np.where(depends_on_known(weights, known), found, np.nan)


@helper
def component(N: Number, xi: Number) -> Number:
    """1/2 N_i xi_i^2 of one number or of arrays: kg, kg m2 and m/s, rad/s to J; equation (30)."""
    return 0.5 * N * xi * xi


def generalised_velocity(Upsilon_inv: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Xi = Upsilon^-1 nu, (4) and (31): nu (..., 6) in m/s, rad/s to xi (..., 6)."""
    return mapped(Upsilon_inv, nu)


def kinetic_energy(Upsilon_inv: np.ndarray, N: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """1/2 N_i xi_i^2, whose sum is 1/2 nu^T M nu.

    Parameters
    ----------
    Upsilon_inv : (6, 6)
    N : (6,) kg, kg m2
    nu : (..., 6) m/s, rad/s, body frame

    Returns
    -------
    components : (..., 6) J; equation (30)

    """
    return component(N, generalised_velocity(Upsilon_inv, nu))


def shares(components: np.ndarray) -> np.ndarray:
    """Shares of (30) in %: components (..., 6) in J to (..., 6); zero where nothing moves.

    All are NaN where a component is: the total is not known then.
    """
    total = components.sum(axis=-1, keepdims=True)
    still = np.where(np.isnan(total), np.nan, np.zeros_like(components))
    return 100.0 * np.divide(components, total, out=still, where=total > 0)
