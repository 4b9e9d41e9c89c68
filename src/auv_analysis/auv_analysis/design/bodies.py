"""Inertia that small bodies add to a vehicle, and its decomposition; complex numbers pass through.

A derivative by the complex step, Im f(x + ih) / h, has no cancellation, but asks that nothing on
the way takes an absolute value, a conjugate or a branch. `np.linalg.cholesky` conjugates, so the
decomposition is written here a second time, for complex symmetric matrices.
"""

import numpy as np

from auv_dynamics.vehicle.vehicle import rigid_body_matrix
from auv_gvc_controller.laws.decomposition import inverse_upper

DISC = 8 / 3  # added mass of a thin disc that moves broadside, in rho a^3: Lamb 1932
DISC_TURNED = 16 / 45  # its added moment of inertia about a diameter, in rho a^5: Lamb 1932
DISC_DRAG = 1.17  # drag coefficient of a disc broadside, of its area: Hoerner 1965


def point_mass(mass: float | np.ndarray, r: np.ndarray) -> np.ndarray:
    """M_RB of point masses (...,) in kg, or of one, at r (..., 3) in m: (..., 6, 6)."""
    return rigid_body_matrix(np.broadcast_to(mass, r.shape[:-1]), r, np.zeros((3, 3)), 'cg')


def normal_of(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3): azimuth from surge to sway, elevation from there to heave, deg."""
    turned, raised = azimuth * np.pi / 180, elevation * np.pi / 180
    flat = np.cos(raised)
    parts = (flat * np.cos(turned), flat * np.sin(turned), np.sin(raised))
    return np.stack(parts, axis=-1)


def disc_mass(radius: np.ndarray, density: float) -> np.ndarray:
    """Added mass in kg of thin discs that move broadside: radius (...,) in m."""
    return DISC * density * radius**3


def _disc_way(r: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """H (..., 6) with h nu the velocity of the point r along a normal, (..., 3) each."""
    return np.concatenate([normal, np.cross(r, normal)], axis=-1)


def disc_added_mass(
    radius: np.ndarray, r: np.ndarray, normal: np.ndarray, density: float
) -> np.ndarray:
    """M_A of thin discs in unbounded water, positive semidefinite.

    Parameters
    ----------
    radius : (...,) m
    r, normal : (..., 3) centre in m and unit normal, body frame
    density : of the water, kg/m3

    Returns
    -------
    M_A : (..., 6, 6) m_a h h^T, h = [n; r x n], and the moment about the disc's own diameters

    """
    way = _disc_way(r, normal)
    M_A = disc_mass(radius, density)[..., None, None] * way[..., :, None] * way[..., None, :]
    turned = np.eye(3) - normal[..., :, None] * normal[..., None, :]
    own = DISC_TURNED * density * radius**5
    M_A[..., 3:, 3:] += own[..., None, None] * turned
    return M_A


def disc_drag(radius: np.ndarray, r: np.ndarray, normal: np.ndarray, density: float) -> np.ndarray:
    """What thin discs add to the diagonal of the quadratic damping, (..., 6).

    Exact for a motion in one degree of freedom alone. The products of two velocities, which the
    format of a vehicle file has no place for, are left out; it dissipates for every motion.

    Parameters are those of `disc_added_mass`.
    """
    way = _disc_way(r, normal)
    size = way * np.where(way.real < 0, -1.0, 1.0)
    return (0.5 * density * DISC_DRAG * np.pi * radius**2)[..., None] * size**3


def decomposed(M: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Upsilon, its inverse and N of matrices M = Upsilon^-T N Upsilon^-1, (4) and (9).

    Parameters
    ----------
    M : (..., 6, 6) symmetric, real or complex; where a pivot is not positive, N says so

    Returns
    -------
    Upsilon, Upsilon_inv : (..., 6, 6) upper triangular, unit diagonal
    N : (..., 6)

    """
    rest = np.array(M)
    upper = np.zeros_like(rest)  # L^T of M = L N L^T
    N = np.zeros(rest.shape[:-1], rest.dtype)
    with np.errstate(all='ignore'):
        for k in range(6):
            N[..., k] = rest[..., k, k]
            upper[..., k, k:] = rest[..., k, k:] / N[..., k, None]
            upper[..., k, k] = 1.0
            row = upper[..., k, :]
            rest = rest - N[..., k, None, None] * row[..., :, None] * row[..., None, :]
        return inverse_upper(upper), upper, N
