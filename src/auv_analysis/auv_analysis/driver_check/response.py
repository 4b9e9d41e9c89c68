"""The answer to a wrench against that of the model: how large, and how late."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auv_analysis.driver_check.prediction import Predicted

LATEST = 0.8  # s of delay that are looked for
FINE = 0.01  # s between two delays that are tried
ALIKE = 1e-6  # of the largest: terms that are as much alike are one
TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Response:
    """A measured velocity as a multiple of a predicted one, beside a steady drift.

    Attributes
    ----------
    gain : measured over predicted, in the axis of the wrench
    error : standard error of it
    delay : s
    squares : of what is left of the velocity in that axis
    measured, predicted : (6,) peak of each velocity, as far as it has the shape of the prediction

    """

    gain: float
    error: float
    delay: float
    squares: float
    measured: np.ndarray
    predicted: np.ndarray


def response_of(t: np.ndarray, nu: np.ndarray, model: Predicted, axis: int) -> Response:
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
    fits = [_fits(t, nu[:, j], forms, free[j]) for j in range(6)]
    best = [int(np.argmin(fit.squares)) for fit in fits]
    peak = float(np.abs(model.added[:, axis]).max())
    prompt = [np.interp(t, model.t, column) for column in model.added.T]
    predicted = [_fits(t, prompt[j], forms[:1], free[j]).gain[0] for j in range(6)]
    found, i = fits[axis], best[axis]
    return Response(
        float(found.gain[i]),
        float(found.error[i]),
        float(delays[i]),
        float(found.squares[i]),
        np.array([fit.gain[k] for fit, k in zip(fits, best, strict=True)]) * peak,
        np.array(predicted) * peak,
    )


class Fits(NamedTuple):
    """Factors (k,) of some forms, their standard errors, and the squares that each leaves."""

    gain: np.ndarray
    error: np.ndarray
    squares: np.ndarray


def _fits(t: np.ndarray, y: np.ndarray, forms: np.ndarray, free: np.ndarray) -> Fits:
    """Fit forms (k, n), one at a time, beside a straight line and a free motion."""
    rest = np.stack([np.ones_like(t), t - t.mean(), free - free.mean()], axis=1)
    size = np.linalg.norm(rest, axis=0)
    basis, strength, _ = np.linalg.svd(rest / np.maximum(size, TINY), full_matrices=False)
    basis = basis[:, strength > ALIKE * strength[0]]
    y = y - basis @ (basis.T @ y)
    whole = (forms**2).sum(axis=1)
    forms = forms - forms @ basis @ basis.T
    own = (forms**2).sum(axis=1)
    told = own > ALIKE * whole
    own = np.where(told, own, 1.0)
    gain = np.where(told, forms @ y / own, 0.0)
    squares = np.maximum(y @ y - gain**2 * own, 0.0)
    freedom = max(len(t) - basis.shape[1] - 1, 1)
    error = np.where(told, np.sqrt(squares / freedom / own), np.inf)
    return Fits(gain, error, squares)
