"""Reading a bag: its contents, and the values of its step topics batch by batch.

A channel is taken at once where all its messages in a table have one layout, the same strings and
usable numbers. Whatever differs goes through the decoder, and where a message is refused, so does
the whole table, in the order of the file: the refusal is that of its first bad message. Only where
the recording says that a driver was free to say anything, bad messages are left out and counted:
the controller has refused them as well.
"""

import contextlib
import ctypes
import math
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np
from mcap.records import Attachment, Channel

from auv_analysis.bag import limits
from auv_analysis.bag.chunks import MessageTable
from auv_analysis.bag.mcap_file import McapFile
from auv_analysis.bag.metadata import RECORDING, FileExtent, bag_files, read_recording
from auv_analysis.bag.step_topics import (
    ODOMETRIES,
    READERS,
    Decoding,
    StepLayout,
    check_type,
    learned,
    namespace_of,
    role_of,
)
from auv_dynamics.files.errors import FailedError, InputError, reason
from auv_dynamics.ros import interface
from auv_dynamics.ros.interface import CONTROLLER, GAINS_FACT, LAW_FACT, SETTINGS_FACT, Frames

Series = tuple[np.ndarray, np.ndarray]  # stamps (n,) in ns, values (n, 6) or (n, 13)
TOGETHER = 64  # chunks whose small arrays are joined at once: thousands of them scatter the memory
MMAP_THRESHOLD, LARGE = -3, 1 << 20  # of glibc's `mallopt`; bytes


def _give_back() -> None:
    """Let arrays go back to the system when they are freed: glibc keeps those below larger ones."""
    with contextlib.suppress(AttributeError):  # not every system has glibc
        ctypes.CDLL(None).mallopt(MMAP_THRESHOLD, LARGE)


class SpooledColumn:
    """Rows that come block by block: kept in memory up to a number of them, else in a file.

    The file has no name; it lies where temporary files do (`TMPDIR`) and is mapped for reading, see
    `rows_of`.

    Parameters
    ----------
    whole : rows up to which they are kept in memory

    """

    def __init__(self, whole: float):
        self._whole, self._count = whole, 0
        self._small: list[np.ndarray] = []
        self._parts: list[np.ndarray] = []
        self._file: IO[bytes] | None = None

    def append(self, rows: np.ndarray) -> None:
        """Take the next rows; FailedError where the file cannot take them."""
        self._count += len(rows)
        self._small.append(rows)
        if self._count > self._whole:
            self._spool()
        elif len(self._small) == TOGETHER:
            self._parts.append(np.concatenate(self._small))
            self._small.clear()

    def _spool(self) -> None:
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile()  # noqa: SIM115
                _give_back()
            for rows in (*self._parts, *self._small):
                self._file.write(np.ascontiguousarray(rows).data)
        except OSError as error:
            raise FailedError(f'{tempfile.gettempdir()}: {reason(error)}') from None
        self._parts.clear()
        del self._small[:-1]
        self._small[0] = self._small[0][:0]  # dtype and shape of a row

    def array(self) -> np.ndarray:
        """All rows, of which there must be some."""
        if self._file is None:
            return np.concatenate([*self._parts, *self._small])
        empty = self._small[0]
        shape = self._count, *empty.shape[1:]
        with self._file as file:
            file.flush()
            return np.asarray(np.memmap(file, empty.dtype, 'r', shape=shape))


def gathered(blocks: Iterable[np.ndarray], whole: float) -> np.ndarray:
    """All rows of blocks, in memory if they are at most `whole`."""
    column = SpooledColumn(whole)
    for block in blocks:
        column.append(block)
    return column.array()


def slices(count: int, rows: int = 1 << 13) -> Iterator[slice]:
    """Slices of so many rows that make up a count of them."""
    return (slice(i, min(i + rows, count)) for i in range(0, count, rows))


