"""Bags that look like those of other systems: their topics, types, axes, clocks and containers."""

import shutil
import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
import zstandard
from helpers.foreign_bags import (
    Maker,
    Message,
    loaded,
    motion,
    nanoseconds,
    simple,
    simulated,
    write,
    write_chunks,
    written,
)
from mcap.writer import Writer as McapWriter
from numpy.testing import assert_allclose
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg

from auv_analysis.bag.any_bag import messages as messages_of
from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.load import load_run
from auv_analysis.bag.recover import recover
from auv_analysis.replay.played_bag import index_bag
from auv_analysis.replay.played_bag import messages as played_messages
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.thruster_curves import load_curve

Layout = tuple[list[Message], dict[str, Any]]


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=1.0)


def uuv_simulator(run: Run, maker: Maker) -> Layout:
    """Gazebo's ground truth, its velocity in earth axes, and a wrench without stamp."""
    m, messages = motion(run, enu=True, world=True), []
    for i, ns in enumerate(nanoseconds(m.t, epoch=172).tolist()):
        odometry = maker.odometry(ns, ('world', 'rexrov/base_link'), m, i)
        messages.append(('/rexrov/pose_gt', ns, odometry))
        messages.append(('/rexrov/thruster_manager/input', ns, maker.six('Wrench', m.tau[i])))
    return messages, {
        'odometry': {'topic': '/rexrov/pose_gt', 'twist_frame': 'world'},
        'wrench': '/rexrov/thruster_manager/input', 'frames': 'enu_flu',
    }  # fmt: skip


def mavros(run: Run, maker: Maker) -> Layout:
    """ENU and FLU, and set-points of the velocity in a Twist without stamp."""
    m = motion(run, enu=True)
    topics = '/mavros/local_position/odom', '/mavros/wrench'
    messages = simple(m, maker, *topics, ('map', 'base_link'))
    for i, ns in enumerate(nanoseconds(m.t).tolist()):
        setpoint = maker.six('Twist', m.nu_d[i])
        messages.append(('/mavros/setpoint_velocity/cmd_vel_unstamped', ns, setpoint))
    return messages, {
        'odometry': topics[0], 'wrench': topics[1], 'frames': 'enu_flu',
        'setpoint': '/mavros/setpoint_velocity/cmd_vel_unstamped',
    }  # fmt: skip


def cola2(run: Run, maker: Maker) -> Layout:
    """NED, but a body frame that does not say so."""
    topics = '/girona500/navigator/odometry', '/girona500/controller/body_force_req'
    frames = 'world_ned', 'girona500/base_link'
    messages = simple(motion(run, enu=False), maker, *topics, frames)
    return messages, {'odometry': topics[0], 'wrench': topics[1], 'frames': 'ned_fsd'}


def vortex(run: Run, maker: Maker) -> Layout:
    """A navigation of its own and a controller in other axes than the navigation."""
    navigation, control = motion(run, enu=True), motion(run, enu=False)
    topics = '/nucleus/odom', '/thrust/wrench_input'
    messages = simple(navigation, maker, *topics, ('odom', 'base_link'), control)
    return messages, {
        'odometry': {'topic': topics[0], 'frames': 'enu_flu'},
        'wrench': {'topic': topics[1], 'frames': 'ned_fsd'},
    }


def apart(run: Run, maker: Maker) -> Layout:
    """Pose and velocity as topics of their own, with covariances, and a filter's set-point."""
    m, messages = motion(run, enu=True), []
    for i, ns in enumerate(nanoseconds(m.t).tolist()):
        pose = maker.covariant('Pose', maker.pose(m.position[i], m.attitude[i]))
        twist = maker.covariant('Twist', maker.six('Twist', m.twist[i]))
        wrench, setpoint = maker.six('Wrench', m.tau[i]), maker.six('Twist', m.nu_d[i])
        for topic, name, frame, value in (
            ('/ekf/pose', 'PoseWithCovariance', 'map', pose),
            ('/dvl/twist', 'TwistWithCovariance', 'base_link', twist),
            ('/thrusters/wrench', 'Wrench', 'base_link', wrench),
            ('/cmd/twist', 'Twist', 'base_link', setpoint),
        ):
            messages.append((topic, ns, maker.stamped(name, ns, frame, value)))
    return messages, {
        'pose': '/ekf/pose', 'twist': '/dvl/twist', 'wrench': '/thrusters/wrench',
        'setpoint': '/cmd/twist', 'frames': 'enu_flu',
    }  # fmt: skip


