"""Who publishes and subscribes a topic, as the middleware's discovery tells it."""

from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSCompatibility, ReliabilityPolicy, qos_check_compatible

from auv_dynamics import interface
from auv_dynamics.ros.kinds import type_name
from auv_dynamics.ros.topics import Topic

UNNAMED = '_NODE_NAME_UNKNOWN_'  # the names of nodes arrive behind their endpoints


@dataclass(frozen=True)
class Endpoints:
    """The two sides of a topic; observers are not counted.

    Attributes
    ----------
    publishers, subscribers : how many
    foreign : another message type that it is published with, or an empty text
    conflicts : pairs of nodes that cannot hear each other, one line each

    """

    publishers: int = 0
    subscribers: int = 0
    foreign: str = ''
    conflicts: tuple[str, ...] = ()


def onlookers(node: Node, topic: str) -> int:
    """How many subscriptions of a topic are of observers, or may turn out to be.

    Observers subscribe with best effort: a reliable subscription without a name is none of them.
    """
    found = node.get_subscriptions_info_by_topic(node.resolve_topic_name(topic))
    return sum(map(observes, found))


def observes(endpoint: Any) -> bool:
    """Whether an endpoint is of an observer, or may turn out to be."""
    best_effort = endpoint.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
    return endpoint.node_name == interface.OBSERVER or (
        endpoint.node_name == UNNAMED and best_effort
    )


def endpoints(node: Node, topic: Topic) -> Endpoints:
    """Both sides of a topic as a node sees them."""
    name = node.resolve_topic_name(topic.name)
    publishers = node.get_publishers_info_by_topic(name)
    ours = [one for one in publishers if one.topic_type == type_name(topic.type)]
    others = [one.topic_type for one in publishers if one not in ours]
    listed = node.get_subscriptions_info_by_topic(name)
    subscribers = [one for one in listed if not observes(one)]
    conflicts = [_conflict(topic, one, other) for one in ours for other in subscribers]
    return Endpoints(
        len(ours), len(subscribers), others[0] if others else '', tuple(filter(None, conflicts))
    )


def _conflict(topic: Topic, publisher: Any, subscriber: Any) -> str:
    verdict, reason = qos_check_compatible(publisher.qos_profile, subscriber.qos_profile)
    if verdict != QoSCompatibility.ERROR:
        return ''
    policy = reason.removeprefix('ERROR: ').rstrip('; ').lower()
    pair = f'{publisher.node_name} and {subscriber.node_name}'
    return f'{topic.name}: incompatible QoS of {pair}: {policy}'
