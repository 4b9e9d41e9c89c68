"""Which odometry may be used: stamps that go forward, without jumps, at speeds that exist."""

import math


class OdometryGuard:
    """Judges the stamps and speeds of consecutive odometry.

    Parameters
    ----------
    gap_ns : longest time between two stamps that a law may integrate over
    speed, rate : largest speed in m/s and turn rate in rad/s that is believed
    lockstep : a jump is then always an error; in real time the data stream may resume after it

    """

    def __init__(self, gap_ns: int, speed: float, rate: float, lockstep: bool):
        self._gap, self._speed, self._rate = gap_ns, speed, rate
        self._lockstep = lockstep
        self.reset()

    def reset(self) -> None:
        """Forget everything, as at activation."""
        self.last: int | None = None
        self._candidate: int | None = None

    def elapsed(self, ns: int, nu: tuple) -> float:
        """Seconds to integrate over since the last accepted odometry, 0 at the first.

        Raises
        ------
        ValueError : this odometry must not be used; the text says what was expected and found

        """
        for name, values, most, unit in (
            ('linear', nu[:3], self._speed, 'm/s'),
            ('angular', nu[3:], self._rate, 'rad/s'),
        ):
            size = math.hypot(*values)
            if size > most:
                raise ValueError(f'twist.{name}: expected at most {most:g} {unit}, found {size:g}')
        if self.last is None:
            self.last = ns
            return 0.0
        dt = ns - self.last
        if dt <= 0:
            raise ValueError(f'stamp: expected later than {self.last} ns, found {ns} ns')
        if dt > self._gap:
            return self._after_jump(ns, self.last)
        self.last, self._candidate = ns, None
        return dt / 1e9

    def _after_jump(self, ns: int, last: int) -> float:
        # one stray stamp must not lock out those that follow: the second in a row is believed
        candidate = self._candidate
        self._candidate = ns
        if self._lockstep or candidate is None or not 0 < ns - candidate <= self._gap:
            most = last + self._gap
            raise ValueError(f'stamp: expected at most {most} ns, found {ns} ns')
        self.last, self._candidate = ns, None
        return 0.0