def simulated_clock(run: Run, maker: Maker) -> Layout:
    """Stamps of a simulator's clock, logged by the wall's, twice as fast; the wrench has none."""
    m, messages = motion(run, enu=True), []
    logged = nanoseconds(m.t / 2.0)
    for i, ns in enumerate(nanoseconds(m.t, epoch=12).tolist()):
        odometry = maker.odometry(ns, ('odom', 'base_link'), m, i)
        messages.append(('/odometry/filtered', logged[i], odometry))
        messages.append(('/wrench_cmd', logged[i], maker.six('Wrench', m.tau[i])))
    return messages, {
        'odometry': '/odometry/filtered',
        'wrench': '/wrench_cmd',
        'frames': 'enu_flu',
    }


LAYOUTS: list[Callable[[Run, Maker], Layout]] = [
    uuv_simulator, mavros, cola2, vortex, apart, simulated_clock,
]  # fmt: skip


@pytest.mark.parametrize(('layout', 'kind'), [
    *((layout, 'mcap') for layout in LAYOUTS),
    *((layout, kind) for layout in (apart, simulated_clock) for kind in ('sqlite3', 'bag')),
])  # fmt: skip
def test_layout(layout, kind, run, tmp_path) -> None:
    maker = Maker(ros1=kind == 'bag')
    messages, keys = layout(run, maker)
    file = tmp_path / 'map.yaml'
    file.write_text(yaml.safe_dump(keys | {'vehicle': 'rexrov', 'step': 0.01}))
    found = loaded(write(tmp_path / 'other', messages, maker, kind=kind), file)
    assert_allclose(found.t, run.t, atol=1e-9)
    assert_allclose(found.nu, run.nu, atol=1e-7)
    assert_allclose(found.eta, run.eta, atol=1e-7)
    assert_allclose(found.tau, run.tau, rtol=1e-9, atol=1e-6)
    if 'setpoint' in keys:
        assert_allclose(found.nu_d, run.nu_d, atol=1e-9)
    assert found.knows_setpoint == ('setpoint' in keys)


def test_frames_that_are_told_against_the_frame_ids_are_taken_with_a_note(run, tmp_path) -> None:
    messages, keys = cola2(run, Maker())
    told = keys | {'frames': 'enu_flu'}
    found = loaded(write(tmp_path / 'other', messages, Maker()), **told)
    assert any('frame_id world_ned taken as enu_flu, as told' in note for note in found.notes)
    assert_allclose(found.nu, run.nu * [1, -1, -1, 1, -1, -1], atol=1e-7)


def test_a_killed_recorder_leaves_files_without_metadata(run, tmp_path) -> None:
    messages, keys = cola2(run, Maker())
    bag = write(tmp_path / 'other', messages, Maker(), kind='sqlite3')
    (bag / 'metadata.yaml').unlink()
    assert loaded(bag, **keys).samples == run.samples
    (file,) = bag.glob('*.db3')
    assert loaded(file, **keys).samples == run.samples
    assert loaded(file, **keys, name='dive_7').scenario == 'dive_7'


def test_files_of_a_killed_recorder_are_read_by_their_numbers(run, tmp_path) -> None:
    seen, bag = motion(run, enu=False), tmp_path / 'killed'
    bag.mkdir()
    topics, frames = ('/o', '/w'), ('odom_ned', 'base_frd')
    for number in (1, 2, 10):  # 3 s after another: by their names, the clock would begin anew
        later = seen._replace(t=seen.t + 3.0 * number)
        part = write(tmp_path / f'{number}', simple(later, Maker(), *topics, frames), Maker(),
                     kind='sqlite3')  # fmt: skip
        next(part.glob('*.db3')).rename(bag / f'killed_{number}.db3')
    found = loaded(bag, odometry='/o', wrench='/w', frames='ned_fsd', step=0.01)
    assert found.samples == 3 * run.samples
    contents = survey(bag)
    assert contents.counts == dict.fromkeys(topics, 3 * run.samples)
    span = nanoseconds(seen.t[[0, -1]] + [3.0, 30.0]) + 2_000_000  # when they were logged
    assert [contents.first, contents.last] == span.tolist()
    assert not any('jumps back' in note for note in found.notes)
    told = yaml.safe_load((tmp_path / '1' / 'metadata.yaml').read_text())
    told['rosbag2_bagfile_information']['relative_file_paths'] = ['killed_1.db3']
    (bag / 'metadata.yaml').write_text(yaml.safe_dump(told))  # of before the others
    assert survey(bag).counts == contents.counts


