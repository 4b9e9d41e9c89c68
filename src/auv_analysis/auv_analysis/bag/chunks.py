"""Chunks of an MCAP file: their messages as tables, found in bulk, and the definitions between."""

import struct
from array import array
from collections.abc import Iterator
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from auv_analysis.bag.limits import Counts, plain

HEAD = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8'),
])  # fmt: skip
PREFIX = struct.Struct('<BQ')  # opcode and length of every record
DEFINITIONS: dict[int, Any] = {Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel}


class Body(ReadDataStream):
    """The bytes of a record, none of which may be missing."""

    def __init__(self, data: bytes):
        super().__init__(BytesIO(data))
        self._data = data

    def read(self, length: int) -> bytes:
        """The next bytes; McapError where there are fewer."""
        begin = self._count
        self._count = self._within(begin + length)
        return self._data[begin : self._count]

    def read_prefixed_string(self) -> str:
        """The next text, at once: a small file may hold millions of them."""
        begin = self._count + 4
        length = int.from_bytes(self._data[self._count : begin], 'little')
        self._count = self._within(begin + length)
        return str(self._data[begin : self._count], 'utf-8')

    def _within(self, end: int) -> int:
        if end > len(self._data):
            raise McapError('a record that is shorter than its fields')
        return end


class MessageTable(NamedTuple):
    """Messages that lie in one buffer, in the order of the file.

    Attributes
    ----------
    data : the buffer
    starts, sizes : (n,) place and length of each payload, bytes
    channels, sequences : (n,) as they stand in the records
    log_times, publish_times : (n,) ns

    """

    data: bytes
    starts: np.ndarray
    sizes: np.ndarray
    channels: np.ndarray
    sequences: np.ndarray
    log_times: np.ndarray
    publish_times: np.ndarray

    def payload(self, i: int) -> bytes:
        """Message i as it stands in the file."""
        start = int(self.starts[i])
        return self.data[start : start + int(self.sizes[i])]

    def message(self, i: int) -> bytes:
        """Message i, serialized."""
        return plain(self.payload(i))


def table_at(data: bytes, places: np.ndarray) -> MessageTable:
    """Table of the whole message records of a buffer that begin at (n,) places."""
    head = gather(data, places, HEAD.itemsize).view(HEAD)[:, 0]
    sizes = head['length'].astype(np.int64) - (HEAD.itemsize - PREFIX.size)
    columns = (head[name] for name in ('channel', 'sequence', 'log_time', 'publish_time'))
    return MessageTable(data, places + HEAD.itemsize, sizes, *columns)


def by_channel(channels: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Each channel of messages (n,), and the numbers of its messages, rising."""
    order = np.argsort(channels, kind='stable')
    found = channels[order]
    begins = np.flatnonzero(np.diff(found)) + 1
    for index in np.split(order, begins) if len(order) else ():
        yield int(channels[index[0]]), index


def gather(data: bytes, starts: np.ndarray, width: int) -> np.ndarray:
    """Bytes (n, width) of a buffer that begin at (n,) places, of which there must be some."""
    windows: np.ndarray = np.ndarray((len(data) - width + 1,), f'V{width}', data, strides=(1,))
    return windows[starts].view(np.uint8).reshape(-1, width)


def contents_of(
    data: bytes, counts: Counts, indexed: np.ndarray | None = None
) -> list[MessageTable | Schema | Channel]:
    """Messages, schemas and channels of a chunk, in their order.

    Parameters
    ----------
    data : the chunk's records, decompressed
    counts : of the file
    indexed : (n,) where its messages begin as an index says, believed as far as that fits

    Raises
    ------
    TooManyError : it holds more records than are looked at
    McapError, ValueError, struct.error : its records do not fill it, or not their own fields

    """
    places = _tiled(data, indexed, counts.most)
    if places is None:
        places = _places(data, counts.most)
    ends = np.append(places[1:], len(data))
    opcodes = np.frombuffer(data, np.uint8)[places]
    is_message = opcodes == Opcode.MESSAGE
    others = np.flatnonzero(~is_message)
    counts.take(len(places), int((ends - places)[others].sum()))
    if np.any(is_message & (ends - places < HEAD.itemsize)):
        raise McapError('a message that is shorter than its fields')
    found: list[MessageTable | Schema | Channel] = []
    done = 0
    for i in [*others.tolist(), len(places)]:
        if i > done:
            found.append(table_at(data, places[done:i]))
        done = i + 1
        kind = DEFINITIONS.get(int(opcodes[i])) if i < len(places) else None
        if kind is not None:
            found.append(kind.read(Body(data[int(places[i]) + PREFIX.size : int(ends[i])])))
            counts.note(found[-1])
    return found


def _tiled(data: bytes, indexed: np.ndarray | None, most: int) -> np.ndarray | None:
    """Where the records begin, of an index whose messages leave room for whole records alone."""
    if indexed is None or not 0 < len(indexed) <= most:
        return None
    places = np.sort(indexed)
    if places[0] < 0 or places[-1] > len(data) - HEAD.itemsize:
        return None
    lengths = gather(data, places + 1, 8).view('<u8')[:, 0]
    if np.any(lengths > len(data)):
        return None
    begins = np.append(places, len(data))
    ends = np.insert(places + PREFIX.size + lengths.astype(np.int64), 0, 0)
    if np.any(begins < ends):
        return None
    try:
        between = [
            end + _places(data[end:begin], most)
            for end, begin in zip(ends[begins > ends], begins[begins > ends], strict=True)
        ]
    except (McapError, struct.error):
        return None
    return np.sort(np.concatenate([places, *between]))


def _places(data: bytes, most: int) -> np.ndarray:
    """Where the records begin, as their lengths say; one more than `most` where there are more."""
    places, place, end = array('q'), 0, len(data)
    append, unpack = places.append, PREFIX.unpack_from
    for _ in range(most + 1):
        if place >= end:
            break
        append(place)
        place += PREFIX.size + unpack(data, place)[1]
    if place != end and len(places) <= most:
        raise McapError('a chunk that ends within a record')
    return np.array(places, np.int64)
