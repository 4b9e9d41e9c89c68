"""Small files that would cost a careless reader gigabytes and minutes: counts, not sizes."""

import random
import struct
from collections.abc import Callable, Iterator
from functools import cache

import zstandard
from helpers.made_messages import TYPES

MAGIC = b'\x89MCAP0\r\n'
MILLION = 1_000_000
KIND = 'nav_msgs/msg/Odometry'


def text(value: str) -> bytes:
    data = value.encode()
    return struct.pack('<I', len(data)) + data


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack('<BQ', opcode, len(body)) + body


@cache
def definition(kind: str) -> str:
    return TYPES.generate_msgdef(kind, ros_version=2)[0] if '/msg/' in kind else ''


def schema(number: int, kind: str = KIND, remark: str = '') -> bytes:
    parts = text(kind), text('ros2msg'), text(definition(kind) + remark)
    return record(3, struct.pack('<H', number) + b''.join(parts))


def channel(number: int, topic: str, of: int = 1, about: bytes = b'') -> bytes:
    head = struct.pack('<HH', number, of)
    return record(4, head + text(topic) + text('cdr') + struct.pack('<I', len(about)) + about)


def message(number: int, at: int = 0, data: bytes = b'') -> bytes:
    return record(5, struct.pack('<HIQQ', number, 0, at, at) + data)


def chunk(data: bytes) -> bytes:
    packed = zstandard.compress(data)
    head = struct.pack('<QQQI', 0, 0, len(data), 0) + text('zstd') + struct.pack('<Q', len(packed))
    return record(6, head + packed)


def file_of(*parts: bytes) -> bytes:
    """A finished file."""
    closing = record(15, bytes(4)) + record(2, bytes(20))
    return b''.join([MAGIC, record(1, text('ros2') + text('harm')), *parts, closing, MAGIC])


def empty_messages(count: int) -> bytes:
    """On a topic of nobody."""
    return file_of(chunk(schema(1, 'std_msgs/msg/Empty') + channel(1, '/x') + message(1) * count))


def messages_of_ours(count: int) -> bytes:
    """On a topic that is read, each of them unusable."""
    return file_of(chunk(schema(1) + channel(1, '/odom') + message(1) * count))


def messages_that_do_not_tile(count: int) -> bytes:
    """Behind a message that is shorter than its own head."""
    first = schema(1) + channel(1, '/x')
    return file_of(chunk(first + message(1) * count + record(5, bytes(21))))


def messages_on_many_channels(count: int) -> bytes:
    """Every channel that there can be, in turn."""
    channels = b''.join(channel(i, f'/x{i}') for i in range(1 << 16))
    turn = b''.join(message(i) for i in range(1 << 16))
    return file_of(chunk(schema(1) + channels + turn * (count >> 16)))


def channels_in_turn(count: int) -> bytes:
    """A channel's record before each message."""
    pair = channel(1, '/x') + message(1)
    return file_of(chunk(schema(1) + pair * (count // 2)))


def one_channel_again(count: int) -> bytes:
    """The same record."""
    return file_of(chunk(schema(1) + channel(1, '/odom') * count))


def many_channels_of_ours(count: int) -> bytes:
    """Each with an odometry of its own."""
    found = b''.join(channel(i, f'/v{i}/odom') for i in range(min(count, 1 << 16)))
    return file_of(chunk(schema(1) + found))


def one_schema_again(count: int) -> bytes:
    """The same record."""
    return file_of(chunk(schema(1, 'x/Y') * count))


def many_schemas(count: int) -> bytes:
    """Definitions of odometry that all differ in a remark, and a topic each."""
    numbers = range(1, min(count, 20_000))
    found = b''.join(
        schema(i, remark=f'\n# {i}') + channel(i, f'/v{i}/odom', i) + message(i) for i in numbers
    )
    return file_of(chunk(found))


def long_schema(count: int) -> bytes:
    """A definition of very many fields."""
    fields = ''.join(f'int8 a{i}\n' for i in range(count))
    return file_of(chunk(schema(1, remark=f'\n{fields}') + channel(1, '/odom') + message(1)))


def long_maps(count: int) -> bytes:
    """Channels with very much to be said of them."""
    about = b''.join(text(f'{i}') + text('') for i in range(count // 400))
    return file_of(chunk(schema(1) + b''.join(channel(i, '/x', 1, about) for i in range(50))))


def policies(count: int) -> bytes:
    """Channels whose offered profiles are YAML that takes long, or that explodes."""
    lines = ['- &a [0,0,0,0,0,0,0,0,0,0]', *['- &b [*a,*a,*a,*a,*a,*a,*a,*a,*a,*a]'] * 90]
    about = text('offered_qos_profiles') + text('\n'.join(lines))
    numbers = range(min(count // 1000, 1000))
    found = b''.join(channel(i, f'/x{i}', 1, about) for i in numbers)
    return file_of(chunk(schema(1) + found + message(1)))


def attachments(count: int) -> bytes:
    """Empty ones."""
    found = (
        record(9, bytes(16) + text(f'{i}') + text('') + bytes(8) + bytes(4))
        for i in range(count // 100)
    )
    return file_of(*found)


def metadata(count: int) -> bytes:
    """Records of it, all different."""
    return file_of(*(record(12, text(f'{i}') + bytes(4)) for i in range(count // 50)))


def chunks(count: int) -> bytes:
    """Very many messages in many chunks."""
    one = chunk(message(1) * (count // 20))
    return file_of(schema(1), channel(1, '/x'), one * 20)


KINDS: dict[str, Callable[[int], bytes]] = {
    make.__name__: make
    for make in (
        empty_messages, messages_of_ours, messages_that_do_not_tile, messages_on_many_channels,
        channels_in_turn, one_channel_again, many_channels_of_ours, one_schema_again, many_schemas,
        long_schema, long_maps, policies, attachments, metadata, chunks,
    )
}  # fmt: skip


def drawn(rng: random.Random) -> Iterator[tuple[str, bytes]]:
    """Bags of every kind, of drawn counts, without end."""
    while True:
        name = rng.choice([*KINDS])
        yield name, KINDS[name](int(MILLION * 10 ** rng.uniform(-3, 0.5)))
