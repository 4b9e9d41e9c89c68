"""`auv recover`: all that its checksums confirm is kept, nothing else; twice is as good as once."""

import json
import os
import stat
import struct
import tempfile
import zlib
from collections import Counter
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from helpers.damaged_bags import (
    attachments_of,
    hoped_for,
    messages_of,
    old,
    places,
    seen_by_rosbags,
    write_bag,
)
from helpers.made_messages import COMPRESSIONS, STRING, TYPES, Bag, serialized
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Metadata,
    Schema,
    Statistics,
)
from mcap.stream_reader import breakup_chunk
from mcap.writer import Writer

from auv_analysis.bag import limits, mcap_file
from auv_analysis.bag import recover as recovery
from auv_analysis.bag.mcap_file import MAGIC
from auv_analysis.bag.reading import read_bag
from auv_analysis.bag.recover import recover
from auv_dynamics.files.errors import FailedError, InputError

STEP = 10_000_000
OPTIONS = st.fixed_dictionaries({
    'chunk_size': st.sampled_from([1, 300, 3000]),
    'compression': st.sampled_from(list(COMPRESSIONS.values())),
    'use_chunking': st.sampled_from([True, True, False]),
    'index': st.booleans(),
    'enable_crcs': st.booleans(),
    'enable_data_crcs': st.booleans(),
    'use_statistics': st.booleans(),
})  # fmt: skip


@pytest.fixture(autouse=True)
def _no_waiting_for_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, 'fsync', lambda _: None)


@cache
def whole() -> bytes:
    """A file of our recorder."""
    with tempfile.TemporaryDirectory() as root:
        return (write_bag(Path(root) / 'bag') / 'bag_0.mcap').read_bytes()


def put(folder: Path, data: bytes, name: str = 'bag_0.mcap') -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)
    return old(folder / name)


def recovered(
    data: bytes, *, checked: bool = True
) -> tuple[list, list[str], dict[str, Any]] | Exception:
    """Messages, attachments and report of these bytes; a second repair changes nothing.

    `checked`: rosbags sees the same, which takes most of the time.
    """
    with tempfile.TemporaryDirectory() as root:
        path = put(Path(root) / 'bag', data)
        path.chmod(0o666)  # which a umask takes from new files
        try:
            document = recover(path.parent).document()
        except (InputError, FailedError) as error:
            assert path.read_bytes() == data, 'left as it was'
            assert sorted(os.listdir(path.parent)) == ['bag_0.mcap']
            return error
        if document['files'][0]['state'] == 'repaired':
            assert path.with_name('bag_0.mcap.damaged').read_bytes() == data
        else:
            assert path.read_bytes() == data
        assert stat.S_IMODE(path.stat().st_mode) == 0o666
        before = states(path.parent)
        assert recover(path.parent).document()['changed'] is False
        assert states(path.parent) == before
        json.dumps(document, allow_nan=False)
        rows = messages_of(path)
        assert read_bag(path.parent, decode=False).notes == []
        if checked and document['files'][0]['kept_as'] and document['metadata'] != 'none':
            assert seen_by_rosbags(path.parent) == Counter(rows)
        return rows, [name for name, _ in attachments_of(path)], document


def states(folder: Path) -> dict[str, tuple]:
    return {
        p.name: (p.read_bytes(), p.stat().st_mtime_ns, p.stat().st_ino) for p in folder.iterdir()
    }


def check_cut(data: bytes, size: int, *, checked: bool = False) -> None:
    rows, names = hoped_for(data, lambda begin, end: end > size)
    result = recovered(data[:size], checked=checked)
    if not rows and not names:
        assert isinstance(result, FailedError), (size, result)
        assert 'nothing in it can be recovered' in str(result)
    else:
        assert not isinstance(result, Exception), (size, result)
        assert (result[0], result[1]) == (rows, names), size
        assert result[2]['changed'] == (size < len(data) or result[2]['metadata'] == 'written')


@given(share=st.floats(0, 1, exclude_max=True))
@examples(8)
def test_a_bag_that_is_cut_anywhere(share: float) -> None:
    check_cut(whole(), int(share * len(whole())), checked=True)


def test_a_bag_that_is_cut_around_every_record() -> None:
    ends = {end for _, end, _ in places(whole())}
    for size in sorted({n + d for n in ends for d in (-1, 0)})[::19]:
        check_cut(whole(), size)


@pytest.mark.long
def test_a_bag_that_is_cut_at_every_byte() -> None:
    for size in range(len(whole())):
        check_cut(whole(), size)