def test_files_that_were_compressed_as_a_whole(run, tmp_path, monkeypatch) -> None:
    messages, keys = cola2(run, Maker())
    bag = write(tmp_path / 'other', messages, Maker(), kind='sqlite3')
    (file,) = bag.glob('*.db3')
    packed = file.with_name(f'{file.name}.zstd')
    packed.write_bytes(zstandard.ZstdCompressor().compress(file.read_bytes()))
    size = file.stat().st_size
    file.unlink()
    told = yaml.safe_load((bag / 'metadata.yaml').read_text())
    told['rosbag2_bagfile_information'] |= {
        'compression_mode': 'FILE', 'compression_format': 'zstd',
        'relative_file_paths': [packed.name],
    }  # fmt: skip
    (bag / 'metadata.yaml').write_text(yaml.safe_dump(told))
    assert loaded(bag, **keys).samples == run.samples
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: SimpleNamespace(free=size))
    assert sum(survey(bag).counts.values()) == 2 * run.samples
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: SimpleNamespace(free=size - 1))
    with pytest.raises(InputError, match=f'at most the {size - 1} bytes .* found {size} bytes'):
        survey(bag)


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3'])
def test_of_a_recorder_that_was_killed_while_it_compressed_files_none_is_left_out(
    kind, run, tmp_path
) -> None:
    messages, _ = cola2(run, Maker())
    bag = write(tmp_path / 'other', messages, Maker(), kind=kind)
    (bag / 'metadata.yaml').unlink()
    (file,) = bag.iterdir()
    packed = file.with_name(f'other_0{file.suffix}.zstd')
    packed.write_bytes(b'')
    for read in (survey, recover)[: 1 + (kind == 'mcap')]:
        with pytest.raises(InputError, match=f'{packed}: expected files that are all compressed'):
            read(bag)
    packed.with_suffix('').write_bytes(file.read_bytes())  # unpacked beside it
    assert sum(survey(bag).counts.values()) == 4 * run.samples


def test_what_a_killed_recorder_had_not_taken_into_its_database_is_not_left_out(
    run, tmp_path
) -> None:
    messages, _ = cola2(run, Maker())
    (file,) = write(tmp_path / 'one', messages, Maker(), kind='sqlite3').glob('*.db3')
    with closing(sqlite3.connect(file)) as recorder:
        recorder.execute('PRAGMA journal_mode=WAL')
        recorder.execute('DELETE FROM messages WHERE id % 2')
        recorder.commit()
        killed = Path(shutil.copytree(file.parent, tmp_path / 'killed'))
    (killed / 'metadata.yaml').unlink()
    copy = killed / file.name
    for path in (killed, copy):
        with pytest.raises(
            InputError, match=f'expected nothing in {file.name}-wal: sqlite3 {file.name}'
        ):
            survey(path)
    with closing(sqlite3.connect(copy)) as mended:
        mended.execute('PRAGMA wal_checkpoint')
    assert sum(survey(killed).counts.values()) == run.samples


