"""`auv info` proposes a mapping file, with which a log can be read."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.foreign_bags import (
    UNNAMED,
    Maker,
    loaded,
    motion,
    nanoseconds,
    simple,
    simulated,
    write,
)
from helpers.foreign_logs import HEADS, SENSORS, columns, every, maker, text_of
from helpers.made_messages import SECOND, STRING, Bag, new, serialized, stamped
from numpy.testing import assert_allclose
from rosbags.typesys import get_types_from_msg

from auv_analysis.bag import proposal as proposing
from auv_analysis.bag.any_bag import messages, survey
from auv_analysis.bag.csv_logs import Span
from auv_analysis.bag.foreign_fields import presets
from auv_analysis.bag.foreign_topics import (
    candidates,
    other_odometries,
    read_mapping,
    with_candidates,
)
from auv_analysis.bag.proposal import Looked, component_of, looked_through, proposal, unit_of
from auv_analysis.bag.reading import BagContents
from auv_analysis.bag.step_topics import WRENCH, NotOursError
from auv_analysis.cli import main
from auv_analysis.runs.run import Run


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=1.0)


def proposed(bag: Path) -> tuple[str, dict[str, Any]]:
    contents = survey(bag)
    text = proposal(bag, contents, looked_through(bag, contents))
    return text, yaml.safe_load(text)


def saved(text: str, folder: Path, **more: Any) -> Path:
    file = folder / 'map.yaml'
    file.write_text(text + (yaml.safe_dump(more) if more else ''))
    return file


def test_a_table_is_read_by_what_is_proposed(run, tmp_path) -> None:
    path = tmp_path / 'dive.csv'
    path.write_text(HEADS['plain'][0] + text_of(columns(run)))
    text, _ = proposed(path)
    found = loaded(path, saved(text, tmp_path, vehicle='rexrov', step=0.01))
    assert_allclose(found.nu, run.nu, atol=1e-12)
    assert_allclose(found.eta, run.eta, atol=1e-12)
    assert_allclose(found.tau, run.tau, rtol=1e-12)


def test_topics_of_nobodys_types_are_found_by_their_names(run, tmp_path) -> None:
    make = maker()
    bag = write(tmp_path / 'dive', every(run, make), make)
    text, keys = proposed(bag)
    assert keys['pose'] == [
        {'topic': '/imu', 'frames': 'enu_flu'},
        {'topic': '/fix', 'fields': {'x': 'point.x', 'y': 'point.y'}},
        {'topic': '/depth', 'fields': {'z': 'depth_mm'}, 'units': 'mm'},
    ]
    assert keys['twist'] == [
        {'topic': '/dvl', 'fields': {'u': 'velocity.x', 'v': 'velocity.y', 'w': 'velocity.z'}},
        {'topic': '/imu', 'frames': 'enu_flu'},
    ]  # fmt: skip
    assert keys['wrench'] == {'topic': '/force', 'fields': SENSORS['wrench']['fields']}
    found = loaded(bag, saved(text, tmp_path, vehicle='rexrov', step=0.01))
    assert_allclose(found.nu[:, 0], run.nu[:, 0], atol=1e-12)


def test_an_odometry_of_zeros_is_left_out_and_said(run, tmp_path) -> None:
    make, m = Maker(), motion(run, enu=True)
    still = m._replace(twist=0.0 * m.twist)
    messages = simple(m, make, '/nav/odometry', '/rov/wrench', UNNAMED)
    for i, ns in enumerate(nanoseconds(m.t).tolist()):
        messages += [('/rov/odom', ns + k, make.odometry(ns, UNNAMED, still, i)) for k in range(2)]
        messages.append(('/cmd_vel', ns, make.six('Twist', m.twist[i])))
        messages += [('/nav2/odometry', ns, make.odometry(ns, UNNAMED, m, i))] * (i < 9)
    text, keys = proposed(write(tmp_path / 'dive', messages, make))
    assert keys['odometry'] == {'topic': '/nav/odometry'}
    assert keys['setpoint'] == {'topic': '/cmd_vel'}
    assert '# /nav2/odometry: an odometry as well\n' in text
    assert text.count('an odometry as well') == 1
    assert '# /rov/odom: no attitude or no velocity in it but zeros\n' in text
    assert 'frames: enu_flu    # the frame ids odom, base_link of /nav/odometry do not say' in text


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3', 'bag'])
def test_what_begins_late_is_seen(kind, run, tmp_path, monkeypatch) -> None:
    """A vehicle that stays on deck for two thirds of a recording; ranges in every third message."""
    monkeypatch.setattr(proposing, 'OF_TOPIC', 97)
    make, m = maker(ros1=kind == 'bag'), motion(run, enu=True)
    name = 'rov_msgs/msg/Sonar'
    make.store.register(get_types_from_msg('float64 t\nfloat64 depth\nfloat64[] ranges\n', name))
    still = m._replace(position=0.0 * m.position, twist=0.0 * m.twist)
    messages = []
    for k in range(300):
        ns, late = k * 2 * SECOND, k >= 200
        seen = make.odometry(ns, UNNAMED, m if late else still, k % 101)
        sonar = make.new(name, 2.0 * k, 30.0 * late, np.ones(int(k % 3 == 2)))
        messages += [('/odom', ns, seen), ('/sonar', ns, sonar)]
    bag = write(tmp_path / 'dive', messages, make, kind=kind)
    assert proposed(bag)[1]['odometry'] == {'topic': '/odom'}
    found = looked_through(bag, survey(bag))['/sonar']
    assert found.count == 97
    assert found.spans['depth'].high == 30.0
    assert found.stamp == ('t', 's')
    assert 31 < found.spans['ranges[0]'].filled < 34


def test_a_share_of_the_messages_of_some_topics_is_taken_evenly(tmp_path) -> None:
    bag = Bag(tmp_path / 'dive.mcap')
    for k in range(8):
        for topic in ('/a', '/b', '/c'):
            bag.add(topic, STRING, k, serialized(new(STRING, 'x')))
    found = [(one.topic, one.log_time) for one in
             messages(bag.close(), ['/a', '/b'], [], {'/a': 0.375})]  # fmt: skip
    assert [ns for topic, ns in found if topic == '/a'] == [0, 2, 5]
    assert [ns for topic, ns in found if topic == '/b'] == [*range(8)]


def test_constants_of_a_definition_are_no_fields(tmp_path) -> None:
    make = maker()
    for name, text in (
        ('Esc', 'uint8 IDLE=7\nfloat64 newton\n'),
        ('Escs', 'rov_msgs/Esc[] motors'),
    ):
        make.store.register(get_types_from_msg(text, f'rov_msgs/msg/{name}'))
    motors = [make.new('rov_msgs/msg/Esc', i + 1.0) for i in range(6)]
    message = make.new('rov_msgs/msg/Escs', motors)
    keys = proposed(write(tmp_path / 'dive', [('/esc', 0, message)], make))[1]
    assert keys['thrusters']['fields'] == [f'motors[{i}].newton' for i in range(6)]


def test_what_is_missing_is_a_comment(tmp_path) -> None:
    """A thesis: no position, empty rates, pulse widths, a filter's states beside them."""
    path = tmp_path / 'x.csv'
    head = 'time_ms;state_1;vel_x;vel_y;vel_z;roll [deg];pitch [deg];yaw [deg];gyro_x;motor1;motor2'
    rows = [f'{20 * i};7;0.1;{i};0;1;2;{i};;1500;{1500 + i}' for i in range(99)]
    path.write_text('\n'.join([head, *rows]))
    text, keys = proposed(path)
    stamp = {'field': 'time_ms', 'units': 'ms'}
    assert keys['pose']['units'] == 'deg'
    assert keys['rates'] == 'from attitude'
    assert keys['thrusters'] == {
        'topic': 'x', 'fields': ['motor1', 'motor2'], 'curve': 't200_16v', 'stamp': stamp,
    }  # fmt: skip
    assert '# pose: no topic was found with x, y, z\n' in text
    assert 'setpoint' not in text, 'a recording may lack it'
    path.write_text('\n'.join([head.replace('vel_z', 'other'), *rows]))
    assert '# twist: no topic was found with w\n' in proposed(path)[0]
    path.write_text('\n'.join(row.rsplit(';', 2)[0] for row in [head, *rows]))
    assert '# wrench or thrusters: no topic was found\n' in proposed(path)[0]
    read_mapping(saved(text, tmp_path), {})


