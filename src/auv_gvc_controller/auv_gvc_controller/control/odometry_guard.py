"""Which odometry may be used: stamps that go forward, are young and do not jump; true speeds."""

from auv_gvc_controller.control.plausibility import Limits
from auv_gvc_controller.control.stamp_age import Now, StampAge

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
    restarts : how often the stamps began anew, at an earlier time

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
        self.reset()

    def reset(self) -> None:
        """Forget everything, as at activation."""
        self.last: int | None = None
        self.origin = 0
        self.restarts = 0
        self._candidate: int | None = None
        self._accepted_at = 0.0

    def elapsed(self, ns: int, nu: tuple[float, ...], now: Now = UNTIMED) -> float:
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
            self._age.check(ns, now)
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
            return 0.0, False
        # late ones come one after the other as well: time goes back only where it had stopped
        stopped = now.steady - self._accepted_at > self._patience
        if self._lockstep or not follows or not stopped:
            word = 'went back' if dt < 0 else 'repeated'
            raise ValueError(f'stamp {word}: expected later than {self.last} ns, found {ns} ns')
        return 0.0, True
