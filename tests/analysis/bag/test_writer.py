"""The bag writer without a graph: its thread keeps deadlines, files end where they should."""

import os
import re
import time
from collections import Counter
from pathlib import Path

import pytest
import yaml
from helpers.damaged_bags import (
    ATTACHED,
    QOS,
    STEP,
    attachments_of,
    messages_of,
    seen_by_rosbags,
    write_bag,
)
from helpers.made_messages import STRING, TYPES, serialized
from helpers.patience import patience
from mcap.reader import make_reader

from auv_analysis.bag import output
from auv_analysis.bag import writer as writer_module
from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.output import LEAST_SIZE, BagFile, Storage
from auv_analysis.bag.reading import read_bag
from auv_analysis.bag.recover import recover
from auv_analysis.bag.ros2msg import schema_text
from auv_analysis.bag.writer import BagWriter, FileHealth, RecordingError

PATIENCE = patience(20.0)  # s


def test_metadata_say_when_a_bag_begins_and_how_long_it_is(tmp_path: Path) -> None:
    told = yaml.safe_load((write_bag(tmp_path / 'bag', first=1000) / 'metadata.yaml').read_text())
    whole = told['rosbag2_bagfile_information']
    assert (whole['version'], whole['storage_identifier']) == (9, 'mcap')
    for one in (whole, *whole['files']):
        assert one['starting_time'] == {'nanoseconds_since_epoch': 1000 * STEP}
        assert one['duration'] == {'nanoseconds': 29 * STEP}
    bag = write_bag(tmp_path / 'split', first=1000, max_duration=20 * STEP)
    told = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    for one, first, count in zip((told, *told['files']), (0, 0, 20), (30, 20, 10), strict=True):
        assert one['starting_time'] == {'nanoseconds_since_epoch': (1000 + first) * STEP}
        assert one['duration'] == {'nanoseconds': (count - 1) * STEP}
    assert [key for key in whole if not whole[key]] == [
        'compression_format', 'compression_mode', 'custom_data',
    ]  # fmt: skip


def writer_of(folder: Path, **storage: object) -> BagWriter:
    writer = BagWriter(folder, ATTACHED, Storage(**storage))
    for topic in ('/a', '/b'):
        text = TYPES.generate_msgdef(STRING, ros_version=2)[0]
        writer.add_channel(
            Definition(topic, STRING, qos=QOS, digest=TYPES.hash_rihs01(STRING)), text
        )
    return writer


def said(text: str) -> bytes:
    return serialized(TYPES.types[STRING](text))


def test_a_chunk_is_closed_while_the_program_is_busy_with_something_else(tmp_path: Path) -> None:
    writer = writer_of(tmp_path / 'bag')
    writer.write('/a', 0, said('lonely'))
    limit = time.monotonic() + PATIENCE
    while read_bag(writer.path).counts.get('/a') != 1:  # no call of the writer
        assert time.monotonic() < limit
        time.sleep(0.01)
    writer.close()


def test_the_disk_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(output.os, 'fdatasync', lambda fd: synced.append(os.fstat(fd).st_size))
    writer = writer_of(tmp_path / 'bag')
    limit = time.monotonic() + PATIENCE
    for k in range(3):
        writer.write('/a', k, said('x' * k))
        seen = len(synced)
        while len(synced) <= seen or read_bag(writer.path).counts.get('/a', 0) <= k:
            assert time.monotonic() < limit
            time.sleep(0.01)
    writer.close()
    assert synced == sorted(synced)
    assert synced[-1] == (tmp_path / 'bag' / 'bag_0.mcap').stat().st_size


