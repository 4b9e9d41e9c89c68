"""A replay beside a vehicle: it gets no recorded command unless somebody says so, and no clock."""

import math
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from geometry_msgs.msg import Twist, Wrench
from helpers.made_messages import ODOMETRY, Bag, geometry, odometry, serialized, stamped
from helpers.node_processes import assert_one_line, graph, parameters, run_node, stop
from helpers.nodes_in_process import program
from helpers.played_bags import STATE, STEP, ended, made, playing, process, steps_of, there
from rclpy.qos import DurabilityPolicy
from std_srvs.srv import Trigger

from auv_analysis.bag.reading import read_bag
from auv_analysis.nodes import replay_node, replay_publishers
from auv_analysis.nodes.replay_node import ReplayNode
from auv_analysis.nodes.replay_publishers import CommandGuard
from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import NAMELESS, UNNAMED
from auv_dynamics.ros.interface import RECORDER, nanoseconds
from auv_dynamics.ros.topics import Topic

ODOM = there(topics.ODOM)
AS_RECORDED = {'original_names': True, 'commands': True}
NEVER = '-p', 'expected_subscribers:=["odom=2"]'  # it meets others until it finds what it refuses
WAITS = {name: getattr(replay_node, name) for name in ('DISCOVERY', 'ANNOUNCED')}  # s
COMMAND_ALONE = {**AS_RECORDED, 'topics': ['/wrench']}
FORCED = {**AS_RECORDED, 'allow_commands_to_foreign': True, 'rate': 0.0}


def test_a_foreign_listener_gets_no_command(tmp_path: Path) -> None:
    with process(made(tmp_path / 'bag'), *NEVER, **AS_RECORDED, rate=0.0) as (peer, replay):
        peer.listen(topics.ODOM, topics.WRENCH, topics.CLOCK)
        assert ended(peer, replay) == 2
        _, output = stop(replay)
    assert len(output.strip().splitlines()) == 1, output
    assert '/wrench: expected nobody who acts on recorded commands, found /test_peer' in output
    assert not any(peer.heard.values()), 'nothing is published'


@pytest.mark.parametrize(('asked', 'wait'), [
    ({}, 'DISCOVERY'), ({'original_names': True}, 'ANNOUNCED'), (COMMAND_ALONE, 'ANNOUNCED'),
    ({**COMMAND_ALONE, 'allow_commands_to_foreign': True}, 'DISCOVERY'),
], ids=str)  # fmt: skip
def test_others_are_looked_for_until_a_lost_announcement_comes_again(
    asked: dict, wait: str, tmp_path: Path
) -> None:
    """Where the vehicle may be among them: Fast DDS repeats one after 3 s."""
    with program() as peer, pytest.MonkeyPatch.context() as patch:
        for name, seconds in WAITS.items():
            patch.setattr(replay_node, name, seconds)  # as for a user
        begins = time.monotonic()
        node = peer.add(ReplayNode, {'bag': str(made(tmp_path / 'bag')), **asked})
        assert begins <= node._until - WAITS[wait] <= time.monotonic()
    assert WAITS['ANNOUNCED'] > 3.0 > WAITS['DISCOVERY'] > 0.0


def test_commands_stop_when_a_foreign_listener_comes(tmp_path: Path) -> None:
    with process(made(tmp_path / 'bag', 1000), **AS_RECORDED, rate=4.0) as (peer, replay):
        peer.listen(topics.ODOM)
        peer.until(lambda: len(peer.heard['odom']) > 10, 'odometry')
        peer.listen(topics.WRENCH)
        assert ended(peer, replay) == 1
        peer.until(lambda: steps_of(peer, topics.ODOM)[-1] == 999, 'the rest')
        _, output = stop(replay)
    assert 'commands are not published any more: /test_peer on /wrench' in output
    assert len(peer.heard['wrench']) <= 1, 'one may leave while the listener is being discovered'


