"""Publishers and subscribers of a topic, by the middleware's discovery."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible

from auv_dynamics.ros import interface
from auv_dynamics.ros.topics import Topic, type_name

TOOLS = ('rosbag2_recorder', '_ros2cli')  # how the names of their nodes begin
UNNAMED = '_NODE_NAME_UNKNOWN_'  # the names of nodes arrive behind their endpoints
NAMELESS = 'a node without a name yet'
NAMED = 1.0  # s after which a name does not come any more
ONLOOKERS = ('analysis_node', 'recorder_node')  # our nodes that act on nothing they hear


@dataclass(frozen=True)
class Endpoints:
    """The two sides of a topic; observers are not counted.

    Attributes
    ----------
    publishers, subscribers : how many
    foreign : another message type that it is published with, or an empty text
    conflicts : pairs of nodes that cannot hear each other, one line each

    """

    publishers: int
    subscribers: int
    foreign: str
    conflicts: tuple[str, ...]


def full_name(endpoint: Any) -> str:
    """Namespace and name of the node of an endpoint."""
    if endpoint.node_name == UNNAMED:
        return NAMELESS
    return f'{endpoint.node_namespace.rstrip("/")}/{endpoint.node_name}'


def is_of(node: Any, endpoint: Any) -> bool:
    """Whether an endpoint is of a node, or of another one of its very name."""
    return bool(full_name(endpoint) == node.get_fully_qualified_name())


def other_publishers(node: Any, topic: str) -> list[Any]:
    """Publishers of a topic, by its full name, beside the node's own."""
    own = sum(one.topic_name == topic for one in node.publishers)
    return _others(node, node.get_publishers_info_by_topic(topic), own)


def other_subscribers(node: Any, topic: str) -> list[Any]:
    """Subscriptions of a topic, by its full name, beside the node's own."""
    mine = {id(one): one for one in (*node.subscriptions, *node.data_subscriptions())}
    own = sum(one.topic_name == topic for one in mine.values())
    return _others(node, node.get_subscriptions_info_by_topic(topic), own)


def _others(node: Any, found: list[Any], own: int) -> list[Any]:
    """Endpoints without so many of the node's own: another node may have its very name."""
    others = []
    for endpoint in found:
        if own and is_of(node, endpoint):
            own -= 1
        else:
            others.append(endpoint)
    return others


def acts(endpoint: Any) -> bool:
    """Whether a subscription may be of somebody who acts on what he hears."""
    if endpoint.node_name == UNNAMED:
        return True
    return not (endpoint.node_name in ONLOOKERS or observes(endpoint))


def crowds(node: Node, topics: Iterable[Topic]) -> list[str]:
    """Topics with several publishers although they are for one, and the publishers' names."""
    found = []
    for topic in sorted(topics, key=lambda one: one.name):
        name, kind = node.resolve_topic_name(topic.name), type_name(topic.type)
        listed = node.get_publishers_info_by_topic(name)
        names = sorted(full_name(one) for one in listed if one.topic_type == kind)
        if len(names) > 1:
            found.append(f'{name}: expected one publisher, found {", ".join(names)}')
    return found


def why_silent(node: Node, topic: Topic) -> str:
    """Why nothing can be heard on a topic, with what to do; empty: somebody publishes its type."""
    name, expected = node.resolve_topic_name(topic.name), type_name(topic.type)
    found = node.get_publishers_info_by_topic(name)
    if not found:
        return f'nobody publishes {name}'
    if any(one.topic_type == expected for one in found):
        return ''
    other = found[0].topic_type
    remedy = 'publish it with a header' if f'{other}Stamped' == expected else 'publish that type'
    return f'{name}: expected {expected}, found {other} of {full_name(found[0])}; {remedy}'


def onlookers(node: Node, publisher: Any, namespace: str) -> int:
    """How many that hear a publisher are not of the graph in a namespace, or may turn out not to.

    These are observers, the recorder of another namespace, and tools: `ros2 bag`, `ros2 topic`.
    """
    return sum(looks_on(namespace, one) for one in hearers(node, publisher))


def hearers(node: Node, publisher: Any) -> list[Any]:
    """Subscriptions that a publisher has matched, or is about to."""
    kind, name = type_name(publisher.msg_type), publisher.topic_name
    offered = [
        one.qos_profile for one in node.get_publishers_info_by_topic(name) if is_of(node, one)
    ]
    return [
        one
        for one in node.get_subscriptions_info_by_topic(name)
        if one.topic_type == kind
        and not any(qos_conflict(ours, one.qos_profile) for ours in offered)
    ]


def looks_on(namespace: str, endpoint: Any) -> bool:
    """Whether a subscription is not of the graph in a namespace, or may turn out not to be."""
    name = endpoint.node_name
    foreign = name == interface.RECORDER and endpoint.node_namespace != namespace
    return foreign or name == UNNAMED or observes(endpoint) or name.startswith(TOOLS)


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


def has_conflict(node: Node, topic: Topic) -> bool:
    """Whether there is an endpoint of a topic that a node cannot hear, or is not heard by."""
    name = node.resolve_topic_name(topic.name)
    subscribers = node.get_subscriptions_info_by_topic(name)
    return any(
        _conflict(topic, publisher, subscriber)
        for publisher in node.get_publishers_info_by_topic(name)
        for subscriber in subscribers
        if is_of(node, publisher) or is_of(node, subscriber)
    )


def _conflict(topic: Topic, publisher: Any, subscriber: Any) -> str:
    policies = qos_conflict(publisher.qos_profile, subscriber.qos_profile)
    pair = f'{full_name(publisher)} and {full_name(subscriber)}'
    return f'{topic.name}: incompatible QoS of {pair}: {policies}' if policies else ''


def qos_conflict(offered: QoSProfile, asked: QoSProfile) -> str:
    """Why a publisher and a subscription of these profiles do not match, or an empty text."""
    verdict, reason = qos_check_compatible(offered, asked)
    if verdict != QoSCompatibility.ERROR:
        return ''
    parts = reason.lower().replace('error:', '').split(';')
    return ', '.join(part.strip() for part in parts if part.strip())