def test_candidates_are_those_with_messages_the_likeliest_first() -> None:
    topics = {
        '/a/odom': ('nav_msgs/msg/Odometry', 5), '/b/odom': ('nav_msgs/msg/Odometry', 50),
        '/c/odom': ('nav_msgs/msg/Odometry', 0), '/ref/odom': ('nav_msgs/msg/Odometry', 2),
        '/cmd_vel': ('geometry_msgs/msg/Twist', 9),
        '/dvl': ('geometry_msgs/msg/TwistStamped', 7), '/tau': ('geometry_msgs/msg/Wrench', 9),
        '/a/tau': ('geometry_msgs/msg/Wrench', 9),
        '/thrusterInput': ('std_msgs/msg/Float64MultiArray', 9),
    }  # fmt: skip
    kinds = {topic: kind for topic, (kind, _) in topics.items()}
    contents = BagContents(types=kinds, counts={topic: n for topic, (_, n) in topics.items()})
    found = {role: names for role, names in candidates(contents).items() if names}
    assert found == {
        'odometry': ['/b/odom', '/a/odom', '/ref/odom'], 'twist': ['/dvl'],
        'wrench': ['/a/tau', '/tau'], 'setpoint': ['/cmd_vel'], 'thrusters': ['/thrusterInput'],
    }  # fmt: skip
    others = {'/a/odom': kinds['/a/odom'], '/sim/ground_truth/odom': kinds['/a/odom']}
    assert other_odometries(kinds | others, '/a/odom').endswith(
        '--odom /b/odom or /c/odom or /ref/odom'
    )


