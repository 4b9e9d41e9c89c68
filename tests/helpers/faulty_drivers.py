"""Vehicle drivers in one process, one per namespace, each with the fault that it is named after.

They publish a motion that is known and take a wrench, which they do not obey.
"""

import sys
from collections.abc import Callable

import numpy as np
import rclpy
from geometry_msgs.msg import Wrench, WrenchStamped
from helpers.made_odometry import motion
from helpers.patience import patience
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message

from auv_dynamics.ros import convert
from auv_dynamics.ros.interface import NANOSECONDS, Frames
from auv_dynamics.vehicle.kinematics import rotation

RATE, SLOW = 50.0, 2.0  # Hz
SECONDS = patience(200.0)  # of motion: more than all tests of a module take
OLD = round(patience(10.0) * NANOSECONDS)  # well past the timeout that the test gives
HEALTHY = 'healthy'
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def in_world(x: np.ndarray) -> np.ndarray:
    x = x.copy()
    x[7:10] = rotation(x[3:7]) @ x[7:10]
    return x


def w_first(x: np.ndarray) -> np.ndarray:
    x = x.copy()
    x[3:7] = np.roll(x[3:7], 1)
    return x


def not_a_number(x: np.ndarray) -> np.ndarray:
    x = x.copy()
    x[9] = np.nan
    return x


STATES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    'world_twist': in_world,
    'w_first': w_first,
    'nan': not_a_number,
}
NAMES = (
    *(HEALTHY, *STATES, 'ros_frames', 'best_effort', 'frozen', 'old', 'slow', 'plain_wrench'),
    'garbled',
)


class Driver(Node):
    def __init__(self, name: str, states: np.ndarray):
        super().__init__('driver', namespace=name)
        self._name, self._states, self._k = name, states, 0
        qos = BEST_EFFORT if name == 'best_effort' else 10
        self._odom = self.create_publisher(Odometry, 'odom', qos)
        kind = Wrench if name == 'plain_wrench' else WrenchStamped
        self.create_subscription(kind, 'wrench', lambda _: None, 1)
        self._began = self.get_clock().now().nanoseconds
        self._every = round(RATE / SLOW) if name == 'slow' else 1

    def tick(self) -> None:
        now = self.get_clock().now().nanoseconds
        at = min(round((now - self._began) / NANOSECONDS * RATE), len(self._states) - 1)
        x = STATES.get(self._name, lambda x: x)(self._states[at])
        frames = Frames('odom', 'base_link') if self._name == 'ros_frames' else Frames()
        # the states are those of the grid: stamps are its times as well
        stamp = self._began + round(at * NANOSECONDS / RATE)
        stamp = {'frozen': self._began - OLD, 'old': stamp - OLD}.get(self._name, stamp)
        if at >= self._k + self._every or self._name == 'frozen':
            self._k = at
            message = convert.odometry(stamp, x, frames)
            if self._name == 'garbled' and at % 10 == 0:
                message = bytes(serialize_message(message))[:100]
            self._odom.publish(message)


def main() -> None:
    rclpy.init()
    states = motion(SECONDS, RATE)
    executor = SingleThreadedExecutor()
    drivers = [Driver(name, states) for name in NAMES]
    for driver in drivers:
        executor.add_node(driver)
    # one timer for all: rclpy looks at every node each time that it wakes up
    drivers[0].create_timer(1.0 / RATE, lambda: [driver.tick() for driver in drivers])
    print('ready', flush=True)
    executor.spin()


if __name__ == '__main__':
    sys.exit(main())
