"""Test oracle: closed-loop underwater vehicle after P. Herman (2018), written apart from src.

Equation numbers are those of the article; what goes beyond it is that of docs/model.md
and docs/faults.md.  The names below are the whole interface:

reference_vehicle  6x6 matrices of a vehicle file, kinematics, decomposition
reference_signals  set-points, explicit F(t), current
reference_plant    model errors and current: the plant that the controller does not know
reference_laws     gvc, cl, pid, smc
reference_devices  actuators, anti-windup, sensors
reference_faults   faults of these
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from reference_devices import Actuators, Sensors, not_wound_up, thruster_matrix
from reference_faults import Faults
from reference_laws import control_law, make_law
from reference_plant import Plant, kirchhoff, newton_euler, plant_matrices
from reference_signals import DOFS, current, disturbance, setpoint
from reference_vehicle import (
    Array,
    coriolis,
    damping,
    decompose,
    euler_angles,
    jacobian,
    kinetic_energy,
    restoring,
    restoring_from_rotation,
    rodrigues,
    skew,
    square,
    vehicle_matrices,
)

__all__ = [
    'DOFS',
    'TABLEAUX',
    'Actuators',
    'Plant',
    'Sensors',
    'control_law',
    'coriolis',
    'current',
    'damping',
    'decompose',
    'disturbance',
    'euler_angles',
    'jacobian',
    'kinetic_energy',
    'kirchhoff',
    'make_law',
    'newton_euler',
    'not_wound_up',
    'plant_matrices',
    'restoring',
    'restoring_from_rotation',
    'rodrigues',
    'setpoint',
    'simulate',
    'skew',
    'square',
    'thruster_matrix',
    'vehicle_matrices',
]

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


class EulerAngles:
    """Pose (6,) as eta itself; singular at theta = +-90 deg."""

    size = 6

    def start(self, eta: Array) -> Array:
        return eta.copy()

    def rate(self, pose: Array, nu: Array) -> tuple[Array, Array]:
        """Rotation body to NED, and the rate of the pose by (2)."""
        j = jacobian(pose)
        return j[:3, :3], j @ nu

    def rotation(self, pose: Array) -> Array:
        return jacobian(pose)[:3, :3]

    def eta(self, pose: Array) -> Array:
        return pose

    def tidy(self, pose: Array) -> Array:
        return pose


class RotationMatrix:
    """Pose (12,): position and the nine elements of R, R_dot = R S(omega); nowhere singular."""

    size = 12

    def start(self, eta: Array) -> Array:
        return np.concatenate((eta[:3], jacobian(eta)[:3, :3].ravel()))

    def rate(self, pose: Array, nu: Array) -> tuple[Array, Array]:
        """Rotation body to NED, and the rate of the pose."""
        R = pose[3:].reshape(3, 3)
        return R, np.concatenate((R @ nu[:3], (R @ skew(nu[3:])).ravel()))

    def rotation(self, pose: Array) -> Array:
        return pose[3:].reshape(3, 3)

    def eta(self, pose: Array) -> Array:
        return np.concatenate((pose[:3], euler_angles(self.rotation(pose))))

    def tidy(self, pose: Array) -> Array:
        """Nearest rotation, after each step."""
        left, _, right = np.linalg.svd(self.rotation(pose))
        return np.concatenate((pose[:3], (left @ right).ravel()))


ATTITUDES = {'euler': EulerAngles(), 'matrix': RotationMatrix()}


def simulate(
    vehicle: dict[str, Any],
    scenario: dict[str, Any],
    controller: str,
    hold: str,
    duration: float | None = None,
    attitude: str = 'euler',
) -> dict[str, Array]:
    """Run one entry of scenario['controllers'] against the plant of the scenario.

    Parameters
    ----------
    vehicle, scenario : contents of the two files; a set-point from a CSV as {'table': (m, 7) array}
    controller : name of the entry
    hold : 'continuous' (the law inside every stage) or 'zoh', which
        actuators, sensors and faults need
    duration : s, in place of the scenario's
    attitude : 'euler', or 'matrix', which passes theta = 90 deg

    Returns
    -------
    Of n + 1 samples each: t; eta, nu (the truth); R (n + 1, 3, 3) body to NED; eta_measured,
    nu_measured; nu_d; tau (command), tau_applied; disturbance_estimate f; disturbance, the explicit
    F(t) of herman2018 and harmonic; F, by definition tau_applied - [M nu_dot + C nu + D nu + g]
    with the vehicle file's coefficients; law_state (n + 1, size), see control_law.

    """
    if hold not in ('continuous', 'zoh'):
        raise ValueError('hold must be continuous or zoh')
    if hold == 'continuous' and any(
        scenario.get(key) for key in ('actuators', 'sensors', 'faults')
    ):
        raise ValueError('actuators, sensors and faults need hold zoh')
    entry, target = scenario['controllers'][controller], scenario['setpoint']
    h = float(scenario['step'])
    length = float(scenario['duration']) if duration is None else duration
    steps = round(length / h)
    if 'table' in target:
        times = np.asarray(target['table'], dtype=float)[:, 0]
        if times[0] > 0.0 or times[-1] < length - 1e-9:
            raise ValueError('the table of set-points does not cover [0, duration]')

    known = vehicle_matrices(vehicle)  # what the controller knows
    plant = Plant(vehicle, scenario.get('disturbance'))
    size, law = control_law(known, entry)
    pose = ATTITUDES[attitude]
    seed, faults = int(scenario.get('seed', 0)), None
    if scenario.get('faults'):
        faults = Faults(scenario['faults'], h, seed)
    actuators = Actuators(scenario.get('actuators') or {}, vehicle, h, faults)
    sensors = Sensors(scenario.get('sensors') or {}, seed, faults)
    c_nodes, a_rows, b_weights = TABLEAUX[scenario.get('integrator', 'ode5')]
    stage_rows, weights = [np.array(row) for row in a_rows], np.array(b_weights)
    n = pose.size

    def open_loop(time: float, x: Array, tau: Array) -> Array:
        """Time derivative of pose and nu under a wrench that is held."""
        R, pose_dot = pose.rate(x[:n], x[n:])
        return np.concatenate((pose_dot, plant.acceleration(time, R, x[n:], tau)))

    def closed_loop(time: float, x: Array) -> Array:
        """The same with the law inside: its state stands behind nu."""
        nu = x[n : n + 6]
        R, pose_dot = pose.rate(x[:n], nu)
        g = restoring_from_rotation(known, R)
        tau, law_dot, _ = law(nu, *setpoint(target, time), g)(x[n + 6 :])
        return np.concatenate((pose_dot, plant.acceleration(time, R, nu, tau), law_dot))

    def advance(
        derivative: Callable[..., Array], time: float, x: Array, x_dot: Array, *args: Array
    ) -> Array:
        """One explicit Runge-Kutta step of length h from x, where the derivative is x_dot."""
        k = np.zeros((len(weights), len(x)))
        k[0] = x_dot
        for i in range(1, len(weights)):
            k[i] = derivative(time + c_nodes[i] * h, x + h * (stage_rows[i] @ k[:i]), *args)
        return x + h * (weights @ k)

    t = np.arange(steps + 1) * h
    rows: dict[str, list[Array]] = {}
    initial = scenario.get('initial') or {}
    start = [np.array(initial.get(key, [0.0] * 6), dtype=float) for key in ('eta', 'nu')]
    x = np.concatenate((pose.start(start[0]), start[1], np.zeros(size)))
    rate = np.zeros(size)  # zoh: of the law's state, at the sample before
    for k in range(steps + 1):
        if hold == 'zoh' and k > 0:
            x[n + 6 :] += (t[k] - t[k - 1]) * rate
        eta, R, nu = pose.eta(x[:n]), pose.rotation(x[:n]), x[n : n + 6]
        position, R_seen, nu_seen = sensors(eta[:3], R, nu)
        nu_d, nu_d_dot = setpoint(target, t[k])
        answer = law(nu_seen, nu_d, nu_d_dot, restoring_from_rotation(known, R_seen))
        tau, rate, f = answer(x[n + 6 :])
        applied = actuators(tau)
        if actuators.cuts and entry.get('anti_windup', True):
            rate = not_wound_up(answer, x[n + 6 :], tau, rate, actuators, entry['law'])
        nu_dot = plant.acceleration(t[k], R, nu, applied)
        model = known['M'] @ nu_dot + (coriolis(known['M'], nu) + damping(known, nu)) @ nu
        for name, row in {
            'eta': eta,
            'nu': nu,
            'R': R,
            'eta_measured': np.concatenate((position, euler_angles(R_seen))),
            'nu_measured': nu_seen,
            'nu_d': nu_d,
            'tau': tau,
            'tau_applied': applied,
            'disturbance': disturbance(scenario.get('disturbance'), t[k]),
            'disturbance_estimate': f,
            'F': applied - model - restoring_from_rotation(known, R),
            'law_state': x[n + 6 :],
        }.items():
            rows.setdefault(name, []).append(np.array(row))
        if k == steps:
            break
        x_dot = np.concatenate((pose.rate(x[:n], nu)[1], nu_dot, rate))
        if hold == 'continuous':
            x = advance(closed_loop, t[k], x, x_dot)
        else:
            x[: n + 6] = advance(open_loop, t[k], x[: n + 6], x_dot[: n + 6], applied)
        x[:n] = pose.tidy(x[:n])
    return {'t': t, **{name: np.array(row) for name, row in rows.items()}}
