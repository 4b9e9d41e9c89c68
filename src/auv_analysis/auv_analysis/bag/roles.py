"""Our name of a recorded topic, the type that it must have and what reads its messages."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from auv_analysis.bag.contents import NotOursError
from auv_dynamics.ros import interface

ODOMETRIES = (interface.ODOM, interface.GROUND_TRUTH)
ODOMETRY = 'nav_msgs/msg/Odometry'
TWIST = 'geometry_msgs/msg/TwistStamped'
ACCEL = 'geometry_msgs/msg/AccelStamped'
WRENCH = 'geometry_msgs/msg/WrenchStamped'
KINDS = {
    interface.ODOM: ODOMETRY,
    interface.CMD_VEL: TWIST,
    interface.CMD_ACCEL: ACCEL,
    interface.WRENCH: WRENCH,
    interface.WRENCH_APPLIED: WRENCH,
    interface.GROUND_TRUTH: ODOMETRY,
    interface.DISTURBANCE: WRENCH,
    interface.DISTURBANCE_ESTIMATE: WRENCH,
}
_BY_KIND = {
    ODOMETRY: interface.read_odometry,
    TWIST: interface.read_twist,
    ACCEL: interface.read_accel,
    WRENCH: interface.read_wrench,
}
READERS: dict[str, Callable[[Any, interface.Frames], tuple[int, tuple[float, ...]]]] = {
    role: partial(_BY_KIND[kind], topic=role) for role, kind in KINDS.items()
}


def role_of(topic: str) -> str:
    """Our name of a topic, whatever its namespace."""
    if topic.endswith(f'/{interface.GROUND_TRUTH}'):
        return interface.GROUND_TRUTH
    return topic.rpartition('/')[2]


def namespace_of(topic: str) -> str:
    """What stands before our name of a topic."""
    return topic.removesuffix(role_of(topic))


def check_type(path: Path, topic: str, found: str) -> None:
    """Raise InputError when a topic with one of our names is of another type."""
    expected = KINDS[role_of(topic)]
    if found != expected:
        raise NotOursError(path, topic, expected, found)
