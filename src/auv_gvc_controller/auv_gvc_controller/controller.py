"""The velocity controller without ROS: odometry and set-points in, wrench out."""

from dataclasses import dataclass

from auv_gvc_controller.odometry_guard import OdometryGuard
from auv_gvc_controller.pairing import Pairing
from auv_gvc_controller.sampled import SampledLaw

ZERO = (0.0,) * 6


@dataclass(frozen=True)
class Answer:
    """What the controller says to an odometry: wrench and estimate, and why they are zero."""

    ns: int
    tau: tuple
    f: tuple
    trouble: str = ''


class VelocityController:
    """A sampled law behind its guards.

    Parameters
    ----------
    law : with its gains, its model and its state
    pairing : which set-point belongs to an odometry
    guard : which odometry may be used
    lockstep : wait for the set-point; else answer every odometry, with zero if need be
    setpoint_timeout_ns : real time: age from which a set-point is not followed any more
    wrench_limit : (6,) largest absolute wrench per axis, N and N m; empty: no limit

    """

    def __init__(
        self,
        law: SampledLaw,
        pairing: Pairing,
        guard: OdometryGuard,
        *,
        lockstep: bool,
        exact: bool,
        setpoint_timeout_ns: int,
        wrench_limit: tuple,
    ):
        self._law, self._pairing, self._guard = law, pairing, guard
        self._lockstep, self._exact = lockstep, exact
        self._timeout, self._limit = setpoint_timeout_ns, wrench_limit
        self._waiting: tuple[int, tuple, float] | None = None
        self._origin: int | None = None
        self._bridge = False  # the law was silent: its old rate must not be integrated

    def reset(self) -> None:
        """Forget the integrals."""
        self._law.reset()

    def odometry(self, ns: int, x: tuple) -> Answer | None:
        """Take an odometry: state x = position, quaternion, nu (13 floats).

        Returns
        -------
        answer : or None while its set-point is missing

        Raises
        ------
        ValueError : the odometry must not be used

        """
        dt = self._guard.elapsed(ns, x[7:])
        if self._origin is None:
            self._origin = ns
        if self._waiting is not None:
            dt += self._waiting[2]  # the one before was never answered: its time counts as well
        self._waiting = (ns, x, dt)
        return self.answer()

    def answer(self) -> Answer | None:
        """Answer the odometry that waits, once its set-point is here."""
        if self._waiting is None:
            return None
        ns, x, dt = self._waiting
        reference = self._pairing.find(ns)
        if reference is None:
            return None if self._exact else self._zero(ns, 'no set-point yet')
        if not self._lockstep and ns - reference.ns > self._timeout:
            return self._zero(ns, f'no set-point for {(ns - reference.ns) / 1e9:.3g} s')
        self._waiting = None
        if self._bridge:
            self._law.forget_rate()
            self._bridge = False
        try:
            tau, f = self._law.sample(
                (ns - (self._origin or 0)) / 1e9,
                dt,
                x[7:],
                x[3:7],
                reference.nu_d,
                reference.nu_d_dot,
            )
        except ArithmeticError as error:
            return self._zero(ns, str(error))
        return Answer(ns, self._limited(tau), f)

    @property
    def unanswered(self) -> int | None:
        """Stamp of the odometry that still waits for its answer."""
        return self._waiting[0] if self._waiting else None

    def silence(self, why: str = '') -> Answer:
        """Zero wrench because the law lets go, stamped with the last odometry."""
        return self._zero(self._guard.last or 0, why)

    def _zero(self, ns: int, trouble: str) -> Answer:
        self._waiting = None
        self._bridge = True
        return Answer(ns, ZERO, ZERO, f'{trouble}: zero wrench' if trouble else '')

    def _limited(self, tau: tuple) -> tuple:
        if not self._limit:
            return tau
        return tuple(min(max(a, -most), most) for a, most in zip(tau, self._limit, strict=True))
