"""The vehicle as a system to integrate: state x = position (3), quaternion (4), nu (6)."""

from typing import NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.integrator import (
    TABLEAUS,
    Tableau,
    fill_step,
    stage_times,
)
from auv_dynamics.kernel.lanes import Number, sqrt
from auv_dynamics.kernel.six import (
    Numbers,
    Vector,
    fill_vector,
    vector,
)
from auv_dynamics.plant.actuators import IDEAL, Actuators
from auv_dynamics.plant.devices import Acting, Sensing, SensorNoise
from auv_dynamics.plant.faults import NONE, WRENCH, FaultRows, Faults
from auv_dynamics.plant.uncertainty import (
    PlantModel,
    Uncertainty,
    lumped,
    true_acceleration,
)
from auv_dynamics.vehicle.kinematics import (
    attitude_rate,
    euler,
    position_rate,
    quaternion,
    unwrapped,
)

SIZE = 13
DIVERGED = 100.0  # m/s, rad/s: no underwater vehicle is as fast
BLOCK = 256  # steps whose disturbance is tabulated at once


@helper
def attitude_of(x: np.ndarray) -> tuple[Number, Number, Number, Number]:
    """Quaternion w, x, y, z of a state."""
    return (x[3], x[4], x[5], x[6])


@helper
def fill_plant_rate(
    truth: PlantModel, x: np.ndarray, tau: Vector, F: Vector, current: np.ndarray, stage: int,
    rate: np.ndarray,
) -> None:  # fmt: skip
    """Write (2) and (1) at state x, under wrench tau and external disturbance F, into `rate`."""
    attitude, nu = attitude_of(x), vector(x, 7)
    rate[0], rate[1], rate[2] = position_rate(attitude, nu)
    rate[3], rate[4], rate[5], rate[6] = attitude_rate(attitude, nu)
    fill_vector(rate, 7, true_acceleration(truth, attitude, nu, tau, F, current, stage))


@helper
def fill_unit_attitude(x: np.ndarray) -> None:
    """Renormalise the quaternion of a state in place."""
    norm = sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5] + x[6] * x[6])
    x[3] /= norm
    x[4] /= norm
    x[5] /= norm
    x[6] /= norm


class HeldWrench(NamedTuple):
    """The plant over one step with tau held: `F`, `current` (s, 6) at the stages of this step."""

    truth: PlantModel
    tau: Vector
    F: np.ndarray
    current: np.ndarray

    @staticmethod
    def fill_rate(system: 'HeldWrench', stage: int, x: np.ndarray, rate: np.ndarray) -> None:
        """x_dot at one stage."""
        F = vector(system.F[stage], 0)
        fill_plant_rate(system.truth, x, system.tau, F, system.current, stage, rate)


@helper
def fill_plant_step(
    truth: PlantModel, x: np.ndarray, tau: Vector, F: np.ndarray, current: np.ndarray, step: float,
    tableau: Tableau, stages: np.ndarray, trial: np.ndarray,
) -> None:  # fmt: skip
    """Advance the plant's state x (13,) in place by one step under a held wrench."""
    fill_step(HeldWrench(truth, tau, F, current), x, step, tableau, stages, trial)
    fill_unit_attitude(x)


compiled_plant_step = compiled(fill_plant_step)


@compiled
def lumped_uncertainty(
    truth: PlantModel, x: np.ndarray, tau: Vector, F: np.ndarray, current: np.ndarray
) -> Numbers:
    """F of (1) and (3) at the state x under the applied wrench tau, see `lumped`."""
    attitude, nu, d = attitude_of(x), vector(x, 7), vector(F[0], 0)
    nu_dot = true_acceleration(truth, attitude, nu, tau, d, current, 0)
    return lumped(truth, attitude, nu, tau, d, nu_dot)


