"""A sampled law with zero-order hold, as the nodes and `simulate(hold='zoh')` run it."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import named_line
from auv_dynamics.kernel.compile import (
    JITTED,
    compiled,
    helper,
    load,
    specialised,
)
from auv_dynamics.kernel.lanes import anywhere, select
from auv_dynamics.kernel.six import Numbers, Vector
from auv_dynamics.vehicle.thrusters import (
    AttainableWrench,
    demanded,
    make_reach,
    reachable,
)
from auv_gvc_controller.laws.law import SHIPPED
from auv_gvc_controller.laws.model import ControlModel

ROUNDING = 1e-9


def _method(law: Any, name: str) -> Any:
    """What numba compiles of a law: a user's may make arrays, and gives tuples to the kernel."""
    given = getattr(law, name)
    if law in SHIPPED.values():
        return given
    if name == 'state_rate' and law.STATES == 0:
        return lambda *_: (0.0,)  # that nobody reads: numba takes no entry of an empty tuple
    jit = load()
    method, six, states = jit.allocating(given), jit.in_numbers(6), jit.in_numbers(law.STATES)

    def both(*arguments: Any) -> tuple[Numbers, Numbers]:
        tau, f = method(*arguments)
        return six(tau), six(f)

    def rate(*arguments: Any) -> Numbers:
        return states(method(*arguments))

    inner = jit.allocating(both if name == 'wrench' else rate)
    return lambda *arguments: inner(*arguments)  # noqa: PLW0108  numba looks at its code


@specialised('gains', _method)
def wrench(
    t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
    gains: Any, model: ControlModel,
) -> tuple[Numbers, Numbers]:  # fmt: skip
    """(tau, f) of the law to which `gains` belongs; ArithmeticError if it does not give them."""
    with user_law(gains):
        tau, f = type(gains).wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
        return _numbers('tau', tau, 6), _numbers('f', f, 6)


@specialised('gains', _method)
def state_rate(
    t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
    gains: Any, model: ControlModel,
) -> Vector:  # fmt: skip
    """Rate of the state of the law to which `gains` belongs; ArithmeticError as of `wrench`."""
    law = type(gains)
    with user_law(gains):
        rate = law.state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
        return _numbers('state_rate', rate, law.STATES)


def _numbers(name: str, values: Any, count: int) -> Numbers:
    found = tuple(map(float, values))
    if len(found) != count:
        raise ValueError(f'expected {count} numbers as {name}, found {len(found)}')
    return found


@contextmanager
def user_law(gains: Any) -> Iterator[None]:
    """Turn what a user's law raises while it runs into an ArithmeticError that names it."""
    try:
        yield
    except Exception as error:
        if type(error) is ArithmeticError or type(gains) in SHIPPED.values():
            raise
        said = named_line(error)
        raise ArithmeticError(f'the law {type(gains).__name__} failed: {said}') from error


class AntiWindup(NamedTuple):
    """Anti-windup of a law's integrals.

    Attributes
    ----------
    integrals : how many of the law's states, the first ones, are integrals: blocks of six, one
        per axis; 0: nothing is stopped
    reach : attainable wrench set

    """

    integrals: int
    reach: AttainableWrench


def anti_windup(gains: Any, reach: AttainableWrench | None) -> AntiWindup:
    """Anti-windup of a law whose actuators are known; None: off.

    A law says how many of its states are integrals in `INTEGRALS`; without it all are, where
    their number is a multiple of six.
    """
    if reach is None or not reach.bounded:
        return AntiWindup(0, make_reach(None, None))
    law = type(gains)
    integrals = getattr(law, 'INTEGRALS', 0 if law.STATES % 6 else law.STATES)
    return AntiWindup(integrals, reach)