def test_what_is_called_wrench_is_likeliest_and_a_disturbance_is_no_wrench(tmp_path) -> None:
    bag = Bag(tmp_path / 'ours.mcap')
    names = ['/wrench_applied', '/disturbance', '/disturbance_estimate', '/analysis/delta_pi']
    for k in range(9):
        for topic in [*names, '/disturbance/tau', *['/auv/wrench'] * (k > 3)]:
            bag.add(topic, WRENCH, k * SECOND, serialized(stamped('Wrench', k * SECOND, range(6))))
    path = bag.close()
    found = candidates(survey(path))['wrench']
    assert found == ['/auv/wrench', '/wrench_applied', '/disturbance/tau']
    assert proposed(path)[1]['wrench'] == {'topic': '/auv/wrench'}


def test_a_disturbance_alone_is_not_taken_for_a_wrench(tmp_path) -> None:
    (tmp_path / 'run').mkdir()
    rows = [f'{k},{k},{2 * k},{3 * k}' for k in range(1, 9)]
    for name in ('disturbance', 'state'):
        path = tmp_path / 'run' / f'{name}.csv'
        path.write_text('\n'.join(['t,force_x,disturbance_force_y,yaw', *rows]))
    assert proposed(tmp_path / 'run')[1]['wrench']['topic'] == 'state'
    assert proposed(path)[1]['wrench']['fields'] == {'X': 'force_x'}
    path.rename(path.with_name('analysis.csv'))
    assert proposed(path.with_name('analysis.csv'))[1]['wrench']['fields'] == {'X': 'force_x'}


