"""Between law and vehicle: limits, slew limits, and a ramp whenever one of them takes over."""

from auv_gvc_controller.limits import ZERO

FEWEST = 10  # answers over which a law takes over at least, however rare they are


class HandOver:
    """The last stage before a wrench is published.

    A law that takes over, at activation or after a watchdog, comes in over the ramp; one that lets
    go is taken back over it. So neither is a jump for the vehicle.

    Parameters
    ----------
    limit : (6,) largest absolute wrench per axis, N and N m
    slew : (6,) largest change per second, N/s and N m/s; empty: none
    ramp : s between no wrench and all of the law's; 0: at once

    """

    def __init__(self, limit: tuple[float, ...], slew: tuple[float, ...] = (), ramp: float = 0.0):
        self._limit, self._slew, self._ramp = limit, slew, ramp
        self.drop()

    def drop(self) -> tuple[float, ...]:
        """Zero wrench at once, as at deactivation."""
        self._share = 0.0  # of the law's wrench
        self._tau: tuple[float, ...] = ZERO
        self._at: float | None = None
        self._falling = False
        return ZERO

    @property
    def idle(self) -> bool:
        """Whether the last wrench was zero because the law is not in charge."""
        return self._share == 0.0

    def follow(self, tau: tuple[float, ...], now: float) -> tuple[float, ...]:
        """Wrench to publish while the law is in charge.

        Parameters
        ----------
        tau : (6,) wanted by the law, N and N m
        now : s, of a clock that never goes back

        """
        dt = now - self._at if self._at is not None else 0.0
        if self._share < 1.0:
            came = dt / self._ramp if self._ramp > 0.0 and self._at is not None else 1.0
            most = 1.0 / FEWEST if self._ramp > 0.0 else 1.0
            self._share = min(1.0, self._share + min(came, most))
        wanted = [
            self._share * min(max(value, -most), most)
            for value, most in zip(tau, self._limit, strict=True)
        ]
        if self._slew:
            change = (most * dt for most in self._slew)
            wanted = [
                min(max(value, last - most), last + most)
                for value, last, most in zip(wanted, self._tau, change, strict=True)
            ]
        self._tau, self._at, self._falling = tuple(wanted), now, False
        return self._tau

    def release(self, now: float) -> tuple[float, ...]:
        """Wrench to publish while the law is not in charge: on its way to zero."""
        if self._share == 0.0 or self._ramp <= 0.0:
            return self.drop()
        if self._at is None or not self._falling:  # from now on, however long the law was silent
            self._at, self._falling = now, True
        left = max(0.0, self._share - (now - self._at) / self._ramp)
        if left == 0.0:
            return self.drop()
        self._tau = tuple(value * (left / self._share) for value in self._tau)
        self._share, self._at = left, now
        return self._tau
