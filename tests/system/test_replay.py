"""A recorded run played again: analysis says the same, laws answer it, `auv replay` as typed."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.fork_server import Process
from helpers.graph_runs import every_message, recorded
from helpers.made_messages import Bag, odometry, serialized, stamped
from helpers.node_processes import (
    PATIENCE,
    Peer,
    change,
    environment,
    fresh_domain,
    graph,
    parameters,
    start_auv,
    start_installed_auv,
    start_node,
    stop,
)
from helpers.patience import patience
from helpers.played_bags import STATE, STEP, ended, fill, made, steps_of, there
from lifecycle_msgs.msg import Transition

from auv_analysis import load_scenario
from auv_analysis.bag.load import load_run
from auv_analysis.bag.step_topics import ODOMETRY, WRENCH
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.replay.compared import reproduction
from auv_analysis.replay.open_loop import open_loop, recorded_loop
from auv_dynamics.files.errors import ENDING
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.interface import nanoseconds

GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
SCENARIO = {
    'name': 'played',
    'vehicle': 'rexrov',
    'duration': 1.0,
    'step': 0.01,
    'initial': {'eta': [1.0, 2.0, 3.0, 0.2, -0.3, 1.2], 'nu': [0.3, -0.1, 0.2, 0.05, 0.02, -0.1]},
    'controllers': {'gvc': {'law': 'gvc', **GAINS}},
    'setpoint': {'surge': {'offset': 0.2, 'terms': [{'amplitude': 0.1, 'omega': 0.5}]}},
    'disturbance': {'kind': 'herman2018'},
    'actuators': {'limit': 900.0},
}
FORCED = ('--original-names', '--force-commands', '--topics', 'wrench')
PACED = ('/diagnostics', '/recorder/progress', '/controller_node/transition_event')  # by the wall


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was recorded in lock-step, with saturation."""
    folder = tmp_path_factory.mktemp('played')
    (folder / 'played.yaml').write_text(yaml.safe_dump(SCENARIO))
    return recorded(folder / 'played.yaml', folder / 'out') / 'gvc'


def start_replay(domain: int, *options: str) -> Process:
    return start_auv('replay', *options, domain=domain)


def test_live_analysis_of_a_replay_is_the_recorded_one(bag: Path) -> None:
    """Every message of every topic, to the last bit."""
    heard = [topics.Topic(f'replay/{t.name}', t.type) for t in topics.ANALYSIS_TOPICS]
    counts = ', '.join(f'"{topic.name}=1"' for topic in topics.ANALYSIS_TOPICS)
    analysis = ['-r', '__ns:=/replay', '-p', f'expected_subscribers:=[{counts}]']
    analysis += parameters(vehicle=bag.parent / 'vehicle.yaml')
    waits = '["odom=1", "cmd_vel=1", "wrench=1", "disturbance=1", "disturbance_estimate=1"]'
    replay = [*parameters(bag=bag, rate=0.0), '-p', f'expected_subscribers:={waits}']
    with graph(('analysis_node', analysis), ('replay_node', replay)) as (peer, processes):
        peer.listen(*heard)
        assert ended(peer, processes['replay_node']) == 0
        peer.until(lambda: all(len(peer.heard[t.name]) >= 11 for t in heard), 'the last sample')
    recorded = every_message(bag)
    for topic in topics.ANALYSIS_TOPICS:
        messages = peer.heard[f'replay/{topic.name}']
        again = [(nanoseconds(m.header.stamp), numbers(m)) for m in messages]
        assert len(again) == 11
        assert again == [(ns, flat(message)) for ns, message in recorded[f'/{topic.name}']], topic


def numbers(message: Any) -> list:
    """Everything in a message of rclpy in its order, without its header's stamp."""
    found: list = []
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if name == 'stamp':
            continue
        if hasattr(value, 'get_fields_and_field_types'):
            found += numbers(value)
        else:
            found += list(value) if not isinstance(value, str | float | int) else [value]
    return found


def flat(message: Any) -> list:
    """The same of a decoded message as tuples: header first, the stamp first in it."""
    (_, frame), *rest = message
    return [frame, *leaves(rest)]


def leaves(value: Any) -> list:
    if not isinstance(value, list | tuple):
        return [value]
    return [leaf for entry in value for leaf in leaves(entry)]


