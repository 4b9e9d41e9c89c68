"""Which odometry may be used: stamps that go forward, without jumps, at speeds that exist."""

from auv_gvc_controller.limits import Limits


class OdometryGuard:
    """Judges the stamps and speeds of consecutive odometry.

    Parameters
    ----------
    gap_ns : longest time between two stamps that a law may integrate over
    limits : speeds that are believed
    lockstep : a jump is then always an error; in real time the data stream may resume after it

    """

    def __init__(self, gap_ns: int, limits: Limits, lockstep: bool):
        self._gap, self._limits, self._lockstep = gap_ns, limits, lockstep
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
        self._limits.check_velocity(nu)
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
