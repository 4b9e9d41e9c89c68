"""Energy, momentum and worked numbers written from physics alone: nothing here is taken from src.

Only `drive` and `body` touch the code under test: they are where tests meet the plant.
"""

from collections.abc import Callable, Sequence
from typing import Any

import herman_reference as reference
import numpy as np
from helpers.plants import plant_of, push

from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

# M and what C, g and R are with it, as published; see the tests that use them
DENSE_M_A = np.array(
    [
        [10, 1, 0, 0, 0, 0.5],
        [1, 20, 2, 0, 0, 0],
        [0, 2, 30, 0, 0, 0],
        [0, 0, 0, 5, 0.3, 0],
        [0, 0, 0, 0.3, 15, 1],
        [0.5, 0, 0, 0, 1, 25],
    ]
)
DENSE_NU = np.array([1, -0.5, 0.3, 0.1, -0.2, 0.4])
DENSE_C_NU = np.array([1.76, 3.08, 1.10, -2.512, -5.944, -3.719])
G_ETA = np.array([0, 0, 0, -0.1, 0.2, 0])  # phi, theta of the published g
G = np.array([-1.986693308, -0.97843395, 9.751703272, -7.338241567, 8.968312824, -0.595171275])
R_ANGLES = np.array([0.1, -0.2, 0.3])  # phi, theta, psi of the published R and T
R = np.array(
    [
        [0.936293364, -0.312991826, -0.159345079],
        [0.289629478, 0.944702486, -0.153791998],
        [0.198669331, 0.097843395, 0.975170327],
    ]
)
T = np.array(
    [
        [1, -0.020237235, -0.20169733],
        [0, 0.995004165, -0.099833417],
        [0, 0.101863913, 1.015241401],
    ]
)


def diagonal_C() -> np.ndarray:
    """C of M = diag(1, ..., 6) at nu = (1, ..., 6)."""
    upper_right = np.array([[0, 9, -4], [-9, 0, 1], [4, -1, 0]])
    lower_right = np.array([[0, 36, -25], [-36, 0, 16], [25, -16, 0]])
    return np.block([[np.zeros((3, 3)), upper_right], [upper_right, lower_right]])


def body(**entries: Any) -> dict[str, Any]:
    """Contents of a vehicle file on which nothing acts but its inertia, M = 1, W = B."""
    return {
        'name': 'body',
        'source': 'none needed',
        'rigid_body': {'mass': 1.0, 'center_of_gravity': [0.0, 0.0, 0.0]},
        'inertia_matrix': np.eye(6).tolist(),
        'hydrostatics': {'volume': 0.001, 'center_of_buoyancy': [0.0, 0.0, 0.0]},
        'damping': {'linear': [0.0] * 6, 'quadratic': [0.0] * 6},
        'environment': {'water_density': 1000.0, 'gravity': 9.81},
        **entries,
    }


def with_inertia(M: Any) -> dict[str, Any]:
    """Contents of a vehicle file with a given M, and W, B, r_G, r_B of the published g."""
    return body(
        rigid_body={'mass': 30.0, 'center_of_gravity': [0.01, 0.02, 0.03]},
        inertia_matrix=np.asarray(M, float).tolist(),
        hydrostatics={'volume': 0.031, 'center_of_buoyancy': [-0.01, 0.0, -0.02]},
        environment={'water_density': 1000.0, 'gravity': 10.0},
    )


def vehicle_of(data: dict[str, Any]) -> Vehicle:
    """Vehicle of the contents of a vehicle file."""
    return vehicle_from_dict(data, 'vehicle.yaml')


