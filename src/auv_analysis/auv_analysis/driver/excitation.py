"""Excitation: a plan carried out, and what was heard meanwhile.

Wrenches go out at a steady rate, each is preceded by a look at the vehicle, and the last ones are
zero however it ends.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from threading import Event
from typing import Any, Protocol

import numpy as np

from auv_analysis.driver.odometry_log import OdometryBuffer, OdometryLog
from auv_analysis.driver.plan import REST, SETTLE, UNHEARD, ZERO, Plan, Trial
from auv_analysis.driver.response import (
    SCALES,
    GainFit,
    Noise,
    Wrench,
    fit_response,
    noise_at_rest,
)
from auv_analysis.output.progress import say
from auv_analysis.output.text import join
from auv_dynamics.files.errors import on_signals
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.vehicle import Vehicle

PERIOD = 0.02  # s between two wrenches
GOODBYE = 0.3  # s of zero at the end
RECENT = 5  # messages whose median is the speed
LOOK = 10  # wrenches between two looks at who else commands
TOO_FAST = 3.0  # times the speed of the plan, beyond what it moved at before
LEAST = 20  # messages of a trial
COUNTDOWN = 3  # s before the first wrench
MATCHES = 5.0  # s for the driver to be seen by a new publisher
LOOK_AGAIN = 0.1  # s between two looks at what has come before that
SIGNS = {1: 'right', 0: 'undecided', -1: 'reversed'}


class DriverClient(Protocol):
    """Connection to a driver, as far as an excitation needs one."""

    @property
    def buffer(self) -> OdometryBuffer:
        """Messages heard so far."""

    def send(self, tau: Wrench) -> int:
        """Publish a wrench; when it left, ns of this machine's clock."""

    def listen(self, seconds: float) -> None:
        """Take what comes in for so long."""

    def others(self) -> list[str]:
        """Who else publishes the wrench."""

    def advertise(self) -> bool:
        """Make it known that wrenches are going to be published; whether the driver hears them."""

    def retire(self) -> None:
        """Publish no more."""

    def now_ns(self) -> int:
        """Time of this machine's clock, ns."""


@dataclass
class Sent:
    """A trial as it was carried out.

    Attributes
    ----------
    trial : what was planned
    steps : time in ns and wrench of each message
    ended_ns : 0 where it was broken off

    """

    trial: Trial
    steps: list[tuple[int, Wrench]] = field(default_factory=list[Any])
    ended_ns: int = 0


@dataclass(frozen=True)
class Excitation:
    """Part of a plan that was sent, and why it ended early; empty: it did not."""

    plan: Plan
    sent: Sequence[Sent]
    aborted: str = ''

    def measured(self, log: OdometryLog) -> 'list[MeasuredTrial]':
        """Trials that were not broken off and of which enough was heard."""
        noise = _noise(self.sent, log)
        trials = (_measured(self.plan.vehicle, sent, log, noise) for sent in self.sent)
        return [trial for trial in trials if trial]


class AbortError(RuntimeError):
    """The wrenches must not go on; the text says why."""


class MotionGuard:
    """Looks at the vehicle between two wrenches.

    Parameters
    ----------
    client : of whom it hears
    speed : m/s and rad/s of the plan
    timeout : s of silence of the odometry that end it; a stamp that comes again is silence
    stopped : whether the user wants an end

    Raises
    ------
    AbortError : it moves too fast already

    """

    def __init__(
        self, client: DriverClient, speed: float, timeout: float, stopped: Callable[[], bool]
    ):
        self._client, self._timeout, self._stopped = client, timeout, stopped
        self._count = self._heard = 0  # ns: arrival of the newest stamp
        self._stamp: int | None = None
        before, most = self._speeds(), TOO_FAST * speed
        if not (before <= most).all():
            found = f'it moves by {before.max():.3g} m/s or rad/s already, over {most:.3g}'
            raise AbortError(found)
        self._before = before

    def _speeds(self) -> np.ndarray:
        """Linear and angular speed (2,), m/s and rad/s."""
        recent = self._client.buffer.recent(RECENT)[:, 7:]
        nu = np.median(recent, axis=0) if len(recent) else np.zeros(6)
        return np.linalg.norm(nu.reshape(2, 3), axis=1)

    def look(self, planned: float) -> None:
        """Raise AbortError or KeyboardInterrupt where the next wrench must not be sent.

        `planned` is the speed of the present trial, m/s and rad/s.
        """
        if self._stopped():
            raise KeyboardInterrupt
        newest = self._client.buffer.newest
        if newest is not None and newest[1] != self._stamp:
            self._heard, self._stamp = newest
        latest = self._client.now_ns() - self._timeout * NANOSECONDS
        if self._heard < latest:
            repeated = newest is not None and newest[0] >= latest
            new = ' of a new stamp' if repeated else ''
            raise AbortError(f'no odometry{new} for {self._timeout:g} s')
        speeds, most = self._speeds(), TOO_FAST * planned + self._before
        if not (speeds <= most).all():  # NaN is too fast as well
            i = int(np.argmax(speeds - most))
            raise AbortError(f'{speeds[i]:.3g} m/s or rad/s, more than {most[i]:.3g}')
        if self._count % LOOK == 0 and (others := self._client.others()):
            raise AbortError(f'{others[0]} publishes the wrench as well')
        self._count += 1


