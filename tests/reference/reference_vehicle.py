"""Matrices of the vehicle and its kinematics, plain 6x6, one function per formula.

Equation numbers are those of Herman 2018.  Fossen's conventions: ZYX Euler angles, NED, forward-
starboard-down body frame.  DOF order: surge, sway, heave, roll, pitch, yaw.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, tan
from typing import Any

import numpy as np

Array = np.ndarray


def square(value: Any) -> Array:
    """A scalar, [6] or 6x6 entry as a 6x6 matrix."""
    array = np.asarray(value, dtype=float)
    if array.shape == (6, 6):
        return array.copy()
    if array.shape in ((), (6,)):
        return np.diag(np.broadcast_to(array, 6))
    raise ValueError(f'expected a scalar, [6] or 6x6, found shape {array.shape}')


def skew(v: Array) -> Array:
    """S(v), so that S(v) w = v x w."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    """a x b of plain numbers (np.cross costs more than the rest of a stage)."""
    (a1, a2, a3), (b1, b2, b3) = a, b
    return [a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1]


def vehicle_matrices(spec: dict[str, Any]) -> dict[str, Any]:
    """Constant matrices of a vehicle file (v1); M_RB and M_A are None with inertia_matrix."""
    body, hydro = spec['rigid_body'], spec['hydrostatics']
    environment = spec.get('environment', {})
    sign = {'positive': 1.0, 'sname': -1.0}[spec.get('sign', 'positive')]
    mass = float(body['mass'])
    r_g = np.array(body['center_of_gravity'], dtype=float)
    gravity = float(environment.get('gravity', 9.81))
    density = float(environment.get('water_density', 1000.0))

    m_rb = m_a = None
    if 'inertia_matrix' in spec:
        if 'added_mass' in spec or 'inertia' in body:
            raise ValueError('inertia_matrix excludes rigid_body.inertia and added_mass')
        m = np.array(spec['inertia_matrix'], dtype=float)
        m = (m + m.T) / 2
    else:
        inertia = np.array(body['inertia'], dtype=float)
        inertia = (inertia + inertia.T) / 2
        if body['inertia_reference'] == 'cg':  # parallel axes, to the body origin
            inertia = inertia + mass * (r_g @ r_g * np.eye(3) - np.outer(r_g, r_g))
        elif body['inertia_reference'] != 'co':
            raise ValueError('inertia_reference must be cg or co')
        m_rb = np.zeros((6, 6))
        m_rb[:3, :3] = mass * np.eye(3)
        m_rb[:3, 3:] = -mass * skew(r_g)
        m_rb[3:, :3] = mass * skew(r_g)
        m_rb[3:, 3:] = inertia
        m_a = sign * square(spec['added_mass'])
        m_a = (m_a + m_a.T) / 2
        m = m_rb + m_a

    drag = spec.get('damping', {})
    return {
        'M': m,
        'M_RB': m_rb,
        'M_A': m_a,
        'D_linear': sign * square(drag.get('linear', 0.0)),
        'D_quadratic': sign * square(drag.get('quadratic', 0.0)),
        'lift': sign * square(spec.get('lift', 0.0)),
        'W': mass * gravity,
        'B': density * gravity * float(hydro['volume']),
        'r_G': r_g,
        'r_B': np.array(hydro['center_of_buoyancy'], dtype=float),
    }


def coriolis(M: Array, nu: Array) -> Array:
    """C(nu) = [[0, -S(a)], [-S(a), -S(b)]], (a, b) = M nu; skew-symmetric."""
    a1, a2, a3, b1, b2, b3 = (M @ nu).tolist()
    return np.array(
        [
            [0.0, 0.0, 0.0, 0.0, a3, -a2],
            [0.0, 0.0, 0.0, -a3, 0.0, a1],
            [0.0, 0.0, 0.0, a2, -a1, 0.0],
            [0.0, a3, -a2, 0.0, b3, -b2],
            [-a3, 0.0, a1, -b3, 0.0, b1],
            [a2, -a1, 0.0, b2, -b1, 0.0],
        ]
    )


def damping(spec_matrices: dict[str, Any], nu: Array) -> Array:
    """D(nu) = D_linear + D_quadratic diag(|nu|) + |u| lift: |nu_j| multiplies column j."""
    drag = spec_matrices['D_linear'] + spec_matrices['D_quadratic'] * np.abs(nu)
    return drag + abs(nu[0]) * spec_matrices['lift']


def restoring(mats: dict[str, Any], eta: Array) -> Array:
    """g(eta) on the left-hand side of (1), Fossen 1994, NED."""
    w, b = mats['W'], mats['B']
    mx, my, mz = (w * mats['r_G'] - b * mats['r_B']).tolist()
    sp, cp, st, ct = sin(eta[3]), cos(eta[3]), sin(eta[4]), cos(eta[4])
    return np.array(
        [
            (w - b) * st,
            -(w - b) * ct * sp,
            -(w - b) * ct * cp,
            -my * ct * cp + mz * ct * sp,
            mz * st + mx * ct * cp,
            -mx * ct * sp - my * st,
        ]
    )


def restoring_from_rotation(mats: dict[str, Any], R: Array) -> Array:
    """g again, as minus the forces and their moments: W down at r_G, B up at r_B; R body to NED."""
    x, y, z = R[2].tolist()  # down
    w, b = mats['W'], mats['B']
    moment_w = cross(mats['r_G'].tolist(), (w * x, w * y, w * z))
    moment_b = cross(mats['r_B'].tolist(), (-b * x, -b * y, -b * z))
    force = [(b - w) * x, (b - w) * y, (b - w) * z]
    return np.array(force + [-m - n for m, n in zip(moment_w, moment_b, strict=True)])


def jacobian(eta: Array) -> Array:
    """J(eta) of (2): rotation body to NED, and Euler-angle rates; singular at theta = +-90 deg."""
    phi, theta, psi = eta[3:].tolist()
    sp, cp, st, ct, ss, cs = sin(phi), cos(phi), sin(theta), cos(theta), sin(psi), cos(psi)
    tt = tan(theta)
    j = np.zeros((6, 6))
    j[:3, :3] = [
        [cs * ct, -ss * cp + cs * st * sp, ss * sp + cs * cp * st],
        [ss * ct, cs * cp + sp * st * ss, -cs * sp + st * ss * cp],
        [-st, ct * sp, ct * cp],
    ]
    j[3:, 3:] = [[1.0, sp * tt, cp * tt], [0.0, cp, -sp], [0.0, sp / ct, cp / ct]]
    return j


def decompose(M: Array) -> tuple[Array, Array]:
    """(4), (9): row operations E make M upper triangular; Upsilon = E^T, N = E M E^T."""
    a = np.array(M, dtype=float)
    e = np.eye(len(a))
    for i in range(len(a)):
        if a[i, i] <= 0.0:
            raise ValueError('M is not positive definite')
        for j in range(i + 1, len(a)):
            factor = a[j, i] / a[i, i]
            a[j] -= factor * a[i]
            e[j] -= factor * e[i]
    return e.T.copy(), np.diag(np.diag(a))


def kinetic_energy(N: Array, Upsilon: Array, nu: Array) -> tuple[Any, Array]:
    """(30): total and components N_i xi_i^2 / 2 for nu (6,) or (n, 6); N is 6x6 or [6]."""
    diagonal = np.diag(N) if np.ndim(N) == 2 else np.asarray(N)
    xi = np.linalg.solve(Upsilon, np.asarray(nu, dtype=float).T).T
    components = 0.5 * diagonal * xi**2
    return components.sum(axis=-1), components


def rodrigues(turn: Array) -> Array:
    """The rotation by |turn| rad about the axis turn: I + sin S(a) + (1 - cos) S(a)^2."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    s = skew(turn / angle)
    return np.eye(3) + sin(angle) * s + (1.0 - cos(angle)) * s @ s


def euler_angles(R: Array) -> Array:
    """phi, theta, psi of a rotation body to NED; at theta = +-90 deg only phi -+ psi is defined."""
    phi, psi = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(R[1, 0], R[0, 0])
    return np.array([phi, np.arctan2(-R[2, 0], np.hypot(R[2, 1], R[2, 2])), psi])
