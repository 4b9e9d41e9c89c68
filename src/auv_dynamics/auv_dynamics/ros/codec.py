"""Numbers <-> serialized messages: a template is patched in place of a message built anew.

Of the messages of a topic only the stamp and the numbers change. Where these stand in the
serialized form is not written down here but looked up, in a message that carries marks; fields and
checks are those of `convert` and `interface`. What is laid out in another way goes the long way,
through message objects, and so does everything in real time.
"""

import struct
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any, NamedTuple

from geometry_msgs.msg import AccelStamped, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from auv_dynamics.files.errors import first_line
from auv_dynamics.ros import convert, interface
from auv_dynamics.ros.interface import NANOSECONDS, BadMessageError, Frames
from auv_dynamics.vehicle import DOFS

STAMP = 'iI'  # Time: seconds and nanoseconds
FIRST_FIELD = 4  # bytes of the CDR encapsulation come before it
MARK_NS = 305419896 * NANOSECONDS + 180150000
PROBES = (0.1, -7e300)  # numbers that a template is tried with
UNUSED = 16  # bytes: fewer than these behind the last number are the middleware's, for no field


class Kind(NamedTuple):
    """Codec of a message type: made, read and checked; `size` numbers each, `words` in all."""

    size: int
    make: Callable[[int, Any, Frames], Any]
    read: Callable[[Any, Frames, str], tuple[int, tuple[float, ...]]] | None = None
    check: Callable[[str, tuple[float, ...]], tuple[float, ...]] | None = None
    words: tuple[str, ...] = ()


KINDS = {
    Odometry: Kind(13, convert.odometry, interface.read_odometry, interface.check_state),
    TwistStamped: Kind(6, convert.twist, interface.read_twist, interface.check_finite),
    AccelStamped: Kind(6, convert.accel, interface.read_accel, interface.check_finite),
    WrenchStamped: Kind(6, convert.wrench, interface.read_wrench, interface.check_finite),
    JointState: Kind(
        6, convert.joint_state, interface.read_joint_state, interface.check_finite, DOFS
    ),
    Clock: Kind(0, lambda ns, _, __: Clock(clock=convert.stamp(ns))),
}


def byte_order(data: bytes) -> str:
    """Sign of the byte order of a serialized message, for `struct`."""
    return '<' if data[1] & 1 else '>'


_FIRST_STAMP = {order: struct.Struct(f'{order}{STAMP}') for order in '<>'}


def first_stamp(data: bytes, topic: str) -> int:
    """Nanoseconds of a serialized message that begins with a Header or a Time.

    BadMessageError, which names the topic, where it ends before or has no stamp.
    """
    if len(data) < FIRST_FIELD + 8:
        raise BadMessageError(f'{topic}: expected a message with a stamp, found {len(data)} bytes')
    sec, nanosec = _FIRST_STAMP[byte_order(data)].unpack_from(data, FIRST_FIELD)
    return interface.check_stamp(topic, sec, nanosec)


def message_of(data: bytes, kind: Any, topic: str) -> Any:
    """Message of its serialized form; BadMessageError, which names the topic, where it is none."""
    try:
        return deserialize_message(data, kind)
    except Exception as error:  # whatever the middleware says to bytes from outside
        raise BadMessageError(
            f'{topic}: not a message: expected a serialized {kind.__name__}, '
            f'found {len(data)} bytes ({first_line(error)})'
        ) from None


class Layout:
    """Where stamp, numbers and frame ids stand in the serialized messages of a kind.

    Parameters
    ----------
    kind : of message
    frames : frame ids that the messages carry

    Raises
    ------
    LookupError : they are not found, or not once each

    """

    def __init__(self, kind: Kind, frames: Frames):
        marks = [1.0 / (i + 3) for i in range(kind.size)]
        data = bytes(serialize_message(kind.make(MARK_NS, marks, frames)))
        order = byte_order(data)
        self._stamp = struct.Struct(f'{order}{STAMP}')
        self._at = _only(data, self._stamp.pack(*divmod(MARK_NS, NANOSECONDS)))
        places = [_only(data, struct.pack(f'{order}d', mark)) for mark in marks]
        wire = sorted(range(kind.size), key=places.__getitem__)  # numbers as they are sent
        back = sorted(range(kind.size), key=wire.__getitem__)
        self._to_wire, self._from_wire = _permutation(wire), _permutation(back)
        self._runs = _runs([places[i] for i in wire], order)
        end = max(places, default=len(data)) + 8
        self._length = len(data)
        self._buffer = bytearray(data[:end] if len(data) - end < UNUSED else data)
        self._fixed = [(0, data[:2])]  # the encoding
        for text in {frames.odom, frames.base, *kind.words}:
            encoded = struct.pack(f'{order}I', len(text.encode()) + 1) + text.encode() + b'\0'
            self._fixed += [(at, encoded) for at in _all(data, encoded)]

    def pack(self, ns: int, values: Sequence[float]) -> bytes:
        """Serialized message of a stamp in ns and numbers."""
        buffer = self._buffer
        self._stamp.pack_into(buffer, self._at, *divmod(ns, NANOSECONDS))
        wire = self._to_wire(values)
        for numbers, at, first, last in self._runs:
            numbers.pack_into(buffer, at, *wire[first:last])
        return bytes(buffer)

    def unpack(self, data: bytes) -> tuple[int, tuple[float, ...]] | None:
        """Stamp in ns and numbers; None: laid out in another way, or in other frames."""
        if len(data) != self._length:
            return None
        for at, expected in self._fixed:
            if not data.startswith(expected, at):
                return None
        sec, nanosec = self._stamp.unpack_from(data, self._at)
        if sec < 0 or nanosec >= NANOSECONDS:
            return None  # nor is it a stamp, which will be said of the message
        wire: tuple[float, ...] = ()
        for numbers, at, _, _ in self._runs:
            wire += numbers.unpack_from(data, at)
        return sec * NANOSECONDS + nanosec, self._from_wire(wire)