@pytest.mark.parametrize(
    ('language', 'text'), [('unknown', b''), ('ros2msg', b''), ('ros2idl', b'module m {};')]
)
def test_types_of_ros_are_known_where_rosbag2_had_no_definition_of_them(
    language, text, run, tmp_path
) -> None:
    maker, m = Maker(), motion(run, enu=False)
    writer, channels = McapWriter(str(tmp_path / 'bag.mcap')), {}
    writer.start(profile='ros2', library='test')
    for topic, log, one in simple(m, maker, '/odom', '/wrench', ('odom_ned', 'base_link_fsd')):
        if topic not in channels:
            schema = writer.register_schema(one.__msgtype__, language, text)
            channels[topic] = writer.register_channel(topic, 'cdr', schema)
        data = bytes(maker.store.serialize_cdr(one, one.__msgtype__))
        writer.add_message(channels[topic], log, data, log)
    writer.finish()
    assert_allclose(load_run(tmp_path / 'bag.mcap', 'rexrov').tau, run.tau)
    if not text:
        found = loaded(tmp_path / 'bag.mcap', odometry='/odom', wrench='/wrench')
        assert_allclose(found.nu, run.nu, atol=1e-9)


@pytest.mark.parametrize('language', ['unknown', ''])
def test_a_database_without_a_definition_of_some_types_is_read(language, tmp_path) -> None:
    maker = Maker()
    maker.store.register(get_types_from_msg('float64 a\n', 'rov_msgs/msg/Own'))
    wrench = maker.stamped('Wrench', 0, 'base', maker.six('Wrench', np.arange(6.0)))
    both = [('/w', 0, wrench), ('/own', 0, maker.new('rov_msgs/msg/Own', 1.0))]
    bag = write(tmp_path / 'bag', both, maker, kind='sqlite3')
    (file,) = bag.glob('*.db3')
    empty = "UPDATE message_definitions SET encoding = ?, encoded_message_definition = ''"
    with closing(sqlite3.connect(file)) as recorder:
        recorder.execute(empty, (language,))
        recorder.commit()
    for path in (bag, file):
        assert survey(path).counts == {'/w': 1, '/own': 1}
        assert [one.message.wrench.torque.z for one in messages_of(path, ['/w'], [])] == [5.0]
        with pytest.raises(InputError, match=r'/own: expected .* found none of rov_msgs/msg/Own'):
            next(messages_of(path, ['/own'], []))


def test_an_mcap_that_was_not_finished_is_read_as_far_as_it_goes(run, tmp_path) -> None:
    messages, keys = cola2(run, Maker())
    file = write_chunks(tmp_path / 'killed.mcap', messages, Maker())
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    found = loaded(file, **keys)
    assert 'was not finished' in found.notes[0]
    assert 1 < found.samples < run.samples


def test_mcap_files_that_were_compressed_as_a_whole(run, tmp_path) -> None:
    messages, keys = cola2(run, Maker())
    bag, maker = tmp_path / 'bag', Maker()
    writer = Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    written(bag, writer, messages, maker.store.serialize_cdr, maker)
    (file,) = bag.glob('*.zstd')
    data = zstandard.ZstdDecompressor().decompressobj().decompress(file.read_bytes())
    file.write_bytes(zstandard.ZstdCompressor().compress(data))  # rosbag2 says the size in front
    assert_allclose(loaded(bag, **keys).nu, run.nu, atol=1e-7)
    (bag / 'metadata.yaml').unlink()
    with pytest.raises(InputError, match=r'expected a metadata\.yaml beside compressed files'):
        survey(bag)


def test_messages_that_were_compressed_one_by_one(run, tmp_path) -> None:
    maker, m = Maker(), motion(run, enu=False)
    ours = simple(m, maker, '/odom', '/wrench', ('odom_ned', 'base_link_fsd'))
    bag = tmp_path / 'bag'
    writer = Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    written(bag, writer, ours, maker.store.serialize_cdr, maker)
    found = loaded(bag, odometry='/odom', wrench='/wrench')
    assert_allclose(found.nu, run.nu, atol=1e-9)
    assert_allclose(load_run(bag, 'rexrov').tau, run.tau)
    (bag / 'metadata.yaml').unlink()
    assert recover(bag).metadata == 'written'
    with AnyReader([bag]) as reader:  # which takes it from there that they are compressed
        stamps = [reader.deserialize(data, one.msgtype).header.stamp
                  for one, _, data in reader.messages()]  # fmt: skip
    assert len(stamps) == 2 * run.samples
    played = list(played_messages(index_bag(bag), ['/odom', '/wrench']))
    assert {message.data[:4] for message in played} == {b'\0\1\0\0'}


