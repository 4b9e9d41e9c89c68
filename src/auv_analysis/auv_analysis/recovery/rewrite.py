"""A file written anew from what could be kept of it: complete indices, summary and statistics."""

from collections.abc import Callable
from pathlib import Path

from mcap.records import Attachment, Chunk, Metadata
from mcap.writer import Writer

from auv_analysis.output.new_files import created, synced
from auv_analysis.recording.metadata import Extent, as_text, metadata
from auv_analysis.recording.storage import COMPRESSIONS
from auv_analysis.recovery.audit import PROFILE, ROSBAG2, Audit
from auv_analysis.recovery.parts import Messages, parts_of
from auv_analysis.recovery.scan import Found, Scan

NEVER = 1 << 62  # bytes: a chunk ends where that of the damaged file does
CHUNK_SIZE = 1 << 20  # bytes, where the damaged file has none
ZSTD = 'zstd'


class Rewriter:
    """Writes what an audit has found.

    Parameters
    ----------
    audit : of the damaged file
    name : that the new file will have

    """

    def __init__(self, audit: Audit, name: str):
        self._audit, self.extent = audit, Extent(name)
        self._channels: dict[int, int] = {}
        self._topics: dict[int, str] = {}
        self._schemas: dict[int, int] = {}
        self._metadata: set[tuple[str, frozenset[tuple[str, str]]]] = set()

    def write(self, path: Path, progress: Callable[[int], None] = lambda _: None) -> None:
        """Write the file and wait until it is on the disk; an older one is replaced.

        Parameters
        ----------
        path : of the new file
        progress : told the byte of the damaged file up to which all is done

        """
        audit = self._audit
        keeps_chunks = audit.compression is not None
        with created(path) as file, audit.path.open('rb') as stream:
            self._writer = Writer(
                file,
                chunk_size=NEVER if keeps_chunks else CHUNK_SIZE,
                compression=COMPRESSIONS[audit.compression or ZSTD],
            )
            self._writer.start(*self._beginning())
            for item in Scan(audit.path, stream).items():
                if isinstance(item, Found):
                    self._take(item)
                progress(item.end)
            for channel in audit.definitions.channels():
                self._channel(channel.id)
            self._finish()
            synced(file)

    def _beginning(self) -> tuple[str, str]:
        header = self._audit.header
        told = (header.profile, header.library) if header else ('', 'auv_gvc recovery')
        return (told[0] if self._audit.definitions.of_rosbag2() is None else PROFILE), told[1]

    def _take(self, found: Found) -> None:
        for part in parts_of(found):
            if isinstance(part, Messages):
                self._messages(part)
            elif isinstance(part, Attachment):
                a = part
                self._writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
            elif isinstance(part, Metadata) and part.name != ROSBAG2:
                self._keep(part)
        if isinstance(found.record, Chunk):
            self._writer.flush()

    def _keep(self, record: Metadata) -> None:
        """Write metadata, once."""
        key = record.name, frozenset(record.metadata.items())
        if key not in self._metadata:
            self._metadata.add(key)
            self._writer.add_metadata(record.name, record.metadata)

    def _messages(self, messages: Messages) -> None:
        columns = (c.tolist() for c in messages[:4])
        for i, (number, sequence, log, publish) in enumerate(zip(*columns, strict=True)):
            channel = self._channel(number)
            if channel is not None:
                self._writer.add_message(channel, log, messages.payload(i), publish, sequence)
                self.extent.add(self._topics[number], log)

    def _channel(self, number: int) -> int | None:
        """Id of a channel in the new file, None of one that is not known."""
        if number in self._channels:
            return self._channels[number]
        known = self._audit.definitions
        channel = known.channel(number)
        if channel is None:
            return None
        schema = 0
        if (found := known.schema_of(channel)) is not None:
            if found.id not in self._schemas:
                registered = self._writer.register_schema(found.name, found.encoding, found.data)
                self._schemas[found.id] = registered
            schema = self._schemas[found.id]
        about = channel.topic, channel.message_encoding, schema, channel.metadata
        self._channels[number] = self._writer.register_channel(*about)
        self._topics[number] = channel.topic
        self.extent.counts.setdefault(channel.topic, 0)
        return self._channels[number]

    def _finish(self) -> None:
        if (definitions := self._audit.definitions.of_rosbag2()) is not None:
            text = as_text(metadata(definitions, [self.extent]))
            self._writer.flush()
            self._writer.add_metadata(ROSBAG2, {'serialized_metadata': text})
        self._writer.finish()
