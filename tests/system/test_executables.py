"""The installed executables, started: what the launch file describes, and the others."""

import subprocess
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path

import pytest
import yaml
from helpers.graph_runs import assert_same
from helpers.launch_actions import actions, launch_file, of
from helpers.node_processes import environment, fresh_domain
from helpers.patience import patience

from auv_analysis import load_scenario, simulate
from auv_analysis.bag.load import load_run
from auv_analysis.graph.supervisor import executable

SCENARIO = """
format: 1
name: short
vehicle: bluerov2_heavy
duration: 0.4
step: 0.02
controllers: {gvc: {law: gvc, k_D: 12.0, k_I: 1.0, Lambda: 0.8, Gamma: 60.0}}
setpoint: {surge: {offset: 0.3}, yaw: {terms: [{amplitude: 0.2, omega: 0.7}]}}
disturbance: {kind: harmonic, sway: {offset: 3.0, terms: [{amplitude: 5.0, omega: 2.0}]}}
actuators: {limit: 300.0, lag: 0.05}
sensors: {velocity_noise: 0.01}
"""
BESIDES = {'frame_converter_node', 'replay_node', 'composed_graph'}  # that the launch file starts


def started(command: list[str], domain: int) -> subprocess.Popen:
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.STDOUT}
    return subprocess.Popen(command, env=environment(domain), text=True, **streams)


@pytest.fixture(scope='module')
def launched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, dict[str, list]]]:
    """The folder of a run by the launch file's actions, and the command of each node."""
    folder = tmp_path_factory.mktemp('launched')
    (folder / 'short.yaml').write_text(SCENARIO)
    with pytest.MonkeyPatch.context() as patched, launch_file() as read:
        patched.chdir(folder)
        listed = actions(read, scenario=str(folder / 'short.yaml'), namespace='auv1')
        ends = [one.positional[0].named for one in of('RegisterEventHandler', listed)]
        commands = {}
        for node in of('Node', listed):
            told = node.named
            (path,) = told['parameters']
            names = ['-r', f'__node:={told["name"]}', '-r', f'__ns:=/{told["namespace"]}']
            ros = ['--ros-args', *told['ros_arguments'], *names, '--params-file', path]
            commands[told['executable']] = [
                str(executable(told['package'], told['executable'])), *ros
            ]  # fmt: skip
        domain = fresh_domain()
        running = {name: started(command, domain) for name, command in commands.items()}
        output = {}
        try:
            assert running['recorder_node'].wait(patience(60)) == 0
        finally:
            for name, process in running.items():
                process.terminate()
                output[name], _ = process.communicate(timeout=patience(20))
        assert [process.returncode for process in running.values()] == [0] * 5, output
        assert ends[-1]['target_action'].named['executable'] == 'recorder_node'
        yield folder, commands


def test_every_executable_is_started_here(launched) -> None:
    packages = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')
    scripts = {
        one.name
        for one in entry_points(group='console_scripts')
        if one.value.split('.')[0] in packages
    }
    assert {*launched[1]} | BESIDES | {'auv'} == scripts


def test_what_the_launch_file_describes_is_the_run_of_the_scenario(launched) -> None:
    folder, _ = launched
    simulated = simulate(load_scenario(folder / 'short.yaml'), 'gvc', 'zoh')
    assert_same(load_run(folder / 'runs/short/auv1/gvc'), simulated)


def test_the_same_parameters_serve_one_process(launched, tmp_path: Path) -> None:
    folder, commands = launched
    path = Path(commands['plant_node'][-1])
    own, bag = tmp_path / 'params.yaml', folder / 'runs/short/auv1/gvc'
    told = yaml.safe_load(path.read_text())
    for values in told.values():
        if 'bag' in values['ros__parameters']:
            values['ros__parameters']['bag'] = str(tmp_path / 'bag')
    own.write_text(yaml.safe_dump(told))
    script = str(executable('auv_analysis', 'composed_graph'))
    names = ['--ros-args', '-r', '__ns:=/auv1', '--params-file', str(own)]
    process = started([script, *names], fresh_domain())
    said, _ = process.communicate(timeout=patience(60))
    assert process.returncode == 0, said
    assert_same(load_run(tmp_path / 'bag'), load_run(bag))


def test_the_replay_plays_that_bag_to_its_end(launched) -> None:
    script = str(executable('auv_analysis', 'replay_node'))
    bag = launched[0] / 'runs/short/auv1/gvc'
    process = started(
        [script, '--ros-args', '-p', f'bag:={bag}', '-p', 'rate:=0.0'], fresh_domain()
    )
    said, _ = process.communicate(timeout=patience(60))
    assert process.returncode == 0, said
    assert f'plays {bag}' in said


def test_the_frame_converter_begins_and_ends() -> None:
    script = str(executable('auv_dynamics', 'frame_converter_node'))
    process = started([script], fresh_domain())
    assert 'begins: converts enu_flu' in process.stdout.readline()
    process.terminate()
    said, _ = process.communicate(timeout=patience(20))
    assert process.returncode == 0, said
