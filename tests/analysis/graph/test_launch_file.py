"""The launch file without `launch`, which has no wheel: what it makes of its arguments."""

import importlib
import importlib.util
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from helpers.launch_actions import FILE, actions, launch_file, of
from helpers.needs import need

from auv_analysis.graph.experiment import PACKAGES


@pytest.fixture(name='launch_file')
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[dict[str, Any]]:
    monkeypatch.chdir(tmp_path)
    with launch_file() as read:
        yield read


def nodes(listed: list[Any]) -> tuple[list[str], dict[str, dict[str, Any]]]:
    """Names of the nodes, and the parameters in their file."""
    found = of('Node', listed)
    (path,) = {one.named['parameters'][0] for one in found}
    text = Path(path).read_text()
    assert text.startswith('# case1, gvc: ros2 launch\n')
    data = yaml.safe_load(text)
    named = {name.rpartition('/')[2]: value['ros__parameters'] for name, value in data.items()}
    for one in found:
        name = one.named['executable']
        assert (one.named['package'], one.named['name']) == (PACKAGES[name], name)
        assert one.named['ros_arguments'] == ['--enclave', f'/auv_gvc/{name}']
        assert one.named['output'] == 'screen'
    return [one.named['executable'] for one in found], named


def test_every_node_gets_its_parameters_and_the_bag_that_of_its_namespace(launch_file) -> None:
    listed = actions(launch_file, namespace='/auv1')
    names, given = nodes(listed)
    assert of('SetEnvironmentVariable', listed), 'with the plant all stays on this machine'
    assert {one.named['namespace'] for one in of('Node', listed)} == {'/auv1'}
    assert names == list(given)
    assert set(names) == set(PACKAGES)
    assert Path(given['recorder_node']['bag']) == Path('runs/case1/auv1/gvc').resolve()
    assert all(given[name]['use_sim_time'] == (name != 'plant_node') for name in names)
    kept = dict(entry.split('=') for entry in given['recorder_node']['attachments'])
    assert kept.keys() == {'params.yaml', 'scenario.yaml', 'vehicle.yaml'}
    assert [kept['params.yaml']] == of('Node', listed)[0].named['parameters']
    _, given = nodes(actions(launch_file, bag='elsewhere'))
    assert Path(given['recorder_node']['bag']) == Path('elsewhere').resolve()


@pytest.mark.parametrize('left_out', ['record', 'analysis'])
def test_a_node_is_left_out_alone(launch_file, left_out: str) -> None:
    names, _ = nodes(actions(launch_file, **{left_out: 'false'}))
    node = {'record': 'recorder_node', 'analysis': 'analysis_node'}[left_out]
    assert {*names} == {*PACKAGES} - {node}


def test_lock_step_and_the_clock_are_two_switches(launch_file) -> None:
    _, given = nodes(actions(launch_file, use_sim_time='false', plant='True'))
    assert given['controller_node']['lockstep']
    assert not given['controller_node']['use_sim_time']
    _, given = nodes(actions(launch_file, lockstep='false'))
    assert not given['plant_node']['lockstep']
    assert given['controller_node']['use_sim_time']


def test_beside_another_plant_there_is_no_clock(launch_file) -> None:
    _, given = nodes(actions(launch_file, publish_clock='false'))
    assert not given['plant_node']['publish_clock']
    assert not any(values['use_sim_time'] for values in given.values())


def test_a_driver_in_place_of_the_plant_is_real_time(launch_file) -> None:
    listed = actions(launch_file, plant='false', record='False', analysis='false')
    names, given = nodes(listed)
    assert names == ['setpoint_node', 'controller_node']
    assert not given['controller_node']['lockstep']
    assert not given['controller_node']['use_sim_time']
    assert of('SetEnvironmentVariable', listed) == [], 'it may be on another machine'


