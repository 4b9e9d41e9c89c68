"""The other nodes that a node waits for before it starts."""

import time

from rclpy.exceptions import InvalidServiceNameException
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.graph import steady_timer

ASK_AGAIN = 1.0  # s: an answer is lost when it comes before both ends have matched


class Peers:
    """Asks the `~/ready` of other nodes until each has said yes.

    Parameters
    ----------
    node : that asks
    names : of the nodes, relative to its namespace

    Raises
    ------
    InputError : a node cannot have such a name

    """

    def __init__(self, node: Node, names: list[str]):
        try:
            self._clients = {name: node.create_client(Trigger, f'{name}/ready') for name in names}
        except InvalidServiceNameException:
            raise InputError(node.get_name(), 'start_after', 'names of nodes', names) from None
        self._pending: dict[str, tuple[float, Future]] = {}
        self._ready: set[str] = set()
        if names:
            self._timer = steady_timer(node, 0.05, self._ask)

    def not_ready(self) -> str:
        """Name of the first node that has not said yes, or an empty text."""
        return next((name for name in self._clients if name not in self._ready), '')

    def _ask(self) -> None:
        for name, client in self._clients.items():
            if name in self._ready or not client.service_is_ready():
                continue
            asked, future = self._pending.get(name, (0.0, None))
            if future is None or time.monotonic() - asked > ASK_AGAIN:
                self._pending[name] = (time.monotonic(), client.call_async(Trigger.Request()))
            elif future.done():
                if future.result() is not None and future.result().success:
                    self._ready.add(name)
                del self._pending[name]
        if not self.not_ready():
            self._timer.cancel()