def actuate(client: DriverClient, plan: Plan, timeout: float) -> Excitation:
    """Announce and carry out a plan.

    Parameters
    ----------
    client : the connection, which publishes nothing yet
    plan : what is sent
    timeout : s of silence of the odometry that end it

    Raises
    ------
    KeyboardInterrupt : the user wanted an end; zero was sent

    """
    stop = Event()  # a signal only asks for an end: zero is sent before it is one
    with ExitStack() as stack:
        stack.enter_context(on_signals(stop.set))
        stack.callback(client.retire)
        for line in plan.lines():
            say(line)
        client.advertise()  # nothing is sent yet, but whoever else is about to command sees it
        for left in range(COUNTDOWN, 0, -1):
            say(f'begins in {left} s')
            _wait(client, 1.0, stop.is_set)
        if others := client.others():
            return Excitation(plan, (), f'{join(others)} publishes the wrench as well')
        until = time.monotonic() + MATCHES
        while not client.advertise():
            if time.monotonic() > until:
                why = f'the driver does not hear a publisher within {MATCHES:g} s'
                return Excitation(plan, (), why)
            _wait(client, LOOK_AGAIN, stop.is_set)
        return carry_out(client, plan, timeout, stop.is_set)


def _wait(client: DriverClient, seconds: float, stopped: Callable[[], bool]) -> None:
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        client.listen(min(LOOK_AGAIN, left))
        if stopped():
            raise KeyboardInterrupt


def carry_out(
    client: DriverClient, plan: Plan, timeout: float, stopped: Callable[[], bool]
) -> Excitation:
    """Send the wrenches of a plan; the last ones are zero, however it ends.

    Parameters
    ----------
    client : that sends
    plan : what
    timeout : s of silence of the odometry that end it
    stopped : whether the user wants an end

    Raises
    ------
    KeyboardInterrupt : the user wanted an end; zero was sent

    """
    done: list[Sent] = []
    try:
        guard = MotionGuard(client, plan.speed, timeout, stopped)
        for trial in plan.trials:
            say(f'{trial.dof} ...')
            done.append(Sent(trial))
            _send(client, guard, done[-1])
    except AbortError as error:
        return Excitation(plan, done, str(error))
    finally:
        for _ in range(round(GOODBYE / PERIOD)):
            client.send(ZERO)
            client.listen(PERIOD)
    return Excitation(plan, done)


def _send(client: DriverClient, guard: MotionGuard, sent: Sent) -> None:
    for tau, seconds in sent.trial.parts:
        for _ in _periods(client, seconds):
            sent.steps.append((client.send(tau), tau))
            guard.look(sent.trial.speed)
    if sent.trial.silent:
        for _ in _periods(client, UNHEARD):
            guard.look(sent.trial.speed)
    sent.ended_ns = client.now_ns()


def _periods(client: DriverClient, seconds: float) -> Iterator[None]:
    """Periods of listening: they end by the clock, and by their number if it is set back."""
    end = client.now_ns() + round(seconds * NANOSECONDS)
    for _ in range(round(seconds / PERIOD)):
        if (left := end - client.now_ns()) <= 0:
            return
        yield
        client.listen(min(PERIOD, left / NANOSECONDS))