def test_a_replay_that_is_recorded_is_the_same_bag(bag: Path, tmp_path: Path) -> None:
    """Under the recorded names, as fast as it goes: our observers lose nothing."""
    domain, again = fresh_domain(), tmp_path / 'again'
    counts = ', '.join(f'"{topic.name}=1"' for topic in topics.ANALYSIS_TOPICS)
    recorder = parameters(bag=again, duration=1.0, analysis_every=10)
    recorder += ['-p', 'topics:=["odom", "wrench", "cmd_vel", "twist", "wrench_applied"]']
    analysis = parameters(vehicle=bag.parent / 'vehicle.yaml')
    analysis += ['-p', f'expected_subscribers:=[{counts}]']
    processes = [
        start_node('recorder_node', domain, *recorder),
        start_node('analysis_node', domain, *analysis),
    ]
    try:
        waits = ['odom=2', 'cmd_vel=2', 'wrench=2', 'disturbance=2', 'disturbance_estimate=2']
        waits += ['twist=1', 'cmd_accel=1', 'wrench_applied=1']
        options = ['--original-names', '--commands', '--rate', 'max', '--json']
        options += [word for entry in waits for word in ('--expect', entry)]
        replay = start_replay(domain, str(bag), *options)
        output, errors = replay.communicate(timeout=PATIENCE)
        assert replay.returncode == 0, errors
        assert processes[0].wait(PATIENCE) == 0, 'the recorder has all'
    finally:
        for process in processes:
            print(stop(process))
    document = json.loads(output)
    assert document['topics']['/wrench']['messages'] == 101
    ours = {'/clock', *PACED[:2], *(f'/{topic}' for topic in interface.ANALYSIS_TOPICS)}
    # a short run may be over before the first diagnostics
    assert document['left_out'].keys() == ours & every_message(bag).keys()
    first, second = (every_message(folder, *PACED) for folder in (bag, again))
    assert first.keys() == second.keys()
    for topic, messages in first.items():
        assert sorted(messages) == sorted(second[topic]), topic


def test_the_recorded_law_gives_the_recorded_wrench(bag: Path) -> None:
    loop = recorded_loop(bag)
    again = open_loop(loop, 'gvc', loop.controller.gains)
    assert np.array_equal(again.tau, load_run(bag).tau)
    assert np.array_equal(again.f, loop.series[interface.DISTURBANCE_ESTIMATE][1])
    assert not again.trouble


def test_another_law_answers_recorded_odometry_as_in_process(bag: Path) -> None:
    """A real node in lock-step against the same law in this process, to the last bit."""
    other = topics.Topic('replay/other', topics.WRENCH.type)
    controller = ['-r', '__ns:=/replay', '-r', 'wrench:=other']
    controller += ['-r', 'disturbance_estimate:=other_estimate', '-p', 'actuators.limit:=[900.0]']
    controller += ['-p', 'expected_subscribers:=["wrench=2"]']
    values: dict[str, Any] = {f'gains__{name}': f'[{value}]' for name, value in GAINS.items()}
    values |= {'law': 'cl', 'vehicle': bag.parent / 'vehicle.yaml', 'lockstep': True}
    values |= {'setpoint_pairing': 'exact', 'setpoint_acceleration': 'topic'}
    replay = parameters(bag=bag, rate=0.0, answers='replay/other')
    replay += ['-p', 'topics:=["odom", "cmd_vel", "cmd_accel"]']
    replay += ['-p', 'expected_subscribers:=["odom=1", "cmd_vel=1", "cmd_accel=1"]']
    nodes = ('controller_node', [*controller, *parameters(**values)]), ('replay_node', replay)
    with graph(*nodes) as (peer, processes):
        peer.listen(other)
        assert ended(peer, processes['replay_node']) == 0
        peer.until(lambda: len(peer.heard[other.name]) >= 101, 'the last answer')
    expected = open_loop(recorded_loop(bag), 'cl', GAINS)
    messages = peer.heard[other.name]
    live = [[*vector(m.wrench.force), *vector(m.wrench.torque)] for m in messages]
    assert [nanoseconds(m.header.stamp) for m in messages] == expected.ns.tolist()
    assert np.array_equal(live, expected.tau)
    assert len(live) == 101
    assert np.abs(expected.tau - load_run(bag).tau).max() > 10.0, 'it is another law'


def vector(message: Any) -> tuple:
    return message.x, message.y, message.z


@pytest.mark.parametrize('how', ENDING)
def test_a_signal_ends_it_well(how: int, tmp_path: Path) -> None:
    """What it said to a vehicle last is a zero wrench."""
    domain = fresh_domain()
    peer = Peer(domain)
    try:
        peer.listen(topics.WRENCH)
        options = (str(made(tmp_path / 'bag', 500)), '--rate', '0.2', '--json', *FORCED)
        process = start_replay(domain, *options)
        forces = forces_once_moving(peer)
        process.send_signal(how)
        output, errors = process.communicate(timeout=PATIENCE)
        peer.until(lambda: forces()[-1] == 0.0, 'the zero wrench')
    finally:
        peer.close()
    assert process.returncode == 0, errors
    document = json.loads(output)
    assert document['interrupted']
    assert 0 < document['messages'] < 500
    assert document['topics'].keys() == {'/wrench'}


