"""Memory limits for untrusted bags: sizes and counts are checked before anything is allocated."""

import zlib
from contextlib import suppress
from typing import Any

import lz4.frame
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata, Schema

MIB = 1 << 20
LARGEST_CHUNK = 512 * MIB  # bytes, decompressed; recorders close theirs at 1 to 64 MiB
LARGEST_ATTACHMENT = 64 * MIB  # bytes of one that is read, and of all together
LARGEST_RECORD: dict[int, int] = {
    Opcode.CHUNK: LARGEST_CHUNK + MIB,
    Opcode.MESSAGE: LARGEST_CHUNK,
    Opcode.MESSAGE_INDEX: LARGEST_CHUNK,
    Opcode.STATISTICS: 1 * MIB,
    Opcode.CHUNK_INDEX: 2 * MIB,
}
LARGEST_OTHER = 64 * MIB  # bytes of a schema, of metadata and of what is not known
LARGEST_DECODED = 2 * MIB  # bytes of a message, which may become a hundred times as many
DENSEST = 100  # times smaller than it is: the best compressed message above that size
LARGEST_PARSED = MIB // 4  # bytes of the definitions of types that are parsed, of a file
MOST_RECORDS = 1 << 21  # in a chunk; a chunk of 64 MiB holds so many of the smallest messages
FREE_RECORDS = 1 << 17  # in all chunks of a file, beside one per byte of it
FREE_DEFINITIONS = 16 * MIB  # bytes of definitions in all chunks of a file, beside RATIO per byte
RATIO = 8
MOST_NAMED = 10_000  # channels of a file; as many schemas, attachments and metadata


class TooLargeError(McapError):
    """More than we are willing to hold: what is expected, and how much was found."""

    def __str__(self) -> str:
        """As a report of a repair shows it."""
        return 'expected {}, found {}'.format(*self.args)


class TooManyError(TooLargeError):
    """More records than we are willing to look at."""


class Counts:
    """Remaining budget of a file; a hostile one of some kilobytes declares millions of records.

    Parameters
    ----------
    size : bytes of the file

    """

    def __init__(self, size: int):
        self._records = self._most_records = FREE_RECORDS + size
        self._definitions = self._most_definitions = FREE_DEFINITIONS + RATIO * size
        self._names: dict[type, int] = {}
        self._known: set[tuple[type, int]] = set()

    @property
    def most(self) -> int:
        """Number of records that the next chunk may hold."""
        return min(self._records, MOST_RECORDS)

    def take(self, records: int, definitions: int) -> None:
        """Note what a chunk holds; TooManyError: too many records, or bytes of definitions."""
        if records > MOST_RECORDS:
            raise TooManyError(f'a chunk of at most {MOST_RECORDS} records', 'more')
        if records > self._records:
            raise TooManyError(
                f'at most {self._most_records} records in a file of its size', 'more'
            )
        if definitions > self._definitions:
            expected = (
                f'at most {self._most_definitions} bytes of definitions in a file of its size'
            )
            raise TooManyError(expected, 'more')
        self._records -= records
        self._definitions -= definitions

    def note(self, record: object) -> None:
        """Count what has a name or an id of its own."""
        if isinstance(record, Schema | Channel):
            key = type(record), record.id
            if key in self._known:
                return
            self._known.add(key)
        elif not isinstance(record, Attachment | Metadata):
            return
        kind = type(record)
        self._names[kind] = self._names.get(kind, 0) + 1
        if self._names[kind] > MOST_NAMED:
            expected = f'at most {MOST_NAMED} records of the kind {kind.__name__}'
            raise TooManyError(expected, 'more')


def check_length(opcode: int, length: int) -> None:
    """Raise TooLargeError for a record of so many bytes; attachments are looked at elsewhere."""
    most = LARGEST_RECORD.get(opcode, LARGEST_OTHER)
    if length > most and opcode != Opcode.ATTACHMENT:
        raise TooLargeError(f'a record of at most {most} bytes', f'{length}')


def decompressed(chunk: Chunk) -> bytes:
    """Records of a chunk, in no more memory than it declares, as its checksum says.

    Raises
    ------
    TooLargeError : it declares too much
    McapError, ValueError, RuntimeError : it is damaged, or is longer than it declares

    """
    size, written = chunk.uncompressed_size, _written_size(chunk)
    if written is not None and written != size:
        raise McapError(f'a chunk of {written} bytes that declares {size}')
    if size > LARGEST_CHUNK:
        raise TooLargeError(f'a chunk of at most {LARGEST_CHUNK} bytes', f'{size}, decompressed')
    data = _decompress(chunk, size)
    if len(data) != size:
        raise McapError(f'a chunk of {len(data)} bytes that declares {size}')
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise McapError('a chunk that is not what its checksum says')
    return data


def _written_size(chunk: Chunk) -> int | None:
    """Bytes that the compressed data says it holds; None where it does not say."""
    if chunk.compression == 'zstd':
        size = zstandard.frame_content_size(chunk.data)
        return None if size < 0 else size
    if chunk.compression == 'lz4':
        told: dict[str, Any] = lz4.frame.get_frame_info(chunk.data)
        return told['content_size'] or None
    return len(chunk.data)


def _decompress(chunk: Chunk, size: int) -> bytes:
    if chunk.compression == 'zstd':
        return zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size)
    if chunk.compression == 'lz4':
        return lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    if chunk.compression:
        raise McapError(f'unknown compression {chunk.compression!r}')
    return chunk.data


def plain(message: bytes) -> bytes:
    """A message as it was published, where rosbag2 has compressed each by itself.

    The file does not say so, but CDR begins with a zero. What cannot be decompressed, or would
    become very much more, stays as it is.
    """
    if not message.startswith(zstandard.FRAME_HEADER):
        return message
    with suppress(zstandard.ZstdError):
        most = max(LARGEST_DECODED, DENSEST * len(message))
        if zstandard.frame_content_size(message) <= most:  # below zero: it does not say
            return zstandard.ZstdDecompressor().decompress(message)
    return message