@dataclass(frozen=True, eq=False)
class MeasuredTrial:
    """A trial: velocities against the time since it began, and the response of the model.

    Attributes
    ----------
    vehicle : the model
    trial : what was sent
    t, nu : (n,) s and (n, 6) m/s and rad/s, measured, by the times of arrival
    x : (13,) state at its beginning
    noise : of nu at rest
    held : begin, end in s and wrench of each piece
    applied_t, applied : (m,) s and (m, 6) of wrench_applied
    silent_from : s, when the last wrench was sent

    """

    vehicle: Vehicle
    trial: Trial
    t: np.ndarray
    nu: np.ndarray
    x: np.ndarray
    noise: Noise
    held: list[tuple[float, float, Wrench]]
    applied_t: np.ndarray
    applied: np.ndarray
    silent_from: float

    @cached_property
    def response(self) -> GainFit:
        """Response to the wrenches as they were sent."""
        return self.response_to(self.held)

    def response_to(
        self, held: Sequence[tuple[float, float, Wrench]], scales: np.ndarray = SCALES
    ) -> GainFit:
        """Response if these wrenches had acted, on a vehicle of one of these scales."""
        axis = self.trial.axis
        latest = self.trial.pulse / 2
        return fit_response(
            self.vehicle, self.x, held, self.t, self.nu, axis, self.noise, latest, scales
        )

    def document(self) -> Mapping[str, Any]:
        """Ready for JSON."""
        trial, found = self.trial, self.response
        return {
            'dof': trial.dof,
            'size': trial.size,
            'unit': trial.unit,
            'dead_band': trial.dead_band,
            'sign': SIGNS[found.sign],
            'gain': found.gain,
            'delay': found.delay,
            'delay_uncertainty': found.delay_error,
            'noise_at_rest': float(np.sqrt(self.noise.variance[trial.axis])),
            'peaks_measured': found.measured.tolist(),
            'peaks_predicted': found.predicted.tolist(),
        }


def _noise(sent: Sequence[Sent], log: OdometryLog) -> Noise:
    """Noise of the velocity before the first wrench that is not zero."""
    steps = [step for one in sent for step in one.steps]
    moved = next((ns for ns, tau in steps if tau != ZERO), 0)
    before = log.finite & (log.arrived_ns <= moved)
    before &= log.arrived_ns > moved - SETTLE * NANOSECONDS
    return noise_at_rest((log.arrived_ns[before] - moved) / NANOSECONDS, log.x[before, 7:])


def _measured(vehicle: Vehicle, sent: Sent, log: OdometryLog, noise: Noise) -> MeasuredTrial | None:
    """Record of a trial; None where it was broken off or too little came."""
    if not sent.ended_ns:
        return None
    began = next(ns for ns, tau in sent.steps if tau != ZERO) - round(REST * NANOSECONDS)

    def during(ns: np.ndarray) -> np.ndarray:
        return (ns >= began) & (ns <= sent.ended_ns)

    def seconds(ns: Any) -> Any:
        return (ns - began) / NANOSECONDS

    inside = during(log.arrived_ns) & log.finite
    if int(inside.sum()) < LEAST:
        return None
    t, first = np.unique(seconds(log.arrived_ns[inside]), return_index=True)
    x = log.x[inside][first]
    before = x[t <= REST] if (t <= REST).any() else x[:1]
    start = before[0].copy()
    start[7:] = np.median(before[:, 7:], axis=0)
    # pieces of time in which one wrench was held
    runs = [
        (max(next(run)[0], began), tau)
        for tau, run in groupby(sent.steps, key=lambda step: step[1])
    ]
    ends = [*(ns for ns, _ in runs[1:]), sent.ended_ns]
    held = [(seconds(ns), seconds(end), tau) for (ns, tau), end in zip(runs, ends, strict=True)]
    acted = during(log.applied_arrived_ns)
    return MeasuredTrial(
        vehicle,
        sent.trial,
        t,
        x[:, 7:],
        start,
        noise,
        held,
        seconds(log.applied_arrived_ns[acted]),
        log.applied[acted],
        seconds(sent.steps[-1][0]),
    )
