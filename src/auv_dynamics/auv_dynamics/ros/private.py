"""The private names of rclpy that the nodes rely on: these and no others, and only here.

Where one of the data path is missing, or with AUV_GVC_EXECUTOR=plain, PLAIN is true: data then
comes through rclpy's executor, as message objects.
"""

import os
from collections.abc import Iterator, Sequence
from typing import Any

from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription

try:
    from rclpy.impl.implementation_singleton import rclpy_implementation

    WaitSet = rclpy_implementation.WaitSet
    RCLError, RMWError = rclpy_implementation.RCLError, rclpy_implementation.RMWError
    FOUND = hasattr(rclpy_implementation.Subscription, 'take_message')
except (ImportError, AttributeError):
    FOUND, RCLError, RMWError = False, RuntimeError, RuntimeError

PLAIN = not FOUND or os.environ.get('AUV_GVC_EXECUTOR') == 'plain'


def taken(subscription: Subscription) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Everything that has arrived on a subscription: message and what is known of its way."""
    handle, kind, raw = subscription.handle, subscription.msg_type, subscription.raw
    with handle:
        while (entry := handle.take_message(kind, raw)) is not None:
            yield entry


class DataWait:
    """A wait set for data alone; it is kept from one wait to the next."""

    def __init__(self, context: Context):
        self._context: Any = context.handle
        self._size = 0
        self._waiting: Any = None

    def wait(self, subscriptions: Sequence[Subscription], timeout: float) -> None:
        """Wait until data has arrived on one of the subscriptions, at most `timeout` s."""
        with self._context:
            if self._size != len(subscriptions):
                self._size = len(subscriptions)
                self._waiting = WaitSet(self._size, 0, 0, 0, 0, 0, self._context)
            # what was waited for must be named again each time: the middleware forgets it
            self._waiting.clear_entities()
            for subscription in subscriptions:
                self._waiting.add_subscription(subscription.handle)
            self._waiting.wait(int(timeout * 1e9))


def overrides(node: Node) -> dict[str, Parameter]:
    """Parameters that the user gave, declared or not; the node's own mapping."""
    return node._parameter_overrides  # noqa: SLF001


def declared(node: Node) -> list[str]:
    """Names of the parameters that the node has declared."""
    return sorted(node._parameters)  # noqa: SLF001


def type_support(kind: type) -> Any:
    """Capsule with the type support of a message class."""
    of_class: Any = type(kind)
    if of_class._TYPE_SUPPORT is None:  # noqa: SLF001
        of_class.__import_type_support__()
    return of_class._TYPE_SUPPORT  # noqa: SLF001


def class_of(name: str, support: Any, keeps: Any) -> type:
    """Stand-in for a message class that has a type support, which lives as long as `keeps`."""
    verbs = ('CREATE_ROS_MESSAGE', 'CONVERT_FROM_PY', 'CONVERT_TO_PY', 'DESTROY_ROS_MESSAGE')
    entries = {'_TYPE_SUPPORT': support, 'keeps': keeps} | {f'_{verb}': support for verb in verbs}
    return type('RawType', (type,), entries)(name, (), {})
