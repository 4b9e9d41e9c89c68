"""The velocity controller without ROS: odometry and set-points in, wrench out."""

from dataclasses import dataclass

from auv_gvc_controller.control.odometry_guard import UNTIMED, ZERO, Now, OdometryGuard
from auv_gvc_controller.control.sampled_law import SampledLaw
from auv_gvc_controller.control.setpoint_buffer import ReferenceFilter, SetpointBuffer

FEWEST = 10  # answers over which a law engages at least, however rare they are


class OutputStage:
    """The last stage before a wrench is published.

    A law that engages, at activation, after a watchdog or a reset, comes in over the ramp from
    the wrench that was published last; one that disengages is taken back over it. So neither is a
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


@dataclass(frozen=True)
class Answer:
    """The controller's answer to an odometry: wrench and estimate, and why it disengages."""

    ns: int
    tau: tuple[float, ...]
    f: tuple[float, ...]
    trouble: str = ''


@dataclass(frozen=True)
class Timeouts:
    """Real time: after what the law disengages, s.

    Attributes
    ----------
    odometry : silence on `odom`
    setpoint : silence on `cmd_vel`, however far ahead its stamps are, or age of the set-point in
        use by its stamp

    """

    odometry: float
    setpoint: float


class VelocityController:
    """A sampled law behind its guards.

    Parameters
    ----------
    law : with its gains, its model and its state
    setpoints : which set-point belongs to an odometry
    guard : which odometry may be used
    output : what the wrench passes before it is published
    reference_filter : smooths the set-points; None: they are followed as they come
    timeouts : of the watchdogs; None in lock-step: it waits for the set-point, whatever the time

    Attributes
    ----------
    watchdog : why the law is not in charge, empty while it is
    trips : how often it had to disengage

    """

    def __init__(
        self,
        law: SampledLaw,
        setpoints: SetpointBuffer,
        guard: OdometryGuard,
        output: OutputStage,
        *,
        timeouts: Timeouts | None,
        reference_filter: ReferenceFilter | None = None,
    ):
        self._filter = reference_filter
        self._law, self._setpoints, self._guard, self._output = law, setpoints, guard, output
        self._timeouts = timeouts
        self._waiting: tuple[int, tuple[float, ...], float] | None = None
        self._heard: float | None = None  # steady s of the last odometry; None: none is missed
        self._unanswered_since = 0.0
        self._bridge = False  # the law was silent: its old rate must not be integrated
        self._in_charge = False
        self.watchdog, self.trips = '', 0

    def reset(self) -> None:
        """Forget the integrals; the law comes in anew over the ramp."""
        self._law.reset()
        if self._in_charge:
            self._output.restart()

    def unheard(self) -> None:
        """Begin anew with the next odometry: nobody was told the answer to this one."""
        self._law.reset()
        self._output.drop()
        self._in_charge = False

    def odometry(self, ns: int, x: tuple[float, ...], now: Now = UNTIMED) -> Answer | None:
        """Take an odometry.

        Parameters
        ----------
        ns : its stamp
        x : state: position, quaternion, nu (13 floats)
        now : when it arrived; without meaning in lock-step

        Returns
        -------
        answer : or None while its set-point is missing

        Raises
        ------
        ValueError : the odometry must not be used

        """
        restarts = self._guard.restarts
        dt = self._guard.accept(ns, x[7:], now)
        if self._guard.restarts > restarts:
            self._waiting = None
            self._setpoints.forget()
        self._heard = now.steady
        if self._waiting is None:
            self._unanswered_since = now.steady
        else:
            dt += self._waiting[2]  # the one before was never answered: its time counts as well
        self._waiting = (ns, x, dt)
        return self.answer(now)

    def answer(self, now: Now = UNTIMED) -> Answer | None:
        """Answer the odometry that waits, once its set-point is here."""
        if self._waiting is None:
            return None
        ns, x, dt = self._waiting
        silent = self._silent(now)
        reference = self._setpoints.find(ns)
        if reference is None:
            return None if self._setpoints.exact else self._trip(ns, 'no set-point yet', now)
        age = (ns - reference.ns) / 1e9
        if self._timeouts is not None and age > self._timeouts.setpoint:
            silent = f'no set-point for {age:.3g} s'
        if silent:
            return self._trip(ns, silent, now)
        self._waiting = None
        if self._bridge:
            self._law.forget_rate()
            self._bridge = False
        t = (ns - self._guard.origin) / 1e9
        nu_d, nu_d_dot = reference.nu_d, reference.nu_d_dot
        if self._filter is not None:
            if not self._in_charge:
                self._filter.start(x[7:])
            nu_d, nu_d_dot = self._filter.advance(dt if self._in_charge else 0.0, nu_d)
        try:
            tau, f = self._law.sample(t, dt, x[7:], x[3:7], nu_d, nu_d_dot)
        except ArithmeticError as error:
            return self._disengage(ns, str(error), now)
        self.watchdog, self._in_charge = '', True
        return Answer(ns, self._output.follow(tau, self._clock(ns, now)), f)

    def watch(self, now: Now) -> Answer | None:
        """Wrench due without a new odometry, in real time; to be called periodically."""
        late = self._timeouts
        if late is None or self._heard is None:
            return None
        waits = self._waiting is not None and now.steady - self._unanswered_since > late.setpoint
        if self._waiting is not None and (waits or self.watchdog):
            return self._trip(self._waiting[0], 'no set-point of its stamp', now)
        silence = now.steady - self._heard
        if silence <= late.odometry:
            return self._watch_between(now)
        if self._in_charge and silence > 2 * late.odometry:  # it was stopped itself, and not heard
            self._output.drop()  # a vehicle has let go since: the old wrench would be a new one
        answer = self._trip(self._guard.last or 0, f'no odometry for {late.odometry:g} s', now)
        if self._output.idle:
            self._heard = None  # said
        return answer

    def _watch_between(self, now: Now) -> Answer | None:
        """Disengage between two odometries, however rare they are, until the wrench is zero."""
        if self._output.idle:
            return None
        ns, silent = self._guard.last or 0, '' if self._setpoints.exact else self._silent(now)
        if silent and self._in_charge:
            return self._trip(ns, silent, now)
        return self._disengage(ns, self.watchdog, now) if self.watchdog else None

    @property
    def newest(self) -> int | None:
        """Stamp of the last odometry, ns; None before the first."""
        return self._guard.last

    @property
    def unanswered(self) -> int | None:
        """Stamp of the odometry that still waits for its answer."""
        return self._waiting[0] if self._waiting else None

    def silence(self) -> Answer:
        """Zero wrench at once, stamped with the last odometry: the controller leaves."""
        self._waiting, self._heard, self._bridge = None, None, True
        return Answer(self._guard.last or 0, self._output.drop(), ZERO)

    def _silent(self, now: Now) -> str:
        """That set-points have not been heard for too long, however far ahead they were."""
        late = self._timeouts
        if late is None or now.steady - self._setpoints.heard <= late.setpoint:
            return ''
        self._setpoints.leave()
        return f'no set-point heard for {late.setpoint:g} s'

    def _trip(self, ns: int, trouble: str, now: Now) -> Answer:
        """Disengage because of a watchdog: in real time the integrals do not outlive it."""
        if self._timeouts is not None:
            self._law.reset()
        return self._disengage(ns, trouble, now)

    def _disengage(self, ns: int, trouble: str, now: Now) -> Answer:
        self._waiting = None
        self._bridge = True
        self.trips += self._in_charge
        self.watchdog, self._in_charge = trouble, False
        tau = self._output.release(self._clock(ns, now))
        how = 'zero wrench' if self._output.idle else 'the wrench goes to zero'
        return Answer(ns, tau, ZERO, f'{trouble}: {how}')

    def _clock(self, ns: int, now: Now) -> float:
        """Seconds that do not go back: of the stamps in lock-step, else of the steady clock."""
        return ns / 1e9 if self._timeouts is None else now.steady
