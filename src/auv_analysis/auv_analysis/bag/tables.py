"""Where the messages of a chunk lie, found without looking at them one by one."""

import struct
from array import array
from collections.abc import Iterator, Sequence
from io import BytesIO
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, McapRecord, Message, Schema

from auv_analysis.bag.limits import Counts

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
LEAST = PREFIX.size + 12  # bytes of a schema or channel


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


def by_channel(channels: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Each channel of messages (n,), and the numbers of its messages, rising."""
    order = np.argsort(channels, kind='stable')
    found = channels[order]
    begins = np.flatnonzero(np.diff(found)) + 1
    for index in np.split(order, begins) if len(order) else ():
        yield int(channels[index[0]]), index


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


def parts_of_chunk(
    data: bytes, places: np.ndarray | None, counts: Counts
) -> list[Table | McapRecord] | None:
    """Messages, schemas and channels of a chunk in their order.

    Parameters
    ----------
    data : the chunk's records, decompressed
    places : (n,) where its message records begin by the index, in any order; None: not indexed
    counts : of the file

    Returns
    -------
    parts : None where index or chunk are not as they should be: then only reading record by
        record tells what is there

    Raises
    ------
    TooManyError : it holds more records than are looked at

    """
    found = None if places is None else _indexed(data, places, counts)
    return _walked(data, counts) if found is None else found


def _indexed(data: bytes, places: np.ndarray, counts: Counts) -> list[Table | McapRecord] | None:
    """Parts by the index, when the records that it names tile the chunk."""
    if len(places) > counts.most:
        return None
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
    done, between = 0, int((begins - ends).sum())
    held = len(places) + between // LEAST, between
    counts.check(*held)
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
    counts.take(*held)
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


def _walked(data: bytes, counts: Counts) -> list[Table | McapRecord] | None:
    """Parts of a chunk without index, from one record's length to the next."""
    parts: list[Table | McapRecord] = []
    places = array('q')
    place, end = 0, len(data)
    held = _held(data, counts.most)
    counts.check(*held)
    for begin, opcode, place in _steps(data, 0, end):
        if opcode == Opcode.MESSAGE:
            places.append(begin)
            continue
        parts += _tiles(data, places)
        del places[:]
        others = _others(data, begin, place)
        if others is None:
            return None
        parts += others
    if place != end:
        return None
    counts.take(*held)
    return parts + _tiles(data, places)


def _held(data: bytes, most: int) -> tuple[int, int]:
    """Number of records up to one more than `most`, and bytes of those that are no messages."""
    number = between = 0
    for begin, opcode, after in islice(_steps(data, 0, len(data)), most + 1):
        number += 1
        if opcode != Opcode.MESSAGE:
            between += after - begin
    return number, between


def _steps(data: bytes, begin: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Begin, opcode and end of each record, as long as they lie within these places."""
    while end - begin >= PREFIX.size:
        opcode, length = PREFIX.unpack_from(data, begin)
        after = begin + PREFIX.size + length
        if after > end or (opcode == Opcode.MESSAGE and length < FIXED):
            return
        yield begin, opcode, after
        begin = after


def _tiles(
    data: bytes, places: 'array[int]', sizes: np.ndarray | None = None
) -> list[Table | McapRecord]:
    """Table of message records whose heads are known to be whole; default sizes: as these say."""
    if not places:
        return []
    at = np.array(places, np.int64)
    head = gather(data, at, HEAD.itemsize).view(HEAD)[:, 0]
    if sizes is None:
        sizes = head['length'].astype(np.int64) - FIXED
    return [Table(data, at + HEAD.itemsize, sizes, head['channel'], head['log_time'])]


def parts_one_by_one(data: bytes, counts: Counts) -> list[Table | McapRecord]:
    """Parts of a chunk as the mcap library reads it: each by its fields, whatever its length says.

    Raises
    ------
    TooManyError : it holds more records than are looked at
    McapError, EndOfFile, ValueError, struct.error : it is damaged

    """
    parts: list[Table | McapRecord] = []
    places, sizes = array('q'), array('q')
    stream = ReadDataStream(BytesIO(data))
    while (begin := stream.count) < len(data):
        opcode, length = stream.read1(), stream.read8()
        message = opcode == Opcode.MESSAGE
        if message:
            places.append(begin)
            sizes.append(len(Message.read(stream, length).data))
        elif opcode in OTHERS:
            parts += _tiles(data, places, np.array(sizes, np.int64))
            del places[:], sizes[:]
            parts.append(OTHERS[opcode].read(stream))
        else:
            stream.read(length)
        counts.take(1, 0 if message else stream.count - begin)
    return parts + _tiles(data, places, np.array(sizes, np.int64))
