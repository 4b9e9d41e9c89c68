"""`auv recover` as a user meets it: files, names, exit codes, and repairs that are ended midway."""

import errno
import fcntl
import json
import os
import resource
import stat
import sys
import tracemalloc
from collections import Counter
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.damaged_bags import (
    ATTACHED,
    STEP,
    attachments_of,
    messages_of,
    old,
    places,
    seen_by_rosbags,
    write_bag,
)
from helpers.made_messages import STRING, Bag, new, serialized
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Message, Schema
from mcap.stream_reader import breakup_chunk

from auv_analysis.bag import inspection
from auv_analysis.bag import recover as recovery
from auv_analysis.bag.inspection import Definitions, Spacing
from auv_analysis.bag.metadata import Definition, FileExtent, metadata, offered_profiles
from auv_analysis.bag.output import Storage
from auv_analysis.bag.reading import read_bag
from auv_analysis.bag.recover import recover
from auv_analysis.bag.writer import BagWriter
from auv_analysis.cli.main import main
from auv_analysis.output import new_files
from auv_dynamics.files.errors import FailedError


def aged(bag: Path) -> Path:
    for path in bag.iterdir():
        old(path)
    return bag


def cut(path: Path, share: float = 0.6) -> bytes:
    """Cut a file; what is left of it."""
    data = path.read_bytes()
    left = data[: int(share * len(data))]
    path.write_bytes(left)
    old(path)
    return left


def contents(bag: Path) -> dict[str, tuple]:
    return {p.name: (p.read_bytes(), p.stat().st_mtime_ns, p.stat().st_ino) for p in bag.iterdir()}


