"""Messages of the step topics as numbers: by their schema, or a whole channel at once.

A layout says where the numbers of a message lie when its strings have a known length: CDR, little
endian. It holds for messages in which the decoder of their schema finds the same.
"""

import contextlib
import io
import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, Schema
from mcap_ros2.decoder import DecoderFactory

from auv_analysis.bag.chunks import MessageTable, gather
from auv_analysis.bag.limits import LARGEST_PARSED
from auv_analysis.bag.ros2msg import schema_text
from auv_dynamics.files.errors import InputError, first_line
from auv_dynamics.ros import interface

ODOMETRIES = (interface.ODOM, interface.GROUND_TRUTH)
ODOMETRY = 'nav_msgs/msg/Odometry'
TWIST = 'geometry_msgs/msg/TwistStamped'
ACCEL = 'geometry_msgs/msg/AccelStamped'
WRENCH = 'geometry_msgs/msg/WrenchStamped'
KINDS = {
    interface.ODOM: ODOMETRY,
    interface.CMD_VEL: TWIST,
    interface.CMD_ACCEL: ACCEL,
    interface.WRENCH: WRENCH,
    interface.WRENCH_APPLIED: WRENCH,
    interface.GROUND_TRUTH: ODOMETRY,
    interface.DISTURBANCE: WRENCH,
    interface.DISTURBANCE_ESTIMATE: WRENCH,
}
_BY_KIND = {
    ODOMETRY: interface.read_odometry,
    TWIST: interface.read_twist,
    ACCEL: interface.read_accel,
    WRENCH: interface.read_wrench,
}
READERS: dict[str, Callable[[Any, interface.Frames], tuple[int, tuple[float, ...]]]] = {
    role: partial(_BY_KIND[kind], topic=role) for role, kind in KINDS.items()
}
CDR = 4  # bytes of the encapsulation, from which alignment counts
PLAIN = b'\0\1'  # kind of CDR, little endian; all zero: big endian
STAMP = slice(CDR, CDR + 8)  # sec and nanosec
LATEST = 1 << 31  # s: from here on it depends on the schema whether a stamp is negative
NEARLY = 1e-3 - 1e-9  # of the norm of a quaternion: beyond, the reader of single messages decides
UNIT = np.array([1.0, 2.0, 4.0, 10.0]) / 11.0  # a quaternion of four different entries
Decoder = Callable[[bytes], Any]


class NotOursError(InputError):
    """A bag whose topics are not those that our nodes publish."""


def role_of(topic: str) -> str:
    """Our name of a topic, whatever its namespace."""
    if topic.endswith(f'/{interface.GROUND_TRUTH}'):
        return interface.GROUND_TRUTH
    return topic.rpartition('/')[2]


def namespace_of(topic: str) -> str:
    """Prefix of our name of a topic."""
    return topic.removesuffix(role_of(topic))


def check_type(path: Path, topic: str, found: str) -> None:
    """Raise InputError when a topic with one of our names is of another type."""
    expected = KINDS[role_of(topic)]
    if found != expected:
        raise NotOursError(path, topic, expected, found)


