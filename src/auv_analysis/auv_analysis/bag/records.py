"""The records of an MCAP file in order, finished or not, damaged or not."""

import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Chunk, DataEnd, Footer, McapRecord, Message

from auv_analysis.bag.framing import (
    DAMAGES,
    MAGIC,
    PREFIX,
    CutError,
    Frame,
    LongAttachment,
    MessageIndex,
    frame_at,
    record_of,
)
from auv_analysis.bag.limits import Counts, TooLargeError, TooManyError, decompressed
from auv_analysis.bag.tables import Table, parts_of_chunk, parts_one_by_one, table_of_messages
from auv_dynamics.files.errors import InputError, first_line

TOGETHER = 4096  # messages outside chunks that are read together


class _Pending:
    """A chunk whose indices are still to come."""

    def __init__(self, chunk: Chunk, position: int):
        self.chunk, self.position = chunk, position
        self.places: list[np.ndarray] = []

    def parts(self, counts: Counts) -> list[Table | McapRecord]:
        """What lies in the chunk, in order."""
        data = decompressed(self.chunk)
        places = np.concatenate(self.places) if self.places else None
        found = parts_of_chunk(data, places, counts)
        return parts_one_by_one(data, counts) if found is None else found


def records(path: Path, notes: list[str]) -> Iterator[Table | McapRecord]:
    """Records of a file in order, with messages in tables.

    Parameters
    ----------
    path : the file
    notes : gets a line where the file is damaged or was not finished

    Raises
    ------
    InputError : not an MCAP file, or one that would take too much memory

    """
    finished = False
    messages: list[Message] = []
    with path.open('rb') as stream:
        for item, position in _opened(stream):
            if isinstance(item, Message) and len(messages) < TOGETHER:
                messages.append(item)
                continue
            if messages:
                yield table_of_messages(messages)
                messages = []
            if isinstance(item, Message):
                messages.append(item)
            elif isinstance(item, Exception):
                finished = _ended(path, item, position, notes, finished)
            elif isinstance(item, LongAttachment):
                notes.append(f'{path.name}: attachment {item.name!r} of {item.size} bytes not read')
            else:
                finished = finished or isinstance(item, Footer)
                yield item
    if not finished:
        notes.append(f'{path.name}: was not finished, its writer was killed; read to the end')


def _ended(path: Path, error: Exception, position: int, notes: list[str], finished: bool) -> bool:
    """Note why a file was not read further; whether nothing more is to be said of its end."""
    if isinstance(error, CutError):
        return finished
    if isinstance(error, TooLargeError):
        raise InputError(path, f'byte {position}', *error.args) from None
    if position <= len(MAGIC):
        raise InputError(path, '', 'an MCAP file', first_line(error)) from None
    notes.append(f'{path.name}: damaged from byte {position}, read up to there')
    return True


def _opened(stream: IO[bytes]) -> Iterator[tuple[Any, int]]:
    """Records and the places where they begin, chunks opened; an exception may be the last one."""
    counts = Counts(os.fstat(stream.fileno()).st_size)
    pending: _Pending | None = None
    for item, position in _closed(stream):
        if pending is not None and isinstance(item, MessageIndex):
            pending.places.append(item.entries['place'].astype(np.int64))
            continue
        if pending is not None:
            try:
                parts = pending.parts(counts)
                for part in parts:
                    counts.note(part)
            except DAMAGES as error:
                yield error, pending.position
                return
            for part in parts:
                yield part, pending.position
            pending = None
        if isinstance(item, Chunk):
            pending = _Pending(item, position)
        elif item is not None:
            try:
                counts.note(item)
            except TooManyError as error:
                yield error, position
                return
            yield item, position


def _closed(stream: IO[bytes]) -> Iterator[tuple[Any, int]]:
    """Records as they stand in the file, then an exception or None."""
    position = 0
    try:
        _check_magic(stream, 'another beginning')
        position, record = len(MAGIC), None
        checksum: int | None = zlib.crc32(MAGIC)
        while not isinstance(record, Footer):
            frame = frame_at(stream, position)
            record = record_of(frame)
            told = record.data_section_crc if isinstance(record, DataEnd) else 0
            if told and checksum is not None and told != checksum:
                raise McapError('data that is not what its checksum says')
            yield record, position
            checksum, position = _checksum(frame, checksum), frame.end
        _check_magic(stream, 'another end')
    except (CutError, *DAMAGES) as error:
        yield error, position
    else:
        yield None, position


def _checksum(frame: Frame, before: int | None) -> int | None:
    """Checksum up to the end of a record; None where not all has been read."""
    length = frame.end - frame.start - PREFIX.size
    if before is None or len(frame.body) < length:
        return None
    return zlib.crc32(frame.body, zlib.crc32(PREFIX.pack(frame.opcode, length), before))


def _check_magic(stream: IO[bytes], found: str) -> None:
    data = stream.read(len(MAGIC))
    if data != MAGIC:
        raise CutError if MAGIC.startswith(data) else McapError(found)
