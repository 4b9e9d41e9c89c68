"""Messages of any type, read by paths to their fields, in other units, out of several topics."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.foreign_bags import SECOND, loaded, nanoseconds, simulated, write, write_chunks
from helpers.foreign_logs import SENSORS, every, maker
from helpers.made_messages import Bag, geometry, header, new, serialized
from numpy.testing import assert_allclose

from auv_analysis.bag.any_bag import decoder
from auv_analysis.bag.foreign_fields import (
    FieldError,
    MessageReader,
    are_usable,
    factor,
    numbers,
    presets,
)
from auv_analysis.bag.foreign_messages import read_sources
from auv_analysis.bag.foreign_topics import read_mapping
from auv_analysis.bag.foreign_tracks import tracks_of
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError

JOINTS = 'sensor_msgs/msg/JointState'


def written(keys: dict[str, Any], folder: Path) -> Path:
    file = folder / 'map.yaml'
    file.write_text(yaml.safe_dump(keys))
    return file


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=1.0)


def bag_of(run: Run, folder: Path) -> Path:
    make = maker()
    return write(folder / 'dive', every(run, make), make)


@pytest.fixture(scope='module')
def dive(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bag_of(run, tmp_path_factory.mktemp('whole'))


@pytest.fixture(scope='module')
def short_dive(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bag_of(run.part(slice(30)), tmp_path_factory.mktemp('short'))


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3', 'bag', 'chunks', 'chunks of ROS 1'])
def test_a_motion_out_of_five_topics_of_nobodys_types(kind, run, tmp_path) -> None:
    make = maker(ros1=kind in ('bag', 'chunks of ROS 1'))
    messages = every(run, make)
    if kind.startswith('chunks'):
        bag = write_chunks(tmp_path / 'dive.mcap', messages, make)
    else:
        bag = write(tmp_path / 'dive', messages, make, kind=kind)
    found = loaded(bag, written(SENSORS, tmp_path))
    assert_allclose(found.t, run.t, atol=1e-9)
    assert_allclose(found.nu, run.nu, atol=1e-12)
    assert_allclose(found.eta, run.eta, atol=1e-12)
    assert_allclose(found.tau, run.tau, rtol=1e-12)
    notes = '\n'.join(found.notes)
    assert '/imu: every stamp is zero, so the time of logging is taken' in notes
    assert '/imu: p, q, r in deg/s, turned into rad/s' in notes
    assert '/force: X in kN, turned into N; ' in notes


def test_unused_bytes_behind_empty_sequences_are_not_read() -> None:
    """As rmw_fastrtps_cpp serializes thrusts that have neither position nor velocity."""
    none = np.zeros(0)
    message = new(JOINTS, header(0, ''), [], none, none, np.array([1.0, 2.0]))
    decode = decoder(JOINTS, '', 'msg', 'cdr')
    for little in (True, False):
        data = serialized(message, little=little)
        assert decode(data + b'\xff' * 12).effort.tolist() == [1.0, 2.0]
        for wrong, said in (
            (data + bytes(20), '20 bytes behind a message of 48'),
            (data[:-1], r'(?i)buffer|sequence'),
            (b'\0\7' + data[2:], 'CDR of kind 0007'),
        ):
            with pytest.raises(Exception, match=said):
                decode(wrong)
    layout, kind = new('std_msgs/msg/MultiArrayLayout', [], 0), 'std_msgs/msg/UInt8MultiArray'
    data = serialized(new(kind, layout, np.zeros(0, np.uint8)))
    with pytest.raises(ValueError, match='4 bytes behind a message of 12'):
        decoder(kind, '', 'msg', 'cdr')(data + bytes(4))


def test_a_definition_may_have_line_ends_of_windows() -> None:
    text = 'std_msgs/Header header  # stamped\r\nfloat64 newton\r\n'
    text += '=' * 80 + '\r\nMSG: std_msgs/Header\r\nuint32 seq\r\n'
    read = decoder('rov_msgs/msg/Thrust', text, 'msg', 'cdr')
    assert read(b'\0\1\0\0' + bytes(8) + np.float64(2.5).tobytes()).newton == 2.5


def test_a_definition_may_be_idl() -> None:
    text = ''
    for name, fields in (
        ('Level', 'double m;'), ('Depth', 'rov_msgs::msg::Level level; double rate;'),
    ):  # fmt: skip
        text += '=' * 80 + f'\nIDL: rov_msgs/msg/{name}\n'
        text += f'module rov_msgs {{ module msg {{ struct {name} {{ {fields} }}; }}; }};\n'
    found = decoder('rov_msgs/msg/Depth', text, 'idl', 'cdr')(
        b'\0\1\0\0' + np.array([2.5, -1.5]).tobytes()
    )
    assert (found.level.m, found.rate) == (2.5, -1.5)


@pytest.mark.parametrize(('name', 'unit', 'size'), [
    ('x', 'cm', 0.01), ('y', 'mm', 1e-3), ('z', 'ft', 0.3048), ('phi', 'deg', 0.01745329),
    ('u', 'cm/s', 0.01), ('v', 'mm/s', 1e-3), ('w', 'kn', 0.5144444), ('p', 'deg/s', 0.01745329),
    ('X', 'kN', 1e3), ('Y', 'kgf', 9.80665), ('K', 'kN m', 1e3),
])  # fmt: skip
def test_a_unit_is_so_many_of_the_si_unit_where_it_fits(name, unit, size) -> None:
    for units in (unit, {name: unit}):
        assert factor(name, units) == pytest.approx(size, rel=1e-6)
    assert factor('psi' if name != 'phi' else 'x', unit) == 1.0


def test_a_stamped_pose_is_known_without_paths() -> None:
    pose = geometry('Pose', geometry('Point', 1, 2, 3), geometry('Quaternion', 5, 6, 7, 4))
    read = MessageReader('pose', presets('pose')['geometry_msgs/msg/PoseStamped'], '', None)
    found = read(geometry('PoseStamped', header(9, 'map'), pose))
    assert (found.stamp, found.frame, found.row) == (9, 'map', (1, 2, 3, 4, 5, 6, 7))


@pytest.mark.parametrize('unset', [2**64 - 1, -(2**70)])
def test_a_message_whose_time_is_none_is_left_out(unset: int) -> None:
    read = MessageReader('pose', {'z': 'z'}, {}, ('at', 'ns'))
    known = 2**60 + 1  # more digits than a float has
    one, other = (read(SimpleNamespace(at=at, z=1.0)) for at in (np.uint64(known), unset))
    assert (one.stamp, one.row) == (known, (1.0,))
    assert other.stamp == 0
    assert np.isnan(other.row).all()


def test_a_stamp_may_be_a_time_and_a_number_the_same_in_every_message() -> None:
    read = MessageReader('pose', {'z': 'z', 'x': 2.5}, {}, ('at', 's'))
    found = read(SimpleNamespace(at=SimpleNamespace(sec=3, nanosec=4), z=1.5))
    assert (found.stamp, found.row) == (3 * SECOND + 4, (2.5, 1.5))


def test_numbers_are_those_of_a_message_itself_and_no_truth_values() -> None:
    message = SimpleNamespace(_size=1, on=True, few=[2.0, 3.0], many=np.ones(65), text='4')
    assert list(numbers(message)) == [('few[0]', 2.0), ('few[1]', 3.0)]
    with pytest.raises(FieldError, match='on, which is bool'):
        MessageReader('pose', {'z': 'on'}, {}, None)(message)
    with pytest.raises(FieldError, match='text, which is str') as refusal:
        MessageReader('pose', {'z': 'few[0]'}, {}, ('text', 's'))(message)
    assert refusal.value.args[0] == 'stamp'


def test_rows_of_nothing_and_of_absurd_numbers_are_of_no_use() -> None:
    rows = np.full((3, 6), np.nan)
    assert not are_usable(rows, 'wrench').any()
    rows[:, 2] = -1.0, -1e200, np.inf
    assert are_usable(rows, 'wrench').tolist() == [True, False, False]


def test_an_imu_is_known_without_paths(run, dive, tmp_path) -> None:
    attitude = {'topic': '/imu', 'frames': 'enu_flu'}
    found = loaded(dive, written(SENSORS | {'pose': [attitude, *SENSORS['pose'][1:]]}, tmp_path))
    assert_allclose(found.eta, run.eta, atol=1e-12)


def test_topics_have_their_own_rates(run, tmp_path) -> None:
    """The velocity has the stamps of the slower DVL, and the means of the rates about them."""
    make = maker()
    messages = every(run, make, {'/dvl': 10, '/depth': 4, '/fix': 20, '/force': 2})
    bag, mapping = write(tmp_path / 'dive', messages, make), read_mapping(None, SENSORS)
    tracks, _ = tracks_of(read_sources(bag, mapping, []), mapping, load_vehicle('rexrov'), [])
    twist, pose = tracks['twist'], tracks['pose']
    assert len(pose.ns) == 101
    assert_allclose((twist.ns - twist.ns[0]) / SECOND, 0.1 * np.arange(9))
    assert_allclose(twist.rows[:, :3], run.nu[10:91:10, :3], atol=1e-12)
    weights = np.array([0.5, *[1.0] * 9, 0.5]) / 10.0  # trapezia over a tenth of a second
    means = [weights @ run.nu[k - 5 : k + 6, 3:] for k in range(10, 91, 10)]
    assert_allclose(twist.rows[:, 3:], means, atol=1e-12)


def test_a_pause_of_one_topic_is_a_pause_of_what_it_is_part_of(run, tmp_path) -> None:
    make = maker()
    ns = nanoseconds(run.t)
    messages = [m for m in every(run, make) if not (m[0] == '/dvl' and ns[30] < m[1] < ns[70])]
    found = loaded(write(tmp_path / 'dive', messages, make), written(SENSORS, tmp_path))
    ((begin, end),) = found.gaps
    assert (begin, end) == pytest.approx((0.3, 0.7), abs=1e-6)


def test_thrusts_of_several_topics_in_their_order(run, tmp_path) -> None:
    vehicle = load_vehicle('bluerov2_heavy')
    assert vehicle.thrusters is not None
    make = maker()
    u = np.random.default_rng(0).uniform(-20.0, 20.0, (run.samples, 8))
    messages = every(run, make)
    for i, ns in enumerate(nanoseconds(run.t).tolist()):
        motors = [make.new('rov_msgs/msg/Motor', value / 9.80665) for value in u[i, :6]]
        messages.append(
            ('/motors', ns, make.new('rov_msgs/msg/Motors', make.header(ns, ''), motors))
        )
        tilt = make.new('rov_msgs/msg/Tilt', ns // 1000, -u[i, 6:])
        messages.append(('/vertical', ns, tilt))
    keys = {key: value for key, value in SENSORS.items() if key != 'wrench'}
    keys |= {'vehicle': 'bluerov2_heavy', 'thrusters': [
        {'topic': '/motors', 'fields': [f'motors[{i}].thrust' for i in range(6)], 'units': 'kgf'},
        {'topic': '/vertical', 'fields': '-deg'},
    ]}  # fmt: skip
    apart = [  # of the second one half a step later, and so each change of either is one
        (topic, ns + (topic == '/vertical') * SECOND // 200, m) for topic, ns, m in messages
    ]
    bag, mapping = write(tmp_path / 'apart', apart, make), read_mapping(None, keys)
    sources = read_sources(bag, mapping, [])
    tracks, _ = tracks_of(sources, mapping, load_vehicle('bluerov2_heavy'), [])
    assert_allclose(np.diff(tracks['wrench'].ns), SECOND / 200, atol=2000)
    found = loaded(write(tmp_path / 'dive', messages, make), written(keys, tmp_path))
    assert_allclose(found.tau, u @ vehicle.thrusters.matrix.T, rtol=1e-12, atol=1e-12)


def test_a_message_without_stamp_may_be_logged_at_any_time(tmp_path) -> None:
    kind, bag, notes = 'geometry_msgs/msg/Wrench', Bag(tmp_path / 'x.mcap'), list[str]()
    for k, ns in enumerate((5, 2**64 - 1)):
        force, torque = (geometry('Vector3', k, 10 * k, i) for i in (1, 2))
        bag.add('/tau', kind, ns, serialized(geometry('Wrench', force, torque)))
    keys = {'twist': {'topic': '/tau', 'fields': {'u': 'force.y'}}, 'wrench': '/tau'}
    found = read_sources(bag.close(), read_mapping(None, keys), notes)
    assert found['twist'].stamps.tolist() == [5, 2**62]
    assert found['wrench'].rows.tolist() == [[0, 0, 1, 0, 0, 2], [1, 10, 1, 1, 10, 2]]
    assert notes == ['/tau: messages without stamp, so the time of logging is taken'] * 2


DVL = SENSORS['twist'][0]


@pytest.mark.parametrize(('keys', 'line'), [
    ({'twist': [DVL | {'twist_frame': 'world'}], 'pose': SENSORS['pose'][1]},
     r'pose: expected all three angles.*found none for phi, theta, psi$'),
    ({'twist': [DVL | {'fields': {'u': 'velocity.q'}}, SENSORS['twist'][1]]},
     r'twist\[0\].fields.u: expected a path in its messages: header.*velocity.x.*found velocity.q'),
    ({'twist': [DVL | {'fields': {'u': 'velocity'}}, SENSORS['twist'][1]]},
     r'fields.u: expected a path to a number: velocity.x, velocity.y, velocity.z, found velo'),
    ({'twist': [DVL | {'fields': {'u': 'mode'}}, SENSORS['twist'][1]]},
     r'fields.u: expected a path to a number.*found mode, which is str'),
    ({'twist': [DVL, SENSORS['twist'][1], DVL]}, 'each component from one topic, found u in /dvl'),
    ({'pose': [SENSORS['pose'][0] | {'stamp': 'time_ns'}, *SENSORS['pose'][1:]]},
     r'pose\[0\].stamp: expected a path in its messages: time_us.*: time_us\), found time_ns'),
    ({'wrench': '/force'}, r'/force: expected geometry_msgs.*found rov_msgs/msg/Force, of which'),
    ({'wrench': SENSORS['wrench'] | {'topic': '/force2'}}, r'wrench: expected a topic.*: /force'),
    ({'rates': 'from attitude', 'pose': SENSORS['pose'][1]}, 'found none for phi, theta, psi'),
])  # fmt: skip
def test_paths_that_lead_nowhere_are_refused_in_one_line(keys, line, short_dive, tmp_path) -> None:
    with pytest.raises(InputError, match=line) as refusal:
        loaded(short_dive, written(SENSORS | keys, tmp_path))
    assert str(refusal.value).startswith(str(short_dive))


def test_without_angular_velocity_the_attitude_has_it(run, dive, tmp_path) -> None:
    keys = SENSORS | {'twist': DVL, 'rates': 'from attitude'}
    found = loaded(dive, written(keys, tmp_path))
    inner = slice(5, -5)
    assert_allclose(found.nu[inner, :3], run.nu[inner, :3], atol=1e-12)
    assert_allclose(found.nu[inner, 3:], run.nu[inner, 3:], atol=2e-3)


@pytest.mark.parametrize(('entry', 'line'), [
    ('{topic: /x, fields: {u: a, k: b}}', 'twist.fields.k: expected one of u, v, w, p, q, r'),
    ('{topic: /x, fields: [a, b]}', 'twist.fields: expected paths by u, v, w, p, q, r'),
    ('{topic: /x, fields: {u: --a}}', 'twist.fields.u: expected a path such as'),
    ('{topic: /x, fields: {}}', 'twist.fields: expected paths by component'),
    ('{topic: /x, units: deg}', r'twist.units: expected one of m/s, .*deg/s.*, found deg'),
    ('{topic: /x, units: 2}', 'twist.units: expected a unit, or units by component, found 2'),
    ('{topic: /x, units: {u: rad/s}}', 'twist.units.u: expected one of m/s, cm/s, mm/s, kn, found'),
    ('{topic: /x, units: {a: m/s}}', 'twist.units.a: expected one of u, v, w, p, q, r'),
    ('{topic: /x, stamp: {field: t, units: min}}', 'twist.stamp.units: expected s, ms, us or ns'),
    ('{topic: /x, stamp: {units: s}}', 'twist.stamp.field: expected a path, found nothing'),
    ('[]', 'twist: expected a topic with a velocity'),
    ('[/x, {topic: /y, unit: m/s}]', r'twist\[1\].unit: expected one of topic.*nearest: units'),
])  # fmt: skip
def test_a_wrong_entry_is_refused_in_one_line(entry, line, tmp_path) -> None:
    file = tmp_path / 'map.yaml'
    file.write_text(f'pose: /p\nwrench: /w\ntwist: {entry}\n')
    with pytest.raises(InputError, match=line):
        read_mapping(file, {})


@pytest.mark.parametrize(('entry', 'line'), [
    ('pose: {topic: /x, fields: {qw: a, qx: b}}', 'pose.fields: expected phi, theta, psi, or'),
    ('pose: {topic: /x, fields: {phi: a, qw: b}}', 'an attitude from one topic, found phi, qw'),
])  # fmt: skip
def test_half_an_attitude_is_refused(entry, line, tmp_path) -> None:
    file = tmp_path / 'map.yaml'
    file.write_text(f'{entry}\nwrench: /w\ntwist: /t\n')
    with pytest.raises(InputError, match=line):
        read_mapping(file, {})


TILT, DEPTH, FIX = SENSORS['pose']


@pytest.mark.parametrize(('keys', 'lacking'), [
    ({'twist': DVL}, ['p', 'q', 'r']),
    ({'twist': SENSORS['twist'][1]}, ['u', 'v', 'w']),
    ({'twist': SENSORS['twist'][1], 'rates': 'from attitude'}, ['u', 'v', 'w']),
    ({'pose': [TILT, DEPTH]}, ['x', 'y']),
    ({'pose': DEPTH}, ['x', 'y', 'phi', 'theta', 'psi']),
    ({'pose': None}, ['x', 'y', 'z', 'phi', 'theta', 'psi']),
    ({'twist': None, 'rates': 'from attitude'}, ['u', 'v', 'w']),
    ({'pose': [TILT | {'fields': {k: TILT['fields'][k] for k in ('phi', 'theta')}}, DEPTH, FIX]},
     ['psi']),
    ({'wrench': SENSORS['wrench'] | {'fields': {'Z': SENSORS['wrench']['fields']['Z']}}},
     ['tau_X', 'tau_Y', 'tau_K', 'tau_M', 'tau_N']),
])  # fmt: skip
def test_what_no_topic_gives_is_unknown(keys, lacking, run, dive, tmp_path) -> None:
    told = {key: value for key, value in (SENSORS | keys).items() if value is not None}
    found = loaded(dive, written(told, tmp_path))
    wrench = [f'tau_{axis}' for axis in 'XYZKMN']
    values = np.concatenate([found.eta, found.nu, found.tau], axis=1)
    names = ['x', 'y', 'z', 'phi', 'theta', 'psi', *'uvwpqr', *wrench]
    unknown = np.array([name in lacking for name in names])
    assert np.isnan(values[:, unknown]).all()
    inner = slice(5, -5)  # `rates` of the attitude are estimates
    truth = np.concatenate([run.eta, run.nu, run.tau], axis=1)
    k = np.searchsorted(run.t, found.t + 1e-9, 'right') - 1
    tolerance = 2e-3 if 'rates' in keys else 1e-9
    apart = np.abs(values[inner] - truth[k][inner])[:, ~unknown]
    assert np.all(apart <= tolerance * np.maximum(np.abs(truth).max(axis=0)[~unknown], 1.0))
    assert any(f'not recorded: {", ".join(lacking)}; ' in note for note in found.notes)