class Decoding:
    """Decoders of the channels of one file; what must not be used raises InputError.

    Parameters
    ----------
    path : the file, for the refusals

    """

    def __init__(self, path: Path):
        self._path = path
        self._decoders: dict[int, Decoder] = {}
        self._known: dict[tuple[str, str, str, bytes], Decoder | None] = {}
        self._parsed = 0  # bytes of definitions
        self._topics: dict[int, str] = {}

    def add(self, channel: Channel, schema: Schema | None) -> None:
        """Learn to decode a channel."""
        decoder = self._decoder(channel, schema)
        if decoder is None:
            found = f'messages in {channel.message_encoding}'
            found += f', a definition in {schema.encoding}' if schema else ''
            raise InputError(self._path, channel.topic, 'cdr, with a definition in ros2msg', found)
        self._decoders[channel.id] = decoder
        self._topics[channel.id] = channel.topic

    def _decoder(self, channel: Channel, schema: Schema | None) -> Decoder | None:
        """Decoder of a channel; channels of one definition share it."""
        if schema is None:
            return None
        if schema.encoding == 'ros2idl' or not schema.data:
            schema = self._standard(channel, schema)
        key = channel.message_encoding, schema.name, schema.encoding, schema.data
        if key not in self._known:
            self._parsed += len(schema.data)
            if self._parsed > LARGEST_PARSED:
                expected = f'at most {LARGEST_PARSED} bytes of different definitions'
                raise InputError(self._path, channel.topic, expected, f'{self._parsed}')
            try:  # a factory of its own each: it goes by the ids of schemas
                with contextlib.redirect_stderr(io.StringIO()):  # its parser prints and raises
                    decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
            except Exception as error:  # whatever its parser stumbles over
                found = f'one that cannot be read: {first_line(error)}'
                raise InputError(self._path, channel.topic, 'a schema of its type', found) from None
            self._known[key] = decoder
        return self._known[key]

    def _standard(self, channel: Channel, schema: Schema) -> Schema:
        """Schema of one of our types by its name, where rosbag2 had no .msg file of it."""
        try:
            return Schema(schema.id, schema_text(schema.name).encode(), 'ros2msg', schema.name)
        except OSError as error:
            raise refusal(self._path, channel.topic, 'a schema of its type', error) from None

    def __contains__(self, channel: int) -> bool:
        return channel in self._decoders

    def __getitem__(self, channel: int) -> Decoder:
        return self._decoders[channel]

    def message(self, table: MessageTable, i: int, channel: int) -> Any:
        """Message number i of a table."""
        try:
            data = table.message(i)
            if data[:2] not in (b'\0\0', PLAIN):
                raise ValueError(f'CDR of kind {data[:2].hex()}')
            return self._decoders[channel](data)
        except Exception as error:  # by its schema, a message may be anything
            raise refusal(
                self._path, self._topics[channel], 'messages of its type', error
            ) from None

    def value(
        self, topic: str, message: Any, frames: interface.Frames | None
    ) -> tuple[int, tuple[float, ...]]:
        """Stamp and row of a message; those before the first odometry are free in their frame."""
        try:
            known = frames or interface.Frames(base=message.header.frame_id)
            return READERS[role_of(topic)](message, known)
        except interface.BadMessageError as error:
            raise refusal(self._path, topic, 'usable messages', error) from None
        except (AttributeError, TypeError) as error:  # a schema with other fields
            raise refusal(self._path, topic, 'messages of its type', error) from None

    def frames_of(self, channel: int, odometry: Any) -> interface.Frames:
        """Frames that an odometry of a channel names."""
        try:
            return interface.Frames(odometry.header.frame_id, odometry.child_frame_id)
        except AttributeError as error:  # a schema with other fields
            raise refusal(
                self._path, self._topics[channel], 'messages of its type', error
            ) from None


def refusal(path: Path, topic: str, expected: str, error: Exception) -> InputError:
    """Message of a library, as one line of ours."""
    return InputError(path, topic, expected, first_line(error))