def test_our_own_observers_are_no_strangers(tmp_path: Path) -> None:
    recorder = parameters(bag=tmp_path / 'again', strict=False, topics='[odom, wrench, cmd_vel]')
    waits = ('-p', 'expected_subscribers:=["wrench=1", "odom=1"]')
    played = [*parameters(bag=made(tmp_path / 'bag'), **AS_RECORDED, rate=0.0), *waits]
    with graph(('recorder_node', recorder), ('replay_node', played)) as (peer, processes):
        assert ended(peer, processes['replay_node']) == 0
        assert stop(processes['recorder_node'])[0] == 0
    counts = read_bag(tmp_path / 'again', decode=False).counts
    assert counts['/wrench'] == counts['/odom'] == counts['/clock'] == 50


def test_commands_to_a_vehicle_end_with_a_zero_wrench(tmp_path: Path) -> None:
    """Only on demand; a vehicle is not left with the last wrench of a bag."""
    with playing(made(tmp_path / 'bag'), **FORCED) as (peer, replay):
        peer.listen(topics.WRENCH)
        assert ended(peer, replay) == 0
        replay.close()
        peer.until(lambda: len(peer.heard['wrench']) == 51, 'the zero wrench')
    forces = [message.wrench.force.x for message in peer.heard['wrench']]
    assert forces == [*map(float, range(50)), 0.0]
    assert nanoseconds(peer.heard['wrench'][-1].header.stamp) == 49 * STEP


def test_a_wrench_that_is_not_finite_is_refused(tmp_path: Path, capfd) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    for k, value in enumerate((1.0, float('nan'), 3.0)):
        data = serialized(stamped('Wrench', k * STEP, (value,) * 6))
        bag.add('/wrench', 'geometry_msgs/msg/WrenchStamped', k * STEP, data)
    bag.add('/wrench', 'geometry_msgs/msg/WrenchStamped', 3 * STEP, b'\0\1\0\0')
    with playing(bag.close(), **FORCED) as (peer, replay):
        peer.listen(topics.WRENCH)
        assert ended(peer, replay) == 0
        peer.until(lambda: len(peer.heard['wrench']) == 2, 'two wrenches')
    assert [message.wrench.force.x for message in peer.heard['wrench']] == [1.0, 3.0]
    error = capfd.readouterr().err
    assert '/wrench: not finite: expected finite numbers' in error
    assert '/wrench: not a message: expected a serialized WrenchStamped' in error


@pytest.mark.parametrize('root', ['', 'auv1/'])
def test_without_commands_a_vehicle_hears_none(tmp_path: Path, root: str) -> None:
    names = {'namespace': root.strip('/')} if root else {'original_names': True}
    with playing(made(tmp_path / 'bag'), **names, rate=0.0) as (peer, replay):
        assert replay.remarks() == [
            'left out: /cmd_vel, /wrench: a command outside of /replay; --commands publishes it'
        ]
        odom, wrench = (
            topics.Topic(f'{root}{t.name}', t.type) for t in (topics.ODOM, topics.WRENCH)
        )
        peer.listen(odom, wrench)
        assert ended(peer, replay) == 0
        peer.until(lambda: len(peer.heard[odom.name]) == 50, 'odometry')
    assert len(peer.heard[odom.name]) == 50
    assert peer.heard[wrench.name] == []


def test_a_remapping_does_not_smuggle_commands(tmp_path: Path) -> None:
    remapped = '-r', 'replay/wrench:=/wrench', '-p', 'expected_subscribers:=["odom=1"]'
    with process(made(tmp_path / 'bag'), *remapped, rate=0.0) as (peer, replay):
        peer.listen(topics.WRENCH, ODOM)
        assert ended(peer, replay) == 0
        peer.until(lambda: len(peer.heard[ODOM.name]) == 50, 'odometry')
        _, output = stop(replay)
    assert peer.heard['wrench'] == []
    assert len(peer.heard[ODOM.name]) == 50
    assert 'left out: /wrench: a command outside of /replay' in output
    assert f'begins: plays {tmp_path / "bag"}' in output


