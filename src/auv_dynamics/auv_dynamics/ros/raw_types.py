"""Message types that are known by name alone: enough to subscribe to their serialized messages.

The middleware asks a type support for the name of the type, to match publishers, and for functions
that are not called where messages stay serialized. Here the name is put into a copy of the type
support of an installed type.
"""

import ctypes
from functools import cache
from typing import Any

from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import String

from auv_dynamics.ros.kinds import NAME
from auv_dynamics.ros.private import class_of, type_support

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
    return class_of(match[2], support, (handle, callbacks))


def _installed() -> _Handle:
    """Type support of an installed type, which finds that of the middleware."""
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return _Handle.from_address(pointer(type_support(String), None))