@dataclass(frozen=True)
class StepLayout:
    """Places in a serialized message, bytes from its beginning.

    Attributes
    ----------
    size : bytes that a message has at least
    strings : bytes up to here, whole words, hold encapsulation, stamp and strings
    shared : (strings / 8,) words whose bits are 1 where every message must have the same
    like : words that hold these
    runs : place and count of float64 numbers that stand together
    order : permutation of these numbers into a row
    frames : ids in the strings; of a message without child frame, its one frame twice

    """

    size: int
    strings: int
    shared: np.ndarray
    like: np.ndarray
    runs: list[tuple[int, int]]
    order: np.ndarray
    frames: interface.Frames

    @property
    def is_state(self) -> bool:
        """Whether rows are states (13,), with a quaternion at 3 to 6."""
        return len(self.order) > 6

    def fits(self, message: bytes) -> bool:
        """Whether a message has this layout and these strings."""
        start = np.zeros(1, np.int64)
        return len(message) >= self.size and self._alike(gather(message, start, self.strings))

    def is_in(self, frames: interface.Frames | None) -> bool:
        """Whether the frames in the strings are those."""
        if frames is None:
            return False
        own = frames if self.is_state else interface.Frames(frames.base, frames.base)
        return self.frames == own

    def read(
        self, data: bytes, starts: np.ndarray, sizes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Stamps (n,) in ns and rows (n, 13) or (n, 6) of messages in a buffer.

        None where one of them has another layout, other strings or numbers that must not be used.
        """
        if np.any(sizes < self.size):
            return None
        head = gather(data, starts, self.strings)
        sec, nanosec = head.view('<u4')[:, 1:3].astype(np.int64).T
        odd = (sec >= LATEST) | (nanosec >= interface.NANOSECONDS)
        if not self._alike(head) or np.any(odd):
            return None
        parts = [gather(data, starts + at, 8 * count).view('<f8') for at, count in self.runs]
        rows = np.concatenate(parts, axis=1)[:, self.order] if self.is_state else parts[0]
        usable = np.all(np.abs(rows) < interface.LARGEST / 4.0)  # NaN: false
        if self.is_state and usable:
            q = rows[:, 3:7]
            usable = np.all(np.abs(np.sqrt(np.einsum('ij,ij->i', q, q)) - 1.0) < NEARLY)
        return (sec * interface.NANOSECONDS + nanosec, rows) if usable else None

    def _alike(self, heads: np.ndarray) -> bool:
        return not np.any((heads.view(np.uint64) ^ self.like) & self.shared)


def learned(message: bytes, role: str, decoder: Callable[[bytes], Any]) -> StepLayout | None:
    """Layout of messages with the strings of this one.

    Parameters
    ----------
    message : serialized, of the type that the role asks for
    role : our name of its topic
    decoder : of the channel: it must find what the layout finds

    Returns
    -------
    layout : None where there is none, so that every message has to be decoded

    """
    layout = _layout(KINDS[role], message)
    return layout and _proven(layout, message, role, decoder)


def _layout(kind: str, message: bytes) -> StepLayout | None:
    """Layout by the definition of the type, not proven yet."""
    if len(message) < CDR or message[:2] != PLAIN:
        return None
    place, shared = STAMP.stop, [0, 1]
    for _ in range(2 if kind == ODOMETRY else 1):
        place = _aligned(place, 4)
        if place + 4 > len(message):
            return None
        end = place + 4 + struct.unpack_from('<I', message, place)[0]
        if end > len(message):
            return None
        shared += range(place, end)
        place = end
    strings, place = -(-place // 8) * 8, _aligned(place, 8)
    if kind == ODOMETRY:  # position, quaternion x y z w, 36 covariances; twist, 36 covariances
        runs = [(place, 7), (place + 8 * (7 + 36), 6)]
        order, size = [0, 1, 2, 6, 3, 4, 5, *range(7, 13)], place + 8 * (7 + 36 + 6 + 36)
    else:
        runs, order, size = [(place, 6)], list(range(6)), place + 8 * 6
    if size > len(message):
        return None
    like = np.frombuffer(message, np.uint64, strings // 8)
    mask = np.zeros(strings, np.uint8)
    mask[shared] = 255
    masks = mask.view(np.uint64)
    return StepLayout(size, strings, masks, like, runs, np.array(order), interface.Frames())


def _proven(
    layout: StepLayout, message: bytes, role: str, decoder: Callable[[bytes], Any]
) -> StepLayout | None:
    """The layout with its frames, when the decoder finds the same in a different number each."""
    values = np.arange(1.0, len(layout.order) + 1.0)
    if layout.is_state:
        values[3:7] = UNIT
    sample = bytearray(message[: layout.size])
    struct.pack_into('<II', sample, STAMP.start, 0x1234567, 0x2345678)
    there = iter(values[np.argsort(layout.order)])
    for at, count in layout.runs:
        for i in range(count):
            struct.pack_into('<d', sample, at + 8 * i, next(there))
    try:
        decoded = decoder(bytes(sample))
        frame = decoded.header.frame_id
        frames = interface.Frames(frame, decoded.child_frame_id if layout.is_state else frame)
        ns, row = READERS[role](decoded, frames)
    except Exception:  # whatever a foreign schema leads to: then every message is decoded
        return None
    found = layout.read(bytes(sample), np.zeros(1, np.int64), np.array([layout.size]))
    same = found is not None and found[0][0] == ns and np.array_equal(found[1][0], row)
    return replace(layout, frames=frames) if same else None


def _aligned(place: int, size: int) -> int:
    return place + (CDR - place) % size
