"""Response to wrenches: velocity by the model, and the sign, size and delay of the measured one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import expm

from auv_analysis.simulation.open_loop import open_loop
from auv_analysis.studies.linearize.linearize import ATTITUDE, NU, plant_jacobian
from auv_dynamics.plant.plant import eta_of
from auv_dynamics.vehicle.vehicle import Vehicle

Wrench = tuple[float, ...]
Held = Sequence[tuple[float, float, Wrench]]  # begin and end in s of each wrench

STEPS, FINER = 0.02, 4  # s between two values of a prediction, and steps between them
OPPOSED = 1.5  # s that the other sign may be late that has to fit worse
FINE = 0.01  # s between two delays that are tried
ALIKE = 1e-6  # of the largest: terms that are as much alike are one
SCALES = np.array(  # inertia and damping, times the model's, under which a sign has to hold
    [(a, b) for a in np.geomspace(0.25, 4.0, 9) for b in np.geomspace(0.25, 4.0, 5)]
)
MISFIT = 1.0  # of what no model explains: by so much the other sign has to be worse
SURE = 8.0  # difference in log-likelihood beyond which noise at rest does not make it better
KNOWN = 1.25  # times its estimate: what the variance of the noise may be
AS_WELL = 0.03  # of what moved: models that leave so much more of it fit as well
NOTHING = 0.2  # of the predicted response: none
EXPLAINED = 0.3  # of what moved: a sign that leaves more of it is not told


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
    both = np.tile(x, (2, 1))
    times, rows = [np.array([held[0][0]])], [both[:, None]]
    for begin, end, tau in held:
        count = max(round((end - begin) / STEPS), 1)
        commands, wrenches = np.zeros((1, FINER * count, 6)), np.array([tau, np.zeros(6)], float)
        step = (end - begin) / (FINER * count)
        found = open_loop(
            vehicle, commands, both[:, None], step,
            bias=wrenches, integrator='ode5', every=FINER, threads=1,
        )[:, 0]  # fmt: skip
        both = found[:, -1]
        times.append(np.linspace(begin, end, count + 1)[1:])
        rows.append(found)
    moved, left = np.concatenate(rows, axis=1)[..., 7:]
    return Predicted(np.concatenate(times), moved - left, left)


def _varied(
    vehicle: Vehicle, x: np.ndarray, held: Held, model: Predicted, axis: int, scales: np.ndarray
) -> Predicted:
    """Velocity along an axis, (m, k) each, with k (2,) scales of the model's inertia and damping.

    (1) is linear about the state x (13,) here, without C, with D at the mean speeds of the model:
    responses to the steps of the wrench are added up.
    """
    eta = eta_of(x)
    free, forced = plant_jacobian(vehicle, eta, np.zeros(6))
    inverse, D = forced[NU], vehicle.D(np.abs(model.added).mean(axis=0))
    inertia, damping = scales.T[:, :, None, None]
    A = np.zeros((len(scales), 10, 10))  # roll and pitch, velocity, a unit wrench, weight
    A[:, ATTITUDE, NU] = free[ATTITUDE, NU]
    A[:, NU, ATTITUDE] = free[NU, ATTITUDE] / inertia
    A[:, NU, NU] = -inverse @ D * damping / inertia
    A[:, NU, 8] = inverse[:, axis] / inertia[..., 0]
    A[:, NU, 9] = -inverse @ vehicle.g(eta) / inertia[..., 0]
    z = np.zeros((len(scales), 10, 2))
    z[:, 8, 0] = z[:, 9, 1] = 1.0
    z[:, NU, 1] = x[7:]
    row = NU.start + axis
    t, step, rows = np.arange(0.0, held[-1][1] + STEPS, STEPS), expm(STEPS * A), [z[:, row]]
    for _ in t[1:]:
        z = step @ z
        rows.append(z[:, row])
    by_step, alone = np.moveaxis(np.array(rows), 2, 0)
    response = make_interp_spline(t, by_step, k=1)
    changes = np.diff([tau[axis] for *_, tau in held], prepend=0.0)
    added = sum(
        size * response(np.maximum(t - begin, 0.0))
        for (begin, *_), size in zip(held, changes, strict=True)
    )
    own = np.isclose(scales, 1.0).all(axis=1)  # the model itself is not linear
    parts = (np.asarray(added), alone)
    for part, column in zip(parts, (model.added, model.alone), strict=True):
        part[:, own] = np.interp(t, model.t, column[:, axis])[:, None]
    return Predicted(t, *parts)


class Noise(NamedTuple):
    """Noise of the velocity at rest.

    Attributes
    ----------
    variance : (6,) m2/s2 and rad2/s2
    alike : (6,) how many samples in a row tell as much as one that is independent

    """

    variance: np.ndarray
    alike: np.ndarray


def noise_at_rest(t: np.ndarray, nu: np.ndarray) -> Noise:
    """Noise of velocities (n, 6) at times (n,) in s beside a line; zero if n is below 5."""
    if len(t) < 5:
        return Noise(np.zeros(6), np.ones(6))
    left = nu - np.polynomial.polynomial.polyval(t, np.polyfit(t, nu, 1)[::-1]).T
    return Noise((left**2).sum(axis=0) / (len(t) - 2), in_a_row(left))


def in_a_row(left: np.ndarray) -> np.ndarray:
    """How many of the residuals (n, k) in a row tell as much as one: (1 + rho) / (1 - rho), (k,).

    They are taken for a first-order autoregressive process.
    """
    squares = np.maximum((left**2).sum(axis=0), np.finfo(float).tiny)
    rho = np.clip((left[1:] * left[:-1]).sum(axis=0) / squares, 0.0, 1.0 - 2.0 / len(left))
    return np.asarray((1.0 + rho) / (1.0 - rho))


@dataclass(frozen=True)
class GainFit:
    """A measured velocity as a multiple of a predicted one, beside a steady drift.

    Attributes
    ----------
    t, form : (m,) s and (m,) the response that fits best, m/s or rad/s, without its delay
    scales : (2,) inertia and damping of that, times the model's, as near to it as fit
    gain : peak of the measured over that of the predicted response, in the axis of the wrench
    sign : 1: as it should be, -1: reversed, 0: undecided
    delay, delay_error : s, and its standard error
    squares : of what is left of the velocity in that axis
    residual : its root mean square, m/s or rad/s
    measured, predicted : (6,) peak of each velocity, as far as it has the shape of the prediction

    """

    t: np.ndarray
    form: np.ndarray
    scales: np.ndarray
    gain: float
    sign: int
    delay: float
    delay_error: float
    squares: float
    residual: float
    measured: np.ndarray
    predicted: np.ndarray


def fit_response(
    vehicle: Vehicle,
    x: np.ndarray,
    held: Held,
    t: np.ndarray,
    nu: np.ndarray,
    axis: int,
    noise: Noise,
    latest: float,
    scales: np.ndarray = SCALES,
) -> GainFit:
    """Fit gain * added(t - delay) + c_0 + c_1 t + c_2 alone(t) to a velocity.

    The wrench acts one way and then the other, so that what it adds rises and falls. What is
    steady, such as buoyancy, a current or a slow turn, is taken up by the straight line, and the
    swinging of a vehicle that something rights by the motion that the model has without a wrench.
    A vehicle that is quicker or slower than its model can look like one that is late and goes the
    other way: inertia and damping are nuisance parameters, and each sign has the best of them.

    Parameters
    ----------
    vehicle, x : the model and its state (13,) at first
    held : wrenches along the axis
    t, nu : (n,) s and (n, 6) m/s and rad/s, measured
    axis : of the wrench
    noise : of nu at rest
    latest : s of delay that may be, half of a pulse
    scales : (k, 2) inertia and damping that may be, times the model's

    """
    model = predicted(vehicle, x, held)
    varied = _varied(vehicle, x, held, model, axis, scales)
    delays = np.arange(0.0, OPPOSED + FINE / 2, FINE)
    early = delays < latest + FINE / 2
    late = np.maximum(t - delays[:, None], 0.0)
    forms, alone = _at(late, varied.t, varied.added), _at(t, varied.t, varied.alone)
    gains, squares, still = _gains(t, nu[:, axis], forms, alone)
    # of each sign: by no response at all, where none of its kind makes it better
    of_sign = {sign: np.where(np.sign(gains) == sign, squares, np.inf) for sign in (1, -1)}
    best = {one: min(float(left[:, early].min()), still.min()) for one, left in of_sign.items()}
    sign = max(best, key=lambda one: -best[one])
    mine, least = of_sign[sign][:, early], best[sign]
    opposite = min(float(of_sign[-sign].min()), float(still.min()))
    white = KNOWN * float(noise.variance[axis]) * len(t)
    chance = 2.0 * SURE * float((noise.variance * noise.alike)[axis])
    unlike, moved = max(least - white, 0.0), float(still.min()) - white
    # the scales nearest to the model's own of those that fit as well
    alike = mine.min(axis=1) <= least + chance + AS_WELL * moved
    k = int(np.argmin(np.where(alike, (np.log(scales) ** 2).sum(axis=1), np.inf)))
    i = int(np.argmin(mine[k]))
    form, near = gains[k, i] * varied.added[:, k], scales[k]
    delays = delays[early]
    measured, shares = _peaks(t, nu, model, axis, delays)
    measured[axis] = np.sign(gains[k, i]) * np.abs(form).max()
    gain = float(measured[axis] / np.abs(model.added[:, axis]).max())
    clear = opposite - least > MISFIT * unlike + chance and unlike < EXPLAINED * moved
    told = clear and abs(gain) >= NOTHING
    k, i = (int(one) for one in np.unravel_index(np.argmin(mine), mine.shape))
    left = _beside(_steady(t, alone[k]), nu[:, axis] - gains[k, i] * forms[k, i])
    spread = least / len(t) * float(in_a_row(left[:, None])[0])
    likely = delays[mine.min(axis=0) <= least + spread]
    error = float(np.hypot(np.abs(likely - delays[i]).max(initial=0.0), FINE / 2.0))
    return GainFit(
        varied.t, form, near, gain, sign if told else 0, float(delays[i]), error,
        least, float(np.sqrt(least / len(t))), measured, shares,
    )  # fmt: skip


def _peaks(
    t: np.ndarray, nu: np.ndarray, model: Predicted, axis: int, delays: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Peak of each velocity, measured at whatever delay and predicted, in the shape of an axis."""
    forms = np.interp(t - delays[:, None], model.t, model.added[:, axis])
    free, prompt = (_at(t, model.t, part) for part in (model.alone, model.added))
    gains, squares, _ = _gains(t, nu.T, forms, free)
    shares, _, _ = _gains(t, prompt, forms[:1], free)
    measured = np.take_along_axis(gains, squares.argmin(axis=1)[:, None], axis=1)
    peak = np.abs(model.added[:, axis]).max()
    return peak * measured[:, 0], peak * shares[:, 0]


