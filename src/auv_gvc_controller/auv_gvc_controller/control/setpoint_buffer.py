"""Which set-point belongs to an odometry: the very same stamp, or the newest one before it."""

from collections import OrderedDict
from typing import NamedTuple

from auv_gvc_controller.control.odometry_guard import ZERO, Limits
from auv_gvc_controller.control.reference_filter import clamped

UNLIMITED = Limits()
SAME, FILTER, NONE, DIFFERENCE = 'topic', 'filter', 'none', 'difference'
LEAST = 5_000_000  # ns that two set-points are taken to be apart at least
CAPACITY = 4096  # set-points kept; more than any horizon that is accepted


class Reference(NamedTuple):
    """A set-point: stamp in ns, nu_d and nu_d_dot as six floats each."""

    ns: int
    nu_d: tuple[float, ...]
    nu_d_dot: tuple[float, ...]


class SetpointBuffer:
    """Buffers set-points and their derivatives by stamp.

    Parameters
    ----------
    exact : take the set-point of the odometry's own stamp; else the newest at or before it
    acceleration : 'topic' waits for the derivative of the same stamp; 'difference' takes the
        backward difference of the set-points, zero at the first and over a jump; with 'none' and
        'filter' it is zero here
    limits : velocities and accelerations that are believed
    steepest : (6,) bounds of the difference, m/s2 and rad/s2; set-points are then taken to be
        `LEAST` apart at least, and the difference is zero once a set-point has been held for
        longer than it took to come; None: none of this

    Attributes
    ----------
    heard : when the newest set-point came, s of the steady clock

    """

    def __init__(
        self,
        exact: bool,
        acceleration: str,
        limits: Limits = UNLIMITED,
        steepest: tuple[float, ...] | None = None,
    ):
        self._exact, self._acceleration = exact, acceleration
        self.believe(limits, steepest)
        self._nu_d: OrderedDict[int, tuple[float, ...]] = OrderedDict()
        self._nu_d_dot: OrderedDict[int, tuple[float, ...]] = OrderedDict()
        self._used: Reference | None = None
        self._slope_until = 0  # ns
        self.heard = 0.0

    def believe(self, limits: Limits, steepest: tuple[float, ...] | None) -> None:
        """Set the limits of what comes from now on."""
        self._limits, self._steepest = limits, steepest

    def reset(self) -> None:
        """Forget which set-point was used last, as at activation; the buffers stay."""
        self._used = None

    def forget(self) -> None:
        """Forget everything, as when the stamps begin anew."""
        self._used = None
        self._nu_d.clear()
        self._nu_d_dot.clear()

    def setpoint(self, ns: int, nu_d: tuple[float, ...], steady: float = 0.0) -> None:
        """Keep a set-point that came at `steady` s.

        Raises
        ------
        ValueError : it is not believed, not newer than the one in use, or there already

        """
        self._limits.check_velocity(nu_d)
        self._keep(self._nu_d, ns, nu_d)
        self.heard = steady

    def derivative(self, ns: int, nu_d_dot: tuple[float, ...]) -> None:
        """Keep a derivative; ValueError when it is not believed or not newer than that in use."""
        self._limits.check_acceleration(nu_d_dot)
        self._keep(self._nu_d_dot, ns, nu_d_dot)

    def _keep(
        self, buffer: OrderedDict[int, tuple[float, ...]], ns: int, values: tuple[float, ...]
    ) -> None:
        if self._used is not None and ns <= self._used.ns:
            raise ValueError(f'stamp late: expected later than {self._used.ns} ns, found {ns} ns')
        if ns in buffer:
            raise ValueError(f'stamp repeated: expected each stamp once, found {ns} ns again')
        buffer[ns] = values
        if len(buffer) > CAPACITY:
            buffer.popitem(last=False)

    def find(self, ns: int) -> Reference | None:
        """Set-point for an odometry stamped `ns`, or None while there is none."""
        chosen = self._choose(ns)
        if chosen is None:
            return None
        if self._used is not None and chosen == self._used.ns:
            if self._steepest is not None and ns > self._slope_until:
                self._used = self._used._replace(nu_d_dot=ZERO)
            return self._used
        if self._acceleration == SAME:
            nu_d_dot = self._nu_d_dot[chosen]
        else:
            nu_d_dot = self._difference(chosen) if self._acceleration == DIFFERENCE else ZERO
        self._used = Reference(chosen, self._nu_d[chosen], nu_d_dot)
        for buffer in (self._nu_d, self._nu_d_dot):
            while buffer and next(iter(buffer)) <= chosen:
                buffer.popitem(last=False)
        return self._used

    def _complete(self, ns: int) -> bool:
        return ns in self._nu_d and (self._acceleration != SAME or ns in self._nu_d_dot)

    def _choose(self, ns: int) -> int | None:
        if self._exact:
            used = self._used is not None and self._used.ns == ns
            return ns if used or self._complete(ns) else None
        earlier = [stamp for stamp in self._nu_d if stamp <= ns and self._complete(stamp)]
        return max(earlier, default=self._used.ns if self._used else None)

    def _difference(self, chosen: int) -> tuple[float, ...]:
        before = [(stamp, self._nu_d[stamp]) for stamp in self._nu_d if stamp < chosen]
        if self._used is not None:
            before.append((self._used.ns, self._used.nu_d))
        if not before:
            return ZERO
        ns, last = max(before)
        apart = chosen - ns if self._steepest is None else max(chosen - ns, LEAST)
        self._slope_until = chosen + apart
        dt = apart / 1e9
        slope = tuple((new - old) / dt for new, old in zip(self._nu_d[chosen], last, strict=True))
        try:
            self._limits.check_acceleration(slope)
        except ValueError:
            return ZERO  # a jump has no derivative
        if self._steepest is None:
            return slope
        return tuple(clamped(*entry) for entry in zip(slope, self._steepest, strict=True))
