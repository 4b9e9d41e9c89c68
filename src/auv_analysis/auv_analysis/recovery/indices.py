"""Whether the indices and the summary of a file say what is in it."""

import zlib
from collections.abc import Iterable
from typing import IO, Any

import numpy as np
from mcap.records import AttachmentIndex, ChunkIndex, Footer, McapRecord, Statistics

from auv_analysis.bag.framing import PREFIX, MessageIndex
from auv_analysis.recovery.parts import Messages

FOOTER = 8 + 8  # bytes of the footer that the summary's checksum covers


class Indices:
    """Compares what is found on the way through a file.

    Attributes
    ----------
    faults : what does not agree, a few words each
    orphans : number of messages in indices whose chunk is missing

    """

    def __init__(self) -> None:
        self.faults: set[str] = set()
        self.orphans = 0
        self._chunks: dict[int, int] = {}  # start -> length
        self._indexed: dict[int, int] = {}
        self._attachments: dict[int, int] = {}  # start -> length
        self._attachments_told: dict[int, int] = {}
        self._statistics: Statistics | None = None
        self._messages: list[Messages] | None = None  # of the last chunk; None: it is missing
        self._entries: list[tuple[int, np.ndarray]] = []

    def chunk(self, start: int, end: int, messages: list[Messages]) -> None:
        """A chunk begins."""
        self.close_chunk()
        self._chunks[start] = end - start
        self._messages = messages

    def lost(self) -> None:
        """What comes next is not of the last chunk."""
        self.close_chunk()
        self._messages = None

    def attachment(self, start: int, end: int) -> None:
        """An attachment."""
        self._attachments[start] = end - start

    def record(self, record: McapRecord | None) -> None:
        """Any other record."""
        if isinstance(record, MessageIndex):
            if self._messages is None:
                self.orphans += len(record.entries)
            else:
                self._entries.append((record.channel, record.entries))
        elif isinstance(record, ChunkIndex):
            self._indexed[record.chunk_start_offset] = record.chunk_length
        elif isinstance(record, AttachmentIndex):
            self._attachments_told[record.offset] = record.length
        elif isinstance(record, Statistics):
            self._statistics = record

    def close_chunk(self) -> None:
        """Compare a chunk with the message indices behind it."""
        if self._messages is not None and self._entries:
            found = _rows((m.places, m.log_times, m.channels) for m in self._messages)
            told = _rows(
                (e['place'], e['log_time'], np.full(len(e), channel))
                for channel, e in self._entries
            )
            if not np.array_equal(found, told):
                self.faults.add('message indices do not fit their chunks')
        self._entries = []

    def disown(self) -> None:
        """The summary is damaged: what it says counts for nothing."""
        self.faults.add('the summary is not what its checksum says')
        self._indexed, self._attachments_told, self._statistics = {}, {}, None

    def close(self, count: int) -> None:
        """Compare the file, with so many messages, with its summary."""
        self.lost()
        if self._indexed and self._indexed != self._chunks:
            self.faults.add('the index of chunks does not fit')
        if self._attachments_told and self._attachments_told != self._attachments:
            self.faults.add('the index of attachments does not fit')
        told = self._statistics
        if told is not None and (told.message_count, told.attachment_count) != (
            count,
            len(self._attachments),
        ):
            self.faults.add('the statistics do not fit')

    @property
    def told(self) -> int | None:
        """Number of messages by the statistics; None where there are none."""
        return None if self._statistics is None else self._statistics.message_count


def _rows(parts: Iterable[Iterable[Any]]) -> np.ndarray:
    """Rows of place, time and channel, in the order of places."""
    rows = [np.stack([np.asarray(c, np.uint64) for c in part]) for part in parts]
    joined = np.concatenate(rows, axis=1) if rows else np.zeros((3, 0), np.uint64)
    return joined[:, np.argsort(joined[0], kind='stable')]


def summary_fits(stream: IO[bytes], footer: Footer, start: int) -> bool:
    """Whether the checksum in a footer, which begins at a place, is that of the summary."""
    if not footer.summary_crc:
        return True
    begin = footer.summary_start or start
    if begin > start:
        return False
    return checksum_of(stream, begin, start + PREFIX.size + FOOTER) == footer.summary_crc


def checksum_of(stream: IO[bytes], begin: int, end: int) -> int | None:
    """Checksum of the bytes from a place to another; None where the file ends before."""
    stream.seek(begin)
    checksum, left = 0, end - begin
    while left:
        data = stream.read(min(left, 1 << 20))
        if not data:
            return None
        checksum, left = zlib.crc32(data, checksum), left - len(data)
    return checksum