def command(capsys: pytest.CaptureFixture, *arguments: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of `auv recover`."""
    code = 0
    try:
        main(['recover', *map(str, arguments)])
    except SystemExit as ended:
        code = int(ended.code or 0)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def messages_in(chunk: Chunk) -> list[Message]:
    return [record for record in breakup_chunk(chunk) if isinstance(record, Message)]


def split_bag(folder: Path) -> Path:
    """A bag of several files."""
    bag = write_bag(folder, steps=60, max_duration=20 * STEP)
    assert len(list(bag.glob('*.mcap'))) == 3
    return aged(bag)


def test_a_healthy_bag_is_not_touched(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bag = split_bag(tmp_path / 'bag')
    before, folder = contents(bag), bag.stat().st_mtime_ns
    code, out, err = command(capsys, bag)
    assert (code, err) == (0, '')
    assert 'nothing was changed' in out
    assert '0 known to be lost' in out
    assert contents(bag) == before
    assert bag.stat().st_mtime_ns == folder


def test_json_is_one_document(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bag = write_bag(tmp_path / 'bag')
    left = cut(bag / 'bag_0.mcap')
    code, out, _ = command(capsys, bag, '--json')
    assert code == 0
    document = json.loads(out)
    assert document['changed']
    (file,) = document['files']
    assert file['state'] == 'repaired'
    assert file['lost'][-1]['to'] == len(left)
    assert document['messages'] == len(messages_of(bag / 'bag_0.mcap'))
    assert document['attachments'] == sorted(ATTACHED)
    assert (file['messages_lost'], document['messages_lost']) == (None, None), 'who knows'
    odom, remark = (document['topics'][topic] for topic in ('/odom', '/remark'))
    assert odom['spacing'] == {'gaps': 0, 'missing': 0, 'longest': []}
    assert (remark['spacing'], remark['type']) == (None, 'std_msgs/msg/String')


def test_a_damaged_chunk_amid_others_leaves_a_gap_that_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    bag = write_bag(tmp_path / 'bag')
    path = bag / 'bag_0.mcap'
    data = bytearray(path.read_bytes())
    chunks = [(b, e, r) for b, e, r in places(bytes(data)) if isinstance(r, Chunk)]
    begin, end, chunk = chunks[4]
    data[(begin + end) // 2] ^= 1
    path.write_bytes(data)
    code, out, _ = command(capsys, old(path).parent)
    assert code == 0
    assert 'repaired, the damaged one is kept as bag_0.mcap.damaged' in out
    assert f'lost: bytes {begin} to {end}' in out
    assert f'{len(messages_in(chunk))} known to be lost' in out
    stamps = [message.log_time for message in messages_in(chunk) if message.channel_id == 1]
    first, last = (stamps[0] - STEP) / 1e9, (stamps[-1] + STEP) / 1e9
    assert f'/odom: nothing between {first:g} and {last:g} s' in out
    kept = sum(
        message.channel_id == 1 for *_, one in chunks if one is not chunk
        for message in messages_in(one)
    )  # fmt: skip
    rows = [line.split() for line in out.splitlines()]
    assert ['/odom', str(kept), '1', str(len(stamps))] in rows
    assert command(capsys, bag)[0] == 0
    with path.open('rb') as file:
        (told,) = (m.metadata for m in make_reader(file).iter_metadata() if m.name == 'rosbag2')
    metadata = yaml.safe_load(told['serialized_metadata'])['rosbag2_bagfile_information']
    assert metadata['message_count'] == len(messages_of(path))


def test_a_split_bag_with_a_damaged_file(tmp_path: Path) -> None:
    bag = split_bag(tmp_path / 'bag')
    before = contents(bag)
    data = (bag / 'bag_1.mcap').read_bytes()
    begin = [b for b, _, r in places(data) if isinstance(r, Chunk)][2]
    left = cut(bag / 'bag_1.mcap', (begin + 20) / len(data))
    (bag / 'metadata.yaml').unlink()
    document = recover(bag).document()
    assert [f['state'] for f in document['files']] == ['healthy', 'repaired', 'healthy']
    assert document['topics']['/odom']['spacing']['gaps'] == 1
    assert document['duration'] == 0.59
    after = contents(bag)
    assert {k: after[k] for k in ('bag_0.mcap', 'bag_2.mcap')} == {
        k: before[k] for k in ('bag_0.mcap', 'bag_2.mcap')
    }
    assert after['bag_1.mcap.damaged'][0] == left
    rows = Counter(row for path in sorted(bag.glob('*.mcap')) for row in messages_of(path))
    assert seen_by_rosbags(bag) == rows
    assert all(len(attachments_of(path)) == 3 for path in bag.glob('*.mcap'))
    assert recover(bag).changed is False


@pytest.mark.parametrize('size', [0, 3, 8, 40])
def test_a_last_file_in_which_nothing_is_yet(tmp_path: Path, size: int) -> None:
    """The recorder was killed, or the power cut, when it had just begun a new file."""
    bag = split_bag(tmp_path / 'bag')
    (bag / 'metadata.yaml').unlink()
    data = (bag / 'bag_2.mcap').read_bytes()[:size]
    (bag / 'bag_2.mcap').write_bytes(data)
    old(bag / 'bag_2.mcap')
    assert read_bag(bag).counts['/odom'] == 40, 'read before it is repaired'
    document = recover(bag).document()
    assert document['files'][2]['state'] == 'left out'
    assert (bag / 'bag_2.mcap.damaged').read_bytes() == data
    assert sum(seen_by_rosbags(bag).values()) == document['messages']
    assert recover(bag).changed is False


def test_a_single_file(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bag = split_bag(tmp_path / 'bag')
    left = cut(bag / 'bag_1.mcap')
    (bag / 'bag_1.mcap').chmod(0o600)
    others = {k: v for k, v in contents(bag).items() if k != 'bag_1.mcap'}
    assert command(capsys, bag / 'bag_1.mcap')[0] == 0
    assert (bag / 'bag_1.mcap.damaged').read_bytes() == left
    assert (bag / 'bag_1.mcap').stat().st_mode & 0o777 == 0o600, 'nobody else may read it now'
    assert others.items() <= contents(bag).items()
    assert messages_of(bag / 'bag_1.mcap')


def test_a_missing_metadata_yaml_is_written_as_it_was(tmp_path: Path) -> None:
    bag = split_bag(tmp_path / 'bag')
    before, text = contents(bag), (bag / 'metadata.yaml').read_text()
    (bag / 'metadata.yaml').unlink()
    assert recover(bag).metadata == 'written'
    assert yaml.safe_load((bag / 'metadata.yaml').read_text()) == yaml.safe_load(text)
    after = contents(bag)
    assert all(after[name] == before[name] for name in before if name.endswith('.mcap'))


@pytest.mark.parametrize('mode', ['message', 'FILE'])
def test_what_only_a_metadata_yaml_says_is_kept(tmp_path: Path, mode: str) -> None:
    path = write_bag(tmp_path / 'bag') / 'metadata.yaml'
    told = yaml.safe_load(path.read_text())
    told['rosbag2_bagfile_information']['message_count'] = 1
    alone = {'ros_distro': 'humble', 'custom_data': {'dive': '7'}}
    packed = {'compression_format': 'zstd', 'compression_mode': mode}
    told['rosbag2_bagfile_information'] |= alone | packed
    path.write_text(yaml.safe_dump(told))
    assert recover(path.parent).metadata == 'written'
    found = yaml.safe_load(path.read_text())['rosbag2_bagfile_information']
    assert alone.items() <= found.items()
    assert not any(found[key] for key in packed), 'somebody has decompressed them'
    assert found['message_count'] == 65


def test_a_metadata_yaml_agrees_by_files_counts_and_span() -> None:
    topics = [Definition('/a', 'x'), Definition('/none', 'x')]
    told = metadata(topics, [FileExtent('a.mcap', {'/a': 2}, 5, 9)])
    agrees = recovery._gist(told)
    assert recovery._gist(metadata(topics[:1], [FileExtent('a.mcap', {'/a': 2}, 5, 9)])) == agrees
    for name, counts, first, last in (
        ('b.mcap', {'/a': 2}, 5, 9), ('a.mcap', {'/a': 3}, 5, 9), ('a.mcap', {'/b': 2}, 5, 9),
        ('a.mcap', {'/a': 2}, 4, 8), ('a.mcap', {'/a': 2}, 5, 8),
    ):  # fmt: skip
        other = metadata([*topics, Definition('/b', 'x')], [FileExtent(name, counts, first, last)])
        assert recovery._gist(other) != agrees


def test_a_report_adds_up_its_files(tmp_path: Path) -> None:
    for number, spans in enumerate(({'/a': (5, 9), '/b': (7, 12)}, {'/b': (13, 15)})):
        bag = Bag(tmp_path / f'bag_{number}.mcap', chunk_size=1)
        for topic, (first, last) in spans.items():
            for k in range(first, last + 1):
                bag.add(topic, STRING, k * STEP, serialized(new(STRING, 'x' * 50)))
        data = bytearray(bag.close().read_bytes())
        begin, end = [one[:2] for one in places(bytes(data)) if isinstance(one[2], Chunk)][1]
        data[(begin + end) // 2] ^= 1  # the second message
        bag.path.write_bytes(data)
        old(bag.path)
    seen = list[tuple[str, int, int]]()
    document = recover(tmp_path, lambda *told: seen.append(told)).document()
    assert (document['duration'], document['messages']) == (0.1, 12)
    assert document['messages_lost'] == 2
    assert [file['messages'] for file in document['files']] == [10, 2]
    assert {topic: entry['messages'] for topic, entry in document['topics'].items()} == {
        '/a': 4, '/b': 8
    }  # fmt: skip
    sizes = [(tmp_path / f'bag_{i}.mcap.damaged').stat().st_size for i in (0, 1)]
    assert {what: (done, of) for what, of, done in seen} == {  # up to the footer
        f'{what} bag_{i}.mcap': (size - 8, size)
        for what in ('reading', 'repairing') for i, size in enumerate(sizes)
    }  # fmt: skip


def test_a_gap_is_one_from_half_a_usual_interval_more() -> None:
    found = Spacing()
    apart = [0, 10, 20, 20, 30, 31, 20, 31, *[0] * 6, -90, 90]  # ms; 4 of 8 that rise: up to 20
    found.add(np.cumsum(apart) * 1_000_000)
    gaps = found.gaps()
    assert (gaps['gaps'], gaps['missing']) == (3, 1 + 1 + 3)
    assert gaps['longest'] == [[0.072, 0.162], [0.08, 0.111], [0.131, 0.162]]


def test_the_ends_of_a_spacing_are_those_in_the_bag_and_those_by_size() -> None:
    found = Spacing()
    for stamps in ([5, 3, 9, 4], [2, 8], [1]):
        found.add(np.array(stamps))
    assert (found.first, found.last, found.count) == (5, 1, 7)
    assert (found.earliest, found.latest) == (1, 9)


def test_policies_are_read_up_to_a_size_of_all_together(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = {'/a': '- {depth: 1}', '/b': '- {depth: 25}', '/c': '- {depth: 1}', '/d': 'depth: 1',
             '/e': '- &a [*a]', '/f': '- ]'}  # fmt: skip
    size = sum(map(len, texts.values()))
    more_texts = {'/g': '- {depth: 3}', '/h': '- {depth: 1}'}
    for more, last in ((0, [{'depth': 3}]), (-1, [])):
        known = Definitions()
        known.add(Schema(1, b'', 'ros2msg', 'X'), 0)
        for i, (topic, text) in enumerate((texts | more_texts).items()):
            about = {'offered_qos_profiles': text, 'topic_type_hash': f'{i}'}
            known.add(Channel(i, topic, 'cdr', about, 1), 0)
        known.add(Channel(9, '/a', 'cdr', {}, 1), 0)
        monkeypatch.setattr(inspection, 'LARGEST_POLICIES', size + len('- {depth: 3}') + more)
        found = known.of_rosbag2()
        assert [offered_profiles(one.qos) for one in found] == [
            [{'depth': 1}], [{'depth': 25}], [{'depth': 1}], [], [], [], last, []
        ]  # fmt: skip
        assert [(one.topic, one.digest) for one in found[:2]] == [('/a', '0'), ('/b', '1')]
    known.add(Channel(10, '/j', 'json', {}, 1), 0)
    assert known.of_rosbag2() is None


def test_gaps_over_several_files_are_those_of_one() -> None:
    wide = [38 + k for k in range(12)]  # ms, beside 10; one message comes 3 ms late
    apart = [10] * 20 + [n for gap in wide for n in (gap, 10)] + [10, 13, -3, 10]
    stamps = np.cumsum([5000, *apart]) * 1_000_000
    whole, joined, part = Spacing(), Spacing(), Spacing()
    whole.add(stamps)
    cut = 25  # within a gap
    part.add(stamps[:7])
    part.add(stamps[7:cut])
    later = Spacing()
    later.add(stamps[cut:])
    for one in (Spacing(), part, later):
        joined.join(one)
    found = whole.gaps()
    assert apart[cut - 1] in wide
    assert vars(joined) | {'longest': sorted(joined.longest)} == vars(whole) | {
        'longest': sorted(whole.longest)
    }
    assert (whole.count, whole.first, whole.last) == (len(stamps), stamps[0], stamps[-1])
    assert (found['gaps'], found['missing']) == (12, sum(round(n / 10) - 1 for n in wide))
    begin = 5.2 + (sum(wide[:2]) + 20) / 1e3
    assert len(found['longest']) == 10
    assert found['longest'][0] == pytest.approx([begin, begin + 0.04])


def test_a_definition_is_that_which_is_checked_best() -> None:
    one, other = (Channel(1, topic, 'cdr', {}, 0) for topic in ('/a', '/b'))
    known = Definitions()
    for channel, trust, kept in ((one, 0, one), (other, 2, other), (one, 1, other)):
        known.add(channel, trust)
        assert known.channel(1) is kept
    assert known.doubtful == {'/a', '/b'}


@pytest.mark.parametrize(
    'text',
    [
        'no: yaml: {', '- a\n', 'rosbag2_bagfile_information: 7\n',
        'rosbag2_bagfile_information: {relative_file_paths: [../../secret.mcap]}\n',
    ],
)  # fmt: skip
def test_a_metadata_yaml_that_does_not_fit_is_replaced(tmp_path: Path, text: str) -> None:
    bag = write_bag(tmp_path / 'bag')
    (bag / 'metadata.yaml').write_text(text)
    assert recover(bag).metadata == 'written'
    assert sum(seen_by_rosbags(bag).values()) == 65


@pytest.mark.parametrize('size', [0, 5, 30])
def test_nothing_to_be_recovered(tmp_path: Path, capsys: pytest.CaptureFixture, size: int) -> None:
    bag = write_bag(tmp_path / 'bag')
    path = bag / 'bag_0.mcap'
    path.write_bytes(path.read_bytes()[:size])
    before = contents(aged(bag))
    code, out, err = command(capsys, bag)
    assert (code, out) == (1, '')
    assert err.splitlines() == [f'{bag}: nothing in it can be recovered']
    assert contents(bag) == before


def wrong(folder: Path) -> dict[str, Path]:
    (folder / 'empty').mkdir()
    (folder / 'sqlite').mkdir()
    (folder / 'sqlite' / 'bag_0.db3').write_bytes(b'SQLite format 3')
    (folder / 'text.mcap').write_text('no bag at all, but long enough to be looked through')
    (folder / 'other.bag').write_text('#ROSBAG V2.0')
    (folder / 'linked').mkdir()
    (folder / 'linked' / 'a.mcap').symlink_to(write_bag(folder / 'true') / 'true_0.mcap')
    (folder / 'piped').mkdir()
    os.mkfifo(folder / 'piped' / 'a.mcap')
    names = ('empty', 'sqlite', 'text.mcap', 'other.bag', 'linked', 'piped', 'none', 'none.mcap')
    return {name: folder / name for name in names}


FOUND = {
    'empty': 'a folder without .mcap files', 'sqlite': 'a folder of .db3 files',
    'text.mcap': 'what is no MCAP file', 'other.bag': 'a file that ends in \'.bag\'',
    'linked': 'a link to', 'piped': 'something else', 'none': 'no such', 'none.mcap': 'no such',
}  # fmt: skip


def test_wrong_input_ends_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    for name, path in wrong(tmp_path).items():
        code, out, err = command(capsys, path)
        assert (code, out) == (2, ''), name
        assert len(err.splitlines()) == 1, err
        assert 'expected' in err
        assert f'found {FOUND[name]}' in err
    assert sorted(os.listdir(tmp_path / 'true')) == ['metadata.yaml', 'true_0.mcap']


def test_a_bag_that_is_being_recorded_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    writer = BagWriter(tmp_path / 'bag', {}, Storage())
    code, _, err = command(capsys, tmp_path / 'bag')
    assert code == 2
    assert 'expected a bag that nobody is recording, found a file that is being written' in err
    assert len(err.splitlines()) == 1
    writer.close()
    assert command(capsys, tmp_path / 'bag')[0] == 0


@pytest.mark.parametrize('has_locks', [True, False])
def test_a_network_file_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_locks: bool
) -> None:
    """There an exclusive lock asks for a file that may be written, or there is none at all."""

    def flock(descriptor: int, _: int) -> None:
        if not has_locks:
            raise OSError(errno.ENOLCK, 'No locks available')
        if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE != os.O_RDWR:
            raise OSError(errno.EBADF, 'Bad file descriptor')

    bag = write_bag(tmp_path / 'bag')
    monkeypatch.setattr(fcntl, 'flock', flock)
    notes = recover(bag).document()['notes']
    assert notes == ([] if has_locks else ['bag_0.mcap: not locked: no locks available'])


@pytest.mark.parametrize('refused', [errno.EACCES, errno.EPERM, errno.EROFS, errno.EIO])
def test_a_file_that_may_only_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: int
) -> None:
    bag, opened = write_bag(tmp_path / 'bag'), os.open

    def reading(path: Path, flags: int, *more: Any) -> int:
        if flags & os.O_ACCMODE != os.O_RDONLY:
            raise OSError(refused, os.strerror(refused), str(path))
        return opened(path, flags, *more)

    monkeypatch.setattr(os, 'open', reading)
    if refused == errno.EIO:
        with pytest.raises(FailedError, match=r'bag_0.mcap: .*the file is as it was'):
            recover(bag)
    else:
        assert not recover(bag).changed


def test_a_file_that_is_written_or_replaced_is_another(tmp_path: Path) -> None:
    path, other = tmp_path / 'a', tmp_path / 'b'
    states = []
    for data, file in (('x', path), ('xy', path), ('xy', path), ('xy', other)):
        file.write_text(data)
        os.utime(file, ns=(0, 5 if len(states) < 2 else 6))
        states.append(recovery.state(file))
    assert len({*states}) == 4
    other.replace(path)
    assert recovery.state(path) == states[3]


@pytest.mark.parametrize('last', ['.2', '.10'])
def test_a_repair_goes_on_from_the_damaged_file_that_was_kept_last(
    tmp_path: Path, last: str
) -> None:
    bag = write_bag(tmp_path / 'bag')
    path = bag / 'bag_0.mcap'
    whole = path.read_bytes()
    path.unlink()
    for end in {'', '.2', last}:
        kept = bag / f'bag_0.mcap.damaged{end}'
        kept.write_bytes(whole if end == last else whole[:4000])
        old(kept)
    (file,) = recover(bag).files
    assert (file.kept_as, file.inspection.count) == (f'bag_0.mcap.damaged{last}', 65)


def test_a_link_that_is_named_itself_is_repaired(tmp_path: Path) -> None:
    path, link = write_bag(tmp_path / 'bag') / 'bag_0.mcap', tmp_path / 'other' / 'link.mcap'
    left = cut(path)
    link.parent.mkdir()
    link.symlink_to(path)
    (file,) = recover(link).files
    assert (file.state, path.read_bytes()) == ('repaired', left)
    assert len(messages_of(link)) == file.inspection.count > 0


def test_two_repairs_at_once(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bag = write_bag(tmp_path / 'bag')
    left = cut(bag / 'bag_0.mcap')
    with (bag / 'bag_0.mcap').open('rb') as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert command(capsys, bag)[0] == 2
    assert (bag / 'bag_0.mcap').read_bytes() == left


def go_on(path: Path) -> None:
    """What a recorder does that takes no lock."""
    with path.open('ab') as file:
        file.write(b'more')


def assert_left_to_its_recorder(capsys: pytest.CaptureFixture, bag: Path, left: bytes) -> None:
    code, _, err = command(capsys, bag)
    assert code == 2
    assert 'found a file that is being written' in err
    assert (bag / 'bag_0.mcap').read_bytes() == left + b'more'
    assert sorted(os.listdir(bag)) == ['bag_0.mcap', 'metadata.yaml']


def test_a_file_that_grows_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = write_bag(tmp_path / 'bag')
    path = bag / 'bag_0.mcap'
    left = cut(path)
    path.touch()

    def grow(seconds: float) -> None:
        assert 0 < seconds <= recovery.QUIET
        go_on(path)

    monkeypatch.setattr(recovery.time, 'sleep', grow)
    monkeypatch.setattr(recovery, 'QUIET', 3600.0)
    assert_left_to_its_recorder(capsys, bag, left)


def test_a_recorder_that_comes_back_during_a_repair_loses_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = write_bag(tmp_path / 'bag')
    path = bag / 'bag_0.mcap'
    left = cut(path)
    write = recovery.Rewriter.write

    def meanwhile(*given: Any) -> None:
        write(*given)
        go_on(path)

    monkeypatch.setattr(recovery.Rewriter, 'write', meanwhile)
    assert_left_to_its_recorder(capsys, bag, left)


def order_of_calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What the disk is told, in its order."""
    called: list[str] = []

    def told(name: str) -> None:
        original = getattr(os, name)

        def call(*given: Any, **options: Any) -> Any:
            folder = name == 'fsync' and stat.S_ISDIR(os.fstat(given[0]).st_mode)
            called.append('folder' if folder else name)
            return original(*given, **options)

        monkeypatch.setattr(os, name, call)

    for name in ('fsync', 'link', 'replace'):
        told(name)
    return called


def test_what_takes_a_name_is_on_the_disk_before_and_the_name_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = write_bag(tmp_path / 'bag')
    cut(bag / 'bag_0.mcap', 0.4)
    called = order_of_calls(monkeypatch)
    recover(bag)
    whole = ['fsync', 'replace', 'folder']
    assert called == ['fsync', 'link', 'folder', 'replace', 'folder', *whole]
    called.clear()
    new_files.write(tmp_path / 'x', b'x')
    assert called == whole


def test_what_few_may_read_is_read_by_few_during_its_repair(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag, modes = write_bag(tmp_path / 'bag'), []
    cut(bag / 'bag_0.mcap')
    (bag / 'bag_0.mcap').chmod(0o600)
    finish = recovery.Writer.finish

    def finished(writer: Any) -> None:
        modes.append((bag / 'bag_0.mcap.unfinished').stat().st_mode & 0o777)
        finish(writer)

    monkeypatch.setattr(recovery.Writer, 'finish', finished)
    recover(bag)
    assert modes == [0o600]
    assert (bag / 'bag_0.mcap').stat().st_mode & 0o777 == 0o600


class EndedError(BaseException):
    """The process is gone."""


def ended_at(monkeypatch: pytest.MonkeyPatch, name: str, number: int) -> None:
    """Let the process end before call `number` of a function of `os`."""
    original, left = getattr(os, name), [number]

    def call(*arguments: Any, **options: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise EndedError
        return original(*arguments, **options)

    monkeypatch.setattr(os, name, call)


@pytest.mark.parametrize('links', [True, False])
@pytest.mark.parametrize(
    ('name', 'number'),
    [('fsync', 0), ('fsync', 1), ('link', 0), ('rename', 0), ('replace', 0), ('fsync', 2),
     ('fsync', 3), ('replace', 1), ('fsync', 4)],
)  # fmt: skip
def test_a_repair_that_is_ended_is_finished_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, number: int, links: bool
) -> None:
    bag = write_bag(tmp_path / 'bag')
    left = cut(bag / 'bag_0.mcap', 0.4)  # messages are lost, so that metadata.yaml is written anew
    rows = len(messages_of_a_copy(bag, tmp_path / 'copy'))
    if not links:
        monkeypatch.setattr(os, 'link', no_links)
    with monkeypatch.context() as patch:
        called = {'link': links, 'rename': not links}.get(name, True)
        if called:
            ended_at(patch, name, number)
        with pytest.raises(EndedError) if called else nullcontext():
            recover(bag)
        if called:
            kept = [p.read_bytes() for p in bag.glob('bag_0.mcap*') if not p.name.endswith('d')]
            kept += [p.read_bytes() for p in bag.glob('*.mcap.damaged')]
            assert left in kept, 'never less than before'
    recover(bag)
    assert len(messages_of(bag / 'bag_0.mcap')) == rows
    assert (bag / 'bag_0.mcap.damaged').read_bytes() == left
    assert sorted(os.listdir(bag)) == ['bag_0.mcap', 'bag_0.mcap.damaged', 'metadata.yaml']
    assert recover(bag).changed is False, 'metadata.yaml says what is there'


@pytest.mark.parametrize('kind', ['symlink', 'hard link'])
def test_planted_links_are_not_written_through(tmp_path: Path, kind: str) -> None:
    bag, victim = write_bag(tmp_path / 'bag'), tmp_path / 'victim'
    left = cut(bag / 'bag_0.mcap')
    (bag / 'metadata.yaml').unlink()
    victim.write_text('precious')
    for name in ('bag_0.mcap.unfinished', 'metadata.yaml.unfinished'):
        if kind == 'symlink':
            (bag / name).symlink_to(victim)
        else:
            (bag / name).hardlink_to(victim)
    (bag / 'metadata.yaml').symlink_to(victim)
    report = recover(bag)
    assert victim.read_text() == 'precious'
    assert (bag / 'bag_0.mcap.damaged').read_bytes() == left
    assert report.metadata == 'written'
    assert not (bag / 'metadata.yaml').is_symlink()
    assert sum(seen_by_rosbags(bag).values()) == report.document()['messages']


@pytest.mark.parametrize('target', ['bag_0.mcap', 'nowhere'])
def test_a_planted_link_does_not_pass_for_the_damaged_file(tmp_path: Path, target: str) -> None:
    bag = write_bag(tmp_path / 'bag')
    left = cut(bag / 'bag_0.mcap')
    (bag / 'bag_0.mcap.damaged').symlink_to(target)
    file = recover(bag / 'bag_0.mcap').files[0]
    assert (bag / str(file.kept_as)).read_bytes() == left


def no_links(*_: Any) -> None:
    raise PermissionError(1, 'operation not permitted')


def messages_of_a_copy(bag: Path, copy: Path) -> list:
    copy.mkdir()
    (copy / 'bag_0.mcap').write_bytes((bag / 'bag_0.mcap').read_bytes())
    old(copy / 'bag_0.mcap')
    recover(copy)
    return messages_of(copy / 'bag_0.mcap')


def test_a_repaired_file_that_is_damaged_again(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / 'bag')
    first = cut(bag / 'bag_0.mcap', 0.8)
    recover(bag)
    second = cut(bag / 'bag_0.mcap', 0.7)
    recover(bag)
    assert (bag / 'bag_0.mcap.damaged').read_bytes() == first
    assert (bag / 'bag_0.mcap.damaged.2').read_bytes() == second
    assert recover(bag).changed is False


def test_a_full_disk_leaves_the_file_as_it_was(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, 'dont_write_bytecode', True)  # Python would leave a part of a module
    bag = write_bag(tmp_path / 'bag')
    left = cut(bag / 'bag_0.mcap')
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, hard))
    try:
        code, _, err = command(capsys, bag)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert code == 1
    assert 'file too large; the file is as it was' in err
    assert len(err.splitlines()) == 1
    assert (bag / 'bag_0.mcap').read_bytes() == left
    assert command(capsys, bag)[0] == 0