def test_a_disk_that_fails_ends_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: int) -> None:
        if b'a message' in (tmp_path / 'bag/bag_0.mcap').read_bytes():
            raise OSError(5, 'Input/output error')

    writer = writer_of(tmp_path / 'bag', compression='none')
    monkeypatch.setattr(output.os, 'fdatasync', broken)
    limit = time.monotonic() + PATIENCE
    writer.write('/a', 0, said('a message'))
    while not writer.trouble:
        assert time.monotonic() < limit
        time.sleep(0.01)
    with pytest.raises(RecordingError, match=r'bag_0.mcap: input/output error'):
        writer.write('/a', 0, said('x'))
    with pytest.raises(RecordingError, match='input/output error'):
        writer.close()
    assert read_bag(tmp_path / 'bag').counts['/a'] > 0


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
@pytest.mark.parametrize('compressible', [True, False])
def test_no_file_is_larger_than_it_may_be(
    tmp_path: Path, compression: str, compressible: bool
) -> None:
    largest = LEAST_SIZE // 4
    writer = writer_of(tmp_path / 'bag', compression=compression, max_size=largest, chunk_size=9000)
    rows = []
    for k in range(200):
        data = said('x' * 4000) if compressible else said('') + os.urandom(4000)
        writer.write('/ab'[0] + 'ab'[k % 2], k * STEP, data)
        rows.append((f'/{"ab"[k % 2]}', k * STEP, data))
    writer.close()
    files = sorted(
        (tmp_path / 'bag').glob('*.mcap'), key=lambda p: int(p.stem.removeprefix('bag_'))
    )
    sizes = [path.stat().st_size for path in files]
    assert max(sizes) <= largest
    assert compressible or compression != 'none' or min(sizes[:-1]) > 0.9 * largest
    assert [row for path in files for row in messages_of(path)] == rows
    assert seen_by_rosbags(tmp_path / 'bag') == Counter(rows)
    assert all([name for name, _ in attachments_of(path)] == [*ATTACHED] for path in files)
    assert recover(tmp_path / 'bag').changed is False


@pytest.mark.parametrize('where', ['loss', 'free_space', 'sync', 'flush'])
def test_any_exception_of_the_thread_ends_the_recording_in_good_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    writer = writer_of(tmp_path / 'bag', free_space=1)

    def strange(*_: object) -> None:
        raise ValueError('nobody has thought of this')

    with monkeypatch.context() as patched:
        kind = writer_module.BagFile if where == 'flush' else output.Output
        patched.setattr(kind, where, strange)
        writer.write('/a', 0, said('a message'))
        limit = time.monotonic() + PATIENCE
        while not writer.trouble:
            assert time.monotonic() < limit
            time.sleep(0.01)
    assert writer.trouble.endswith('bag_0.mcap: ValueError: nobody has thought of this')
    writer.write('/a', 1, said('another one'))
    writer.close()
    contents = read_bag(tmp_path / 'bag')
    assert contents.counts == {'/a': 2}
    assert contents.notes == []
    assert not recover(tmp_path / 'bag').changed


def test_the_thread_does_not_stumble_over_files_that_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_module, 'LOOK', 0.0)
    monkeypatch.setattr(writer_module, 'CHECK_PERIOD', 0.0)
    monkeypatch.setattr(writer_module, 'SYNC_PERIOD', 0.0)
    writer = writer_of(tmp_path / 'bag', max_duration=3 * STEP)
    for k in range(300):
        writer.write('/a', k * STEP, said(''))
    writer.close()
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) == 100
    assert read_bag(tmp_path / 'bag').counts['/a'] == 300


def test_a_message_larger_than_a_file_has_one_of_its_own(tmp_path: Path) -> None:
    writer = writer_of(tmp_path / 'bag', max_size=50_000)
    for k in range(3):
        writer.write('/a', k, said('') + os.urandom(80_000))
    writer.close()
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) == 3
    assert read_bag(tmp_path / 'bag').counts['/a'] == 3


def test_bursts_of_topics_do_not_multiply_the_files(tmp_path: Path) -> None:
    """A recorder takes all that a topic has sent before it looks at the next."""
    writer = writer_of(tmp_path / 'bag', max_duration=100 * STEP)
    for burst in range(10):
        for topic in ('/a', '/b'):
            for k in range(50 * burst, 50 * burst + 50):
                writer.write(topic, k * STEP, said(''))
    writer.close()
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) == 5


def test_a_clock_that_is_set_back_begins_a_file_as_well(tmp_path: Path) -> None:
    writer = writer_of(tmp_path / 'bag', max_duration=100 * STEP)
    for k in (*range(300), *range(300)):
        writer.write('/a', k * STEP, said(''))
    writer.close()
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) == 6


