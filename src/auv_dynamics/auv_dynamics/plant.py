"""The vehicle as a system to integrate: state x = position (3), quaternion (4), nu (6)."""

from typing import NamedTuple

import numpy as np

from auv_dynamics.disturbance import Disturbance
from auv_dynamics.integrator import TABLEAUS, fill_step, stage_times
from auv_dynamics.jit import compiled, helper
from auv_dynamics.kinematics import attitude_rate, euler, position_rate, quaternion
from auv_dynamics.model import Model, acceleration
from auv_dynamics.six import fill_vector, vector

SIZE = 13
DIVERGED = 100.0  # m/s, rad/s: no underwater vehicle is as fast
BLOCK = 256  # steps whose disturbance is tabulated at once


@helper
def attitude_of(x):
    """Quaternion w, x, y, z of a state."""
    return (x[3], x[4], x[5], x[6])


@helper
def fill_plant_rate(model, x, tau, F, rate):
    """Write (2) and (1) at state x under wrench tau and lumped uncertainty F into `rate`."""
    attitude, nu = attitude_of(x), vector(x, 7)
    rate[0], rate[1], rate[2] = position_rate(attitude, nu)
    rate[3], rate[4], rate[5], rate[6] = attitude_rate(attitude, nu)
    fill_vector(rate, 7, acceleration(model, attitude, nu, tau, F))


@helper
def fill_unit_attitude(x):
    """Renormalise the quaternion of a state in place."""
    norm = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5] + x[6] * x[6])
    x[3] /= norm
    x[4] /= norm
    x[5] /= norm
    x[6] /= norm


class HeldWrench(NamedTuple):
    """The plant over one step with tau held: `F` (s, 6) at the stages of this step."""

    model: Model
    tau: tuple
    F: np.ndarray

    @staticmethod
    def fill_rate(system, stage, x, rate):
        """x_dot at one stage."""
        fill_plant_rate(system.model, x, system.tau, vector(system.F[stage], 0), rate)


@compiled
def fill_plant_step(model, x, tau, F, step, tableau, stages, trial):
    """Advance the plant's state x (13,) in place by one step under a held wrench."""
    fill_step(HeldWrench(model, tau, F), x, step, tableau, stages, trial)
    fill_unit_attitude(x)


def initial_state(eta: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """State (13,) from eta (6,) in m (NED) and rad, and nu (6,) in m/s, rad/s."""
    return np.concatenate([eta[:3], quaternion(np.asarray(eta)[3:]), nu]).astype(float)


def eta_of(x: np.ndarray) -> np.ndarray:
    """Position and Euler angles (..., 6) of states (..., 13); psi is not unwrapped."""
    return np.concatenate([x[..., :3], euler(x[..., 3:7])], axis=-1)


class Plant:
    """A vehicle under a held wrench and a disturbance of time, one step at a time.

    Parameters
    ----------
    model : coefficients of (1)
    disturbance : F(t), N and N m
    step : integration step, s
    integrator : 'ode5', 'rk4' or 'euler'
    x : (13,) initial state, copied

    """

    def __init__(
        self, model: Model, disturbance: Disturbance, step: float, integrator: str, x: np.ndarray
    ):
        self._model, self._disturbance, self._step = model, disturbance, step
        self._tableau = TABLEAUS[integrator]
        self._stages = np.zeros((len(self._tableau.b), SIZE))
        self._trial = np.zeros(SIZE)
        self._first, self._F = 0, np.zeros((0, len(self._tableau.b), 6))
        self.k = 0
        self.x = np.array(x, float)
        self.advance((0.0,) * 6)  # compiles or loads the kernel: not at the first step
        self.k = 0
        self.x = np.array(x, float)

    def F(self) -> np.ndarray:
        """Lumped uncertainty at the stages of the present step: (s, 6), stage 0 being t_k."""
        if not self._first <= self.k < self._first + len(self._F):
            self._first = self.k
            times = stage_times(self._tableau, self._step, self.k, BLOCK)
            self._F = self._disturbance(times.ravel()).reshape(*times.shape, 6)
        return self._F[self.k - self._first]

    @property
    def diverged(self) -> bool:
        """Whether a velocity has left what any vehicle could have, or the finite numbers."""
        return not (np.abs(self.x[7:]) < DIVERGED).all()

    def advance(self, tau: tuple) -> None:
        """Hold the wrench tau, six floats in N and N m, over one step."""
        fill_plant_step(
            self._model,
            self.x,
            tau,
            self.F(),
            self._step,
            self._tableau,
            self._stages,
            self._trial,
        )
        self.k += 1
