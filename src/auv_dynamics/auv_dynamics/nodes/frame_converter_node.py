"""The frame converter: a driver in ENU and FLU on one side, our graph on the other."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.codec import KINDS, message_of
from auv_dynamics.ros.endpoints import acts, hearers, looks_on
from auv_dynamics.ros.interface import ROS_FRAMES, BadMessageError, Frames, nanoseconds
from auv_dynamics.ros.node_interface import NodeInterface, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import declare_settings
from auv_dynamics.ros.settings import setting
from auv_dynamics.ros.topics import Topic
from auv_dynamics.vehicle import frames
from auv_dynamics.vehicle.frames import swap_body, swap_body_matrix, swap_earth_matrix, swap_state

CHILD, WORLD = 'child', 'world'  # frame in which an odometry's twist is written


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
    kind = KINDS[type(message)]
    ns, values = kind.read(message, here, topic)  # type: ignore[misc]  # as each of these is
    return kind.make(ns, swap_body(np.array(values)), there)


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
        from auv_dynamics.vehicle.kinematics import rotation

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


ENU_FLU = 'enu_flu'  # what the driver's topics begin with


@dataclass(frozen=True)
class ConverterSettings:
    """Settings of the frame converter."""

    enu_frame: str = setting(ROS_FRAMES.odom, "frame id of the driver's poses: east-north-up")
    flu_frame: str = setting(ROS_FRAMES.base, "frame id of the driver's body: forward-left-up")
    twist_frame: str = setting(
        CHILD, "frame of the twist in the driver's odometry", one_of=(CHILD, WORLD)
    )


class FrameConverterNode(BulkNode):
    """Converts odometry and set-points to NED and FSD, the wrench to FLU: never a silent flip."""

    latency_critical = True

    def __init__(self, **options: Any):
        super().__init__('frame_converter_node', **options)
        self.graph = NodeInterface(self)
        ours = self.graph.frames
        p = declare_settings(self, ConverterSettings)
        theirs, self._twist_frame = Frames(p.enu_frame, p.flu_frame), p.twist_frame
        self._check_axes(ours, theirs)
        self._held: deque[tuple[Publisher, Any]] = deque(maxlen=interface.DEPTH)
        inward = partial(mirrored, here=theirs, there=ours)
        outward = partial(mirrored, here=ours, there=theirs)
        lockstep, every = topics.one_at_a_time(), topics.every_step()
        odometry = lockstep if self.lockstep else topics.newest_measurement()
        command = lockstep if self.lockstep else topics.newest_command()
        odom = partial(mirrored_odometry, here=theirs, there=ours, twist_frame=self._twist_frame)
        self._pass(_theirs(topics.ODOM), topics.ODOM, odom, odometry)
        for setpoint in (topics.CMD_VEL, topics.CMD_ACCEL):
            self._pass(_theirs(setpoint), setpoint, inward, every)
        self._commanded = self._pass(topics.WRENCH, _theirs(topics.WRENCH), outward, command)
        self.graph.also_ready_when(self._untaken)
        steady_timer(self, 0.05, self._publish_held)
        self.begin(f'converts {ENU_FLU}/* of a driver to {ours.odom} and {ours.base}, and back')

    def _check_axes(self, ours: Frames, theirs: Frames) -> None:
        """Refuse frame ids that name the axes of the other side."""
        for ids, axes, keys in (
            (ours, frames.ENU_FLU, ('odom_frame', 'base_frame')),
            (theirs, frames.NED_FSD, ('enu_frame', 'flu_frame')),
        ):
            for key, frame_id in zip(keys, (ids.odom, ids.base), strict=True):
                if frames.named_axes(frame_id) == axes:
                    expected = 'a frame whose name does not say the axes of the other side'
                    raise InputError(self.get_name(), key, expected, frame_id)

    def _pass(
        self, source: Topic, target: Topic, convert: Callable[..., Any], qos: QoSProfile
    ) -> Publisher:
        """Publish on `target` what arrives on `source`, converted."""
        publisher = self.graph.publisher(target)
        count = f'{target.name} converted'
        self.graph.facts[count] = 0

        def take(data: bytes, _: dict[str, Any]) -> None:
            message = message_of(data, source.type, source.name)
            converted = convert(message, topic=source.name)
            self.graph.facts[count] += 1
            if self.lockstep or self.graph.ready():  # in real time it would be old once it is heard
                self._held.append((publisher, converted))
                self._publish_held()

        self.graph.subscribe(source, take, qos)
        return publisher

    def _publish_held(self) -> None:
        """Publish what has been converted, in order, once the expected subscribers are there."""
        while self._held and self.graph.ready():
            publisher, message = self._held.popleft()
            publisher.publish(message)
            self.graph.latest_ns = nanoseconds(message.header.stamp)

    def _untaken(self) -> str:
        heard_by = hearers(self, self._commanded)
        idle = sum(looks_on(self.get_namespace(), one) or not acts(one) for one in heard_by)
        if self._commanded.get_subscription_count() > idle:
            return ''
        return f'{_theirs(topics.WRENCH).name}: expected a subscriber, found none'


def _theirs(topic: Topic) -> Topic:
    """The driver's topic of one of ours."""
    return replace(topic, name=f'{ENU_FLU}/{topic.name}')


def main() -> None:
    """Run the node."""
    main_of(FrameConverterNode)
