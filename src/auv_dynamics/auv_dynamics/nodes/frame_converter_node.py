"""The frame converter as a node: a driver in ENU and FLU on one side, our graph on the other."""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import topics
from auv_dynamics.ros.bulk import BulkNode
from auv_dynamics.ros.codec import message_of
from auv_dynamics.ros.graph import Graph, steady_timer
from auv_dynamics.ros.interface import ROS_FRAMES, Frames, nanoseconds
from auv_dynamics.ros.life import main_of
from auv_dynamics.ros.mirror import CHILD, WORLD, mirrored, mirrored_odometry
from auv_dynamics.ros.parameters import declare, refuse_unknown
from auv_dynamics.ros.topics import Topic
from auv_dynamics.vehicle import frames

ENU_FLU = 'enu_flu'  # what the driver's topics begin with


class FrameConverterNode(BulkNode):
    """Converts odometry and set-points to NED and FSD, the wrench to FLU: never a silent flip."""

    prompt = True

    def __init__(self) -> None:
        super().__init__('frame_converter_node')
        self.graph = Graph(self)
        ours = self.graph.frames
        theirs = Frames(
            declare(
                self,
                'enu_frame',
                str,
                ROS_FRAMES.odom,
                "frame id of the driver's poses: east-north-up",
            ),
            declare(
                self,
                'flu_frame',
                str,
                ROS_FRAMES.base,
                "frame id of the driver's body: forward-left-up",
            ),
        )
        self._twist_frame = declare(
            self, 'twist_frame', str, CHILD, "frame of the twist in the driver's odometry",
            one_of=(CHILD, WORLD),
        )  # fmt: skip
        self.lockstep = declare(
            self, 'lockstep', bool, False, 'each step waits for its wrench; else real time'
        )
        refuse_unknown(self)
        self._check_axes(ours, theirs)
        self._held: deque[tuple[Publisher, Any]] = deque(maxlen=topics.DEPTH)
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
        steady_timer(self, 0.05, self._say_held)
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
            self._held.append((publisher, converted))
            self._say_held()

        self.graph.subscribe(source, take, qos)
        return publisher

    def _say_held(self) -> None:
        """Publish what has been converted, in order, once the expected subscribers are there."""
        while self._held and self.graph.ready():
            publisher, message = self._held.popleft()
            publisher.publish(message)
            self.graph.latest_ns = nanoseconds(message.header.stamp)

    def _untaken(self) -> str:
        if self._commanded.get_subscription_count():
            return ''
        return f'{_theirs(topics.WRENCH).name}: expected a subscriber, found none'


def _theirs(topic: Topic) -> Topic:
    """The driver's topic of one of ours."""
    return replace(topic, name=f'{ENU_FLU}/{topic.name}')


def main() -> None:
    """Run the node."""
    main_of(FrameConverterNode)
