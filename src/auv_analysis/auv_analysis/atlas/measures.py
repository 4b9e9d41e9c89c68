"""Couplings by inertia as pure numbers, which neither length nor mass units change.

With D = diag(M) the kinetic energy is T = 1/2 y^T R y, where y = D^1/2 nu and R is the inertial
correlation D^-1/2 M D^-1/2. Its diagonal is 1; what is beside it is coupling.
"""

import numpy as np

from auv_gvc_controller.decomposition import decompose, inverse_upper


def inertial_correlation(M: np.ndarray) -> np.ndarray:
    """R_ij = M_ij / sqrt(M_ii M_jj): how much of the kinetic energy of two is their cross term.

    In a motion of i and j with equal energies 1/2 M_ii nu_i^2 = 1/2 M_jj nu_j^2, the cross term
    M_ij nu_i nu_j is R_ij times the sum of the two, and no motion of the two has a larger part.

    Parameters
    ----------
    M : (6, 6) symmetric positive definite

    Returns
    -------
    R : (6, 6) symmetric, 1 on its diagonal, within -1 and 1; no unit

    """
    root = np.sqrt(np.diagonal(M))
    return M / np.outer(root, root)


def velocity_shares(M: np.ndarray) -> np.ndarray:
    """Shares (6, 6) of the energy of a motion in j alone that the decomposition finds in xi_i.

    S = N^1/2 Upsilon^-1 D^-1/2 is upper triangular and S^T S = R, so that the squares of a column
    sum to 1: of 1/2 M_jj nu_j^2, 1/2 N_i xi_i^2 is the part S_ij^2. Beside the diagonal it is what
    deforms xi_i, (31) and (33), made unit-free by (30).

    Parameters
    ----------
    M : (6, 6) symmetric positive definite

    Returns
    -------
    shares : (6, 6) in 0..1, row i of column j; upper triangular, columns sum to 1

    """
    Upsilon, N = decompose(M)
    S = np.sqrt(N)[:, None] * inverse_upper(Upsilon) / np.sqrt(np.diagonal(M))
    return S**2


def input_shares(M: np.ndarray) -> np.ndarray:
    """Shares (6, 6) of the energy that an impulse in j alone leaves, that lie in xi_i.

    An impulse p leaves the energy 1/2 p^T M^-1 p, and with pi = Upsilon^T p that is the sum of
    1/2 pi_i^2 / N_i: of an impulse in j, Upsilon_ji^2 / (N_i (M^-1)_jj) is the part of i. Beside
    the diagonal it is what deforms pi_i, (32) and (34).

    Parameters
    ----------
    M : (6, 6) symmetric positive definite

    Returns
    -------
    shares : (6, 6) in 0..1, row i of column j; lower triangular, columns sum to 1

    """
    Upsilon, N = decompose(M)
    weights = Upsilon.T**2 / N[:, None]
    return weights / weights.sum(axis=0)


def coupling_strength(M: np.ndarray) -> float:
    """Largest size of all cross terms together, as a part of the energy without them.

    Over all motions, y^T (R - 1) y / y^T y lies between the extreme eigenvalues of R - 1; the
    larger magnitude of the two is returned. Zero where M is diagonal, at least max abs(R_ij).
    """
    values = np.linalg.eigvalsh(inertial_correlation(M))
    return float(max(values[-1] - 1.0, 1.0 - values[0]))
