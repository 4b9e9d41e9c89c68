"""The records of an MCAP file in order, finished or not, damaged or not."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, Footer, McapRecord, Message
from mcap.stream_reader import StreamReader, breakup_chunk, get_chunk_data_stream
from zstandard import ZstdError

from auv_analysis.bag.tables import Table, parts_of_chunk, table_of_messages
from auv_dynamics.files import InputError

MAGIC = b'\x89MCAP0\r\n'
ENTRY = np.dtype([('log_time', '<u8'), ('place', '<u8')])  # of a message index
PIECE = 1 << 24  # bytes
TOGETHER = 4096  # messages outside chunks that are read together
ENDS = (EndOfFile, struct.error)  # the reader unpacks a record that is cut without asking
DAMAGES = (McapError, ValueError, KeyError, OverflowError, RuntimeError, MemoryError, ZstdError)


class _Index(McapRecord):
    """A message index: where the messages of one channel lie in the chunk before it."""

    def __init__(self, places: np.ndarray):
        self.places = places


class _Reader(StreamReader):
    """The same records, but whole chunks, and message indices without a tuple per message."""

    def _read_record(self, opcode: int, length: int) -> McapRecord | None:
        if opcode != Opcode.MESSAGE_INDEX:
            return super()._read_record(opcode, length)
        self._stream.read2()
        size = -(-self._stream.read4() // ENTRY.itemsize) * ENTRY.itemsize
        data = b''
        while len(data) < size:  # in pieces: a damaged size may be that of the whole memory
            data += self._stream.read(min(size - len(data), PIECE))
        return _Index(np.frombuffer(data, ENTRY)['place'].astype(np.int64))


class _Pending:
    """A chunk whose indices are still to come."""

    def __init__(self, chunk: Chunk, position: int):
        self.chunk, self.position = chunk, position
        self.places: list[np.ndarray] = []

    def parts(self) -> list[Table | McapRecord]:
        """What lies in the chunk, in order."""
        stream, length = get_chunk_data_stream(self.chunk, validate_crc=True)
        data = stream.read(length)
        found = parts_of_chunk(data, np.concatenate(self.places) if self.places else None)
        return [*breakup_chunk(self.chunk)] if found is None else found


def records(path: Path, notes: list[str]) -> Iterator[Table | McapRecord]:
    """Records of a file in order, with messages in tables.

    Parameters
    ----------
    path : the file
    notes : gets a line where the file is damaged or was not finished

    Raises
    ------
    InputError : not an MCAP file

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
            else:
                finished = finished or isinstance(item, Footer)
                yield item
    if not finished:
        notes.append(f'{path.name}: was not finished, its writer was killed; read to the end')


def _ended(path: Path, error: Exception, position: int, notes: list[str], finished: bool) -> bool:
    """Note why a file was not read further; whether nothing more is to be said of its end."""
    if isinstance(error, ENDS):
        if 0 < position < len(MAGIC) or not MAGIC.startswith(_head(path)):
            raise InputError(path, '', 'an MCAP file', 'another beginning') from None
        return finished
    if position <= 64:
        found = (str(error) or repr(error)).splitlines()[0]
        raise InputError(path, '', 'an MCAP file', found) from None
    notes.append(f'{path.name}: damaged from byte {position}, read up to there')
    return True


def _opened(stream: IO[bytes]) -> Iterator[tuple[Any, int]]:
    """Records and the places where they end, chunks opened; an exception is the last one."""
    pending: _Pending | None = None
    for item, position in _closed(stream):
        if pending is not None and isinstance(item, _Index):
            pending.places.append(item.places)
            continue
        if pending is not None:
            try:
                parts = pending.parts()
            except (*ENDS, *DAMAGES) as error:
                yield error, pending.position
                return
            for part in parts:
                yield part, pending.position
            pending = None
        if isinstance(item, Chunk):
            pending = _Pending(item, position)
        elif item is not None:
            yield item, position


def _closed(stream: IO[bytes]) -> Iterator[tuple[Any, int]]:
    """Records as they stand in the file, then an exception or None."""
    try:
        for record in _Reader(stream, emit_chunks=True, validate_crcs=True).records:
            yield record, stream.tell()
    except (*ENDS, *DAMAGES) as error:
        yield error, stream.tell()
    else:
        yield None, stream.tell()


def _head(path: Path) -> bytes:
    with path.open('rb') as stream:
        return stream.read(len(MAGIC))
