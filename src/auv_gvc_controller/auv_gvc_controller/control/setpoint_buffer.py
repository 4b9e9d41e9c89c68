"""Buffer of set-points: the one that belongs to an odometry, and the reference filter."""

import math
from typing import NamedTuple

import numpy as np

from auv_gvc_controller.control.odometry_guard import ZERO, Limits

Six = tuple[float, ...]


class ReferenceFilter:
    """Second-order low-pass filter of the set-point r (Fossen 2021, section 12.1), per axis.

        nu_d_ddot + 2 zeta omega nu_d_dot + omega^2 nu_d = omega^2 r

    Implicit Euler steps: stable for every step of time, without overshoot where zeta >= 1, and
    nu_d advances by dt * nu_d_dot exactly, also where a limit holds.

    Parameters
    ----------
    omega : natural frequency, rad/s
    zeta : damping ratio; from 1 on nothing overshoots
    fastest, steepest : (6,) largest nu_d and nu_d_dot, m/s, rad/s, m/s2 and rad/s2

    """

    def __init__(self, omega: float, zeta: float, fastest: Six, steepest: Six):
        self._omega, self._zeta, self._fastest, self._steepest = omega, zeta, fastest, steepest
        self.start(ZERO)

    def start(self, nu: Six) -> None:
        """Begin at a velocity (6,), within the limits, without acceleration."""
        self._nu_d = tuple(
            clamped(value, most) for value, most in zip(nu, self._fastest, strict=True)
        )
        self._nu_d_dot: Six = ZERO

    def advance(self, dt: float, setpoint: Six) -> tuple[Six, Six]:
        """Follow a set-point.

        Parameters
        ----------
        dt : s since the last call, 0 or more
        setpoint : (6,) m/s and rad/s, body frame

        Returns
        -------
        nu_d, nu_d_dot : six floats each, within the limits

        """
        if dt > 0.0:
            gain = dt * self._omega**2
            damping = 1.0 + 2.0 * self._zeta * self._omega * dt + dt * gain
            slopes, values = [], []
            for r, v, a, fastest, steepest in zip(
                setpoint, self._nu_d, self._nu_d_dot, self._fastest, self._steepest, strict=True
            ):
                wanted = (a + gain * (clamped(r, fastest) - v)) / damping
                reached = clamped(v + dt * clamped(wanted, steepest), fastest)
                slopes.append(clamped((reached - v) / dt, steepest))
                values.append(reached)
            self._nu_d, self._nu_d_dot = tuple(values), tuple(slopes)
        return self._nu_d, self._nu_d_dot


def clamped(value: float, most: float) -> float:
    """The number nearest to `value` in [-most, most]."""
    return min(max(value, -most), most)


UNLIMITED = Limits()
SAME, FILTER, NONE, DIFFERENCE = 'topic', 'filter', 'none', 'difference'
LEAST = 5_000_000  # ns that two set-points are taken to be apart at least
CAPACITY = 4096  # set-points kept; more than any horizon that is accepted
AHEAD = 60_000_000_000  # ns, further than that no set-point lies ahead
NEVER = np.iinfo(np.int64).max


class Reference(NamedTuple):
    """A set-point: stamp in ns, nu_d and nu_d_dot as six floats each."""

    ns: int
    nu_d: Six
    nu_d_dot: Six


