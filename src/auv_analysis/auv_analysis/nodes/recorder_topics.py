"""Topics that are recorded beside those of the graph: found as they appear, heard as offered."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.subscription import Subscription

from auv_analysis.bag.schemas import schema_text
from auv_dynamics.files.errors import first_line
from auv_dynamics.ros.bulk import BulkNode
from auv_dynamics.ros.interface import GLOBALS
from auv_dynamics.ros.kinds import message_class
from auv_dynamics.ros.private import RCLError
from auv_dynamics.ros.raw_types import raw_class
from auv_dynamics.ros.topics import DEPTH

ALL = 'all'
UNRECORDED = ('/rosout', '/parameter_events')  # unless they are asked for by name
Take = Callable[[str, str, bytes, dict[str, Any]], None]  # topic, type, message, what is known


@dataclass(frozen=True)
class Wanted:
    """Which topics are recorded beside those of the graph.

    Attributes
    ----------
    namespace : of the recorder; what lies in it is recorded
    extra : full names, or 'all'
    exclude : what is found in a name that is not recorded; None: nothing

    """

    namespace: str
    extra: tuple[str, ...] = ()
    exclude: re.Pattern[str] | None = None

    def __contains__(self, topic: str) -> bool:
        if self.exclude and self.exclude.search(topic):
            return False
        if topic in self.extra:
            return True
        if topic in UNRECORDED:
            return False
        inside = topic.startswith(f'{self.namespace.rstrip("/")}/')
        return inside or topic in GLOBALS or ALL in self.extra


class OtherTopics:
    """Subscribes to topics as they appear, with the quality of service that is offered.

    Parameters
    ----------
    node : the recorder
    wanted : which
    take : gets every message

    Attributes
    ----------
    left : topic -> why it is not recorded

    """

    def __init__(self, node: BulkNode, wanted: Wanted, take: Take):
        self._node, self._wanted, self._take = node, wanted, take
        self._heard: dict[str, Subscription] = {}
        self._kinds: dict[str, str] = {}
        self.left: dict[str, str] = {}

    def look(self, ours: set[str]) -> None:
        """Subscribe to what has appeared, but for `ours`, and follow publishers that have come."""
        for topic, _ in self._node.get_topic_names_and_types():
            if topic in ours or topic in self.left or topic not in self._wanted:
                continue
            found = self._node.get_publishers_info_by_topic(topic)
            if found:
                kind = self._kinds.setdefault(topic, found[0].topic_type)
                follow = self._adapt if topic in self._heard else self._begin
                follow(topic, [one for one in found if one.topic_type == kind])
                for other in {one.topic_type for one in found} - {kind}:
                    self._leave(f'{topic} of {other}', f'it is recorded as {kind}')

    def _begin(self, topic: str, publishers: list[Any]) -> None:
        kind = self._kinds[topic]
        try:
            schema_text(kind)
        except (OSError, ValueError):
            self._leave(topic, f'no definition of {kind}')
            return
        self._subscribe(topic, adapted(publishers))

    def _adapt(self, topic: str, publishers: list[Any]) -> None:
        """Ask for less where a publisher would not be heard, never for more."""
        asked = self._heard[topic].qos_profile
        if all(_is_heard(asked, one.qos_profile) for one in publishers):
            return
        self._node.take_data()
        self._node.drop_data(self._heard.pop(topic))
        self._subscribe(topic, adapted(publishers, asked))

    def _subscribe(self, topic: str, qos: QoSProfile) -> None:
        kind = self._kinds[topic]
        # what comes late is seen at the next look
        events = SubscriptionEventCallbacks(use_default_callbacks=False)
        callback: Any = partial(self._take, topic, kind)
        try:
            subscription = self._node.create_subscription(
                _class(kind), topic, callback, qos, event_callbacks=events, raw=True
            )
        except (ImportError, RCLError) as error:
            self._leave(topic, first_line(error))
            return
        self._heard[topic] = subscription
        self._node.add_data(subscription)

    def _leave(self, topic: str, why: str) -> None:
        if topic not in self.left:
            node: Any = self._node
            node.get_logger().warning(f'{topic}: not recorded, {why}')
        self.left[topic] = why


def _class(kind: str) -> type:
    try:
        return message_class(kind)
    except Exception:  # a package that is not installed, or whatever it raises
        return raw_class(kind)


def adapted(publishers: list[Any], asked: QoSProfile | None = None) -> QoSProfile:
    """Profile that every publisher of a topic offers at least.

    Parameters
    ----------
    publishers : their endpoints
    asked : profile so far, of which nothing is asked anew; None: there is none

    """
    offered = [one.qos_profile for one in publishers] + ([asked] if asked else [])
    reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offered)
    kept = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offered)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if kept else DurabilityPolicy.VOLATILE,
    )


def _is_heard(asked: QoSProfile, offered: QoSProfile) -> bool:
    return qos_check_compatible(offered, asked)[0] != QoSCompatibility.ERROR