def test_there_is_one_clock(tmp_path: Path) -> None:
    with process(made(tmp_path / 'bag'), *NEVER) as (peer, replay):
        peer.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 10)
        peer.listen(ODOM)
        assert ended(peer, replay) == 2
        _, output = stop(replay)
    assert '/clock: expected no other publisher' in output
    assert 'found /test_peer' in output
    assert peer.heard[ODOM.name] == []


def test_a_second_clock_ends_the_replay(tmp_path: Path) -> None:
    with playing(made(tmp_path / 'bag'), rate=0.01) as (peer, replay):
        peer.listen(ODOM)
        peer.until(lambda: peer.heard[ODOM.name], 'odometry')
        peer.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 10)
        assert ended(peer, replay) == 1
        assert '/clock: expected no other publisher' in replay.failure


def test_a_clock_of_a_node_without_a_name_is_another_one_unless_the_name_comes(
    tmp_path: Path, monkeypatch
) -> None:
    unnamed = SimpleNamespace(node_name=UNNAMED, node_namespace='/')
    others = [unnamed]
    monkeypatch.setattr(replay_node, 'other_publishers', lambda node, topic: others)
    with playing(made(tmp_path / 'bag'), start_paused=True) as (peer, replay):
        assert replay._rival(3.0) is None
        others.clear()
        assert replay._rival(3.5) is None
        others.append(unnamed)  # another one
        assert [replay._rival(now) is None for now in (5.0, 5.9, 6.0)] == [True, True, False]
        monkeypatch.setattr(replay_node, 'NAMED', math.inf)
        peer.until(lambda: replay.playing or replay.exit_code is not None, 'the replay')
        assert replay.exit_code is None
        monkeypatch.setattr(replay_node, 'NAMED', 0.0)
        assert ended(peer, replay) == 1
        assert replay.failure.startswith('replay_node: /clock: expected no other publisher')
        assert NAMELESS in replay.failure


def test_beside_another_clock_it_plays_without_its_own(tmp_path: Path) -> None:
    with playing(made(tmp_path / 'bag'), clock=False, rate=0.0) as (peer, replay):
        peer.node.create_publisher(topics.CLOCK.type, topics.CLOCK.name, 10)
        peer.listen(topics.CLOCK)
        assert ended(peer, replay) == 0
    assert peer.heard[topics.CLOCK.name] == []


@pytest.mark.parametrize('root', ['', 'replay/'])
def test_no_odometry_beside_that_of_a_vehicle(tmp_path: Path, root: str) -> None:
    """Its controller would believe both; in the namespace of the replay there is none."""
    with playing(made(tmp_path / 'bag'), original_names=not root, rate=0.0) as (peer, replay):
        peer.node.create_publisher(topics.ODOM.type, f'{root}odom', 10)
        peer.listen(there(topics.ODOM) if root else topics.ODOM)
        assert ended(peer, replay) == (0 if root else 2)
    assert root or peer.heard['odom'] == []


def test_a_listener_without_a_name_gets_no_command_before_it_has_one(monkeypatch) -> None:
    unnamed, ours = (SimpleNamespace(node_name=n, node_namespace='/') for n in (UNNAMED, RECORDER))
    ours.qos_profile = topics.every_step()
    found: list = []
    monkeypatch.setattr(replay_publishers, 'other_subscribers', lambda node, topic: found)
    complaints: list[str] = []
    node = SimpleNamespace(get_name=lambda: 'replay', count_subscribers=lambda topic: len(found))
    node.graph = SimpleNamespace(complain=complaints.append)
    wrench = {'/wrench': SimpleNamespace(topic_name='/wrench')}
    guard = CommandGuard(node, wrench, False)
    assert guard.may('/wrench', 0.0)
    found.append(unnamed)
    assert guard.refusal(final=False) is None
    assert NAMELESS in str(guard.refusal(final=True))
    assert guard.may('/wrench', 1.0) is None
    assert guard.may('/wrench', 1.9) is None
    found[:] = [ours]
    assert guard.may('/wrench', 1.9)
    found[:] = [unnamed]  # in its place: their number tells nothing
    guard.look(5.0)
    assert guard.may('/wrench', 5.9) is None
    assert not complaints
    assert guard.may('/wrench', 6.0) is False
    assert complaints == [f'commands are not published any more: {NAMELESS} on /wrench']