def test_a_topic_that_begins_a_file_and_falls_silent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(output, 'SILENCE', -1.0)
    writer = writer_of(tmp_path / 'bag', max_duration=100 * STEP)
    writer.write('/a', 0, said(''))
    for k in range(250):
        writer.write('/b', k * STEP, said(''))
    writer.close()
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) == 3


@pytest.mark.parametrize(('pace', 'telling', 'other'), [('', '/a', '/b'), ('/b', '/b', '/a')])
def test_one_topic_says_when_a_file_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pace: str, telling: str, other: str
) -> None:
    file = BagFile(tmp_path / 'x.mcap', {}, Storage(max_duration=100, pace=pace))
    for topic in ('/a', '/b'):
        file.define(Definition(topic, STRING), 'string data')
    assert not file.is_full(telling, 10**9, 5), 'nothing is in it'
    for topic in ('/a', '/b'):
        file.write(topic, 1000, said(''))
    for ns, is_full in ((1099, False), (1100, True), (901, False), (900, True)):
        assert file.is_full(telling, ns, 5) == is_full
        assert not file.is_full(other, ns, 5)
    assert not file.is_full('/new', 5000, 5), 'its first message'
    monkeypatch.setattr(output, 'SILENCE', -1.0)
    assert file.is_full(other, 1100, 5)
    file.finish()


def test_a_file_is_full_where_the_next_message_would_not_fit(tmp_path: Path) -> None:
    file = BagFile(tmp_path / 'x.mcap', {}, Storage('none', max_size=50_000))
    file.define(Definition('/a', STRING), 'string data')
    assert not file.is_full('/a', 0, 10**9)
    file.write('/a', 0, bytes(10_000))
    assert file.is_full('/a', 0, 41_000)
    assert not file.is_full('/a', 0, 33_000)
    file.write('/a', 0, bytes(33_000))
    file.finish()
    assert (tmp_path / 'x.mcap').stat().st_size <= 50_000


@pytest.mark.parametrize(('topics', 'chunk_size'), [(1, 1 << 20), (1, 1), (50, 1 << 20)])
def test_many_small_messages_chunks_or_topics_do_not_make_a_file_too_large(
    tmp_path: Path, topics: int, chunk_size: int
) -> None:
    file = BagFile(tmp_path / 'x.mcap', {}, Storage('none', chunk_size, max_size=200_000))
    for i in range(topics):
        file.define(Definition(f'/topic{i}', STRING, qos=QOS), 'string data')
    k = 0
    while not file.is_full(topic := f'/topic{k % topics}', k, 4):
        file.write(topic, k, b'abcd')
        k += 1
    file.finish()
    assert 100_000 < (tmp_path / 'x.mcap').stat().st_size <= 200_000


def test_attachments_say_what_they_are(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / 'bag', dict.fromkeys(('a.yaml', 'b.yml', 'c.txt'), 'x'))
    writer.close()
    with writer.path.open('rb') as file:
        found = {one.name: one.media_type for one in make_reader(file).iter_attachments()}
    yaml_type = 'application/yaml'
    assert found == {'a.yaml': yaml_type, 'b.yml': yaml_type, 'c.txt': 'text/plain'}


class FakeFile:
    """A file on a disk that runs full."""

    def __init__(self) -> None:
        self.output, self.path, self.lost = self, 'x.mcap', ''
        self.position, self.free, self.looks = 0, 1600, 0

    def loss(self) -> str:
        return self.lost

    def free_space(self) -> int:
        self.looks += 1
        return self.free


def test_space_is_looked_at_after_each_sixteenth_of_what_shall_stay_free() -> None:
    health, file = FileHealth(1600), FakeFile()
    for position, looks in ((100, 0), (101, 1), (201, 1), (202, 2), (101, 3)):
        file.position = position
        health.follow(file)
        assert file.looks == looks
    assert not health.trouble
    file.free = 1599
    health.check(file)
    told = 'x.mcap: 1599 bytes free on its file system, storage.free_space asks for 1600'
    assert health.trouble == told
    assert not health.broken, 'it can be finished'
    file.free = 5
    health.check(file)
    assert health.trouble == told
    carefree = FileHealth(0)
    file.position = 10**9
    carefree.follow(file)
    carefree.check(file)
    assert not carefree.trouble


