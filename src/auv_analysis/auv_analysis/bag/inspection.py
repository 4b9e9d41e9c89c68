"""Inspection of a file before its repair: what can be kept, what is wrong, which gaps it has."""

import heapq
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema, Statistics
from zstandard import FRAME_HEADER

from auv_analysis.bag.chunks import MessageTable, by_channel
from auv_analysis.bag.mcap_file import LongAttachment, Lost, McapFile, MessageIndex, Read
from auv_analysis.bag.metadata import Definition, FileExtent
from auv_analysis.bag.step_topics import role_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import NANOSECONDS, OPTIONAL_STEP_TOPICS, STEP_TOPICS

ROSBAG2 = 'rosbag2'  # metadata that rosbag2 and our recorder write when a file is closed
PROFILE = 'ros2'
LARGEST_POLICIES = 1 << 21  # characters of the offered profiles of all topics; more are left out
BETWEEN, SUMMARY, CHUNK = range(3)  # where a definition stands: the better its checksum, the higher
MOST = 4096  # different intervals that are told apart
SHOWN = 10  # longest intervals whose place is remembered
WIDE = 1.5  # times the usual interval: from here on something is missing


class Definitions:
    """The most trustworthy definition of each id."""

    def __init__(self) -> None:
        self._known: dict[tuple[type, int], tuple[int, Schema | Channel]] = {}
        self.doubtful: set[str] = set()  # topics or types that are defined differently elsewhere

    def add(self, record: Schema | Channel, trust: int) -> None:
        """Take a definition, of which `trust` says where it stands."""
        key = type(record), record.id
        best, known = self._known.get(key, (-1, record))
        if known != record:
            self.doubtful.add(record.name if isinstance(record, Schema) else record.topic)
        if best < trust:
            self._known[key] = trust, record

    def channel(self, number: int) -> Channel | None:
        """Channel of an id."""
        _, found = self._known.get((Channel, number), (0, None))
        return found if isinstance(found, Channel) else None

    def schema_of(self, channel: Channel) -> Schema | None:
        """Schema of a channel."""
        _, found = self._known.get((Schema, channel.schema_id), (0, None))
        return found if isinstance(found, Schema) else None

    def channels(self) -> list[Channel]:
        """All channels, by their ids."""
        every = (record for _, record in self._known.values() if isinstance(record, Channel))
        return sorted(every, key=lambda channel: channel.id)

    def of_rosbag2(self) -> list[Definition] | None:
        """The topics for a metadata.yaml; None where not all are as rosbag2 writes them."""
        found: dict[str, Definition] = {}
        left = LARGEST_POLICIES
        for channel in self.channels():
            schema = self.schema_of(channel)
            if channel.message_encoding != 'cdr' or schema is None:
                return None
            one = Definition.of(channel, schema)
            left -= len(one.qos)
            found.setdefault(channel.topic, one if left >= 0 else replace(one, qos=''))
        return [*found.values()]


@dataclass
class Spacing:
    """Intervals between the stamps of a topic, in the order of the bag.

    Attributes
    ----------
    first, last, earliest, latest : stamps in ns, in the order of the bag and by their size
    count : number of stamps; without any, those mean nothing
    intervals : ns -> how often
    longest : the longest of them, and where they begin, ns

    """

    first: int = 0
    last: int = 0
    earliest: int = 0
    latest: int = 0
    count: int = 0
    intervals: Counter[int] = field(default_factory=Counter)
    longest: list[tuple[int, int]] = field(default_factory=list)

    def add(self, stamps: np.ndarray) -> None:
        """Take the next stamps (n,), ns, of which there must be some."""
        apart = np.diff(stamps)
        values, counts = (found.tolist() for found in np.unique(apart, return_counts=True))
        intervals = Counter(dict(zip(values, counts, strict=True)))
        longest = [(int(apart[i]), int(stamps[i])) for i in np.argsort(apart)[-SHOWN:]]
        first, last, earliest, latest = (
            int(ns) for ns in (stamps[0], stamps[-1], stamps.min(), stamps.max())
        )
        self.join(Spacing(first, last, earliest, latest, len(stamps), intervals, longest))

    def join(self, other: 'Spacing') -> None:
        """Go on with what comes next of the topic."""
        if not other.count:
            return
        if self.count:
            between = other.first - self.last
            self._note(between, 1)
            self._keep(between, self.last)
            self.earliest = min(self.earliest, other.earliest)
            self.latest = max(self.latest, other.latest)
        else:
            self.first, self.earliest, self.latest = other.first, other.earliest, other.latest
        self.count += other.count
        self.last = other.last
        for value, count in other.intervals.items():
            self._note(value, count)
        for interval, begin in other.longest:
            self._keep(interval, begin)

    def _note(self, interval: int, count: int) -> None:
        if len(self.intervals) < MOST or interval in self.intervals:
            self.intervals[interval] += count

    def _keep(self, interval: int, begin: int) -> None:
        heapq.heappush(self.longest, (interval, begin))
        if len(self.longest) > SHOWN:
            heapq.heappop(self.longest)

    def gaps(self) -> dict[str, Any]:
        """Number of gaps, of messages missing in them, and the longest ones in s, in order."""
        usual = self._usual()
        wide = {value: n for value, n in self.intervals.items() if usual and value > WIDE * usual}
        shown = sorted(
            (begin, interval)
            for interval, begin in self.longest
            if usual and interval > WIDE * usual
        )
        return {
            'gaps': sum(wide.values()),
            'missing': sum((round(value / usual) - 1) * n for value, n in wide.items()),
            'longest': [
                [begin / NANOSECONDS, (begin + interval) / NANOSECONDS] for begin, interval in shown
            ],
        }

    def _usual(self) -> int:
        """The median interval, ns; 0 where there is none."""
        rising = sorted((value, n) for value, n in self.intervals.items() if value > 0)
        half, seen = sum(n for _, n in rising) / 2, 0
        for value, n in rising:
            seen += n
            if seen >= half:
                return value
        return 0


