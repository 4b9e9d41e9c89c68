"""From the messages of a file to arrays: whole channels at once, message by message where need be.

A channel is taken at once where all its messages in a table have one layout, the same strings and
usable numbers. Whatever differs goes through the decoder, and where a message is refused, so does
the whole table, in the order of the file: the refusal is that of its first bad message. Only where
the recording says that a driver was free to say anything, bad messages are left out and counted:
the controller has refused them as well.
"""

import contextlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.records import Attachment, Channel, McapRecord, Metadata, Schema

from auv_analysis.bag import recording
from auv_analysis.bag.contents import Contents, Series
from auv_analysis.bag.decoding import Decoding
from auv_analysis.bag.layouts import Layout, learned
from auv_analysis.bag.limits import LARGEST_ATTACHMENT
from auv_analysis.bag.roles import ODOMETRIES, READERS, check_type, namespace_of, role_of
from auv_analysis.bag.tables import Table, by_channel
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import interface


class Batch(NamedTuple):
    """Messages of one topic: stamps (n,) in ns, values (n, 6) or (n, 13)."""

    topic: str
    stamps: np.ndarray
    rows: np.ndarray


class FileReader:
    """Reads one file of a bag into `contents`.

    Parameters
    ----------
    path : the file
    contents : of the whole bag, filled here but for its messages
    decode : whether the messages of our topics are read, or only counted

    """

    def __init__(self, path: Path, contents: Contents, decode: bool):
        self._path, self._contents, self._decode = path, contents, decode
        self._frames = contents.frames
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._decoders = Decoding(path)
        self._layouts: dict[int, Layout] = {}
        self._sizes = {name: len(text) for name, text in contents.attachments.items()}
        self._attached = sum(self._sizes.values())
        self._left_out: Counter[str] = Counter()
        self._reasons: dict[str, str] = {}  # topic -> why its first message was left out

    def finish(self) -> None:
        """Note what was left out."""
        for topic, count in self._left_out.items():
            counted = f'{self._path.name}: {topic}: {count} unusable messages left out'
            self._contents.notes.append(f'{counted}, the first one: {self._reasons[topic]}')

    def take(self, item: Table | McapRecord) -> Iterator[Batch]:
        """Read a record, or a table of messages."""
        if isinstance(item, Table):
            yield from self._table(item)
        elif isinstance(item, Schema):
            self._schemas[item.id] = item
        elif isinstance(item, Channel):
            self._channel(item)
        elif isinstance(item, Attachment):
            self._attachment(item)
        elif isinstance(item, Metadata):
            self._contents.metadata[item.name] = dict(item.metadata)

    def _attachment(self, item: Attachment) -> None:
        kept = self._contents.attachments
        more = len(item.data) - self._sizes.get(item.name, 0)
        if self._attached + more > LARGEST_ATTACHMENT:
            note = f'{self._path.name}: attachment {item.name!r} not read, they are too many'
            self._contents.notes.append(note)
            return
        self._attached += more
        self._sizes[item.name] = len(item.data)
        text = item.data.decode('utf-8', 'replace')
        kept[item.name] = text
        if item.name == recording.NAME:
            self._contents.names = recording.names_of(text, self._path)
            self._contents.lenient = not recording.was_strict(text, self._path)
            if not self._contents.asked:
                self._contents.namespace = recording.namespace_in(text, self._path)

    def _topic(self, channel: int) -> str:
        """Our name of a channel's topic."""
        topic = self._channels[channel].topic
        return self._contents.names.get(topic, topic)

    def _is_read(self, topic: str) -> bool:
        space = self._contents.namespace
        return space is None or namespace_of(topic).strip('/') == space.strip('/')

    def _channel(self, channel: Channel) -> None:
        if channel.id in self._channels:
            return
        self._channels[channel.id] = channel
        schema = self._schemas.get(channel.schema_id)
        kind = schema.name if schema else ''
        self._contents.types[channel.topic] = kind
        topic = self._topic(channel.id)
        if self._decode and role_of(topic) in READERS and self._is_read(topic):
            check_type(self._path, topic, kind)
            self._decoders.add(channel, schema)

    def _table(self, table: Table) -> Iterator[Batch]:
        members = {}
        for channel, index in by_channel(table.channels):
            if channel not in self._channels:
                expected = 'a channel before its messages'
                raise InputError(self._path, f'channel {channel}', expected, None)
            topic = self._channels[channel].topic
            self._contents.counts[topic] = self._contents.counts.get(topic, 0) + len(index)
            if channel in self._decoders:
                members[channel] = index
        self._contents.span(int(table.log_times.min()), int(table.log_times.max()))
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
                yield Batch(topic, *(np.concatenate(part)[order] for part in parts))
            else:
                yield Batch(topic, *entries[0][1])

    def _found(
        self, table: Table, members: dict[int, np.ndarray]
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

    def _meet(self, table: Table, members: dict[int, np.ndarray]) -> dict[str, int]:
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
        self, table: Table, index: np.ndarray, channel: int
    ) -> tuple[int, interface.Frames] | None:
        """The first odometry that may be left in, and its frames."""
        known = self._decoders
        if not self._contents.lenient:
            i = int(index[0])
            return i, known.frames_of(channel, known.message(table, i, channel))
        for i in index.tolist():
            with contextlib.suppress(InputError):
                odometry = known.message(table, i, channel)
                frames = known.frames_of(channel, odometry)
                known.value(self._topic(channel), odometry, frames)
                return i, frames
        return None

    def _at_once(self, table: Table, channel: int, index: np.ndarray, first: int) -> Series | None:
        """Stamps and rows of a channel; None where its messages must be looked at one by one."""
        topic, like = self._topic(channel), table.payload(index[0])
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
        self, table: Table, channel: int, index: np.ndarray, first: int
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
                if not self._contents.lenient:
                    raise
                self._left_out[topic] += 1
                self._reasons.setdefault(topic, error.found)
            else:
                taken.append(i)
                stamps.append(ns)
                rows.append(row)
        return np.array(taken, np.int64), (np.array(stamps, np.int64), np.array(rows, float))

    def _in_order(self, table: Table, frames: dict[str, interface.Frames]) -> None:
        """Refuse the first message of a table that must be refused."""
        for i, channel in enumerate(table.channels.tolist()):
            if channel in self._decoders:
                topic = self._topic(channel)
                message, namespace = self._decoders.message(table, i, channel), namespace_of(topic)
                if role_of(topic) in ODOMETRIES and namespace not in frames:
                    frames[namespace] = self._decoders.frames_of(channel, message)
                self._decoders.value(topic, message, frames.get(namespace))