def _all(data: bytes, part: bytes) -> list[int]:
    places, at = [], data.find(part)
    while at >= 0:
        places.append(at)
        at = data.find(part, at + 1)
    return places


def _only(data: bytes, part: bytes) -> int:
    places = _all(data, part)
    if len(places) != 1:
        raise LookupError(f'expected one place, found {len(places)}')
    return places[0]


def _permutation(order: list[int]) -> Callable[[Any], Any]:
    if order == list(range(len(order))):
        return lambda values: values
    return itemgetter(*order)


def _runs(places: list[int], order: str) -> list[tuple[struct.Struct, int, int, int]]:
    """Neighbouring numbers together: their struct, offset, first and last of the numbers."""
    runs, first = [], 0
    for i in range(1, len(places) + 1):
        if i == len(places) or places[i] != places[i - 1] + 8:
            runs.append((struct.Struct(f'{order}{i - first}d'), places[first], first, i))
            first = i
    return runs


class Codec:
    """Messages of one topic in fixed frames.

    Parameters
    ----------
    kind : message type
    frames : frame ids that are sent and accepted
    topic : its name, for what is refused
    patched : whether templates are patched, else every message is an object

    """

    def __init__(self, kind: type, frames: Frames, topic: str, *, patched: bool = True):
        self._type, self._kind, self._frames, self._topic = kind, KINDS[kind], frames, topic
        self.layout = verified_layout(kind, frames) if patched else None

    def encode(self, ns: int, values: Any) -> Any:
        """Message of a stamp in ns and numbers, serialized where the layout is known."""
        if self.layout is None:
            return self._kind.make(ns, values, self._frames)
        return self.layout.pack(ns, values.tolist() if hasattr(values, 'tolist') else values)

    def decode(self, data: bytes) -> tuple[int, tuple[float, ...]]:
        """Stamp in ns and numbers; BadMessageError when the message must not be used."""
        found = self.layout.unpack(data) if self.layout is not None else None
        kind = self._kind
        if found is None:
            message = message_of(data, self._type, self._topic)
            # whoever decodes a kind has told how it is read
            return kind.read(message, self._frames, self._topic)  # type: ignore[misc]
        return found[0], kind.check(self._topic, found[1])  # type: ignore[misc]  # as above


def verified_layout(kind: type, frames: Frames) -> Layout | None:
    """Layout that has been seen to give the messages that are meant, or None.

    Patched templates are compared as messages: the bytes between fields are not defined.
    """
    make, size = KINDS[kind].make, KINDS[kind].size
    try:
        layout = Layout(KINDS[kind], frames)
    except LookupError:
        return None
    for ns, number in zip((1, MARK_NS + 1), PROBES, strict=True):
        values = tuple(number * (i + 1) for i in range(size))
        message, patched = make(ns, values, frames), layout.pack(ns, values)
        same = deserialize_message(patched, kind) == message
        if not same or layout.unpack(bytes(serialize_message(message))) != (ns, values):
            return None
    return layout if _tells_frames_apart(layout, make, size, frames) else None


def _tells_frames_apart(
    layout: Layout, make: Callable[..., Any], size: int, frames: Frames
) -> bool:
    """Whether a message in other frames, even of equal length, is seen to be another one."""
    zero = (0.0,) * size
    for other in (
        Frames(frames.odom[:-1] + '\x01', frames.base),
        Frames(frames.odom, frames.base[:-1] + '\x01'),
    ):
        message = make(0, zero, other)
        if message != make(0, zero, frames) and layout.unpack(bytes(serialize_message(message))):
            return False
    return True
