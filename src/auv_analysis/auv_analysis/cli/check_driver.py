"""`auv check-driver`: whether a vehicle driver offers what our nodes need."""

import argparse
import time
from collections.abc import Callable
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
from auv_analysis.driver.checks import (
    PASSIVE,
    document_of,
    failure_of,
    findings_table,
    judge,
    refusal,
)
from auv_analysis.driver.evidence import Evidence, Settings
from auv_analysis.driver.excitation import SPEED, Excitation, Plan, StoppedError, carry_out, plan_of
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

USUAL = 10.0  # s of listening
LONGEST = 600.0  # s
APPEARS = 5.0  # s within which discovery finds a driver that is there
LOOK = 0.1  # s between two looks
FASTEST = 0.5  # m/s and rad/s that may be asked for
COUNTDOWN = 3  # s before the first wrench
MATCHES = 5.0  # s for the driver to be seen by a new publisher


def check_driver(options: argparse.Namespace) -> dict[str, Any]:
    """Listen to a driver and judge it; FailedError where a check fails."""
    seconds = positive(options.seconds, '--seconds', LONGEST) or USUAL
    plan, settings = _plan(options), _settings(options)
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
    from auv_analysis.nodes.driver_check_node import RosDriverClient

    with ExitStack() as stack:
        client = RosDriverClient(domain, namespace, names, settings.frames, commands=bool(plan))
        stack.callback(client.close)
        say(f'listens on {place_of(domain, namespace)}')
        began = _listen(client, seconds)
        graph = client.graph(short_place(domain, namespace))
        why, excitation = 'nothing is sent without --actuate', None
        if plan is not None:
            why = refusal(judge(Evidence(graph, client.log(began), settings), PASSIVE))
            if not why:
                excitation = actuate(client, plan, settings.timeout)
        evidence = Evidence(graph, client.log(began), settings, excitation, why)
    return _conclude(options, evidence)


def _settings(options: argparse.Namespace) -> Settings:
    usual = Frames()
    return Settings(
        frames=Frames(options.odom_frame or usual.odom, options.base_frame or usual.base),
        rate=positive(options.expect_rate, '--expect-rate', 1e4),
        sim_time=options.use_sim_time,
        actuates=options.actuate,
    )


def _plan(options: argparse.Namespace) -> Plan | None:
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
    return plan


def _listen(client: Any, seconds: float) -> int:
    """Listen for so long from the first odometry on; the time of the first, ns."""
    appears = time.monotonic() + APPEARS
    while not len(client.buffer) and time.monotonic() < appears:
        client.listen(LOOK)
    began, first = time.time_ns(), time.monotonic()
    if not len(client.buffer) and not client.publishes():
        return began
    with bar() as shown:
        task = shown.add_task('listens', total=seconds)
        while (spent := time.monotonic() - first) < seconds:
            text = f'{len(client.buffer)} messages'
            shown.update(task, completed=spent, description=text)
            client.listen(min(LOOK, seconds - spent))
    return began


def actuate(client: Any, plan: Plan, timeout: float) -> Excitation:
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
    with on_signals(stop.set):
        try:
            return _announced(client, plan, timeout, stop.is_set)
        except StoppedError:
            raise KeyboardInterrupt from None
        finally:
            client.retire()


def _announced(client: Any, plan: Plan, timeout: float, stopped: Callable[[], bool]) -> Excitation:
    for line in plan.lines():
        say(line)
    client.advertise()  # nothing is sent yet, but whoever else is about to command sees it
    for left in range(COUNTDOWN, 0, -1):
        say(f'begins in {left} s')
        _wait(client, 1.0, stopped)
    if others := client.others():
        return Excitation(plan, (), f'{join(others)} publishes the wrench as well')
    until = time.monotonic() + MATCHES
    while not client.advertise():
        if time.monotonic() > until:
            why = f'the driver does not hear a publisher within {MATCHES:g} s'
            return Excitation(plan, (), why)
        _wait(client, LOOK, stopped)
    return carry_out(client, plan, timeout, stopped, lambda trial: say(f'{trial.dof} ...'))


def _wait(client: Any, seconds: float, stopped: Callable[[], bool]) -> None:
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        client.listen(min(LOOK, left))
        if stopped():
            raise StoppedError


def _conclude(options: argparse.Namespace, evidence: Evidence) -> dict[str, Any]:
    findings = judge(evidence)
    document = document_of(evidence, findings)
    if not options.json:
        TextConsole(highlight=False).print(findings_table(findings))
    if options.out is not None:
        from auv_analysis.driver.report import write_results  # matplotlib loads slowly

        inputs = [shipped('vehicles', options.vehicle)] if options.vehicle else []
        with (
            results_folder(options.out, overwrite=options.overwrite, inputs=inputs) as results,
            waiting('drawing figures, writing the report'),
        ):
            write_results(results.folder, evidence, findings, document)
    failure = failure_of(findings)
    if failure:
        raise FailedError(failure, document)
    return document
