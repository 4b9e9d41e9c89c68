"""The replay node: everything again, in order and in time, as long as there is room for it."""

import signal
import struct
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.made_messages import STRING, Bag, new, odometry, serialized
from helpers.node_processes import (
    CONTROLLER,
    PATIENCE,
    Peer,
    fresh_domain,
    parameters,
    start_node,
    stop,
)
from helpers.played_bags import (
    STATE,
    STEP,
    ended,
    fill,
    made,
    odometry_alone,
    playing,
    process,
    steps_of,
    there,
)
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from auv_analysis.bag.reading import read_bag
from auv_analysis.bag.step_topics import ODOMETRY
from auv_analysis.nodes import replay_node, replay_publishers
from auv_analysis.nodes.replay_node import ReplayNode
from auv_analysis.nodes.replay_publishers import offered_again
from auv_analysis.replay.played_bag import PlayedMessage
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import topics
from auv_dynamics.ros.interface import DEPTH, nanoseconds

ODOM, WRENCH, CMD_VEL = there(topics.ODOM), there(topics.WRENCH), there(topics.CMD_VEL)
REMARK = topics.Topic('replay/remark', String)
WAITS = {'expected_subscribers': ['odom=1', '/wrench=1', 'cmd_vel=1']}
SLOW = 0.001  # rate at which 10 ms take ten seconds


def clocks(peer: Peer) -> list[int]:
    return [nanoseconds(message.clock) // STEP for message in peer.heard[topics.CLOCK.name]]


def set_rate(peer: Peer, rate: float) -> None:
    value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=rate)
    request = SetParameters.Request(parameters=[Parameter(name='rate', value=value)])
    answer = peer.call(SetParameters, 'replay_node/set_parameters', request)
    assert answer.results[0].successful


def asks(replay: ReplayNode) -> bool:
    """Whether there is somebody who says what he has taken."""
    clients = replay.player.receivers._clients.values()
    return any(client.service_is_ready() for client in clients)


def all_heard(peer: Peer, count: int, *heard: topics.Topic) -> None:
    """Wait for what is still under way to the peer, which cannot be asked."""
    peer.until(lambda: all(len(peer.heard[t.name]) >= count for t in heard), f'{count} messages')


@pytest.mark.parametrize('files', [1, 3])
def test_plays_everything_in_order(tmp_path: Path, files: int) -> None:
    with playing(made(tmp_path / 'bag', 300, files), **WAITS, rate=0.0) as (peer, replay):
        peer.listen(ODOM, WRENCH, CMD_VEL, REMARK, topics.CLOCK)
        assert ended(peer, replay) == 0
        all_heard(peer, 300, ODOM, WRENCH, CMD_VEL, REMARK, topics.CLOCK)
    for topic in (ODOM, WRENCH, CMD_VEL):
        assert steps_of(peer, topic) == list(range(300)), topic.name
    assert [m.data for m in peer.heard[REMARK.name]][-1] == 'step 299'
    assert clocks(peer) == list(range(300))
    assert peer.heard[WRENCH.name][7].wrench.torque.z == 7.0


def test_keeps_to_the_barrier(tmp_path: Path) -> None:
    with playing(made(tmp_path / 'bag'), **WAITS, rate=0.0) as (peer, replay):
        peer.listen(ODOM, topics.CLOCK)
        peer.until(lambda: 'wrench' in peer.call(Trigger, 'replay_node/ready').message, 'odom')
        assert not peer.call(Trigger, 'replay_node/ready').success
        tool = Node('rosbag2_recorder', context=peer.context)
        for topic in (WRENCH, CMD_VEL):
            tool.create_subscription(topic.type, topic.name, print, 10)
        peer.spin(1.5)
        assert peer.heard == {ODOM.name: [], topics.CLOCK.name: []}, 'tools are not waited for'
        peer.listen(WRENCH, CMD_VEL)
        assert ended(peer, replay) == 0
        tool.destroy_node()
        all_heard(peer, 50, ODOM, WRENCH)
    assert steps_of(peer, ODOM) == steps_of(peer, WRENCH) == list(range(50))


