"""The plant node: lock-step on the wrench's stamp, start barrier, watchdog, reset, real time."""

import re
import signal
import time
from collections.abc import Iterator
from subprocess import CompletedProcess
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.node_processes import (
    PATIENCE,
    assert_one_line,
    fresh_domain,
    graph,
    parameters,
    start_node,
    stop,
)
from helpers.nodes_in_process import Program, assert_refused, program
from helpers.patience import patience
from helpers.stalls import undisturbed
from std_srvs.srv import SetBool, Trigger

from auv_dynamics.nodes import plant_node
from auv_dynamics.nodes.plant_node import PlantNode
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.endpoints import UNNAMED
from auv_dynamics.ros.interface import Frames

FRAMES = Frames()
STEP = 10_000_000
LOCKSTEP = {'vehicle': 'herman2018', 'lockstep': True, 'duration': 1.0}
BARRIER = {**LOCKSTEP, 'expected_subscribers': ['odom=1', 'disturbance=1']}


def wrench(k: int, tau=(10.0, 0, 0, 0, 0, 0), frames: Frames = FRAMES):
    return convert.wrench(k * STEP, tau, frames)


def step_of(message) -> int:
    return interface.nanoseconds(message.header.stamp) // STEP


def odometry(peer, count: int) -> list:
    peer.until(lambda: len(peer.heard['odom']) >= count, f'{count} odometry messages')
    return peer.heard['odom']


def listening(peer) -> None:
    peer.listen(topics.ODOM, topics.TWIST, topics.DISTURBANCE, topics.CLOCK)


def answered(peer, first: int, count: int) -> None:
    """Answer some steps as they come."""
    for k in range(first, first + count):
        odometry(peer, k + 1)
        peer.publish(topics.WRENCH, wrench(k))


def ready(_, response):
    """The answer of a node that is waited for."""
    response.success = True
    return response


@pytest.fixture
def peer() -> Iterator[Program]:
    with program() as made:
        yield made


def test_advances_only_on_the_wrench_of_its_own_stamp(peer, capfd) -> None:
    plant = peer.add(PlantNode, BARRIER)
    listening(peer)
    assert [step_of(m) for m in odometry(peer, 1)] == [0]
    for wrong in (
        wrench(1),
        wrench(5),
        wrench(0, (np.nan,) * 6),
        wrench(0, frames=Frames(base='x')),
    ):
        peer.publish(topics.WRENCH, wrong)
    peer.until(lambda: plant.graph.refused.total() == 4, 'refusals')
    peer.spin(0.1)
    assert len(peer.heard['odom']) == 1, 'no step without its wrench'
    for k in range(3):
        peer.publish(topics.WRENCH, wrench(k))
        assert [step_of(m) for m in odometry(peer, k + 2)][-1] == k + 1
        peer.publish(topics.WRENCH, wrench(k))  # a second answer is none
    peer.until(lambda: plant.graph.refused.total() == 7, 'refusals')
    peer.until(lambda: len(peer.heard['disturbance']) == 3, 'a disturbance per wrench')
    assert [step_of(m) for m in peer.heard['disturbance']] == [0, 1, 2]
    assert plant.plant.k == 3
    output = capfd.readouterr().err
    for word in ('frame_id', 'finite', 'stamp'):
        assert word in output, output


def test_publishes_nothing_before_its_subscribers_have_matched(peer) -> None:
    """Rival recordings lose the first messages (rosbag2#1430)."""
    peer.add(PlantNode, BARRIER)
    answer = peer.call(Trigger, 'plant_node/ready')
    assert not answer.success
    assert 'odom' in answer.message
    for data, said in ((True, 'plant_node'), (False, 'paused')):
        answer = peer.call(SetBool, 'plant_node/run', SetBool.Request(data=data))
        assert (answer.success, answer.message) == (not data, said)
    peer.spin(plant_node.MET + 0.2)
    listening(peer)
    peer.until(lambda: peer.call(Trigger, 'plant_node/ready').success, 'all to be there')
    peer.spin(0.2)
    assert not peer.heard['odom'], 'a pause goes on'
    assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=True)).success
    assert step_of(odometry(peer, 1)[0]) == 0, 'the very first step is heard'


