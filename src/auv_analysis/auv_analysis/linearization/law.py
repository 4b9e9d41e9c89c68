"""A law as a function of all that it is given, where it holds a velocity, and its derivatives."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from auv_analysis.linearization.derivatives import jacobian
from auv_dynamics.kinematics import quaternion
from auv_dynamics.vehicle import Vehicle
from auv_gvc_controller.model import ControlModel
from auv_gvc_controller.sampled import (
    anti_windup,
    compiled_sample,
    fill_sample,
    is_compiled,
    user_law,
)

ROUNDING = 1e-9
TRIALS = 20  # of Newton's method for the states in which a law holds a velocity


class LawAt:
    """A law around an attitude: y = (phi, theta, nu, its states, nu_d, nu_d_dot) to its answer.

    Parameters
    ----------
    gains : named tuple of the law's gains
    model : what the law knows of the vehicle
    psi : heading, rad

    """

    def __init__(self, gains: Any, model: ControlModel, psi: float):
        self._gains, self._model, self._psi = gains, model, psi
        self._guard = anti_windup(gains, None)
        self._sample = compiled_sample if is_compiled(gains) else fill_sample
        self.states = type(gains).STATES

    def answer(self, y: np.ndarray) -> np.ndarray:
        """(6 + m,): tau in N and N m, then the rates of the law's m states, at t = 0."""
        m = self.states
        nu, state, nu_d, nu_d_dot = np.split(y[2:], [6, 6 + m, 12 + m])
        attitude = quaternion(np.array([y[0], y[1], self._psi]))
        return self._tau_and_rate((nu, attitude, nu_d, nu_d_dot), state.copy())

    def _tau_and_rate(self, given: Iterable[Iterable[float]], state: np.ndarray) -> np.ndarray:
        # a sample after no time at all: nothing is integrated
        nu, attitude, nu_d, nu_d_dot = (tuple(map(float, part)) for part in given)
        rate = np.zeros(self.states)
        with user_law(self._gains):
            tau, _ = self._sample(
                0.0, 0.0, nu, attitude, nu_d, nu_d_dot, state, rate,
                self._gains, self._model, self._guard,
            )  # fmt: skip
        answer = np.concatenate([tau, rate])
        if not np.isfinite(answer).all():
            raise ArithmeticError(f'the law gave what is not finite: {answer}')
        return answer

    def jacobian(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (6 + m, 20 + m) of the answer, and their errors."""
        return jacobian(self.answer, y)


def holding_point(law: LawAt, plant: Vehicle, eta: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Argument of a law that holds nu: nu_d = nu, nu_d_dot = 0, states that balance the plant.

    Parameters
    ----------
    law : LawAt
    plant : Vehicle; where it is what the law knows, the states are zero
    eta, nu : (6,) m and rad, m/s and rad/s

    Returns
    -------
    y : (20 + m,) as `LawAt.answer` takes it

    Raises
    ------
    ArithmeticError : there are no such states

    """
    m = law.states
    needed = np.concatenate([plant.inverse_dynamics(eta, nu, np.zeros(6)), np.zeros(m)])
    y = np.concatenate([eta[3:5], nu, np.zeros(m), nu, np.zeros(6)])
    bound = ROUNDING * max(1.0, np.abs(needed).max())
    for _ in range(TRIALS):
        missing = needed - law.answer(y)
        if np.abs(missing).max() <= bound:
            return y
        slope, _ = law.jacobian(y)
        y[8 : 8 + m] += np.linalg.lstsq(slope[:, 8 : 8 + m], missing, rcond=None)[0]
    raise ArithmeticError(
        f'the law holds nu = {nu} in no state: {np.abs(missing).max():.3g} N or N m are missing'
    )
