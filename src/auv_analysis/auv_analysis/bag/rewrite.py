"""A file written anew from what could be kept of it: complete indices, summary, statistics."""

from collections.abc import Callable
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata
from mcap.writer import Writer

from auv_analysis.bag.chunks import Table
from auv_analysis.bag.inspection import PROFILE, ROSBAG2, Inspection
from auv_analysis.bag.mcap_file import McapFile, Read
from auv_analysis.bag.metadata import as_text, metadata
from auv_analysis.bag.output import COMPRESSIONS
from auv_analysis.output.new_files import created, synced

NEVER = 1 << 62  # bytes: a chunk ends where that of the damaged file does
CHUNK_SIZE = 1 << 20  # bytes, where the damaged file has none
ZSTD = 'zstd'
OURS = 'auv_gvc recovery'


class Rewriter:
    """Writes what an inspection has found.

    Parameters
    ----------
    inspection : of the damaged file
    name : that the new file will have

    """

    def __init__(self, inspection: Inspection, name: str):
        self._inspection, self._name = inspection, name
        self._channels: dict[int, int] = {}
        self._schemas: dict[int, int] = {}
        self._metadata: set[tuple[str, frozenset[tuple[str, str]]]] = set()

    def write(self, path: Path, progress: Callable[[int], None] = lambda _: None) -> None:
        """Write the file and wait until it is on the disk; an older one is replaced.

        Parameters
        ----------
        path : of the new file
        progress : told the byte of the damaged file up to which all is done

        """
        known = self._inspection
        with created(path) as file:
            self._writer = Writer(
                file,
                chunk_size=CHUNK_SIZE if known.compression is None else NEVER,
                compression=COMPRESSIONS[known.compression or ZSTD],
            )
            told = (known.header.profile, known.header.library) if known.header else ('', OURS)
            definitions = known.definitions.of_rosbag2()
            self._writer.start(told[0] if definitions is None else PROFILE, told[1])
            for item in McapFile(known.path, resync=True).items():
                if isinstance(item, Read):
                    self._take(item)
                progress(item.end)
            for channel in known.definitions.channels():
                self._channel(channel.id)
            if definitions is not None:
                text = as_text(metadata(definitions, [known.extent(self._name)]))
                self._writer.flush()
                self._writer.add_metadata(ROSBAG2, {'serialized_metadata': text})
            self._writer.finish()
            synced(file)

    def _take(self, item: Read) -> None:
        for part in item.parts:
            if isinstance(part, Table):
                self._messages(part)
            elif isinstance(part, Attachment):
                a = part
                self._writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
            elif isinstance(part, Metadata) and part.name != ROSBAG2:
                self._keep(part)
        if item.opcode == Opcode.CHUNK:
            self._writer.flush()

    def _keep(self, record: Metadata) -> None:
        """Write metadata, once."""
        key = record.name, frozenset(record.metadata.items())
        if key not in self._metadata:
            self._metadata.add(key)
            self._writer.add_metadata(record.name, record.metadata)

    def _messages(self, table: Table) -> None:
        rows = zip(*(column.tolist() for column in table[3:]), strict=True)
        for i, (number, sequence, log, publish) in enumerate(rows):
            channel = self._channel(number)
            if channel is not None:
                self._writer.add_message(channel, log, table.payload(i), publish, sequence)

    def _channel(self, number: int) -> int | None:
        """Id of a channel in the new file, None of one that is not known."""
        if number in self._channels:
            return self._channels[number]
        known = self._inspection.definitions
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
        return self._channels[number]