def drive(
    vehicle: Vehicle,
    x: np.ndarray,
    *,
    tau: Callable[[int], np.ndarray] | Sequence[float] = (0.0,) * 6,
    F: Sequence[dict[str, Any]] = (),
    step: float = 0.01,
    steps: int = 100,
    integrator: str = 'ode5',
) -> np.ndarray:
    """States (steps + 1, 13) of the plant from x (13,), tau held (or given for each step)."""
    plant = plant_of(vehicle, F, step, integrator, x)
    rows = [plant.x.copy()]
    for k in range(steps):
        push(plant, tuple(map(float, tau(k) if callable(tau) else tau)))
        rows.append(plant.x.copy())
    return np.array(rows)


def down(q: np.ndarray) -> np.ndarray:
    """Direction of gravity in the body frame, of quaternions (..., 4) w, x, y, z."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z], -1)


def hamilton(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Product of two quaternions w, x, y, z."""
    scalar = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([scalar, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def attitude_of(angles: np.ndarray) -> np.ndarray:
    """Quaternion of phi, theta, psi: about z, then y, then x, by half angles."""
    product = np.array([1.0, 0.0, 0.0, 0.0])
    for axis in (2, 1, 0):
        half = np.zeros(4)
        half[0], half[1 + axis] = np.cos(angles[axis] / 2), np.sin(angles[axis] / 2)
        product = hamilton(product, half)
    return product


def turned(q: np.ndarray) -> np.ndarray:
    """R(q) from its action on the axes, q e q*; takes complex q."""
    star = q * [1, -1, -1, -1]
    axes = (np.array([0, *axis]) for axis in np.eye(3))
    return np.stack([hamilton(hamilton(q, axis), star)[1:] for axis in axes], axis=1)


def potential(data: dict[str, Any], eta: np.ndarray) -> complex:
    """Potential energy, J: weight times height of r_G minus buoyancy times height of r_B.

    Height is -z. Takes complex eta (6,), for derivatives by the complex step.
    """
    m, (phi, theta) = reference.vehicle_matrices(data), eta[3:5]
    d = np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
    return -m['W'] * (eta[2] + d @ m['r_G']) + m['B'] * (eta[2] + d @ m['r_B'])


def potential_gradient(data: dict[str, Any], eta: np.ndarray) -> np.ndarray:
    """Slopes (6,) of `potential` over eta, exact but for rounding: no difference is formed."""
    tiny = 1e-30
    return np.array([np.imag(potential(data, eta + 1j * tiny * unit)) / tiny for unit in np.eye(6)])


def energy(data: dict[str, Any], x: np.ndarray) -> np.ndarray:
    """Kinetic plus potential energy, J, of states (..., 13)."""
    m, nu = reference.vehicle_matrices(data), x[..., 7:]
    kinetic = 0.5 * np.einsum('...i,ij,...j', nu, m['M'], nu)
    depth_G, depth_B = (x[..., 2] + down(x[..., 3:7]) @ m[r] for r in ('r_G', 'r_B'))
    return kinetic - m['W'] * depth_G + m['B'] * depth_B


def particles(mass: float, r_G: np.ndarray, inertia: np.ndarray) -> tuple[float, np.ndarray]:
    """Six equal particles with the mass, centre and inertia (about it) of a rigid body.

    Two on each principal axis of the second moments P = tr(I) / 2 - I, sqrt(3 P / mass) from the
    centre: their second moments add up to P.
    """
    moments, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)
    arms = axes * np.sqrt(3.0 * np.maximum(moments, 0.0) / mass)
    return mass / 6, r_G + np.concatenate([arms.T, -arms.T])


def particle_wrench(mass: float, places: np.ndarray, nu: np.ndarray, nu_dot: np.ndarray):
    """Newton for particles fixed in the body: the wrench (6,) that gives them nu_dot."""
    (v, omega), (v_dot, omega_dot) = nu.reshape(2, 3), nu_dot.reshape(2, 3)
    forces = mass * (
        v_dot
        + np.cross(omega, v)
        + np.cross(omega_dot, places)
        + np.cross(omega, np.cross(omega, places))
    )
    return np.concatenate([forces.sum(axis=0), np.cross(places, forces).sum(axis=0)])
