"""What `auv check-driver --actuate` does to a vehicle: announced, bounded, to be stopped."""

import argparse
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from threading import Event
from typing import Any

from auv_analysis.cli.graphs import (
    checked_namespace,
    checked_topic,
    join_domain,
    place_of,
    positive,
    short_place,
)
from auv_analysis.driver_check.checks import findings_of
from auv_analysis.driver_check.finding import PASS, Finding
from auv_analysis.driver_check.outcome import Commands, Result, document_of, failure_of, judged
from auv_analysis.driver_check.plan import SPEED, Plan, plan_of
from auv_analysis.driver_check.procedure import Actuation, StoppedError, carry_out
from auv_analysis.driver_check.settings import Settings
from auv_analysis.driver_check.terminal import findings_table
from auv_analysis.graph.domain import joined_domain
from auv_analysis.output.folder import check_free, results_folder
from auv_analysis.output.progress import TextConsole, bar, say, waiting
from auv_analysis.output.text import join
from auv_dynamics import load_vehicle
from auv_dynamics.files.ending import on_signals
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.ros import interface
from auv_dynamics.ros.interface import Frames

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


USUAL = 10.0  # s of listening
LONGEST = 600.0  # s
APPEARS = 5.0  # s within which discovery finds a driver that is there
LOOK = 0.1  # s between two looks
FASTEST = 0.5  # m/s and rad/s that may be asked for
PASSIVE = 'nothing is sent without --actuate'


def check_driver(options: argparse.Namespace) -> dict[str, Any]:
    """Listen to a driver and judge it; FailedError where a check fails."""
    seconds = positive(options.seconds, '--seconds', LONGEST) or USUAL
    commands, settings = _commands(options), _settings(options)
    names = {
        interface.ODOM: checked_topic(options.odom or interface.ODOM, '--odom'),
        interface.WRENCH: checked_topic(options.wrench or interface.WRENCH, '--wrench'),
    }
    domain = joined_domain(options.domain_id)
    namespace = checked_namespace(options.namespace)
    if options.out is not None:
        check_free(options.out, overwrite=options.overwrite)
    join_domain(domain)
    # the middleware reads its environment when it is loaded
    from auv_analysis.nodes.driver_check_node import Ear

    with ExitStack() as stack:
        ear = Ear(domain, namespace, names, settings.frames, commands=options.actuate)
        stack.callback(ear.close)
        say(f'listens on {place_of(domain, namespace)}')
        began = _listen(ear, seconds)
        scene = ear.scene(short_place(domain, namespace))
        findings = findings_of(scene, ear.recording(began), settings)
        why = refusal(findings) if commands else PASSIVE
        actuation = None
        if commands and not why:
            actuation = actuate(ear, commands.plan, settings.timeout)
        recording = ear.recording(began)
    result = judged(scene, recording, settings, why, actuation, commands)
    return _conclude(options, result)


def _settings(options: argparse.Namespace) -> Settings:
    usual = Frames()
    return Settings(
        frames=Frames(options.odom_frame or usual.odom, options.base_frame or usual.base),
        rate=positive(options.expect_rate, '--expect-rate', 1e4),
        sim_time=options.use_sim_time,
        actuates=options.actuate,
    )


def _commands(options: argparse.Namespace) -> Commands | None:
    """What is going to be sent; None without --actuate."""
    speed = positive(options.speed, '--speed', FASTEST) or SPEED
    force, torque = positive(options.force, '--force'), positive(options.torque, '--torque')
    vehicle = None if options.vehicle is None else load_vehicle(options.vehicle)
    if not options.actuate:
        return None
    if vehicle is None:
        expected = 'a vehicle file with --actuate: it bounds the wrenches and predicts the answer'
        raise InputError('--vehicle', '', expected, None)
    plan = plan_of(vehicle, options.axis or (), speed, force, torque)
    if not plan.trials:
        expected = f'axes that the thrusters of {vehicle.name} can move'
        raise InputError('--axis', '', expected, ', '.join(options.axis or ()))
    return Commands(vehicle, plan)


def _listen(ear: Any, seconds: float) -> int:
    """Listen for so long from the first odometry on; the time of the first, ns."""
    appears = time.monotonic() + APPEARS
    while not len(ear.tape) and time.monotonic() < appears:
        ear.listen(LOOK)
    began, first = time.time_ns(), time.monotonic()
    if not len(ear.tape) and not ear.publishes():
        return began
    with bar() as shown:
        task = shown.add_task('listens', total=seconds)
        while (spent := time.monotonic() - first) < seconds:
            text = f'{len(ear.tape)} messages'
            shown.update(task, completed=spent, description=text)
            ear.listen(min(LOOK, seconds - spent))
    return began


def _conclude(options: argparse.Namespace, result: Result) -> dict[str, Any]:
    document = document_of(result)
    if not options.json:
        TextConsole(highlight=False).print(findings_table(result.findings))
    if options.out is not None:
        from auv_analysis.driver_check.report import write_results  # matplotlib loads slowly

        inputs = [shipped('vehicles', options.vehicle)] if options.vehicle else []
        with (
            results_folder(options.out, overwrite=options.overwrite, inputs=inputs) as results,
            waiting('drawing figures, writing the report'),
        ):
            write_results(results.folder, result, document)
    failure = failure_of(result.findings)
    if failure:
        raise FailedError(failure, document)
    return document