def test_steps_pauses_and_goes_on(tmp_path: Path) -> None:
    bag = made(tmp_path / 'bag')
    with playing(bag, **WAITS, start_paused=True, rate=0.0) as (peer, replay):
        peer.listen(ODOM, WRENCH, CMD_VEL, topics.CLOCK)
        peer.until(lambda: peer.call(Trigger, 'replay_node/ready').success, 'the peer')
        assert peer.call(Trigger, 'replay_node/step').message == 'to 0 s of the bag'
        peer.until(lambda: len(peer.heard[WRENCH.name]) == 1, 'step 0')
        assert peer.call(Trigger, 'replay_node/step').success
        peer.until(lambda: len(peer.heard[WRENCH.name]) == 2, 'step 1')
        peer.spin(0.3)
        assert steps_of(peer, ODOM) == steps_of(peer, CMD_VEL) == clocks(peer) == [0, 1]
        set_rate(peer, SLOW)
        assert peer.call(SetBool, 'replay_node/run', SetBool.Request(data=True)).success
        answer = peer.call(Trigger, 'replay_node/step')
        assert (answer.success, answer.message) == (False, 'not paused')
        peer.call(SetBool, 'replay_node/run', SetBool.Request(data=False))
        set_rate(peer, 0.0)
        peer.spin(0.3)
        assert steps_of(peer, ODOM) == [0, 1], 'paused'
        peer.call(SetBool, 'replay_node/run', SetBool.Request(data=True))
        assert ended(peer, replay) == 0
        all_heard(peer, 50, ODOM)
    assert steps_of(peer, ODOM) == list(range(50))


def test_keeps_the_time_of_the_bag(tmp_path: Path) -> None:
    with playing(made(tmp_path / 'bag'), **WAITS, rate=SLOW) as (peer, replay):
        peer.listen(ODOM, WRENCH, CMD_VEL)
        peer.until(lambda: len(peer.heard[WRENCH.name]) == 1, 'step 0')
        peer.spin(0.5)
        assert steps_of(peer, ODOM) == [0], 'step 1 is due after ten seconds'
        set_rate(peer, 10.0)
        assert ended(peer, replay) == 0
        all_heard(peer, 50, ODOM)
    assert steps_of(peer, ODOM) == list(range(50))


def test_names_gaps_and_jumps_over_them(tmp_path: Path) -> None:
    """A bag with an odometry of two epochs; nobody waits for decades."""
    bag = Bag(tmp_path / 'bag.mcap')
    for k in (0, 1, 10**11, 10**11 + 1):
        bag.add('/odom', ODOMETRY, k * STEP, serialized(odometry(k * STEP, STATE)))
    values = {'expected_subscribers': ['odom=1'], 'skip_gaps': True}
    with playing(bag.close(), **values) as (peer, replay):
        peer.listen(ODOM, topics.CLOCK)
        assert ended(peer, replay) == 0
        all_heard(peer, 4, ODOM)
        assert 'nothing from 0.01 to 1e+09 s of the bag' in ' '.join(replay.remarks())


@pytest.mark.parametrize(
    ('skip', 'then'), [(False, '--skip-gaps jumps over it'), (True, 'jumped over')]
)
def test_the_longest_gaps_are_named_in_their_order(tmp_path: Path, skip: bool, then: str) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    for second in (0, 100, 1000, 1200, 2000, 2300, 3000, 3110):
        ns = second * 10**9
        bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, STATE)))
    named = [(100, 1000), (1000, 1200), (1200, 2000), (2000, 2300), (2300, 3000)]
    with playing(bag.close(), skip_gaps=skip, start_paused=True) as (_, replay):
        said = [f'nothing from {a} to {b} s of the bag: {then}' for a, b in named]
        assert replay.remarks() == said


