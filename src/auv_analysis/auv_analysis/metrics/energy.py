"""Kinetic energy and its shares in generalised velocity components, equation (30)."""

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number


@helper
def component(N: Number, xi: Number) -> Number:
    """1/2 N_i xi_i^2 of one number or of arrays: kg, kg m2 and m/s, rad/s to J; equation (30)."""
    return 0.5 * N * xi * xi


def generalised_velocity(Upsilon_inv: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Xi = Upsilon^-1 nu, (4) and (31): nu (..., 6) in m/s, rad/s to xi (..., 6)."""
    return nu @ Upsilon_inv.T


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
    """Shares of (30) in %: components (..., 6) in J to (..., 6); zero where nothing moves."""
    total = components.sum(axis=-1, keepdims=True)
    return 100.0 * np.divide(components, total, out=np.zeros_like(components), where=total > 0)
