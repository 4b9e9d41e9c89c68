"""From the messages of a file to arrays: whole channels at once, message by message where need be.

A channel is taken at once where all its messages in a table have one layout, the same strings and
usable numbers. Whatever differs goes through the decoder, and where a message is refused, so does
the whole table, in the order of the file: the refusal is that of its first bad message.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.records import Attachment, Channel, McapRecord, Metadata, Schema
from mcap_ros2.decoder import DecoderFactory

from auv_analysis.bag import recording
from auv_analysis.bag.contents import Contents, Series
from auv_analysis.bag.layouts import Layout, learned
from auv_analysis.bag.limits import LARGEST_ATTACHMENT
from auv_analysis.bag.roles import ODOMETRIES, READERS, check_type, namespace_of, role_of
from auv_analysis.bag.tables import Table
from auv_dynamics import interface
from auv_dynamics.files import InputError

Decoder = Callable[[bytes], Any]


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
        self._decoders: dict[int, Decoder] = {}
        self._layouts: dict[int, Layout] = {}

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
        held = sum(len(text) for name, text in kept.items() if name != item.name)
        if held + len(item.data) > LARGEST_ATTACHMENT:
            note = f'{self._path.name}: attachment {item.name!r} not read, they are too many'
            self._contents.notes.append(note)
            return
        text = item.data.decode('utf-8', 'replace')
        kept[item.name] = text
        if item.name == recording.NAME:
            self._contents.names = recording.names_of(text, self._path)

    def _topic(self, channel: int) -> str:
        """Our name of a channel's topic."""
        topic = self._channels[channel].topic
        return self._contents.names.get(topic, topic)

    def _channel(self, channel: Channel) -> None:
        if channel.id in self._channels:
            return
        self._channels[channel.id] = channel
        schema = self._schemas.get(channel.schema_id)
        kind = schema.name if schema else ''
        self._contents.types[channel.topic] = kind
        if self._decode and role_of(self._topic(channel.id)) in READERS:
            check_type(self._path, self._topic(channel.id), kind)
            try:  # a factory of its own per file: schema ids are only unique within one
                decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
            except Exception as error:  # whatever its parser stumbles over
                raise self._refusal(channel.topic, 'a schema of its type', error) from None
            if decoder is not None:
                self._decoders[channel.id] = decoder

    def _table(self, table: Table) -> Iterator[Batch]:
        counts = np.bincount(table.channels)
        members = {}
        for channel in np.flatnonzero(counts).tolist():
            if channel not in self._channels:
                expected = 'a channel before its messages'
                raise InputError(self._path, f'channel {channel}', expected, None)
            topic = self._channels[channel].topic
            self._contents.counts[topic] = self._contents.counts.get(topic, 0) + int(
                counts[channel]
            )
            if channel in self._decoders:
                members[channel] = np.flatnonzero(table.channels == channel)
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
            if series is None:
                series = self._one_by_one(table, channel, index, first)
            found.setdefault(topic, []).append((index, series))
        return found

    def _meet(self, table: Table, members: dict[int, np.ndarray]) -> dict[str, int]:
        """Namespace -> number of the message of the table from which its frames hold."""
        since = dict.fromkeys(self._frames, 0)
        met: dict[str, tuple[int, int]] = {}
        for channel, index in members.items():
            topic = self._topic(channel)
            namespace = namespace_of(topic)
            if role_of(topic) in ODOMETRIES and namespace not in self._frames:
                first = int(index[0]), channel
                met[namespace] = min(met.get(namespace, first), first)
        for namespace, (i, channel) in met.items():
            self._frames[namespace] = self._frames_of(table, i, channel)
            since[namespace] = i
        return since

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

    def _one_by_one(self, table: Table, channel: int, index: np.ndarray, first: int) -> Series:
        """Stamps and rows of a channel, by its decoder; messages from `first` on have frames."""
        topic = self._topic(channel)
        frames = self._frames.get(namespace_of(topic))
        values = [
            self._value(topic, self._message(table, i, channel), frames if i >= first else None)
            for i in index.tolist()
        ]
        stamps, rows = zip(*values, strict=True)
        return np.array(stamps, np.int64), np.array(rows, float)

    def _in_order(self, table: Table, frames: dict[str, interface.Frames]) -> None:
        """Refuse the first message of a table that must be refused."""
        for i, channel in enumerate(table.channels.tolist()):
            if channel in self._decoders:
                topic = self._topic(channel)
                message, namespace = self._message(table, i, channel), namespace_of(topic)
                if role_of(topic) in ODOMETRIES and namespace not in frames:
                    frames[namespace] = self._frames_of(table, i, channel)
                self._value(topic, message, frames.get(namespace))

    def _message(self, table: Table, i: int, channel: int) -> Any:
        try:
            return self._decoders[channel](table.payload(i))
        except Exception as error:  # by its schema, a message may be anything
            topic = self._channels[channel].topic
            raise self._refusal(topic, 'messages of its type', error) from None

    def _value(
        self, topic: str, message: Any, frames: interface.Frames | None
    ) -> tuple[int, tuple]:
        """Stamp and row of a message; those before the first odometry are free in their frame."""
        try:
            known = frames or interface.Frames(base=message.header.frame_id)
            return READERS[role_of(topic)](message, known)
        except interface.BadMessageError as error:
            raise self._refusal(topic, 'usable messages', error) from None
        except (AttributeError, TypeError) as error:  # a schema with other fields
            raise self._refusal(topic, 'messages of its type', error) from None

    def _frames_of(self, table: Table, i: int, channel: int) -> interface.Frames:
        odometry = self._message(table, i, channel)
        try:
            return interface.Frames(odometry.header.frame_id, odometry.child_frame_id)
        except AttributeError as error:  # a schema with other fields
            topic = self._channels[channel].topic
            raise self._refusal(topic, 'messages of its type', error) from None

    def _refusal(self, topic: str, expected: str, error: Exception) -> InputError:
        lines = str(error).splitlines()
        return InputError(self._path, topic, expected, lines[0] if lines else repr(error))