@pytest.mark.parametrize(('kinds', 'options'), [
    ({'/p': 'geometry_msgs/msg/PoseStamped', '/v': 'geometry_msgs/msg/TwistStamped',
      '/rov/pwm': 'std_msgs/msg/Float64MultiArray'},
     '--map FILE with pose /p and twist /v, --map FILE with thrusters /rov/pwm, {}'),
    ({'/cmd_vel': 'geometry_msgs/msg/Twist'},
     '--setpoint /cmd_vel, {} (the bag has no odometry and no wrench)'),
])  # fmt: skip
def test_a_refusal_names_the_options_that_would_map_the_topics(kinds, options, tmp_path) -> None:
    bag = Bag(tmp_path / 'dive.mcap')
    for topic, kind in kinds.items():
        bag.add(topic, kind, 0, bytes(12))
    found = with_candidates(NotOursError(bag.close(), 'odom', 'messages', None))
    more = options.format('--frames ned_fsd or enu_flu, --vehicle FILE')
    assert found.expected == f'messages, or of another system {more}'


@pytest.mark.parametrize(
    ('step', 'units'), [(20_000_000, 'ns'), (20_000, 'us'), (20, 'ms'), (0.02, None)]
)
def test_units_that_nobody_says_are_told_by_sizes(tmp_path, step, units) -> None:
    path = tmp_path / 'x.csv'
    rows = [f'{step * i:g},{i},{-i},{2 * i},{4 * i}' for i in range(99)]
    path.write_text('\n'.join(['t,gyro_x,gyro_y,gyro_z,yaw', *rows]))
    twist = proposed(path)[1]['twist']
    stamp = {'field': 't', 'units': units} if units else 't'
    assert (twist['stamp'], twist['units']) == (stamp, 'deg/s')


def test_units_below_the_head_are_believed(tmp_path) -> None:
    path = tmp_path / 'x.csv'
    rows = [f'{i},{i % 5},{i % 3},{i % 4},{i},{2 * i},{3 * i}' for i in range(50)]
    units = 'ms,deg,deg,deg,cm/s,cm/s,cm/s'
    path.write_text('\n'.join(['t,roll,pitch,yaw,u,v,w', units, *rows]))
    keys = proposed(path)[1]
    assert keys['twist']['stamp']['units'] == 'ms'
    assert (keys['pose']['units'], keys['twist']['units']) == ('deg', 'cm/s')


@pytest.mark.parametrize(('topic', 'path', 'component'), [
    ('/dvl', 'velocity.x', 'u'), ('log', 'vy', 'v'), ('log', 'surge_vel', 'u'), ('log', 'w', 'w'),
    ('/imu', 'angular_velocity.z', 'r'), ('log', 'rollspeed', 'p'),
    ('log', 'yaw rate (deg/s)', 'r'),
    ('log', 'gyroY', 'q'), ('log', 'Heading', 'psi'), ('/ahrs', 'rpy[1]', 'theta'),
    ('/state', 'pose.orientation.w', 'qw'), ('/state', 'pose.orientation.x', 'qx'),
    ('/imu', 'omega.y', 'q'), ('log', 'qy', 'qy'), ('log', 'q_x', 'qx'),
    ('/pressure', 'depth', 'z'), ('log', 'pos_north', 'x'), ('/tau', 'N', 'N'), ('log', 'Fz', 'Z'),
    ('/cmd', 'torque.x', 'K'), ('/wrench', 'data.yaw', 'N'),
    ('/imu', 'linear_acceleration.x', ''), ('/imu', 'velocity_covariance[0]', ''),
    ('/thrusters', 'force.x', ''), ('/ekf', 'state[0]', ''), ('log', 'N', ''), ('log', 'mag_x', ''),
])  # fmt: skip
def test_names_of_fields(topic, path, component) -> None:
    assert component_of(topic, path) == component


