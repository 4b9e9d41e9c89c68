"""A node of its own context in one domain, beside whatever else the process does."""

import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from auv_dynamics.ros.security import enclave, require


class Participant:
    """A node that is served whenever there is time for it; signals stay with the program.

    Parameters
    ----------
    domain : ROS domain id
    make : builds the node in a context
    executable : whose keys it joins with, where security is switched on

    Raises
    ------
    InputError : DDS security is asked for and cannot be had

    """

    def __init__(self, domain: int, make: Callable[[Context], Any], executable: str = 'auv'):
        require(executable)
        self._context = Context()
        rclpy.init(
            args=enclave(executable),
            context=self._context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        try:
            self._node = make(self._context)
        except BaseException:
            try_shutdown(context=self._context)
            raise
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def spin(self, seconds: float) -> None:
        """Handle what comes in for so long."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def nodes(self) -> set[str]:
        """Full names of the nodes that are known so far, its own among them."""
        found = self._node.get_node_names_and_namespaces()
        return {f'{namespace.rstrip("/")}/{name}' for name, namespace in found}

    def close(self) -> None:
        """Leave the domain."""
        self._node.destroy_node()
        self._executor.shutdown()
        try_shutdown(context=self._context)
