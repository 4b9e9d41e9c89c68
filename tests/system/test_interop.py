"""A bag of ours read by three readers that are not ours: equal values, whole schemas."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml
from harness import auv
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from auv_analysis.bag import load_run
from auv_dynamics import interface

HERE = Path(__file__).parent
CHECK = HERE / 'interop'


@pytest.fixture(scope='module')
def bag(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp('interop')
    scenario = root / 's.yaml'
    gains = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
    scenario.write_text(
        yaml.safe_dump({
            'name': 'interop', 'vehicle': 'herman2018', 'duration': 2.0, 'step': 0.01,
            'controllers': {'gvc': {'law': 'gvc', **gains}}, 'setpoint': {'surge': {'offset': 0.5}},
            'disturbance': {'kind': 'herman2018'},
        })
    )  # fmt: skip
    ended = auv('run', str(scenario), '--out', str(root / 'out'))
    assert ended.returncode == 0, ended.stderr
    return root / 'out' / 'gvc'


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
        assert reader.duration > 2_000_000_000 - 1
        chosen = [c for c in reader.connections if c.topic == '/wrench']
        rows = [
            (stamp, wrench_row(reader.deserialize(raw, c.msgtype)))
            for c, stamp, raw in reader.messages(connections=chosen)
        ]
    assert [stamp for stamp, _ in rows] == [k * 10_000_000 for k in range(201)]
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
    assert {'/clock', '/diagnostics', '/recorder/progress'} <= stamped
    for _, channel, message, decoded in found:
        header = getattr(decoded, 'header', None)
        time = header.stamp if header is not None else getattr(decoded, 'clock', None)
        if time is None:
            time = getattr(decoded, 'stamp', None)
        if time is None:  # a lifecycle event has no stamp: it is filed at the latest step
            continue
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


@pytest.mark.skipif(shutil.which('npm') is None, reason='npm is not installed')
def test_npm_mcap_core(bag: Path, tmp_path: Path) -> None:
    for name in ('package.json', 'read.mjs'):
        shutil.copy(CHECK / name, tmp_path)
    installed = subprocess.run(
        ['npm', 'install', '--no-audit', '--no-fund', '--silent'],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert installed.returncode == 0, installed.stderr
    ended = subprocess.run(
        ['node', 'read.mjs', str(mcap_of(bag))],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    document = json.loads(ended.stdout)
    run = load_run(bag)
    assert np.array_equal(document['wrench'], run.tau)
    assert document['stamps'] == [k * 10_000_000 for k in range(201)]
    assert document['counts']['/odom'] == 201
    assert set(document['attachments']) >= {'scenario.yaml', 'vehicle.yaml', 'params.yaml'}