HEALTH = 'diagnostic_msgs/msg/DiagnosticArray'
BACK = interface.NANOSECONDS  # ns: stamps that fall by more have begun anew
MOST_FALLS = 1000  # by less, beyond which they are none of a clock that was set
MOST_STRAYS = 5  # messages in a row, beyond which a clock has begun anew
MOST_SWAPPED = 2  # beyond which they are a part that only stands in another order
GAP_PERIODS = 5.0  # median periods, at least, that make a pause a gap
GAP_USUAL = 3.0  # times the interval that nine of ten keep: some topics come in bursts
USUAL = 90.0  # percentile


def stretches(ns: np.ndarray) -> list[int]:
    """Where the clock of stamps (n,) begins anew in the order of the bag, with 0 and n."""
    apart = np.diff(ns)
    anew = np.flatnonzero(apart < -BACK) + 1
    return [0, *sorted([*anew.tolist(), *_set_back(ns, apart)]), len(ns)]


def _set_back(ns: np.ndarray, apart: np.ndarray) -> Iterator[int]:
    """Where stamps (n,), so far apart, fall by less, and count through a time once more.

    Of messages that came late, the time that they are of had been left out before.
    """
    if not (np.any((apart < 0) & (apart >= -BACK)) and np.any(apart > 0)):
        return
    period = float(np.median(apart[apart > 0]))
    falls = np.flatnonzero((apart < -GAP_PERIODS * period) & (apart >= -BACK))
    for i in falls.tolist() if len(falls) <= MOST_FALLS else ():
        again = ns[i + 1 : i + 2 + int(2 * BACK / period)]
        count = int(np.argmax(again > ns[i])) if np.any(again > ns[i]) else len(again)
        again, before = again[:count], ns[max(i + 1 - count, 0) : i + 1]
        walks = 2 * count * period >= -apart[i] and np.all(np.diff(again) > 0)
        if walks and 2 * np.count_nonzero((before >= again[0]) & (before <= again[-1])) >= count:
            yield i + 1


def strays(ns: np.ndarray, topic: str, notes: list[str]) -> np.ndarray:
    """Which stamps (n,) jump, a few in a row, so that those around go on without them.

    Parameters
    ----------
    ns : (n,) stamps in the order of the bag
    topic, notes : gets a line that counts them

    """
    found, most = np.zeros(len(ns), bool), 0
    if np.any(np.diff(ns) < -BACK):
        most = MOST_SWAPPED if are_swapped(ns) else MOST_STRAYS
    for width in range(1, most + 1):
        left = np.flatnonzero(~found)
        found[left[_jumps(ns[left], width)[:, None] + np.arange(width)]] = True
    if count := np.count_nonzero(found):
        lost = f'{topic}: {count} of {len(ns)} messages were left out'
        notes.append(f'{lost}: their stamps are far off those around them')
    return found


def _jumps(ns: np.ndarray, width: int) -> np.ndarray:
    """Where stamps (n,) jump for so many messages and then go on; not for two clocks in turn."""
    count = max(len(ns) - width - 1, 0)
    before, first, last, behind = (ns[i:][:count] for i in (0, 1, width, width + 1))
    falls = (before - first > BACK) | (last - behind > BACK)
    begins = np.flatnonzero(falls & (behind >= before)) + 1
    apart = np.diff(begins, prepend=-width, append=len(ns) + width) > width
    return begins[apart[:-1] & apart[1:]]


def are_swapped(ns: np.ndarray) -> bool:
    """Whether parts of times (n,) that follow one another only stand in another order.

    Chunks and files may; where a clock began anew, the parts overlap or are apart.
    """
    jumps = np.flatnonzero(np.abs(np.diff(ns)) > BACK) + 1
    begins = np.union1d(jumps, stretches(ns)[:-1]).astype(np.int64)
    first, last = np.minimum.reduceat(ns, begins), np.maximum.reduceat(ns, begins)
    order = np.argsort(first)
    between = first[order][1:] - last[order][:-1]
    return bool(np.all((between > 0) & (between <= BACK)))