def forces_once_moving(peer: Peer) -> Callable[[], list[float]]:
    """Forces heard so far, once one of them is not zero."""

    def forces() -> list[float]:
        return [message.wrench.force.x for message in peer.heard['wrench']]

    peer.until(lambda: any(forces()), 'a wrench')
    return forces


def test_a_terminal_that_is_closed_leaves_a_zero_wrench(tmp_path: Path) -> None:
    domain = fresh_domain()
    peer = Peer(domain)
    peer.listen(topics.WRENCH)
    options = (str(made(tmp_path / 'bag', 500)), '--rate', '0.2', *FORCED)
    ours, its = pty.openpty()
    command = ['setsid', '--ctty', str(Path(sys.executable).with_name('auv')), 'replay', *options]
    process = subprocess.Popen(command, env=environment(domain), stdin=its, stdout=its, stderr=its)
    os.close(its)
    try:
        forces = forces_once_moving(peer)
        os.close(ours)
        peer.until(lambda: forces()[-1] == 0.0, 'the zero wrench')
        peer.until(lambda: process.poll() is not None, 'the end')
    finally:
        process.kill()
        peer.close()


def test_keys_step_and_go_on(tmp_path: Path) -> None:
    domain = fresh_domain()
    peer = Peer(domain)
    ours, its = pty.openpty()
    odom = there(topics.ODOM)
    options = (str(made(tmp_path / 'bag')), '--paused', '--rate', 'max', '--expect', 'odom=1')
    process = start_installed_auv('replay', *options, domain=domain, stdin=its)
    os.close(its)
    try:
        peer.listen(odom)
        sent = 0

        def stepped() -> bool:
            nonlocal sent
            if not peer.heard[odom.name] and time.monotonic() > sent:
                os.write(ours, b'\x1b[C')
                sent = time.monotonic() + 0.5
            return bool(peer.heard[odom.name])

        peer.until(stepped, 'a step')
        os.write(ours, b' ')
        peer.until(lambda: process.poll() is not None, 'the end')
        peer.until(lambda: len(peer.heard[odom.name]) >= 50, 'the rest')
    finally:
        peer.close()
        os.close(ours)
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    assert 'space: pause, go on' in errors
    assert len(peer.heard[odom.name]) == 50


def test_the_options_say_which_part_is_played_how_often_and_under_which_names(
    tmp_path: Path,
) -> None:
    bag, domain = Bag(tmp_path / 'bag.mcap'), fresh_domain()
    fill(bag, range(20))
    derived = f'/{interface.DELTA_XI}'
    bag.add(derived, WRENCH, 12 * STEP, serialized(stamped('Wrench', 12 * STEP, (1.0,) * 6)))
    for k in (10_000, 10_050):
        bag.add('/odom', ODOMETRY, k * STEP, serialized(odometry(k * STEP, STATE)))
    odom = there(topics.ODOM, 'other')
    options = ['--start', '0.1', '--duration', '100.1', '--loop', '--skip-gaps', '--all']
    options += ['--namespace', 'other', '--no-clock', '--rate', 'max', '--expect', 'odom=1']
    peer, once = Peer(domain), [*range(10, 20), 10_000]
    try:
        peer.listen(odom)
        process = start_replay(domain, str(bag.close()), *options, '--json')
        peer.until(lambda: len(peer.heard[odom.name]) >= 3 * len(once), 'three loops')
        assert peer.node.count_publishers(topics.CLOCK.name) == 0
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=PATIENCE)
    finally:
        peer.close()
    assert steps_of(peer, odom)[: 3 * len(once)] == 3 * once
    document = json.loads(output)
    assert {topic: one['published_as'] for topic, one in document['topics'].items()} == {
        topic: f'/other{topic}' for topic in ('/odom', '/remark', derived)
    }
    assert document['left_out'].keys() == {'/cmd_vel', '/wrench'}
    assert (document['start'], document['gaps']) == (0.1, [{'from': 0.19, 'to': 100.0}])
    assert 0.0 <= document['duration'] <= 99.9
    assert document['loops'] >= 2
    assert f'topics, {document["loops"]} loops and ' in errors
    assert 'nothing from 0.19 to 100 s of the bag: jumped over' in errors