def check_flip(data: bytes, place: int, mask: int, *, checked: bool = False) -> None:
    """One flipped bit costs no more than the record that it is in."""
    broken = bytearray(data)
    broken[place] ^= mask
    rows, names = hoped_for(data, lambda begin, end: begin <= place < end)
    result = recovered(bytes(broken), checked=checked)
    assert not isinstance(result, Exception), (place, result)
    kept = Counter(result[0])
    assert not Counter(rows) - kept, (place, 'lost more than was damaged')
    every, all_names = hoped_for(data, lambda begin, end: False)
    assert not kept - Counter(every), (place, 'invented')
    assert set(names) <= set(result[1]) <= set(all_names), place


@given(share=st.floats(0, 1, exclude_max=True), mask=st.integers(1, 255))
@examples(8)
def test_one_damaged_byte_costs_its_record_alone(share: float, mask: int) -> None:
    check_flip(whole(), int(share * len(whole())), mask, checked=True)


def test_damage_in_the_head_of_every_record() -> None:
    for begin, _, _ in places(whole())[::19]:
        for place, mask in ((begin, 0x81), (begin + 1, 0x10), (begin + 4, 0x01)):
            check_flip(whole(), place, mask)


@pytest.mark.long
def test_every_damaged_byte_costs_its_record_alone() -> None:
    for place in range(len(whole())):
        check_flip(whole(), place, 0x55)


@st.composite
def foreign_bags(draw: st.DrawFn, **fixed: Any) -> bytes:
    """A file of the mcap package's writer, with whatever options."""
    options = {**draw(OPTIONS), **fixed}
    with tempfile.TemporaryDirectory() as root:
        bag = Bag(Path(root) / 'bag.mcap', **options)
        bag.attach('note.txt', 'by hand')
        for k in range(draw(st.integers(0, 12))):
            text = 'x' * draw(st.integers(0, 40))
            data = serialized(TYPES.types[STRING](text))
            bag.add(draw(st.sampled_from(['/a', '/b'])), STRING, k * STEP, data)
        return bag.close().read_bytes()


@given(data=foreign_bags(), share=st.floats(0, 1))
@examples(8)
def test_bags_of_other_writers_that_are_cut(data: bytes, share: float) -> None:
    """Every record of which all bytes are there; without checksums as well."""
    size = int(share * len(data))
    rows, names = hoped_for(data, lambda begin, end: end > size)
    result = recovered(data[:size])
    if isinstance(result, Exception):
        assert not names, result
        return
    assert (result[0], result[1]) == (rows, names)
    assert size < len(data) or result[2]['files'][0]['state'] == 'healthy'


@given(
    data=foreign_bags(enable_crcs=True),
    flips=st.lists(st.tuples(st.floats(0, 1), st.integers(1, 255)), max_size=4),
)
@examples(8)
def test_bags_of_other_writers_with_damaged_bytes(data: bytes, flips: list) -> None:
    """Whatever comes out can be read by others, and is not damaged any more."""
    broken = bytearray(data)
    for share, mask in flips:
        broken[min(int(share * len(data)), len(data) - 1)] ^= mask
    recovered(bytes(broken), checked=False)


def bytes_of(*records: Any) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()


def plain_chunk(data: bytes, **more: Any) -> Chunk:
    """A chunk that is not compressed."""
    about = {'compression': '', 'data': data, 'uncompressed_size': len(data)}
    times = {'message_start_time': 0, 'message_end_time': 0}
    return Chunk(**{**about, **times, 'uncompressed_crc': zlib.crc32(data), **more})


def file_of(*parts: bytes) -> bytes:
    """A finished file."""
    begin, end = bytes_of(Header('ros2', 'test')), bytes_of(DataEnd(0), Footer(0, 0, 0))
    return b''.join([MAGIC, begin, *parts, end, MAGIC])


DEFINED = bytes_of(Schema(1, b'string data\n', 'ros2msg', STRING), Channel(1, '/a', 'cdr', {}, 1))


def said(k: int, data: bytes) -> Message:
    return Message(channel_id=1, data=data, log_time=k, publish_time=k, sequence=k)


def losses(document: dict[str, Any]) -> list[tuple[int, int]]:
    (file,) = document['files']
    return [(lost['from'], lost['to']) for lost in file['lost']]


