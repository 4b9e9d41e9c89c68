"""`auv run --composed`: the same nodes in one process, the same bags, the same ends."""

import signal
import time
from functools import partial
from pathlib import Path

import numpy as np
import psutil
import pytest
import yaml
from helpers.graph_runs import every_message, node_of, nodes, recorded, start, start_installed
from helpers.node_processes import auv, change, graph, installed_auv, parameters, stop
from helpers.patience import patience
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetState
from std_srvs.srv import SetBool, Trigger

from auv_analysis.bag.load import load_run
from auv_analysis.bag.reading import read_bag
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.scenario.scenario import load_scenario
from auv_dynamics.ros import topics

SCENARIO = """
name: composed
vehicle: bluerov2_heavy
duration: 1.5
step: 0.01
seed: 3
controllers: {gvc: {law: gvc, k_D: 12.0, k_I: 1.0, Lambda: 0.8, Gamma: 60.0}}
setpoint: {surge: {offset: 0.3}, yaw: {terms: [{amplitude: 0.2, omega: 0.7}]}}
disturbance: {kind: harmonic, sway: {offset: 3.0, terms: [{amplitude: 5.0, omega: 2.0}]}}
actuators: {limit: 300.0, lag: 0.05}
sensors: {velocity_noise: 0.01, drop_out: 0.1}
"""
PACED = ('/diagnostics', '/recorder/progress', '/controller_node/transition_event')  # by the wall
ALONE = 'composed_graph'


def write(folder: Path, **changes) -> Path:
    path = folder / 's.yaml'
    path.write_text(yaml.safe_dump({**yaml.safe_load(SCENARIO), **changes}))
    return path


@pytest.mark.parametrize('executor', ['', pytest.param('plain', marks=pytest.mark.long)])
def test_the_bag_is_that_of_five_processes(tmp_path: Path, executor: str) -> None:
    """Message for message, analysis and clock included."""
    scenario, out = write(tmp_path), tmp_path / 'one'
    # it is read where rclpy is loaded
    run = partial(installed_auv, AUV_GVC_EXECUTOR=executor) if executor else auv
    ended = run('run', str(scenario), '--out', str(out), '--composed', '--no-report')
    assert ended.returncode == 0, ended.stderr
    assert not nodes(out)
    one = every_message(out / 'gvc', *PACED)
    five = every_message(recorded(scenario, tmp_path / 'five') / 'gvc', *PACED)
    assert five.keys() == one.keys()
    assert {len(messages) for topic, messages in one.items() if 'analysis' not in topic} == {151}
    assert len(one['/analysis/lumped_error']) == 16
    for topic, messages in five.items():
        assert messages == one[topic], topic


def test_all_nodes_are_one_process_under_a_name_of_its_own(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    process = start(write(tmp_path, duration=600.0), out, '--composed')
    composed = node_of(out, ALONE)
    assert list(nodes(out)) == [ALONE]
    assert not any(part.endswith('_node') for part in composed.cmdline())
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=patience(60))
    assert process.returncode == 1
    assert not nodes(out)
    run = load_run(out / 'gvc')
    assert len(run.t) > 10
    assert 'not finished' not in ' '.join(run.notes), 'the recorder has closed its bag'


@pytest.mark.long
def test_it_does_not_outlive_auv(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    process = start_installed(write(tmp_path, duration=600.0), out, '--composed')
    composed = node_of(out, ALONE)
    process.kill()
    process.communicate(timeout=patience(60))
    composed.wait(timeout=patience(10))
    assert 'not finished' not in ' '.join(load_run(out / 'gvc').notes)


@pytest.mark.long
def test_its_death_ends_the_run_and_loses_nothing_that_was_written(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    process = start(write(tmp_path, duration=600.0), out, '--composed')
    node_of(out, ALONE).kill()
    _, errors = process.communicate(timeout=patience(60))
    assert process.returncode == 1
    assert f'{ALONE} ended with exit code -9' in errors
    run = load_run(out / 'gvc')
    assert len(run.t) > 10
    assert np.isfinite(run.nu).all()


def test_a_node_that_ends_is_named_and_everything_said_before_is_in_the_bag(
    tmp_path: Path,
) -> None:
    unstable = {'bad': {'law': 'cl', 'k_D': -1e6, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}}
    ideal = {k: v for k, v in yaml.safe_load(SCENARIO).items() if k not in ('actuators', 'sensors')}
    path = tmp_path / 's.yaml'
    path.write_text(yaml.safe_dump({**ideal, 'controllers': unstable}))
    ended = auv('run', str(path), '--out', str(tmp_path / 'out'), '--composed', '--no-report')
    assert ended.returncode == 1
    assert f'{ALONE} ended with exit code 1' in ended.stderr
    assert 'plant_node ended with exit code 1' in ended.stderr
    assert 'diverges' in ended.stderr
    assert not nodes(tmp_path)
    contents = read_bag(tmp_path / 'out' / 'bad', decode=False)
    assert contents.notes == []
    counts = {contents.counts[f'/{t}'] for t in ('odom', 'wrench', 'disturbance')}
    assert len(counts) == 1, 'the last wrench and what opposed it are there as well'


def test_wrong_input_of_one_node_ends_all_in_one_line(tmp_path: Path) -> None:
    with graph((ALONE, parameters(bag=tmp_path / 'bag', vehicle='nothing'))) as (_, processes):
        process = processes[ALONE]
        output, _ = process.communicate(timeout=patience(60))
        assert process.returncode == 2
        assert len(output.strip().splitlines()) == 1, output


def test_every_node_has_its_services_and_life(tmp_path: Path) -> None:
    """A deactivated controller holds the run; active again, it goes on; SIGTERM closes the bag."""
    scenario = load_scenario(write(tmp_path, duration=600.0))
    values = node_parameters(scenario, 'gvc', bag=tmp_path / 'bag')
    path = tmp_path / 'params.yaml'
    path.write_text(parameter_file(values, 'by hand'))
    with graph((ALONE, ['--params-file', str(path)])) as (peer, processes):
        for name in values:
            peer.until(lambda name=name: peer.call(Trigger, f'{name}/ready').success, name)
        peer.listen(topics.PROGRESS)
        heard = peer.heard[topics.PROGRESS.name]
        peer.until(lambda: heard and heard[-1].stamp.sec > 1, 'progress')
        assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=False)).success
        assert change(peer, Transition.TRANSITION_DEACTIVATE)
        state = peer.call(GetState, 'controller_node/get_state').current_state.label
        assert state == 'inactive'
        held = heard[-1].stamp.sec
        assert change(peer, Transition.TRANSITION_ACTIVATE)
        assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=True)).success
        peer.until(lambda: heard[-1].stamp.sec > held + 1, 'more progress')
        code, output = stop(processes[ALONE])
        assert code == 0, output
    assert read_bag(tmp_path / 'bag', decode=False).notes == []


@pytest.mark.long
def test_memory_does_not_grow_with_the_run(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    process = start(write(tmp_path, duration=80.0), out, '--composed')
    composed = node_of(out, ALONE)
    sizes = []
    while process.poll() is None:
        try:
            sizes.append(composed.memory_info().rss / 1e6)
        except psutil.NoSuchProcess:
            break
        time.sleep(0.05)
    _, errors = process.communicate(timeout=patience(60))
    assert process.returncode == 0, errors
    half = len(sizes) // 2
    assert max(sizes[half:]) < max(sizes[:half]) + 5.0, 'MB'
