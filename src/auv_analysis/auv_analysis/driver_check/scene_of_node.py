"""The scene of a driver as a node of rclpy sees it."""

from collections.abc import Iterable
from typing import Any

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Infinite
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    qos_check_compatible,
)

from auv_analysis.driver_check.scene import Endpoint, Scene
from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import acts, full_name, other_publishers, other_subscribers
from auv_dynamics.ros.kinds import type_name

ODOMETRY, WRENCH = type_name(Odometry), type_name(WrenchStamped)


def scene_of(node: Any, odom: str, wrench: str, place: str) -> Scene:
    """Who is there beside a node.

    Parameters
    ----------
    node : that looks; it is no part of the scene
    odom, wrench : full names of the topics
    place : domain and namespace, in words

    """
    odometry = node.get_publishers_info_by_topic(odom)
    takers = list(filter(acts, other_subscribers(node, wrench)))
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
        wrench_publishers=tuple(map(_endpoint, other_publishers(node, wrench))),
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
            for one in other_subscribers(node, name)
            if one.topic_type == WRENCH and acts(one)
        ),
        topics=tuple(names),
    )


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