@pytest.mark.parametrize(
    ('tail', 'lost', 'is_noted'),
    [
        (MAGIC, [], False),
        (b'', [], False),
        (MAGIC[:3], [(0, 3)], False),
        (MAGIC + b'xy', [(8, 10)], False),
        (b'xyz', [(0, 3)], True),
        (MAGIC[:-1] + b'x', [(0, 8)], True),
        (MAGIC[:-1] + b'xyz', [(-29, 10)], True),  # it need not be the footer then
    ],
)
def test_what_stands_behind_the_footer(
    tail: bytes, lost: list, is_noted: bool, tmp_path: Path
) -> None:
    end = len(whole()) - len(MAGIC)
    data = whole()[:end] + tail
    rows, names, document = recovered(data)
    assert (rows, names) == hoped_for(whole(), lambda *_: False)
    assert [(begin - end, behind - end) for begin, behind in losses(document)] == lost
    (file,) = document['files']
    assert file['state'] == ('healthy' if tail == MAGIC else 'repaired')
    assert ('was not finished' in file['faults']) == (tail[:8] != MAGIC)
    notes = read_bag(put(tmp_path, data), decode=False).notes
    assert notes == [f'bag_0.mcap: damaged from byte {end}, read up to there'] * is_noted


def test_a_damaged_beginning_costs_the_header_alone(tmp_path: Path) -> None:
    rows, names, document = recovered(b'X' + whole()[1:])
    first = next(begin for begin, _, record in places(whole()) if isinstance(record, Attachment))
    assert (rows, names) == hoped_for(whole(), lambda *_: False)
    assert losses(document) == [(0, first)]
    (file,) = document['files']
    assert file['faults'] == ['damaged: another beginning', 'has no header']
    path = put(tmp_path / 'bag', b'X' + whole()[1:])
    recover(path.parent)
    with path.open('rb') as stream:
        assert make_reader(stream).get_header() == Header('ros2', 'auv_gvc recovery')


def test_a_damaged_length_takes_no_chunk_along() -> None:
    """It leads into a chunk, to bytes that look like a record."""
    lure = b'\x80' + struct.pack('<Q', 2) + b'ab\0'
    chunk = bytes_of(plain_chunk(DEFINED + bytes_of(said(1, b'one'), said(2, lure))))
    mine = bytearray(bytes_of(Metadata('mine', {'a': '1'})))
    struct.pack_into('<Q', mine, 1, len(mine) - 9 + chunk.index(lure))
    attached = bytes_of(Attachment(0, 0, 'note.txt', '', b'by hand'))
    data = file_of(attached, mine, chunk)
    rows, names, document = recovered(data)
    assert (rows, names) == ([('/a', 1, b'one'), ('/a', 2, lure)], ['note.txt'])
    assert losses(document) == [(data.index(mine), data.index(chunk))]


def test_messages_of_a_chunk_are_not_believed_without_its_checksum() -> None:
    """Where its damaged length ends between two of them."""
    chunks = [
        bytes_of(plain_chunk(DEFINED * (k == 0) + bytes_of(said(k, b'a'), said(k + 3, b'bc'))))
        for k in range(3)
    ]
    broken = bytearray(chunks[1])
    struct.pack_into('<Q', broken, 1, len(broken) - 9 - len(bytes_of(said(4, b'bc'))))
    rows, _, document = recovered(file_of(chunks[0], broken, chunks[2]))
    assert [(ns, data) for _, ns, data in rows] == [(0, b'a'), (3, b'bc'), (2, b'a'), (5, b'bc')]
    (file,) = document['files']
    assert 'damaged: a message between chunks' in file['faults']


def test_without_chunks_a_damaged_message_costs_itself_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that is shorter than its fields, amid others, one of which is empty."""
    short = b'\x05' + struct.pack('<Q', 21) + bytes(21)
    before, behind = bytes_of(said(1, b'')), bytes_of(said(2, b'two'))
    data = file_of(DEFINED, before, short, behind)
    rows, _, document = recovered(data)
    assert rows == [('/a', 1, b''), ('/a', 2, b'two')]
    assert losses(document) == [(data.index(short), data.index(behind))]
    path = put(tmp_path / 'bag', data)
    monkeypatch.setattr(recovery, 'CHUNK_SIZE', 1)
    recover(path.parent)
    with path.open('rb') as stream:
        indexes = make_reader(stream).get_summary().chunk_indexes
    assert [index.compression for index in indexes] == ['zstd', 'zstd']
    _, _, document = recovered(file_of(bytes_of(plain_chunk(DEFINED + before))))
    assert (document['messages'], document['files'][0]['state']) == (1, 'healthy')


def test_a_message_is_not_believed_where_no_record_follows() -> None:
    """Its length leads into the data of the next one, to zeros."""
    sent = [
        bytearray(bytes_of(said(k, data))) for k, data in ((1, b'abc'), (2, b''), (3, bytes(20)))
    ]
    struct.pack_into('<Q', sent[1], 1, len(sent[1]) - 9 + len(sent[2]) - 18)
    data = file_of(DEFINED, *sent)
    rows, _, document = recovered(data)
    assert rows == [('/a', 1, b'abc')]
    assert losses(document) == [(data.index(sent[1]), len(data))]


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_the_next_chunk_is_found_wherever_it_begins(
    compression: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Also in the last byte of what is searched at once; and the last one that was not cut."""
    bag = Bag(tmp_path / 'bag.mcap', chunk_size=1, compression=COMPRESSIONS[compression])
    for k in range(4):
        bag.add('/a', STRING, k * STEP, serialized(TYPES.types[STRING]('x' * (90 + k))))
    data = bytearray(bag.close().read_bytes())
    rows, _ = hoped_for(bytes(data), lambda *_: False)
    chunks = [one for one in places(bytes(data)) if isinstance(one[2], Chunk)]
    del data[chunks[3][1] :]
    data[chunks[2][0] + 4] = 1  # its length: 16 MiB
    apart = chunks[3][0] - chunks[1][1]
    for window in (40, apart, apart + 1):
        monkeypatch.setattr(mcap_file, 'WINDOW', window)
        found, _, document = recovered(bytes(data), checked=False)
        assert found == [*rows[:2], rows[3]], window
        assert losses(document) == [(chunks[2][0], chunks[3][0])]


