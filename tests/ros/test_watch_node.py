"""The listener of `auv watch` beside real publishers: it hears, and it changes nothing."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from helpers.node_processes import PATIENCE, Peer, fresh_domain, graph, parameters
from helpers.patience import patience
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from std_msgs.msg import String
from std_srvs.srv import Trigger

from auv_analysis.nodes.watch_node import Listener
from auv_analysis.watch.monitor import GraphMonitor
from auv_analysis.watch.snapshot import Snapshot, TopicState
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.participant import Watcher

FRAMES = Frames()
STEP = 10_000_000
STATE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *[0.1] * 6)
BEST_EFFORT = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.BEST_EFFORT
)


class Ears:
    """A listener, its monitor, and a peer that publishes."""

    def __init__(self, peer: Peer, domain: int, namespace: str = '/'):
        self.peer = peer
        self.monitor = GraphMonitor(domain, namespace, begin=time.monotonic())
        self.listener = Listener(domain, namespace, FRAMES, self.monitor)

    def snapshot(self) -> Snapshot:
        return self.monitor.snapshot(time.monotonic())

    def topic(self, topic: topics.Topic) -> TopicState:
        return next(one for one in self.snapshot().topics if one.name == topic.name)

    def until(self, done: Callable[[], Any]) -> None:
        limit = time.monotonic() + PATIENCE
        while not done():
            assert time.monotonic() < limit, self.snapshot().document()
            self.listener.listen()
            self.peer.executor.spin_once(timeout_sec=0.02)

    def publisher(self, topic: topics.Topic, qos: Any = None, kind: type | None = None) -> Any:
        """Publisher that the listener has matched."""
        made = self.peer.node.create_publisher(
            kind or topic.type, topic.name, qos or topics.every_step()
        )
        if kind is None:
            self.until(lambda: made.get_subscription_count() > 0)
        return made

    def troubles(self) -> str:
        return '\n'.join(alert.text for alert in self.snapshot().alerts)


@pytest.fixture
def ears(monkeypatch) -> Iterator[Ears]:
    monkeypatch.setattr('auv_analysis.watch.monitor.SILENT', patience(3.0))
    domain = fresh_domain()
    peer = Peer(domain)
    made = Ears(peer, domain)
    try:
        yield made
    finally:
        made.listener.close()
        peer.close()


def test_numbers_of_every_kind_come_in_and_broken_messages_are_errors(ears: Ears) -> None:
    publish = {
        topic: ears.publisher(topic).publish
        for topic in (topics.ODOM, topics.CMD_VEL, topics.WRENCH, topics.KINETIC_ENERGY)
    }
    shares = ears.publisher(topics.KINETIC_ENERGY_SHARES, BEST_EFFORT)
    subscribed = ears.listener._node.data_subscriptions()
    assert subscribed[0].topic_name == '/cmd_vel', 'it is taken before the odometry'
    publish[topics.CMD_VEL](convert.twist(0, (0.4,) * 6, FRAMES))
    for k in range(20):
        publish[topics.ODOM](convert.odometry(k * STEP, STATE, FRAMES))
        publish[topics.WRENCH](convert.wrench(k * STEP, (2.0,) * 6, FRAMES))
    publish[topics.KINETIC_ENERGY](convert.joint_state(0, range(6), FRAMES))
    shares.publish(convert.joint_state(0, [100.0, 0, 0, 0, 0, 0], FRAMES))
    ears.until(lambda: ears.topic(topics.WRENCH).heard == 20)
    ears.until(lambda: ears.snapshot().kinetic_energy)
    found = ears.snapshot()
    assert found.velocity_error.now == pytest.approx((0.3,) * 6)
    assert found.tau == (2.0,) * 6
    assert found.kinetic_energy.total == 15.0
    assert (found.time, found.alerts) == (0.19, ())
    odometry = ears.topic(topics.ODOM)
    assert (odometry.heard, odometry.gaps, odometry.repeats) == (20, 0, 0)
    publish[topics.ODOM](convert.odometry(22 * STEP, STATE, FRAMES))
    ears.until(lambda: ears.topic(topics.ODOM).gaps)

    publish[topics.WRENCH](convert.wrench(20 * STEP, (float('nan'), *[0.0] * 5), FRAMES))
    publish[topics.ODOM](convert.odometry(20 * STEP, STATE, Frames('map', FRAMES.base)))
    ears.until(lambda: ears.topic(topics.WRENCH).refused and ears.topic(topics.ODOM).refused)
    assert "odom: header.frame_id: expected 'odom_ned', found 'map'" in ears.troubles()
    assert 'wrench: not finite: expected finite numbers, found (nan' in ears.troubles()
    assert ears.snapshot().tau == (2.0,) * 6, 'what is refused is not shown'
    for topic in (topics.WRENCH, topics.DIAGNOSTICS):
        before = ears.topic(topic).refused
        ears.publisher(topic).publish(bytes(serialize_message(topic.type()))[:6])
        ears.until(lambda t=topic, n=before: ears.topic(t).refused > n)


def test_a_message_is_refused_once_and_under_the_name_of_its_topic(ears: Ears) -> None:
    odd = convert.wrench(0, (1.0,) * 6, FRAMES)
    odd.header.stamp.sec = -1
    ears.listener.listen()
    said = ears.listener._node._callbacks
    said[topics.WRENCH](bytes(serialize_message(odd)), {})
    said[topics.PROGRESS](b'\x00\x01\x00\x00', {})
    told = [(alert.text, alert.count) for alert in ears.snapshot().alerts]
    assert told == [
        ('recorder/progress: expected a message with a stamp, found 4 bytes', 1),
        ('wrench: no stamp: expected 0 s or later, found -1 s and 0 ns', 1),
    ]
    for topic in (topics.WRENCH, topics.PROGRESS):
        assert (ears.topic(topic).refused, ears.topic(topic).heard) == (1, 0)


def test_what_nodes_say_of_themselves_is_told(ears: Ears) -> None:
    levels = {0: 'ok', 1: 'warning', 2: 'error', 3: 'stale', 9: 'stale'}
    said = [
        DiagnosticStatus(level=bytes([level]), name=f'/n{level}', message=f'is {word}')
        for level, word in levels.items()
    ]
    said[0].values = [KeyValue(key='step', value='7'), KeyValue(key='ready', value='False')]
    publisher = ears.publisher(topics.DIAGNOSTICS)
    publisher.publish(DiagnosticArray(status=said))
    ears.until(lambda: ears.snapshot().nodes)
    told = [(node.name, node.level, node.text) for node in ears.snapshot().nodes]
    assert told == [(f'/n{level}', word, f'is {word}') for level, word in levels.items()]
    assert ears.snapshot().nodes[0].facts == {'step': '7', 'ready': 'False'}
    assert ears.topic(topics.DIAGNOSTICS).heard == 1
    later = DiagnosticArray(status=said)
    later.header.stamp = convert.stamp(7 * STEP)
    publisher.publish(later)
    ears.until(lambda: ears.topic(topics.DIAGNOSTICS).heard == 2)
    assert ears.topic(topics.DIAGNOSTICS).published == 2, 'by the number of its publisher'


@pytest.mark.parametrize('named', [True, False])
def test_who_does_not_fit_is_named_with_topic_and_policy(ears: Ears, named: bool, monkeypatch):
    ears.peer.listen(topics.ODOM)  # reliable
    ears.publisher(topics.ODOM, BEST_EFFORT)
    ears.publisher(topics.WRENCH, kind=String)
    peer = ears.peer.node.get_fully_qualified_name()
    if not named:
        monkeypatch.setattr('auv_dynamics.ros.endpoints.UNNAMED', ears.peer.node.get_name())
        peer = 'a node without a name yet'
    for word in (f'odom: incompatible QoS of {peer} and {peer}: best effort publisher',
                 'wrench: expected the type of this topic, found std_msgs/msg/String'):  # fmt: skip
        ears.until(lambda word=word: word in ears.troubles())


def test_it_publishes_nothing_and_leaves_with_the_last_publisher(ears: Ears) -> None:
    odometry = ears.publisher(topics.ODOM)
    node = ears.peer.node

    def published() -> list[str]:
        if interface.OBSERVER not in node.get_node_names():  # not discovered yet
            return []
        found = node.get_publisher_names_and_types_by_node(interface.OBSERVER, '/')
        return [name for name, _ in found]

    ears.until(published)
    assert published() == ['/parameter_events']  # rclpy's; nothing is said
    assert node.count_subscribers(topics.WRENCH.name) == 0, 'only what is published'
    node.destroy_publisher(odometry)
    ears.until(lambda: node.count_subscribers(topics.ODOM.name) == 0)


def test_another_namespace_is_found(ears: Ears) -> None:
    ears.peer.node.create_publisher(topics.ODOM.type, '/auv7/odom', topics.every_step())
    ears.peer.node.create_publisher(topics.ODOM.type, '/ground_truth/odom', topics.every_step())
    ears.until(lambda: ears.listener.elsewhere() == ['/auv7'])
    ears.peer.node.create_publisher(topics.ODOM.type, '/odom', topics.every_step())
    inside = Listener(ears.monitor.domain, '/auv1', FRAMES, ears.monitor)
    try:
        ears.until(lambda: inside.elsewhere() == ['/', '/auv7'])
    finally:
        inside.close()


def test_it_is_no_stranger_on_a_domain(ears: Ears) -> None:
    ears.publisher(topics.ODOM)
    watcher = Watcher(ears.monitor.domain)
    try:
        limit = time.monotonic() + PATIENCE
        while watcher.endpoints() != ['test_peer on /odom']:
            assert time.monotonic() < limit, watcher.endpoints()
            watcher.spin(0.05)
    finally:
        watcher.close()


def test_nobody_waits_for_it_and_it_does_not_start_a_run() -> None:
    """The start barrier counts subscribers, but no onlooker, foreign recorder or tool."""
    expected = ['-p', 'expected_subscribers:=["odom=1"]']
    plant = ('plant_node', [*parameters(vehicle='herman2018', lockstep=True), *expected])
    with graph(plant) as (peer, _):
        beside = Ears(peer, peer.context.get_domain_id())
        last = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # it hears nothing
        others = [('recorder_node', '/auv2', 10), ('rosbag2_recorder', '/', 10)]
        others += [('_ros2cli_7', '/', last)]
        strangers = [Node(name, namespace=at, context=peer.context) for name, at, _ in others]
        try:
            for stranger, (_, _, qos) in zip(strangers, others, strict=True):
                stranger.create_subscription(topics.ODOM.type, '/odom', print, qos)
            beside.until(lambda: peer.node.count_subscribers('odom') == 4)
            answer = peer.call(Trigger, 'plant_node/ready')
            assert not answer.success
            assert answer.message == 'odom: expected 1 subscribers, found 0'
            strangers.append(Node('recorder_node', context=peer.context))  # of this graph
            strangers[-1].create_subscription(topics.ODOM.type, '/odom', print, 10)
            beside.until(lambda: peer.call(Trigger, 'plant_node/ready').success)
        finally:
            for stranger in strangers:
                stranger.destroy_node()
            beside.listener.close()
