"""`auv check-driver`: whether a vehicle driver offers what our nodes need."""

from __future__ import annotations

import argparse
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import (
    add_domain,
    add_frames,
    add_results,
    namespace,
    number,
    topic,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import interface
from auv_dynamics.vehicle import DOFS

if TYPE_CHECKING:
    from auv_analysis.driver.evidence import DriverRecord
    from auv_analysis.driver.plan import Plan

APPEARS = 5.0  # s within which discovery finds a driver that is there
SPEED, FASTEST = 0.1, 0.5  # m/s and rad/s
LOOK = 0.1  # s between two looks


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Where the driver is, how long it is listened to, and what may be sent to it."""
    add_results(command)
    add_domain(command)
    add = command.add_argument
    add('--namespace', type=namespace, default='/', help='of the driver, such as /auv1')
    text = 'its odometry, default: odom'
    add('--odom', type=topic, default=interface.ODOM, metavar='TOPIC', help=text)
    text = 'what it takes, default: wrench'
    add('--wrench', type=topic, default=interface.WRENCH, metavar='TOPIC', help=text)
    add_frames(command)
    text = 'how long to listen, default: 10'
    add('--seconds', type=number(above=0, at_most=600), default=10.0, metavar='S', help=text)
    text = 'that the driver promises'
    add('--expect-rate', type=number(above=0, at_most=1e4), metavar='HZ', help=text)
    text = 'stamps are those of /clock: the driver is a simulation'
    add('--use-sim-time', action='store_true', help=text)
    text = 'file or shipped bare name; for --actuate: bounds the wrench, predicts the response'
    add('--vehicle', help=text)
    group = command.add_argument_group('wrenches, none of which is sent without --actuate')
    add = group.add_argument
    text = 'send small wrenches, an axis at a time: THE VEHICLE MOVES'
    add('--actuate', action='store_true', help=text)
    text = 'only this one; may be repeated; default: all that are actuated'
    add('--axis', action='append', choices=DOFS, help=text)
    text = (
        f'largest predicted speed, m/s and rad/s, default: {SPEED:g}, or up to {FASTEST:g} where '
    )
    text += "the vehicle file's thrusters would stay in their dead band"
    add('--speed', type=number(above=0, at_most=FASTEST), metavar='V', help=text)
    add('--force', type=number(above=0), metavar='N', help='largest force, N')
    add('--torque', type=number(above=0), metavar='NM', help='largest torque, N m')


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Listen to a driver and judge it; FailedError where a check fails."""
    from auv_analysis.driver.checks import PASSIVE, judge, refusal
    from auv_analysis.driver.evidence import DriverRecord, Settings
    from auv_analysis.driver.excitation import actuate
    from auv_analysis.graph.domain import join_domain, place_of
    from auv_analysis.output.folder import check_free
    from auv_analysis.output.progress import say

    plan, frames = _plan(options), interface.Frames(options.odom_frame, options.base_frame)
    settings = Settings(frames, options.expect_rate, options.use_sim_time, options.actuate)
    if options.out is not None:
        check_free(options.out, overwrite=options.overwrite, inputs=_inputs(options))
    domain = join_domain(options.domain_id)
    # the middleware reads its environment when it is loaded
    from auv_analysis.nodes.driver_check_node import RosDriverClient

    names = {interface.ODOM: options.odom, interface.WRENCH: options.wrench}
    with ExitStack() as stack:
        client = RosDriverClient(domain, options.namespace, names, frames, commands=bool(plan))
        stack.callback(client.close)
        say(f'listens on {place_of(domain, options.namespace)}')
        began = _listen(client, options.seconds)
        graph = client.graph(place_of(domain, options.namespace, with_range=False))
        why, excitation = 'nothing is sent without --actuate', None
        if plan is not None:
            why = refusal(judge(DriverRecord(graph, client.log(began), settings), PASSIVE))
            if not why:
                excitation = actuate(client, plan, settings.timeout)
        evidence = DriverRecord(graph, client.log(began), settings, excitation, why)
    return _conclude(options, evidence)


def _plan(options: argparse.Namespace) -> Plan | None:
    """What is going to be sent; None without --actuate."""
    from auv_analysis.driver.plan import plan_of
    from auv_dynamics import load_vehicle

    vehicle = None if options.vehicle is None else load_vehicle(options.vehicle)
    if not options.actuate:
        return None
    if vehicle is None:
        expected = 'a vehicle file with --actuate: it bounds the wrench and predicts the response'
        raise InputError('--vehicle', '', expected, None)
    speeds = (SPEED, FASTEST) if options.speed is None else (options.speed, options.speed)
    plan = plan_of(
        vehicle, options.axis or (), speeds[0], options.force, options.torque, raised=speeds[1]
    )
    if not plan.trials:
        expected = f'axes that the thrusters of {vehicle.name} can move'
        raise InputError('--axis', '', expected, ', '.join(options.axis or ()))
    return plan


def _inputs(options: argparse.Namespace) -> list[Path]:
    from auv_dynamics.files.shipped import shipped

    return [shipped('vehicles', options.vehicle)] if options.vehicle else []


def _listen(client: Any, seconds: float) -> int:
    """Listen for so long from the first odometry on; the time of the first, ns."""
    from auv_analysis.output.progress import bar

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


def _conclude(options: argparse.Namespace, evidence: DriverRecord) -> dict[str, Any]:
    from auv_analysis.driver.checks import document_of, failure_of, findings_table, judge
    from auv_analysis.output.folder import results_folder
    from auv_analysis.output.progress import TextConsole, waiting
    from auv_dynamics.files.errors import FailedError

    findings = judge(evidence)
    document = document_of(evidence, findings)
    if not options.json:
        TextConsole(highlight=False).print(findings_table(findings))
    if options.out is not None:
        from auv_analysis.driver.report import write_results  # matplotlib loads slowly

        inputs = _inputs(options)
        with (
            results_folder(options.out, overwrite=options.overwrite, inputs=inputs) as results,
            waiting('drawing plots, writing the report'),
        ):
            write_results(results.folder, evidence, findings, document)
    failure = failure_of(findings)
    if failure:
        raise FailedError(failure, document)
    return document