def test_starts_by_itself_once_all_are_there(peer) -> None:
    plant = peer.add(PlantNode, {**BARRIER, 'start_after': ['first']})
    assert plant.wrench_timeout == 30.0
    listening(peer)
    peer.spin(plant_node.MET + 0.2)
    assert not peer.heard['odom']

    asked = []

    def answer(request, response):
        asked.append(True)
        return ready(request, response) if len(asked) > 3 else response

    peer.node.create_service(Trigger, 'first/ready', answer)
    assert step_of(odometry(peer, 1)[0]) == 0
    assert len(asked) == 4, 'it was not ready when it was asked before'
    assert peer.call(Trigger, 'plant_node/ready').success


def test_run_names_the_first_node_that_is_not_ready(peer) -> None:
    peer.add(PlantNode, {**BARRIER, 'start_after': ['first', 'second'], 'start_paused': True})
    listening(peer)

    def ask():
        return peer.call(SetBool, 'plant_node/run', SetBool.Request(data=True))

    assert ask().message == 'first'
    told = peer.call(Trigger, 'plant_node/ready')
    assert (told.success, 'first' in told.message) == (False, True)
    peer.node.create_service(Trigger, 'first/ready', ready)
    peer.until(lambda: ask().message == 'second', 'the second to be named')
    assert not peer.heard['odom']
    peer.node.create_service(Trigger, 'second/ready', ready)
    peer.until(lambda: ask().success, 'consent')
    assert peer.call(Trigger, 'plant_node/ready').success
    assert step_of(odometry(peer, 1)[0]) == 0


def test_a_pause_holds_the_next_step(peer) -> None:
    plant = peer.add(PlantNode, {**BARRIER, 'wrench_timeout': patience(1.0)})
    listening(peer)
    odometry(peer, 1)
    assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=False)).success
    peer.publish(topics.WRENCH, wrench(0))
    peer.spin(patience(1.3))
    assert len(peer.heard['odom']) == 1
    assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=True)).success
    assert step_of(odometry(peer, 2)[1]) == 1
    for data in (False, True):  # a controller has as long after a pause as before it
        assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=data)).success
        peer.spin(patience(0.6))
    assert plant.exit_code is None
    answered(peer, 1, 2)
    odometry(peer, 4)


def test_silence_ends_the_run_and_is_named(peer, capfd) -> None:
    plant = peer.add(PlantNode, {**BARRIER, 'wrench_timeout': patience(0.5)})
    listening(peer)
    odometry(peer, 1)
    peer.until(lambda: plant.exit_code is not None, 'the end')
    assert plant.exit_code == 1
    assert 'no answer on wrench to step 0 for' in (said := capfd.readouterr().err)
    assert 'its publisher: no controller' in said


def test_whose_steps_are_all_answered_waits_for_its_recorder(peer) -> None:
    short = {'duration': 0.01, 'recorder_window': 5, 'wrench_timeout': patience(0.4)}
    plant = peer.add(PlantNode, {**BARRIER, **short})
    listening(peer)
    odometry(peer, 1)
    answered(peer, 0, 2)
    peer.spin(patience(0.8))
    assert plant.exit_code is None


def test_a_controller_that_falls_silent_ends_the_run_and_is_named(peer, capfd) -> None:
    plant = peer.add(PlantNode, {**BARRIER, 'wrench_timeout': patience(1.0)})
    listening(peer)
    for k in range(2):
        odometry(peer, k + 1)
        peer.spin(patience(0.6))
        answered(peer, k, 1)
    assert plant.exit_code is None, 'each step has its own wait'
    odometry(peer, 3)
    peer.until(lambda: plant.exit_code is not None, 'the end')
    assert plant.exit_code == 1
    said = capfd.readouterr().err
    assert f'no answer on wrench to step 2 for {patience(1.0):g} s; ' in said
    assert '; its publisher: test_peer' in said


def test_who_has_lost_its_name_is_named_as_before(peer, capfd) -> None:
    quiet = {'wrench_timeout': patience(1.0), 'publish_clock': False}
    plant = peer.add(PlantNode, {**BARRIER, **quiet})
    names = ['two', 'one']
    listening(peer)
    odometry(peer, 1)
    plant.get_publishers_info_by_topic = lambda _: [
        SimpleNamespace(node_name=name, node_namespace='', topic_type='') for name in names
    ]
    peer.spin(0.5)
    names[0] = UNNAMED
    peer.until(lambda: plant.exit_code is not None, 'the end')
    assert '; its publisher: one, two\n' in capfd.readouterr().err


