"""Files that are no bags, or damaged ones: one line that names file and reason, nothing else."""

import pytest
from helpers.foreign_bags import (
    UNNAMED,
    Maker,
    loaded,
    motion,
    simple,
    simulated,
    write,
    write_chunks,
)
from mcap.writer import Writer as McapWriter

from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.load import load_run
from auv_analysis.bag.metadata import Definition, files_of, is_csv, is_mcap
from auv_analysis.bag.output import Storage
from auv_analysis.bag.writer import BagWriter
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError

KEYS = {'odometry': '/o', 'wrench': '/w', 'frames': 'enu_flu'}


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=0.5)


def listed(run: Run, maker: Maker) -> list:
    return simple(motion(run, enu=True), maker, '/o', '/w', UNNAMED)


@pytest.mark.parametrize('count', [1, 2])
def test_a_motion_of_one_or_two_messages_is_refused(count, run, tmp_path) -> None:
    maker, few = Maker(), motion(run, enu=True, keep=slice(count))
    path = write(tmp_path / 'dive', simple(few, maker, '/o', '/w', UNNAMED), maker)
    with pytest.raises(InputError) as refusal:
        loaded(path, **KEYS)
    assert '/o' in str(refusal.value)


def test_files_whose_names_end_in_what_is_no_number(run, tmp_path) -> None:
    """The superscript is a digit of Unicode, and none of a number."""
    path = write(tmp_path / 'dive', listed(run, Maker()), Maker())
    [file] = files_of(path)
    copies = [path / f'{file.stem}_{end}.mcap' for end in ('²', '1')]
    for copy in copies:
        copy.write_bytes(file.read_bytes())
    (path / 'metadata.yaml').unlink()
    assert files_of(path) == [*sorted([file, copies[0]]), copies[1]]


@pytest.mark.parametrize('name', ['x.db3', 'x.bag', 'x.mcap'])
@pytest.mark.parametrize('data', [b'', b'no bag at all', b'SQLite format 3\0', b'#ROSBAG V2.0\n'])
def test_what_is_no_bag_is_refused(name, data, tmp_path) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError) as refusal:
        loaded(path, **KEYS)
    assert str(path) in str(refusal.value)


@pytest.mark.parametrize(('name', 'is_ours'), [
    ('x.mcap', True), ('x.db3', False), ('x_0.db3.zstd', False), ('x_0.mcap.zstd', False),
])  # fmt: skip
def test_a_table_beside_a_bag_is_no_bag(name, is_ours, tmp_path) -> None:
    for one in (name, 'dive.csv'):
        (tmp_path / one).write_bytes(b'')
    assert (is_csv(tmp_path), is_mcap(tmp_path)) == (False, is_ours)


def test_a_link_among_the_files_of_a_killed_recorder_is_refused(tmp_path) -> None:
    bag = tmp_path / 'bag'
    bag.mkdir()
    (tmp_path / 'secret.db3').write_bytes(b'')
    (bag / 'x_0.db3').symlink_to(tmp_path / 'secret.db3')
    with pytest.raises(InputError, match='a link to'):
        survey(bag)


def test_no_bag_is_refused(tmp_path) -> None:
    for path in (tmp_path, tmp_path / 'gone', tmp_path / ('x' * 300)):
        with pytest.raises(InputError, match=r'expected a bag: a folder, an \.mcap, a \.db3 or a'):
            is_mcap(path)


def test_a_damaged_ros_1_bag_is_refused(run, tmp_path) -> None:
    maker = Maker(ros1=True)
    path = write(tmp_path / 'whole', listed(run, maker), maker, kind='bag')
    data = path.read_bytes()
    for cut in (100, 4096, len(data) // 2, len(data) - 50):
        path.write_bytes(data[:cut])
        with pytest.raises(InputError) as refusal:
            loaded(path, **KEYS)
        assert str(path) in str(refusal.value)


def test_a_damaged_chunk_ends_an_mcap(run, tmp_path) -> None:
    path = write_chunks(tmp_path / 'x.mcap', listed(run, Maker()), Maker())
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 255
    path.write_bytes(data)
    found = loaded(path, **KEYS)
    assert any('damaged' in note for note in found.notes)
    assert found.samples < run.samples


def test_a_type_without_a_package_is_named_and_nobodys(tmp_path) -> None:
    bag = BagWriter(tmp_path / 'bag', {}, Storage('none'))
    bag.add_channel(Definition('/o', 'Odometry'), 'float64 x')
    bag.write('/o', 0, bytes(12))
    bag.close()
    path = tmp_path / 'bag' / 'bag_0.mcap'
    assert survey(path).types == {'/o': 'Odometry'}
    with pytest.raises(InputError, match='/o: expected'):
        loaded(path, odometry='/o', wrench='/o', frames='enu_flu')


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3', 'bag'])
def test_results_must_not_overwrite_the_files_of_a_bag(kind, run, tmp_path) -> None:
    maker = Maker(ros1=kind == 'bag')
    path = write(tmp_path / 'dive', listed(run, maker), maker, kind=kind)
    found = files_of(path)
    assert found
    assert all(file.is_file() for file in found)


def test_messages_of_another_definition_are_refused(run, tmp_path) -> None:
    path = tmp_path / 'x.mcap'
    writer = McapWriter(str(path))
    writer.start(profile='ros2', library='test')
    for topic, kind in (('/o', 'nav_msgs/msg/Odometry'), ('/w', 'geometry_msgs/msg/Wrench')):
        schema = writer.register_schema(kind, 'ros2msg', b'float64 depth\n')
        channel = writer.register_channel(topic, 'cdr', schema)
        writer.add_message(channel, 0, b'\0\1\0\0' + bytes(8), 0)
    writer.finish()
    with pytest.raises(InputError, match='/o: expected messages of its type, found'):
        loaded(path, **KEYS)


@pytest.mark.parametrize(('language', 'encoding'), [('ros2msg', 'json'), ('jsonschema', 'cdr')])
def test_an_odometry_of_ours_that_nobody_can_decode_is_named(language, encoding, tmp_path) -> None:
    writer = McapWriter(str(tmp_path / 'x.mcap'))
    writer.start(profile='', library='test')
    schema = writer.register_schema('nav_msgs/msg/Odometry', language, b'{}')
    writer.add_message(writer.register_channel('/odom', encoding, schema), 0, b'{}', 0)
    writer.finish()
    found = f'found messages in {encoding}, a definition in {language}'
    with pytest.raises(InputError, match=f'/odom: expected cdr, with .*, {found}'):
        load_run(tmp_path / 'x.mcap')


@pytest.mark.parametrize(
    ('language', 'encoding'), [('jsonschema', 'json'), ('protobuf', 'protobuf')]
)
def test_other_encodings_are_refused(language, encoding, tmp_path) -> None:
    path = tmp_path / 'x.mcap'
    writer = McapWriter(str(path))
    writer.start(profile='', library='test')
    schema = writer.register_schema('nav_msgs/msg/Odometry', language, b'{}')
    other = writer.register_schema('geometry_msgs/msg/Wrench', language, b'{}')
    for topic, one in (('/o', schema), ('/w', other)):
        writer.add_message(writer.register_channel(topic, encoding, one), 0, b'{}', 0)
    writer.finish()
    with pytest.raises(
        InputError, match=f'/o: expected a definition of its type, found messages in {encoding}'
    ):
        loaded(path, **KEYS)