def test_words_for_vectors_and_their_axes() -> None:
    words = {
        'y': 'pos position pose usbl point local location',
        'v': 'vel velocity linear dvl speed v', 'q': 'gyro angular rate rates omega gyroscope',
        'Y': 'force f', 'M': 'torque moment', 'theta': 'rpy euler',
        'qy': 'orientation quaternion quat q',
    }  # fmt: skip
    for component, kinds in words.items():
        for kind in kinds.split():
            found = [component_of('log', f'{kind}{axis}') for axis in ('_y', '[1]', '_east')]
            assert found == [component] * 3, kind
    for kind in ('accel', 'acceleration', 'acc', 'mag', 'magnetic', 'bias'):
        assert not component_of('log', f'velocity.{kind}.y'), kind
    axes = {'u': ('_x', '[0]', '_north'), 'w': ('_z', '[2]', '_down'), 'p': ('[3]',), 'r': ('[5]',)}
    for component, ends in axes.items():
        assert [component_of('log', f'vel{end}') for end in ends] == [component] * len(ends)
    forces = [component_of('log', f'force[{i}]') for i in range(6)]
    assert forces == [*'XYZKMN']
    assert component_of('log', 'angvel_x') == 'p'


def test_words_for_turns_and_ways() -> None:
    turns = {'roll': 'phi', 'phi': 'phi', 'pitch': 'theta', 'theta': 'theta'}
    turns |= dict.fromkeys(('yaw', 'psi', 'heading'), 'psi')
    rates, moments = {'phi': 'p', 'theta': 'q', 'psi': 'r'}, {'phi': 'K', 'theta': 'M', 'psi': 'N'}
    for turn, angle in turns.items():
        paths = turn, f'{turn}rate', f'{turn}speed', f'tau_{turn}'
        found = [component_of('log', path) for path in paths]
        assert found == [angle, rates[angle], rates[angle], moments[angle]], turn
    for word in ('rate', 'rates', 'speed', 'vel', 'velocity', 'dot', 'gyro', 'angular'):
        assert component_of('log', f'yaw_{word}') == 'r', word
    for word in ('force', 'torque', 'moment', 'tau', 'wrench'):
        assert component_of('log', f'{word}_pitch') == 'M', word
        assert component_of('log', f'{word}_heave') == 'Z', word
    ways = [component_of('log', path) for path in ('surge', 'sway', 'heave', 'tau_sway')]
    assert ways == ['u', 'v', 'w', 'Y']


@pytest.mark.parametrize(('component', 'path', 'span', 'unit'), [
    ('psi', 'yaw', (-6.6, 1.0), 'deg'), ('psi', 'yaw', (-6.4, 6.4), ''),
    ('r', 'r', (0.0, 20.1), 'deg/s'), ('r', 'r', (-19.9, 19.9), ''),
    ('phi', 'roll_degrees', (0.0, 1.0), 'deg'), ('p', 'gyro_x_dps', (0.0, 1.0), 'deg/s'),
    ('p', 'gyro_x_degs', (0.0, 1.0), 'deg/s'), ('p', 'rate_x (deg)', (0.0, 1.0), 'deg/s'),
    ('p', 'gyro_x_rads', (0.0, 90.0), ''), ('psi', 'yaw [rad]', (0.0, 90.0), ''),
    ('u', 'vel_x_mms', (0.0, 90.0), 'mm/s'), ('x', 'pos_x [cm]', (0.0, 1.0), 'cm'),
])  # fmt: skip
def test_a_unit_is_said_or_seen_by_the_range(component, path, span, unit) -> None:
    assert unit_of(component, path, Looked('csv', spans={path: Span(9, *span)})) == unit


def test_a_unit_of_the_file_comes_before_that_of_a_name() -> None:
    looked = Looked('csv', spans={'z_mm': Span(0, np.inf, -np.inf)}, units={'z_mm': 'ft'})
    assert unit_of('z', 'z_mm', looked) == 'ft'
    assert unit_of('psi', 'z_mm', looked) == ''