def test_margins_are_said_before_a_vehicle_is_driven(launch_file, tmp_path: Path) -> None:
    path = tmp_path / 'late.yaml'
    gains = {'law': 'gvc', 'k_D': 20.0, 'k_I': 2.0, 'Lambda': 0.8, 'Gamma': 2.0}
    data = {
        'name': 'late', 'vehicle': 'bluerov2_heavy', 'duration': 1.0, 'step': 0.02, 'setpoint': {},
        'controllers': {'quick': gains, 'slow': gains | {'k_D': 2.0, 'Lambda': 0.1, 'Gamma': 0.1}},
    }  # fmt: skip

    def said(**values: str) -> list[str]:
        listed = actions(launch_file, scenario=str(path), plant='false', **values)
        return [one.named['msg'] for one in listed if type(one).__name__ == 'LogInfo']

    path.write_text(yaml.safe_dump(data))
    (note,) = said(controller='quick')
    assert 'no delay is known' in note
    path.write_text(yaml.safe_dump(data | {'actuators': {'delay': 0.04}}))
    assert 'below 6 dB and 45 deg' in said(controller='quick')[0]
    assert said(controller='slow')[0].startswith('note: ')
    path.write_text(yaml.safe_dump(data | {'initial': {'eta': [0, 0, 0, 90, 0, 0]}}))
    assert any(one.startswith('warning: ') and 'degrees?' in one for one in said())


@pytest.mark.parametrize(
    ('switch', 'about'),
    [
        ('plant', 'simulate the vehicle'), ('publish_clock', 'the plant publishes /clock'),
        ('record', 'write a bag'), ('analysis', 'analysis/*'),
        ('use_sim_time', 'default: true with a /clock'), ('lockstep', 'false without'),
    ],
)  # fmt: skip
def test_a_switch_is_described_and_takes_no_other_word(launch_file, switch, about) -> None:
    described = launch_file['generate_launch_description']().positional[0]
    declared = {one.positional[0]: one.named for one in described if one.positional}
    assert 'maybe' not in declared[switch]['choices']
    assert about in declared[switch]['description']
    assert declared[switch]['default_value'] in declared[switch]['choices']


def test_a_node_that_fails_ends_the_launch_and_the_last_one_ends_it_well(launch_file) -> None:
    listed = actions(launch_file)
    order = [type(one).__name__ for one in listed][-10:]
    assert order == ['RegisterEventHandler', 'Node'] * 5, 'one that ends at once is noticed'
    handlers = of('RegisterEventHandler', listed)
    ends = [one.positional[0].named['on_exit'] for one in handlers]
    running = SimpleNamespace(is_shutdown=False)
    well, failed = (SimpleNamespace(returncode=code) for code in (0, 2))
    assert [bool(end(well, running)) for end in ends] == [False] * 4 + [True]
    without = of('RegisterEventHandler', actions(launch_file, record='false'))
    first, *others = (one.positional[0].named for one in without)
    assert first['target_action'].named['name'] == 'plant_node', 'the last without a recorder'
    assert first['on_exit'](well, running)
    assert not any(one['on_exit'](well, running) for one in others)
    for end in ends:
        with pytest.raises(RuntimeError, match='_node ended with exit code 2'):
            end(failed, running)
        end(failed, SimpleNamespace(is_shutdown=True))


def test_the_folder_of_its_files_goes_with_it(launch_file) -> None:
    (node, *_) = of('Node', actions(launch_file))
    folder = Path(node.named['parameters'][0]).parent
    assert folder.is_dir()
    for do in launch_file['kept']:
        do()
    assert not folder.exists()


def test_launch_itself_makes_the_same_of_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Where `launch` is installed, as beside ROS 2 from Debian packages."""
    found = importlib.util.find_spec('launch')  # without an origin it is the folder of our file
    need('launch', found and found.origin)
    launch, sources = map(importlib.import_module, ('launch', 'launch.launch_description_sources'))
    monkeypatch.chdir(tmp_path)
    described = sources.get_launch_description_from_python_launch_file(str(FILE))
    context = launch.LaunchContext()
    made = [one for entity in described.entities for one in entity.visit(context) or []]
    found = {one.node_executable: one.node_package for one in of('Node', made)}
    assert found == PACKAGES