def test_mcap_of_ros_1(run, tmp_path) -> None:
    maker = Maker(ros1=True)
    messages, keys = mavros(run, maker)
    found = loaded(write_chunks(tmp_path / 'dive 1.mcap', messages, maker), **keys, step=0.01)
    assert_allclose(found.nu, run.nu, atol=1e-7)
    assert found.scenario == 'dive_1'


def numbers_on_a_topic(run: Run, numbers: Iterable[np.ndarray], name: str = 'Float64MultiArray'):
    """Odometry of a run on /o, and an array on /thrusts."""
    maker, m = Maker(), motion(run, enu=False)
    messages = [
        message for message in simple(m, maker, '/o', '/w', ('odom_ned', 'base_frd'))
        if message[0] == '/o'
    ]  # fmt: skip
    for ns, row in zip(nanoseconds(m.t).tolist(), numbers, strict=True):
        if name == 'JointState':
            none = np.zeros(0)
            message = maker.new(
                'sensor_msgs/msg/JointState', maker.header(ns, ''), [], none, none, row
            )
        else:
            layout = maker.new('std_msgs/msg/MultiArrayLayout', [], 0)
            data = row.astype(np.float32 if '32' in name else float)
            message = maker.new(f'std_msgs/msg/{name}', layout, data)
        messages.append(('/thrusts', ns, message))
    return messages, maker


@pytest.mark.parametrize('name', ['Float64MultiArray', 'Float32MultiArray', 'JointState'])
def test_thrusts_become_the_wrench_of_the_vehicle_file(name, run, tmp_path) -> None:
    vehicle = load_vehicle('bluerov2_heavy')
    assert vehicle.thrusters is not None
    u = np.random.default_rng(0).uniform(-20.0, 20.0, (run.samples, len(vehicle.thrusters.names)))
    bag = write(tmp_path / 'other', *numbers_on_a_topic(run, u, name))
    keys = {'odometry': '/o', 'thrusters': '/thrusts', 'step': 0.01}
    found = loaded(bag, **keys, vehicle='bluerov2_heavy')
    assert_allclose(found.tau, u @ vehicle.thrusters.matrix.T, rtol=1e-5, atol=1e-4)
    with pytest.raises(InputError, match=r'thrusters: expected the thrusters.*found nothing'):
        loaded(bag, **keys)


@pytest.mark.parametrize(('last', 'line'), [
    (5, r'/thrusts: expected 8 numbers, one per thruster of bluerov2_heavy, found 5$'),
    (4, r'/thrusts: expected 5 numbers in each message, found 4$'),
])  # fmt: skip
def test_thrusts_of_another_number_are_refused(last, line, run, tmp_path) -> None:
    part = run.part(slice(3))
    numbers = [np.ones(5), np.ones(5), np.ones(last)]
    bag = write(tmp_path / 'other', *numbers_on_a_topic(part, numbers))
    with pytest.raises(InputError, match=line):
        loaded(bag, odometry='/o', thrusters='/thrusts', vehicle='bluerov2_heavy')


def test_pulse_widths_become_a_wrench_by_a_curve(run, tmp_path) -> None:
    vehicle, curve = load_vehicle('bluerov2_heavy'), load_curve('t200_16v')
    assert vehicle.thrusters is not None
    mirrored = np.isin(np.arange(8), [2, 4])
    u = np.random.default_rng(0).uniform(-30.0, 30.0, (run.samples, 8))
    u[:20, 0], u[:4, 1], u[4:10, 1] = 0.0, curve.thrusts[0], curve.thrusts[-1]
    bag = write(tmp_path / 'other', *numbers_on_a_topic(run, curve.command(u, mirrored)))

    def read(**entry: Any) -> Run:
        entry = {'topic': '/thrusts', 'curve': 't200_16v', 'reversed': ['T3', 5]} | entry
        return loaded(bag, odometry='/o', thrusters=entry, step=0.01, vehicle='bluerov2_heavy')

    found = read()
    assert_allclose(found.tau, u @ vehicle.thrusters.matrix.T, atol=1e-9)
    (note,) = (note for note in found.notes if 'pwm_us into N by t200_16v, a steady curve' in note)
    assert '2.48 % of the commands without thrust, 1.24 % at its ends' in note
    wrong = read(reversed=[]).tau - found.tau
    assert np.abs(wrong).max() > 10.0
    for entry, expected in (
        ({'curve': 't100'}, 'curve: expected a .csv file, or one of t200_10v'),
        ({'reversed': ['T9']}, 'thrusters.reversed: expected one of T1, .*, or 1 to 8, found T9'),
        ({'curve': ''}, 'thrusters.curve: expected a shipped thruster curve'),
    ):
        with pytest.raises(InputError, match=expected):
            read(**entry)


