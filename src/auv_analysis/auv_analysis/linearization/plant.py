"""The vehicle itself, linearised: equation (1) with the two Euler angles that g depends on."""

import numpy as np

from auv_dynamics.kinematics import jacobian as kinematics
from auv_dynamics.vehicle import Vehicle

LEVEL = 1e-6  # distance of abs(theta) from pi/2 below which Euler angles are of no use
ATTITUDE, NU = slice(0, 2), slice(2, 8)


def plant_jacobian(
    vehicle: Vehicle, eta: np.ndarray, nu: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A and B of x_dot = A x + B (tau - F), x = (phi, theta, nu), exact but for rounding.

    C(nu) nu is homogeneous of degree 2, D(nu) nu = D_l nu + D_q abs(nu) nu + abs(u) lift nu has
    the derivative D_l + 2 D_q diag(abs(nu)) + abs(u) lift + sign(u) lift nu e_u^T, also at zero
    (at u = 0 with sideways velocity: the mean of either side), and g is a sinusoid in phi as in
    theta, whose derivative is half its difference over a quarter turn to either side.

    Parameters
    ----------
    vehicle : Vehicle
    eta : (6,) m (NED) and rad; abs(theta) below pi/2
    nu : (6,) m/s, rad/s

    Returns
    -------
    A : (8, 8) derivatives of (1) and of phi_dot, theta_dot of (2)
    B : (8, 6) zero above M^-1

    """
    C = vehicle.C(nu)
    turning = C + np.stack([vehicle.C(unit) @ nu for unit in np.eye(6)], axis=1)
    dragging = 2 * vehicle.D(nu) - vehicle.D_linear
    if vehicle.lift is not None:
        dragging -= abs(nu[0]) * vehicle.lift
        dragging[:, 0] += np.sign(nu[0]) * vehicle.lift @ nu
    restoring = np.stack([_quarter_turns(vehicle, eta, axis) for axis in (3, 4)], axis=1)
    A = np.zeros((8, 8))
    A[ATTITUDE, ATTITUDE] = _attitude_slope(eta, kinematics(eta) @ nu)
    A[ATTITUDE, NU] = kinematics(eta)[3:5]
    A[NU, ATTITUDE] = -np.linalg.solve(vehicle.M, restoring)
    A[NU, NU] = -np.linalg.solve(vehicle.M, turning + dragging)
    B = np.zeros((8, 6))
    B[NU] = np.linalg.inv(vehicle.M)
    return A, B


def _quarter_turns(vehicle: Vehicle, eta: np.ndarray, axis: int) -> np.ndarray:
    turn = np.pi / 2 * np.eye(6)[axis]
    return (vehicle.g(eta + turn) - vehicle.g(eta - turn)) / 2


def _attitude_slope(eta: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Derivatives of (phi_dot, theta_dot) of (2) by (phi, theta) at these Euler rates."""
    theta, (_, pitching, heading) = eta[4], rate[3:]
    cos = np.cos(theta)
    return np.array([[pitching * np.tan(theta), heading / cos], [-heading * cos, 0.0]])
