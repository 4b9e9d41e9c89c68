"""A node that says every odometry again on COUNT topics of its own, for more topics to record."""

import sys

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.utilities import try_shutdown

from auv_dynamics.ros import interface
from auv_dynamics.ros.topics import every_step


def main() -> None:
    """Say it again until SIGTERM."""
    rclpy.init()
    node = rclpy.create_node('echo')
    outputs = [
        node.create_publisher(Odometry, f'echo_{i}', every_step()) for i in range(int(sys.argv[1]))
    ]

    def again(message: bytes) -> None:
        for output in outputs:
            output.publish(message)

    node.create_subscription(Odometry, interface.ODOM, again, every_step(), raw=True)
    print('ready', flush=True)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        try_shutdown()


if __name__ == '__main__':
    main()
