"""Harm to the bag under a recorder: it ends with exit code 1, names the cause, keeps the rest."""

import os
import re
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.damaged_bags import seen_by_rosbags
from helpers.disks import no_more_files, small_disk
from helpers.needs import need
from helpers.node_processes import graph, parameters, run_node, stop
from helpers.nodes_in_process import assert_refused

from auv_analysis.bag.reading import read_bag
from auv_analysis.bag.recover import recover
from auv_analysis.nodes.recorder_node import RecorderNode
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.interface import Frames, nanoseconds

FRAMES = Frames()
STEP = 10_000_000
UPRIGHT = np.array([0, 0, 0, 1, *[0] * 9], float)
TOPICS = ['-p', 'topics:=["odom", "wrench"]']
PLAIN = {'storage__compression': 'none', 'storage__chunk_size': 4096}
MOST = 20_000  # steps until something must have happened


class Recording:
    """A recorder, and steps that it is given."""

    def __init__(self, peer: Any, process: subprocess.Popen, bag: Path):
        self.peer, self.process, self.bag, self.steps = peer, process, bag, 0
        peer.listen(topics.PROGRESS)

    def give(self, count: int) -> None:
        """Publish so many steps, unless the recorder ends."""
        for k in range(self.steps, self.steps + count):
            if self.process.poll() is not None:
                return
            odom, wrench = convert.odometry(k * STEP, UPRIGHT, FRAMES), (1.0 * k,) * 6
            self.peer.publish(topics.ODOM, odom, subscribers=not k)
            wrenched = convert.wrench(k * STEP, wrench, FRAMES)
            self.peer.publish(topics.WRENCH, wrenched, subscribers=not k)
            self.steps += 1

    def acknowledged(self) -> None:
        """Wait until all that was given has been taken, or the recorder has ended."""
        heard, last = self.peer.heard['recorder/progress'], (self.steps - 1) * STEP

        def taken() -> bool:
            return bool(heard) and nanoseconds(heard[-1].stamp) >= last

        self.peer.until(lambda: taken() or self.process.poll() is not None, 'progress')

    def on_disk(self, file: Path) -> None:
        """Wait until steps have reached a file."""
        self.peer.until(lambda: file.exists() and b'odom_ned' in file.read_bytes(), 'a chunk')

    def ends(self, *words: str) -> str:
        """Its last words: one error with these words, exit code 1."""
        self.peer.until(lambda: self.process.poll() is not None, 'the end')
        code, output = stop(self.process)
        assert code == 1, output
        errors = [line for line in output.splitlines() if '[ERROR]' in line]
        assert len(errors) == 1, output
        for word in words:
            assert word in errors[0]
        assert 'Traceback' not in output
        return output


@contextmanager
def recording(bag: Path, **values: Any) -> Iterator[Recording]:
    arguments = [*TOPICS, *parameters(bag=bag, **{'storage__free_space': 0, **PLAIN, **values})]
    with graph(('recorder_node', arguments)) as (peer, processes):
        yield Recording(peer, processes['recorder_node'], bag)


def assert_steps_from_the_first(bag: Path) -> int:
    """Every topic has its first steps without a gap; how many."""
    messages = read_bag(bag).messages
    for stamps, _ in messages.values():
        assert np.array_equal(stamps, np.arange(len(stamps)) * STEP)
    return min(len(stamps) for stamps, _ in messages.values())


def test_a_full_disk(tmp_path: Path) -> None:
    with small_disk(tmp_path / 'disk', 600) as disk:
        bag = (disk or tmp_path / 'quota') / 'bag'
        with recording(bag) as recorder:
            recorder.give(1)
            recorder.acknowledged()
            if disk is None:
                limits = 600 << 10, resource.RLIM_INFINITY
                resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, limits)
            while recorder.process.poll() is None and recorder.steps < MOST:
                recorder.give(100)
                recorder.acknowledged()
            text = 'file too large' if disk is None else 'no space left on device'
            recorder.ends(f'{bag}/bag_0.mcap: {text}')
        kept = assert_steps_from_the_first(bag)
        assert kept > 300
        shutil.copytree(bag, tmp_path / 'copy')
    document = recover(tmp_path / 'copy').document()
    counts = {topic: entry['messages'] for topic, entry in document['topics'].items()}
    if not counts.get('/diagnostics', 1):
        del counts['/diagnostics']  # the disk was full between the topic and its first message
    assert counts == read_bag(tmp_path / 'copy').counts
    assert document['topics']['/odom']['spacing']['gaps'] == 0


def test_a_quota(tmp_path: Path) -> None:
    bag = tmp_path / 'bag'
    with recording(bag) as recorder:
        recorder.give(1)
        recorder.acknowledged()
        limits = 300 << 10, resource.RLIM_INFINITY
        resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, limits)
        while recorder.process.poll() is None and recorder.steps < MOST:
            recorder.give(100)
            recorder.acknowledged()
        recorder.ends(f'{bag}/bag_0.mcap: file too large')
    assert assert_steps_from_the_first(bag) > 100
    assert (bag / 'bag_0.mcap').stat().st_size <= limits[0]


