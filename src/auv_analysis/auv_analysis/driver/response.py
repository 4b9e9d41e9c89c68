"""Response to wrenches: velocity by the model, and the measured one as a multiple of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from auv_dynamics.plant.plant import eta_of
from auv_dynamics.vehicle.kinematics import jacobian
from auv_dynamics.vehicle.vehicle import Vehicle

Wrench = tuple[float, ...]
Held = Sequence[tuple[float, float, Wrench]]  # begin and end in s of each wrench

ACCURATE = 1e-6  # m/s, rad/s, and relative
STEPS = 0.02  # s between two values of a prediction
LATEST = 0.8  # s of delay that are looked for
FINE = 0.01  # s between two delays that are tried
ALIKE = 1e-6  # of the largest: terms that are as much alike are one


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


def predicted(vehicle: Vehicle, x: np.ndarray, held: Held) -> Predicted:
    """Velocity with and without wrenches, by (1) and (2), from the state x (13,) on."""
    nothing = [(begin, end, (0.0,) * 6) for begin, end, _ in held]
    (t, moved), (_, left) = (_velocity(vehicle, x, parts) for parts in (held, nothing))
    return Predicted(t, moved - left, left)


def _velocity(vehicle: Vehicle, x: np.ndarray, held: Held) -> tuple[np.ndarray, np.ndarray]:
    y = np.concatenate([eta_of(x), x[7:]])
    times, rows = [np.array([held[0][0]])], [y[None, 6:]]
    for begin, end, tau in held:
        at = np.linspace(begin, end, max(round((end - begin) / STEPS), 1) + 1)
        rate = partial(_rate, vehicle, np.array(tau))
        solved = solve_ivp(rate, (begin, end), y, t_eval=at, rtol=ACCURATE, atol=ACCURATE)
        y = solved.y[:, -1]
        times.append(at[1:])
        rows.append(solved.y[6:, 1:].T)
    return np.concatenate(times), np.concatenate(rows)


def _rate(vehicle: Vehicle, tau: np.ndarray, _: float, y: np.ndarray) -> np.ndarray:
    eta, nu = y[:6], y[6:]
    return np.concatenate([jacobian(eta) @ nu, vehicle.forward_dynamics(eta, nu, tau)])


@dataclass(frozen=True)
class GainFit:
    """A measured velocity as a multiple of a predicted one, beside a steady drift.

    Attributes
    ----------
    model : the prediction
    gain : measured over predicted, in the axis of the wrench
    delay : s
    squares : of what is left of the velocity in that axis
    residual : its root mean square, m/s or rad/s
    measured, predicted : (6,) peak of each velocity, as far as it has the shape of the prediction

    """

    model: Predicted
    gain: float
    delay: float
    squares: float
    residual: float
    measured: np.ndarray
    predicted: np.ndarray


def fit_response(t: np.ndarray, nu: np.ndarray, model: Predicted, axis: int) -> GainFit:
    """Fit gain * added(t - delay) + c_0 + c_1 t + c_2 alone(t) to a velocity.

    The wrench acts one way and then the other, so that what it adds rises and falls. What is
    steady, such as buoyancy, a current or a slow turn, is taken up by the straight line, and the
    swinging of a vehicle that something rights by the motion that the model has without a wrench.

    Parameters
    ----------
    t, nu : (n,) s and (n, 6) m/s and rad/s, measured
    model : what is predicted
    axis : of the wrench

    """
    free = [np.interp(t, model.t, column) for column in model.alone.T]
    delays = np.arange(0.0, LATEST, FINE)
    forms = np.stack([np.interp(t - late, model.t, model.added[:, axis]) for late in delays])
    fits = [_gains(t, nu[:, j], forms, free[j]) for j in range(6)]
    best = [int(np.argmin(squares)) for _, squares in fits]
    prompt = [np.interp(t, model.t, column) for column in model.added.T]
    shares = [_gains(t, prompt[j], forms[:1], free[j])[0][0] for j in range(6)]
    gains = np.array([gain[k] for (gain, _), k in zip(fits, best, strict=True)])
    peak = float(np.abs(model.added[:, axis]).max())
    squares = float(fits[axis][1][best[axis]])
    residual = float(np.sqrt(squares / len(t)))
    return GainFit(
        model,
        float(gains[axis]),
        float(delays[best[axis]]),
        squares,
        residual,
        gains * peak,
        np.array(shares) * peak,
    )


def _gains(
    t: np.ndarray, y: np.ndarray, forms: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Factor of each form (k, n) beside a straight line and a free motion; squares left by it."""
    rest = np.stack([np.ones_like(t), t - t.mean(), free - free.mean()], axis=1)
    size = np.maximum(np.linalg.norm(rest, axis=0), np.finfo(float).tiny)
    basis, strength, _ = np.linalg.svd(rest / size, full_matrices=False)
    basis = basis[:, strength > ALIKE * strength[0]]
    y = y - basis @ (basis.T @ y)
    own = forms - forms @ basis @ basis.T
    strong = (own**2).sum(axis=1)
    told = strong > ALIKE * (forms**2).sum(axis=1)
    gain = np.where(told, own @ y / np.where(told, strong, 1.0), 0.0)
    return gain, np.maximum(y @ y - gain**2 * strong, 0.0)
