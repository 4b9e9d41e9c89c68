"""Attitude and the kinematic equation (2): NED earth frame, FSD body frame, Euler ZYX outside.

Inside the kernel attitude is the unit quaternion q = (w, x, y, z) from body to NED.
"""

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number
from auv_dynamics.kernel.six import Vector

GIMBAL = 1e-12  # distance of |sin(theta)| from 1 below which phi is put to 0 and psi takes the rest


def _first(a: np.ndarray) -> np.ndarray:
    """Put the last axis first: `np.moveaxis` takes longer than the rest of a single rotation."""
    return a.transpose(-1, *range(a.ndim - 1))


def quaternion(euler: np.ndarray) -> np.ndarray:
    """Unit quaternion of ZYX Euler angles.

    Parameters
    ----------
    euler : (..., 3) phi, theta, psi in rad

    Returns
    -------
    q : (..., 4) w, x, y, z, body to NED

    """
    half = _first(np.asarray(euler, float) / 2)
    (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )


def rotation(q: np.ndarray) -> np.ndarray:
    """R(q): body to NED.

    Parameters
    ----------
    q : (..., 4) unit quaternions w, x, y, z

    Returns
    -------
    R : (..., 3, 3)

    """
    w, x, y, z = _first(np.asarray(q, float))
    R = np.empty((*w.shape, 3, 3))
    R[..., 0, 0], R[..., 1, 1] = 1 - 2 * (y * y + z * z), 1 - 2 * (x * x + z * z)
    R[..., 2, 2] = 1 - 2 * (x * x + y * y)
    R[..., 0, 1], R[..., 1, 0] = 2 * (x * y - w * z), 2 * (x * y + w * z)
    R[..., 0, 2], R[..., 2, 0] = 2 * (x * z + w * y), 2 * (x * z - w * y)
    R[..., 1, 2], R[..., 2, 1] = 2 * (y * z - w * x), 2 * (y * z + w * x)
    return R


def euler(q: np.ndarray) -> np.ndarray:
    """ZYX Euler angles of unit quaternions: theta within +-pi/2, phi = 0 at the singularity.

    Parameters
    ----------
    q : (..., 4) w, x, y, z

    Returns
    -------
    angles : (..., 3) phi, theta, psi in rad, phi and psi within +-pi (psi is not unwrapped)

    """
    R = rotation(q)
    sin_theta = np.clip(-R[..., 2, 0], -1.0, 1.0)
    singular = 1.0 - np.abs(sin_theta) < GIMBAL
    phi = np.where(singular, 0.0, np.arctan2(R[..., 2, 1], R[..., 2, 2]))
    # theta from the row's norm: arcsin alone loses half of the digits near the singularity
    theta = np.arctan2(sin_theta, np.hypot(R[..., 2, 1], R[..., 2, 2]))
    psi = np.where(
        singular,
        np.arctan2(-R[..., 0, 1], R[..., 1, 1]),
        np.arctan2(R[..., 1, 0], R[..., 0, 0]),
    )
    return np.stack([phi, theta, psi], -1)


def unwrapped(angles: np.ndarray) -> np.ndarray:
    """Euler angles (n, 3) of consecutive samples with psi continued over +-pi."""
    angles = np.array(angles, float)
    angles[:, 2] = np.unwrap(angles[:, 2])
    return angles


def jacobian(eta: np.ndarray) -> np.ndarray:
    """J(eta) of (2), Fossen 1994, Euler form; singular at theta = +-pi/2.

    Parameters
    ----------
    eta : (6,) x, y, z in m (NED), phi, theta, psi in rad

    Returns
    -------
    J : (6, 6) block diagonal, eta_dot = J nu

    """
    phi, theta, _ = np.asarray(eta, float)[3:]
    J = np.zeros((6, 6))
    J[:3, :3] = rotation(quaternion(np.asarray(eta)[3:]))
    J[3:, 3:] = [
        [1, np.sin(phi) * np.tan(theta), np.cos(phi) * np.tan(theta)],
        [0, np.cos(phi), -np.sin(phi)],
        [0, np.sin(phi) / np.cos(theta), np.cos(phi) / np.cos(theta)],
    ]
    return J


@helper
def position_rate(attitude: Vector, nu: Vector) -> tuple[Number, Number, Number]:
    """R(q) nu_1: velocity in NED, m/s."""
    w, x, y, z = attitude
    u, v, h = nu[0], nu[1], nu[2]
    return (
        (1.0 - 2.0 * (y * y + z * z)) * u + 2.0 * (x * y - w * z) * v + 2.0 * (x * z + w * y) * h,
        2.0 * (x * y + w * z) * u + (1.0 - 2.0 * (x * x + z * z)) * v + 2.0 * (y * z - w * x) * h,
        2.0 * (x * z - w * y) * u + 2.0 * (y * z + w * x) * v + (1.0 - 2.0 * (x * x + y * y)) * h,
    )


@helper
def attitude_rate(attitude: Vector, nu: Vector) -> tuple[Number, Number, Number, Number]:
    """q_dot = 1/2 q * (0, p, q, r), 1/s."""
    w, x, y, z = attitude
    p, q, r = nu[3], nu[4], nu[5]
    return (
        -0.5 * (x * p + y * q + z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q + z * p - x * r),
        0.5 * (w * r + x * q - y * p),
    )
