"""The model in a law: the terms of (1) and the decomposition of M, (4) and (9)."""

from typing import NamedTuple

import numpy as np

from auv_dynamics.vehicle.model import Model
from auv_dynamics.vehicle.vehicle import Vehicle, row_major


def decompose(M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Upsilon and N of M = Upsilon^-T N Upsilon^-1, with nu = Upsilon xi.

    M = L N L^T with L unit lower triangular, and Upsilon = L^-T: the direction is from xi to nu.

    Parameters
    ----------
    M : (..., 6, 6) inertia with added mass, symmetric positive definite

    Returns
    -------
    Upsilon : (..., 6, 6) upper triangular, unit diagonal
    N : (..., 6) diagonal of N, positive; kg and kg m2

    Raises
    ------
    ValueError : M is not a symmetric positive definite (6, 6) matrix

    Equations (4), (9); the scaling by a unit diagonal is the one that gives (38).

    """
    M = np.asarray(M, float)
    if M.shape[-2:] != (6, 6) or not np.all(np.isfinite(M)):
        raise ValueError(f'expected a finite (6, 6) matrix M, found shape {M.shape}')
    size = np.abs(M).max(axis=(-2, -1))
    if np.any(np.abs(M - np.swapaxes(M, -2, -1)).max(axis=(-2, -1)) > 1e-9 * size):
        raise ValueError('expected a symmetric M, found M[i][j] != M[j][i]')
    try:
        lower = np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        smallest = np.linalg.eigvalsh(M)[..., 0].min()
        text = f'expected a positive definite M, found smallest eigenvalue {smallest:.4g}'
        raise ValueError(text) from None
    scale = np.diagonal(lower, axis1=-2, axis2=-1)
    return inverse_upper(np.swapaxes(lower / scale[..., None, :], -2, -1)), scale**2


def inverse_upper(U: np.ndarray) -> np.ndarray:
    """Inverse of upper triangular (..., 6, 6) matrices of unit diagonal, exactly of that form."""
    inverse = np.broadcast_to(np.eye(6, dtype=U.dtype), U.shape).copy()
    for i in reversed(range(5)):
        row = U[..., i : i + 1, i + 1 :]
        inverse[..., i, i + 1 :] = -(row @ inverse[..., i + 1 :, i + 1 :])[..., 0, :]
    return inverse


class Range(NamedTuple):
    """Where a gain is searched: whether it is an inertia times what is bounded here, and how."""

    inertial: bool
    low: float
    high: float


class ControlModel(NamedTuple):
    """The `model` argument of a law: flat float64 arrays, row-major.

    Attributes
    ----------
    dynamics : M, D and hydrostatics of (1)
    Upsilon, Upsilon_inv : (36,) from xi to nu and back, unit upper triangular, (4)
    N : (6,) diagonal inertia, (9)

    """

    dynamics: Model
    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray


def control_model(vehicle: Vehicle) -> ControlModel:
    """Model of a vehicle, or of a fleet of them, as a law takes it."""
    Upsilon, N = decompose(vehicle.M)
    return ControlModel(vehicle.model, row_major(Upsilon), row_major(inverse_upper(Upsilon)), N)
