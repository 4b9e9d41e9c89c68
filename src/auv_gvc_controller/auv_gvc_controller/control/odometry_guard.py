"""Acceptance of odometry: stamps must go forward, be recent and not jump; speeds be plausible."""

import math
from dataclasses import dataclass
from typing import NamedTuple

ZERO = (0.0,) * 6


@dataclass(frozen=True)
class Limits:
    """Largest magnitudes of a body-frame 6-vector's linear and angular part.

    Attributes
    ----------
    speed, rate : m/s and rad/s
    acceleration : m/s2 and rad/s2

    """

    speed: float = math.inf
    rate: float = math.inf
    acceleration: float = math.inf

    def check_velocity(self, nu: tuple[float, ...]) -> None:
        """Raise ValueError for a velocity (6,) that no vehicle has."""
        self._check('twist', nu, (self.speed, self.rate), ('m/s', 'rad/s'))

    def check_acceleration(self, nu_dot: tuple[float, ...]) -> None:
        """Raise ValueError for an acceleration (6,) that no vehicle has."""
        self._check('accel', nu_dot, (self.acceleration,) * 2, ('m/s2', 'rad/s2'))

    @staticmethod
    def _check(
        key: str, values: tuple[float, ...], most: tuple[float, ...], units: tuple[str, ...]
    ) -> None:
        for part, first, limit, unit in zip(
            ('linear', 'angular'), (0, 3), most, units, strict=True
        ):
            size = math.hypot(*values[first : first + 3])
            if not size <= limit:  # NaN is not believed either
                text = f'expected at most {limit:g} {unit}, found {size:g}'
                raise ValueError(f'{key}.{part}: {text}')


AUTO, ROS, OWN = 'auto', 'ros', 'own'
CLOCKS = (AUTO, ROS, OWN)
SAME_EPOCH = 86_400 * 10**9  # ns: clocks that are further apart count from different beginnings
DRIFT = 1e-3  # s/s that two free-running clocks may drift apart


class Now(NamedTuple):
    """The present moment on two clocks.

    Attributes
    ----------
    steady : s, never goes back
    ros_ns : ns of the node's clock, 0 where it has not begun

    """

    steady: float
    ros_ns: int = 0


class StampAge:
    """Refuses stamps that are too old, or ahead of the clock.

    Parameters
    ----------
    clock : that wrote the stamps. 'ros': the node's own, so that the age is their difference;
        'own': a free-running one, so that the age counts from the freshest stamp seen; 'auto': as
        'ros' where both count from the same beginning, else as 'own'
    most : largest age, s

    """

    def __init__(self, clock: str, most: float):
        self._clock, self._most = clock, most
        self.reset()

    def reset(self) -> None:
        """Forget the freshest stamp, as when their clock has jumped."""
        self._freshest: tuple[float, float] | None = None  # steady s minus stamp s, and when

    def accept(self, ns: int, now: Now) -> None:
        """Take a stamp; ValueError where it is too old or ahead of the clock."""
        apart = now.ros_ns == 0 or abs(now.ros_ns - ns) > SAME_EPOCH
        free = self._clock == OWN or (self._clock == AUTO and apart)  # cannot be compared
        age, behind = (now.ros_ns - ns) / 1e9, now.steady - ns / 1e9  # s
        if free:
            offset, at = self._freshest or (behind, now.steady)
            age = max(0.0, behind - offset - DRIFT * (now.steady - at))
        if age > self._most:
            raise ValueError(f'stamp old: expected at most {self._most:g} s, found {age:.3g} s')
        if -age > self._most:
            text = f'expected at most {self._most:g} s ahead of the clock, found {-age:.3g} s'
            raise ValueError(f'stamp ahead of the clock: {text}')
        if free:
            self._freshest = behind - age, now.steady


UNTIMED = Now(0.0)  # lock-step: no clock but that of the stamps


class OdometryGuard:
    """Judges the stamps and speeds of consecutive odometry.

    Parameters
    ----------
    gap_ns : longest time between two stamps that a law may integrate over
    limits : speeds that are believed
    lockstep : a jump is then always an error; in real time the data stream may resume after it
    patience : s without accepted odometry after which stamps that have gone back are believed
    age : how old a stamp may be; None: any

    Attributes
    ----------
    last : stamp that was accepted last, ns
    origin : stamp from which the time of a run counts: it goes on where stamps begin anew
    restarts : how often the stamps began anew: at an earlier time, or more than a day later

    """

    def __init__(
        self,
        gap_ns: int,
        limits: Limits,
        lockstep: bool,
        patience: float = 0.0,
        age: StampAge | None = None,
    ):
        self._gap, self._limits, self._lockstep = gap_ns, limits, lockstep
        self._patience, self._age = patience, age
        self.last: int | None = None
        self.origin = 0
        self.restarts = 0
        self._candidate: int | None = None
        self._accepted_at = 0.0

    def accept(self, ns: int, nu: tuple[float, ...], now: Now = UNTIMED) -> float:
        """Seconds to integrate over since the last accepted odometry, 0 at the first.

        Parameters
        ----------
        ns : stamp
        nu : (6,) m/s and rad/s
        now : when it arrived

        Raises
        ------
        ValueError : this odometry must not be used; the text says what was expected and found

        """
        self._limits.check_velocity(nu)
        dt, restarted = self._seconds(ns, now)
        if self._age is not None:
            if restarted:
                self._age.reset()
            self._age.accept(ns, now)
        if self.last is None:
            self.origin = ns
        elif restarted:
            self.origin += ns - self.last
        self.restarts += restarted
        self.last, self._candidate, self._accepted_at = ns, None, now.steady
        return dt

    def _seconds(self, ns: int, now: Now) -> tuple[float, bool]:
        """Time since the last one, and whether the stamps have begun anew."""
        if self.last is None:
            return 0.0, False
        dt = ns - self.last
        if 0 < dt <= self._gap:
            return dt / 1e9, False
        # one stray stamp must not lock out those that follow: the second in a row is believed
        follows = self._candidate is not None and 0 < ns - self._candidate <= self._gap
        self._candidate = ns
        if dt > 0:
            if self._lockstep or not follows:
                most = self.last + self._gap
                raise ValueError(f'stamp jumped: expected at most {most} ns, found {ns} ns')
            return 0.0, dt > SAME_EPOCH
        # late ones come one after the other as well: time goes back only where it had stopped
        stopped = now.steady - self._accepted_at > self._patience
        if self._lockstep or not follows or not stopped:
            word = 'went back' if dt < 0 else 'repeated'
            raise ValueError(f'stamp {word}: expected later than {self.last} ns, found {ns} ns')
        return 0.0, True
