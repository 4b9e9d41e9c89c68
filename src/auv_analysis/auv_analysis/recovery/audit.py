"""A file from its beginning to its end: what can be kept of it, and whether anything is wrong."""

from collections.abc import Callable
from pathlib import Path
from typing import IO

import numpy as np
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    Metadata,
    Schema,
)

from auv_analysis.bag.tables import by_channel
from auv_analysis.recovery.definitions import BETWEEN, CHUNK, SUMMARY, Definitions
from auv_analysis.recovery.indices import Indices, checksum_of, summary_fits
from auv_analysis.recovery.parts import Messages, parts_of
from auv_analysis.recovery.scan import Found, Lost, Scan
from auv_analysis.recovery.spacing import Spacing

ROSBAG2 = 'rosbag2'  # metadata that rosbag2 and our recorder write when a file is closed
PROFILE = 'ros2'


class Audit:
    """What is found in a file.

    Attributes
    ----------
    path : the file
    size : bytes of it
    definitions : of its topics
    header : None where it is lost
    spacings : channel id -> the stamps of its messages
    attachments : names and sizes
    lost : bytes that cannot be used
    faults : what else is wrong, a few words each; empty: the file is healthy
    compression : of its first chunk, None: it has no chunks

    """

    def __init__(self, path: Path, progress: Callable[[int], None] = lambda _: None):
        self.path = path
        self.definitions, self.header = Definitions(), None  # type: Definitions, Header | None
        self.spacings: dict[int, Spacing] = {}
        self.attachments: list[tuple[str, int]] = []
        self.lost: list[Lost] = []
        self.compression: str | None = None
        self._indices = Indices()
        self._data_end, self._footer, self._summary = False, False, 0
        self._is_rosbag2 = False
        with path.open('rb') as stream:
            scan = Scan(path, stream)
            self.size, self.begins_well = scan.size, scan.starts_well
            for item in scan.items():
                if isinstance(item, Lost):
                    self.lost.append(item)
                    self._indices.lost()
                else:
                    self._take(item, stream)
                progress(item.end)
            ends_well = scan.ends_well
        self._indices.close(self.count)
        self.faults = self._faults(ends_well)

    @property
    def count(self) -> int:
        """Number of messages that can be kept."""
        known = self.definitions
        return sum(s.count for c, s in self.spacings.items() if known.channel(c) is not None)

    @property
    def messages_lost(self) -> int | None:
        """Number of messages that are lost, as far as indices or statistics tell; None: unknown."""
        unknown = sum(s.count for s in self.spacings.values()) - self.count
        if self._indices.told is not None:
            return max(0, self._indices.told - self.count)
        if self._indices.orphans or unknown:
            return self._indices.orphans + unknown
        return None if self.lost else 0

    def _take(self, found: Found, stream: IO[bytes]) -> None:
        record, messages = found.record, []
        trust = CHUNK if isinstance(record, Chunk) else SUMMARY if self._data_end else BETWEEN
        for part in parts_of(found):
            if isinstance(part, Messages):
                messages.append(part)
                self._space(part)
            elif isinstance(part, Schema | Channel):
                self.definitions.add(part, trust)
            elif isinstance(part, Metadata):
                self._is_rosbag2 |= part.name == ROSBAG2
            elif isinstance(part, Attachment):
                self.attachments.append((part.name, len(part.data)))
                self._indices.attachment(found.start, found.end)
        if isinstance(record, Chunk):
            self.compression = self.compression or record.compression or 'none'
            self._indices.chunk(found.start, found.end, messages)
        elif isinstance(record, Header):
            self.header = self.header or record
        elif isinstance(record, DataEnd):
            self._data_end, self._summary = True, found.end
            if record.data_section_crc not in (0, checksum_of(stream, 0, found.start)):
                self._indices.faults.add('the data is not what its checksum says')
        elif isinstance(record, Footer):
            self._footer = True
            begins = (0, self._summary) if found.start > self._summary else (0, found.start)
            if record.summary_start not in begins or not summary_fits(stream, record, found.start):
                self._indices.disown()
        elif not isinstance(record, Attachment | Metadata):
            self._indices.record(record)

    def _space(self, messages: Messages) -> None:
        for channel, index in by_channel(messages.channels):
            spacing = self.spacings.setdefault(channel, Spacing())
            spacing.add(messages.log_times[index].astype(np.int64))

    def _faults(self, ends_well: bool) -> list[str]:
        found = [f'damaged: {lost.why}' for lost in self.lost]
        if not (self._data_end and self._footer and ends_well):
            found.append('was not finished')
        if self.header is None:
            found.append('has no header')
        elif self._is_rosbag2 and self.header.profile != PROFILE:
            found.append('has another profile than rosbag2 writes')
        if any(self.definitions.channel(channel) is None for channel in self.spacings):
            found.append('has messages whose topic is not known')
        if not self.definitions.agree():
            found.append('has a summary of other topics')
        found += sorted(self._indices.faults)
        found += [f'{name} is defined twice' for name in sorted(self.definitions.doubtful)]
        return list(dict.fromkeys(found))