def test_the_search_behind_damage_has_an_end() -> None:
    """What is looked into in vain is at most eight bytes per byte of the file, and a MiB."""
    inside = [DEFINED + bytes_of(said(k, b'x')) for k in (1, 2)]
    first, last = (bytes_of(plain_chunk(data)) for data in inside)

    def with_lure(size: int) -> tuple[bytes, bytes]:
        lure = bytes_of(plain_chunk(bytes(4), compression='zstd', uncompressed_size=size))
        return lure, file_of(first, b'\0', lure, last)

    lure, data = with_lure(0)
    bodies = len(lure) - 9 + len(last) - 9
    most = 8 * len(data) + (1 << 20) - bodies - len(inside[1])
    for size, kept in ((most, [1, 2]), (most + 1, [1])):
        rows, _, _ = recovered(with_lure(size)[1], checked=False)
        assert [ns for _, ns, _ in rows] == kept


def test_what_only_looks_like_a_chunk_at_the_end_is_none() -> None:
    cut = [begin for begin, _, record in places(whole()) if isinstance(record, Chunk)][3]
    rows, _ = hoped_for(whole(), lambda _, end: end > cut)
    damaged = whole()[:cut] + b'\0\x06' + bytes(8)
    found, _, document = recovered(damaged)
    assert (found, losses(document)[-1][1]) == (rows, len(damaged))


def test_an_attachment_of_nothing_is_found_behind_damage() -> None:
    first, empty = (bytes_of(Attachment(0, 0, name, '', b'')) for name in ('first', ''))
    data = bytearray(file_of(first, empty, bytes_of(plain_chunk(DEFINED))))
    data[data.index(first)] = 0
    assert recovered(bytes(data), checked=False)[1] == ['']


@pytest.mark.parametrize(
    ('kind', 'place', 'mask', 'crcs', 'fault'),
    [
        (MessageIndex, -1, 1, True, 'the data is not what its checksum says'),
        (Statistics, 9, 0x40, True, 'the summary is not what its checksum says'),  # its messages
        (Footer, 9, 0x01, False, 'the summary is not what its checksum says'),  # where it begins
    ],
)
def test_damage_that_a_checksum_of_many_records_shows(
    kind: type, place: int, mask: int, crcs: bool, fault: str, tmp_path: Path
) -> None:
    bag = Bag(tmp_path / 'bag' / 'bag_0.mcap', enable_crcs=crcs, enable_data_crcs=True)
    for k in range(3):
        bag.add('/a', STRING, k, serialized(TYPES.types[STRING]('x' * k)))
    data = bytearray(bag.close().read_bytes())
    begin, end = next(one[:2] for one in places(bytes(data)) if isinstance(one[2], kind))
    data[begin + place if place >= 0 else end + place] ^= mask
    rows, _, document = recovered(bytes(data))
    assert len(rows) == 3
    assert [file['faults'] for file in document['files']] == [[fault]]
    assert document['messages_lost'] == 0
    if kind is MessageIndex:
        stop = next(one[0] for one in places(bytes(data)) if isinstance(one[2], DataEnd))
        bag.path.write_bytes(data)
        notes = read_bag(bag.path.parent, decode=False).notes
        assert notes == [f'bag_0.mcap: damaged from byte {stop}, read up to there']


