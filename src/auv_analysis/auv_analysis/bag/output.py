"""One MCAP file of a bag while it is recorded: chunks, definitions, whole records or nothing."""

import contextlib
import fcntl
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, cast

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, McapRecord, Schema
from mcap.writer import CompressionType, Writer

from auv_analysis.bag.metadata import Definition, FileExtent, as_text, metadata
from auv_analysis.output.new_files import NEW

COMPRESSIONS = {
    'zstd': CompressionType.ZSTD,
    'lz4': CompressionType.LZ4,
    'none': CompressionType.NONE,
}
LEAST_SIZE = 1 << 20  # bytes of a split file, beside its attachments: below, definitions prevail
LEAST_DURATION = 1.0  # s of a split file
FREE_SPACE = 1 << 25  # bytes that the recorder leaves on a disk, if not told otherwise
LARGEST_CHUNK = 1 << 26  # bytes; readers allow for more, since a message may be longer
BESIDE = 31 + 16  # bytes of a message's record and index beside its data
PER_CHANNEL = 15 + 10 + 10  # bytes of a chunk's index records, of its entry, of the statistics
PER_CHUNK = 128  # bytes of a chunk's head and of its entry in the summary
ENDING = 4096  # bytes of the records that every file ends with
SILENCE = 5.0  # s without the topic that tells the time
PER_TOPIC = 512  # bytes of a topic in the metadata, beside its profiles