def stamp_of(path: str, high: float = 2.0, count: int = 5, **more: Any) -> tuple[str, str]:
    spans = {'u': Span(count, 0.0, 1e9), path: Span(count, 0.0, high)}
    return Looked('csv', spans=spans, **more).stamp


def test_a_time_is_found_by_its_name_and_its_unit_by_name_or_step() -> None:
    for word in ('t', 'time', 'timestamp', 'stamp', 'sec', 'secs', 'seconds', 'clock'):
        assert stamp_of(word) == (word, 's'), word
    for path, unit in (
        ('time_ms', 'ms'), ('time_us', 'us'), ('time_usec', 'us'), ('time_ns', 'ns'),
        ('time_nsec', 'ns'), ('time_boot_ms', 'ms'), ('boot_time_s', 's'), ('time_sec', 's'),
    ):  # fmt: skip
        assert stamp_of(path, 4e9) == (path, unit)
    assert stamp_of('t', 4e9, units={'t': 'ms'}) == ('t', 'ms')
    for step, unit in (
        (4.9, 's'), (5.0, 'ms'), (4999.0, 'ms'), (5000.0, 'us'), (4.9e6, 'us'), (5e6, 'ns')
    ):  # fmt: skip
        assert stamp_of('t', 4.0 * step) == ('t', unit)
        assert stamp_of('t', 8.0 * step, share=0.5) == ('t', unit)
    for none in (stamp_of('t', count=1), stamp_of('u_t'), stamp_of('t', stamped=True)):
        assert none == ('', '')
    looked = Looked('csv', spans={'time_ms': Span(3, 500.0, 2000.0)})
    assert (looked.duration, Looked('csv').duration) == (1.5, None)


@pytest.mark.parametrize(('low', 'high', 'curve'), [
    (800.0, 2200.0, 't200_16v'), (799.0, 2200.0, None), (800.0, 2201.0, None),
])  # fmt: skip
def test_pulses_are_told_from_thrusts_by_their_range(low, high, curve) -> None:
    motors = {'motor1': Span(9, low, 1000.0), 'motor2': Span(9, 900.0, high),
              'motor3': Span(9, 0.0, 0.0), 'motor': Span(9, 1.0, 2.0)}  # fmt: skip
    more = {f'motor{i}': Span(9, 1.0, 2.0) for i in (1, 2)}
    looked = {'a': Looked('csv', spans={'motor1': Span(9, 1.0, 2.0)}),
              'b': Looked('csv', spans=motors), 'c': Looked('csv', spans=more)}  # fmt: skip
    contents = BagContents(types=dict.fromkeys('abc', 'csv'), counts=dict.fromkeys('abc', 9))
    found = yaml.safe_load(proposal(Path('x'), contents, looked))['thrusters']
    by = {'curve': curve} if curve else {}
    assert found == {'topic': 'b', 'fields': ['motor1', 'motor2'], **by}


@pytest.mark.parametrize('names', [
    ('x y z qw qx qy qz', 'roll pitch yaw'), ('x y z roll pitch yaw', 'qw qx qy qz'),
    ('qw qx qy qz roll pitch yaw', 'x y z'),
])  # fmt: skip
def test_an_attitude_is_proposed_once(names) -> None:
    looked = {
        topic: Looked('csv', spans={name: Span(9, 0.1, 0.2) for name in listed.split()})
        for topic, listed in zip('ab', names, strict=True)
    }
    contents = BagContents(types=dict.fromkeys('ab', 'csv'), counts=dict.fromkeys('ab', 9))
    found = yaml.safe_load(proposal(Path('x'), contents, looked))['pose']
    entries = found if isinstance(found, list) else [found]
    fields = {name for entry in entries for name in entry['fields']}
    turns = {*'xyz', 'qw', 'qx', 'qy', 'qz'}, {*'xyz', 'phi', 'theta', 'psi'}
    assert fields == turns['x y z roll' in names[0]]