class SetpointBuffer:
    """Buffers set-points and their derivatives by stamp.

    Parameters
    ----------
    exact : take the set-point of the odometry's own stamp; else the newest at or before it
    acceleration : 'topic' waits for the derivative of the same stamp; 'difference' takes the
        backward difference of the set-points, zero at the first and over a jump; with 'none' and
        'filter' it is zero here
    limits : velocities and accelerations that are believed
    steepest : real time: (6,) bounds of the difference, m/s2 and rad/s2; set-points are then taken
        to be `LEAST` apart at least, the difference is zero once a set-point has been held for
        longer than it took to come, and one stamped before those that wait takes the place of what
        lies ahead: it is of another publisher, or of a new plan; None: none of this

    Attributes
    ----------
    heard : when the newest set-point came, s of the steady clock; before the first: minus infinity

    """

    def __init__(
        self,
        exact: bool,
        acceleration: str,
        limits: Limits = UNLIMITED,
        steepest: Six | None = None,
    ):
        self.exact, self._acceleration = exact, acceleration
        self.believe(limits, steepest)
        self._nu_d: dict[int, Six] = {}
        self._nu_d_dot: dict[int, Six] = {}
        self._used: Reference | None = None
        self._slope_until = 0  # ns
        self.heard, self._left = -math.inf, False

    def believe(self, limits: Limits, steepest: Six | None) -> None:
        """Set the limits of what comes from now on."""
        self._limits, self._steepest = limits, steepest

    def reset(self) -> None:
        """Forget which set-point was used last, as at activation; the buffers stay."""
        self._used = None

    def forget(self) -> None:
        """Forget everything, as when the stamps begin anew."""
        self.reset()
        self._nu_d.clear()
        self._nu_d_dot.clear()

    def leave(self) -> None:
        """Note that whoever sent them is silent: the next one may be of another."""
        if not self._left and self.heard > -math.inf:
            self._left = True
            self._nu_d_dot.clear()  # now: those of the other may come before his nu_d

    def setpoint(self, ns: int, nu_d: Six, steady: float = 0.0) -> None:
        """Keep a set-point that came at `steady` s.

        Raises
        ------
        ValueError : it is not believed, not newer than the one in use, or there already

        """
        self._limits.check_velocity(nu_d)
        if self._left:
            self._nu_d.clear()
            self._left = False
        self._keep(self._nu_d, ns, nu_d)
        self.heard = steady

    def derivative(self, ns: int, nu_d_dot: Six) -> None:
        """Keep a derivative; ValueError when it is not believed or not newer than that in use."""
        self._limits.check_acceleration(nu_d_dot)
        self._keep(self._nu_d_dot, ns, nu_d_dot)

    def _keep(self, buffer: dict[int, Six], ns: int, values: Six) -> None:
        of_now = self._used is None or self._used.ns - ns <= AHEAD
        if self._steepest is not None and of_now and ns < next(reversed(buffer), ns):
            for ahead in (self._nu_d, self._nu_d_dot):
                for stamp in [stamp for stamp in ahead if stamp >= ns]:
                    del ahead[stamp]
        if self._used is not None and ns <= self._used.ns:
            raise ValueError(f'stamp late: expected later than {self._used.ns} ns, found {ns} ns')
        if ns in buffer:
            raise ValueError(f'stamp repeated: expected each stamp once, found {ns} ns again')
        buffer[ns] = values
        if len(buffer) > CAPACITY:
            del buffer[next(iter(buffer))]

    def find(self, ns: int) -> Reference | None:
        """Set-point for an odometry stamped `ns`, or None while there is none."""
        chosen = self._choose(ns)
        if chosen is None:
            return None
        if self._used is not None and chosen == self._used.ns:
            if self._acceleration != SAME and self._steepest and ns > self._slope_until:
                self._used = self._used._replace(nu_d_dot=ZERO)
            return self._used
        if self._acceleration == SAME:
            nu_d_dot = self._nu_d_dot[chosen]
        else:
            nu_d_dot = self._difference(chosen) if self._acceleration == DIFFERENCE else ZERO
        self._used = Reference(chosen, self._nu_d[chosen], nu_d_dot)
        for buffer in (self._nu_d, self._nu_d_dot):
            for stamp in [stamp for stamp in buffer if stamp <= chosen]:
                del buffer[stamp]
        return self._used

    def _complete(self, ns: int) -> bool:
        return ns in self._nu_d and (self._acceleration != SAME or ns in self._nu_d_dot)

    def _choose(self, ns: int) -> int | None:
        if self.exact:
            used = self._used is not None and self._used.ns == ns
            return ns if used or self._complete(ns) else None
        earlier = [stamp for stamp in self._nu_d if stamp <= ns and self._complete(stamp)]
        return max(earlier, default=self._used.ns if self._used else None)

    def _difference(self, chosen: int) -> Six:
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


def followed(ns: np.ndarray) -> np.ndarray:
    """Numbers of the set-points that a buffer in real time keeps, of stamps (n,) as they came, ns.

    As `SetpointBuffer` says one by one: a repeated stamp is refused, and one that is stamped before
    those that wait takes the place of what lies ahead.
    """
    index = np.flatnonzero(np.diff(ns, prepend=-1))
    late = np.maximum.accumulate(ns) - ns > AHEAD  # refused: of no time that lies ahead
    least = np.minimum.accumulate(np.where(late, NEVER, ns)[index][::-1])[::-1]
    return index[ns[index] < np.append(least[1:], NEVER)]