@helper
def fill_sample(
    t: float,
    dt: float,
    nu: Vector,
    attitude: Vector,
    nu_d: Vector,
    nu_d_dot: Vector,
    state: np.ndarray,
    rate: np.ndarray,
    gains: Any,
    model: ControlModel,
    guard: AntiWindup,
) -> tuple[Numbers, Numbers]:
    """Take one sample: state += dt * rate of the last sample, in place, then (tau, f).

    `rate` receives the rate at this sample, as anti-windup lets it; dt = 0 at the first one.
    """
    for i in range(state.shape[0]):
        state[i] += dt * rate[i]
    tau, f = wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
    change = state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
    for i in range(state.shape[0]):
        rate[i] = change[i]
    if guard.integrals > 0:
        reach = guard.reach
        wanted, had = demanded(reach, tau), reachable(reach, tau)
        for j in range(guard.integrals):
            stopped = cut(wanted, had, j % 6)
            if anywhere(stopped):
                kept = 1.0 * state[j]  # a number of its own, also where state[j] is a view
                state[j] = kept + rate[j]
                ahead, _ = wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
                state[j] = kept
                pushed = demanded(reach, ahead)[j % 6] - wanted[j % 6]
                outward = pushed * (wanted[j % 6] - had[j % 6]) > 0.0
                rate[j] = select(stopped, select(outward, 0.0, rate[j]), rate[j])
    return tau, f


@helper
def cut(wanted: Vector, had: Vector, i: int) -> Any:
    """Whether the actuators keep axis i from what is wanted, by more than rounding.

    Conditional integration (Astrom & Hagglund 2006, section 3.5; Visioli 2006, chapter 3): an
    integral of such an axis stops while it would push the wrench further out.
    """
    total = (
        abs(wanted[0])
        + abs(wanted[1])
        + abs(wanted[2])
        + abs(wanted[3])
        + abs(wanted[4])
        + abs(wanted[5])
    )
    return abs(wanted[i] - had[i]) > ROUNDING * total


compiled_sample = compiled(fill_sample)


def is_compiled(gains: Any) -> bool:
    """Whether the kernel runs compiled for this law: a user's own law runs as plain Python."""
    return JITTED and type(gains) in SHIPPED.values()


class SampledLaw:
    """A law with its state, one sample at a time.

    Parameters
    ----------
    gains : named tuple of the law's gains, which also names the law
    model : what the law knows of the vehicle
    reach : what is known of the actuators, for anti-windup; None: no bounds

    """

    def __init__(self, gains: Any, model: ControlModel, reach: AttainableWrench | None = None):
        self._gains, self._model = gains, model
        self._guard = anti_windup(gains, reach)
        self._compiled = is_compiled(gains)
        self._sample = compiled_sample if self._compiled else fill_sample
        self.reset()
        if self._compiled:
            # compile or load the kernel now: the first sample must not wait for it
            zero = (0.0,) * 6
            self.sample(0.0, 0.0, zero, (1.0, 0.0, 0.0, 0.0), zero, zero)
            self.reset()

    def reset(self) -> None:
        """Forget the integrals."""
        self._state = np.zeros(type(self._gains).STATES)
        self._rate = np.zeros_like(self._state)

    def forget_rate(self) -> None:
        """Integrate nothing over the time since the last sample: the law was not in charge."""
        self._rate[:] = 0.0

    def sample(
        self,
        t: float,
        dt: float,
        nu: tuple[float, ...],
        attitude: tuple[float, ...],
        nu_d: tuple[float, ...],
        nu_d_dot: tuple[float, ...],
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """One sample.

        Parameters
        ----------
        t : s since the first odometry after activation
        dt : s since the last sample, 0 at the first
        nu, nu_d, nu_d_dot : six floats, m/s and rad/s (m/s2 and rad/s2), body frame
        attitude : unit quaternion w, x, y, z, body to NED

        Returns
        -------
        tau, f : six floats each, N and N m, body frame

        A sample that is not finite leaves the state as it was and raises ArithmeticError.

        """
        # whole numbers would be another kernel, compiled on the spot
        nu, attitude, nu_d, nu_d_dot = (
            tuple(map(float, values)) for values in (nu, attitude, nu_d, nu_d_dot)
        )
        state, rate = self._state.copy(), self._rate.copy()
        given = (t, dt, nu, attitude, nu_d, nu_d_dot, state, rate)
        known = (self._gains, self._model, self._guard)
        if self._compiled:  # nothing of Python's to catch, and it is called at every step
            tau, f = self._sample(*given, *known)
        else:
            with np.errstate(all='ignore'):
                tau, f = self._sample(*given, *known)
        if not all(map(math.isfinite, (*tau, *f, *state.tolist(), *rate.tolist()))):
            raise ArithmeticError(f'the law gave a wrench that is not finite: {tau}')
        self._state, self._rate = state, rate
        return tau, f