def test_a_foreign_listener_is_named_by_the_command(tmp_path: Path) -> None:
    domain = fresh_domain()
    peer = Peer(domain)
    try:
        peer.listen(topics.WRENCH, topics.ODOM)
        options = (str(made(tmp_path / 'bag')), '--original-names', '--commands', '--json')
        process = start_replay(domain, *options)
        peer.until(lambda: process.poll() is not None, 'the end')
    finally:
        peer.close()
    output, errors = process.communicate()
    assert process.returncode == 2
    assert output == ''
    refusal = errors.strip().splitlines()[-1]
    assert '/wrench: expected nobody who acts on recorded commands, found /test_peer' in refusal
    assert peer.heard == {'wrench': [], 'odom': []}


def in_real_time(folder: Path) -> tuple[Path, bool]:
    """A run that is not in lock-step: activated late, and without set-points for a while.

    At 10 Hz, so that other tests on the machine do not make every second set-point late.

    Returns
    -------
    bag : of the run
    late : whether a set-point came so late that the controller may have missed it, which the bag
        does not tell: on a busy machine

    """
    path = folder / 'played.yaml'
    text = yaml.safe_dump({**SCENARIO, 'duration': 600.0, 'step': 0.1})
    path.write_text(text)
    scenario, bag = load_scenario(path), folder / 'bag'
    nodes = node_parameters(
        scenario,
        'gvc',
        bag=bag,
        vehicle='rexrov',
        analysis=False,
        lockstep=False,
        use_sim_time=False,
    )
    nodes['plant_node']['start_after'] = []  # an inactive controller is not ready
    nodes['plant_node'] |= {'wrench_timeout': patience(0.5)}
    nodes['controller_node'] |= {
        'autostart': False, 'limits.wrench': [3000.0] * 6,
        'odometry_timeout': patience(0.5), 'setpoint_timeout': patience(0.5),
    }  # fmt: skip
    told, attached = folder / 'params.yaml', folder / 'vehicle.yaml'
    attached.write_text(scenario.attachments['vehicle.yaml'])
    nodes['recorder_node']['attachments'] = [f'{file.name}={file}' for file in (told, attached)]
    told.write_text(parameter_file(nodes, 'real time'))
    names = ('plant_node', 'setpoint_node', 'controller_node', 'recorder_node')
    with graph(*((name, ['--ros-args', '--params-file', str(told)]) for name in names)) as found:
        peer, processes = found
        peer.listen(topics.ODOM, topics.WRENCH)
        odometry, wrenches = peer.heard[topics.ODOM.name], peer.heard[topics.WRENCH.name]
        came: dict[str, dict[int, float]] = {}  # topic -> stamp -> when it came
        for topic in (topics.ODOM, topics.CMD_VEL):
            at = came[topic.name] = {}
            peer.node.create_subscription(
                topic.type,
                topic.name,
                lambda m, at=at: at.setdefault(nanoseconds(m.header.stamp), time.monotonic()),
                topics.every_step(),
            )
        peer.until(lambda: len(odometry) > 10, 'odometry')
        for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
            assert change(peer, transition)

        def acts(number: int) -> bool:
            return sum(message.wrench.force.x != 0.0 for message in wrenches) > number

        peer.until(lambda: acts(30), 'wrenches')
        began, stopped = (nanoseconds(odometry[i].header.stamp) for i in (10, -1))
        processes['setpoint_node'].send_signal(signal.SIGSTOP)
        peer.until(lambda: wrenches[-1].wrench.force.x == 0.0, 'watchdog')
        processes['setpoint_node'].send_signal(signal.SIGCONT)
        again = nanoseconds(odometry[-1].header.stamp)
        peer.until(lambda: acts(70), 'wrenches again')
        code, _ = stop(processes['recorder_node'], signal.SIGINT)
        assert code == 0
    measured, wanted = came[topics.ODOM.name], came[topics.CMD_VEL.name]
    steps = [ns for ns in measured if began < ns < stopped or ns > again + 300_000_000]
    ahead = [measured[ns] - wanted.get(ns, np.inf) for ns in steps]
    return bag, min(ahead) < 0.02  # usually a step


def test_the_law_of_a_bag_in_real_time_is_reproduced(tmp_path: Path) -> None:
    for attempt in range(5):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        bag, late = in_real_time(folder)
        loop = recorded_loop(bag)
        answers = open_loop(loop, loop.controller.law, loop.controller.gains)
        found = reproduction(loop, answers)
        if found.holds or not late:
            break
    assert found.holds, found.sentence()
    # the odometry upon which the test activates it may be still to be taken then
    assert answers.ns[0] >= loop.series[interface.ODOM][0][10], 'not before its activation'
    assert any('was not in charge' in note for note in answers.notes)
