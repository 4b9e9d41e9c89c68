"""What the model says of wrenches: the velocity that they add to that of a vehicle left alone."""

from collections.abc import Sequence
from functools import partial
from itertools import groupby
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from auv_dynamics.plant.plant import eta_of
from auv_dynamics.vehicle.kinematics import jacobian
from auv_dynamics.vehicle.vehicle import Vehicle

ACCURATE = 1e-6  # m/s, rad/s, and relative
STEPS = 0.02  # s between two values of a prediction


def pieces(
    steps: Sequence[tuple[float, tuple[float, ...]]], end: float
) -> list[tuple[float, float, tuple[float, ...]]]:
    """Begin, end and wrench of the pieces of time in which one wrench was held.

    Parameters
    ----------
    steps : time in s and wrench of each message, in their order
    end : of the last piece, s

    """
    runs = [(next(run)[0], tau) for tau, run in groupby(steps, key=lambda step: step[1])]
    ends = [*(begin for begin, _ in runs[1:]), end]
    return [(begin, last, tau) for (begin, tau), last in zip(runs, ends, strict=True)]


class Predicted(NamedTuple):
    """Velocities by the model.

    Attributes
    ----------
    t : (m,) s
    added : (m, 6) what wrenches add, m/s and rad/s, zero at first
    alone : (m, 6) what there is without them

    """

    t: np.ndarray
    added: np.ndarray
    alone: np.ndarray


def predicted(
    vehicle: Vehicle, x: np.ndarray, held: Sequence[tuple[float, float, tuple[float, ...]]]
) -> Predicted:
    """Velocity with and without wrenches, by (1) and (2).

    Parameters
    ----------
    vehicle : the model
    x : (13,) state at the beginning
    held : of `pieces`

    """
    nothing = [(begin, end, (0.0,) * 6) for begin, end, _ in held]
    (t, moved), (_, left) = (_velocity(vehicle, x, parts) for parts in (held, nothing))
    return Predicted(t, moved - left, left)


def _velocity(
    vehicle: Vehicle, x: np.ndarray, held: Sequence[tuple[float, float, tuple[float, ...]]]
) -> tuple[np.ndarray, np.ndarray]:
    y = np.concatenate([eta_of(x), x[7:]])
    times, rows = [np.array([held[0][0]])], [y[None, 6:]]
    for begin, end, tau in held:
        at = np.linspace(begin, end, max(round((end - begin) / STEPS), 1) + 1)
        solved = solve_ivp(
            partial(_rate, vehicle, np.array(tau)),
            (begin, end),
            y,
            t_eval=at,
            rtol=ACCURATE,
            atol=ACCURATE,
        )
        y = solved.y[:, -1]
        times.append(at[1:])
        rows.append(solved.y[6:, 1:].T)
    return np.concatenate(times), np.concatenate(rows)


def _rate(vehicle: Vehicle, tau: np.ndarray, _: float, y: np.ndarray) -> np.ndarray:
    eta, nu = y[:6], y[6:]
    return np.concatenate([jacobian(eta) @ nu, vehicle.forward_dynamics(eta, nu, tau)])