def test_its_diagnostics_say_where_it_is_and_what_it_waits_for(tmp_path: Path) -> None:
    values = {'expected_subscribers': ['odom=1'], 'start': 0.1, 'start_paused': True, 'rate': 2.0}
    with playing(made(tmp_path / 'bag'), **values) as (peer, replay):
        peer.listen(topics.DIAGNOSTICS)

        def told(key: str) -> str:
            heard = peer.heard[topics.DIAGNOSTICS.name][-1:]
            return {one.key: one.value for m in heard for one in m.status[0].values}.get(key, '')

        missing = '/odom: expected 1 subscribers, found 0'
        peer.until(lambda: told('waits for') == missing, 'what it waits for')
        peer.listen(ODOM)
        peer.until(lambda: replay.playing, 'the replay')
        for k in (1, 2):
            replay.player.step()
            peer.until(lambda k=k: told('published') == f'{4 * k}', 'a step')
        names = ('time', 'rate', 'paused', 'loops', 'waits for')
        assert [told(name) for name in names] == ['0.11', '2.0', 'True', '0', '']
        said = peer.heard[topics.DIAGNOSTICS.name][-1]
        assert nanoseconds(said.header.stamp) == 11 * STEP
        assert not replay.lockstep


EPOCH = 1_700_000_000 * 10**9  # a bag that was stamped by a wall clock
TRUTH = there(topics.GROUND_TRUTH)


