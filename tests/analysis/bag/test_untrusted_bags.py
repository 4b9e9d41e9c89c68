"""Bags that were made to do harm: small files that fill the memory, names that are paths."""

import os
import resource
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import lz4.frame
import pytest
import yaml
import zstandard
from helpers import costly_bags
from helpers.damaged_bags import UPRIGHT, old
from helpers.made_messages import TYPES, odometry, serialized, stamped
from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    Message,
    Metadata,
    Schema,
)

from auv_analysis import load_scenario
from auv_analysis.bag import attachments, chunks, limits, mcap_file, metadata
from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.chunks import Body
from auv_analysis.bag.load import load_run
from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.reading import BagContents, read_bag
from auv_analysis.bag.recover import recover
from auv_analysis.bag.writer import BagWriter
from auv_analysis.cli.main import main
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_dynamics.files.errors import InputError

MIB = 1 << 20
HUGE = 3 << 30  # bytes that a bomb holds
MAGIC = mcap_file.MAGIC


@pytest.fixture
def little_memory() -> Iterator[None]:
    """So little more than now that no bomb fits into it."""
    pages = int(Path('/proc/self/statm').read_text().split()[0])
    before = resource.getrlimit(resource.RLIMIT_AS)
    now = pages * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + 400 * MIB, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def record(item: object) -> bytes:
    builder = RecordBuilder()
    item.write(builder)
    return builder.end()


def write_chunk(path: Path, chunk: Chunk) -> Path:
    """A finished file of one chunk."""
    parts = Header('ros2', 'harm'), chunk, DataEnd(0), Footer(0, 0, 0)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(MAGIC + b''.join(map(record, parts)) + MAGIC)
    return old(path)


def zstd_bomb(size: int, *, says: bool) -> bytes:
    """Zeros, with or without their number: blocks (RFC 8878) of one byte that repeats."""
    window = (17 - 10) << 3  # exponent of 128 KiB, the largest block
    head = struct.pack('<IBBQ', 0xFD2FB528, 0xC0, window, size)
    if not says:
        head = struct.pack('<IBB', 0xFD2FB528, 0, window)
    blocks = size >> 17
    kinds = [1 << 1] * (blocks - 1) + [1 << 1 | 1]  # the last one says so
    return head + b''.join(((1 << 17) << 3 | kind).to_bytes(3, 'little') + b'\0' for kind in kinds)


