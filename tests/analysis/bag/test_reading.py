"""The bulk reader against a plain one: the same values, notes and refusals, whatever the file."""

import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.made_messages import (
    COMPRESSIONS,
    FRAMES,
    STRING,
    TYPES,
    Bag,
    odometry,
    serialized,
    stamped,
)
from helpers.plain_reader import slow_read_bag
from helpers.strategies import examples
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from auv_analysis.bag import chunks, mcap_file, step_topics
from auv_analysis.bag.chunks import MessageTable
from auv_analysis.bag.mcap_file import MAGIC, McapFile
from auv_analysis.bag.metadata import bag_files
from auv_analysis.bag.reading import BagContents, read_bag
from auv_dynamics.files.errors import InputError

STEP = 10_000_000
TWISTS = {'cmd_vel': 'Twist', 'cmd_accel': 'Accel', 'wrench': 'Wrench', 'disturbance': 'Wrench'}
OPTIONS = st.fixed_dictionaries({
    'chunk_size': st.sampled_from([1, 300, 3000, 100_000]),
    'compression': st.sampled_from(list(COMPRESSIONS.values())),
    'use_chunking': st.sampled_from([True, True, True, False]),
    'index': st.sampled_from([True, True, False]),
    'enable_crcs': st.booleans(),
    'enable_data_crcs': st.booleans(),
})  # fmt: skip
ODD = (  # what a message may be in place of a usable one of constant length
    'big endian', 'trailing bytes', 'other frame', 'longer frame', 'no frame', 'NaN', 'infinite',
    'long quaternion', 'cut', 'late', 'negative', 'not text', 'CDR 2',
)  # fmt: skip
SHARED = [HealthCheck.function_scoped_fixture]
quick = examples(15, suppress_health_check=SHARED)


def row(k: int, width: int) -> np.ndarray:
    values = np.sin(np.arange(1.0, width + 1.0) * (k + 1))
    if width == 13:
        values[3:7] /= np.linalg.norm(values[3:7])
    return values


def message(role: str, k: int, odd: str = '') -> tuple[str, bytes]:
    """Type and bytes of message k of a role."""
    ns = k * STEP
    frame = {'other frame': 'base_link_flu', 'longer frame': 'base_link_fsdx', 'no frame': ''}
    base = frame.get(odd, FRAMES[1])
    values = row(k, 13 if role == 'odom' else 6)
    if odd in ('NaN', 'infinite'):
        values[-1] = {'NaN': np.nan, 'infinite': np.inf}[odd]
    if odd == 'long quaternion':
        values[3:5] *= 1.01
    made: Any = (
        odometry(ns, values, (FRAMES[0], base))
        if role == 'odom'
        else stamped(TWISTS[role], ns, values, base)
    )
    data = bytearray(serialized(made, little=odd != 'big endian'))
    if odd in ('negative', 'late'):
        struct.pack_into('<i', data, 4, {'negative': -5, 'late': -(2**31)}[odd])
    elif odd == 'not text':
        data[16] = 0xFF
    elif odd == 'CDR 2':
        data[1] = 7
    elif odd == 'trailing bytes':
        data += b'\0\0\0\7'
    elif odd == 'cut':
        del data[-20:]
    return made.__msgtype__, bytes(data)