def usual_limit(ns: np.ndarray) -> float:
    """Longest pause that is no gap, by the intervals of rising stamps (n,), ns."""
    if len(ns) < 2:
        return np.inf
    median, usual = np.percentile(np.diff(ns), (50, USUAL), overwrite_input=True)
    return float(max(GAP_PERIODS * median, GAP_USUAL * usual))


@dataclass
class BagContents(FileExtent):
    """Contents of a bag, before anything is computed from it.

    Attributes
    ----------
    attachments : name -> text
    parameters : of the autopilot of a log, name -> value
    types : topic -> message type
    messages : topic -> stamps (n,) in ns and values (n, 6) or (n, 13), of our topics
    notes : what is odd, one line each
    frames : namespace -> frames of its first odometry
    names : recorded topic -> our name of it, where the recorder's topics were remapped
    namespace : that is read: the one asked for, else that of the recorder; None: any
    asked : whether it was asked for
    recorder : namespace of the recorder, which the attachments are of; None: the bag does not say
    strict : whether every step had to come once and in order; where it had not, a driver was free
        to say anything, and what cannot be used is left out; None: the bag does not say
    laws : law, and in JSON its gains and the settings that were changed since the controller's
        start, that it said to be in charge, one after the other, and the stamp of the last wrench
        before it said so, ns
    controller : name of the node that said so

    """

    attachments: dict[str, str] = field(default_factory=dict)
    parameters: dict[str, str] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    messages: dict[str, Series] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    frames: dict[str, Frames] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    namespace: str | None = None
    asked: bool = False
    recorder: str | None = None
    strict: bool | None = None
    laws: list[tuple[tuple[str, ...], int]] = field(default_factory=list)
    controller: str = CONTROLLER

    @property
    def is_of_another(self) -> bool:
        """Whether the vehicle that is read is not the recorder's."""
        if self.namespace is None or self.recorder is None:
            return False
        return self.namespace.strip('/') != self.recorder.strip('/')


