"""Test oracle: closed-loop underwater vehicle after P. Herman (2018), written apart from src.

Equation numbers are those of the article.  Everything is plain: 6x6 matrices, Euler angles
(Fossen ZYX, NED), one function per formula.  DOF order: surge, sway, heave, roll, pitch, yaw.
Not covered, and refused: model_error, current, actuators, sensors, set-points from a file.
The plant is therefore exactly the model that the controller knows, plus F.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, exp, pi, sin, tan
from typing import Any

import numpy as np

Array = np.ndarray
DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')

# Butcher tableaux (c, A, b); ode5 is the fifth-order Dormand-Prince solution, six stages.
TABLEAUX: dict[str, tuple[list[float], list[list[float]], list[float]]] = {
    'euler': ([0.0], [[]], [1.0]),
    'rk4': (
        [0.0, 1 / 2, 1 / 2, 1.0],
        [[], [1 / 2], [0.0, 1 / 2], [0.0, 0.0, 1.0]],
        [1 / 6, 1 / 3, 1 / 3, 1 / 6],
    ),
    'ode5': (
        [0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0],
        [
            [],
            [1 / 5],
            [3 / 40, 9 / 40],
            [44 / 45, -56 / 15, 32 / 9],
            [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
            [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        ],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ),
}


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
        'W': mass * gravity,
        'B': density * gravity * float(hydro['volume']),
        'r_G': r_g,
        'r_B': np.array(hydro['center_of_buoyancy'], dtype=float),
    }


def coriolis(M: Array, nu: Array) -> Array:
    """C(nu) = [[0, -S(a)], [-S(a), -S(b)]], (a, b) = M nu; skew-symmetric."""
    momentum = M @ nu
    s_a = skew(momentum[:3])
    c = np.zeros((6, 6))
    c[:3, 3:] = -s_a
    c[3:, :3] = -s_a
    c[3:, 3:] = -skew(momentum[3:])
    return c


def damping(spec_matrices: dict[str, Any], nu: Array) -> Array:
    """D(nu) = D_linear + D_quadratic diag(|nu|): column j is multiplied by |nu_j|."""
    return spec_matrices['D_linear'] + spec_matrices['D_quadratic'] * np.abs(nu)[np.newaxis, :]


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


def setpoint(spec: dict[str, Any], t: float) -> tuple[Array, Array]:
    """nu_d and its derivative: per DOF, offset + sum of amplitude sin(omega t + phase)."""
    value, rate = np.zeros(6), np.zeros(6)
    for dof, entry in spec.items():
        i = DOFS.index(dof)
        value[i] = entry.get('offset', 0.0)
        for term in entry.get('terms', []):
            amplitude, omega = float(term['amplitude']), float(term['omega'])
            angle = omega * t + float(term.get('phase', 0.0))
            value[i] += amplitude * sin(angle)
            rate[i] += amplitude * omega * cos(angle)
    return value, rate


def disturbance(spec: list[dict[str, Any]] | dict[str, Any] | None, t: float) -> Array:
    """F(t) of (1), on the left-hand side; kinds herman2018 (39) and harmonic, summed.

    exponent_sign turns the exponents of (39) and the e^-1 inside f2, not e^cos(t - 0.7).
    """
    total = np.zeros(6)
    for item in [] if spec is None else [spec] if isinstance(spec, dict) else spec:
        if item['kind'] == 'harmonic':
            total += setpoint({k: v for k, v in item.items() if k != 'kind'}, t)[0]
        elif item['kind'] == 'herman2018':
            g = float(item.get('exponent_sign', -1))
            f1 = pi / 4 * cos(pi * t / 5) + pi / 10 * sin(pi * t / 3)
            f2 = 0.2 * sin(t) * exp(g) + 0.1 * exp(cos(t - 0.7))
            f3 = pi / 5 * sin(pi * t / 15) + pi / 4 * cos(pi * t / 5)
            total += [
                100 * f1 * exp(2.5 * g) + 20,
                20 * f1 * exp(2.5 * g) + 4,
                150 * f2 * exp(g) + 1,
                3 * f2 * exp(g) + 1,
                150 * f3 * exp(3 * g) + 12,
                50 * f3 * exp(3 * g) + 4,
            ]
        else:
            raise ValueError(f'disturbance kind {item["kind"]!r} is not covered')
    return total


# A law maps (nu, nu_d, nu_d_dot, z, sigma, C, D, g) to (tau, s, f); sigma integrates s,
# and s, sigma are in the law's own frame (xi for gvc, body for cl); tau and f in the body frame.
Law = Callable[..., tuple[Array, Array, Array]]


def make_law(M: Array, gains: dict[str, Any]) -> Law:
    """GVC (16)-(21) in the xi frame, or CL (29), with constant matrices built once."""
    k_d, k_i, lam, gam = (square(gains[key]) for key in ('k_D', 'k_I', 'Lambda', 'Gamma'))
    u, n = decompose(M)
    ut, u_inv = u.T, np.linalg.inv(u)
    ut_inv = u_inv.T
    n_k_d, n_gam, ut_k_i = n @ k_d, n @ gam, ut @ k_i

    def gvc(nu, nu_d, nu_d_dot, z, sigma, c, d, g):
        e = nu_d - nu  # (17)
        xi = u_inv @ nu  # (4)
        xi_r = u_inv @ (nu_d + lam @ z)  # (18)
        xi_r_dot = u_inv @ (nu_d_dot + lam @ e)  # (20)
        s_xi = xi_r - xi  # (19)
        f_xi = n_gam @ sigma  # (21), integrated
        c_xi, d_xi, g_xi = ut @ c @ u, ut @ d @ u, ut @ g  # (10)-(12)
        pi_xi = n @ xi_r_dot + c_xi @ xi_r + d_xi @ xi_r + g_xi + n_k_d @ s_xi + ut_k_i @ z + f_xi
        return ut_inv @ pi_xi, s_xi, ut_inv @ f_xi  # (16), (14), (13)

    def cl(nu, nu_d, nu_d_dot, z, sigma, c, d, g):
        e = nu_d - nu
        nu_r = nu_d + lam @ z
        nu_r_dot = nu_d_dot + lam @ e
        s = nu_r - nu
        f = gam @ sigma
        tau = M @ nu_r_dot + c @ nu_r + d @ nu_r + g + k_d @ s + k_i @ z + f  # (29)
        return tau, s, f

    return {'gvc': gvc, 'cl': cl}[gains['law']]


def simulate(
    vehicle: dict[str, Any],
    scenario: dict[str, Any],
    controller: str,
    hold: str,
    duration: float | None = None,
) -> dict[str, Array]:
    """Run one entry of scenario['controllers']; state eta, nu and, if continuous, z, sigma."""
    if hold not in ('continuous', 'zoh'):
        raise ValueError('hold must be continuous or zoh')
    if scenario.get('actuators') or scenario.get('sensors'):
        raise ValueError('actuators and sensors are not covered')
    mats = vehicle_matrices(vehicle)
    m, m_inv = mats['M'], np.linalg.inv(mats['M'])
    law = make_law(m, scenario['controllers'][controller])
    c_nodes, a_rows, b_weights = TABLEAUX[scenario.get('integrator', 'ode5')]
    stage_rows, weights = [np.array(row) for row in a_rows], np.array(b_weights)
    target, upset = scenario['setpoint'], scenario.get('disturbance')

    h = float(scenario['step'])
    steps = round((float(scenario['duration']) if duration is None else duration) / h)
    t = np.arange(steps + 1) * h
    names = ('eta', 'nu', 'nu_d', 'tau', 'disturbance', 'disturbance_estimate')
    out: dict[str, Array] = {'t': t, **{name: np.zeros((steps + 1, 6)) for name in names}}

    def model(x: Array) -> tuple[Array, Array, Array]:
        """C(nu), D(nu), g(eta): the same for plant and controller."""
        return coriolis(m, x[6:12]), damping(mats, x[6:12]), restoring(mats, x[:6])

    def plant(time: float, x: Array, tau: Array) -> Array:
        """Time derivative of eta, nu: (2), and (1) solved for nu_dot."""
        nu, (c, d, g) = x[6:12], model(x)
        nu_dot = m_inv @ (tau - c @ nu - d @ nu - g - disturbance(upset, time))
        return np.concatenate((jacobian(x[:6]) @ nu, nu_dot))

    def closed_loop(time: float, x: Array) -> Array:
        """Continuous controller: z and sigma are states x[12:18], x[18:24]."""
        nu, (nu_d, nu_d_dot) = x[6:12], setpoint(target, time)
        tau, s, _ = law(nu, nu_d, nu_d_dot, x[12:18], x[18:24], *model(x))
        return np.concatenate((plant(time, x, tau), nu_d - nu, s))

    def advance(derivative: Callable[..., Array], time: float, x: Array, *args: Array) -> Array:
        """One explicit Runge-Kutta step of length h."""
        k = np.zeros((len(weights), len(x)))
        for i, (node, row) in enumerate(zip(c_nodes, stage_rows, strict=True)):
            k[i] = derivative(time + node * h, x + h * (row @ k[:i]), *args)
        return x + h * (weights @ k)

    initial = scenario.get('initial', {})
    start = [np.array(initial.get(key, [0.0] * 6), dtype=float) for key in ('eta', 'nu')]
    x = np.concatenate((*start, np.zeros(12)))
    previous = None  # zoh: (e, s) of the sample before
    for k in range(steps + 1):
        if hold == 'zoh' and previous is not None:
            x[12:18] += (t[k] - t[k - 1]) * previous[0]
            x[18:24] += (t[k] - t[k - 1]) * previous[1]
        nu_d, nu_d_dot = setpoint(target, t[k])
        tau, s, f = law(x[6:12], nu_d, nu_d_dot, x[12:18], x[18:24], *model(x))
        previous = (nu_d - x[6:12], s)
        for name, row in zip(names, (x[:6], x[6:12], nu_d, tau, None, f), strict=True):
            out[name][k] = disturbance(upset, t[k]) if row is None else row
        if k == steps:
            break
        if hold == 'continuous':
            x = advance(closed_loop, t[k], x)
        else:
            x[:12] = advance(plant, t[k], x[:12], tau)
    return out