def test_a_reset_between_two_steps_is_seen_at_the_next(peer) -> None:
    plant = peer.add(PlantNode, BARRIER)
    listening(peer)
    answered(peer, 0, 2)
    odometry(peer, 3)
    assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=False)).success
    answered(peer, 2, 1)
    peer.until(lambda: plant.plant.k == 3, 'the answer')
    assert peer.call(Trigger, 'plant_node/reset').message.endswith('from step 3')
    assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=True)).success
    answered(peer, 3, 1)
    first, _, _, back, on = (m.pose.pose.position.z for m in odometry(peer, 5)[:5])
    assert first == back != on


def test_silence_of_the_recorder_ends_the_run_and_is_named(peer, capfd) -> None:
    plant = peer.add(PlantNode, {**BARRIER, 'recorder_window': 2, 'wrench_timeout': patience(1.0)})
    listening(peer)
    peer.node.create_publisher(topics.PROGRESS.type, topics.PROGRESS.name, 1)
    answered(peer, 0, 2)
    peer.until(lambda: plant.exit_code is not None, 'the end')
    assert plant.exit_code == 1
    said = capfd.readouterr().err
    assert f'no answer on recorder/progress to step 2 for {patience(1.0):g} s; ' in said
    assert '; its publisher: test_peer' in said


def test_without_recorder_it_ends_with_the_last_wrench(peer) -> None:
    plant = peer.add(PlantNode, {**BARRIER, 'duration': 0.03})
    listening(peer)
    answered(peer, 0, 3)
    odometry(peer, 4)
    peer.spin(0.1)
    assert plant.exit_code is None, 'the last step is not answered yet'
    answered(peer, 3, 1)
    peer.until(lambda: plant.exit_code is not None, 'the end')
    assert plant.exit_code == 0
    peer.until(lambda: len(peer.heard['disturbance']) == 4, 'the last disturbance')


def test_credit_holds_the_plant_while_the_recorder_is_behind(peer) -> None:
    shallow = {'qos_overrides./clock.publisher.depth': 1}  # which no step waits for
    plant = peer.add(PlantNode, {**BARRIER, **shallow, 'recorder_window': 2, 'duration': 0.05})
    listening(peer)
    answered(peer, 0, 2)  # ack is -1: steps 0 and 1 are free
    peer.spin(0.2)
    assert len(peer.heard['odom']) == 2

    def acknowledged(k: int) -> None:
        peer.publish(topics.PROGRESS, topics.PROGRESS.type(stamp=convert.stamp(k * STEP)))

    acknowledged(0)
    assert step_of(odometry(peer, 3)[2]) == 2
    acknowledged(2)
    acknowledged(1)  # an old word takes nothing back
    answered(peer, 2, 3)
    peer.spin(0.2)
    assert len(peer.heard['odom']) == 5
    acknowledged(5)
    answered(peer, 5, 1)
    peer.until(lambda: len(peer.heard['disturbance']) == 6, 'the last wrench')
    acknowledged(5)
    peer.spin(0.1)
    peer.publish(topics.WRENCH, wrench(5))
    peer.until(lambda: plant.graph.refused.total() == 1, 'a second answer to be refused')
    assert len(peer.heard['disturbance']) == 6
    assert plant.exit_code is None, 'it is the recorder that ends the run'


def test_a_reset_in_real_time_puts_the_vehicle_back_at_once(peer) -> None:
    start = [1.0, 2.0, 3.0, 0.0, 0.0, 0.5]
    plant = peer.add(PlantNode, {'vehicle': 'herman2018', 'initial.eta': start})
    assert plant.wrench_timeout == 0.5
    listening(peer)
    odometry(peer, 20)

    def reset() -> tuple[int, list[tuple[int, float]]]:
        answer = peer.call(Trigger, 'plant_node/reset')
        assert answer.success
        step = int(answer.message.removeprefix('state of the start from step '))
        peer.until(lambda: step_of(peer.heard['odom'][-1]) >= step, 'the state of the start')
        return step, [(step_of(m), m.pose.pose.position.z) for m in peer.heard['odom']]

    # a message that was lost on the way shows that something stood still
    step, heard = undisturbed(reset, lambda found: found[0] in dict(found[1]), lambda _: True)
    steps, depths = zip(*heard, strict=True)
    at = steps.index(step)
    assert abs(depths[at] - 3.0) < 1e-6 < abs(depths[at - 1] - 3.0), 'it rises, being light'
    assert [*steps] == sorted(set(steps)), 'the time goes on'


REAL = [*parameters(vehicle='herman2018_neutral'), '-p', 'expected_subscribers:=["odom=1"]']


