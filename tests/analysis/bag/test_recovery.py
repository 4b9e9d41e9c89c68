"""`auv recover`: all that its checksums confirm is kept, nothing else; twice is as good as once."""

import json
import os
import stat
import tempfile
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
from mcap.records import Message
from mcap.writer import Writer

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
    """Messages, attachments and report of these bytes; a second repair changes nothing."""
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


def check_cut(data: bytes, size: int) -> None:
    rows, names = hoped_for(data, lambda begin, end: end > size)
    result = recovered(data[:size])
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
    check_cut(whole(), int(share * len(whole())))


def test_a_bag_that_is_cut_around_every_record() -> None:
    ends = {end for _, end, _ in places(whole())}
    for size in sorted({n + d for n in ends for d in (-1, 0)})[::19]:
        check_cut(whole(), size)


@pytest.mark.long
def test_a_bag_that_is_cut_at_every_byte() -> None:
    for size in range(len(whole())):
        check_cut(whole(), size)


def check_flip(data: bytes, place: int, mask: int) -> None:
    """One flipped bit costs no more than the record that it is in."""
    broken = bytearray(data)
    broken[place] ^= mask
    rows, names = hoped_for(data, lambda begin, end: begin <= place < end)
    result = recovered(bytes(broken))
    assert not isinstance(result, Exception), (place, result)
    kept = Counter(result[0])
    assert not Counter(rows) - kept, (place, 'lost more than was damaged')
    every, all_names = hoped_for(data, lambda begin, end: False)
    assert not kept - Counter(every), (place, 'invented')
    assert set(names) <= set(result[1]) <= set(all_names), place


@given(share=st.floats(0, 1, exclude_max=True), mask=st.integers(1, 255))
@examples(8)
def test_one_damaged_byte_costs_its_record_alone(share: float, mask: int) -> None:
    check_flip(whole(), int(share * len(whole())), mask)


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


def test_all_of_a_record_is_kept(tmp_path: Path) -> None:
    """Times, media type, sequence and metadata of other programs; and the compression."""
    lz4 = COMPRESSIONS['lz4']
    bag = Bag(tmp_path / 'whole' / 'bag_0.mcap', chunk_size=300, compression=lz4)
    writer, data = bag._writer, serialized(TYPES.types[STRING]('y' * 40))
    channel = bag.channel('/x', STRING)
    writer.add_metadata('mine', {'a': '1'})
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
        assert {'a': '1'} in [m.metadata for m in reader.iter_metadata() if m.name == 'mine']
        assert {c.compression for c in reader.get_summary().chunk_indexes} == {'lz4'}


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
