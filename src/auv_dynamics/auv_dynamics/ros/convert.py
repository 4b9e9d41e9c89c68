"""Messages from numbers: the only place where a message's fields are written."""

from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import AccelStamped, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from auv_dynamics.ros.interface import NANOSECONDS, Frames
from auv_dynamics.vehicle import DOFS


def stamp(ns: int) -> Time:
    """Time message of nanoseconds."""
    sec, nanosec = divmod(ns, NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def _fill3(vector: Any, x: float, y: float, z: float) -> None:
    vector.x, vector.y, vector.z = float(x), float(y), float(z)


def odometry(ns: int, x: Any, frames: Frames) -> Odometry:
    """Odometry of a plant state (13,): position, quaternion w x y z, nu in the child frame."""
    message = Odometry()
    message.header.stamp = stamp(ns)
    message.header.frame_id = frames.odom
    message.child_frame_id = frames.base
    pose, twist = message.pose.pose, message.twist.twist
    _fill3(pose.position, x[0], x[1], x[2])
    q = pose.orientation
    q.w, q.x, q.y, q.z = float(x[3]), float(x[4]), float(x[5]), float(x[6])
    _fill3(twist.linear, x[7], x[8], x[9])
    _fill3(twist.angular, x[10], x[11], x[12])
    return message


def _stamped(message: Any, ns: int, frames: Frames) -> Any:
    message.header.stamp, message.header.frame_id = stamp(ns), frames.base
    return message


def _six(message: Any, parts: tuple[Any, Any], ns: int, values: Any, frames: Frames) -> Any:
    _fill3(parts[0], *values[:3])
    _fill3(parts[1], *values[3:])
    return _stamped(message, ns, frames)


def twist(ns: int, nu: Any, frames: Frames) -> TwistStamped:
    """TwistStamped of (6,) m/s, rad/s in the body frame."""
    message = TwistStamped()
    return _six(message, (message.twist.linear, message.twist.angular), ns, nu, frames)


def accel(ns: int, nu_dot: Any, frames: Frames) -> AccelStamped:
    """AccelStamped of (6,) m/s2, rad/s2 in the body frame."""
    message = AccelStamped()
    return _six(message, (message.accel.linear, message.accel.angular), ns, nu_dot, frames)


def wrench(ns: int, tau: Any, frames: Frames) -> WrenchStamped:
    """WrenchStamped of (6,) N, N m in the body frame."""
    message = WrenchStamped()
    return _six(message, (message.wrench.force, message.wrench.torque), ns, tau, frames)


def joint_state(ns: int, effort: Any, frames: Frames) -> JointState:
    """JointState whose names are the DOF words and whose `effort` holds (6,) numbers."""
    message = _stamped(JointState(), ns, frames)
    message.name, message.effort = list(DOFS), [float(value) for value in effort]
    return message
