"""How a bag is stored: compression, chunks, and where one file ends and the next begins."""

from dataclasses import dataclass

from mcap.writer import CompressionType

COMPRESSIONS = {
    'zstd': CompressionType.ZSTD,
    'lz4': CompressionType.LZ4,
    'none': CompressionType.NONE,
}
LEAST_SIZE = 1 << 20  # bytes of a split file, beside its attachments: below, definitions prevail
LEAST_DURATION = 1.0  # s of a split file
FREE_SPACE = 1 << 25  # bytes that the recorder leaves on a disk, if not told otherwise
LARGEST_CHUNK = 1 << 26  # bytes; readers allow for more, since a message may be longer


@dataclass(frozen=True)
class Storage:
    """What a bag writer is asked for.

    Attributes
    ----------
    compression : 'zstd', 'lz4' or 'none'
    chunk_size : bytes from which a chunk is closed
    max_size : bytes that a file of the bag has at most; 0: one file
    max_duration : ns of log time after which a new file is begun; 0: one file
    pace : topic by whose log times this is done; '': that of the first message of a file
    free_space : bytes that stay free on the file system; 0: not looked at

    """

    compression: str = 'zstd'
    chunk_size: int = 1 << 20
    max_size: int = 0
    max_duration: int = 0
    pace: str = ''
    free_space: int = 0
