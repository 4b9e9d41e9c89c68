"""Sending the wrenches of a plan: at a steady rate, under watch, and zero whatever happens."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from auv_analysis.driver_check.plan import HELD, PULSE, REST, UNHEARD, Plan, Trial
from auv_analysis.driver_check.recording import Tape
from auv_dynamics.ros.interface import NANOSECONDS

PERIOD = 0.02  # s between two wrenches
GOODBYE = 0.3  # s of zero at the end
RECENT = 5  # messages whose median is the speed
LOOK = 10  # wrenches between two looks at who else commands
TOO_FAST = 3.0  # times the speed of the plan, beyond what it moved at before
ZERO = (0.0,) * 6


class Voice(Protocol):
    """What the procedure needs of a participant of the graph."""

    @property
    def tape(self) -> Tape:
        """What has been heard so far."""

    def send(self, tau: tuple[float, ...]) -> int:
        """Publish a wrench; when it left, ns of this machine's clock."""

    def listen(self, seconds: float) -> None:
        """Take what comes in for so long."""

    def others(self) -> list[str]:
        """Who else publishes the wrench."""

    def now_ns(self) -> int:
        """What the clock of this machine shows, ns."""


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
    steps: list[tuple[int, tuple[float, ...]]] = field(default_factory=list[Any])
    ended_ns: int = 0


@dataclass(frozen=True)
class Actuation:
    """What was sent, and why it ended early; empty: it did not."""

    sent: Sequence[Sent]
    aborted: str = ''


class AbortError(RuntimeError):
    """The wrenches must not go on; the text says why."""


class StoppedError(RuntimeError):
    """The user wants an end."""


class Watch:
    """Looks at the vehicle between two wrenches.

    Parameters
    ----------
    voice : of whom it hears
    speed : m/s and rad/s of the plan
    timeout : s of silence of the odometry that end it
    stopped : whether the user wants an end

    Raises
    ------
    AbortError : it moves too fast already

    """

    def __init__(self, voice: Voice, speed: float, timeout: float, stopped: Callable[[], bool]):
        self._voice, self._timeout, self._stopped = voice, timeout, stopped
        self._count = 0
        before, most = max(self._speeds()), TOO_FAST * speed
        if not before <= most:
            raise AbortError(f'it moves by {before:.3g} m/s or rad/s already, over {most:.3g}')
        self._most = most + before

    def _speeds(self) -> tuple[float, float]:
        recent = self._voice.tape.recent(RECENT)[:, 7:]
        nu = np.median(recent, axis=0) if len(recent) else np.zeros(6)
        return float(np.linalg.norm(nu[:3])), float(np.linalg.norm(nu[3:]))

    def look(self) -> None:
        """Raise AbortError or StoppedError where the next wrench must not be sent."""
        if self._stopped():
            raise StoppedError
        newest = self._voice.tape.newest
        if newest is None or self._voice.now_ns() - newest[0] > self._timeout * NANOSECONDS:
            raise AbortError(f'no odometry for {self._timeout:g} s')
        fastest = max(self._speeds())
        if not fastest <= self._most:  # NaN is too fast as well
            raise AbortError(f'{fastest:.3g} m/s or rad/s, more than {self._most:.3g}')
        if self._count % LOOK == 0 and (others := self._voice.others()):
            raise AbortError(f'{others[0]} publishes the wrench as well')
        self._count += 1


def carry_out(
    voice: Voice,
    plan: Plan,
    timeout: float,
    stopped: Callable[[], bool],
    begins: Callable[[Trial], None],
) -> Actuation:
    """Send the wrenches of a plan; the last ones are zero, however it ends.

    Parameters
    ----------
    voice : that sends
    plan : what
    timeout : s of silence of the odometry that end it
    stopped : whether the user wants an end
    begins : is told of each trial

    Raises
    ------
    StoppedError : the user wanted an end; zero was sent

    """
    done: list[Sent] = []
    try:
        watch = Watch(voice, plan.speed, timeout, stopped)
        for trial in plan.trials:
            begins(trial)
            done.append(Sent(trial))
            _send(voice, watch, done[-1])
    except AbortError as error:
        return Actuation(done, str(error))
    finally:
        _hold(voice, ZERO, GOODBYE, lambda: None, [])
    return Actuation(done)


def _send(voice: Voice, watch: Watch, sent: Sent) -> None:
    tau = sent.trial.tau
    back = tuple(-number for number in tau)
    parts = [(ZERO, REST), (tau, PULSE), (back, PULSE), (ZERO, REST)]
    if sent.trial.silent:
        parts = [(ZERO, REST), (tau, HELD)]
    for wrench, seconds in parts:
        _hold(voice, wrench, seconds, watch.look, sent.steps)
    if sent.trial.silent:
        for _ in range(round(UNHEARD / PERIOD)):
            voice.listen(PERIOD)
            watch.look()
    sent.ended_ns = voice.now_ns()


def _hold(
    voice: Voice,
    tau: tuple[float, ...],
    seconds: float,
    look: Callable[[], None],
    steps: list[tuple[int, tuple[float, ...]]],
) -> None:
    """Send one wrench again and again."""
    for _ in range(round(seconds / PERIOD)):
        steps.append((voice.send(tau), tau))
        look()
        voice.listen(PERIOD)
