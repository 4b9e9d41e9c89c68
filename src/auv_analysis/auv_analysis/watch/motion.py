"""Motion as it was heard last: errors of the last seconds, energy and couplings."""

import math
from bisect import bisect_right
from collections import OrderedDict, deque
from typing import NamedTuple

import numpy as np

from auv_analysis.metrics.coupling import LiveAnalysis
from auv_analysis.watch.snapshot import Energy, Errors, Six
from auv_dynamics.ros import interface

CAPACITY = 4096  # set-points that are kept; more than any horizon that is accepted
PENDING = 512  # messages that wait for the one of the same stamp
FRESH = 3.0  # s for which an analysis that was published is shown
HELD_NS = interface.NANOSECONDS  # how far a set-point may lie behind the odometry
VELOCITY = 7  # numbers of a state before its velocity: position and quaternion
BUCKET, BUCKETS = 0.5, 20  # s, and how many of them errors are shown of


class Bucket(NamedTuple):
    """Samples (6,) of half a second: steady time of the first, largest sizes, squares, how many."""

    begin: float
    largest: np.ndarray
    squares: np.ndarray
    samples: int


class Trend:
    """The last ten seconds of six numbers that come in at steady times."""

    def __init__(self) -> None:
        self._buckets: deque[Bucket] = deque(maxlen=BUCKETS)

    def add(self, now: float, values: np.ndarray) -> None:
        """Take a sample (6,) at a steady time in s."""
        size = np.abs(values)
        new = Bucket(now, size, size * size, 1)
        if self._buckets and now - self._buckets[-1].begin < BUCKET:
            last = self._buckets.pop()
            largest = np.maximum(last.largest, size)
            new = Bucket(last.begin, largest, last.squares + new.squares, last.samples + 1)
        self._buckets.append(new)

    @property
    def largest(self) -> Six | None:
        """Largest absolute values (6,), or None without a sample."""
        if not self._buckets:
            return None
        return tuple(np.max([bucket.largest for bucket in self._buckets], axis=0).tolist())

    @property
    def rms(self) -> Six | None:
        """Root mean squares (6,) of the samples, or None without one."""
        count = sum(bucket.samples for bucket in self._buckets)
        if not count:
            return None
        squares = np.sum([bucket.squares for bucket in self._buckets], axis=0)
        return tuple(np.sqrt(squares / count).tolist())

    @property
    def history(self) -> tuple[Six, ...]:
        """Largest absolute values (6,) of each half second, the oldest first."""
        return tuple(tuple(bucket.largest.tolist()) for bucket in self._buckets)


