"""How much each degree of freedom is deformed by the others, equations (31) to (34)."""

import numpy as np

from auv_dynamics.signals import DOFS

NEGLIGIBLE = 1e-12  # an entry below this, relative to the largest, is a zero of the structure


def velocity_deformation(Upsilon_inv: np.ndarray) -> np.ndarray:
    """Matrix (6, 6) from nu to delta_xi, (33)."""
    return Upsilon_inv - np.eye(6)


def input_deformation(Upsilon: np.ndarray) -> np.ndarray:
    """Matrix (6, 6) from tau to delta_pi, (34)."""
    return (Upsilon - np.eye(6)).T


def delta_xi(Upsilon_inv: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Xi - nu, (33): nu (..., 6) in m/s, rad/s to (..., 6) in the same units."""
    return nu @ velocity_deformation(Upsilon_inv).T


def delta_pi(Upsilon: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Pi - tau with pi = Upsilon^T tau, (34): tau (..., 6) in N, N m to (..., 6)."""
    return tau @ input_deformation(Upsilon).T


def structural_zeros(Upsilon: np.ndarray, Upsilon_inv: np.ndarray) -> dict[str, list[str]]:
    """Degrees of freedom whose delta_xi or delta_pi vanishes for every motion.

    Row i of Upsilon^-1 - I gives delta_xi_i, column i of Upsilon - I gives delta_pi_i.
    """

    def empty(rows: np.ndarray) -> list[str]:
        size = np.abs(rows).max(axis=1)
        return [dof for dof, entry in zip(DOFS, size, strict=True) if entry <= NEGLIGIBLE]

    return {
        'delta_xi': empty(velocity_deformation(Upsilon_inv)),
        'delta_pi': empty(input_deformation(Upsilon)),
    }