def test_times_of_a_bag_are_counted_from_its_first_message(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    for k in (*range(30), 10_000):
        ns = EPOCH + k * STEP
        bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, STATE)))
    path = bag.close()
    part = {'start': 0.1, 'duration': 0.05, 'start_paused': True, 'rate': 0.0}
    with playing(path, expected_subscribers=['odom=1'], **part) as (peer, replay):
        peer.listen(ODOM, topics.DIAGNOSTICS)
        peer.until(lambda: replay.playing, 'the replay')
        assert replay._facts()['time'] == pytest.approx(0.1)
        assert peer.call(Trigger, 'replay_node/step').message == 'to 0.1 s of the bag'
        replay.player.run()
        assert ended(peer, replay) == 0
        all_heard(peer, 6, ODOM)
        steps = [step - EPOCH // STEP for step in steps_of(peer, ODOM)]
        assert steps == [*range(10, 16)]
    with (
        pytest.raises(InputError, match='at most 100 s, the length of the bag, found 101'),
        playing(path, start=101.0),
    ):
        pass
    with playing(path, start_paused=True) as (_, replay):
        assert replay.remarks() == [
            'nothing from 0.29 to 100 s of the bag: --skip-gaps jumps over it'
        ]


def test_plays_a_part_again_and_again(tmp_path: Path) -> None:
    """Stamps and clock begin again as well; a signal is a good end."""
    waits = ('-p', 'expected_subscribers:=["odom=1"]')
    part = {'start': 0.1, 'duration': 0.05, 'loop': True, 'rate': 0.0}
    with process(made(tmp_path / 'bag'), *waits, **part) as (peer, replay):
        peer.listen(ODOM, topics.CLOCK)
        peer.until(lambda: len(peer.heard[ODOM.name]) >= 18, 'three loops')
        assert stop(replay)[0] == 0
    once = list(range(10, 16))
    assert steps_of(peer, ODOM)[:18] == 3 * once
    assert clocks(peer)[-6:] in [once[k:] + once[:k] for k in range(6)]


def test_a_loop_that_is_stepped_through_is_held_at_its_beginning(tmp_path: Path) -> None:
    with playing(made(tmp_path / 'bag', 1), loop=True, start_paused=True) as (peer, replay):
        peer.listen(topics.CLOCK)
        peer.until(lambda: replay.playing, 'the replay')
        peer.listen(ODOM)  # who has come since is asked as well
        peer.node.create_service(Trigger, '~/ready', lambda _, response: response)
        peer.until(lambda: asks(replay), 'the peer')
        for k in (1, 2):
            assert replay.player.step() == 0
            peer.until(lambda k=k: replay.player.loops == k, 'the end of the bag')
            peer.spin(0.1)
            assert replay.player.published.total() == 4 * k
            peer.until(lambda k=k: clocks(peer) == [0] * k, 'the clock')


def test_a_controller_follows_into_the_next_loop(tmp_path: Path) -> None:
    """It refuses the jump back in time at first, says so, and starts anew."""
    other = topics.Topic('replay/other', topics.WRENCH.type)
    domain = fresh_domain()
    renamed = ('-r', '__ns:=/replay', '-r', 'wrench:=other')
    controller = start_node('controller_node', domain, *renamed, *CONTROLLER)
    values = {'expected_subscribers': ['odom=1', 'cmd_vel=1'], 'loop': True}
    values |= {'topics': ['odom', 'cmd_vel']}
    try:
        with playing(made(tmp_path / 'bag', 150), domain=domain, **values) as (peer, replay):
            peer.listen(other)
            peer.until(lambda: replay.player.loops == 1, 'the first loop')
            peer.until(lambda: steps_of(peer, other)[-1:] > [100], 'its answers')
            peer.until(lambda: 0 < steps_of(peer, other)[-1] < 100, 'the next one')
            peer.until(lambda: steps_of(peer, other)[-1] > 100, 'its end')
    finally:
        _, output = stop(controller)
    assert 'stamp went back' in output


def test_waits_for_answers_in_lock_step(tmp_path: Path) -> None:
    """A law beside a replay is asked as the plant asks it: no odometry before the answer."""
    other = topics.Topic('other/wrench', topics.WRENCH.type)
    with playing(made(tmp_path / 'bag'), **WAITS, rate=0.0, answers=other.name) as (peer, replay):
        peer.listen(ODOM, WRENCH, CMD_VEL)
        for k in range(50):
            peer.until(lambda k=k: len(peer.heard[ODOM.name]) == k + 1, f'odometry {k}')
            if k in (0, 30, 49):
                for old in peer.heard[ODOM.name][:k][-1:]:  # what answers another one is no answer
                    peer.publish(other, topics.WRENCH.type(header=old.header))
                peer.spin(0.2)
                assert len(peer.heard[ODOM.name]) == k + 1
                assert replay.exit_code is None
            peer.publish(other, topics.WRENCH.type(header=peer.heard[ODOM.name][k].header))
        assert ended(peer, replay) == 0


def test_asks_by_the_odometry_and_not_by_the_truth(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    for k in range(3):
        for topic in ('/odom', '/ground_truth/odom'):
            bag.add(topic, ODOMETRY, k * STEP, serialized(odometry(k * STEP, STATE)))
    other = topics.Topic('other/wrench', topics.WRENCH.type)
    values = {'expected_subscribers': ['odom=1', 'ground_truth/odom=1'], 'answers': other.name}
    with playing(bag.close(), **values, rate=0.0) as (peer, replay):
        peer.listen(ODOM, TRUTH)
        for k in range(3):
            all_heard(peer, k + 1, ODOM, TRUTH)  # the truth goes out before the answer
            assert len(peer.heard[ODOM.name]) == k + 1
            peer.publish(other, topics.WRENCH.type(header=peer.heard[ODOM.name][k].header))
        assert ended(peer, replay) == 0


def test_names_the_answer_that_does_not_come(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr('auv_analysis.nodes.replay_publishers.PATIENCE', 0.2)
    values = {'rate': 0.0, 'answers': 'other/wrench', 'start_paused': True}
    with playing(made(tmp_path / 'bag'), **values) as (peer, replay):
        peer.until(lambda: replay.playing, 'the replay')
        replay.player.step()
        peer.until(lambda: replay.player.published['/odom'] == 1, 'a step')
        peer.spin(0.5)
        assert replay.exit_code is None, 'nobody has to answer in a pause'
        replay.player.run()
        assert ended(peer, replay) == 1
        failure = 'no answer on other/wrench to the odometry of 0 s for 0.2 s'
        assert replay.failure == failure


def test_an_odometry_without_a_stamp_is_refused_where_it_would_be_answered() -> None:
    """The replay ended with a traceback."""
    player, refused, out = object.__new__(replay_node.Player), [], []
    graph: Any = SimpleNamespace(refuse=refused.append, subscribe=lambda *_: None)
    player._node, player._publishers = SimpleNamespace(graph=graph), {}
    player.commands = SimpleNamespace(check=lambda *_: None)
    player.receivers, player.published = SimpleNamespace(sent=lambda _: None), Counter()
    player._answers = replay_publishers.Answers(graph, 'wrench')
    for topic, sec in (('/odom', -1), ('/odom', 1), ('/ground_truth/odom', -1)):
        player._publishers[topic] = SimpleNamespace(publish=out.append)
        player._publish(topic, ODOMETRY, b'\0\1\0\0' + struct.pack('<iI', sec, 0))
    assert refused == ['/odom: no stamp: expected 0 s or later, found -1 s and 0 ns']
    assert [len(one) for one in out] == [12, 12]
    assert not player._answers.are_complete()


def test_waits_for_a_subscriber_that_is_stopped(tmp_path: Path) -> None:
    """At full speed, with more messages than a subscription keeps: none is lost, none is late."""
    steps, domain = DEPTH + 1000, fresh_domain()
    bag = odometry_alone(tmp_path / 'bag.mcap', steps)
    recorder = start_node(
        'recorder_node', domain, '-p', 'topics:=["odom"]', '-r', '__ns:=/replay',
        *parameters(bag=tmp_path / 'again', duration=(steps - 1) * STEP / 1e9),
    )  # fmt: skip
    values = {'expected_subscribers': ['odom=1'], 'start_paused': True}
    try:
        with playing(bag, domain=domain, **values, rate=0.0) as (peer, replay):
            peer.until(lambda: replay.playing and asks(replay), 'the recorder')
            recorder.send_signal(signal.SIGSTOP)
            replay.player.run()
            peer.until(lambda: replay.player.published['/odom'] == 1000, 'a window')
            peer.spin(0.5)
            assert replay.player.published['/odom'] == 1000
            recorder.send_signal(signal.SIGCONT)
            assert ended(peer, replay) == 0
            assert not replay.player.receivers.silent
        assert recorder.wait(PATIENCE) == 0
    finally:
        recorder.send_signal(signal.SIGCONT)
        print(stop(recorder))
    assert read_bag(tmp_path / 'again', decode=False).counts['/replay/odom'] == steps


def test_who_cannot_be_asked_is_not_waited_for() -> None:
    made = object.__new__(replay_publishers.Receivers)
    made._clients, made.silent = {'/x': SimpleNamespace(service_is_ready=lambda: False)}, []
    assert made._is_answered(replay_publishers._Round({}))


def test_a_subscriber_has_taken_all_with_its_second_answer() -> None:
    made, asked = object.__new__(replay_publishers.Receivers), replay_publishers._Round({})
    answer = SimpleNamespace(done=lambda: True)
    one = SimpleNamespace(service_is_ready=lambda: True, call_async=lambda _: answer)
    made._clients, made.silent = {'/x': one}, []
    # asks, takes the answer, asks, takes the answer
    assert [made._is_answered(asked) for _ in range(5)] == [False, False, False, False, True]


@pytest.mark.parametrize(
    ('always', 'used', 'asked'), [(True, 0, 0), (True, 1, 1), (False, 499, 0), (False, 500, 500)]
)
def test_it_is_asked_what_has_arrived_when_half_of_the_room_is_used_or_nothing_is_left(
    always: bool, used: int, asked: int
) -> None:
    publishers: Any = {name: SimpleNamespace(wait_for_all_acked=lambda _: True) for name in 'xy'}
    made = replay_publishers.Receivers(None, publishers)
    for _ in range(used):
        made.sent('y')
    assert made.have_room('y')
    made.ask(always=always)
    assert made._taken == {'x': 0, 'y': asked}
    assert made.have_all() == (used == asked)


def test_who_does_not_say_that_data_has_arrived_is_given_up_after_ten_seconds(monkeypatch) -> None:
    now, arrived, waits = 100.0, {'x': True, 'y': False}, []
    monkeypatch.setattr('time.monotonic', lambda: now)

    def publisher(name: str) -> Any:
        return SimpleNamespace(wait_for_all_acked=lambda t: waits.append(t) or arrived[name])

    logger = SimpleNamespace(error=lambda _: None)
    node: Any = SimpleNamespace(get_logger=lambda: logger)
    made = replay_publishers.Receivers(node, {name: publisher(name) for name in arrived})
    made._clients = {'/z': SimpleNamespace(service_is_ready=lambda: True, call_async=waits.append)}
    asked = replay_publishers._Round({}, began=now)
    now = 110.0
    assert not made._has_arrived(asked)
    assert made._is_answered(asked) is False
    assert made.silent == []
    now = 110.1
    assert made._has_arrived(asked)
    assert made._is_answered(asked)
    assert made.silent == ['a subscriber of y', '/z']
    arrived['y'], again = True, replay_publishers._Round({}, began=now)
    assert made._has_arrived(again)
    arrived['x'] = False
    assert made._has_arrived(again), 'what has come since is of the next question'
    assert not any(getattr(one, 'nanoseconds', 0) for one in waits), 'nothing is waited for'


def test_what_is_not_due_is_not_played_and_others_have_a_turn_between(monkeypatch) -> None:
    now, wait, out = 7.0, 0.5, []
    player = object.__new__(replay_node.Player)
    player.receivers = SimpleNamespace(ask=lambda **_: None)
    player.playback = SimpleNamespace(paused=False, wait=lambda *_: wait, played=lambda _: None)
    player._stream, player._next = (PlayedMessage(k, '/x', b'') for k in range(9)), None
    player._goes_out = lambda message, _: out.append(message.ns) or True
    monkeypatch.setattr('time.monotonic', lambda: now)
    assert player.advance(now) == 0.01
    wait = 0.004
    assert player.advance(now) == 0.004
    assert out == []
    wait, now = 0.0, 7.02
    assert player.advance(7.0) == 0.0
    assert out == [0]
    player.playback.pause = player.playback.change_rate = lambda *given: out.append(given)
    player.pause()
    player.change_rate(3.0)
    assert out[1:] == [(7.02, 1), (7.02, 1, 3.0)], 'between two messages'


def test_gives_up_a_subscriber_that_stays_silent(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr('auv_analysis.nodes.replay_publishers.PATIENCE', 0.5)
    domain = fresh_domain()
    recorder = start_node('recorder_node', domain, *parameters(bag=tmp_path / 'again'))
    values = {'original_names': True, 'expected_subscribers': ['odom=1'], 'start_paused': True}
    try:
        with playing(made(tmp_path / 'bag'), domain=domain, **values, rate=0.0) as (peer, replay):
            peer.until(lambda: replay.playing and asks(replay), 'the recorder')
            recorder.send_signal(signal.SIGSTOP)
            replay.player.run()
            assert ended(peer, replay) == 0
            assert '/recorder_node' in replay.player.receivers.silent
    finally:
        recorder.send_signal(signal.SIGCONT)
        stop(recorder)


def test_leaves_out_what_is_not_installed(tmp_path: Path) -> None:
    """What a bag names as a type is not imported to see whether it is one."""
    bag = Bag(tmp_path / 'bag' / 'bag_0.mcap')
    fill(bag, range(20))
    for topic, kind in (
        ('/sonar', 'sonar_msgs/msg/Ping'),
        ('/evil', 'antigravity/msg/Ping'),
        ('/two words', STRING),
    ):
        schema = bag._writer.register_schema(kind, 'ros2msg', b'uint8 x')
        channel = bag._writer.register_channel(topic, 'cdr', schema)
        bag._writer.add_message(channel, 0, b'\0\1\0\0\1', 0)
    bag._writer.register_channel('/untyped', 'cdr', 0)
    bag.close()
    with playing(tmp_path / 'bag', rate=0.0) as (peer, replay):
        assert replay.remarks() == [
            'left out: /two words: not a name of a ROS topic',
            'left out: /evil: its type antigravity/msg/Ping is not installed',
            'left out: /sonar: its type sonar_msgs/msg/Ping is not installed',
            'left out: /untyped: its type (none) is not installed',
        ]
        peer.listen(ODOM)
        assert ended(peer, replay) == 0
        all_heard(peer, 20, ODOM)
    assert len(peer.heard[ODOM.name]) == 20


def test_leaves_out_a_type_that_has_changed_since(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    fill(bag, range(20))
    schema = bag._writer.register_schema(STRING, 'ros2msg', b'uint8 x')
    digest = {'topic_type_hash': f'RIHS01_{0:064x}'}
    bag._writer.register_channel('/other', 'cdr', schema, digest)
    with playing(bag.close(), rate=0.0) as (_, replay):
        text = f'left out: /other: its type {STRING} is defined in another way here'
        assert replay.remarks() == [text]


def test_a_bag_that_was_cut_is_played_up_to_there(tmp_path: Path) -> None:
    path = made(tmp_path / 'bag', 300) / 'bag_0.mcap'
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with playing(path.parent, rate=0.0) as (peer, replay):
        assert 'bag_0.mcap: was not finished' in replay.remarks()[0]
        peer.listen(ODOM)
        assert ended(peer, replay) == 0
        all_heard(peer, replay.player.published['/odom'], ODOM)
    heard = steps_of(peer, ODOM)
    assert 100 < len(heard) < 300
    assert heard == list(range(len(heard)))


@pytest.mark.parametrize(
    ('recorded', 'depth'),
    [
        ('[{durability: transient_local, depth: 5}]', 5),
        ('[{durability: 1, depth: 5}, {durability: transient_local, depth: 7}]', 7),
        ('[{durability: 1, depth: 0}, {durability: volatile, depth: 200}]', 100),
        ('[{durability: 1, depth: 1}]', 1),
        (f'[{{durability: 1, depth: {DEPTH}}}]', DEPTH),
        (f'[{{durability: 1, depth: {DEPTH + 1}}}]', 100),
        ('[{durability: 1, depth: 5}]'.ljust(9_999), 5),
        ('[{durability: 1, depth: 5}]'.ljust(10_000), None),
        ('[{durability: volatile, depth: 5}, {durability: 2, depth: 5}]', None),
        *(('', None), ('{', None), ('3', None), ('[3]', None)),
    ],
)
def test_as_much_is_kept_as_was_recorded(recorded: str, depth: int | None) -> None:
    found, held = offered_again(recorded), depth is not None
    assert found.durability == getattr(DurabilityPolicy, 'TRANSIENT_LOCAL' if held else 'VOLATILE')
    assert found.depth == (depth or DEPTH)
    assert found.reliability == ReliabilityPolicy.RELIABLE
    command = offered_again(recorded, volatile=True)
    assert (command.durability, command.depth) == (DurabilityPolicy.VOLATILE, DEPTH)


def test_late_comers_get_what_was_kept_for_them(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    text = '- {history: keep_last, depth: 1, reliability: reliable, durability: transient_local}'
    kind = bag._writer.register_schema(STRING, 'ros2msg', b'string data')
    channel = bag._writer.register_channel('/chart', 'cdr', kind, {'offered_qos_profiles': text})
    data = serialized(new(STRING, 'the harbour'))
    bag._writer.add_message(channel, 0, data, 0)
    bag.add('/odom', 'nav_msgs/msg/Odometry', 10**11, serialized(odometry(10**11, STATE)))
    with playing(bag.close()) as (peer, _):
        peer.listen(topics.CLOCK)
        peer.until(lambda: peer.heard[topics.CLOCK.name], 'the first message')
        late = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        heard: list[String] = []
        peer.node.create_subscription(String, 'replay/chart', heard.append, late)
        peer.until(lambda: heard, 'the chart')
    assert heard[0].data == 'the harbour'


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        ({'bag': ''}, 'bag: expected a bag folder'),
        ({'bag': 'none'}, 'none: expected a bag folder'),
        ({'rate': -1.0}, 'rate: expected a number from'),
        ({'start': 9.0}, 'start: expected at most 0.49 s'),
        ({'namespace': 'a b'}, 'namespace: expected a namespace'),
        ({'speed': 2.0}, 'speed: expected one of'),
        ({'topics': ['sonar']}, 'topics: expected one of /cmd_vel.*found sonar'),
        ({'expected_subscribers': ['sonar=1']}, 'expected_subscribers: expected topic=count'),
        ({'original_names': True, 'topics': ['wrench']}, 'expected a topic .* --commands'),
    ],
)
def test_wrong_parameters_are_named(tmp_path: Path, values: dict, words: str) -> None:
    with (
        pytest.raises(InputError, match=words),
        playing(made(tmp_path / 'bag'), **values),
    ):
        pass
