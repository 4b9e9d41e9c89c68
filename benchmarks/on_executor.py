"""An executable of nodes on an executor of rclpy: python on_executor.py plain|events EXECUTABLE...

What is compared with the executor of lock-step, `DataPath`: every message served by rclpy alone.
"""

import os
import runpy
import sys
from collections.abc import Callable
from typing import Any

from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node

from auv_dynamics.ros import node_main

PLAIN, EVENTS = 'plain', 'events'


def use_events() -> None:
    """Put rclpy's EventsExecutor in the place of its SingleThreadedExecutor.

    That of rclpy 7.1 fails for callbacks that are told how a message came: these learn nothing, so
    that the recorder does not follow the numbers of the publications.
    """
    subscribe = Node.create_subscription

    def create(self: Node, kind: Any, topic: str, callback: Any, *rest: Any, **how: Any) -> Any:
        if how.get('raw'):
            return subscribe(self, kind, topic, _uninformed(callback), *rest, **how)
        return subscribe(self, kind, topic, callback, *rest, **how)

    def serve(_: Any, executor: Any, timeout: float) -> bool:
        executor.spin_once(timeout)
        return False

    changed: Any = node_main  # for this process alone
    nodes: Any = Node
    nodes.create_subscription = create
    changed.SingleThreadedExecutor, changed.serve = EventsExecutor, serve


def _uninformed(callback: Callable[[Any, Any], None]) -> Callable[[Any], None]:
    return lambda message: callback(message, {})


if __name__ == '__main__':
    os.environ['AUV_GVC_EXECUTOR'] = 'plain'
    if sys.argv[1] == EVENTS:
        use_events()
    sys.argv = sys.argv[2:]
    runpy.run_path(sys.argv[0], run_name='__main__')