class Inspection:
    """Findings of a file's inspection.

    Attributes
    ----------
    path, size : of the file, bytes
    definitions : of its topics
    header : None where it is lost
    spacings : channel id -> the stamps of its messages
    attachments : their names
    lost : bytes that cannot be used
    faults : what else is wrong, a few words each; empty: the file is healthy
    compression : of its first chunk, None: it has no chunks
    packed : whether rosbag2 compressed each message by itself

    """

    def __init__(self, path: Path, progress: Callable[[int], None] = lambda _: None):
        self.path = path
        self.definitions = Definitions()
        self.header: Header | None = None
        self.spacings: dict[int, Spacing] = {}
        self.attachments: list[str] = []
        self._too_long: list[str] = []
        self.lost: list[Lost] = []
        self.compression: str | None = None
        self.packed = False
        self._told: int | None = None  # number of messages by the statistics
        self._orphans = 0  # messages in indices whose chunk is lost
        self._data_end, self._footer, self._is_rosbag2 = False, False, False
        file = McapFile(path, resync=True)
        self.size = file.size
        has_chunk = False
        for item in file.items():
            if isinstance(item, Lost):
                self.lost.append(item)
                has_chunk = False
            else:
                has_chunk = has_chunk or item.opcode == Opcode.CHUNK
                self._take(item, has_chunk)
            progress(item.end)
        self.begins_well = file.begins_well
        self.faults = self._faults(file)
        if file.faults:
            self._told = None

    @property
    def count(self) -> int:
        """Number of messages that can be kept."""
        return sum(self.extent('').counts.values())

    @property
    def messages_lost(self) -> int | None:
        """Number of messages that are lost, as far as indices or statistics tell; None: unknown."""
        unknown = sum(s.count for s in self.spacings.values()) - self.count
        if self._told is not None:
            return max(0, self._told - self.count)
        if self._orphans or unknown:
            return self._orphans + unknown
        return None if self.lost else 0

    def extent(self, name: str) -> FileExtent:
        """The part that can be kept, as a file of some name."""
        extent = FileExtent(name)
        for number, spacing in self.spacings.items():
            channel = self.definitions.channel(number)
            if channel is not None:
                extent.add(channel.topic, spacing.earliest, spacing.latest, spacing.count)
        return extent

    def _take(self, item: Read, has_chunk: bool) -> None:
        if item.opcode == Opcode.CHUNK:
            self.compression = self.compression or item.compression
        in_chunk = item.opcode == Opcode.CHUNK
        trust = CHUNK if in_chunk else SUMMARY if self._data_end else BETWEEN
        for part in item.parts:
            if isinstance(part, MessageTable):
                self.packed = self.packed or part.payload(0).startswith(FRAME_HEADER)
                for channel, index in by_channel(part.channels):
                    spacing = self.spacings.setdefault(channel, Spacing())
                    spacing.add(part.log_times[index].astype(np.int64))
            elif isinstance(part, Schema | Channel):
                self.definitions.add(part, trust)
            elif isinstance(part, Attachment):
                self.attachments.append(part.name)
            elif isinstance(part, LongAttachment):
                self._too_long.append(f'attachment {part.name!r} of {part.size} bytes is left out')
            elif isinstance(part, MessageIndex):
                self._orphans += 0 if has_chunk else part.messages
            elif isinstance(part, Metadata):
                self._is_rosbag2 |= part.name == ROSBAG2
            elif isinstance(part, Header):
                self.header = self.header or part
            elif isinstance(part, Statistics):
                self._told = part.message_count
        self._data_end |= item.opcode == Opcode.DATA_END
        self._footer |= item.opcode == Opcode.FOOTER

    def _faults(self, file: McapFile) -> list[str]:
        """What is wrong; InputError where that is only that a record is too large for us."""
        lost = [f'{"too large" if one.limit else "damaged"}: {one.why}' for one in self.lost]
        found = []
        if not (self._data_end and self._footer and file.ends_well):
            found.append('was not finished')
        if self.header is None:
            found.append('has no header')
        elif self._is_rosbag2 and self.header.profile != PROFILE:
            found.append('has another profile than rosbag2 writes')
        if any(self.definitions.channel(channel) is None for channel in self.spacings):
            found.append('has messages whose topic is not known')
        found += file.faults
        found += [f'{name} is defined twice' for name in sorted(self.definitions.doubtful)]
        if self.lost and not found and all(one.limit for one in self.lost):
            expected, size = self.lost[0].limit
            key = f'byte {self.lost[0].start}'
            raise InputError(self.path, key, expected, f'{size}; nothing else is wrong')
        faults = lost + found
        return list(dict.fromkeys(faults + self._too_long)) if faults else []


