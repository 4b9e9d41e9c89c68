"""Between law and vehicle: limits, slew limits, and a ramp whenever one of them takes over."""

from auv_gvc_controller.control.plausibility import ZERO

FEWEST = 10  # answers over which a law takes over at least, however rare they are


class HandOver:
    """The last stage before a wrench is published.

    A law that takes over, at activation, after a watchdog or a reset, comes in over the ramp from
    the wrench that was published last; one that lets go is taken back over it. So neither is a
    jump for the vehicle.

    Parameters
    ----------
    limit : (6,) largest absolute wrench per axis, N and N m
    slew : (6,) largest change per second, N/s and N m/s; empty: none
    ramp : s from the last wrench to the law's, and from it to none; 0: at once

    """

    def __init__(self, limit: tuple[float, ...], slew: tuple[float, ...] = (), ramp: float = 0.0):
        self._limit, self._slew, self._ramp = limit, slew, ramp
        self.drop()

    def drop(self) -> tuple[float, ...]:
        """Zero wrench at once, as at deactivation."""
        self._tau: tuple[float, ...] = ZERO
        self._at = self._since = 0.0  # s: of the last wrench, and of the beginning of a release
        self._falling = False
        self.restart()
        return ZERO

    def restart(self) -> None:
        """Let the law come in anew, from the wrench that was published last."""
        self._from, self._share = self._tau, 0.0  # share of the law's wrench
        self._in_charge = False

    @property
    def idle(self) -> bool:
        """Whether the last wrench was zero because the law is not in charge."""
        return not self._in_charge and self._tau == ZERO

    def follow(self, tau: tuple[float, ...], now: float) -> tuple[float, ...]:
        """Wrench to publish while the law is in charge.

        Parameters
        ----------
        tau : (6,) wanted by the law, N and N m
        now : s, of a clock that never goes back

        """
        dt = now - self._at if self._in_charge else 0.0
        if not self._in_charge:
            self.restart()
        if self._ramp <= 0.0:
            self._share = 1.0
        elif self._in_charge:
            self._share = min(1.0, self._share + min(dt / self._ramp, 1.0 / FEWEST))
        left = 1.0 - self._share
        wanted = tuple(
            left * begun + self._share * min(max(value, -most), most)
            for begun, value, most in zip(self._from, tau, self._limit, strict=True)
        )
        self._falling, self._in_charge = False, True
        return self._publish(wanted, dt, now)

    def release(self, now: float) -> tuple[float, ...]:
        """Wrench to publish while the law is not in charge: on its way to zero."""
        if not self._falling:  # from now on, however long the law was silent
            self.restart()
            self._falling, self._since, self._at = True, now, now
        passed = (now - self._since) / self._ramp if self._ramp > 0.0 else 1.0
        left = max(0.0, 1.0 - passed)
        wanted = tuple(left * value + 0.0 for value in self._from)  # no negative zero
        return self._publish(wanted, now - self._at, now)

    def _publish(self, wanted: tuple[float, ...], dt: float, now: float) -> tuple[float, ...]:
        """Change the last wrench no faster than the slew limits."""
        if self._slew:
            wanted = tuple(
                min(max(value, last - most * dt), last + most * dt)
                for value, last, most in zip(wanted, self._tau, self._slew, strict=True)
            )
        self._tau, self._at = wanted, now
        return self._tau