def lz4_bomb(size: int, *, says: bool) -> bytes:
    """The same: one block again and again."""
    options = {'block_size': lz4.frame.BLOCKSIZE_MAX4MB, 'block_linked': False, 'auto_flush': True}
    compressor = lz4.frame.LZ4FrameCompressor(**options)
    head = compressor.begin(source_size=size if says else 0)
    return head + compressor.compress(bytes(4 * MIB)) * (size // (4 * MIB)) + bytes(4)


BOMBS = {'zstd': zstd_bomb, 'lz4': lz4_bomb}


@pytest.mark.parametrize('says', [True, False], ids=['says', 'silent'])
@pytest.mark.parametrize('kind', BOMBS)
@pytest.mark.usefixtures('little_memory')
def test_a_bomb_that_says_what_it_is_is_refused(
    tmp_path: Path, kind: str, says: bool, capsys: pytest.CaptureFixture
) -> None:
    size = HUGE if kind == 'zstd' else limits.LARGEST_CHUNK + 16 * MIB
    chunk = Chunk(kind, BOMBS[kind](size, says=says), 0, 0, 0, size)
    path = write_chunk(tmp_path / 'bag' / 'bag_0.mcap', chunk)
    assert path.stat().st_size < 3 * MIB
    for command in ('info', 'analyze'):
        with pytest.raises(SystemExit) as ended:
            main([command, str(path.parent)])
        assert ended.value.code == 2
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1
        assert f'expected a chunk of at most {limits.LARGEST_CHUNK} bytes' in lines[0]
        assert f'found {size}, decompressed' in lines[0]


@pytest.mark.parametrize('says', [True, False], ids=['says', 'silent'])
@pytest.mark.parametrize('kind', BOMBS)
@pytest.mark.usefixtures('little_memory')
def test_a_bomb_that_lies_is_not_decompressed(tmp_path: Path, kind: str, says: bool) -> None:
    size = HUGE if kind == 'zstd' else limits.LARGEST_CHUNK
    chunk = Chunk(kind, BOMBS[kind](size, says=says), 0, 0, 0, 999)  # of nines: zeros are records
    path = write_chunk(tmp_path / 'bag' / 'bag_0.mcap', chunk)
    contents = read_bag(path.parent)
    assert contents.counts == {}
    assert f'damaged from byte {8 + len(record(Header("ros2", "harm")))}' in contents.notes[0]


@pytest.mark.parametrize('kind', BOMBS)
def test_a_chunk_need_not_say_how_much_it_holds(tmp_path: Path, kind: str) -> None:
    held = b''.join(map(record, (Channel(1, '/a', 'cdr', {}, 0), Message(1, 0, b'abc', 0, 0))))
    silent = zstandard.ZstdCompressor(write_content_size=False).compress(held)
    packed = silent if kind == 'zstd' else lz4.frame.compress(held, store_size=False)
    chunk = Chunk(kind, packed, 0, 0, zlib.crc32(held), len(held))
    contents = read_bag(write_chunk(tmp_path / 'bag' / 'bag_0.mcap', chunk).parent)
    assert (contents.counts, contents.notes) == ({'/a': 1}, [])


def test_a_compressed_message_that_would_become_very_much_more_stays_as_it_is() -> None:
    most, compress = 2 * MIB, zstandard.ZstdCompressor().compress
    for data in (bytes(most), os.urandom(most + 1)):
        assert limits.plain(compress(data)) == data
    silent = zstandard.ZstdCompressor(write_content_size=False).compress(b'abc')
    for packed in (compress(bytes(most + 1)), silent, compress(b'abc')[:-1], b'\0\1\0\0abc'):
        assert limits.plain(packed) == packed


@pytest.mark.parametrize('size', [0, HUGE, 1 << 62])
@pytest.mark.usefixtures('little_memory')
def test_a_repair_is_not_blown_up_either(
    tmp_path: Path, size: int, capsys: pytest.CaptureFixture
) -> None:
    chunk = Chunk('zstd', zstd_bomb(HUGE, says=size > 0), 0, 0, 0, size)
    path = write_chunk(tmp_path / 'bag' / 'bag_0.mcap', chunk)
    with pytest.raises(SystemExit) as ended:
        main(['recover', str(path.parent)])
    assert ended.value.code == (2 if size == HUGE else 1)
    told = 'expected a chunk of at most' if size == HUGE else 'nothing in it can be recovered'
    assert told in capsys.readouterr().err
    assert os.listdir(path.parent) == ['bag_0.mcap']


def test_a_repair_keeps_what_stands_around_a_chunk_that_is_too_large(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, 'LARGEST_CHUNK', 1000)
    head = costly_bags.schema(1, 'x/Y') + costly_bags.channel(1, '/x')
    held = [head + costly_bags.message(1, k, bytes(size)) for k, size in enumerate((5, 999, 7))]
    path = tmp_path / 'bag_0.mcap'
    whole = costly_bags.file_of(*map(costly_bags.chunk, held))
    told = f'expected a chunk of at most 1000 bytes, found {len(held[1])}, decompressed'
    path.write_bytes(whole)
    with pytest.raises(InputError, match=rf'byte \d+: {told}; nothing else is wrong'):
        recover(tmp_path)
    assert [(one, one.read_bytes()) for one in tmp_path.iterdir()] == [(path, whole)]
    for data, said in (
        (whole[: -len(MAGIC)], 'was not finished'), (whole + b'xy', 'damaged: another end')
    ):  # fmt: skip
        path.write_bytes(data)
        old(path)
        (found,) = recover(tmp_path).document()['files']
        assert found['faults'] == [f'too large: {told}', said]
        assert found['messages'] == 2
        assert (tmp_path / found['kept_as']).read_bytes() == data


def test_a_repair_says_which_attachment_it_leaves_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, 'LARGEST_CHUNK', 80_000)
    held = costly_bags.schema(1, 'x/Y') + costly_bags.channel(1, '/x') + costly_bags.message(1)
    short, long = (record(Attachment(0, 0, f'{n}', '', b'x' * n)) for n in (70_000, 90_000))
    whole = costly_bags.file_of(short, long, costly_bags.chunk(held))
    path = tmp_path / 'bag_0.mcap'
    path.write_bytes(whole)
    assert recover(tmp_path).document()['files'][0]['state'] == 'healthy'
    assert path.read_bytes() == whole
    path.write_bytes(whole[: -len(MAGIC)])
    old(path)
    report = recover(tmp_path).document()
    said = ['was not finished', "attachment '90000' of 90000 bytes is left out"]
    assert report['files'][0]['faults'] == said
    assert (report['attachments'], report['messages']) == (['70000'], 1)


