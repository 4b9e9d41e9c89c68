"""The graph's data path: subscriptions that are emptied in bulk, beside the executor.

An executor of rclpy rebuilds its whole wait set, services and timers included, for every message.
Here the data subscriptions have a small wait set of their own, and all that has arrived is taken
at once; the executor serves parameters, services and timers in between. This file is the only
one that touches private names of rclpy. Where they are missing, or with AUV_GVC_EXECUTOR=plain,
the same subscriptions are ordinary ones.
"""

import os
import struct
import time
from collections.abc import Iterator
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from auv_dynamics.ros.topics import CLOCK

try:
    from rclpy.impl.implementation_singleton import rclpy_implementation

    WaitSet = rclpy_implementation.WaitSet
except (ImportError, AttributeError):
    WaitSet = None

PLAIN = WaitSet is None or os.environ.get('AUV_GVC_EXECUTOR') == 'plain'
NAP = 0.005  # s between two looks of an observer

_STAMP = struct.Struct('<iI')
_STAMP_BIG = struct.Struct('>iI')
_OFFSET = 4  # of the first field, behind the CDR encapsulation header


def first_stamp(data: bytes) -> int:
    """Nanoseconds of a serialized message that begins with a Header or a Time."""
    little = data[1] & 1
    sec, nanosec = (_STAMP if little else _STAMP_BIG).unpack_from(data, _OFFSET)
    return sec * 10**9 + nanosec


def taken(subscription: Subscription) -> Iterator[Any]:
    """Everything that has arrived on a subscription."""
    handle = subscription.handle
    with handle:
        while (entry := handle.take_message(subscription.msg_type, subscription.raw)) is not None:
            yield entry[0]


class BulkMixin:
    """Keeps data subscriptions out of the executor's sight; stands before `Node`.

    A node that must answer at once is `prompt`: it waits for its data. Others look now and then.
    """

    context: Any
    prompt = False
    exit_code: int | None = None  # set when the node ends by itself

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """The subscriptions that an executor waits for."""
        hidden = self._bulk()
        mine = super().subscriptions  # type: ignore[misc]  # of the Node behind the mixin
        return (s for s in mine if PLAIN or not (s in hidden or _is_clock(s)))

    def close(self) -> None:
        """Last words while the context is still valid: zero wrench, closed bag."""

    def _bulk(self) -> list[Subscription]:
        return self.__dict__.setdefault('bulk_subscriptions', [])

    def add_bulk(self, subscription: Subscription) -> None:
        """Take a subscription away from the executor."""
        if not PLAIN:
            self._bulk().append(subscription)

    def wait_for_bulk(self, timeout: float) -> None:
        """Wait until data has arrived, at most `timeout` s; an observer only naps."""
        subscriptions = self._bulk()
        if not self.prompt or not subscriptions:
            time.sleep(min(NAP, timeout))
            return
        with self.context.handle:
            waiting = WaitSet(len(subscriptions), 0, 0, 0, 0, 0, self.context.handle)
            waiting.clear_entities()
            for subscription in subscriptions:
                waiting.add_subscription(subscription.handle)
            waiting.wait(int(timeout * 1e9))

    def empty_bulk(self) -> None:
        """Hand everything that has arrived to its callbacks."""
        for subscription in self._bulk():
            for message in taken(subscription):
                subscription.callback(message)

    def follow_clock(self) -> None:
        """Tell rclpy's clock the newest simulated time."""
        mine = super().subscriptions  # type: ignore[misc]  # of the Node behind the mixin
        for subscription in [s for s in mine if not PLAIN and _is_clock(s)]:
            for newest in list(taken(subscription))[-1:]:
                subscription.callback(newest)


class BulkNode(BulkMixin, Node):
    """A node with a data path of its own: see `BulkMixin`."""


def _is_clock(subscription: Subscription) -> bool:
    """Whether this is the subscription that rclpy makes for `use_sim_time`."""
    return subscription.topic == CLOCK.name and not subscription.raw
