"""What the messages of other systems hold: type -> how its numbers are taken out."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.ros.interface import LARGEST, nanoseconds

UNIT = 1e-2  # of the norm of a quaternion: what rounding to single precision leaves, and more
Numbers = tuple[float, ...]


def type_name(name: str) -> str:
    """A message type as ROS 2 writes it: 'nav_msgs/Odometry' becomes 'nav_msgs/msg/Odometry'.

    A name without a package stays as it is: nobody's type, but a schema may be called so.
    """
    package, slash, rest = name.partition('/')
    return f'{package}/msg/{rest.rpartition("/")[2]}' if slash else name


class Reading(NamedTuple):
    """What one message says.

    Attributes
    ----------
    stamp : ns, None of a message without header
    frame, child : frame ids, '' where the message has none
    row : its numbers

    """

    stamp: int | None
    frame: str
    child: str
    row: Numbers


def _vector(v: Any) -> Numbers:
    return v.x, v.y, v.z


def _pose(pose: Any) -> Numbers:
    q = pose.orientation
    return *_vector(pose.position), q.w, q.x, q.y, q.z


def _twist(twist: Any) -> Numbers:
    return *_vector(twist.linear), *_vector(twist.angular)


def _wrench(wrench: Any) -> Numbers:
    return *_vector(wrench.force), *_vector(wrench.torque)


def _stamped(take: Callable[[Any], Numbers]) -> Callable[[Any], Reading]:
    def read(message: Any) -> Reading:
        header = message.header
        child = getattr(message, 'child_frame_id', '')
        return Reading(nanoseconds(header.stamp), header.frame_id, child, take(message))

    return read


def _bare(take: Callable[[Any], Numbers]) -> Callable[[Any], Reading]:
    return lambda message: Reading(None, '', '', take(message))


# roles: 'odometry' 13 numbers (position, quaternion w x y z, twist), 'pose' the first 7 of them,
# 'twist' and 'wrench' 6, 'thrusters' one per thruster
READERS: dict[str, dict[str, Callable[[Any], Reading]]] = {
    'odometry': {
        'nav_msgs/msg/Odometry': _stamped(lambda m: (*_pose(m.pose.pose), *_twist(m.twist.twist))),
    },
    'pose': {
        'geometry_msgs/msg/PoseStamped': _stamped(lambda m: _pose(m.pose)),
        'geometry_msgs/msg/PoseWithCovarianceStamped': _stamped(lambda m: _pose(m.pose.pose)),
        'nav_msgs/msg/Odometry': _stamped(lambda m: _pose(m.pose.pose)),
    },
    'twist': {
        'geometry_msgs/msg/TwistStamped': _stamped(lambda m: _twist(m.twist)),
        'geometry_msgs/msg/TwistWithCovarianceStamped': _stamped(lambda m: _twist(m.twist.twist)),
        'geometry_msgs/msg/Twist': _bare(_twist),
        'nav_msgs/msg/Odometry': _stamped(lambda m: _twist(m.twist.twist)),
    },
    'wrench': {
        'geometry_msgs/msg/WrenchStamped': _stamped(lambda m: _wrench(m.wrench)),
        'geometry_msgs/msg/Wrench': _bare(_wrench),
    },
    'thrusters': {
        'std_msgs/msg/Float64MultiArray': _bare(lambda m: tuple(map(float, m.data))),
        'std_msgs/msg/Float32MultiArray': _bare(lambda m: tuple(map(float, m.data))),
        'sensor_msgs/msg/JointState': _stamped(lambda m: tuple(map(float, m.effort))),
    },
}
READERS['wrench_applied'] = READERS['wrench']
READERS['setpoint'] = READERS['twist']


def are_usable(rows: np.ndarray, role: str) -> np.ndarray:
    """Whether each row (n, k) can be used: finite, not absurd, and poses with unit quaternions."""
    finite = np.all(np.abs(rows) < LARGEST, axis=1)  # NaN: false
    if role not in ('odometry', 'pose'):
        return finite
    return finite & (np.abs(np.linalg.norm(rows[:, 3:7], axis=1) - 1.0) < UNIT)
