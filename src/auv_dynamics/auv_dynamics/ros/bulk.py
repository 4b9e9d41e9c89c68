"""The graph's data path: subscriptions that are emptied in bulk, beside the executor.

An executor of rclpy rebuilds its whole wait set, services and timers included, for every message.
Here the data subscriptions have a small wait set of their own, and all that has arrived is taken
at once; the executor serves parameters, services and timers in between. With AUV_GVC_EXECUTOR=plain
the same subscriptions are ordinary ones.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import Any

from rclpy.exceptions import ParameterUninitializedException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription

from auv_dynamics.ros.private import PLAIN, DataWait, taken
from auv_dynamics.ros.topics import CLOCK, DEPTH

NAP = 0.005  # s between two looks at an observer's data


class BulkMixin:
    """Keeps data subscriptions out of the executor's sight; stands before `Node`.

    A node that must answer at once is `prompt`: its data is waited for. At others one looks now and
    then: the longer the naps, the more there is to be taken at once.
    """

    prompt = False
    exit_code: int | None = None  # set when the node ends by itself
    task = ''  # what it does, once it has begun

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """The subscriptions that an executor waits for."""
        hidden = self.data_subscriptions()
        mine = super().subscriptions  # type: ignore[misc]  # of the Node behind the mixin
        return (s for s in mine if PLAIN or not (s in hidden or _is_clock(s)))

    def get_parameter(self, name: str) -> Parameter:
        """A parameter, also one that is not set.

        rclpy raises for it, and its service then answers nothing about all the others either.
        """
        try:
            return super().get_parameter(name)  # type: ignore[misc]  # as above
        except ParameterUninitializedException:
            return Parameter(name)

    def begin(self, task: str) -> None:
        """Say in a line what the node does from now on."""
        self.task = task
        self.get_logger().info(f'begins: {task}')  # type: ignore[attr-defined]  # as above

    def finish(self) -> None:
        """Say that it is over, and how it went."""
        if self.task:
            text = f'ends with exit code {self.exit_code or 0}: {self.task}'
            self.get_logger().info(text)  # type: ignore[attr-defined]  # as above

    def close(self) -> None:
        """Last words while the context is still valid: zero wrench, closed bag."""

    def data_subscriptions(self) -> list[Subscription]:
        """The subscriptions of the data path."""
        return self.__dict__.setdefault('_data_subscriptions', [])

    def add_data(self, subscription: Subscription) -> None:
        """Take a subscription, with a callback (message, info), away from the executor."""
        if not PLAIN:
            self.data_subscriptions().append(subscription)

    def drop_data(self, subscription: Subscription) -> None:
        """End a subscription of the data path."""
        if subscription in self.data_subscriptions():
            self.data_subscriptions().remove(subscription)
        super().destroy_subscription(subscription)  # type: ignore[misc]  # as above

    def take_data(self) -> int:
        """Hand everything that has arrived to its callbacks; how many messages that were."""
        count = 0
        for subscription in self.data_subscriptions():
            callback = subscription.callback
            # not without end, should they come as fast as they are taken
            for message, info in islice(taken(subscription), DEPTH):
                callback(message, info)
                count += 1
        return count

    def follow_clock(self) -> None:
        """Tell rclpy's clock the newest simulated time."""
        mine = super().subscriptions  # type: ignore[misc]  # of the Node behind the mixin
        for subscription in [s for s in mine if not PLAIN and _is_clock(s)]:
            for newest, _ in list(taken(subscription))[-1:]:
                subscription.callback(newest)


class BulkNode(BulkMixin, Node):
    """A node with a data path of its own: see `BulkMixin`."""


class DataPath:
    """Serves the data of the nodes of a process, in one thread.

    Parameters
    ----------
    nodes : of one context

    """

    def __init__(self, nodes: Sequence[Any]):
        self._prompt = [node for node in nodes if node.prompt]
        self._observers = [node for node in nodes if not node.prompt]
        self._wait = DataWait(nodes[0].context)
        self._look_at = 0.0

    def serve(self, until: float, ended: Callable[[], bool]) -> None:
        """Take data as it comes until a time of the monotonic clock, or until a node has ended."""
        while (now := time.monotonic()) < until and not ended():
            if now >= self._look_at:
                for node in self._observers:
                    node.take_data()
                self._look_at = time.monotonic() + NAP
            rest = min(self._look_at, until) if self._observers else until
            self._serve_prompt(rest, ended)

    def _serve_prompt(self, until: float, ended: Callable[[], bool]) -> None:
        prompt = self._prompt
        if not prompt:
            time.sleep(max(0.0, until - time.monotonic()))
            return
        while (left := until - time.monotonic()) > 0 and not ended():
            # one node's answer may be the other's question: wait only when nothing came
            if not sum(node.take_data() for node in prompt):
                waited_for = [s for node in prompt for s in node.data_subscriptions()]
                self._wait.wait(waited_for, left)


def _is_clock(subscription: Subscription) -> bool:
    """Whether this is the subscription that rclpy makes for `use_sim_time`."""
    return subscription.topic == CLOCK.name and not subscription.raw
