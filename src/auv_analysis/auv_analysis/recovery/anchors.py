"""Where a damaged file can be entered again: at a record that proves itself."""

import re
import struct
from collections.abc import Callable, Iterator
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Schema

from auv_analysis.bag.framing import DAMAGES, PREFIX, CutError, Frame, frame_at, record_of
from auv_analysis.bag.limits import LARGEST_CHUNK, Counts, decompressed
from auv_analysis.bag.tables import parts_of_chunk

PROVEN = re.compile(rb'(?s)(?=[\x06\x09].{4}\x00{4})')  # chunk or attachment, below 4 GiB
PLAIN = re.compile(rb'(?s)(?=[\x03\x04\x05].{4}\x00{4})')  # schema, channel or message
WINDOW = 1 << 20  # bytes that are searched at once
CHAIN = 3  # plain records that must follow one another
CHUNK_HEAD = struct.Struct('<QQQII')  # times, size, checksum, length of the compression's name
PATIENCE = 8  # bytes that are looked into in vain, per byte of the file


class Anchors:
    """Finds the next record that proves itself.

    Parameters
    ----------
    stream : of the file
    size : bytes of it

    """

    def __init__(self, stream: IO[bytes], size: int):
        self._stream, self._size = stream, size
        self._patience = PATIENCE * size + WINDOW

    def next_proven(self, begin: int) -> int | None:
        """Place of the next chunk or attachment whose checksum is right."""
        return self._next(begin, PROVEN, self._is_proven)

    def next_chain(self, begin: int) -> int | None:
        """Place from which schemas, channels and messages follow one another."""
        return self._next(begin, PLAIN, self._is_chain)

    def _next(
        self, begin: int, pattern: re.Pattern[bytes], fits: Callable[[int], bool]
    ) -> int | None:
        for place in self._candidates(begin, pattern):
            if self._patience < 0:
                return None
            if fits(place):
                return place
        return None

    def _candidates(self, begin: int, pattern: re.Pattern[bytes]) -> Iterator[int]:
        while begin < self._size:
            self._stream.seek(begin)
            window = self._stream.read(WINDOW + PREFIX.size)
            for match in pattern.finditer(window):
                if match.start() < WINDOW:
                    yield begin + match.start()
            begin += WINDOW

    def _record(self, place: int) -> tuple[Frame, McapRecord | None] | None:
        """The record at a place and its bytes; None where there is none, or a damaged one."""
        self._stream.seek(place)
        try:
            frame = frame_at(self._stream, place, LARGEST_CHUNK)
            self._patience -= len(frame.body)
            return frame, record_of(frame)
        except (CutError, *DAMAGES):
            return None

    def _is_proven(self, place: int) -> bool:
        if not self._is_consistent(place):
            return False
        found = self._record(place)
        if found is None:
            return False
        frame, record = found
        if isinstance(record, Chunk):
            self._patience -= record.uncompressed_size
            try:
                content = decompressed(record)  # by checksum, else by what is in it
                return (
                    record.uncompressed_crc != 0
                    or parts_of_chunk(content, None, Counts(self._size)) is not None
                )
            except DAMAGES:
                return False
        return isinstance(record, Attachment) and frame.body[-4:] != bytes(4)

    def _is_consistent(self, place: int) -> bool:
        """Whether the lengths in a record add up, before all of it is read."""
        self._stream.seek(place)
        head = self._stream.read(PREFIX.size + 64)
        opcode, length = PREFIX.unpack_from(head)
        if place + PREFIX.size + length > self._size:
            return False
        if opcode == Opcode.ATTACHMENT:
            named = int.from_bytes(head[PREFIX.size + 16 : PREFIX.size + 20], 'little')
            return bool(length >= 36 + named)
        if len(head) < PREFIX.size + CHUNK_HEAD.size + 8:
            return False
        named = CHUNK_HEAD.unpack_from(head, PREFIX.size)[-1]
        if named not in (0, 3, 4):
            return False
        at = PREFIX.size + CHUNK_HEAD.size + named
        return bool(
            length >= CHUNK_HEAD.size + named + 8 + int.from_bytes(head[at : at + 8], 'little')
        )

    def _is_chain(self, place: int) -> bool:
        for _ in range(CHAIN):
            found = self._record(place)
            if found is None or not isinstance(found[1], Schema | Channel | Message):
                return False
            place = found[0].end
        return True
