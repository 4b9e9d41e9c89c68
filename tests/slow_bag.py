"""A bag message by message, as plainly as it can be said: what the quick reader must equal."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Attachment, Channel, Footer, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from zstandard import ZstdError

from auv_analysis.bag.contents import Contents
from auv_analysis.bag.files import bag_files
from auv_dynamics import interface
from auv_dynamics.files import InputError

MAGIC = b'\x89MCAP0\r\n'
STAMPED = 'geometry_msgs/msg/{}Stamped'.format
TYPES = {
    'odom': 'nav_msgs/msg/Odometry',
    'ground_truth/odom': 'nav_msgs/msg/Odometry',
    'cmd_vel': STAMPED('Twist'),
    'cmd_accel': STAMPED('Accel'),
    'wrench': STAMPED('Wrench'),
    'wrench_applied': STAMPED('Wrench'),
    'disturbance': STAMPED('Wrench'),
    'disturbance_estimate': STAMPED('Wrench'),
}
READERS = {
    'nav_msgs/msg/Odometry': interface.read_odometry,
    STAMPED('Twist'): interface.read_twist,
    STAMPED('Accel'): interface.read_accel,
    STAMPED('Wrench'): interface.read_wrench,
}


def slow_read_bag(bag: str | Path) -> Contents:
    """What `read_bag` gives, with lists in place of arrays."""
    contents = Contents()
    frames: dict[str, interface.Frames] = {}
    for path in bag_files(bag):
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        decoders: dict[int, Any] = {}
        for record in _records(path, contents.notes):
            if isinstance(record, Message):
                if record.channel_id not in channels:
                    where = f'channel {record.channel_id}'
                    raise InputError(path, where, 'a channel before its messages', None)
                topic = channels[record.channel_id].topic
                contents.counts[topic] = contents.counts.get(topic, 0) + 1
                contents.span(record.log_time, record.log_time)
                if record.channel_id in decoders:
                    message = _decoded(decoders[record.channel_id], record.data, path, topic)
                    _keep(contents, path, topic, message, frames)
            elif isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                if record.id in channels:
                    continue
                channels[record.id] = record
                schema = schemas.get(record.schema_id)
                contents.types[record.topic] = kind = schema.name if schema else ''
                if (role := _role(record.topic)) in TYPES:
                    if kind != TYPES[role]:
                        raise InputError(path, record.topic, TYPES[role], kind)
                    try:
                        decoder = DecoderFactory().decoder_for(record.message_encoding, schema)
                    except Exception as error:
                        raise _refusal(path, record.topic, 'a schema of its type', error) from None
                    if decoder is not None:
                        decoders[record.id] = decoder
            elif isinstance(record, Attachment):
                contents.attachments[record.name] = record.data.decode('utf-8', 'replace')
            elif isinstance(record, Metadata):
                contents.metadata[record.name] = dict(record.metadata)
    return contents


def _records(path: Path, notes: list[str]) -> Iterator[Any]:
    finished = False
    with path.open('rb') as stream:
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                finished = finished or isinstance(record, Footer)
                yield record
        except (EndOfFile, struct.error):
            head = path.read_bytes()[: len(MAGIC)]
            if 0 < stream.tell() < len(MAGIC) or not MAGIC.startswith(head):
                raise InputError(path, '', 'an MCAP file', 'another beginning') from None
        except (
            McapError, ValueError, KeyError, OverflowError, RuntimeError, MemoryError, ZstdError,
        ) as error:  # fmt: skip
            if stream.tell() <= 64:
                found = (str(error) or repr(error)).splitlines()[0]
                raise InputError(path, '', 'an MCAP file', found) from None
            notes.append(f'{path.name}: damaged from byte {stream.tell()}, read up to there')
            finished = True
    if not finished:
        notes.append(f'{path.name}: was not finished, its writer was killed; read to the end')


def _role(topic: str) -> str:
    if topic.endswith('/ground_truth/odom'):
        return 'ground_truth/odom'
    return topic.rpartition('/')[2]


def _decoded(decoder: Any, data: bytes, path: Path, topic: str) -> Any:
    try:
        return decoder(data)
    except Exception as error:
        raise _refusal(path, topic, 'messages of its type', error) from None


def _refusal(path: Path, topic: str, expected: str, error: Exception) -> InputError:
    return InputError(path, topic, expected, (str(error) or repr(error)).splitlines()[0])


def _keep(contents: Contents, path: Path, topic: str, message: Any, frames: dict) -> None:
    role = _role(topic)
    namespace = topic.removesuffix(role)
    try:
        if role in ('odom', 'ground_truth/odom'):
            odometry = interface.Frames(message.header.frame_id, message.child_frame_id)
            frames.setdefault(namespace, odometry)
        known = frames.get(namespace) or interface.Frames(base=message.header.frame_id)
        ns, values = READERS[TYPES[role]](message, known, role)
    except interface.BadMessageError as error:
        raise _refusal(path, topic, 'usable messages', error) from None
    except (AttributeError, TypeError) as error:
        raise _refusal(path, topic, 'messages of its type', error) from None
    stamps, rows = contents.messages.setdefault(topic, ([], []))
    stamps.append(ns)
    rows.append(values)
