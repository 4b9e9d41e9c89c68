"""All records of a file that can be believed, and what lies between them that cannot."""

from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import IO, NamedTuple

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Footer, McapRecord, Message, Schema

from auv_analysis.bag.framing import (
    DAMAGES,
    MAGIC,
    PREFIX,
    RESERVED,
    CutError,
    Frame,
    MessageIndex,
    frame_at,
    record_of,
)
from auv_analysis.bag.limits import LARGEST_CHUNK, Counts, TooManyError, check_length, decompressed
from auv_analysis.bag.tables import Table, parts_of_chunk, parts_one_by_one
from auv_analysis.recovery.anchors import CHUNK_HEAD, Anchors
from auv_dynamics.files.errors import InputError, first_line

COMPRESSIONS = (b'', b'lz4', b'zstd')


class Found(NamedTuple):
    """A record.

    Attributes
    ----------
    record : None of a kind that is not known
    start, end : its place, bytes
    parts : of a chunk, what lies in it
    proven : whether it shows by itself that it is undamaged

    """

    record: McapRecord | None
    start: int
    end: int
    parts: Sequence[Table | McapRecord] = ()
    proven: bool = False


class Lost(NamedTuple):
    """Bytes that are left out, and why."""

    start: int
    end: int
    why: str


class Scan:
    """Walks through a file; behind damage it goes on at the next record that proves itself.

    Parameters
    ----------
    path : MCAP file
    stream : of it

    Attributes
    ----------
    size : bytes of the file
    starts_well, ends_well : whether it begins and ends as an MCAP file does

    """

    def __init__(self, path: Path, stream: IO[bytes]):
        self._stream = stream
        self.size = path.stat().st_size
        self._path, self._counts = path, Counts(self.size)
        self._anchors = Anchors(stream, self.size)
        self._has_chunks, self._has_plain, self.ends_well = False, False, False
        stream.seek(0)
        self.starts_well = stream.read(len(MAGIC)) == MAGIC[: self.size]

    def items(self) -> Iterator[Found | Lost]:
        """Records in their order, and what is lost between them; InputError: they are too many."""
        if not self.size:
            return
        place = proven = len(MAGIC)
        if not self.starts_well:
            place = proven = yield from self._entered(0, 0, 'no MCAP file begins so')
        while place < self.size:
            end, found = self._at(place)
            if isinstance(found, Found) and self._is_believed(found):
                yield found
                place = found.end
                proven = place if found.proven else proven
                if isinstance(found.record, Footer):
                    break
            elif isinstance(found, str) and end and self._is_plausible(end):
                yield Lost(place, end, found)
                place = end
            else:
                why = found if isinstance(found, str) else 'what follows is no record'
                place = proven = yield from self._entered(place, proven, why)
        if place < self.size and not self.ends_well:
            extra = self._bytes(place, len(MAGIC)) == MAGIC
            yield Lost(place + len(MAGIC) * extra, self.size, 'no MCAP file ends so')

    def _at(self, place: int) -> tuple[int, Found | str]:
        """The record at a place, or what is wrong with it; its end by its length, 0: unknown."""
        self._stream.seek(place)
        try:
            frame = frame_at(self._stream, place, LARGEST_CHUNK)
        except CutError:
            return 0, 'the file ends within a record'
        except McapError as error:
            return 0, first_line(error)
        try:
            found = self._found(frame)
            for part in (found.record, *found.parts):
                self._counts.note(part)
            return frame.end, found
        except TooManyError as error:
            raise InputError(self._path, f'byte {place}', *error.args) from None
        except DAMAGES as error:
            return frame.end, first_line(error)

    def _found(self, frame: Frame) -> Found:
        record = record_of(frame)
        if isinstance(record, Chunk):
            self._has_chunks = True
            content = decompressed(record)
            tiles = parts_of_chunk(content, None, self._counts)
            proven = record.uncompressed_crc != 0 or tiles is not None
            parts = parts_one_by_one(content, self._counts) if tiles is None else tiles
            return Found(record, frame.start, frame.end, parts, proven)
        if isinstance(record, MessageIndex) and len(frame.body) != 6 + record.entries.nbytes:
            raise McapError('a message index that is longer than its fields')
        if isinstance(record, Message) and self._has_chunks:
            raise McapError('a message between chunks')
        self._has_plain |= isinstance(record, Schema | Channel | Message)
        proven = isinstance(record, Attachment) and frame.body[-4:] != bytes(4)
        return Found(record, frame.start, frame.end, (), proven)

    def _is_believed(self, found: Found) -> bool:
        """Whether a record proves itself, ends the file or is followed by what looks like one."""
        if not isinstance(found.record, Footer):
            return found.proven or self._is_plausible(found.end)
        end, tail = found.end + len(MAGIC), self._bytes(found.end, len(MAGIC))
        self.ends_well = tail == MAGIC and end == self.size
        return tail == MAGIC or end >= self.size

    def _is_plausible(self, place: int) -> bool:
        """Whether a record may begin here, or the file ends."""
        data = self._bytes(place, PREFIX.size)
        if not data:
            return True
        if not data[0] or data[0] in RESERVED:
            return False
        try:
            check_length(*PREFIX.unpack(data.ljust(PREFIX.size, b'\0')))
        except McapError:
            return False
        return True

    def _entered(self, place: int, proven: int, why: str) -> Generator[Lost, None, int]:
        """Skip to the next record that can be believed, maybe one before `place`."""
        self._has_chunks |= self._looks_like_chunk(place)  # whose messages prove nothing
        found = [self._anchors.next_proven(proven)]
        if not self._has_chunks and (self._has_plain or found == [None]):
            found.append(self._anchors.next_chain(place + 1))
        places = [at for at in found if at is not None]
        entered = min(places, default=self.size)
        if entered < self.size and entered < place:
            yield Lost(proven, entered, why)
        else:
            yield Lost(place, entered, why)
        return entered

    def _looks_like_chunk(self, place: int) -> bool:
        head = self._bytes(place, PREFIX.size + CHUNK_HEAD.size + 4)
        if len(head) < PREFIX.size + CHUNK_HEAD.size or head[0] != Opcode.CHUNK:
            return False
        named = CHUNK_HEAD.unpack_from(head, PREFIX.size)[-1]
        return named <= 4 and head[PREFIX.size + CHUNK_HEAD.size :][:named] in COMPRESSIONS

    def _bytes(self, place: int, count: int) -> bytes:
        self._stream.seek(place)
        return self._stream.read(count)
