"""The private names of rclpy that lock-step relies on; no other module uses any.

The data path of lock-step takes messages past the executor; topics whose types are not installed
are subscribed by name alone. Without these names everything else works.
"""

import ctypes
import os
from collections.abc import Sequence
from functools import cache
from typing import Any

from rclpy.context import Context
from rclpy.subscription import Subscription
from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import String

from auv_dynamics.ros.topics import NAME

try:
    from rclpy.impl.implementation_singleton import rclpy_implementation

    WaitSet = rclpy_implementation.WaitSet
    RCLError, RMWError = rclpy_implementation.RCLError, rclpy_implementation.RMWError
    FOUND = hasattr(rclpy_implementation.Subscription, 'take_message')
except (ImportError, AttributeError):
    FOUND, RCLError, RMWError = False, RuntimeError, RuntimeError


def has_data_path() -> bool:
    """Whether data may bypass the executor: rclpy has what it takes, and nobody forbids it."""
    return FOUND and os.environ.get('AUV_GVC_EXECUTOR') != 'plain'


def taken(subscription: Subscription, most: int) -> list[tuple[Any, dict[str, Any]]]:
    """What has arrived on a subscription, at most so many: message, what is known of its way."""
    handle, kind, raw = subscription.handle, subscription.msg_type, subscription.raw
    entries: list[tuple[Any, dict[str, Any]]] = []
    with handle:
        take = handle.take_message
        while len(entries) < most and (entry := take(kind, raw)) is not None:
            entries.append(entry)
    return entries


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


VERBS = ('CREATE_ROS_MESSAGE', 'CONVERT_FROM_PY', 'CONVERT_TO_PY', 'DESTROY_ROS_MESSAGE')
MIDDLEWARE = 'rmw_fastrtps_cpp'  # whose type supports are laid out as below
IDENTIFIER = b'rosidl_typesupport_fastrtps_c'
FIND = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)


class _Handle(ctypes.Structure):
    """rosidl_message_type_support_t."""

    _fields_ = (
        ('identifier', ctypes.c_char_p),
        ('data', ctypes.c_void_p),
        ('find', FIND),
        ('functions', ctypes.c_void_p * 3),  # hash and description of the type
    )


class _Callbacks(ctypes.Structure):
    """message_type_support_callbacks_t."""

    _fields_ = (
        ('namespace', ctypes.c_char_p),
        ('name', ctypes.c_char_p),
        ('functions', ctypes.c_void_p * 4),  # serialize, deserialize and two sizes
    )


@cache
def raw_class(name: str) -> type:
    """Stand-in for the class of a message, for subscriptions with `raw=True`.

    Parameters
    ----------
    name : 'package/msg/Name'

    Raises
    ------
    ImportError : no name of a message, or a middleware that needs the type itself

    """
    match = NAME.fullmatch(name)
    found = get_rmw_implementation_identifier()
    if not match or found != MIDDLEWARE:
        raise ImportError(f'{name}: expected a message and {MIDDLEWARE}, found {found}')
    dispatch = _installed()
    known = _Handle.from_address(dispatch.find(ctypes.addressof(dispatch), IDENTIFIER))
    callbacks = _Callbacks.from_buffer_copy(_Callbacks.from_address(known.data))
    callbacks.namespace, callbacks.name = f'{match[1]}::msg'.encode(), match[2].encode()
    handle = _Handle.from_buffer_copy(known)
    handle.data = ctypes.addressof(callbacks)

    def find(_: Any, identifier: bytes) -> int | None:
        if identifier == IDENTIFIER:
            return ctypes.addressof(handle)
        other: int | None = dispatch.find(ctypes.addressof(dispatch), identifier)
        return other

    handle.find = FIND(find)
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = (
        ctypes.py_object,
        [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p],
    )
    support = new(ctypes.addressof(handle), None, None)
    # the type support lives as long as the class that keeps it
    entries: dict[str, Any] = {'_TYPE_SUPPORT': support, 'keeps': (handle, callbacks)}
    entries |= {f'_{verb}': support for verb in VERBS}
    return type('RawType', (type,), entries)(match[2], (), {})


def _installed() -> _Handle:
    """Type support of an installed type, which finds that of the middleware."""
    of_class: Any = type(String)
    if of_class._TYPE_SUPPORT is None:  # noqa: SLF001
        of_class.__import_type_support__()
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return _Handle.from_address(pointer(of_class._TYPE_SUPPORT, None))  # noqa: SLF001
