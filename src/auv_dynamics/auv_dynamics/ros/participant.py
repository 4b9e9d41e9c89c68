"""A participant in a domain beside the program, and one that starts the plant and follows a run."""

import time
from collections.abc import Callable
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import try_shutdown
from std_msgs.msg import Header
from std_srvs.srv import SetBool

from auv_dynamics.files.errors import FailedError, first_line, undisturbed
from auv_dynamics.ros import interface
from auv_dynamics.ros.endpoints import observes
from auv_dynamics.ros.node_interface import ASK_AGAIN
from auv_dynamics.ros.rclpy_internals import RCLError
from auv_dynamics.ros.security import enclave, require
from auv_dynamics.ros.topics import DIAGNOSTICS, PROGRESS, one_at_a_time


class Participant:
    """A node that is served whenever there is time for it; signals stay with the program.

    They wait while rclpy is at work, whose compiled half would take what they raise for its own.

    Parameters
    ----------
    domain : ROS domain id
    make : builds the node in a context
    executable : whose keys it joins with, where security is switched on

    Raises
    ------
    InputError : DDS security is asked for and cannot be had
    FailedError : ROS does not start, as without a folder for its logs

    """

    @undisturbed()
    def __init__(self, domain: int, make: Callable[[Context], Any], executable: str = 'auv'):
        require(executable)
        self._context = Context()
        try:
            rclpy.init(
                args=enclave(executable),
                context=self._context,
                domain_id=domain,
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except RCLError as error:
            raise FailedError(f'ROS does not start: {first_line(error)}') from None
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
            with undisturbed():
                self._executor.spin_once(timeout_sec=left)

    @undisturbed()
    def nodes(self) -> set[str]:
        """Full names of the nodes that are known so far, its own among them."""
        found = self._node.get_node_names_and_namespaces()
        return {f'{namespace.rstrip("/")}/{name}' for name, namespace in found}

    @undisturbed()
    def close(self) -> None:
        """Leave the domain."""
        self._node.destroy_node()
        self._executor.shutdown()
        try_shutdown(context=self._context)


def bare_node(name: str) -> Callable[[Context], Node]:
    """What builds a node of this name that is there and nothing else."""
    return lambda context: Node(
        name, context=context, start_parameter_services=False, enable_rosout=False
    )


class Watcher(Participant):
    """A participant of one domain that starts the plant and follows the recorder.

    Parameters
    ----------
    domain : ROS domain id

    Attributes
    ----------
    alive : nodes that have published their health since this was emptied

    """

    @undisturbed()
    def __init__(self, domain: int):
        super().__init__(domain, bare_node('auv'))
        self._node.create_subscription(
            PROGRESS.type, PROGRESS.name, self._on_progress, one_at_a_time()
        )
        self._node.create_subscription(
            DIAGNOSTICS.type, DIAGNOSTICS.name, self._on_diagnostics, one_at_a_time()
        )
        self.alive: set[str] = set()
        self._run = self._node.create_client(SetBool, 'plant_node/run')
        self._asked: Future | None = None
        self._asked_at = 0.0
        self.complete_ns = -1
        self.running = False
        self.waits_for = 'plant_node to appear'

    @undisturbed()
    def ask_to_run(self) -> bool:
        """Ask the plant to run, without waiting; True once it has agreed."""
        if self._asked is not None and self._asked.done():
            answer = self._asked.result()
            self.running = answer.success
            self.waits_for = f'{answer.message} to be ready'
            self._asked = None
        late = time.monotonic() - self._asked_at > ASK_AGAIN
        if not self.running and (self._asked is None or late) and self._run.service_is_ready():
            self._asked = self._run.call_async(SetBool.Request(data=True))
            self._asked_at = time.monotonic()
        return self.running

    @undisturbed()
    def endpoints(self) -> list[str]:
        """Nodes that publish or subscribe `wrench` or `odom` already, in any namespace.

        Observers are no strangers: they hold nothing up.
        """
        found: set[str] = set()
        for topic, _ in self._node.get_topic_names_and_types():
            if topic.rpartition('/')[2] in (interface.WRENCH, interface.ODOM):
                for look in (
                    self._node.get_publishers_info_by_topic,
                    self._node.get_subscriptions_info_by_topic,
                ):
                    others = [info for info in look(topic) if not observes(info)]
                    found.update(f'{info.node_name} on {topic}' for info in others)
        return sorted(found)

    def _on_progress(self, message: Header) -> None:
        self.complete_ns = max(self.complete_ns, interface.nanoseconds(message.stamp))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.alive.update(status.name.lstrip('/') for status in message.status)
