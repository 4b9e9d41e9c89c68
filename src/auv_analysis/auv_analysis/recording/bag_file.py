"""One MCAP file of a bag while it is being recorded."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import IO, cast

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, McapRecord, Schema
from mcap.writer import Writer

from auv_analysis.recording.metadata import Definition, Extent, as_text, metadata, qos_text
from auv_analysis.recording.output import Output
from auv_analysis.recording.storage import COMPRESSIONS, Storage

BESIDE = 31 + 16  # bytes of a message's record and index beside its data
PER_CHANNEL = 15 + 10 + 10  # bytes of a chunk's index records, of its entry, of the statistics
PER_CHUNK = 128  # bytes of a chunk's head and of its entry in the summary
ENDING = 4096  # bytes of the records that every file ends with
SILENCE = 5.0  # s without the topic that tells the time
PER_TOPIC = 512  # bytes of a topic in the metadata, beside its profiles


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
        self.output, self.extent = Output(path), Extent(path.name)
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
            self._begin(attachments)
        except OSError:
            self.output.close()
            path.unlink(missing_ok=True)
            raise

    def _begin(self, attachments: Mapping[str, str]) -> None:
        self._writer.start(profile='ros2', library='auv_gvc')
        for name, text in attachments.items():
            kind = 'application/yaml' if name.endswith(('.yaml', '.yml')) else 'text/plain'
            self._writer.add_attachment(0, 0, name, kind, text.encode())

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
        about = {
            'offered_qos_profiles': qos_text(definition.qos),
            'topic_type_hash': definition.digest,
        }
        known = definition.topic, definition.encoding
        number = self._writer.register_channel(*known, self._schemas[kind], about)
        self._put(Channel(number, *known, about, self._schemas[kind]))
        self._channels[definition.topic] = number
        self._definitions.append(definition)
        self.extent.counts[definition.topic] = 0
        self._ending += PER_TOPIC + 2 * len(about['offered_qos_profiles'])

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
        if longest and log_time - self._since.get(topic, log_time) >= longest:
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
        self.extent.add(topic, log_time)
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
