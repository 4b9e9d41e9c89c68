"""A bag message by message, as plainly as it can be said: what the quick reader must equal."""

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Attachment, Channel, Chunk, DataEnd, Message, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap_ros2.decoder import DecoderFactory
from zstandard import ZstdError

from auv_analysis.bag.metadata import bag_files
from auv_analysis.bag.reading import BagContents
from auv_dynamics.files.errors import InputError, first_line
from auv_dynamics.ros import interface

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


def slow_read_bag(bag: str | Path) -> BagContents:
    """What `read_bag` gives, with lists in place of arrays."""
    contents = BagContents()
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
                contents.add(topic, record.log_time, record.log_time)
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
                        found = f'one that cannot be read: {first_line(error)}'
                        raise InputError(
                            path, record.topic, 'a schema of its type', found
                        ) from None
                    if decoder is None:
                        found = f'messages in {record.message_encoding}'
                        found += f', a definition in {schema.encoding}'
                        expected = 'cdr, with a definition in ros2msg'
                        raise InputError(path, record.topic, expected, found)
                    decoders[record.id] = decoder
            elif isinstance(record, Attachment):
                contents.attachments[record.name] = record.data.decode('utf-8', 'replace')
    return contents


def _records(path: Path, notes: list[str]) -> Iterator[Any]:
    """Record by record: one that reaches beyond the file is its end, any other fault is damage."""
    data, place, finished = path.read_bytes(), len(MAGIC), False
    if not data.startswith(MAGIC) and not MAGIC.startswith(data):
        raise InputError(path, '', 'an MCAP file', 'another beginning')
    while place < len(data):
        length = int.from_bytes(data[place + 1 : place + 9], 'little')
        opcode, body = data[place], data[place + 9 : place + 9 + length]
        if len(data) < place + 9 or (len(body) < length and _is_opcode(opcode)):
            break
        try:
            found = _parsed(opcode, body, data[:place])
        except (
            EndOfFile, struct.error, McapError, ValueError, KeyError, OverflowError, RuntimeError,
            MemoryError, ZstdError,
        ) as error:  # fmt: skip
            if place <= len(MAGIC):
                words = (str(error) or repr(error)).splitlines()[0]
                raise InputError(path, '', 'an MCAP file', words) from None
            notes.append(f'{path.name}: damaged from byte {place}, read up to there')
            finished = True
            break
        yield from found
        place += 9 + length
        if opcode == 2:
            finished = True
            if not MAGIC.startswith(data[place : place + 8]):
                notes.append(f'{path.name}: damaged from byte {place}, read up to there')
            break
    if not finished:
        notes.append(f'{path.name}: was not finished, its writer was killed; read to the end')


def _is_opcode(opcode: int) -> bool:
    return 1 <= opcode <= 15 or opcode >= 128


def _parsed(opcode: int, body: bytes, before: bytes) -> list[Any]:
    """Records in a record; the library reads them, but takes less than they declare as well."""
    if not _is_opcode(opcode):
        raise McapError(f'no record has the opcode {opcode}')
    if opcode == 7:
        (size,) = struct.unpack('<I', body[2:6])
        if size > len(body) - 6 or size % 16:
            raise McapError('a record that is shorter than its fields')
        return []
    head = opcode.to_bytes(1, 'little') + len(body).to_bytes(8, 'little')
    stream = StreamReader(_Whole(head + body), skip_magic=True, emit_chunks=True)
    record = next(stream.records, None)
    if isinstance(record, Attachment):
        used = 32 + len(record.name.encode()) + len(record.media_type.encode()) + len(record.data)
        told = int.from_bytes(body[used : used + 4], 'little')
        if told and told != zlib.crc32(body[:used]):
            raise McapError('an attachment that is not what its checksum says')
    if isinstance(record, DataEnd) and record.data_section_crc not in (0, zlib.crc32(before)):
        raise McapError('data that is not what its checksum says')
    if not isinstance(record, Chunk):
        return [record]
    content, length = get_chunk_data_stream(record, validate_crc=True)
    if length != record.uncompressed_size or record.compression not in ('', 'zstd', 'lz4'):
        raise McapError('sizes that do not agree')
    return _inside(content.read(length))


def _inside(data: bytes) -> list[Any]:
    """Schemas, channels and messages of a chunk, which its records must fill."""
    place, found = 0, []
    while place < len(data):
        (length,) = struct.unpack('<Q', data[place + 1 : place + 9])
        opcode, body = data[place], data[place + 9 : place + 9 + length]
        if len(body) < length:
            raise McapError('a chunk that ends within a record')
        found += _parsed(opcode, body, b'') if opcode in (3, 4, 5) else []
        place += 9 + length
    return found


class _Whole(BytesIO):
    """Bytes of which none may be missing."""

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        if size is not None and len(data) < size:
            raise McapError('a record that is shorter than its fields')
        return data


def _role(topic: str) -> str:
    if topic.endswith('/ground_truth/odom'):
        return 'ground_truth/odom'
    return topic.rpartition('/')[2]


def _decoded(decoder: Any, data: bytes, path: Path, topic: str) -> Any:
    try:
        if data[:2] not in (bytes(2), b'\0\1'):
            raise ValueError(f'CDR of kind {data[:2].hex()}')
        return decoder(data)
    except Exception as error:
        raise _refusal(path, topic, 'messages of its type', error) from None


def _refusal(path: Path, topic: str, expected: str, error: Exception) -> InputError:
    return InputError(path, topic, expected, (str(error) or repr(error)).splitlines()[0])


def _keep(contents: BagContents, path: Path, topic: str, message: Any, frames: dict) -> None:
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
