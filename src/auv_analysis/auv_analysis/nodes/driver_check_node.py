"""Listens to a vehicle driver, and commands it only where that was asked for.

A node that listens publishes nothing at all, not even what every node of rclpy does by itself, and
subscribes with best effort: nobody waits for it.
"""

import time
from collections.abc import Iterable, Mapping
from typing import Any

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.duration import Duration, Infinite
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile

from auv_analysis.bag.step_topics import ODOMETRY, WRENCH
from auv_analysis.driver.evidence import Endpoint, GraphSnapshot
from auv_analysis.driver.odometry_log import NO_STAMP, OdometryBuffer, OdometryLog
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import Codec, first_stamp, message_of
from auv_dynamics.ros.endpoints import (
    acts,
    full_name,
    other_publishers,
    other_subscribers,
    qos_conflict,
)
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.node_main import BulkNode
from auv_dynamics.ros.participant import Participant

COMMANDER = 'auv_check_driver'  # its name when it commands: then it is no mere observer
ACKNOWLEDGED = 0.5  # s that are waited for the last zero to arrive


class CheckNode(BulkNode):
    """Hears odometry and sees endpoints.

    Parameters
    ----------
    context : of rclpy
    namespace : of the driver
    names : of odometry and wrench, by their usual names; relative to it or absolute
    commands : whether it is going to publish a wrench

    """

    latency_critical = True

    def __init__(self, context: Context, namespace: str, names: Mapping[str, str], commands: bool):
        super().__init__(
            COMMANDER if commands else interface.OBSERVER,
            context=context,
            namespace=namespace,
            start_parameter_services=False,
            enable_rosout=False,
        )
        for publisher in list(self.publishers):  # /parameter_events
            self.destroy_publisher(publisher)
        self.buffer = OdometryBuffer()
        self.odom = self.resolve_topic_name(names[interface.ODOM])
        self.wrench = self.resolve_topic_name(names[interface.WRENCH])
        self._hear(Odometry, self.odom, self._on_odometry)
        self._hear(topics.CLOCK.type, topics.CLOCK.name, self._on_clock)
        if commands:
            self._hear(WrenchStamped, topics.WRENCH_APPLIED.name, self._on_applied)

    def _hear(self, kind: type, topic: str, callback: Any) -> None:
        def take(data: bytes, info: dict[str, Any]) -> None:
            try:
                callback(data, info)
            except interface.BadMessageError:
                number = info.get('publication_sequence_number') if topic == self.odom else None
                self.buffer.unreadable(topic, number)

        hear: Any = take  # rclpy's types do not know that it may be told the way of a message
        events = SubscriptionEventCallbacks(use_default_callbacks=False)
        self.add_data(
            self.create_subscription(
                kind, topic, hear, topics.best_effort(), event_callbacks=events, raw=True
            )
        )

    def _on_odometry(self, data: bytes, info: dict[str, Any]) -> None:
        message = message_of(data, Odometry, self.odom)
        frames = (message.header.frame_id, message.child_frame_id)
        x, number = interface.state_of(message), info.get('publication_sequence_number')
        try:
            stamp = first_stamp(data, self.odom)
        except interface.BadMessageError:
            stamp = NO_STAMP
        arrived = _arrived(info)
        published = info.get('source_timestamp') or arrived
        self.buffer.odometry(arrived, stamp, published, x, frames, number)

    def _on_clock(self, data: bytes, info: dict[str, Any]) -> None:
        self.buffer.clock(_arrived(info), first_stamp(data, topics.CLOCK.name))

    def _on_applied(self, data: bytes, info: dict[str, Any]) -> None:
        message = message_of(data, WrenchStamped, topics.WRENCH_APPLIED.name)
        self.buffer.wrench_applied(_arrived(info), interface.wrench_of(message))


def _arrived(info: dict[str, Any]) -> int:
    """When a message arrived, ns of this machine's clock; now, where the middleware tells none."""
    return info.get('received_timestamp') or time.time_ns()


def _endpoint(info: Any) -> Endpoint:
    qos = info.qos_profile
    policies = qos.reliability.name.lower(), qos.durability.name.lower()
    return Endpoint(full_name(info), info.topic_type, *policies)


def _nodes(found: Iterable[tuple[str, Any]]) -> dict[str, tuple[str, ...]]:
    """Topic -> its nodes."""
    nodes: dict[str, set[str]] = {}
    for topic, info in found:
        nodes.setdefault(topic, set()).add(full_name(info))
    return {topic: tuple(sorted(names)) for topic, names in nodes.items()}