@dataclass
class FileReport:
    """Outcome for a file: 'healthy', 'repaired' or 'left out'."""

    inspection: Inspection
    name: str
    state: str
    kept_as: str | None = None

    def document(self) -> dict[str, Any]:
        """As `--json` prints it."""
        return {
            'file': self.name,
            'state': self.state,
            'kept_as': self.kept_as,
            'faults': self.inspection.faults,
            'lost': [
                {'from': lost.start, 'to': lost.end, 'why': lost.why}
                for lost in self.inspection.lost
            ],
            'messages': self.inspection.count,
            'messages_lost': self.inspection.messages_lost,
        }


@dataclass
class Report:
    """Outcome of a bag's repair.

    Attributes
    ----------
    bag : as it was named
    files : in their order
    metadata : 'unchanged', 'written' or 'none': a bag that rosbag2 has nothing to say of
    notes : what could not be done, one line each

    """

    bag: str
    files: list[FileReport] = field(default_factory=list)
    metadata: str = 'unchanged'
    notes: list[str] = field(default_factory=list)

    @property
    def changed(self) -> bool:
        """Whether anything was written."""
        return self.metadata == 'written' or any(file.state != 'healthy' for file in self.files)

    def document(self) -> dict[str, Any]:
        """As `--json` prints it."""
        topics = _topics(file.inspection for file in self.files)
        spans = [spacing for _, spacing in topics.values() if spacing.count]
        first = min((spacing.earliest for spacing in spans), default=0)
        last = max((spacing.latest for spacing in spans), default=0)
        lost = [file.inspection.messages_lost for file in self.files]
        return {
            'bag': self.bag,
            'changed': self.changed,
            'files': [file.document() for file in self.files],
            'metadata': self.metadata,
            'duration': (last - first) / NANOSECONDS if spans else None,
            'messages': sum(file.inspection.count for file in self.files),
            'messages_lost': None if None in lost else sum(n for n in lost if n is not None),
            'topics': {
                topic: {'type': kind, 'messages': spacing.count, **_gaps(topic, spacing)}
                for topic, (kind, spacing) in sorted(topics.items())
            },
            'attachments': sorted(
                {name for file in self.files for name in file.inspection.attachments}
            ),
            'notes': self.notes,
        }


def _topics(inspections: Iterable[Inspection]) -> Mapping[str, tuple[str, Spacing]]:
    """Topic -> type and stamps, over all files."""
    found: dict[str, tuple[str, Spacing]] = {}
    for one in inspections:
        for channel in one.definitions.channels():
            schema = one.definitions.schema_of(channel)
            kind = schema.name if schema else ''
            _, spacing = found.setdefault(channel.topic, (kind, Spacing()))
            spacing.join(one.spacings.get(channel.id, Spacing()))
    return found


def _gaps(topic: str, spacing: Spacing) -> dict[str, Any]:
    """Gaps of a step topic; other topics come when they come."""
    is_step = role_of(topic) in (*STEP_TOPICS, *OPTIONAL_STEP_TOPICS)
    return {'spacing': spacing.gaps() if is_step else None}