def test_too_little_space_ends_the_recording_in_good_order(tmp_path: Path) -> None:
    with small_disk(tmp_path / 'disk', 4000) as disk:
        bag = (disk or tmp_path) / 'bag'
        least = (3 << 20) if disk else shutil.disk_usage(tmp_path).free - (1 << 20)
        with recording(bag, storage__free_space=least) as recorder:
            while recorder.process.poll() is None and recorder.steps < MOST:
                recorder.give(100)
                recorder.acknowledged()
            recorder.ends(f'{bag}/bag_0.mcap', 'bytes free', f'storage.free_space asks for {least}')
        contents = read_bag(bag)
        assert contents.notes == [], 'the bag is finished'
        assert assert_steps_from_the_first(bag) > 300
        assert (bag / 'metadata.yaml').is_file()
        assert recover(bag).changed is False


def removed(file: Path) -> None:
    shutil.rmtree(file.parent)


def renamed(file: Path) -> None:
    file.parent.rename(file.parent.with_name('elsewhere'))


def unlinked(file: Path) -> None:
    file.unlink()


def replaced(file: Path) -> None:
    other = file.with_suffix('.new')
    other.write_bytes(b'precious')
    os.replace(other, file)


def shortened(file: Path) -> None:
    os.truncate(file, 100)


@pytest.mark.parametrize(
    ('harm', 'words'),
    [
        (removed, 'removed or renamed'), (unlinked, 'removed or renamed'),
        (renamed, 'removed or renamed'), (replaced, 'replaced by another file'),
        (shortened, 'shortened by somebody else'),
    ],
)  # fmt: skip
def test_a_bag_that_is_taken_away(tmp_path: Path, harm: Callable[[Path], None], words: str) -> None:
    file = tmp_path / 'bag' / 'bag_0.mcap'
    with recording(file.parent) as recorder:
        recorder.give(20)
        recorder.acknowledged()
        recorder.on_disk(file)
        harm(file)
        recorder.ends(f'{file}: {words} while it was being recorded')
    if harm is replaced:
        assert file.read_bytes() == b'precious'
        assert sorted(os.listdir(file.parent)) == ['bag_0.mcap'], 'nothing more is written there'
    elif harm is renamed:
        assert read_bag(tmp_path / 'elsewhere').notes == [], 'finished in its new place'
        assert assert_steps_from_the_first(tmp_path / 'elsewhere') == 20
    elif harm is removed:
        assert os.listdir(tmp_path) == []


def test_a_folder_that_becomes_read_only(tmp_path: Path) -> None:
    bag = tmp_path / 'bag'
    with recording(bag, storage__max_duration=1.0) as recorder:
        recorder.give(50)
        recorder.acknowledged()
        recorder.on_disk(bag / 'bag_0.mcap')
        with no_more_files(bag) as possible:
            need('read-only folders', possible)
            recorder.give(100)
            recorder.ends(f'{bag}/bag_1.mcap: ')
    assert_steps_from_the_first(bag)
    assert read_bag(bag).counts['/odom'] == 100, 'up to the file that could not be made'
    assert recover(bag).changed


@pytest.mark.parametrize('kill', [True, False])
def test_a_split_bag(tmp_path: Path, kill: bool) -> None:
    bag = tmp_path / 'bag'
    with recording(bag, storage__max_duration=1.0, storage__compression='lz4') as recorder:
        recorder.give(250)
        recorder.acknowledged()
        recorder.on_disk(bag / 'bag_2.mcap')
        if kill:
            recorder.process.kill()
            recorder.process.wait()
        else:
            assert stop(recorder.process)[0] == 0
    names = [f'bag_{i}.mcap' for i in range(3)]
    assert sorted(p.name for p in bag.glob('*.mcap')) == names
    kept = assert_steps_from_the_first(bag)
    assert kept == 250 or (kill and kept > 200)
    assert (bag / 'metadata.yaml').exists() != kill
    document = recover(bag).document()
    assert document['changed'] == kill
    assert document['topics']['/odom']['spacing'] == {'gaps': 0, 'missing': 0, 'longest': []}
    assert sum(seen_by_rosbags(bag).values()) == document['messages']
    assert sum(read_bag(bag).counts.values()) == document['messages']


WRONG = {
    'storage__max_size': [5, -1, 1.5], 'storage__max_duration': [0.5, -1.0],
    'storage__free_space': [-1, 1 << 60], 'storage__chunk_size': [10, 1 << 40],
    'storage__compression': ['gzip'],
}  # fmt: skip


@pytest.mark.parametrize(
    ('name', 'value'),
    [(name, value) for name, values in WRONG.items() for value in values],
)
def test_a_wrong_storage_parameter_ends_in_one_line(
    tmp_path: Path, name: str, value: object
) -> None:
    given = parameters(bag=tmp_path / 'bag', **{name: value})
    assert_refused(RecorderNode, given, name.replace('__', '.'))
    assert not (tmp_path / 'bag').exists()


def test_a_bag_on_a_full_disk_is_not_begun(tmp_path: Path) -> None:
    with small_disk(tmp_path / 'disk', 8) as disk:
        need('mounting', disk)
        attached = tmp_path / 'long.yaml'
        attached.write_text('x' * 100_000)
        arguments = [*parameters(bag=disk / 'bag', storage__free_space=0)]
        arguments += ['-p', f'attachments:=["{attached}"]']
        ended = run_node('recorder_node', *arguments)
        assert ended.returncode == 2
        assert re.search(r'found no space left on device', ended.stdout)
        assert list(disk.rglob('*.mcap')) == []
