"""Our nodes in the test's own process, and their messages written and read field by field.

Nothing of ours makes or reads the messages here: an axis that `convert` and `interface` exchanged
alike would not be seen by either.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import AccelStamped, TwistStamped, WrenchStamped
from helpers.fork_server import PERIOD
from helpers.node_processes import Peer, fresh_domain
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

from auv_analysis.nodes import replay_node
from auv_dynamics.files.errors import InputError
from auv_dynamics.nodes import plant_node
from auv_dynamics.ros import node_interface

MEETING = (plant_node, 'MET'), (replay_node, 'DISCOVERY'), (replay_node, 'ANNOUNCED')  # s
SECOND = 10**9
NED, FSD = 'odom_ned', 'base_link_fsd'
AXES = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
PARTS = {  # of a stamped message: its linear and its angular vector
    TwistStamped: lambda m: (m.twist.linear, m.twist.angular),
    AccelStamped: lambda m: (m.accel.linear, m.accel.angular),
    WrenchStamped: lambda m: (m.wrench.force, m.wrench.torque),
}


class Program(Peer):
    """A program with nodes of ours and one of its own, in one executor of rclpy's."""

    def __init__(self, domain: int | None = None) -> None:
        super().__init__(fresh_domain() if domain is None else domain)
        node_interface.DIAGNOSTICS_PERIOD = PERIOD
        self.nodes: list[Any] = []

    def add(self, make: type, given: dict[str, Any] | list[str], **options: Any) -> Any:
        """Add a node with parameters, or with arguments as on its command line."""
        values = []
        if isinstance(given, dict):
            values = [Parameter(name, value=value) for name, value in given.items()]
        else:
            options['cli_args'] = ['--ros-args', *given]
        options |= {'context': self.context, 'use_global_arguments': False}
        node = make.__new__(make)
        try:
            node.__init__(parameter_overrides=values, **options)
        except ValueError:
            _end(node)
            raise
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def drop(self, node: Any) -> None:
        """End a node as its process would."""
        self.nodes.remove(node)
        self.executor.remove_node(node)
        node.close()
        _end(node)

    def close(self) -> None:
        """End everything."""
        for node in [*self.nodes]:
            self.drop(node)
        super().close()


def _end(node: Any) -> None:
    """Take a node, or what there is of one that was refused, out of the graph at once.

    rclpy keeps a lifecycle node there until Python collects it, and a middleware's participant with
    it. They are numbered within a process: from the tenth on `is_free` does not look for them.
    """
    Node.destroy_node(node)
    vars(node).clear()


@contextmanager
def program(domain: int | None = None) -> Iterator[Program]:
    """A program that is ended after the test, by default in a domain of its own.

    Its nodes are one participant of the middleware: none has to wait until it has met the others.
    """
    made = Program(domain)
    try:
        with pytest.MonkeyPatch.context() as patch:
            for module, name in MEETING:
                patch.setattr(module, name, 0.0)
            yield made
    finally:
        made.close()


def assert_refused(make: type, arguments: list[str], *words: str) -> None:
    """Wrong input: the one line with which the node's process ends has the words in it."""
    with program() as made, pytest.raises(InputError) as caught:
        made.add(make, arguments)
    for word in words:
        assert word in str(caught.value)


def write_vehicle(folder: Path, data: dict[str, Any]) -> Path:
    """A vehicle file of what the independent implementation takes."""
    path = folder / 'vehicle.yaml'
    path.write_text(yaml.safe_dump({'format': 1, 'name': 'made', **data}))
    return path


def quaternion_of(rotation: np.ndarray) -> np.ndarray:
    """Quaternion w x y z of a rotation (3, 3): an eigenvector, by Bar-Itzhack (2000)."""
    a, b, c = rotation
    K = np.array(
        [
            [a[0] - b[1] - c[2], 0, 0, 0],
            [b[0] + a[1], b[1] - a[0] - c[2], 0, 0],
            [c[0] + a[2], c[1] + b[2], c[2] - a[0] - b[1], 0],
            [c[1] - b[2], a[2] - c[0], b[0] - a[1], a[0] + b[1] + c[2]],
        ]
    )
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    return np.array([w, x, y, z])


def _stamp(message: Any, ns: int, frame: str) -> Any:
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, SECOND)
    message.header.frame_id = frame
    return message


def odometry(ns: int, x: Any) -> Odometry:
    """Odometry of a state (13,): position, quaternion w x y z, twist."""
    message = _stamp(Odometry(), ns, NED)
    message.child_frame_id = FSD
    p, q, t = message.pose.pose.position, message.pose.pose.orientation, message.twist.twist
    p.x, p.y, p.z, q.w, q.x, q.y, q.z = map(float, x[:7])
    t.linear.x, t.linear.y, t.linear.z = map(float, x[7:10])
    t.angular.x, t.angular.y, t.angular.z = map(float, x[10:])
    return message


def state_of(message: Odometry) -> list[float]:
    """State (13,) of an odometry."""
    p, q, t = message.pose.pose.position, message.pose.pose.orientation, message.twist.twist
    twist = [t.linear.x, t.linear.y, t.linear.z, t.angular.x, t.angular.y, t.angular.z]
    return [p.x, p.y, p.z, q.w, q.x, q.y, q.z, *twist]


def six(kind: type, ns: int, values: Any) -> Any:
    """TwistStamped, AccelStamped or WrenchStamped of (6,) in the body frame."""
    message = _stamp(kind(), ns, FSD)
    linear, angular = PARTS[kind](message)
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = map(float, values)
    return message


def six_of(message: Any) -> list[float]:
    """The six numbers of a message."""
    if isinstance(message, JointState):
        assert tuple(message.name) == AXES
        return list(message.effort)
    linear, angular = PARTS[type(message)](message)
    return [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]


def ns_of(message: Any) -> int:
    """Stamp of a message, ns."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def frames_of(message: Any) -> tuple[str, ...]:
    """Frame ids of a message."""
    child = (message.child_frame_id,) if isinstance(message, Odometry) else ()
    return message.header.frame_id, *child
