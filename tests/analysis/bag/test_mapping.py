"""The grammar of mapping files, and the options that stand for its keys."""

from pathlib import Path

import pytest

from auv_analysis.bag.foreign_topics import read_mapping
from auv_dynamics.files.errors import InputError

GOOD = 'odometry: /o\nwrench: /w\n'
WRONG = {  # what is in the file -> what the one line says
    'odometry: /o\nwrench_applied: /w\n': 'wrench: expected one of wrench',
    'wrench: /w\n': 'odometry: expected odometry (--odom), or both pose and twist, found nothing',
    'pose: /p\nwrench: /w\n': 'pose: expected odometry (--odom), or both pose and twist',
    f'{GOOD}twist: /t\n': 'found odometry and twist',
    f'{GOOD}thrusters: /u\n': 'wrench: expected one of wrench (--wrench) and thrusters, found w',
    'odometry: /o\nthrusters: {topic: /u, units: m/s}\n': 'units: expected one of N, kN, kgf',
    f'{GOOD}odom: /o\n': 'odom: expected one of format, name, vehicle, frames',
    f'{GOOD}frames: enu\n': 'frames: expected ned_fsd or enu_flu (nearest: enu_flu), found enu',
    f'{GOOD}frames: [enu_flu]\n': 'frames: expected ned_fsd or enu_flu, found [',
    f'{GOOD}step: 0\n': 'step: expected a positive number (s), found 0',
    f'{GOOD}step: quick\n': 'step: expected a positive number (s), found quick',
    f'{GOOD}gap: -1\n': 'gap: expected a positive number (s), found -1',
    f'{GOOD}step: .nan\n': 'step: expected a finite number, found nan',
    f'{GOOD}format: 2\n': 'format: expected 1, found 2',
    f'{GOOD}name: ../x\n': 'name: expected a word without blanks or slashes',
    f'{GOOD}twist_frame: body\n': 'twist_frame: expected child or world, found body',
    f'{GOOD}setpoint: 5\n': 'setpoint: expected a topic with a velocity, or a mapping with topic',
    f'{GOOD}setpoint: {{}}\n': 'setpoint.topic: expected the name of a topic, found nothing',
    f'{GOOD}setpoint: {{topic: /s, hold: zoh}}\n': 'setpoint.hold: expected one of topic, frames',
    f'{GOOD}setpoint: {{topic: /s, between: spline}}\n': 'between: expected hold or linear',
    f'{GOOD}wrench_applied: /w\n': 'wrench_applied: expected another topic than wrench',
    'odometry: {topic: /o, twist_frame: earth}\nwrench: /w\n': 'expected child or world',
    'odometry: {topic: /o, between: hold}\nwrench: /w\n': 'odometry.between: expected one of topic',
    'odometry: {topic: ""}\nwrench: /w\n': 'odometry.topic: expected the name of a topic',
    '- /o\n': 'expected a mapping with the keys of a mapping file',
    'odometry: /o\nodometry: /p\nwrench: /w\n': 'odometry: expected each key once',
}


@pytest.mark.parametrize('text', WRONG)
def test_wrong_files_are_refused_in_one_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / 'map.yaml'
    path.write_text(text)
    with pytest.raises(InputError) as refusal:
        read_mapping(path, {})
    assert str(refusal.value).startswith(f'{path}: ')
    assert WRONG[text] in str(refusal.value)
    assert '\n' not in str(refusal.value)


def test_what_a_topic_does_not_say_the_file_says(tmp_path) -> None:
    path = tmp_path / 'map.yaml'
    path.write_text(
        'frames: enu_flu\ngap: 0.5\ntwist_frame: world\nodometry: /o\n'
        'wrench: {topic: /w, frames: ned_fsd, gap: 2, between: linear}\nsetpoint: /s\n'
    )
    sources = read_mapping(path, {}).sources
    odometry, wrench, setpoint = (sources[role] for role in ('odometry', 'wrench', 'setpoint'))
    assert (odometry.frames, odometry.gap, odometry.twist_frame) == ('enu_flu', 0.5, 'world')
    assert (wrench.frames, wrench.gap, wrench.twist_frame) == ('ned_fsd', 2, 'child')
    assert (setpoint.frames, setpoint.gap, setpoint.between) == ('enu_flu', None, 'hold')
    assert (odometry.between, wrench.between) == ('linear', 'linear')


def test_what_an_entry_leaves_out_is_unknown_or_usual() -> None:
    told = {'topic': '/o', 'fields': {'phi': 'a', 'theta': 'b', 'u': 'c'}, 'stamp': {'field': 't'}}
    found = read_mapping(None, {'odometry': told, 'wrench': '/w', 'unknown': ['x']})
    assert found.unknown == {'psi', 'x'}
    assert found.sources['odometry'].stamp == ('t', 's')


def test_options_replace_keys(tmp_path) -> None:
    path = tmp_path / 'map.yaml'
    path.write_text(f'{GOOD}step: 0.1\nvehicle: rexrov\n')
    found = read_mapping(path, {'wrench': '/other', 'step': None, 'frames': 'ned_fsd'})
    assert found.sources['wrench'].topic == '/other'
    assert (found.step, found.vehicle) == (0.1, 'rexrov')
    assert found.sources['odometry'].frames == 'ned_fsd'
    with pytest.raises(InputError, match=r'^options: step: expected a positive number \(s\)'):
        read_mapping(None, {'odometry': '/o', 'wrench': '/w', 'step': -1.0})


def test_a_vehicle_file_is_looked_for_beside_the_mapping(tmp_path, monkeypatch) -> None:
    (tmp_path / 'maps').mkdir()
    (tmp_path / 'maps' / 'mine.yaml').write_text('name: mine\n')
    path = tmp_path / 'maps' / 'map.yaml'
    path.write_text(f'{GOOD}vehicle: mine.yaml\n')
    monkeypatch.chdir(tmp_path)
    assert Path(str(read_mapping(path, {}).vehicle)) == tmp_path / 'maps' / 'mine.yaml'
    given = read_mapping(path, {'vehicle': 'rexrov'})
    assert given.vehicle == 'rexrov'