class FileReader:
    """Reads one file of a bag into `contents`.

    Parameters
    ----------
    path : the file
    contents : of the whole bag, filled here but for its messages
    decode : whether the messages of our topics are read, or only counted

    """

    def __init__(self, path: Path, contents: BagContents, decode: bool):
        self._path, self._contents, self._decode = path, contents, decode
        self._file = McapFile(path, contents.notes)
        self._frames = contents.frames
        self._decoders, self._health = Decoding(path), Decoding(path)
        self._layouts: dict[int, StepLayout] = {}
        self._sizes = {name: len(text) for name, text in contents.attachments.items()}
        self._attached = sum(self._sizes.values())
        self._left_out: Counter[str] = Counter()
        self._reasons: dict[str, str] = {}  # topic -> why its first message was left out

    def batches(self) -> Iterator[tuple[str, Series]]:
        """Topics of ours with their messages, a table at a time; then note what was left out."""
        for item in self._file.records():
            if isinstance(item, MessageTable):
                yield from self._table(item)
            elif isinstance(item, Channel):
                self._channel(item)
            elif isinstance(item, Attachment):
                self._attachment(item)
        for topic, count in self._left_out.items():
            counted = f'{self._path.name}: {topic}: {count} unusable messages left out'
            self._contents.notes.append(f'{counted}, the first one: {self._reasons[topic]}')

    def _attachment(self, item: Attachment) -> None:
        kept = self._contents.attachments
        more = len(item.data) - self._sizes.get(item.name, 0)
        if self._attached + more > limits.LARGEST_ATTACHMENT:
            note = f'{self._path.name}: attachment {item.name!r} not read, they are too many'
            self._contents.notes.append(note)
            return
        self._attached += more
        self._sizes[item.name] = len(item.data)
        text = item.data.decode('utf-8', 'replace')
        kept[item.name] = text
        if item.name == RECORDING:
            strict, self._contents.names, namespace = read_recording(text, self._path)
            self._contents.strict, self._contents.recorder = strict, namespace
            if not self._contents.asked:
                self._contents.namespace = namespace

    def _topic(self, channel: int) -> str:
        """Our name of a channel's topic."""
        topic = self._file.channels[channel].topic
        return self._contents.names.get(topic, topic)

    def _channel(self, channel: Channel) -> None:
        schema = self._file.schema_of(channel)
        kind = schema.name if schema else ''
        self._contents.types[channel.topic] = kind
        topic, space = self._topic(channel.id), self._contents.namespace
        is_read = space is None or namespace_of(topic).strip('/') == space.strip('/')
        if self._decode and role_of(topic) in READERS and is_read:
            check_type(self._path, topic, kind)
            self._decoders.add(channel, schema)
        elif self._decode and (topic, kind) == (interface.DIAGNOSTICS, HEALTH):
            with contextlib.suppress(InputError):  # no run needs it
                self._health.add(channel, schema)

    def _table(self, table: MessageTable) -> Iterator[tuple[str, Series]]:
        members = {}
        for channel, index in self._file.by_channel(table):
            logged = table.log_times[index]
            self._contents.add(channel.topic, int(logged.min()), int(logged.max()), len(index))
            if channel.id in self._decoders:
                members[channel.id] = index
            elif channel.id in self._health:
                self._hear_controller(table, index, channel.id)
        known = dict(self._frames)
        try:
            found = self._found(table, members)
        except InputError:
            self._in_order(table, known)
            raise
        for topic, entries in found.items():
            if len(entries) > 1:  # several channels of one topic
                order = np.argsort(np.concatenate([index for index, _ in entries]))
                parts = zip(*(series for _, series in entries), strict=True)
                stamps, rows = (np.concatenate(part)[order] for part in parts)
                yield topic, (stamps, rows)
            else:
                yield topic, entries[0][1]

    def _hear_controller(self, table: MessageTable, index: np.ndarray, channel: int) -> None:
        """Note the laws that the controller of the vehicle that is read says to be in charge.

        Of nodes of several names the usual one is heard, else the first one.
        """
        contents, known = self._contents, self._contents.laws
        for i in index.tolist():
            if GAINS_FACT.encode() not in table.message(i):
                continue
            with contextlib.suppress(InputError, AttributeError, TypeError):
                message = self._health.message(table, i, channel)
                for status in message.status:
                    facts = {one.key: one.value for one in status.values}
                    space, _, name = status.name.rpartition('/')
                    here = space == (contents.namespace or '').rstrip('/') and LAW_FACT in facts
                    if not here or (known and name not in (contents.controller, CONTROLLER)):
                        continue
                    if name != contents.controller:
                        contents.controller = name
                        known.clear()
                    changed = str(facts.get(SETTINGS_FACT, '{}'))
                    told = str(facts[LAW_FACT]), str(facts.get(GAINS_FACT)), changed
                    if not known or known[-1][0] != told:
                        known.append((told, interface.nanoseconds(message.header.stamp)))

    def _found(
        self, table: MessageTable, members: dict[int, np.ndarray]
    ) -> dict[str, list[tuple[np.ndarray, Series]]]:
        """Numbers of messages and what is in them by topic, an entry per channel."""
        since = self._meet(table, members)
        found: dict[str, list[tuple[np.ndarray, Series]]] = {}
        for channel, index in members.items():
            topic = self._topic(channel)
            first = since.get(namespace_of(topic), len(table.starts))
            series = self._at_once(table, channel, index, first)
            entry = (index, series) if series else self._one_by_one(table, channel, index, first)
            if len(entry[0]):
                found.setdefault(topic, []).append(entry)
        return found

    def _meet(self, table: MessageTable, members: dict[int, np.ndarray]) -> dict[str, int]:
        """Namespace -> number of the message of the table from which its frames hold."""
        since = dict.fromkeys(self._frames, 0)
        met: dict[str, tuple[int, interface.Frames]] = {}
        for channel, index in members.items():
            topic = self._topic(channel)
            namespace = namespace_of(topic)
            if role_of(topic) in ODOMETRIES and namespace not in self._frames:
                told = self._told(table, index, channel)
                if told and (namespace not in met or told[0] < met[namespace][0]):
                    met[namespace] = told
        for namespace, (i, frames) in met.items():
            self._frames[namespace] = frames
            since[namespace] = i
        return since

    def _told(
        self, table: MessageTable, index: np.ndarray, channel: int
    ) -> tuple[int, interface.Frames] | None:
        """The first odometry that may be left in, and its frames."""
        known = self._decoders
        if self._contents.strict is not False:
            i = int(index[0])
            return i, known.frames_of(channel, known.message(table, i, channel))
        for i in index.tolist():
            with contextlib.suppress(InputError):
                odometry = known.message(table, i, channel)
                frames = known.frames_of(channel, odometry)
                known.value(self._topic(channel), odometry, frames)
                return i, frames
        return None

    def _at_once(
        self, table: MessageTable, channel: int, index: np.ndarray, first: int
    ) -> Series | None:
        """Stamps and rows of a channel; None where its messages must be looked at one by one."""
        topic, like = self._topic(channel), table.message(index[0])
        layout = self._layouts.get(channel)
        if layout is None or not layout.fits(like):
            layout = learned(like, role_of(topic), self._decoders[channel])
            if layout is None:
                return None
            self._layouts[channel] = layout
        starts, sizes = table.starts[index], table.sizes[index]
        frames = self._frames.get(namespace_of(topic))
        strangers = index[-1] >= first and not layout.is_in(frames)
        return None if strangers else layout.read(table.data, starts, sizes)

    def _one_by_one(
        self, table: MessageTable, channel: int, index: np.ndarray, first: int
    ) -> tuple[np.ndarray, Series]:
        """Numbers of the messages that are taken, stamps and rows, by the channel's decoder.

        Messages from `first` on have frames.
        """
        topic = self._topic(channel)
        frames = self._frames.get(namespace_of(topic))
        taken, stamps, rows = [], [], []
        for i in index.tolist():
            try:
                message = self._decoders.message(table, i, channel)
                ns, row = self._decoders.value(topic, message, frames if i >= first else None)
            except InputError as error:
                if self._contents.strict is not False:
                    raise
                self._left_out[topic] += 1
                self._reasons.setdefault(topic, error.found)
            else:
                taken.append(i)
                stamps.append(ns)
                rows.append(row)
        return np.array(taken, np.int64), (np.array(stamps, np.int64), np.array(rows, float))

    def _in_order(self, table: MessageTable, frames: dict[str, interface.Frames]) -> None:
        """Refuse the first message of a table that must be refused."""
        for i, channel in enumerate(table.channels.tolist()):
            if channel in self._decoders:
                topic = self._topic(channel)
                message, namespace = self._decoders.message(table, i, channel), namespace_of(topic)
                if role_of(topic) in ODOMETRIES and namespace not in frames:
                    frames[namespace] = self._decoders.frames_of(channel, message)
                self._decoders.value(topic, message, frames.get(namespace))


def read_bag(
    bag: str | Path, namespace: str | None = None, *, decode: bool = True, whole: float = math.inf
) -> BagContents:
    """Read a bag.

    Parameters
    ----------
    bag : folder or .mcap file
    namespace : whose topics are ours; None: what the bag says, else any
    decode : read the messages of our topics; else only count
    whole : messages of a topic up to which they are kept in memory, see `SpooledColumn`

    Raises
    ------
    InputError : not a bag, or a message that must not be used

    """
    contents = BagContents(namespace=namespace, asked=namespace is not None)
    columns: dict[str, tuple[SpooledColumn, SpooledColumn]] = {}
    for path in bag_files(bag):
        for topic, series in FileReader(path, contents, decode).batches():
            pair = columns.setdefault(topic, (SpooledColumn(whole), SpooledColumn(whole)))
            for column, rows in zip(pair, series, strict=True):
                column.append(rows)
    if contents.is_of_another:
        contents.attachments.pop('scenario.yaml', None)
    for topic in [*columns]:  # one topic after the other, so that little is held twice
        stamps, values = columns.pop(topic)
        contents.messages[topic] = stamps.array(), values.array()
    return contents