def test_a_command_is_kept_for_nobody_who_comes_late(tmp_path: Path) -> None:
    bag, kind = Bag(tmp_path / 'bag.mcap'), 'geometry_msgs/msg/WrenchStamped'
    schema = bag._writer.register_schema(kind, 'ros2msg', b'Wrench wrench')
    kept = {'offered_qos_profiles': '[{durability: transient_local, depth: 1}]'}
    channel = bag._writer.register_channel('/wrench', 'cdr', schema, kept)
    bag._writer.add_message(channel, 0, serialized(stamped('Wrench', 0, (1.0,) * 6)), 0)
    with playing(bag.close(), **FORCED, start_paused=True) as (peer, _):
        ends = peer.node.get_publishers_info_by_topic
        (end,) = peer.until(lambda: ends('/wrench'), 'its publisher')
    assert end.qos_profile.durability == DurabilityPolicy.VOLATILE


def test_wrong_input_is_one_line(tmp_path: Path) -> None:
    assert_one_line(run_node('replay_node', *parameters(bag=tmp_path / 'none')), 'none')


def test_what_has_no_header_is_checked_and_let_go_as_well(tmp_path: Path, capfd) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    for k, value in enumerate((1.0, float('nan'), 3.0)):
        halves = geometry('Vector3', value, 0.0, 0.0), geometry('Vector3', 0.0, 0.0, value)
        for topic, kind in (('/wrench', 'Wrench'), ('/cmd_vel', 'Twist')):
            data = serialized(geometry(kind, *halves))
            bag.add(topic, f'geometry_msgs/msg/{kind}', k * STEP, data)
    bag.add('/setpoint', ODOMETRY, 0, serialized(odometry(0, STATE)))  # with frames of its own
    schema = bag._writer.register_schema('sonar_msgs/msg/Ping', 'ros2msg', b'uint8 x')
    bag._writer.register_channel('/thrusters', 'cdr', schema)  # which cannot be published
    plain = Topic('wrench', Wrench), Topic('cmd_vel', Twist), Topic('setpoint', topics.ODOM.type)
    with playing(bag.close(), **FORCED) as (peer, replay):
        peer.listen(*plain)
        assert ended(peer, replay) == 0
        replay.close()
        peer.until(lambda: len(peer.heard['wrench']) == 3, 'two wrenches and a zero')
        peer.until(lambda: len(peer.heard['cmd_vel']) == 2, 'two velocities')
        peer.until(lambda: peer.heard['setpoint'], 'a set-point')
    assert [message.force.x for message in peer.heard['wrench']] == [1.0, 3.0, 0.0]
    assert [message.linear.x for message in peer.heard['cmd_vel']] == [1.0, 3.0]
    error = capfd.readouterr().err
    assert '/wrench: not finite: expected finite numbers' in error
    assert '/cmd_vel: not finite: expected finite numbers' in error


def test_a_vehicle_is_not_left_with_the_wrench_of_a_step(tmp_path: Path) -> None:
    with playing(made(tmp_path / 'bag'), **FORCED, start_paused=True) as (peer, replay):
        peer.listen(topics.WRENCH)
        peer.until(lambda: replay.playing, 'the replay')
        for k in range(3):
            assert peer.call(Trigger, 'replay_node/step', once=True).success
            peer.until(lambda k=k: len(peer.heard['wrench']) == 2 * (k + 1), 'a zero wrench')
    forces = [message.wrench.force.x for message in peer.heard['wrench']]
    assert forces == [0.0, 0.0, 1.0, 0.0, 2.0, 0.0]
