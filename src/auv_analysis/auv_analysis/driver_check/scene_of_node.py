"""The scene of a driver as a node of rclpy sees it."""

from collections.abc import Iterable
from typing import Any

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Infinite
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    qos_check_compatible,
)

from auv_analysis.driver_check.scene import Endpoint, Scene
from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import UNNAMED, observes
from auv_dynamics.ros.kinds import type_name

LISTENERS = ('recorder_node', 'analysis_node')  # ours, which hear the wrench and obey nothing
ODOMETRY, WRENCH = type_name(Odometry), type_name(WrenchStamped)


def scene_of(node: Node, odom: str, wrench: str, place: str) -> Scene:
    """Who is there beside a node.

    Parameters
    ----------
    node : that looks; it is no part of the scene
    odom, wrench : full names of the topics
    place : domain and namespace, in words

    """
    odometry = node.get_publishers_info_by_topic(odom)
    takers = [one for one in node.get_subscriptions_info_by_topic(wrench) if _obeys(node, one)]
    clocks = node.get_publishers_info_by_topic(topics.CLOCK.name)
    names = [name for name, _ in node.get_topic_names_and_types()]
    rest = [name for name in names if name not in (odom, wrench)]
    return Scene(
        place,
        odom,
        wrench,
        ODOMETRY,
        WRENCH,
        odom_publishers=tuple(map(_endpoint, odometry)),
        wrench_publishers=tuple(map(_endpoint, commanders(node, wrench))),
        wrench_subscribers=tuple(map(_endpoint, takers)),
        clock_publishers=tuple(map(_endpoint, clocks)),
        conflicts={
            'controller': _conflict(
                (one, _spelled(topics.newest_measurement())) for one in _of(odometry)
            ),
            'recorder': _conflict((one, _spelled(topics.every_step())) for one in _of(odometry)),
            'wrench': _conflict(
                (_spelled(topics.every_step()), one) for one in _of(takers, WRENCH)
            ),
        },
        elsewhere=_nodes(
            (name, one)
            for name in rest
            for one in node.get_publishers_info_by_topic(name)
            if one.topic_type == ODOMETRY
        ),
        listeners=_nodes(
            (name, one)
            for name in rest
            for one in node.get_subscriptions_info_by_topic(name)
            if one.topic_type == WRENCH and _obeys(node, one)
        ),
        topics=tuple(names),
    )


def commanders(node: Node, wrench: str) -> list[Any]:
    """Publishers of the wrench that are not of the node itself."""
    found = node.get_publishers_info_by_topic(wrench)
    return [one for one in found if not _own(node, one)]


def full_name(info: Any) -> str:
    """Namespace and name of the node of an endpoint."""
    if info.node_name == UNNAMED:
        return 'a node without a name'
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'


def _own(node: Node, info: Any) -> bool:
    return (info.node_name, info.node_namespace) == (node.get_name(), node.get_namespace())


def _obeys(node: Node, info: Any) -> bool:
    """Whether a subscription may be that of a vehicle."""
    return not (observes(info) or _own(node, info) or info.node_name in LISTENERS)


def _endpoint(info: Any) -> Endpoint:
    qos = info.qos_profile
    policies = qos.reliability.name.lower(), qos.durability.name.lower()
    return Endpoint(full_name(info), info.topic_type, *policies)


def _of(ends: Iterable[Any], kind: str = ODOMETRY) -> list[QoSProfile]:
    return [end.qos_profile for end in ends if end.topic_type == kind]


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


def _conflict(pairs: Iterable[tuple[QoSProfile, QoSProfile]]) -> str:
    """Why a publisher and a subscription of some pairs do not match, or an empty text."""
    for publisher, subscription in pairs:
        verdict, reason = qos_check_compatible(publisher, subscription)
        if verdict == QoSCompatibility.ERROR:
            parts = reason.lower().replace('error:', '').split(';')
            return ', '.join(part.strip() for part in parts if part.strip())
    return ''