def test_what_fails_ends_a_recording_and_only_some_of_it_its_file() -> None:
    file = FakeFile()
    for error, final, broken, told in (
        (OSError(5, 'Input/output error'), False, True, 'x.mcap: input/output error'),
        (OSError(5, 'Input/output error', 'y'), False, True, 'y: input/output error'),
        (ValueError('odd\nlines'), False, False, 'x.mcap: ValueError: odd'),
        (ValueError('odd'), True, True, 'x.mcap: ValueError: odd'),
    ):
        health = FileHealth(0)
        health.fail(file, error, final=final)
        assert (health.trouble, health.broken, health.displaced) == (told, broken, False)
    health = FileHealth(0)
    health.fail(file, ValueError('first'))
    health.fail(file, ValueError('second'))
    assert health.trouble.endswith('first')
    health.refuse_broken()
    file.lost = 'removed'
    health.check(file)
    assert (health.trouble, health.broken, health.displaced) == ('x.mcap: removed', True, True)
    with pytest.raises(RecordingError, match='removed'):
        health.refuse_broken()


def test_a_folder_with_a_bag_is_not_written_to(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / 'bag')
    (bag / 'bag_0.mcap').rename(bag / 'other.mcap')
    with pytest.raises(FileExistsError):
        BagWriter(bag, {})
    assert sorted(os.listdir(bag)) == ['metadata.yaml', 'other.mcap']


def test_definitions_stand_outside_of_the_chunks(tmp_path: Path) -> None:
    """So that the first chunk, when it is damaged, does not take all others with it."""
    writer = writer_of(tmp_path / 'bag', chunk_size=100)
    for k in range(20):
        writer.write('/a', k, said('x' * 50))
    path = writer.path
    writer.close()
    data = bytearray(path.read_bytes())
    chunk = data.index(b'zstd')
    data[chunk + 20] ^= 1
    path.write_bytes(data[: len(data) // 2])  # and there is no summary
    os.utime(path, (0, 0))
    document = recover(tmp_path / 'bag').document()
    assert document['topics']['/a']['messages'] > 5


def test_a_definition_is_followed_by_all_it_contains_in_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    texts = {
        'two/a_msgs/Top': 'uint8 KIND=1\n# Unused x\nInner[3] inner  # b_msgs/Unused y\n'
                          'b_msgs/Far[<=2] far\nstring<=5 name\n  Inner again\n\n',
        'two/a_msgs/Inner': 'float64 x\nb_msgs/Deep deep\n',
        'one/b_msgs/Far': 'Deep deep\nbyte[] data\n', 'two/b_msgs/Far': 'Unused x\n',
        'two/b_msgs/Deep': 'bool on\nwstring text\n',
    }  # fmt: skip
    for name, text in texts.items():
        prefix, package, kind = name.split('/')
        path = tmp_path / prefix / 'share' / package / 'msg' / f'{kind}.msg'
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path / "one"}:{tmp_path / "two"}')
    line = '=' * 80
    parts = [texts['two/a_msgs/Top'].rstrip()]
    for name in ('two/a_msgs/Inner', 'one/b_msgs/Far', 'two/b_msgs/Deep'):
        parts.append(f'{line}\nMSG: {name.partition("/")[2]}\n{texts[name].rstrip()}')
    assert schema_text('a_msgs/msg/Top') == '\n'.join(parts) + '\n'
    with pytest.raises(FileNotFoundError, match=r'a_msgs/msg/None.msg below .*one, .*two, '):
        schema_text('a_msgs/msg/None')


@pytest.mark.parametrize('kind', ['nav_msgs/msg/OccupancyGrid', 'sensor_msgs/msg/Imu'])
def test_a_definition_holds_each_type_that_it_needs_once(kind: str) -> None:
    named = re.findall('^MSG: (.*)$', schema_text(kind), re.M)
    assert 'builtin_interfaces/Time' in named
    assert len(set(named)) == len(named)