def test_a_record_that_is_too_large_is_no_damage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor is the one before it, which is believed by what follows it."""
    monkeypatch.setattr(limits, 'LARGEST_OTHER', 1000)
    small, large = (costly_bags.record(12, costly_bags.text('a') + bytes(n)) for n in (4, 1001))
    (tmp_path / 'bag_0.mcap').write_bytes(costly_bags.file_of(small, large, small))
    told = 'expected a record of at most 1000 bytes, found 1006; nothing else is wrong'
    with pytest.raises(InputError, match=told):
        recover(tmp_path)


@pytest.mark.parametrize('opcode', [3, 4, 5, 6, 7, 9, 12, 0x80])
@pytest.mark.parametrize('length', [1 << 31, (1 << 62) + 7, (1 << 64) - 1])
@pytest.mark.usefixtures('little_memory')
def test_lengths_that_no_file_has(tmp_path: Path, opcode: int, length: int) -> None:
    path = tmp_path / 'bag.mcap'
    head = MAGIC + record(Header('ros2', 'harm'))
    path.write_bytes(head + struct.pack('<BQ', opcode, length) + bytes(100))
    contents = read_bag(path)
    assert contents.counts == {}
    assert len(contents.notes) == 1


@pytest.mark.parametrize('opcode', [3, 4, 5, 7, 12, 0x80])
def test_records_that_are_too_long_are_refused(
    tmp_path: Path, opcode: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, 'LARGEST_OTHER', 1000)
    monkeypatch.setattr(limits, 'LARGEST_RECORD', dict.fromkeys(limits.LARGEST_RECORD, 1000))
    path = tmp_path / 'bag.mcap'
    head = MAGIC + record(Header('ros2', 'harm'))
    path.write_bytes(head + struct.pack('<BQ', opcode, 1001) + bytes(1001))
    text = f'byte {len(head)}: expected a record of at most 1000 bytes, found 1001'
    with pytest.raises(InputError, match=text):
        read_bag(path)
    path.write_bytes(head + struct.pack('<BQ', 0x80, 1000) + bytes(1000))
    assert 'was not finished' in read_bag(path).notes[0]


@pytest.mark.parametrize('kind', costly_bags.KINDS)
@pytest.mark.usefixtures('little_memory')
def test_small_files_of_very_many_records_cost_little(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture
) -> None:
    path = tmp_path / 'bag_0.mcap'
    path.write_bytes(costly_bags.KINDS[kind](1_000_000))
    for command in ('info', 'recover'):
        old(path)
        ended = 0
        try:
            main([command, str(path)])
        except SystemExit as error:
            ended = int(error.code or 0)
        said = capsys.readouterr().err.splitlines()
        assert ended in (0, 1, 2)
        assert ended == 0 or len(said) == 1
        if ended == 2:
            assert ': expected at most' in said[0]


@pytest.mark.parametrize('indexed', [True, False])
def test_a_long_recording_of_small_messages_is_no_hostile_one(indexed: bool) -> None:
    messages = 36_000_000  # ten topics at 1 kHz for an hour
    counts = limits.Counts(messages * (16 + 4 if indexed else 4))  # bytes of index and payload
    for _ in range(messages // 1_500_000):  # chunks of 64 MiB
        counts.take(1_500_000, 100_000)


def test_what_a_file_may_hold_grows_with_its_size() -> None:
    counts = limits.Counts(1000)
    counts.take((1 << 17) + 900, 16 * MIB + 7990)
    assert counts.most == 100
    counts.take(100, 10)
    for more, text in (((1, 0), '132072 records'), ((0, 1), '16785216 bytes of definitions')):
        with pytest.raises(limits.TooManyError, match=f'at most {text} in a file'):
            counts.take(*more)
    large = limits.Counts(1 << 30)
    assert large.most == 1 << 21
    large.take(1 << 21, 0)
    with pytest.raises(limits.TooManyError, match='a chunk of at most 2097152 records'):
        large.take((1 << 21) + 1, 0)


def test_names_are_counted_once_and_by_their_kinds() -> None:
    counts, most = limits.Counts(0), 10_000
    kinds = {
        'Attachment': lambda i: Attachment(0, 0, f'{i}', '', b''),
        'Metadata': lambda i: Metadata(f'{i}', {}),
        'Schema': lambda i: Schema(i, b'', '', 'x'),
        'Channel': lambda i: Channel(i, '/x', '', {}, 1),
    }
    for i in range(most):
        for make in kinds.values():
            counts.note(make(i))
        counts.note(Message(1, 0, b'', 0, 0))
        counts.note(Channel(7, '/x', '', {}, 1))
    for kind, make in kinds.items():
        with pytest.raises(limits.TooManyError, match=f'at most {most} records of the kind {kind}'):
            counts.note(make(most))


def test_a_chunk_is_its_tables_and_definitions_in_their_order() -> None:
    schema, channels = Schema(1, b'x', '', 'X'), [Channel(i, '/x', '', {}, 1) for i in (1, 2)]
    other = struct.pack('<BQ', 0x80, 5) + bytes(5)  # of a kind that nobody knows
    sent = [record(Message(i % 2 + 1, 9 - i, b'abc'[:i], 10 + i, i)) for i in range(4)]
    head = [record(schema), record(channels[0])]
    parts = [*head, *sent[:3], other, record(channels[1]), sent[3]]
    taken = list[tuple[int, int]]()
    noted = list[object]()
    counts = SimpleNamespace(most=9, take=lambda *told: taken.append(told), note=noted.append)
    first, second, table, third, last = chunks.contents_of(b''.join(parts), counts)
    assert (first, second, third) == (schema, *channels)
    assert noted == [schema, *channels]
    assert taken == [(8, sum(map(len, [*head, other, record(channels[1])])))]
    assert [table.payload(i) for i in range(3)] == [b'', b'a', b'ab']
    assert (last.payload(0), last.log_times.tolist()) == (b'abc', [6])
    assert (table.channels.tolist(), table.sequences.tolist()) == ([1, 2, 1], [0, 1, 2])
    assert table.publish_times.tolist() == [10, 11, 12]
    assert table.log_times.tolist() == [9, 8, 7]


def test_a_schema_that_cannot_be_parsed_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    parts = costly_bags.schema(1, remark='\n=====5====='), costly_bags.channel(1, '/odom')
    data = costly_bags.file_of(*parts, costly_bags.message(1))
    (tmp_path / 'bag.mcap').write_bytes(data)
    with pytest.raises(SystemExit) as ended:
        main(['analyze', str(tmp_path / 'bag.mcap')])
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert '/odom: expected a schema of its type' in line


def test_strings_that_reach_beyond_their_record(tmp_path: Path) -> None:
    channel = bytearray(record(Channel(1, '/a', 'cdr', {}, 0)))
    struct.pack_into('<I', channel, 13, 0xFFFFFFFF)
    path = tmp_path / 'bag.mcap'
    path.write_bytes(MAGIC + record(Header('ros2', 'harm')) + channel + bytes(100))
    assert 'damaged from byte' in read_bag(path).notes[0]


@pytest.mark.parametrize('data', [b'\1\0', b'\3\0\0\0ab', b'\xff\xff\xff\xff'])
def test_a_text_that_is_longer_than_its_record_is_damage(data: bytes) -> None:
    with pytest.raises(McapError, match='shorter than its fields'):
        Body(data).read_prefixed_string()
    with pytest.raises(McapError, match='shorter than its fields'):
        Body(data).read(len(data) + 1)
    assert Body(b'\2\0\0\0abc').read_prefixed_string() == 'ab'


def test_attachments_that_are_too_long_or_too_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, 'LARGEST_ATTACHMENT', 100_000)
    sizes = [('long', 200_000), ('first', 60_000), ('second', 30_000), ('third', 30_000),
             ('first', 61_000)]  # fmt: skip
    items = [Attachment(0, 0, name, '', b'x' * size) for name, size in sizes]
    path = tmp_path / 'bag' / 'bag_0.mcap'
    path.parent.mkdir()
    schema, channel = (
        Schema(1, b'string data\n', 'ros2msg', 'std_msgs/msg/String'),
        Channel(1, '/a', 'cdr', {}, 1),
    )
    rest = [schema, channel, Message(1, 0, b'\0\1\0\0\0\0\0\0', 0, 0)]
    data = MAGIC + b''.join(map(record, [Header('ros2', 'harm'), *items, *rest]))
    ending = record(DataEnd(zlib.crc32(data))) + record(Footer(0, 0, 0)) + MAGIC
    path.write_bytes(data + ending)
    sizes = [('second', 30_000), ('more', 9000), ('last', 1001)]
    more = [Attachment(0, 0, name, '', b'x' * size) for name, size in sizes]
    data = MAGIC + b''.join(map(record, [Header('ros2', 'harm'), *more]))
    path.with_name('bag_1.mcap').write_bytes(data + record(DataEnd(0)) + record(Footer(0, 0, 0)))
    contents = read_bag(path.parent)
    assert {name: len(text) for name, text in contents.attachments.items()} == {
        'first': 61_000, 'second': 30_000, 'more': 9000
    }  # fmt: skip
    assert contents.counts == {'/a': 1}
    long, third, last = contents.notes
    assert "attachment 'long' of 200000 bytes not read" in long
    assert "attachment 'third' not read, they are too many" in third
    assert "attachment 'last' not read" in last


def hostile(folder: Path, *, scenario: str = 'case1', bag: str = 'gvc') -> Path:
    """A bag whose parameters and attachments name paths."""
    case = load_scenario('case1')
    parameters = node_parameters(case, 'gvc', bag=Path(bag))
    texts = dict(case.attachments)
    texts['scenario.yaml'] = texts['scenario.yaml'].replace('name: case1', f'name: {scenario}')
    texts['params.yaml'] = parameter_file(parameters, 'harm')
    for name in ('../escape.yaml', '/escape.yaml', '../../summary.json', 'a/../../escape'):
        texts[name] = 'harm: 1\n'
    writer = BagWriter(folder, texts)
    for topic, kind in (
        ('/odom', 'nav_msgs/msg/Odometry'), ('/wrench', 'geometry_msgs/msg/WrenchStamped'),
    ):  # fmt: skip
        text = TYPES.generate_msgdef(kind, ros_version=2)[0]
        writer.add_channel(Definition(topic, kind, digest=TYPES.hash_rihs01(kind)), text)
    for k in range(20):
        ns = k * 10_000_000
        writer.write('/odom', ns, serialized(odometry(ns, UPRIGHT)))
        writer.write('/wrench', ns, serialized(stamped('Wrench', ns, [0.0] * 6)))
    writer.close()
    return folder


@pytest.mark.parametrize('name', ['..', '/'])
@pytest.mark.usefixtures('undrawn')
def test_nothing_is_written_outside_of_the_folder_of_the_results(tmp_path: Path, name: str) -> None:
    bag = hostile(tmp_path / 'deep' / 'bag', bag=name)
    before = {p: p.stat().st_mtime_ns for p in tmp_path.rglob('*')}
    out = tmp_path / 'deep' / 'out'
    main(['analyze', str(bag), '--out', str(out)])
    new = {p for p in tmp_path.rglob('*') if before.get(p) != p.stat().st_mtime_ns}
    assert all(p.is_relative_to(out) or p == out.parent for p in new), new
    assert not Path('/escape.yaml').exists()


@pytest.mark.parametrize('name', ['../x', '/etc', '..', 'a/b', "'x\\ny'"])
def test_a_scenario_whose_name_is_a_path_is_refused(tmp_path: Path, name: str) -> None:
    bag = hostile(tmp_path / 'bag', scenario=name)
    with pytest.raises(InputError, match='expected a word without blanks or slashes'):
        load_run(bag)


LAUGHS = 'a: &a [{0}]\n' + ''.join(
    f'{chr(98 + i)}: &{chr(98 + i)} [{",".join(f"*{chr(97 + i)}" for _ in range(9))}]\n'
    for i in range(14)
)  # fmt: skip


@pytest.fixture(scope='module')
def usual(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, BagContents]:
    bag = hostile(tmp_path_factory.mktemp('usual') / 'bag')
    return bag, read_bag(bag)


@pytest.mark.parametrize(
    ('name', 'inner'),
    [
        *(('params.yaml', inner) for inner in ('x,x,x', '', '[]', '{}', '!!pairs [a: b]')),
        ('scenario.yaml', ''), ('vehicle.yaml', ''),
    ],
)  # fmt: skip
def test_attached_yaml_whose_aliases_explode(
    usual: tuple[Path, BagContents], name: str, inner: str
) -> None:
    bag, contents = usual
    texts = {**load_scenario('case1').attachments, 'params.yaml': '{}', name: LAUGHS.format(inner)}
    contents = replace(contents, attachments={**contents.attachments, **texts})
    reading = {
        'params.yaml': attachments.parameters_of,
        'scenario.yaml': attachments.scenario_of,
        'vehicle.yaml': lambda c, b: attachments.vehicle_of(c, b, None),
    }
    with pytest.raises(InputError, match='at most 100000 entries with all aliases written out'):
        reading[name](contents, bag)


def test_attached_yaml_that_is_too_long(usual: tuple[Path, BagContents]) -> None:
    bag, contents = usual
    contents = replace(contents, attachments={'params.yaml': 'a: ' + 'x' * (5 << 20)})
    with pytest.raises(InputError, match='YAML of at most 4194304 characters'):
        attachments.parameters_of(contents, bag)


def linked(bag: Path) -> None:
    outside = bag.parent / 'outside.mcap'
    (bag / 'bag_0.mcap').rename(outside)
    (bag / 'bag_0.mcap').symlink_to(outside)


def piped(bag: Path) -> None:
    os.mkfifo(bag / 'bag_1.mcap')


@pytest.mark.parametrize('harm', [linked, piped])
def test_files_of_a_folder_that_are_none_of_its_own(
    tmp_path: Path, harm: Callable[[Path], None]
) -> None:
    bag = hostile(tmp_path / 'bag')
    harm(bag)
    with pytest.raises(InputError, match=r'a link to|something else of that name'):
        metadata.bag_files(bag)


METADATA = {
    'version': 5, 'storage_identifier': 'sqlite3', 'relative_file_paths': ['bag_0.db3'],
    'duration': {'nanoseconds': 0}, 'starting_time': {'nanoseconds_since_epoch': 0},
    'message_count': 0, 'topics_with_message_count': [], 'compression_format': '',
    'compression_mode': '',
}  # fmt: skip


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'relative_file_paths': ['../../secret.db3']}, 'names of files in the folder of the bag'),
        ({'relative_file_paths': ['/etc/passwd']}, 'names of files in the folder of the bag'),
        ({'relative_file_paths': 'bag_0.db3'}, 'a list of files'),
        ({'relative_file_paths': [7]}, 'names of files in the folder of the bag'),
        ({'relative_file_paths': ['link.db3']}, 'a link to'),
        ({'compression_mode': 'FILE', 'compression_format': 'zstd'}, 'a zstd file that says'),
    ],
)
def test_a_metadata_yaml_that_leads_elsewhere(
    tmp_path: Path, change: dict, words: str, capsys: pytest.CaptureFixture
) -> None:
    bag = tmp_path / 'bag'
    bag.mkdir()
    head = zstd_bomb(HUGE, says=False)
    (bag / 'bag_0.db3').write_bytes(head)
    (bag / 'link.db3').symlink_to(tmp_path / 'secret.db3')
    (tmp_path / 'secret.db3').write_bytes(b'secret')
    text = yaml.safe_dump({'rosbag2_bagfile_information': {**METADATA, **change}})
    (bag / 'metadata.yaml').write_text(text)
    with pytest.raises(SystemExit) as ended:
        main(['info', str(bag)])
    assert ended.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert words in lines[0]


def test_a_metadata_yaml_of_sqlite_whose_aliases_explode(tmp_path: Path) -> None:
    (tmp_path / 'bag_0.db3').write_bytes(b'')
    (tmp_path / 'metadata.yaml').write_text(LAUGHS.format(''))
    with pytest.raises(InputError, match='with all aliases written out'):
        survey(tmp_path)


def test_a_chunk_ends_with_its_last_record_unless_there_are_more_than_are_looked_at() -> None:
    record = chunks.PREFIX.pack(5, 3) + b'abc'
    cut = 3 * record + record[:-1]
    assert chunks._places(cut, 2).tolist() == [0, 12, 24]
    for most in (4, 9):
        with pytest.raises(McapError, match='ends within a record'):
            chunks._places(cut, most)
    assert chunks._places(3 * record, 3).tolist() == [0, 12, 24]