@st.composite
def bags(draw: st.DrawFn, odd: tuple[str, ...] = ODD) -> Any:
    """A function that writes a bag below a folder."""
    options, steps = draw(OPTIONS), draw(st.integers(1, 12))
    roles = draw(st.lists(st.sampled_from(['odom', *TWISTS]), min_size=1, unique=True))
    spaces = draw(st.sampled_from([('/',), ('/', '/a/'), ('/b/', '/a/'), ('',)]))
    plan = [(space, role, k) for k in range(steps) for space in spaces for role in roles]
    if draw(st.booleans()):
        plan = draw(st.permutations(plan))
    strange = draw(
        st.dictionaries(st.integers(0, len(plan) - 1), st.sampled_from(odd or ('',)), max_size=2)
    )
    foreign = draw(st.lists(st.integers(0, len(plan)), max_size=4))
    split = draw(st.sampled_from([None, len(plan) // 2]))
    again = draw(st.sets(st.integers(0, len(plan) - 1), max_size=3))

    def write(folder: Path) -> Path:
        bag = Bag(folder / 'bag' / 'bag_0.mcap', **options)
        bag.attach('scenario.yaml', 'name: made')
        for i, (space, role, k) in enumerate(plan):
            if i == split:
                bag.close()
                bag = Bag(folder / 'bag' / 'bag_1.mcap', **options)
            for n in range(foreign.count(i)):
                text = TYPES.types[STRING]('x' * (n * 7 + i))
                bag.add('/chatter', STRING, k * STEP, serialized(text))
            kind, data = message(role, k, strange.get(i, ''))
            bag.add(f'{space}{role}', kind, k * STEP, data, again=i in again)
        bag.close()
        return folder / 'bag'

    return write


def outcome(reader: Any, bag: Path) -> BagContents | str:
    try:
        return reader(bag)
    except InputError as error:
        return str(error)


def assert_equal_reading(bag: Path) -> BagContents | str:
    """Both readers agree; returns what they found."""
    expected, found = outcome(slow_read_bag, bag), outcome(read_bag, bag)
    if isinstance(expected, str):
        assert found == expected
        return found
    assert isinstance(found, BagContents), found
    for name in ('attachments', 'types', 'counts', 'first', 'last', 'notes'):
        assert getattr(found, name) == getattr(expected, name), name
    assert found.messages.keys() == expected.messages.keys()
    for topic, (stamps, rows) in expected.messages.items():
        assert found.messages[topic][0].tolist() == stamps
        assert np.array_equal(found.messages[topic][1], np.array(rows, float)), topic
    return found


@given(bags(odd=()))
@quick
def test_usable_bags(write: Any) -> None:
    with tempfile.TemporaryDirectory() as folder:
        assert isinstance(assert_equal_reading(write(Path(folder))), BagContents)


@given(bags())
@quick
def test_bags_with_odd_messages(write: Any) -> None:
    with tempfile.TemporaryDirectory() as folder:
        assert_equal_reading(write(Path(folder)))


@given(bags(), st.floats(0, 1))
@quick
def test_bags_that_are_cut(write: Any, share: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        last = sorted(write(Path(folder)).glob('*.mcap'))[-1]
        data = last.read_bytes()
        last.write_bytes(data[: int(share * len(data))])
        assert_equal_reading(last.parent)


@given(bags(odd=()), st.lists(st.tuples(st.floats(0, 1), st.integers(1, 255)), min_size=1))
@examples(30, suppress_health_check=SHARED)
def test_bags_with_damaged_bytes(write: Any, flips: list[tuple[float, int]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        last = sorted(write(Path(folder)).glob('*.mcap'))[-1]
        data = bytearray(last.read_bytes())
        for share, flip in flips:
            data[min(int(share * len(data)), len(data) - 1)] ^= flip
        last.write_bytes(data)
        assert_equal_reading(last.parent)


@pytest.mark.parametrize('odd', ODD)
@pytest.mark.parametrize('role', ['odom', 'wrench'])
@pytest.mark.parametrize('place', [0, 5])
def test_one_odd_message_amid_usable_ones(odd: str, role: str, place: int, tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap', chunk_size=4000 if place else 100_000)
    for name in ('wrench', 'odom', 'cmd_vel') if place == 0 else ():  # all in one table
        bag.channel(f'/{name}', message(name, 0)[0])
    for k in range(10):
        for name in ('wrench', 'odom', 'cmd_vel'):
            kind, data = message(name, k, odd if (name, k) == (role, place) else '')
            bag.add(f'/{name}', kind, k * STEP, data)
    assert_equal_reading(bag.close())


def test_a_topic_in_another_frame_is_free_up_to_the_first_odometry_alone(tmp_path: Path) -> None:
    bag, (kind, odom) = Bag(tmp_path / 'bag.mcap'), message('odom', 1)
    for role in ('odom', 'wrench'):
        bag.channel(f'/{role}', message(role, 0)[0])
    for k in (0, 1, 2):
        wrench, data = message('wrench', k, 'other frame')
        bag.add('/wrench', wrench, k * STEP, data)
        if k == 1:
            bag.add('/odom', kind, k * STEP, odom)
    assert '/wrench: expected usable messages' in str(assert_equal_reading(bag.close()))


@pytest.mark.parametrize('index', [True, False])
@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_channels_of_constant_length_never_meet_the_decoder(
    index: bool, compression: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = Bag(tmp_path / 'bag.mcap', index=index, compression=COMPRESSIONS[compression])
    for k in range(300):
        for topic in ('/cmd_vel', '/odom', '/wrench', '/alone/wrench'):
            kind, data = message(topic.rpartition('/')[2], k)
            bag.add(topic, kind, k * STEP, data)
    path, decoded = bag.close(), []
    original = step_topics.DecoderFactory.decoder_for

    def counting(self: Any, encoding: str, schema: Any) -> Any:
        decoder = original(self, encoding, schema)
        return lambda data: decoded.append(len(data)) or decoder(data)

    monkeypatch.setattr(step_topics.DecoderFactory, 'decoder_for', counting)
    contents = read_bag(path)
    topics = '/cmd_vel', '/odom', '/wrench', '/alone/wrench'
    assert contents.counts == dict.fromkeys(topics, 300)
    assert len(decoded) <= 5, 'one proof per channel, and the frames of the first odometry'


def test_a_schema_with_its_fields_in_another_order_is_obeyed(tmp_path: Path) -> None:
    class Turned(Bag):
        def channel(self, topic: str, kind: str, *, again: bool = False) -> int:
            text = TYPES.generate_msgdef(kind, ros_version=2)[0]
            first, second = 'geometry_msgs/Vector3 force', 'geometry_msgs/Vector3 torque'
            text = text.replace(f'{first}\n{second}', f'{second}\n{first}')
            schema = self._writer.register_schema(kind, 'ros2msg', text.encode())
            return self._writer.register_channel(topic, 'cdr', schema)

    bag = Turned(tmp_path / 'bag.mcap')
    for k in range(5):
        kind, data = message('wrench', k)
        bag.add('/wrench', kind, k * STEP, data)
    found = assert_equal_reading(bag.close())
    assert isinstance(found, BagContents)
    assert np.array_equal(found.messages['/wrench'][1][2], np.roll(row(2, 6), 3))


def test_an_index_that_lies_is_not_believed(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap', compression=COMPRESSIONS['none'])
    for k in range(20):
        kind, data = message('wrench', k)
        bag.add('/wrench', kind, k * STEP, data)
    path = bag.close()
    good = path.read_bytes()
    entry = struct.pack('<QQ', 7 * STEP, 0)[:8]
    place = good.rindex(entry, 0, good.rindex(b'\x08', 0, len(good) - 100))
    index = place - 7 * 16 - 15  # its record: opcode and length, channel, bytes of entries
    assert good[index] == 7
    size = struct.unpack_from('<Q', good, len(MAGIC) + good[8:].index(b'\x06') + 1)[0] - 40
    lies = [('<Q', place + 8, lie) for lie in (0, 1, size - 30, size - 4, 10**6, 2**63, 2**64 - 1)]
    lies += [('<I', index + 11, lie) for lie in (17, 24, 336, 2**32 - 16)]  # it has 320 bytes
    for code, where, lie in lies:
        data = bytearray(good)
        struct.pack_into(code, data, where, lie)
        path.write_bytes(data + b'xyz')  # no whole numbers up to the end
        found = assert_equal_reading(path)
        assert isinstance(found, BagContents)
        assert found.counts == {'/wrench': 20}, lie
    path.write_bytes(good[: index + 15 + 5 * 16 + 3])  # cut in the index
    assert_equal_reading(path)
    assert read_bag(path).counts == {'/wrench': 20}


def test_a_chunk_with_an_index_is_not_gone_through_record_by_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    walked, places = list[int](), chunks._places
    monkeypatch.setattr(
        chunks, '_places', lambda data, most: walked.append(len(data)) or places(data, most)
    )
    for index in (True, False):
        bag = Bag(tmp_path / f'{index}.mcap', index=index, chunk_size=4000)
        for k in range(40):
            for role in ('wrench', 'cmd_vel'):
                kind, data = message(role, k)
                bag.add(f'/{role}', kind, k * STEP, data)
        walked.clear()
        assert read_bag(bag.close()).counts == {'/wrench': 40, '/cmd_vel': 40}
        assert (max(walked) < 4000) == index, 'the definitions alone'


def test_what_damage_costs_of_a_file(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap', chunk_size=1)
    for k in range(3):
        kind, data = message('wrench', k)
        bag.add('/wrench', kind, k * STEP, data)
    good = bag.close().read_bytes()
    bag.path.write_bytes(good[:8] + b'\0' + good[9:])  # the header: nothing tells what it is
    assert 'expected an MCAP file' in str(assert_equal_reading(bag.path))
    second = 8 + 9 + struct.unpack_from('<Q', good, 9)[0]
    bag.path.write_bytes(good[:second] + b'\0' + good[second + 1 :])
    found = assert_equal_reading(bag.path)
    assert isinstance(found, BagContents)
    assert found.notes == [f'bag.mcap: damaged from byte {second}, read up to there']


def test_messages_without_a_channel_are_refused(tmp_path: Path) -> None:
    bag = Bag(tmp_path / 'bag.mcap', use_chunking=False)
    kind, data = message('wrench', 0)
    bag.add('/wrench', kind, 0, data)
    bag._writer.add_message(77, 0, data, 0)
    with pytest.raises(InputError, match='channel 77: expected a channel before its messages'):
        read_bag(bag.close())


def test_of_long_messages_without_chunks_few_are_held(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(mcap_file, 'HEAVY', 30_000)
    bag, image = Bag(tmp_path / 'bag.mcap', use_chunking=False), TYPES.types[STRING]('x' * 10_000)
    for ns in range(10):
        bag.add('/image', STRING, ns, serialized(image))
    tables = [item for item in McapFile(bag.close()).records() if isinstance(item, MessageTable)]
    assert max(len(table.data) for table in tables) < 50_000
    assert [int(ns) for table in tables for ns in table.log_times] == [*range(10)]


def test_files_of_a_bag_come_by_their_numbers(tmp_path: Path) -> None:
    names = [f'dive_{number}.mcap' for number in (0, 2, 10)]
    for name in names:
        (tmp_path / name).touch()
    assert [path.name for path in bag_files(tmp_path)] == names