def test_a_short_pause_in_real_time_is_made_up_for() -> None:
    """Else its stamps stay behind, and a controller with a clock of its own takes them for old."""
    with graph(('plant_node', REAL)) as (peer, processes):
        peer.listen(topics.ODOM)
        first, began = step_of(odometry(peer, 3)[-1]), time.monotonic()
        processes['plant_node'].send_signal(signal.SIGSTOP)
        peer.spin(0.8)
        processes['plant_node'].send_signal(signal.SIGCONT)

        def behind() -> float:
            return 100 * (time.monotonic() - began) - step_of(peer.heard['odom'][-1]) + first

        peer.until(lambda: behind() < 60, 'that the 80 steps of the pause are made up for')
        _, output = stop(processes['plant_node'])
    assert ' s late' not in output


def test_a_pause_in_real_time_is_bounded_and_said() -> None:
    with graph(('plant_node', REAL)) as (peer, processes):
        listening(peer)
        before = step_of(odometry(peer, 3)[-1])
        process = processes['plant_node']
        process.send_signal(signal.SIGSTOP)
        peer.spin(3.0)
        process.send_signal(signal.SIGCONT)
        count = len(peer.heard['odom'])
        after = step_of(odometry(peer, count + 3)[count + 2])
        code, output = stop(process)
    assert after - before < 250, 'three seconds are not made up for'
    said = re.findall(r' ([\d.]+) s late: time goes on from step (\d+)\n', output)
    assert all(float(late) > 1.0 for late, _ in said)
    assert any(before <= int(step) <= after for _, step in said)  # it may be late before as well
    assert code == 0


def test_real_time_ends_where_the_loop_diverges() -> None:
    with graph(('plant_node', REAL)) as (peer, processes):
        listening(peer)
        newest = step_of(odometry(peer, 1)[-1])
        peer.publish(topics.WRENCH, wrench(newest, (1e7, 0, 0, 0, 0, 0)))
        peer.until(lambda: processes['plant_node'].poll() is not None, 'the end')
        code, output = stop(processes['plant_node'])
    assert code == 1
    assert 'diverges' in output


def test_lock_step_ends_where_the_loop_diverges(peer, capfd) -> None:
    plant = peer.add(PlantNode, BARRIER)
    listening(peer)
    odometry(peer, 1)
    peer.publish(topics.WRENCH, wrench(0, (1e9, 0, 0, 0, 0, 0)))
    peer.until(lambda: plant.exit_code is not None, 'the end')
    assert plant.exit_code == 1
    assert 'after step 0: the closed loop diverges' in capfd.readouterr().err
    peer.until(lambda: peer.heard['disturbance'], 'what opposed it')
    assert step_of(peer.heard['disturbance'][0]) == 0
    assert len(peer.heard['odom']) == 1


def test_a_second_clock_is_refused_by_who_comes_later() -> None:
    domain = fresh_domain()
    with graph(('plant_node', REAL), domain=domain) as (peer, processes):
        peer.listen(topics.ODOM, topics.DIAGNOSTICS)
        odometry(peer, 350)  # it is no newcomer any more
        second = [*parameters(vehicle='herman2018_neutral'), '-r', '__ns:=/two']
        late = start_node('plant_node', domain, *second)
        code, said = late.wait(PATIENCE), late.communicate()[0]
        # on a busy machine it may have begun before it met the other, which its log then says
        rest = '\n'.join(line for line in said.splitlines() if not line.startswith('[INFO]'))
        assert_one_line(CompletedProcess([], code, rest), 'publish_clock', '/plant_node')
        beside = start_node('plant_node', domain, *second, *parameters(publish_clock=False))
        said = peer.heard[topics.DIAGNOSTICS.name]
        two = topics.Topic('two/odom', topics.ODOM.type)
        peer.listen(two)
        peer.until(lambda: len(peer.heard[two.name]) > 20, 'odometry of the second')
        peer.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 1)
        crowd = '/clock: expected one publisher, found /plant_node, /test_peer'
        peer.until(lambda: crowd in said[-1].status[0].message, 'an error')
        assert processes['plant_node'].poll() is None
        assert stop(beside)[0] == 0


