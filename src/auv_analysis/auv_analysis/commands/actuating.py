"""What `auv check-driver --actuate` does to a vehicle: announced, bounded, to be stopped."""

import time
from collections.abc import Callable, Sequence
from threading import Event
from typing import Any

from auv_analysis.console import say
from auv_analysis.driver_check.finding import PASS, Finding
from auv_analysis.driver_check.plan import Plan
from auv_analysis.driver_check.procedure import Actuation, StoppedError, carry_out
from auv_analysis.report.text import join
from auv_dynamics.ending import on_signals

COUNTDOWN = 3  # s
MATCHES = 5.0  # s for the driver to be seen by a new publisher
LOOK = 0.1  # s
NEEDED = (
    *('odom_publisher', 'wrench_subscriber', 'wrench_publishers', 'qos_wrench', 'frames'),
    *('finite', 'quaternion_norm', 'rate', 'gaps', 'stamps'),
)


def refusal(findings: Sequence[Finding]) -> str:
    """Why no wrench may be sent after what was heard, or an empty text."""
    against = [one.id for one in findings if one.id in NEEDED and one.verdict != PASS]
    return f'nothing was sent, since {join(against)} did not pass' if against else ''


def actuate(ear: Any, plan: Plan, timeout: float) -> Actuation:
    """Announce and carry out a plan.

    Parameters
    ----------
    ear : the participant, which has not spoken yet
    plan : what is sent
    timeout : s of silence of the odometry that end it

    Raises
    ------
    KeyboardInterrupt : the user wanted an end; zero was sent

    """
    stop = Event()  # a signal only asks for an end: zero is sent before it is one
    with on_signals(stop.set):
        try:
            return _announced(ear, plan, timeout, stop.is_set)
        except StoppedError:
            raise KeyboardInterrupt from None
        finally:
            ear.hush()


def _announced(ear: Any, plan: Plan, timeout: float, stop: Callable[[], bool]) -> Actuation:
    for line in plan.lines():
        say(line)
    ear.speak()  # silent so far, but to be seen by whoever else is about to command
    for left in range(COUNTDOWN, 0, -1):
        say(f'begins in {left} s')
        _wait(ear, 1.0, stop)
    if others := ear.others():
        return Actuation((), f'{join(others)} publishes the wrench as well')
    until = time.monotonic() + MATCHES
    while not ear.speak():
        if time.monotonic() > until:
            return Actuation((), f'the driver does not hear a publisher within {MATCHES:g} s')
        _wait(ear, LOOK, stop)
    return carry_out(ear, plan, timeout, stop, lambda trial: say(f'{trial.dof} ...'))


def _wait(ear: Any, seconds: float, stop: Callable[[], bool]) -> None:
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        ear.listen(min(LOOK, left))
        if stop():
            raise StoppedError
