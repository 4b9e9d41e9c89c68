"""An MCAP file, finished, cut or damaged: its records in order, within limits.

Readers stop at the first damage. The repair goes on behind it: at the next record, where the
length of the damaged one leads to one, else at the next chunk or attachment whose checksum is
right.
"""

import re
import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
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
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from zstandard import ZstdError

from auv_analysis.bag import limits
from auv_analysis.bag.chunks import (
    HEAD,
    PREFIX,
    Body,
    MessageTable,
    by_channel,
    contents_of,
    table_at,
)
from auv_analysis.bag.limits import Counts, TooLargeError, TooManyError, decompressed
from auv_dynamics.files.errors import InputError, first_line

DAMAGED = 'damaged from byte'
MAGIC = b'\x89MCAP0\r\n'
RESERVED = range(0x10, 0x80)  # opcodes that mean nothing yet; above, they are private
DAMAGES = (  # what reading a damaged record may end in
    *(McapError, EndOfFile, ZstdError, struct.error, ValueError, KeyError),
    *(OverflowError, RuntimeError, MemoryError),
)
TOGETHER, HEAVY = 4096, 1 << 24  # messages outside chunks, and bytes, that are read together
LONG_HEAD = 1 << 16  # bytes of a long attachment that are read for its name
KINDS: dict[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}
FOOTER = 16  # bytes of the footer that the summary's checksum covers
CANDIDATE = re.compile(rb'(?s)(?=[\x06\x09].{4}\x00{4})')  # chunk or attachment, below 4 GiB
WINDOW = 1 << 20  # bytes that are searched at once
CHUNK_HEAD = struct.Struct('<QQQII')  # times, size, checksum, length of the compression's name
INDEX_HEAD = struct.Struct('<BQHI')  # prefix of a message index, channel, bytes of its entries
BUDGET = 8  # bytes that are looked into in vain, per byte of the file


class MessageIndex(NamedTuple):
    """Number of messages of a channel in the chunk before it."""

    channel: int
    messages: int


class LongAttachment(NamedTuple):
    """An attachment that is too long to be read."""

    name: str
    size: int


Part = McapRecord | MessageIndex | LongAttachment | MessageTable


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

    def prefix(self) -> bytes:
        """Opcode and length."""
        return PREFIX.pack(self.opcode, self.end - self.start - PREFIX.size)


class Read(NamedTuple):
    """A record that has been read, or several messages outside of chunks.

    Attributes
    ----------
    opcode, start, end : as of a `Frame`
    parts : the record, or what lies in a chunk; nothing of a kind that is not known
    proven : whether it shows by itself that it is undamaged
    compression : of a chunk, 'zstd', 'lz4' or 'none'

    """

    opcode: int
    start: int
    end: int
    parts: Sequence[Part] = ()
    proven: bool = False
    compression: str = ''


class Lost(NamedTuple):
    """Bytes that cannot be used, and why.

    Attributes
    ----------
    start, end : of them
    why : in a few words
    cut : whether the file ends within a record
    limit : of a record that is too large to be looked at: what is expected, and what was found

    """

    start: int
    end: int
    why: str
    cut: bool = False
    limit: tuple[str, ...] = ()


class _CutError(Exception):
    """The file ends before the record does."""