@dataclass(frozen=True)
class Storage:
    """Settings of a bag writer.

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


class Output:
    """A new file that is written record by record; each write reaches the system at once.

    Its lock says to others, such as `auv recover`, that it is being written. The lock is advisory
    and goes with the process.

    Parameters
    ----------
    path : must not exist

    Attributes
    ----------
    position : bytes that the system has taken

    """

    def __init__(self, path: Path):
        self.path, self.position, self._synced = path, 0, 0
        self._fd = os.open(path, NEW | os.O_APPEND, 0o644)
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # some network file systems give an open file another number than its name
        self._has_identity = self._identity() == self._identity_of_path()

    def write(self, data: bytes) -> int:
        """Write all of it, or nothing: then the OSError of the system."""
        begin, rest = self.position, memoryview(data)
        try:
            while rest:
                written = os.write(self._fd, rest)
                rest = rest[written:]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._fd, begin)
            raise
        self.position += len(data)
        return len(data)

    def tell(self) -> int:
        """Position of the next write, bytes."""
        return self.position

    def flush(self) -> None:
        """Nothing is held back."""

    def sync(self) -> None:
        """Wait until what was written is on the disk, where that is not sure yet."""
        if self._synced < (position := self.position):
            os.fdatasync(self._fd)
            self._synced = position

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def loss(self) -> str:
        """Change of the file by another process; empty when there was none."""
        position = self.position
        try:
            found = self._identity_of_path()
        except (FileNotFoundError, NotADirectoryError):
            return 'removed or renamed while it was being recorded'
        if self._has_identity and found != self._identity():
            return 'replaced by another file while it was being recorded'
        if os.fstat(self._fd).st_size < position:
            return 'shortened by somebody else while it was being recorded'
        return ''

    def free_space(self) -> int:
        """Bytes of its file system that are left for its user."""
        system = os.fstatvfs(self._fd)
        return system.f_bavail * system.f_frsize

    def _identity(self) -> tuple[int, int]:
        status = os.fstat(self._fd)
        return status.st_dev, status.st_ino

    def _identity_of_path(self) -> tuple[int, int]:
        status = os.lstat(self.path)
        return status.st_dev, status.st_ino


class BagFile:
    """Writes messages; chunks are closed by size, or when `flush` is called.

    Parameters
    ----------
    path : must not exist
    attachments : name -> text, written before the first message
    storage : compression and size of chunks

    Attributes
    ----------
    output : the file
    extent : what has been written

    """

    def __init__(self, path: Path, attachments: Mapping[str, str], storage: Storage):
        self.output, self.extent = Output(path), FileExtent(path.name)
        self._storage, self._pending = storage, 0  # bytes of the chunk, not compressed
        self._since: dict[str, int] = {}  # topic -> its first log time
        self._pace, self._heard = storage.pace, time.monotonic()
        self._writer = Writer(
            cast(IO[bytes], self.output),
            chunk_size=storage.chunk_size,
            compression=COMPRESSIONS[storage.compression],
        )
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._definitions: list[Definition] = []
        self._ending = ENDING + 256 * len(attachments)
        try:
            self._writer.start(profile='ros2', library='auv_gvc')
            for name, text in attachments.items():
                kind = 'application/yaml' if name.endswith(('.yaml', '.yml')) else 'text/plain'
                self._writer.add_attachment(0, 0, name, kind, text.encode())
        except OSError:
            self.output.close()
            path.unlink(missing_ok=True)
            raise

    def define(self, definition: Definition, schema: str) -> None:
        """Register a topic.

        The records stand outside of the chunks as well: so that no damaged chunk takes away what
        the messages behind it are.

        Parameters
        ----------
        definition : of the topic
        schema : full ros2msg text of its type

        """
        kind, text = definition.kind, schema.encode()
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(kind, 'ros2msg', text)
            self._put(Schema(self._schemas[kind], text, 'ros2msg', kind))
        about = {'offered_qos_profiles': definition.qos, 'topic_type_hash': definition.digest}
        known = definition.topic, definition.encoding
        number = self._writer.register_channel(*known, self._schemas[kind], about)
        self._put(Channel(number, *known, about, self._schemas[kind]))
        self._channels[definition.topic] = number
        self._definitions.append(definition)
        self.extent.counts[definition.topic] = 0
        self._ending += PER_TOPIC + 2 * len(definition.qos)

    def _put(self, record: McapRecord) -> None:
        builder = RecordBuilder()
        record.write(builder)
        data = builder.end()
        self.output.write(data)
        self._pending += len(data)  # once more in the next chunk
        self._ending += len(data)  # and in the summary

    def is_full(self, topic: str, log_time: int, more: int) -> bool:
        """Whether a message of so many bytes, stamped in ns, belongs into the next file."""
        longest, largest = self._storage.max_duration, self._storage.max_size
        if not (longest or largest) or not self._since:
            return False  # a file holds one message at least
        if longest and abs(log_time - self._since.get(topic, log_time)) >= longest:
            # topics come in bursts of their own: one tells the time, others only in its silence
            silent = time.monotonic() - self._heard > SILENCE
            if silent or topic == self._pace:
                return True
        return bool(largest) and self._size_with(more) > largest

    def _size_with(self, more: int) -> int:
        """Bytes that the finished file has at most after one more message."""
        pending = self._pending + more + BESIDE
        pending += pending // 64  # what does not compress becomes longer
        return self.output.position + pending + self._ending + self._per_chunk()

    def write(
        self, topic: str, log_time: int, data: bytes, publish_time: int | None = None
    ) -> bool:
        """Write one serialized message, times in ns; whether that has closed the chunk."""
        before = self.output.position
        published = log_time if publish_time is None else publish_time
        self._writer.add_message(self._channels[topic], log_time, data, published)
        self.extent.add(topic, log_time, log_time)
        if topic == self._pace:
            self._heard = time.monotonic()
        if topic not in self._since:
            self._pace = self._pace or topic
            self._since[topic] = log_time
        self._pending += len(data) + BESIDE
        if self.output.position == before:
            return False
        self._chunk_closed()
        return True

    def flush(self) -> None:
        """Close the chunk: the system has everything that was written."""
        before = self.output.position
        self._writer.flush()
        if self.output.position != before:
            self._chunk_closed()

    def _chunk_closed(self) -> None:
        self._ending += self._per_chunk()
        self._pending = 0

    def _per_chunk(self) -> int:
        return PER_CHUNK + PER_CHANNEL * len(self._channels)

    def finish(self) -> None:
        """Close the last chunk, write the summary, sync and close the file."""
        text = as_text(metadata(self._definitions, [self.extent]))
        self.flush()
        self._writer.add_metadata('rosbag2', {'serialized_metadata': text})
        self._writer.finish()
        self.output.sync()
        self.output.close()