def initial_state(eta: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """State (..., 13) from eta (..., 6) in m (NED) and rad, and nu (..., 6) in m/s, rad/s."""
    eta = np.asarray(eta, float)
    return np.concatenate([eta[..., :3], quaternion(eta[..., 3:]), np.asarray(nu, float)], axis=-1)


def eta_of(x: np.ndarray) -> np.ndarray:
    """Position and Euler angles (..., 6) of states (..., 13); psi is not unwrapped."""
    return np.concatenate([x[..., :3], euler(x[..., 3:7])], axis=-1)


def unwrapped_eta(x: np.ndarray) -> np.ndarray:
    """Eta (n, 6) of the states (n, 13) of consecutive samples."""
    eta = eta_of(x)
    eta[:, 3:] = unwrapped(eta[:, 3:])
    return eta


class Plant:
    """A vehicle with its actuators and sensors, one step at a time: `answer`, then `advance`.

    Parameters
    ----------
    uncertainty : coefficients of (1), disturbance and current
    step : integration step, s
    integrator : 'ode5', 'rk4' or 'euler'
    x : (13,) initial state, copied
    actuators : between the command and the applied wrench; default: the command is applied
    noise : of the sensors; None: they are perfect
    faults : what fails of actuators, links and the delay of sensors; the other faults of sensors
        are part of `noise`
    seed : of the faults
    applied : wrench before the first step, from which lag and slew rate of the actuators go on

    """

    def __init__(
        self, uncertainty: Uncertainty, step: float, integrator: str, x: np.ndarray,
        actuators: Actuators = IDEAL, noise: SensorNoise | None = None, faults: Faults = NONE,
        seed: int = 0, applied: tuple[float, ...] = (0.0,) * 6,
    ):  # fmt: skip
        self._uncertainty, self._step, self._before = uncertainty, step, applied
        self._tableau = TABLEAUS[integrator]
        self._stages = np.zeros((len(self._tableau.b), SIZE))
        self._trial = np.zeros(SIZE)
        self._sensing, self._acting = Sensing(noise, faults), Acting(actuators, faults)
        self._fault_rows = FaultRows(faults, seed) if faults.entries else None
        self._faults = np.zeros((0, 0))
        self._first = 0
        self._F, self._current = (np.zeros((0, 0, 6)) for _ in range(2))
        self._rows = np.zeros((0, 0))
        self._start = np.array(x, float)
        self.k = 0
        self.reset()
        self._tabulate()
        self.answer((0.0,) * 6)  # compiles or loads the kernel: not at the first step
        self._integrate()
        self.reset()
        self._measure()

    def reset(self) -> None:
        """Put the vehicle and its actuators back to where they started; time goes on."""
        self.x = self._start.copy()
        self._sensing.reset(self.x)
        self._acting.reset(self._before)
        self._applied: tuple[float, ...] = (0.0,) * 6

    @property
    def measured(self) -> np.ndarray:
        """(13,) what is known of the state at this step."""
        return self._sensing.measured

    @property
    def measured_at(self) -> int:
        """Step at which that was measured, this one unless sensors are late."""
        return self.k - self._sensing.age

    @property
    def lost(self) -> bool:
        """Whether no new measurement has come at this step: `measured` is that of the last."""
        return self._sensing.lost

    @property
    def deaf(self) -> bool:
        """Whether a wrench that comes at this step is lost."""
        fault = self._fault
        return fault is not None and bool(fault[WRENCH])

    @property
    def diverged(self) -> bool:
        """Whether a velocity has left what any vehicle could have, or the finite numbers."""
        return not all(abs(speed) < DIVERGED for speed in self.x[7:].tolist())

    def answer(
        self, tau: tuple[float, ...], *, heard: bool = False
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Take the command of this step: six floats, N and N m.

        Parameters
        ----------
        tau : the command
        heard : it is what the actuators have: a fault that loses commands does nothing to it

        Returns
        -------
        applied, F : the wrench applied over the step, and the lumped uncertainty (3) at its start

        """
        truth, row = self._uncertainty.truth, self._row
        tau = tuple(map(float, tau))  # whole numbers would be another kernel, compiled on the spot
        self._applied = self._acting.apply(self.k, tau, self._fault, heard=heard)
        if truth.exact:
            return self._applied, tuple(self._F[row, 0])
        F, current = self._F[row], self._current[row]
        return self._applied, lumped_uncertainty(truth, self.x, self._applied, F, current)

    def advance(self) -> None:
        """Hold the applied wrench over one step, then measure."""
        self._integrate()
        self.k += 1
        if self.k - self._first >= len(self._F):
            self._tabulate()
        self._measure()

    @property
    def _row(self) -> int:
        return self.k - self._first

    @property
    def _fault(self) -> np.ndarray | None:
        return None if self._fault_rows is None else self._faults[self._row]

    def _tabulate(self) -> None:
        """Inputs of the next block of steps."""
        self._first = self.k
        times = stage_times(self._tableau, self._step, self.k, BLOCK)
        self._F, self._current = self._uncertainty.tables(times)
        self._rows = self._sensing.rows(BLOCK)
        if self._fault_rows is not None:
            self._faults = self._fault_rows.rows(BLOCK)

    def _measure(self) -> None:
        self._sensing.measure(self.k, self.x, self._rows[self._row], self._fault)

    def _integrate(self) -> None:
        row = self._row
        compiled_plant_step(
            self._uncertainty.truth,
            self.x,
            self._applied,
            self._F[row],
            self._current[row],
            self._step,
            self._tableau,
            self._stages,
            self._trial,
        )