def _at(wanted: np.ndarray, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Columns of values (m, k) at times (m,), interpolated at those wanted: (k, ...)."""
    return np.array([np.interp(wanted, t, column) for column in values.T])


def _gains(
    t: np.ndarray, y: np.ndarray, forms: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Factors of forms beside line and free motion; squares left by each, and by none.

    They are (..., k), (..., k) and (...,) of signals y (..., n), forms (..., k, n) and motions
    (..., n).
    """
    basis = _steady(t, free)
    y = _beside(basis, y)
    size = np.einsum('...n,...n->...', forms, forms)
    strong = size - ((forms @ basis) ** 2).sum(axis=-1)  # of what is left beside line and motion
    told = strong > ALIKE * size
    gain = np.where(told, (forms @ y[..., None])[..., 0] / np.where(told, strong, 1.0), 0.0)
    still = (y**2).sum(axis=-1)
    return gain, np.maximum(still[..., None] - gain**2 * strong, 0.0), still


def _beside(basis: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Signals (..., n) without what an orthonormal basis (..., n, k) spans."""
    return np.asarray(y - (basis @ (basis.swapaxes(-1, -2) @ y[..., None]))[..., 0])


def _steady(t: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Orthonormal basis (..., n, 3) of a straight line and a free motion (..., n).

    What is as much alike as to be one has a vector less, and zeros in its place.
    """
    line = np.ones_like(free), np.broadcast_to(t - t.mean(), free.shape)
    rest = np.stack([*line, free - free.mean(axis=-1, keepdims=True)], axis=-1)
    size = np.maximum(np.linalg.norm(rest, axis=-2, keepdims=True), np.finfo(float).tiny)
    basis, strength, _ = np.linalg.svd(rest / size, full_matrices=False)
    return np.asarray(basis * (strength > ALIKE * strength[..., :1])[..., None, :])
