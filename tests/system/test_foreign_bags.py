"""`auv analyze` and `auv info` of bags of other systems, as the user runs them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.foreign_bags import NAMED, Maker, motion, nanoseconds, simple, simulated, write
from helpers.node_processes import auv

from auv_analysis.bag import foreign_topics
from auv_analysis.cli import main

TOPICS = '/rexrov/pose_gt', '/rexrov/thruster_manager/input'


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """SQLite, ENU and FLU, a pause of the odometry, a set-point without stamps."""
    run = simulated(duration=3.0)
    maker, seen = Maker(), motion(run, enu=True, keep=(run.t < 1.0) | (run.t > 1.4))
    whole = motion(run, enu=True)
    messages = simple(seen, maker, *TOPICS, ('world', 'base_link'), whole)
    for i, ns in enumerate(nanoseconds(whole.t).tolist()):
        messages.append(('/rexrov/cmd_vel', ns, maker.six('Twist', whole.nu_d[i])))
        if i % 10 == 0:
            messages.append(('/chatter', ns, maker.new('std_msgs/msg/String', 'hello')))
    return write(tmp_path_factory.mktemp('foreign') / 'dive', messages, maker, kind='sqlite3')


def refused(arguments: list[str], capsys: pytest.CaptureFixture) -> str:
    with pytest.raises(SystemExit) as end:
        main.main(arguments)
    captured = capsys.readouterr()
    assert (end.value.code, captured.out) == (2, '')
    (line,) = captured.err.splitlines()
    return line


class AskedError(Exception):
    """What was to be seen is seen."""


@pytest.mark.parametrize(('option', 'key', 'value'), [
    ('--odom', 'odometry', '/o'), ('--wrench', 'wrench', '/w'), ('--setpoint', 'setpoint', '/s'),
    ('--frames', 'frames', 'enu_flu'), ('--twist-frame', 'twist_frame', 'world'),
    ('--step', 'step', 0.02), ('--gap', 'gap', 0.5),
])  # fmt: skip
def test_what_is_told_of_a_bag_reaches_its_mapping(option, key, value, monkeypatch) -> None:
    def asked(file: None, given: dict[str, Any]) -> None:
        assert {k: v for k, v in given.items() if v is not None} == {key: value}
        raise AskedError

    monkeypatch.setattr(foreign_topics, 'read_mapping', asked)
    with pytest.raises(AskedError):
        main.main(['analyze', 'bag', option, str(value)])


def test_info_names_what_could_be_mapped(bag, capsys) -> None:
    main.main(['info', str(bag), '--json'])
    document = json.loads(capsys.readouterr().out)
    assert document['candidates'] == {
        'odometry': [TOPICS[0]], 'pose': [], 'twist': [], 'wrench': [TOPICS[1]],
        'setpoint': ['/rexrov/cmd_vel'], 'thrusters': [],
    }  # fmt: skip
    assert document['topics'][TOPICS[1]] == {
        'type': 'geometry_msgs/msg/WrenchStamped', 'messages': 301,
    }  # fmt: skip
    assert document['duration'] == pytest.approx(3.002, abs=1e-3)
    main.main(['info', str(bag)])
    assert f'could be mapped as odometry: {TOPICS[0]}' in capsys.readouterr().out


def test_without_a_mapping_one_line_says_which_options_would_map_it(bag, capsys) -> None:
    line = refused(['analyze', str(bag)], capsys)
    for words in (
        str(bag),
        f'--odom {TOPICS[0]}',
        f'--wrench {TOPICS[1]}',
        '--frames',
        '--vehicle',
    ):
        assert words in line


def test_nothing_is_turned_in_silence(bag, capsys) -> None:
    options = ['--odom', TOPICS[0], '--wrench', TOPICS[1], '--vehicle', 'rexrov']
    line = refused(['analyze', str(bag), *options], capsys)
    assert f'{TOPICS[0]}: frame_id: expected --frames ned_fsd or enu_flu' in line
    assert line.endswith("found 'world', 'base_link'")


@pytest.mark.long
def test_installed_command_analyses_it(bag, tmp_path) -> None:
    mapping: dict[str, Any] = {
        'odometry': TOPICS[0], 'wrench': TOPICS[1], 'setpoint': '/rexrov/cmd_vel',
        'frames': 'enu_flu', 'vehicle': 'rexrov', 'step': 0.02,
    }  # fmt: skip
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(mapping))
    options = '--map', 'map.yaml', '--out', 'out', '--json'
    done = auv('analyze', str(bag), *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)['dive']
    assert json.loads((tmp_path / 'out' / 'summary.json').read_text())['dive'] == summary
    assert summary['source'] == 'foreign_bag'
    assert summary['step'] == 0.02
    assert len(summary['gaps']['spans']) == 1
    assert 0.8 < summary['gaps']['valid_share'] < 0.9
    assert all(error > 0 for error in summary['unexplained']['error_rms'])
    assert summary['velocity_error']['rms'] is not None
    report = (tmp_path / 'out' / 'report.html').read_text()
    for words in ('Unexplained wrench, dive', 'enu_flu as told', 'recorded by another system'):
        assert words in report
    assert (tmp_path / 'out' / 'figures' / 'unexplained_dive.pdf').exists()


def test_a_bag_with_our_names_in_axes_that_nobody_told_is_refused(tmp_path, capsys) -> None:
    maker, run = Maker(), simulated(duration=0.2)
    m = motion(run, enu=True)
    messages = simple(m, maker, '/rexrov/odom', '/rexrov/wrench', ('odom', 'base_link'))
    bag = write(tmp_path / 'other', messages, maker)
    line = refused(['analyze', str(bag), '--vehicle', 'rexrov'], capsys)
    assert '/rexrov/odom: frame_id: expected frames whose names say that they are NED' in line
    assert '--odom /rexrov/odom, --wrench /rexrov/wrench' in line


@pytest.mark.parametrize('command', ['analyze', 'predict'])
@pytest.mark.parametrize(('content', 'words'), [
    ('zeros', 'zero'), ('no attitude', 'quaternion'), ('no velocity', 'finite'),
])  # fmt: skip
def test_an_odometry_with_our_name_that_holds_nothing_is_refused_for_another(
    content, words, command, tmp_path, capsys
) -> None:
    maker, run = Maker(), simulated(duration=0.3)
    m = motion(run, enu=False)
    still = m._replace(twist=0.0 * m.twist, position=0.0 * m.position)
    dead = {
        'zeros': still._replace(attitude=0.0 * m.attitude + [0.0, 0.0, 0.0, 1.0]),
        'no attitude': still._replace(attitude=0.0 * m.attitude),
        'no velocity': m._replace(twist=np.nan * m.twist),
    }[content]
    messages = simple(dead, maker, '/rov/odom', '/rov/wrench', NAMED, m)
    for i, ns in enumerate(nanoseconds(m.t).tolist()):
        messages.append(('/nav/state', ns, maker.odometry(ns, NAMED, m, i)))
    bag = write(tmp_path / 'other', messages, maker)
    line = refused([command, str(bag), '--vehicle', 'rexrov'], capsys)
    assert '/rov/odom: expected' in line
    assert 'another odometry: --odom /nav/state' in line
    if command == 'analyze':
        assert words in line


def test_nothing_is_predicted_of_a_velocity_that_nobody_measured(tmp_path, capsys) -> None:
    maker, m = Maker(), motion(simulated(duration=2.0), enu=False)
    dead = m._replace(twist=np.nan * m.twist)
    bag = write(
        tmp_path / 'other', simple(dead, maker, '/rov/odom', '/rov/wrench', NAMED, m), maker
    )
    line = refused(['predict', str(bag), '--vehicle', 'rexrov'], capsys)
    assert 'a second and more with attitude, velocity and wrench' in line