@pytest.mark.parametrize(('ids', 'line'), [
    (('odom_ned', 'base_frd'), 'frames: ned_fsd'), (('map_enu', 'base_flu'), 'frames: enu_flu'),
    (('odom_ned', 'base_flu'),
     'frames: enu_flu    # the frame ids odom_ned, base_flu of /o contradict each other'),
    ((), 'frames: enu_flu    # the names of /o do not say: a guess'),
])  # fmt: skip
def test_axes_are_those_that_the_frame_ids_name(ids, line) -> None:
    kind = 'nav_msgs/msg/Odometry'
    contents = BagContents(types={'/o': kind}, counts={'/o': 3})
    text = proposal(Path('x'), contents, {'/o': Looked(kind, ids, stamped=True)})
    assert line in text.splitlines()


def test_how_sure_a_value_is_is_no_value() -> None:
    assert component_of('log', 'roll') == 'phi'
    for word in ['cov', 'covariance', 'std', 'stddev', 'var', 'variance', 'err', 'error', 'sigma']:
        assert not component_of('log', f'roll_{word}'), word


def test_pictures_and_points_are_not_looked_at(monkeypatch) -> None:
    names = 'Image', 'CompressedImage', 'PointCloud2', 'PointCloud', 'CameraInfo', 'Imu'
    asked: list[str] = []
    monkeypatch.setattr(
        proposing, 'messages', lambda bag, topics, *_: asked.extend(topics) or iter(())
    )
    contents = BagContents(types={f'/{name}': f'sensor_msgs/msg/{name}' for name in names})
    found = looked_through(Path('bag'), contents)
    assert asked == ['/Imu']
    assert [(topic, one.kind, one.spans) for topic, one in found.items()] == [
        (topic, kind, {}) for topic, kind in contents.types.items()
    ]


@pytest.mark.parametrize(('topics', 'share'), [(1, 0.997), (50, 0.997), (100, 0.5)])
def test_of_many_topics_fewer_messages_are_looked_at(topics, share, monkeypatch) -> None:
    asked: dict[str, float] = {}
    monkeypatch.setattr(proposing, 'messages', lambda *told: asked.update(told[3]) or iter(()))
    kinds = dict.fromkeys((f'/{i}' for i in range(topics)), 'sensor_msgs/msg/Imu')
    counts = dict.fromkeys(kinds, 1000) | {'/0': 2}
    found = looked_through(Path('bag'), BagContents(types=kinds, counts=counts))
    assert asked == dict.fromkeys(kinds, share) | {'/0': 1.0}
    assert {topic: one.share for topic, one in found.items()} == asked


@pytest.mark.parametrize('dead', ['qw qx qy qz', 'u v w', 'p q r', ''])
def test_an_odometry_has_attitude_velocity_and_angular_velocity(dead) -> None:
    kind = 'nav_msgs/msg/Odometry'
    spans = {
        path: Span(3, 0.0, 0.0 if name in dead.split() else 1.0)
        for name, path in presets('odometry')[kind].items()
    }
    contents = BagContents(types={'/o': kind}, counts={'/o': 3})
    text = proposal(Path('x'), contents, {'/o': Looked(kind, spans=spans, count=3)})
    assert ('# /o: no attitude or no velocity in it but zeros' in text) == bool(dead)
    assert ('odometry' in yaml.safe_load(text)) == (not dead)


def test_a_column_without_a_number_is_no_component() -> None:
    spans = {'force_x': Span(0, np.inf, -np.inf), 'force_y': Span(3, 0.0, 1.0)}
    contents = BagContents(types={'a': 'csv'}, counts={'a': 3})
    found = yaml.safe_load(proposal(Path('x'), contents, {'a': Looked('csv', spans=spans)}))
    assert found['wrench']['fields'] == {'Y': 'force_y'}