@pytest.mark.parametrize(
    ('use_chunking', 'which', 'said'),
    [
        (True, 0, ['/odom is defined twice']),
        (True, -1, ['the summary is not what its checksum says', '/odor is defined twice']),
        (False, 0, ['/odom is defined twice']),
    ],
)
def test_a_topic_is_called_as_the_best_checksum_says(
    use_chunking: bool, which: int, said: list[str], tmp_path: Path
) -> None:
    """That of its chunk, else that of the summary."""
    data = whole()
    if not use_chunking:
        bag = Bag(tmp_path / 'bag.mcap', use_chunking=False)
        bag.add('/odom', STRING, 5, serialized(TYPES.types[STRING]('x')))
        data = bag.close().read_bytes()
    rows, _ = hoped_for(data, lambda *_: False)
    named = [
        begin for begin, _, record in places(data)
        if isinstance(record, Channel) and record.topic == '/odom'
    ]  # fmt: skip
    place = data.index(b'/odom', named[which])
    broken = data[:place] + b'/odor' + data[place + 5 :]
    found, _, document = recovered(broken)
    assert found == rows
    assert [file['faults'] for file in document['files']] == [said]


def test_a_bag_of_ros_says_so_in_its_header() -> None:
    data = whole().replace(b'ros2', b'ros1', 1)
    _, _, document = recovered(data)
    (file,) = document['files']
    assert (file['state'], file['faults']) == (
        'repaired', ['has another profile than rosbag2 writes']
    )  # fmt: skip


def test_messages_of_a_lost_chunk_are_counted_by_its_index() -> None:
    data, chunks = bytearray(whole()), [
        one for one in places(whole()) if isinstance(one[2], Chunk)
    ]  # fmt: skip
    begin, end, chunk = chunks[4]
    data[(begin + end) // 2] ^= 1
    _, _, document = recovered(bytes(data[: chunks[6][0] + 20]))
    held = [record for record in breakup_chunk(chunk) if isinstance(record, Message)]
    assert document['messages_lost'] == len(held)


def test_all_of_a_record_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Times, media type, sequence and metadata of other programs; and the compression."""
    monkeypatch.setattr(limits, 'LARGEST_ATTACHMENT', 10)  # of one that is read
    monkeypatch.setattr(mcap_file, 'LONG_HEAD', 40)
    lz4 = COMPRESSIONS['lz4']
    bag = Bag(tmp_path / 'whole' / 'bag_0.mcap', chunk_size=300, compression=lz4)
    writer, data = bag._writer, serialized(TYPES.types[STRING]('y' * 40))
    channel = bag.channel('/x', STRING)
    bag.channel('/silent', STRING)
    for value in ('1', '2', '1'):
        writer.add_metadata('mine', {'a': value})
    writer.add_attachment(7, 9, 'a', 'text/x', b'1')
    for k in range(60):
        writer.add_message(channel, k, data, k + 5, 100 + k)
    whole = bag.close().read_bytes()
    recover(put(tmp_path / 'cut', whole[: len(whole) // 2]).parent)
    with (tmp_path / 'cut' / 'bag_0.mcap').open('rb') as file:
        reader = make_reader(file)
        assert reader.get_header() == make_reader(BytesIO(whole)).get_header()
        rows = [(m.log_time, m.publish_time, m.sequence) for *_, m in reader.iter_messages()]
        assert rows == [(k, k + 5, 100 + k) for k in range(len(rows))]
        assert len(rows) > 5
        (one,) = reader.iter_attachments()
        assert (one.log_time, one.create_time, one.name, one.media_type) == (9, 7, 'a', 'text/x')
        mine = [m.metadata for m in reader.iter_metadata() if m.name == 'mine']
        assert mine == [{'a': '1'}, {'a': '2'}], 'each once'
        assert {c.compression for c in reader.get_summary().chunk_indexes} == {'lz4'}
        assert {c.topic for c in reader.get_summary().channels.values()} == {'/x', '/silent'}


def test_messages_within_and_without_chunks_are_healthy(tmp_path: Path) -> None:
    path = tmp_path / 'mixed.mcap'
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=1 << 20)
        writer.start()
        channel = writer.register_channel('/a', 'json', 0)
        for k in range(4):
            writer.add_message(channel, k, b'{}', k, k)
        writer._Writer__finalize_chunk()
        for k in range(4, 8):
            builder = RecordBuilder()
            Message(channel_id=channel, data=b'{}', log_time=k, publish_time=k, sequence=k).write(
                builder
            )
            file.write(builder.end())
        writer.finish()
    _, _, document = recovered(path.read_bytes())
    assert document['files'][0]['state'] == 'healthy'