def test_attachments_are_never_used_as_paths(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / 'deep' / 'bag')
    cut(bag / 'bag_0.mcap')
    recover(bag)
    assert '../escape.yaml' in dict(attachments_of(bag / 'bag_0.mcap'))
    assert sorted(p.name for p in tmp_path.rglob('*escape*')) == []


def test_memory_does_not_grow_with_the_bag(tmp_path: Path) -> None:
    text, payload = 'string data\n', b'\0\1\0\0' + bytes(100_000)
    writer = BagWriter(tmp_path / 'bag', {}, Storage('none'))
    writer.add_channel(Definition('/blob', 'std_msgs/msg/String'), text)
    for k in range(400):
        writer.write('/blob', k, payload)
    writer.close()
    path = tmp_path / 'bag' / 'bag_0.mcap'
    size = len(cut(path, 0.95))
    tracemalloc.start()
    recover(tmp_path / 'bag')
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert size > 35e6
    assert peak < 12e6


def test_a_bag_whose_name_is_no_text_is_repaired(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / os.fsdecode(b'd\xffve'))
    (file,) = bag.glob('*.mcap')
    whole = len(messages_of(file))
    cut(file, 0.3)
    assert recover(bag)
    assert 0 < len(messages_of(next(bag.glob('*.mcap')))) < whole
    assert yaml.safe_load((bag / 'metadata.yaml').read_text())
