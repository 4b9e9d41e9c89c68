"""Messages in the frames of ROS (ENU, FLU) <-> messages in ours (NED, FSD); stamps are kept.

Each function leads from one side to the other and, with the frames exchanged, back. What must not
be used raises BadMessageError.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import AccelStamped, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry

from auv_dynamics.ros import convert, interface
from auv_dynamics.ros.interface import BadMessageError, Frames
from auv_dynamics.vehicle.frames import (
    swap_body,
    swap_body_matrix,
    swap_earth_matrix,
    swap_state,
)

CHILD, WORLD = 'child', 'world'  # frame in which an odometry's twist is written
_MAKERS: dict[type, Callable[..., Any]] = {
    TwistStamped: convert.twist,
    AccelStamped: convert.accel,
    WrenchStamped: convert.wrench,
}
_READERS: dict[type, Callable[..., Any]] = {
    TwistStamped: interface.read_twist,
    AccelStamped: interface.read_accel,
    WrenchStamped: interface.read_wrench,
}


def mirrored(message: Any, here: Frames, there: Frames, topic: str) -> Any:
    """TwistStamped, AccelStamped or WrenchStamped in the other body frame.

    Parameters
    ----------
    message : in the body frame of `here`: FSD or FLU
    here, there : frame ids that it must have, and those that it gets
    topic : its name, for what is refused

    Returns
    -------
    message : in the body frame of `there`: FLU or FSD, same stamp

    Raises
    ------
    BadMessageError : another frame id, or a number that is not finite

    """
    ns, values = _READERS[type(message)](message, here, topic)
    return _MAKERS[type(message)](ns, swap_body(values), there)


def mirrored_odometry(
    message: Odometry, here: Frames, there: Frames, topic: str, twist_frame: str = CHILD
) -> Odometry:
    """Odometry in the other frames, its twist in the child frame.

    Parameters
    ----------
    message : pose in `here.odom`, NED or ENU
    here, there : frame ids that it must have, and those that it gets
    topic : its name, for what is refused
    twist_frame : 'child': its twist and their covariance are in the child frame, as nav_msgs says;
        'world': in the frame of the pose, as some drivers have them

    Returns
    -------
    message : pose in `there.odom`, twist in `there.base`, covariances turned, same stamp

    Raises
    ------
    BadMessageError : another frame id, a number that is not finite, no unit quaternion

    """
    ns, state = interface.read_odometry(message, here, topic)
    x = np.array(state)
    x[3:7] /= np.linalg.norm(x[3:7])
    poses = _covariance(message.pose.covariance, f'{topic}: pose.covariance')
    twists = _covariance(message.twist.covariance, f'{topic}: twist.covariance')
    if twist_frame == WORLD:
        from auv_dynamics.vehicle.kinematics import rotation  # which loads numba, needed here alone

        to_child = np.kron(np.eye(2), rotation(x[3:7]).T)
        x[7:] = to_child @ x[7:]
        twists = to_child @ twists @ to_child.T
    result = convert.odometry(ns, swap_state(x), there)
    result.pose.covariance = swap_earth_matrix(poses).ravel()
    result.twist.covariance = swap_body_matrix(twists).ravel()
    return result


def _covariance(values: Sequence[float], what: str) -> np.ndarray:
    bad = [float(value) for value in values if not math.isfinite(value)]
    if bad:
        raise BadMessageError(f'{what}: not finite: expected finite numbers, found {bad[0]}')
    return np.array(values).reshape(6, 6)
