"""How much a bag may make us hold: sizes are checked before anything is read or decompressed."""

import zlib
from typing import Any

import lz4.frame
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk

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


class TooLargeError(McapError):
    """More than we are willing to hold; the text says what and how much."""


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