def test_a_curve_lies_beside_its_mapping_file(run, tmp_path) -> None:
    u = np.full((run.samples, 8), 50.0)
    bag = write(tmp_path / 'other', *numbers_on_a_topic(run, u))
    (tmp_path / 'bench.csv').write_text('percent,thrust_n\n-100,-30\n-5,0\n5,0\n100,38\n')
    (tmp_path / 'map.yaml').write_text(
        'odometry: /o\nthrusters: {topic: /thrusts, curve: bench.csv}\nvehicle: bluerov2_heavy\n'
    )
    found = loaded(bag, tmp_path / 'map.yaml')
    assert_allclose(found.tau[:, 2], 4 * 18.0, rtol=1e-12)  # four of eight push down


def test_the_wrench_that_was_applied_explains_the_motion(run, tmp_path) -> None:
    maker, m = Maker(), motion(run, enu=False)
    messages = simple(m, maker, '/o', '/applied', ('odom_ned', 'base_fsd'))
    for i, ns in enumerate(nanoseconds(m.t).tolist()):
        wrench = maker.stamped('Wrench', ns, 'base_fsd', maker.six('Wrench', 3.0 * m.tau[i]))
        messages.append(('/asked', ns, wrench))
    keys = {'odometry': '/o', 'wrench': '/asked', 'step': 0.01}
    bag = write(tmp_path / 'other', messages, maker)
    both, asked = loaded(bag, **keys, wrench_applied='/applied'), loaded(bag, **keys)
    assert both.acting
    assert_allclose(both.tau, 3.0 * run.tau, rtol=1e-9)
    assert_allclose(both.tau_applied, run.tau, rtol=1e-9)
    apart = asked.unexplained - both.unexplained
    assert np.abs(apart).max() > 100.0 * np.abs(both.unexplained_error).max()


def test_a_doubtful_twist_frame_is_said(run, tmp_path) -> None:
    maker = Maker()
    messages, keys = uuv_simulator(run, maker)
    bag = write(tmp_path / 'other', messages, maker)
    assert not [note for note in loaded(bag, **keys).notes if 'fits better' in note]
    told = keys | {'odometry': keys['odometry']['topic']}
    (note,) = [note for note in loaded(bag, **told).notes if 'fits better' in note]
    assert 'with twist_frame child' in note
    assert note.endswith('world fits better')


def test_a_position_above_the_water_is_said(run, tmp_path) -> None:
    maker, m = Maker(), motion(run, enu=True)
    up = m.position[:, 2]
    high = f'is {20.0 - up.max():.3g} to {20.0 - up.min():.3g} m above its origin'
    for frames, shift, said in (
        ('ned_fsd', 20.0, [high]), ('enu_flu', 20.0, []), ('ned_fsd', up.mean(), []),
    ):  # fmt: skip
        moved = m._replace(position=m.position - [0.0, 0.0, shift])
        bag = tmp_path / f'{frames}{shift:.0f}'
        write(bag, simple(moved, maker, '/o', '/w', ('map', 'base')), maker)
        notes = loaded(bag, odometry='/o', wrench='/w', frames=frames).notes
        assert [high for note in notes if high in note] == said
        assert sum('above its origin' in note for note in notes) == len(said)


def test_the_name_is_that_of_the_bag_or_the_one_given(run, tmp_path) -> None:
    messages, keys = cola2(run, Maker())
    bag: Path = write(tmp_path / 'dive_7', messages, Maker())
    names = [loaded(bag, **keys, **more).controller for more in ({}, {'name': 'trial'})]
    assert names == ['dive_7', 'trial']
