"""A driver on a clock of its own: it takes wrenches and gives odometry, with a fault if wanted."""

import math
from collections import deque
from collections.abc import Callable
from functools import cache

import numpy as np
from helpers.made_odometry import BEGAN

from auv_analysis.driver.odometry_log import OdometryBuffer, OdometryLog
from auv_analysis.driver.plan import plan_of
from auv_dynamics import load_vehicle
from auv_dynamics.kernel.compile import plain
from auv_dynamics.ros.interface import NANOSECONDS, Frames
from auv_dynamics.vehicle.kinematics import attitude_rate, position_rate, quaternion
from auv_dynamics.vehicle.model import acceleration

STEP = 0.01  # s
ZERO = (0.0,) * 6

loaded, planned = cache(load_vehicle), cache(plan_of)


class SimulatedDriver:
    """The client that `carry_out` takes.

    Parameters
    ----------
    mapping : of the wrench that is taken to the one that acts
    watchdog : s after which an old wrench is none; None: it is obeyed for ever
    inertia, damping : of the vehicle, times those of its file
    delay, lag : s before a wrench acts, and time constant of the thrusters
    noise : standard deviation of the velocity, m/s and rad/s
    bias : of the velocity
    applied : whether `wrench_applied` is published
    drift : steady wrench of the water
    silent_after, fast_after, joined_after : s after which the odometry ceases, the vehicle is
        torn away, somebody else publishes the wrench

    """

    def __init__(
        self,
        vehicle: str = 'bluerov2_heavy',
        mapping: Callable[[np.ndarray], np.ndarray] = lambda tau: tau,
        watchdog: float | None = 0.5,
        inertia: float = 1.0,
        damping: float = 1.0,
        delay: float = 0.0,
        lag: float = 0.0,
        noise: float = 0.0,
        bias: tuple = ZERO,
        applied: bool = False,
        drift: tuple = ZERO,
        silent_after: float = np.inf,
        fast_after: float = np.inf,
        joined_after: float = np.inf,
    ):
        self.vehicle, self._mapping, self._watchdog = loaded(vehicle), mapping, watchdog
        model = self.vehicle.changed(
            M=inertia * self.vehicle.M,
            D_linear=damping * self.vehicle.D_linear,
            D_quadratic=damping * self.vehicle.D_quadratic,
        ).model
        # numbers of Python, with which the kernel as it is written runs three times as fast
        self._model = model._make(part if part is None else part.tolist() for part in model)
        self._delay, self._noise, self._applied = delay, noise, applied
        self._bias, self._answers, self._acting = np.array(bias), 1.0, np.zeros(6)
        if lag:
            self._answers = 1.0 - np.exp(-STEP / lag)
        self._drift = np.array(drift)
        self._until = {'silent': silent_after, 'fast': fast_after, 'joined': joined_after}
        self.buffer, self.sent = OdometryBuffer(), []
        self._random = np.random.default_rng(3)
        self._pose, self._nu = [0.0, 0.0, 5.0, *quaternion([0.0, 0.0, 0.7]).tolist()], [0.0] * 6
        self._k = 0
        self._ways: deque[tuple[float, tuple]] = deque()
        self._held, self._heard = ZERO, -np.inf
        self.listen(0.1)

    @property
    def _t(self) -> float:
        return self._k * STEP

    def now_ns(self) -> int:
        return BEGAN + round(self._t * NANOSECONDS)

    def others(self) -> list[str]:
        return ['/somebody'] if self._t > self._until['joined'] else []

    def send(self, tau: tuple) -> int:
        self.sent.append(tau)
        self._ways.append((self._t + self._delay, tau))
        return self.now_ns()

    def take(self, mapping: Callable[[np.ndarray], np.ndarray]) -> None:
        """Another mapping of the wrench."""
        self._mapping = mapping

    def listen(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP)):
            self._step()

    def _step(self) -> None:
        while self._ways and self._ways[0][0] <= self._t:
            self._heard, self._held = self._ways.popleft()
        old = self._watchdog is not None and self._t - self._heard > self._watchdog
        tau = np.zeros(6) if old else self._mapping(np.array(self._held))
        self._acting += self._answers * (tau - self._acting)
        acting = (self._acting + self._drift).tolist()
        q, nu = self._pose[3:], self._nu
        rate = plain(acceleration)(self._model, q, nu, acting, ZERO)
        moved = plain(position_rate)(q, nu) + plain(attitude_rate)(q, nu)
        pose = [x + STEP * v for x, v in zip(self._pose, moved, strict=True)]
        size = math.hypot(*pose[3:])
        self._pose = pose[:3] + [x / size for x in pose[3:]]
        self._nu = [x + STEP * v for x, v in zip(nu, rate, strict=True)]
        if self._t > self._until['fast']:
            self._nu = [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        self._k += 1
        if self._t > self._until['silent']:
            return
        noise = self._noise * self._random.normal(size=6)
        x = (*self._pose, *(self._nu + self._bias + noise).tolist())
        frames = Frames()
        ns = self.now_ns()
        self.buffer.odometry(ns, ns, ns, x, (frames.odom, frames.base), self._k)
        if self._applied:
            self.buffer.wrench_applied(ns, tuple(tau.tolist()))

    def log(self) -> OdometryLog:
        return self.buffer.log(BEGAN, self.now_ns())