class McapFile:
    """Reads an MCAP file from its beginning to its end.

    Parameters
    ----------
    path : the file
    notes : gets a line where the file is damaged or was not finished
    resync : whether to go on behind damage; else reading ends there

    Attributes
    ----------
    schemas, channels : id -> definition as far as `records` has come, of a channel the first
    size : bytes of the file
    begins_well, ends_well : whether it begins as an MCAP file does, and has the end of one
    faults : checksums of all data and of the summary that are not right, where damage is no end

    """

    def __init__(self, path: Path, notes: list[str] | None = None, *, resync: bool = False):
        self.path, self._resync = path, resync
        self._notes = [] if notes is None else notes
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.size = path.stat().st_size
        self.begins_well, self.ends_well = False, False
        self.faults: list[str] = []
        self._stream: IO[bytes]
        self._counts = Counts(self.size)
        self._in_chunks = self._is_damaged = False  # since the last whole chunk
        self._checksum: int | None = None  # of data, then summary; None: not all has been read
        self._summary = 0  # where it begins; 0: the end of the data has not been read
        self._budget = BUDGET * self.size + WINDOW

    def records(self) -> Iterator[McapRecord | MessageTable]:
        """Records in order up to the first damage, messages in tables, each channel once.

        Raises
        ------
        InputError : not an MCAP file, or one that would take too much memory

        """
        finished = False
        for item in self.items():
            if isinstance(item, Lost):
                if item.cut:
                    continue
                if item.start <= len(MAGIC):
                    raise InputError(self.path, '', 'an MCAP file', item.why)
                self._notes.append(f'{self.path.name}: {DAMAGED} {item.start}, read up to there')
                return
            finished = finished or item.opcode == Opcode.FOOTER
            for part in item.parts:
                if isinstance(part, LongAttachment):
                    about = f'attachment {part.name!r} of {part.size} bytes not read'
                    self._notes.append(f'{self.path.name}: {about}')
                elif isinstance(part, McapRecord | MessageTable) and self._is_new(part):
                    yield part
        if not finished:
            about = 'was not finished, its writer was killed; read to the end'
            self._notes.append(f'{self.path.name}: {about}')

    def _is_new(self, part: McapRecord | MessageTable) -> bool:
        """Whether it is not a channel that is known; keeps definitions."""
        if isinstance(part, Schema):
            self.schemas[part.id] = part
        elif isinstance(part, Channel):
            return self.channels.setdefault(part.id, part) is part
        return True

    def schema_of(self, channel: Channel) -> Schema | None:
        """Schema of a channel; None where it stands nowhere before."""
        return self.schemas.get(channel.schema_id)

    def by_channel(self, table: MessageTable) -> Iterator[tuple[Channel, np.ndarray]]:
        """Each channel of a table and the numbers of its messages; InputError: an unknown one."""
        for number, index in by_channel(table.channels):
            if number not in self.channels:
                expected = 'a channel before its messages'
                raise InputError(self.path, f'channel {number}', expected, None)
            yield self.channels[number], index

    def items(self) -> Iterator[Read | Lost]:
        """Records as they stand in the file, and what is lost between them.

        Raises
        ------
        InputError : more records than are looked at; without resync a record that is too large

        """
        return _with_tables(self._items())

    def _items(self) -> Iterator[Read | Lost | Frame]:
        with self.path.open('rb') as self._stream:
            begin = self._bytes(0, len(MAGIC))
            self.begins_well = begin == MAGIC[: self.size]
            self._checksum = zlib.crc32(begin)
            place = proven = len(MAGIC) if self.begins_well else 0
            while place < self.size:
                found = self._at(place) if place else Lost(0, 0, 'another beginning')
                if not isinstance(found, Lost) and not self._is_believed(found):
                    found = Lost(place, 0, 'what follows is no record')
                if not isinstance(found, Lost):
                    yield found
                    place = found.end
                    proven = place if isinstance(found, Read) and found.proven else proven
                    if found.opcode == Opcode.FOOTER:
                        yield from self._tail(place)
                        return
                    continue
                if not self._resync:
                    yield found
                    return
                self._checksum, self._is_damaged = None, True
                if found.end and self._may_begin(found.end):
                    yield found
                    place = found.end
                    continue
                entered = self._next_proven(proven)
                if entered is None:
                    yield found._replace(end=self.size)
                    return
                start = proven if entered.start < place else place
                yield found._replace(start=start, end=entered.start)
                yield entered
                place = proven = entered.end

    def _tail(self, place: int) -> Iterator[Lost]:
        """Bytes behind the footer, where that is not the end of an MCAP file."""
        tail = self._bytes(place, len(MAGIC))
        self.ends_well = tail == MAGIC
        if self.ends_well:
            place += len(MAGIC)
            if self._resync and place < self.size:
                yield Lost(place, self.size, 'another end')
        elif not MAGIC.startswith(tail) or (self._resync and tail):
            yield Lost(place, self.size, 'another end')

    def _at(self, place: int) -> Read | Frame | Lost:
        """The record at a place, a message as its frame; where it is damaged, its end if known."""
        end = 0
        try:
            frame = self._frame(place)
            end = frame.end
            return self._read(frame)
        except _CutError:
            return Lost(place, 0, 'the file ends within a record', cut=True)
        except TooLargeError as error:
            if isinstance(error, TooManyError) or not self._resync:
                raise InputError(self.path, f'byte {place}', *error.args) from None
            _, length = PREFIX.unpack(self._bytes(place, PREFIX.size))
            end = place + PREFIX.size + length
            return Lost(place, end, first_line(error), limit=error.args)
        except DAMAGES as error:
            return Lost(place, end, first_line(error))

    def _frame(self, start: int) -> Frame:
        """Bytes of the record that begins at a place."""
        prefix = self._bytes(start, PREFIX.size)
        if len(prefix) < PREFIX.size:
            raise _CutError
        opcode, length = PREFIX.unpack(prefix)
        end = start + PREFIX.size + length
        if not opcode or opcode in RESERVED:
            raise McapError(f'no record has the opcode {opcode}')
        if end > self.size:
            raise _CutError
        limits.check_length(opcode, length)
        largest = limits.LARGEST_CHUNK if self._resync else limits.LARGEST_ATTACHMENT
        is_long = opcode == Opcode.ATTACHMENT and length > largest
        body = self._stream.read(LONG_HEAD if is_long else length)
        if len(body) < length and not is_long:
            raise _CutError
        return Frame(opcode, start, end, body)

    def _read(self, frame: Frame) -> Read | Frame:
        """The record of a frame; McapError, ValueError and others where it is damaged."""
        opcode, start, end, body = frame
        if opcode == Opcode.MESSAGE:
            if len(body) < HEAD.itemsize - PREFIX.size:
                raise McapError('a record that is shorter than its fields')
            if self._in_chunks and self._is_damaged:
                raise McapError('a message between chunks')  # of one whose own head is damaged
            self._verify(frame, None)
            return frame
        parts: list[Part] = []
        proven, compression = False, ''
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(Body(body))
            data = decompressed(chunk)
            parts += contents_of(data, self._counts, self._indexed(end))
            proven, compression = True, chunk.compression or 'none'
            self._in_chunks, self._is_damaged = True, False
        elif opcode == Opcode.MESSAGE_INDEX:
            channel, size = struct.unpack_from('<HI', body)
            if size > len(body) - 6 or size % 16:
                raise McapError('a record that is shorter than its fields')
            parts.append(MessageIndex(channel, size // 16))
        elif opcode == Opcode.ATTACHMENT:
            parts.append(_attachment(frame))
            proven = body[-4:] != bytes(4)
        elif opcode in KINDS:
            parts.append(KINDS[opcode].read(Body(body)))
        for part in parts if opcode != Opcode.CHUNK else ():  # which counts as it is read
            self._counts.note(part)
        self._verify(frame, parts[0] if parts else None)
        return Read(opcode, start, end, parts, proven, compression)

    def _indexed(self, place: int) -> np.ndarray:
        """Where the messages of a chunk begin in it, by the message indices behind it."""
        found = [np.zeros(0, np.int64)]
        head = self._bytes(place, INDEX_HEAD.size)
        while len(head) == INDEX_HEAD.size and head[0] == Opcode.MESSAGE_INDEX:
            _, length, _, size = INDEX_HEAD.unpack(head)
            if size % 16 or size + 6 > length or place + PREFIX.size + length > self.size:
                break
            found.append(np.frombuffer(self._stream.read(size), '<u8')[1::2].astype(np.int64))
            place += PREFIX.size + length
            head = self._bytes(place, INDEX_HEAD.size)
        return np.concatenate(found)

    def _verify(self, frame: Frame, record: Part | None) -> None:
        """Follow the checksum of all data, then that of the summary."""
        prefix, before = frame.prefix(), self._checksum
        if isinstance(record, DataEnd):
            if before is not None and record.data_section_crc not in (0, before):
                if not self._resync:
                    raise McapError('data that is not what its checksum says')
                self.faults.append('the data is not what its checksum says')
            self._checksum, self._summary = 0, frame.end
            return
        if before is None or len(frame.body) < frame.end - frame.start - PREFIX.size:
            self._checksum = None
            return
        if isinstance(record, Footer) and self._summary:
            told = zlib.crc32(frame.body[:FOOTER], zlib.crc32(prefix, before))
            if record.summary_crc not in (0, told) or record.summary_start not in (
                0, self._summary,
            ):  # fmt: skip
                self.faults.append('the summary is not what its checksum says')
        self._checksum = zlib.crc32(frame.body, zlib.crc32(prefix, before))

    def _is_believed(self, found: Read | Frame) -> bool:
        """Whether a record proves itself, ends the file or is followed by what looks like one."""
        if not self._resync:
            return True
        if found.opcode == Opcode.FOOTER:
            is_end = found.end + len(MAGIC) >= self.size
            return is_end or self._bytes(found.end, len(MAGIC)) == MAGIC
        return (isinstance(found, Read) and found.proven) or self._may_begin(found.end)

    def _may_begin(self, place: int) -> bool:
        """Whether a record may begin here, or the file ends."""
        data = self._bytes(place, PREFIX.size)
        if not data:
            return True
        opcode, length = PREFIX.unpack(data.ljust(PREFIX.size, b'\0'))
        if not opcode or opcode in RESERVED:
            return False
        try:
            limits.check_length(opcode, length)
        except McapError:  # perhaps whole, and too large for us
            return place + PREFIX.size + int(length) <= self.size
        return True

    def _next_proven(self, begin: int) -> Read | None:
        """The next chunk or attachment that proves itself, from a place on."""
        while begin < self.size:
            window = self._bytes(begin, WINDOW + PREFIX.size - 1)
            for match in CANDIDATE.finditer(window):
                cost = self._cost(begin + match.start())
                if cost is None:
                    continue
                self._budget -= cost
                if self._budget < 0:
                    return None
                found = self._at(begin + match.start())
                if isinstance(found, Read) and found.proven:
                    return found
            begin += WINDOW
        return None

    def _cost(self, place: int) -> int | None:
        """Bytes to look into at a candidate; None where the lengths in it do not add up."""
        head = self._bytes(place, PREFIX.size + 64).ljust(PREFIX.size + 64, b'\0')
        opcode, length = PREFIX.unpack_from(head)
        if place + PREFIX.size + length > self.size:
            return None
        if opcode == Opcode.ATTACHMENT:
            named = int.from_bytes(head[PREFIX.size + 16 : PREFIX.size + 20], 'little')
            return int(length) if length >= 36 + named else None
        *_, size, _, named = CHUNK_HEAD.unpack_from(head, PREFIX.size)
        at = PREFIX.size + CHUNK_HEAD.size + named
        packed = int.from_bytes(head[at : at + 8], 'little')
        fits = named in (0, 3, 4) and length >= CHUNK_HEAD.size + named + 8 + packed
        return int(length) + min(size, limits.LARGEST_CHUNK) if fits else None

    def _bytes(self, place: int, count: int) -> bytes:
        self._stream.seek(place)
        return self._stream.read(count)


def _with_tables(items: Iterable[Read | Lost | Frame]) -> Iterator[Read | Lost]:
    """The same with the frames of messages that follow one another read as tables."""
    waiting: list[Frame] = []
    size = 0
    for item in items:
        is_full = len(waiting) == TOGETHER or size > HEAVY
        if waiting and (is_full or not isinstance(item, Frame)):
            yield _joined(waiting)
            waiting, size = [], 0
        if isinstance(item, Frame):
            waiting.append(item)
            size += len(item.body)
        else:
            yield item
    if waiting:
        yield _joined(waiting)


def _joined(frames: Sequence[Frame]) -> Read:
    """Messages outside of chunks."""
    data = b''.join(part for frame in frames for part in (frame.prefix(), frame.body))
    sizes = np.array([frame.end - frame.start for frame in frames], np.int64)
    table = table_at(data, np.cumsum(sizes) - sizes)
    return Read(Opcode.MESSAGE, frames[0].start, frames[-1].end, [table])


def _attachment(frame: Frame) -> Attachment | LongAttachment:
    body = frame.body
    stream = Body(body)
    if len(body) < frame.end - frame.start - PREFIX.size:
        stream.read(16)
        name, _ = stream.read_prefixed_string(), stream.read_prefixed_string()
        return LongAttachment(name, stream.read8())
    record = Attachment.read(stream)
    told = struct.unpack('<I', body[stream.count - 4 : stream.count])[0]
    if told and told != zlib.crc32(body[: stream.count - 4]):
        raise McapError('an attachment that is not what its checksum says')
    return record
