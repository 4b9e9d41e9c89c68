"""Where the messages of a chunk lie, found without looking at them one by one."""

import struct
from collections.abc import Iterator, Sequence
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, McapRecord, Message, Schema

HEAD = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8'),
])  # fmt: skip
PREFIX = struct.Struct('<BQ')  # opcode and length of every record
OTHERS: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
}  # what lies in chunks beside messages
FIXED = HEAD.itemsize - PREFIX.size  # bytes of a message's record before its payload


class Table(NamedTuple):
    """Messages that lie in one buffer, in the order of the file.

    Attributes
    ----------
    data : the buffer
    starts, sizes : (n,) place and length of each payload, bytes
    channels : (n,) channel ids
    log_times : (n,) ns

    """

    data: bytes
    starts: np.ndarray
    sizes: np.ndarray
    channels: np.ndarray
    log_times: np.ndarray

    def part(self, first: int, last: int | None) -> 'Table':
        """The messages from one number up to another."""
        here = slice(first, last)
        return Table(self.data, *(column[here] for column in self[1:]))

    def payload(self, i: int) -> bytes:
        """Message i, serialized."""
        start = int(self.starts[i])
        return self.data[start : start + int(self.sizes[i])]


def gather(data: bytes, starts: np.ndarray, width: int) -> np.ndarray:
    """Bytes (n, width) of a buffer that begin at (n,) places."""
    if not len(starts):
        return np.zeros((0, width), np.uint8)
    windows: np.ndarray = np.ndarray((len(data) - width + 1,), f'V{width}', data, strides=(1,))
    return windows[starts].view(np.uint8).reshape(-1, width)


def table_of_messages(messages: Sequence[Message]) -> Table:
    """Table of messages that do not lie in a chunk."""
    sizes = np.array([len(m.data) for m in messages], np.int64)
    return Table(
        b''.join(m.data for m in messages),
        np.cumsum(sizes) - sizes,
        sizes,
        np.array([m.channel_id for m in messages], np.uint16),
        np.array([m.log_time for m in messages], np.uint64),
    )


def parts_of_chunk(data: bytes, places: np.ndarray | None) -> list[Table | McapRecord] | None:
    """Messages, schemas and channels of a chunk in their order.

    Parameters
    ----------
    data : the chunk's records, decompressed
    places : (n,) where its message records begin by the index, in any order; None: not indexed

    Returns
    -------
    parts : None where index or chunk are not as they should be: then only reading record by
        record tells what is there

    """
    found = None if places is None else _indexed(data, places)
    return _walked(data) if found is None else found


def _indexed(data: bytes, places: np.ndarray) -> list[Table | McapRecord] | None:
    """Parts by the index, when the records that it names tile the chunk."""
    places = np.sort(places)
    if len(places) and (places[0] < 0 or places[-1] > len(data) - HEAD.itemsize):
        return None
    head = gather(data, places, HEAD.itemsize).view(HEAD)[:, 0]
    lengths = head['length'].astype(np.int64)
    ends = places + PREFIX.size + lengths
    begins = np.append(places, len(data))
    ends = np.insert(ends, 0, 0)
    whole = (head['opcode'] == Opcode.MESSAGE) & (lengths >= FIXED) & (lengths <= len(data))
    if not whole.all() or np.any(begins < ends):
        return None
    table = Table(data, places + HEAD.itemsize, lengths - FIXED, head['channel'], head['log_time'])
    parts: list[Table | McapRecord] = []
    done = 0
    for i in np.flatnonzero(begins > ends).tolist():
        others = _others(data, int(ends[i]), int(begins[i]))
        if others is None:
            return None
        if i > done:
            parts.append(table.part(done, i))
        parts += others
        done = i
    if done < len(places):
        parts.append(table.part(done, None))
    return parts


def _others(data: bytes, begin: int, end: int) -> list[McapRecord] | None:
    """Schemas and channels between two messages; None where there is something else."""
    found: list[McapRecord] = []
    place = begin
    for here, opcode, place in _steps(data, begin, end):
        kind = OTHERS.get(opcode)
        if opcode == Opcode.MESSAGE:
            return None
        if kind is None:
            continue
        # with the byte behind it, so that a record that reaches beyond its own end shows
        stream = ReadDataStream(BytesIO(data[here + PREFIX.size : place + 1]))
        try:
            found.append(kind.read(stream))
        except (McapError, struct.error, ValueError, OverflowError):
            return None
        if stream.count != place - here - PREFIX.size:
            return None
    return found if place == end else None


def _walked(data: bytes) -> list[Table | McapRecord] | None:
    """Parts of a chunk without index, from one record's length to the next."""
    parts: list[Table | McapRecord] = []
    places: list[int] = []
    place, end = 0, len(data)
    for begin, opcode, place in _steps(data, 0, end):
        if opcode == Opcode.MESSAGE:
            places.append(begin)
            continue
        parts += _tiles(data, places)
        places.clear()
        others = _others(data, begin, place)
        if others is None:
            return None
        parts += others
    if place != end:
        return None
    return parts + _tiles(data, places)


def _steps(data: bytes, begin: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Begin, opcode and end of each record, as long as they lie within these places."""
    while end - begin >= PREFIX.size:
        opcode, length = PREFIX.unpack_from(data, begin)
        after = begin + PREFIX.size + length
        if after > end or (opcode == Opcode.MESSAGE and length < FIXED):
            return
        yield begin, opcode, after
        begin = after


def _tiles(data: bytes, places: list[int]) -> list[Table | McapRecord]:
    """Table of message records that are known to be whole."""
    if not places:
        return []
    at = np.array(places, np.int64)
    head = gather(data, at, HEAD.itemsize).view(HEAD)[:, 0]
    sizes = head['length'].astype(np.int64) - FIXED
    return [Table(data, at + HEAD.itemsize, sizes, head['channel'], head['log_time'])]
