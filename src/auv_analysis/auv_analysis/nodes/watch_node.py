"""Listens to a graph without taking part in it: nothing is published, nobody waits for it.

Only what is published is subscribed, and with best effort: that fits every publisher, and a
publisher never waits for such a subscriber, not even for one that is stopped.
"""

import math
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSPolicyKind
from rclpy.subscription import Subscription

from auv_analysis.watch.monitor import HEARD, GraphMonitor
from auv_analysis.watch.snapshot import LEVELS, NodeState
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import KINDS, Codec, first_stamp, message_of
from auv_dynamics.ros.endpoints import endpoints
from auv_dynamics.ros.interface import BadMessageError, Frames
from auv_dynamics.ros.node_main import BulkNode, serve_all
from auv_dynamics.ros.participant import Participant
from auv_dynamics.ros.rclpy_internals import has_data_path

DEPTH = 256  # messages of a topic between two looks; of more, the oldest are dropped
LOOK = 0.5  # s between two looks at who is there
SERVED = 2000  # callbacks at each look, at most; only a plain executor brings messages as well


class WatchNode(BulkNode):
    """Subscribes what is published and hands it to a monitor.

    Parameters
    ----------
    context : of rclpy
    namespace : of the graph
    frames : frame ids that are accepted
    monitor : is told of everything, with the steady time in s

    """

    def __init__(self, context: Context, namespace: str, frames: Frames, monitor: GraphMonitor):
        super().__init__(
            interface.OBSERVER,
            context=context,
            namespace=namespace,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self.bulk = has_data_path()
        self._monitor = monitor
        self._frames = frames
        self._topics = [topic for topic in topics.TOPICS if topic.name in HEARD]
        # made once: which messages are laid out how takes some time to find out
        self._callbacks: dict[topics.Topic, Any] = {t: self._callback(t) for t in self._topics}
        self._subscribed: dict[topics.Topic, Subscription] = {}

    def take(self) -> None:
        """Take what has come, all at the same time."""
        self._now = time.monotonic()
        self.take_data()

    def look(self) -> None:
        """See who is there; subscribe what is published, leave what is not."""
        found = {topic.name: endpoints(self, topic) for topic in self._topics}
        self._monitor.see(time.monotonic(), found)
        for topic in self._topics:
            published = found[topic.name].publishers > 0
            if published and topic not in self._subscribed:
                self._subscribed[topic] = self._subscribe(topic)
            elif not published and topic in self._subscribed:
                self.drop_data(self._subscribed.pop(topic))

    def _subscribe(self, topic: topics.Topic) -> Subscription:
        events = SubscriptionEventCallbacks(
            incompatible_qos=lambda event: self._incompatible(topic, event),
            use_default_callbacks=False,
        )
        subscription = self.create_subscription(
            topic.type,
            topic.name,
            self._callbacks[topic],
            topics.best_effort(DEPTH),
            event_callbacks=events,
            raw=True,
        )
        self.add_data(subscription)
        # set-points come first, so that the one of an odometry is there before it
        setpoints = self.resolve_topic_name(topics.CMD_VEL.name)
        self.data_subscriptions().sort(key=lambda one: one.topic_name != setpoints)
        return subscription

    def _callback(self, topic: topics.Topic) -> Callable[[bytes, dict[str, Any]], None]:
        """Callback of a topic; a message that must not be used is refused, and once."""
        name = topic.name
        codec = Codec(topic.type, self._frames, name) if topic.type in KINDS else None

        def take(data: bytes, info: dict[str, Any]) -> None:
            ns, values = None, None
            try:
                ns = first_stamp(data, name)
                if codec is not None:
                    _, values = codec.decode(data)
                elif topic is topics.DIAGNOSTICS:
                    self._diagnose(message_of(data, DiagnosticArray, name))
            except BadMessageError as error:
                self._monitor.refuse(self._now, name, str(error))
            if ns is not None:
                number = info.get('publication_sequence_number')
                self._monitor.hear(self._now, name, number, ns, values)

        return take

    def _diagnose(self, message: DiagnosticArray) -> None:
        for status in message.status:
            level = LEVELS[min(int.from_bytes(status.level, 'little'), len(LEVELS) - 1)]
            facts = {pair.key: pair.value for pair in status.values}
            state = NodeState(status.name, level, status.message, 0.0, facts)
            self._monitor.diagnose(self._now, state)

    def _incompatible(self, topic: topics.Topic, event: Any) -> None:
        policy = QoSPolicyKind(event.last_policy_kind).name.lower()
        text = f'{topic.name}: incompatible QoS with another endpoint: {policy}'
        self._monitor.complain(time.monotonic(), text)

    def elsewhere(self) -> list[str]:
        """Other namespaces in which odometry is published."""
        own = self.resolve_topic_name(topics.ODOM.name)
        names = {name for name, _ in self.get_topic_names_and_types()} - {own}
        ending, truth = (f'/{topic.name}' for topic in (topics.ODOM, topics.GROUND_TRUTH))
        found = [name for name in names if name.endswith(ending) and not name.endswith(truth)]
        return sorted(name.removesuffix(ending) or '/' for name in found)


class Listener(Participant):
    """A participant that listens for a monitor.

    Parameters
    ----------
    domain : ROS domain id
    namespace : of the graph
    frames : frame ids that are accepted
    monitor : is told of everything

    """

    def __init__(self, domain: int, namespace: str, frames: Frames, monitor: GraphMonitor):
        def make(context: Context) -> WatchNode:
            return WatchNode(context, namespace, frames, monitor)

        super().__init__(domain, make, interface.OBSERVER)
        self._looked = -math.inf

    def listen(self) -> None:
        """Take what has come, and look now and then who is there."""
        self._node.take()
        now = time.monotonic()
        looks = now - self._looked > LOOK
        if looks or not self._node.bulk:
            serve_all(self._node, self._executor, SERVED)
        if looks:
            self._looked = now
            self._node.look()

    def elsewhere(self) -> list[str]:
        """Other namespaces in which odometry is published."""
        return self._node.elsewhere()
