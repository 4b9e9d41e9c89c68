"""A vehicle in the water, one frame of ArduSub at a time: pulses in, what its sensors feel out."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from json_motors import CHANNELS, Motors

from auv_dynamics.files.errors import FailedError
from auv_dynamics.kernel.compile import plain
from auv_dynamics.plant.actuators import Actuators
from auv_dynamics.plant.faults import AXES, HELD, THRUSTERS, WRENCH, FaultRows
from auv_dynamics.plant.plant import Plant, initial_state
from auv_dynamics.plant.rotors import PER_ROW, Rotors, fill_followed
from auv_dynamics.plant.uncertainty import Uncertainty, to_body
from auv_dynamics.vehicle.kinematics import position_rate, rotation
from auv_dynamics.vehicle.thrusters import Thrusters

LONGEST = 0.005  # s of an integration step: a longer frame takes several
GRAVITY = np.array([0.0, 0.0, 9.80665])  # m/s^2, NED; what ArduPilot takes off: GRAVITY_MSS
USUAL = 400  # frames per second
WHOLE = 1e-9  # of a step
VELOCITY, TO_BODY = plain(position_rate), plain(to_body)  # R v and R^T v of q


class Reading(NamedTuple):
    """The vehicle at the end of a frame.

    Attributes
    ----------
    t : s since the start
    gyro : (3,) angular velocity, FSD, rad/s
    accel_body : (3,) specific force R^T (a - g) at the origin, the frame's mean, FSD, m/s^2
    position, velocity : (3,) NED, m and m/s over ground
    quaternion : (4,) w, x, y, z, body to NED

    """

    t: float
    gyro: np.ndarray
    accel_body: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray
    velocity: np.ndarray


class Physics:
    """The plant under pulses, in time steps that ArduSub asks for.

    Parameters
    ----------
    thrusters : of the vehicle file
    motors : thrusts of pulses
    uncertainty : what acts on the plant besides
    integrator : 'ode5', 'rk4' or 'euler'
    start : eta (6,), nu (6,)
    actuators : of a step in s: lag and slew rate between wrench and plant; the rotors
    faults : makes the rows of a run that begins; s between two of them
    record : told of t, state, wrench of the pulses, wrench applied, F as each frame begins

    """

    def __init__(
        self, thrusters: Thrusters, motors: Motors, uncertainty: Uncertainty, integrator: str,
        start: tuple[np.ndarray, np.ndarray],
        actuators: Callable[[float], tuple[Actuators, Rotors | None]],
        faults: tuple[Callable[[], FaultRows | None], float] = (lambda: None, 1.0),
        record: Callable[..., Any] = lambda *_: None,
    ):  # fmt: skip
        self._T, self._motors, self._uncertainty = thrusters.matrix, motors, uncertainty
        self._integrator, self._start = integrator, initial_state(*start)
        self._actuators, self._make_rows, self._fault_step = actuators, *faults
        self._record = record
        self.reset()
        # compiles or loads the kernels: not at the first frame
        self._plant = self._plant_at(USUAL)
        self._delivered(np.zeros(len(self._T[0])), None)
        self.reset()

    def reset(self) -> None:
        """Put the vehicle back to where it started, and time to zero."""
        self.t, self._x, self._rate = 0.0, self._start, 0
        self._rows, self._row, self._row_k = self._make_rows(), np.zeros(0), -1
        self._heard = np.zeros(CHANNELS)
        self._speeds = np.zeros((-(-self._T.shape[1] // PER_ROW), 6))  # of the rotors
        self._applied: tuple[float, ...] = (0.0,) * 6

    def step(self, pulses: np.ndarray, rate: int) -> Reading:
        """Hold pulses (32,) for 1/rate s; FailedError where the vehicle leaves finite numbers."""
        if rate != self._rate:
            self._began, self._frames, self._rate = self.t, 0, rate
            self._plant = self._plant_at(rate)
        asked, u, fault = self._asked(pulses)
        before = self._x.copy()
        for i in range(self._substeps):
            tau = tuple(self._delivered(u, fault).tolist())
            self._applied, F = self._plant.answer(tau)
            if i == 0:
                self._record(self.t, before, asked, self._applied, F)
            self._plant.advance()
            self._x = self._plant.x
            self._stop_at_surface(self._x)
        self._frames += 1
        self.t = self._began + self._frames / rate
        if self._plant.diverged:
            raise FailedError(f'the simulation diverges at {self.t:g} s')
        return self._reading(before, 1.0 / rate)

    def _plant_at(self, rate: int) -> Plant:
        """The plant from here on, in steps of which a frame is a multiple."""
        self._substeps = math.ceil(1.0 / (rate * LONGEST) - WHOLE)
        began, F, current = self.t, self._uncertainty.F, self._uncertainty.current
        later = None if current is None else lambda t: current(t + began)
        uncertainty = replace(self._uncertainty, F=lambda t: F(t + began), current=later)
        step = 1.0 / (rate * self._substeps)
        actuators, self._rotors = self._actuators(step)
        applied = self._applied
        return Plant(uncertainty, step, self._integrator, self._x, actuators, applied=applied)

    def _asked(self, pulses: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Wrench (6,) of the pulses, thrusts (n,) of those that arrive, faults of this time."""
        u = self._motors.thrusts(pulses)
        if self._rows is None:
            return self._T @ u, u, None
        while self._row_k < math.floor(self.t / self._fault_step + WHOLE):
            self._row, self._row_k = self._rows.rows(1)[0], self._row_k + 1
        if self._row[WRENCH] != HELD:
            self._heard = pulses if self._row[WRENCH] == 0.0 else np.zeros(CHANNELS)
        return self._T @ u, self._motors.thrusts(self._heard), self._row

    def _delivered(self, u: np.ndarray, fault: np.ndarray | None) -> np.ndarray:
        """Wrench (6,) of rotors that follow the steady thrusts u over a step, and their faults."""
        if self._rotors is not None and self._rotors.turning:
            u = u.copy()
            fill_followed(self._rotors, u, self._speeds)
        if fault is None:
            return self._T @ u
        if n := (len(fault) - THRUSTERS) // 2:
            u = fault[THRUSTERS : THRUSTERS + n] * u + fault[THRUSTERS + n :]
        return fault[AXES : AXES + 6] * (self._T @ u) + fault[AXES + 6 : THRUSTERS]

    @staticmethod
    def _stop_at_surface(x: np.ndarray) -> None:
        """Let nothing rise out of the water: the vehicle file's buoyancy knows no surface."""
        if x[2] < 0.0:
            x[2], R = 0.0, rotation(x[3:7])
            velocity = R @ x[7:10]
            velocity[2] = max(velocity[2], 0.0)
            x[7:10] = R.T @ velocity

    def _reading(self, before: np.ndarray, period: float) -> Reading:
        x, (q, nu) = self._x, (self._x[3:7].tolist(), self._x[7:].tolist())
        q_before, nu_before = before[3:7].tolist(), before[7:].tolist()
        velocity = np.array(VELOCITY(q, nu))
        force = (velocity - VELOCITY(q_before, nu_before)) / period - GRAVITY
        felt = np.mean([TO_BODY(q_before, force.tolist()), TO_BODY(q, force.tolist())], axis=0)
        return Reading(self.t, x[10:], felt, x[:3], x[3:7], velocity)
