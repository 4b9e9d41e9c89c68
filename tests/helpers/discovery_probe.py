"""A participant on another machine that knows an address: which nodes does it find?"""

import sys
import time

import rclpy


def main(seconds: str) -> None:
    """Print the nodes that are found within so many s, or at once where there are some."""
    rclpy.init()
    node = rclpy.create_node('outsider')
    until = time.monotonic() + float(seconds)
    found: set[str] = set()
    while not found and time.monotonic() < until:
        rclpy.spin_once(node, timeout_sec=0.1)
        found = set(node.get_node_names()) - {'outsider'}
    print(*sorted(found))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main(*sys.argv[1:])
