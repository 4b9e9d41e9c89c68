"""One record of an MCAP file at a given place: whole, within limits, or an error that says why."""

import os
import struct
import zlib
from io import BytesIO
from typing import IO, Any, NamedTuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from zstandard import ZstdError

from auv_analysis.bag.limits import LARGEST_ATTACHMENT, check_length

MAGIC = b'\x89MCAP0\r\n'
PREFIX = struct.Struct('<BQ')  # opcode and length of every record
ENTRY = np.dtype([('log_time', '<u8'), ('place', '<u8')])  # of a message index
RESERVED = range(0x10, 0x80)  # opcodes that mean nothing yet; above, they are private
DAMAGES = (  # what reading a damaged record may end in
    *(McapError, EndOfFile, ZstdError, struct.error, ValueError, KeyError),
    *(OverflowError, RuntimeError, MemoryError),
)
HEAD = 1 << 16  # bytes of a long attachment that are read for its name
KINDS: dict[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK: Chunk,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT: Attachment,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}


class CutError(Exception):
    """The file ends before the record does."""


class MessageIndex(McapRecord):
    """Where the messages of one channel lie in the chunk before it, without a tuple for each."""

    def __init__(self, channel: int, entries: np.ndarray):
        self.channel, self.entries = channel, entries


class LongAttachment(McapRecord):
    """An attachment that is too long to be read."""

    def __init__(self, name: str, size: int):
        self.name, self.size = name, size


class _Body(ReadDataStream):
    """The bytes of a record, none of which may be missing."""

    def __init__(self, data: bytes):
        super().__init__(BytesIO(data))
        self._size = len(data)

    def read(self, length: int) -> bytes:
        if length > self._size - self.count:
            raise McapError('a record that is shorter than its fields')
        return super().read(length)


class Frame(NamedTuple):
    """Where a record lies in its file, and its bytes.

    Attributes
    ----------
    opcode : of the record
    start, end : of the record with its prefix
    body : without the prefix; of an attachment that is too long, its beginning

    """

    opcode: int
    start: int
    end: int
    body: bytes


def frame_at(stream: IO[bytes], start: int, largest: int = LARGEST_ATTACHMENT) -> Frame:
    """Bytes of the record that begins at a place where the stream stands.

    Parameters
    ----------
    stream : stands at `start`, and behind the record afterwards
    start : bytes
    largest : bytes of an attachment that is still read

    Raises
    ------
    CutError : the file ends within it
    McapError : it cannot be a record, or is larger than any that we read

    """
    prefix = stream.read(PREFIX.size)
    if len(prefix) < PREFIX.size:
        raise CutError
    opcode, length = PREFIX.unpack(prefix)
    end = start + PREFIX.size + length
    if not opcode or opcode in RESERVED:
        raise McapError(f'no record has the opcode {opcode}')
    if end > os.fstat(stream.fileno()).st_size:
        raise CutError
    check_length(opcode, length)
    if opcode == Opcode.ATTACHMENT and length > largest:
        body = stream.read(HEAD)
        stream.seek(end)
    else:
        body = stream.read(length)
    return Frame(opcode, start, end, body)


def record_of(frame: Frame) -> McapRecord | None:
    """The record, None of a kind that is not known; McapError or ValueError where it is damaged."""
    opcode, body = frame.opcode, frame.body
    if opcode == Opcode.MESSAGE:
        return Message.read(_Body(body), len(body))
    if opcode == Opcode.MESSAGE_INDEX:
        return _message_index(body)
    if opcode == Opcode.ATTACHMENT:
        return _attachment(frame)
    kind = KINDS.get(opcode)
    return None if kind is None else kind.read(_Body(body))


def _message_index(body: bytes) -> MessageIndex:
    stream = _Body(body)
    channel, size = stream.read2(), stream.read4()
    return MessageIndex(channel, np.frombuffer(stream.read(size), ENTRY))


def _attachment(frame: Frame) -> McapRecord:
    body = frame.body
    stream = _Body(body)
    if len(body) < frame.end - frame.start - PREFIX.size:
        stream.read(16)
        name, _ = stream.read_prefixed_string(), stream.read_prefixed_string()
        return LongAttachment(name, stream.read8())
    record = Attachment.read(stream)
    told = struct.unpack('<I', body[stream.count - 4 : stream.count])[0]
    if told and told != zlib.crc32(body[: stream.count - 4]):
        raise McapError('an attachment that is not what its checksum says')
    return record