def _spelled(qos: QoSProfile) -> QoSProfile:
    """A profile of ours with what the middleware fills in, as discovery tells it of others."""
    return QoSProfile(
        history=qos.history,
        depth=qos.depth,
        reliability=qos.reliability,
        durability=DurabilityPolicy.VOLATILE,
        deadline=Infinite,
        liveliness=LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=Infinite,
    )


class RosDriverClient(Participant):
    """Connection to a driver: listens, and publishes wrenches where that was asked for.

    Parameters
    ----------
    domain : ROS domain id
    namespace : of the driver
    names : of odometry and wrench, by their usual names
    frames : frame ids that the wrench carries
    commands : whether it is going to publish a wrench

    """

    def __init__(
        self,
        domain: int,
        namespace: str,
        names: Mapping[str, str],
        frames: Frames,
        *,
        commands: bool = False,
    ):
        executable = COMMANDER if commands else interface.OBSERVER
        super().__init__(domain, lambda ctx: CheckNode(ctx, namespace, names, commands), executable)
        self._frames, self._commands = frames, commands
        self._publisher: Publisher | None = None

    @property
    def buffer(self) -> OdometryBuffer:
        """Messages heard so far."""
        return self._node.buffer

    def listen(self, seconds: float) -> None:
        """Take what comes in for so long."""
        self.spin(seconds)

    def publishes(self) -> bool:
        """Whether anybody publishes the odometry."""
        return self._node.count_publishers(self._node.odom) > 0

    def graph(self, place: str) -> GraphSnapshot:
        """Who is there but itself; `place`: domain and namespace, in words."""
        node, odom, wrench = self._node, self._node.odom, self._node.wrench
        odometry = node.get_publishers_info_by_topic(odom)
        takers = list(filter(acts, other_subscribers(node, wrench)))
        clocks = node.get_publishers_info_by_topic(topics.CLOCK.name)
        names = [name for name, _ in node.get_topic_names_and_types()]
        rest = [name for name in names if name not in (odom, wrench)]
        controller, every = map(_spelled, (topics.newest_measurement(), topics.every_step()))
        given = [one.qos_profile for one in odometry if one.topic_type == ODOMETRY]
        taken = [one.qos_profile for one in takers if one.topic_type == WRENCH]
        conflicts = {
            'controller': [qos_conflict(one, controller) for one in given],
            'recorder': [qos_conflict(one, every) for one in given],
            'wrench': [qos_conflict(every, one) for one in taken],
        }
        return GraphSnapshot(
            place,
            odom,
            wrench,
            odom_publishers=tuple(map(_endpoint, odometry)),
            wrench_publishers=tuple(map(_endpoint, other_publishers(node, wrench))),
            wrench_subscribers=tuple(map(_endpoint, takers)),
            clock_publishers=tuple(map(_endpoint, clocks)),
            conflicts={key: next(filter(None, found), '') for key, found in conflicts.items()},
            elsewhere=_nodes(
                (name, one)
                for name in rest
                for one in node.get_publishers_info_by_topic(name)
                if one.topic_type == ODOMETRY
            ),
            listeners=_nodes(
                (name, one)
                for name in rest
                for one in other_subscribers(node, name)
                if one.topic_type == WRENCH and acts(one)
            ),
            topics=tuple(names),
        )

    def log(self, began_ns: int) -> OdometryLog:
        """Messages heard since a time, up to now."""
        return self._node.buffer.log(began_ns, time.time_ns())

    def others(self) -> list[str]:
        """Who else publishes the wrench."""
        return [full_name(one) for one in other_publishers(self._node, self._node.wrench)]

    def advertise(self) -> bool:
        """Create the publisher of wrenches, if there is none; whether somebody hears it."""
        if not self._commands:
            raise RuntimeError('a node that only listens publishes nothing')
        if self._publisher is None:
            codec = Codec(WrenchStamped, self._frames, topics.WRENCH.name)
            self._encode = codec.encode
            qos = topics.every_step()
            self._publisher = self._node.create_publisher(WrenchStamped, self._node.wrench, qos)
        return self._publisher.get_subscription_count() > 0

    def send(self, tau: tuple[float, ...]) -> int:
        """Publish a wrench with the stamp of the newest odometry; the time at which it left, ns."""
        if self._publisher is None or self.buffer.newest is None:
            raise RuntimeError('no wrench before advertise() and an odometry')
        self._publisher.publish(self._encode(self.buffer.newest[1], tau))
        return time.time_ns()

    def now_ns(self) -> int:
        """Time of this machine's clock, ns."""
        return time.time_ns()

    def retire(self) -> None:
        """Wait until what was sent last has arrived, and publish no more."""
        if self._publisher is not None:
            self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))
            self._node.destroy_publisher(self._publisher)
            self._publisher = None