@pytest.mark.parametrize(
    ('arguments', 'key', 'expected'),
    [
        ([], 'vehicle', 'a vehicle file'),
        (parameters(vehicle='herman2018', step=-1.0), 'step', 'a number from'),
        (parameters(vehicle='herman2018', step=1e-10), 'step', 'a number from'),
        (parameters(vehicle='herman2018', duration=1.005), 'duration', 'a multiple of step'),
        (parameters(vehicle='herman2018', integrator='ode45'), 'integrator', 'ode5, rk4, euler'),
        (parameters(vehicle='herman2018', recorder_window=3000), 'recorder_window', '2999'),
        (parameters(vehicle='herman2018', colour='red'), 'colour', 'one of'),
        (parameters(vehicle='herman2018', initial__eta='[1.0]'), 'initial.eta', '6 finite'),
        (
            [
                *parameters(vehicle='herman2018', recorder_window=50),
                '-p',
                'qos_overrides./odom.publisher.depth:=50',
            ],
            'qos_overrides./odom.publisher.depth',
            'more than 50',
        ),
        (
            [*parameters(vehicle='herman2018'), '-p', 'disturbance.names:=["a"]'],
            'disturbance.a.kind',
            'herman2018, harmonic',
        ),
    ],
)
def test_wrong_parameters_end_in_one_line(arguments: list[str], key: str, expected: str) -> None:
    assert_refused(PlantNode, arguments, key, expected)


def test_real_time_withholds_a_lost_sample() -> None:
    extra = parameters(vehicle='herman2018', duration=2.0, sensors__drop_out=0.5, seed=1)
    extra += ['-p', 'expected_subscribers:=["odom=1", "ground_truth/odom=1"]']
    with graph(('plant_node', extra)) as (peer, _):
        peer.listen(topics.ODOM, topics.GROUND_TRUTH)
        truth = peer.heard['ground_truth/odom']
        peer.until(lambda: truth and step_of(truth[-1]) == 200, 'the end')
        peer.spin(0.2)
        seen = {step_of(m) for m in truth}
        measured = {step_of(m) for m in peer.heard['odom']}
        measured -= {*range(min(seen))}  # before the truth was listened to
        assert measured < seen
        assert 0.3 < len(measured) / len(seen) < 0.7


@pytest.mark.parametrize(
    ('extra', 'words'),
    [
        ({'actuators__limit': '[1.0, 2.0]'}, ('actuators.limit', 'number or 6')),
        ({'actuators__rate': '[-1.0]'}, ('actuators.rate', 'positive')),
        ({'actuators__delay': 0.0123}, ('actuators.delay', 'multiple of step')),
        ({'actuators__thrusters': True}, ('actuators.thrusters', 'thrusters')),
        ({'sensors__drop_out': 2.0}, ('sensors.drop_out', '2.0')),
        ({'sensors__velocity_noise': '[-0.1]'}, ('sensors.velocity_noise', 'from 0')),
        (
            {'disturbance__names': '["a"]', 'disturbance__a__kind': 'model_error',
             'disturbance__a__mass': 0.1},
            ('disturbance.a.mass', 'dM and dD'),
        ),
        (
            {'disturbance__names': '["a"]', 'disturbance__a__kind': 'current',
             'disturbance__a__velocity': '[1.0, 2.0]'},
            ('disturbance.a.velocity', '3 numbers'),
        ),
    ],
)  # fmt: skip
def test_wrong_uncertainty_ends_with_one_line(extra, words) -> None:
    lockstep = parameters(**LOCKSTEP)
    assert_refused(PlantNode, [*lockstep, *parameters(**extra)], *words)


def test_to_run_starts_no_plant_beside_another_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    other = SimpleNamespace(node_name='other', node_namespace='')
    monkeypatch.setattr(plant_node, 'other_publishers', lambda *_: [other])
    with program() as made:
        plant = made.add(PlantNode, {'vehicle': 'herman2018', 'start_paused': True})
        answer = plant._on_run(SetBool.Request(data=True), SetBool.Response())
        assert (answer.message, plant.plant.k, plant.exit_code) == ('running', 0, 2)


def test_another_clock_may_wait_for_its_name(monkeypatch: pytest.MonkeyPatch, capfd) -> None:
    others: list[SimpleNamespace] = []
    monkeypatch.setattr(plant_node, 'other_publishers', lambda *_: others)
    with program() as made:
        plant = made.add(PlantNode, {'vehicle': 'herman2018', 'start_paused': True})
        begin = plant_node.NEW + time.monotonic()
        assert plant._is_only_clock(begin)
        others.append(SimpleNamespace(node_name=UNNAMED, node_namespace=''))
        assert not plant._is_only_clock(begin + 0.9 * plant_node.NEW)
        assert plant.exit_code is None
        for _ in range(2):
            assert not plant._is_only_clock(begin + plant_node.NEW)
            assert plant.exit_code == 2
    assert capfd.readouterr().err.count('publish_clock') == 1
