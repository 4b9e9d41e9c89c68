"""A bag of ours read by three readers that are not ours: equal values, whole schemas."""

import json
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.graph_runs import recorded
from helpers.needs import need
from helpers.node_processes import auv
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from auv_analysis.bag.load import load_run
from auv_analysis.bag.metadata import Definition, bag_files
from auv_analysis.bag.output import Storage
from auv_analysis.bag.reading import read_bag
from auv_analysis.bag.writer import BagWriter
from auv_dynamics.ros import interface

HERE = Path(__file__).parent
CHECK = HERE / 'interop'


@pytest.fixture(scope='module')
def bag(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp('interop')
    scenario = root / 's.yaml'
    gains = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
    scenario.write_text(
        yaml.safe_dump({
            'name': 'interop', 'vehicle': 'herman2018', 'duration': 1.0, 'step': 0.01,
            'controllers': {'gvc': {'law': 'gvc', **gains}}, 'setpoint': {'surge': {'offset': 0.5}},
            'disturbance': {'kind': 'herman2018'},
        })
    )  # fmt: skip
    return recorded(scenario, root / 'out') / 'gvc'


def mcap_of(bag: Path) -> Path:
    return next(bag.glob('*.mcap'))


def wrench_row(message) -> list[float]:
    force, torque = message.wrench.force, message.wrench.torque
    return [force.x, force.y, force.z, torque.x, torque.y, torque.z]


def test_rosbags(bag: Path) -> None:
    run = load_run(bag)
    with AnyReader([bag]) as reader:
        assert reader.message_count == sum(c.msgcount for c in reader.topics.values())
        assert {t.strip('/') for t in reader.topics} >= set(interface.STEP_TOPICS)
        assert reader.duration > 1_000_000_000 - 1
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
        chosen = [c for c in reader.connections if c.topic == '/wrench']
        rows = [
            (stamp, wrench_row(reader.deserialize(raw, c.msgtype)))
            for c, stamp, raw in reader.messages(connections=chosen)
        ]
    assert [stamp for stamp, _ in rows] == [k * 10_000_000 for k in range(101)]
    assert np.array_equal([row for _, row in rows], run.tau)


def test_mcap_ros2_support(bag: Path) -> None:
    run = load_run(bag)
    with mcap_of(bag).open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        assert reader.get_header().profile == 'ros2'
        found = list(reader.iter_decoded_messages())
        stamped = {c.topic for _, c, _, _ in found}
    rows = [wrench_row(m) for _, c, _, m in found if c.topic == '/wrench']
    assert np.array_equal(rows, run.tau)
    assert stamped >= {f'/{topic}' for topic in interface.STEP_TOPICS}
    assert {'/clock', '/recorder/progress'} <= stamped  # too short for diagnostics
    ours = (*interface.STEP_TOPICS, *interface.ANALYSIS_TOPICS, interface.CLOCK)
    names = {f'/{topic.lstrip("/")}' for topic in ours}
    for _, channel, message, decoded in found:
        if channel.topic in names:  # others are logged when they came
            time = decoded.clock if channel.topic == interface.CLOCK else decoded.header.stamp
            assert message.log_time == interface.nanoseconds(time), channel.topic


def test_schemas_hashes_and_attachments(bag: Path) -> None:
    with mcap_of(bag).open('rb') as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        attachments = {a.name: a.data.decode() for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    odometry = next(s for s in summary.schemas.values() if s.name == 'nav_msgs/msg/Odometry')
    text = odometry.data.decode()
    assert odometry.encoding == 'ros2msg'
    assert 'MSG: geometry_msgs/PoseWithCovariance' in text
    assert 'builtin_interfaces/Time stamp' in text
    for channel in summary.channels.values():
        assert channel.metadata['topic_type_hash'].startswith('RIHS01_')
        assert yaml.safe_load(channel.metadata['offered_qos_profiles'])[0]['reliability']
    assert {'scenario.yaml', 'vehicle.yaml', 'params.yaml'} <= attachments.keys()
    assert yaml.safe_load(attachments['scenario.yaml'])['integrator'] == 'ode5'
    assert 'rosbag2' in metadata
    first_chunk = min(index.chunk_start_offset for index in summary.chunk_indexes)
    assert all(index.offset < first_chunk for index in summary.attachment_indexes)
    information = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert information['version'] == 9
    assert information['message_count'] == summary.statistics.message_count


@pytest.fixture(scope='module')
def core(tmp_path_factory) -> Callable[..., list[dict[str, Any]]]:
    """What @mcap/core reads from files."""
    need('npm', shutil.which('npm'))
    folder = tmp_path_factory.mktemp('npm')
    for name in ('package.json', 'read.mjs'):
        shutil.copy(CHECK / name, folder)

    def run(*command: str) -> subprocess.CompletedProcess:
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)

    def read(*paths: Path) -> list[dict[str, Any]]:
        ended = run('node', 'read.mjs', *map(str, paths))
        assert ended.returncode == 0, ended.stderr
        return [json.loads(line) for line in ended.stdout.splitlines()]

    installed = run('npm', 'install', '--no-audit', '--no-fund', '--silent')
    if installed.returncode:
        need('npm registry', run('npm', 'view', '@mcap/core', 'version').returncode == 0)
    assert installed.returncode == 0, installed.stderr
    return read


def test_npm_mcap_core(bag: Path, core: Callable[..., list[dict[str, Any]]]) -> None:
    (document,) = core(mcap_of(bag))
    run = load_run(bag)
    assert np.array_equal(document['wrench'], run.tau)
    assert document['stamps'] == [k * 10_000_000 for k in range(101)]
    assert document['counts']['/odom'] == 101
    assert set(document['attachments']) >= {'scenario.yaml', 'vehicle.yaml', 'params.yaml'}


def written_again(bag: Path, folder: Path, storage: Storage) -> Path:
    """The bag once more, stored in another way."""
    attached = {name: (bag.parent / name).read_text() for name in ('scenario.yaml', 'vehicle.yaml')}
    attached['params.yaml'] = (bag / 'params.yaml').read_text()
    writer = BagWriter(folder, attached, storage)
    with mcap_of(bag).open('rb') as stream:
        for schema, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            if not writer.has_channel(channel.topic):
                writer.add_channel(Definition.of(channel, schema), schema.data.decode())
            writer.write(channel.topic, message.log_time, message.data)
    writer.close()
    return folder


@pytest.fixture(scope='module')
def repaired(bag: Path, tmp_path_factory) -> Path:
    """The bag without its end, repaired."""
    folder = tmp_path_factory.mktemp('repaired') / 'gvc'
    path = mcap_of(written_again(bag, folder, Storage(chunk_size=50_000)))
    with path.open('rb') as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    os.truncate(path, chunks[-1].chunk_start_offset + 10)
    (folder / 'metadata.yaml').unlink()
    ended = auv('recover', str(folder))
    assert ended.returncode == 0, ended.stderr
    return folder


@pytest.fixture(scope='module')
def split(bag: Path, tmp_path_factory) -> Path:
    """The bag in several files."""
    storage = Storage(max_duration=250_000_000, pace='/odom')
    folder = written_again(bag, tmp_path_factory.mktemp('split') / 'gvc', storage)
    assert len(list(folder.glob('*.mcap'))) > 3
    return folder


def by_rosbags(folder: Path) -> dict[int, list[float]]:
    with AnyReader([folder]) as reader:
        return {
            stamp: wrench_row(reader.deserialize(raw, c.msgtype))
            for c, stamp, raw in reader.messages()
            if c.topic == '/wrench'
        }


def by_mcap_ros2(folder: Path) -> dict[int, list[float]]:
    found = {}
    for path in bag_files(folder):
        with path.open('rb') as stream:
            read = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
            for _, c, m, decoded in read.iter_decoded_messages():
                if c.topic == '/wrench':
                    found[m.log_time] = wrench_row(decoded)
    return found


def assert_as_ours(folder: Path, found: dict[int, list[float]]) -> None:
    """The same wrenches as our reader's."""
    stamps, rows = read_bag(folder).messages['/wrench']
    assert sorted(found) == stamps.tolist()
    assert np.array_equal([found[stamp] for stamp in stamps.tolist()], rows[:, :6])


@pytest.mark.parametrize('name', ['repaired', 'split'])
def test_repaired_and_split_bags(name: str, request: pytest.FixtureRequest, bag: Path) -> None:
    folder = request.getfixturevalue(name)
    for read in (by_rosbags, by_mcap_ros2):
        assert_as_ours(folder, read(folder))
    run, whole = load_run(folder), load_run(bag)
    assert np.array_equal(run.tau, whole.tau[: len(run.t)])
    assert name == 'repaired' or len(run.t) == len(whole.t)


@pytest.mark.parametrize('name', ['repaired', 'split'])
def test_npm_mcap_core_reads_repaired_and_split_bags(
    name: str, core: Callable[..., list[dict[str, Any]]], request: pytest.FixtureRequest
) -> None:
    folder, found = request.getfixturevalue(name), {}
    for document in core(*bag_files(folder)):
        found.update(zip(document['stamps'], document['wrench'], strict=True))
        assert set(document['attachments']) >= {'scenario.yaml', 'vehicle.yaml', 'params.yaml'}
    assert_as_ours(folder, found)
