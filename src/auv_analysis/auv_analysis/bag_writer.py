"""A rosbag2-style bag: a folder with metadata.yaml and one MCAP file that survives a kill."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from mcap.writer import CompressionType, Writer

COMPRESSIONS = {
    'zstd': CompressionType.ZSTD,
    'lz4': CompressionType.LZ4,
    'none': CompressionType.NONE,
}
CHUNK_PERIOD = 0.9  # s, after which a chunk is closed and handed to the system
DISTRO = 'jazzy'


class BagWriter:
    """Writes raw messages; `flush_due` keeps the loss of a kill below a second.

    Parameters
    ----------
    folder : of the bag, made here; it must not hold a bag yet
    attachments : name -> text, written before the first message
    compression : 'zstd', 'lz4' or 'none'
    chunk_size : bytes from which a chunk is closed

    """

    def __init__(
        self,
        folder: Path,
        attachments: Mapping[str, str],
        compression: str = 'zstd',
        chunk_size: int = 1 << 20,
    ):
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / f'{folder.resolve().name}_0.mcap'
        self._file = self.path.open('xb')
        self._writer = Writer(
            self._file, chunk_size=chunk_size, compression=COMPRESSIONS[compression]
        )
        self._writer.start(profile='ros2', library='auv_gvc')
        for name, text in attachments.items():
            kind = 'application/yaml' if name.endswith(('.yaml', '.yml')) else 'text/plain'
            self._writer.add_attachment(0, 0, name, kind, text.encode())
        self._file.flush()
        self._channels: dict[str, tuple[int, dict[str, Any]]] = {}
        self._schemas: dict[str, int] = {}
        self.counts: dict[str, int] = {}
        self._first: int | None = None
        self._last = 0
        self._flushed = time.monotonic()

    def add_channel(self, topic: str, kind: str, schema: str, qos: list[dict], digest: str) -> None:
        """Register a topic.

        Parameters
        ----------
        topic : full name
        kind : message type, 'package/msg/Name'
        schema : full ros2msg text
        qos : offered profiles as rosbag2 writes them
        digest : RIHS01 type hash

        """
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(kind, 'ros2msg', schema.encode())
        offered = yaml.safe_dump(qos, default_flow_style=False, sort_keys=False)
        channel = self._writer.register_channel(
            topic,
            'cdr',
            self._schemas[kind],
            {'offered_qos_profiles': offered, 'topic_type_hash': digest},
        )
        about = {
            'name': topic,
            'type': kind,
            'serialization_format': 'cdr',
            'offered_qos_profiles': qos,
            'type_description_hash': digest,
        }
        self._channels[topic] = (channel, about)
        self.counts[topic] = 0

    def has_channel(self, topic: str) -> bool:
        """Whether a topic is registered."""
        return topic in self._channels

    def write(self, topic: str, log_time: int, data: bytes) -> None:
        """Write one serialized message, stamped in ns."""
        self._writer.add_message(self._channels[topic][0], log_time, data, log_time)
        self.counts[topic] += 1
        self._first = log_time if self._first is None else min(self._first, log_time)
        self._last = max(self._last, log_time)

    def flush_due(self) -> None:
        """Close the chunk when it is older than its period."""
        if time.monotonic() - self._flushed >= CHUNK_PERIOD:
            self._writer.flush()
            self._file.flush()
            self._flushed = time.monotonic()

    def close(self) -> None:
        """Finish the MCAP file and write metadata.yaml; a second call does nothing."""
        if self._file.closed:
            return
        metadata = self._metadata()
        text = yaml.safe_dump({'rosbag2_bagfile_information': metadata}, sort_keys=False)
        self._writer.add_metadata('rosbag2', {'serialized_metadata': text})
        self._writer.finish()
        self._file.close()
        self.path.with_name('metadata.yaml').write_text(text, encoding='utf-8')

    def _metadata(self) -> dict[str, Any]:
        first = self._first or 0
        span = {
            'starting_time': {'nanoseconds_since_epoch': first},
            'duration': {'nanoseconds': self._last - first},
            'message_count': sum(self.counts.values()),
        }
        return {
            'version': 9,
            'storage_identifier': 'mcap',
            'duration': span['duration'],
            'starting_time': span['starting_time'],
            'message_count': span['message_count'],
            'topics_with_message_count': [
                {'topic_metadata': about, 'message_count': self.counts[topic]}
                for topic, (_, about) in self._channels.items()
            ],
            'compression_format': '',
            'compression_mode': '',
            'relative_file_paths': [self.path.name],
            'files': [{'path': self.path.name, **span}],
            'custom_data': None,
            'ros_distro': DISTRO,
        }