class LiveMotion:
    """The newest numbers of each topic and what follows from them.

    Parameters
    ----------
    live : analysis of the vehicle, for what the graph does not publish itself

    Attributes
    ----------
    source : topic of the velocity; the true one, where it is published
    ns, nu, nu_d : stamp, velocity and set-point; the newest ones that belong together
    tau, lumped_error : newest values

    """

    def __init__(self, live: LiveAnalysis | None = None):
        self._live = live
        self.forget()

    def forget(self) -> None:
        """Begin anew, as another run does."""
        self.source: str | None = None
        self.ns: int | None = None
        self.nu: Six | None = None
        self.nu_d: Six | None = None
        self.tau: Six | None = None
        self.lumped_error: Six | None = None
        self._trend = Trend()
        self._paired = -math.inf  # when a velocity was last heard together with its set-point
        self._stamps: list[int] = []
        self._setpoints: list[Six] = []
        self._pending: dict[str, OrderedDict[int, Six]] = {
            name: OrderedDict() for name in (interface.DISTURBANCE, interface.DISTURBANCE_ESTIMATE)
        }
        self._published: dict[str, tuple[float, Six]] = {}

    def hear(self, now: float, topic: str, ns: int, values: Six) -> None:
        """Take the numbers of a message: steady time in s, stamp in ns."""
        if topic in (interface.ODOM, interface.GROUND_TRUTH):
            self._move(now, topic, ns, values[VELOCITY:])
        elif topic == interface.CMD_VEL:
            self._keep_setpoint(ns, values)
        elif topic == interface.WRENCH:
            self.tau = values
        elif topic in self._pending:
            self._match(topic, ns, values)
        elif topic in interface.ANALYSIS_TOPICS:
            self._published[topic] = now, values

    def _move(self, now: float, topic: str, ns: int, nu: Six) -> None:
        if topic == interface.ODOM and self.source == interface.GROUND_TRUTH:
            return
        if topic != self.source:
            self.source, self._trend = topic, Trend()
        nu_d = self._setpoint(ns)
        if nu_d is not None:
            self._trend.add(now, np.subtract(nu_d, nu))
            self._paired = now
        if nu_d is not None or now - self._paired > FRESH:
            self.ns, self.nu, self.nu_d = ns, nu, nu_d

    def _keep_setpoint(self, ns: int, values: Six) -> None:
        if self._stamps and ns <= self._stamps[-1]:
            del self._stamps[bisect_right(self._stamps, ns - 1) :]
            del self._setpoints[len(self._stamps) :]
        self._stamps.append(ns)
        self._setpoints.append(values)
        if len(self._stamps) >= 2 * CAPACITY:
            del self._stamps[:CAPACITY], self._setpoints[:CAPACITY]

    def _setpoint(self, ns: int) -> Six | None:
        """Newest set-point at or before a stamp."""
        i = bisect_right(self._stamps, ns) - 1
        return self._setpoints[i] if i >= 0 and ns - self._stamps[i] <= HELD_NS else None

    def _match(self, topic: str, ns: int, values: Six) -> None:
        self._pending[topic][ns] = values
        F, f = (self._pending[name] for name in self._pending)
        if ns in F and ns in f:
            self.lumped_error = tuple(np.subtract(f[ns], F[ns]).tolist())
        while len(self._pending[topic]) > PENDING:
            self._pending[topic].popitem(last=False)

    @property
    def errors(self) -> Errors:
        """Velocity errors, now and lately."""
        if self.nu is None or self.nu_d is None:
            return Errors()
        trend, now = self._trend, np.subtract(self.nu_d, self.nu)
        largest, rms, window = trend.largest, trend.rms, BUCKET * BUCKETS
        return Errors(tuple(now.tolist()), largest, rms, window, trend.history)

    def published(self, now: float, topic: str) -> Six | None:
        """Newest numbers of an analysis topic, while it is alive."""
        at, values = self._published.get(topic, (-math.inf, None))
        return values if now - at < FRESH else None

    def energy(self, now: float) -> Energy | None:
        """Kinetic energy, as published or else computed."""
        components = self.published(now, interface.KINETIC_ENERGY)
        shares = self.published(now, interface.KINETIC_ENERGY_SHARES)
        if components is None or shares is None:
            if self._live is None or self.nu is None:
                return None
            components, shares = (tuple(x.tolist()) for x in self._live.energy(self.nu))
        return Energy(sum(components), components, shares)

    def delta_xi(self, now: float) -> Six | None:
        """Xi - nu, as published or else computed."""
        found = self.published(now, interface.DELTA_XI)
        if found is None and self._live is not None and self.nu is not None:
            return tuple(self._live.delta_xi(self.nu).tolist())
        return found

    def delta_pi(self, now: float) -> Six | None:
        """Pi - tau, as published or else computed."""
        found = self.published(now, interface.DELTA_PI)
        if found is None and self._live is not None and self.tau is not None:
            return tuple(self._live.delta_pi(self.tau).tolist())
        return found

    def lumped(self, now: float) -> Six | None:
        """W = f - F, as published or else computed."""
        return self.published(now, interface.LUMPED_ERROR) or self.lumped_error