def test_frame_ids_are_those_of_the_first_message_and_spans_of_all() -> None:
    looked, bare = Looked('x'), Looked('x')
    for frame, x in (('a', 2.0), ('b', -1.0), ('c', np.nan)):
        header = SimpleNamespace(frame_id=frame)
        looked.take(SimpleNamespace(header=header, child_frame_id='', x=x))
        bare.take(SimpleNamespace(child_frame_id=frame, x=x))
    assert (looked.ids, looked.stamped, looked.count) == (('a',), True, 3)
    assert (bare.ids, bare.stamped) == (('a',), False)
    assert looked.spans == {'x': Span(2, -1.0, 2.0)}
    assert looked.table == {'x': {'values': 2, 'least': -1.0, 'largest': 2.0}}


@pytest.mark.parametrize(('columns', 'units'), [
    ('pos_x [cm],roll [deg],pitch [deg],yaw [deg]',
     {'x': 'cm', 'phi': 'deg', 'theta': 'deg', 'psi': 'deg'}),
    ('pos_x [cm],pos_y [mm]', {'x': 'cm', 'y': 'mm'}), ('pos_x [cm],pos_y [cm]', 'cm'),
    ('pos_x [cm],pos_y', {'x': 'cm'}), ('pos_x [m]', None),
])  # fmt: skip
def test_units_are_one_word_where_that_says_it_all(columns, units) -> None:
    looked = Looked('csv', spans={name: Span(9, 0.1, 0.2) for name in columns.split(',')})
    contents = BagContents(types={'a': 'csv'}, counts={'a': 9})
    found = yaml.safe_load(proposal(Path('x'), contents, {'a': looked}))['pose']
    assert found.get('units') == units


def test_info_shows_columns_and_the_mapping(run, tmp_path, capsys) -> None:
    path = tmp_path / 'dive.csv'
    path.write_text(HEADS['plain'][0] + text_of(columns(run)))
    main.main(['info', str(path), '--json'])
    document = json.loads(capsys.readouterr().out)
    assert document['duration'] == pytest.approx(1.0)
    assert document['messages'] == 101
    surge = document['fields']['dive']['u']
    assert surge['values'] == 101
    assert (surge['least'], surge['largest']) == (np.min(run.nu[:, 0]), np.max(run.nu[:, 0]))
    assert yaml.safe_load(document['mapping'])['twist']['topic'] == 'dive'
    main.main(['info', str(path)])
    text = capsys.readouterr().out
    assert document['mapping'] in text


def test_numbers_of_whatever_width_are_written(tmp_path, capsys) -> None:
    kind = 'std_msgs/msg/Float32MultiArray'
    layout = new('std_msgs/msg/MultiArrayLayout', [], 0)
    bag = Bag(tmp_path / 'dive.mcap')
    for k in range(3):
        bag.add('/thrusts', kind, k, serialized(new(kind, layout, np.array([k, -k], np.float32))))
    main.main(['info', str(bag.close()), '--json'])
    fields = json.loads(capsys.readouterr().out)['fields']['/thrusts']
    assert (fields['data[1]']['least'], fields['data[0]']['largest']) == (-2.0, 2.0)


def test_a_message_that_would_fill_the_memory_is_not_looked_into(tmp_path, capsys) -> None:
    kind = 'std_msgs/msg/Float64MultiArray'
    bag = Bag(tmp_path / 'dive.mcap')
    layout = new('std_msgs/msg/MultiArrayLayout', [], 0)
    for topic, count in (('/large', (1 << 21) // 8), ('/small', 2)):
        bag.add(topic, kind, 0, serialized(new(kind, layout, np.zeros(count))))
    main.main(['info', str(bag.close()), '--json'])
    document = json.loads(capsys.readouterr().out)
    assert document['topics']['/large']['messages'] == 1
    assert document['fields']['/small']['data[1]']['least'] == 0.0
    assert not document['fields'].get('/large')
    (note,) = document['notes']
    assert '/large: expected messages of at most 2097152 bytes' in note
