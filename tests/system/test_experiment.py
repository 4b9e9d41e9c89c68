"""`auv run` as a user starts it: the graph equals the simulation, nothing is lost, nobody stays."""

import json
import os
import signal
import time
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import yaml
from helpers.graph_runs import (
    assert_same,
    both,
    every_message,
    node_of,
    nodes,
    recorded,
    start,
    start_installed,
)
from helpers.node_processes import Peer, auv, fresh_domain, installed_auv
from helpers.patience import patience

from auv_analysis import load_scenario, simulate
from auv_analysis.bag.load import load_run
from auv_analysis.bag.reading import read_bag
from auv_analysis.cli.main import main
from auv_analysis.graph import recorded_runs
from auv_analysis.output.folder import results_folder
from auv_dynamics.files.errors import ENDING
from auv_dynamics.ros import interface, topics
from auv_dynamics.vehicle.kinematics import quaternion

GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
SCENARIO = {
    'name': 'six_dofs',
    'vehicle': 'rexrov',
    'duration': 1.5,
    'step': 0.01,
    'initial': {'eta': [1.0, 2.0, 3.0, 0.2, -0.3, 1.2], 'nu': [0.3, -0.1, 0.2, 0.05, 0.02, -0.1]},
    'controllers': {
        'gvc': {'law': 'gvc', **GAINS},
        'cl': {'law': 'cl', **GAINS, 'k_D': [900.0, 800.0, 700.0, 600.0, 500.0, 400.0]},
    },
    'setpoint': {
        dof: {'offset': 0.05 * i, 'terms': [{'amplitude': 0.1, 'omega': 0.5 + 0.1 * i}]}
        for i, dof in enumerate(('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw'))
    },
    'disturbance': [
        {'kind': 'herman2018'},
        {
            'kind': 'harmonic',
            'heave': {'offset': -30.0, 'terms': [{'amplitude': 10, 'omega': 0.3}]},
        },
    ],
}
PACED = ('/diagnostics', '/recorder/progress', '/controller_node/transition_event')  # by the wall


def write(path: Path, **changes) -> Path:
    path.write_text(yaml.safe_dump({**SCENARIO, **changes}, sort_keys=False))
    return path


@pytest.fixture(scope='module')
def done(tmp_path_factory) -> Path:
    """Two recorded runs of the same scenario: gvc in folder one, both in two."""
    root = tmp_path_factory.mktemp('run')
    scenario = write(root / 'six_dofs.yaml')
    options = '--out', str(root / 'one'), '--controller', 'gvc', '--json', '--no-report'
    ended = installed_auv('run', str(scenario), *options)
    assert ended.returncode == 0, ended.stderr
    assert json.loads(ended.stdout).keys() == {'gvc'}
    assert 'export ROS_DOMAIN_ID=' in ended.stderr
    with results_folder(root / 'two', overwrite=False) as results:
        (results.folder / 'setpoint.csv').write_text('of an earlier result')
    options = '--out', str(root / 'two'), '--composed', '--no-report', '--overwrite', '--json'
    ended = auv('run', str(scenario), *options)
    assert ended.returncode == 0, ended.stderr
    assert json.loads(ended.stdout).keys() == {'gvc', 'cl'}
    assert not nodes(root)
    return root


@pytest.mark.parametrize(('folder', 'controller'), [('one', 'gvc'), ('two', 'cl')])
def test_the_graph_equals_the_simulation(done: Path, folder: str, controller: str) -> None:
    recorded, simulated = both(done / folder, done / 'six_dofs.yaml', controller)
    assert_same(recorded, simulated)
    assert len(recorded.t) == 151
    assert recorded.law == controller
    assert recorded.controller == controller
    assert recorded.scenario == 'six_dofs'
    assert recorded.gains == simulated.gains


def test_two_runs_are_equal(done: Path) -> None:
    one, two = (read_bag(done / name / 'gvc').messages for name in ('one', 'two'))
    assert one.keys() == two.keys()
    assert {topic.strip('/') for topic in one} == set(interface.STEP_TOPICS) - {'twist'}
    for topic, (stamps, values) in one.items():
        assert np.array_equal(stamps, two[topic][0])
        assert np.array_equal(values, two[topic][1])


@pytest.mark.long
def test_the_plain_executor_gives_the_same_run(
    done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('AUV_GVC_EXECUTOR', 'plain')
    out = recorded(done / 'six_dofs.yaml', tmp_path / 'plain', 'gvc')
    ours, plain = (every_message(folder / 'gvc', *PACED) for folder in (done / 'one', out))
    assert len(ours['/odom']) == len(ours['/clock']) == 151
    assert ours == plain


def test_the_bag_alone_closes_the_equation_of_motion(done: Path) -> None:
    """Signs and frames: M dnu/dt = tau - C nu - D nu - g - F, F from the topic `disturbance`."""
    run = load_run(done / 'one' / 'gvc')
    vehicle, h = run.vehicle, run.step
    residual, scale = [], []
    for k in range(50, len(run.t) - 1):
        middle_nu = (run.nu[k] + run.nu[k + 1]) / 2
        middle_eta = (run.eta[k] + run.eta[k + 1]) / 2
        F = (run.disturbance[k] + run.disturbance[k + 1]) / 2
        rate = (run.nu[k + 1] - run.nu[k]) / h
        needed = vehicle.inverse_dynamics(middle_eta, middle_nu, rate, F)
        residual.append(needed - run.tau[k])
        scale.append(np.abs(run.tau[k]))
    assert np.abs(residual).max() < 1e-4 * np.max(scale)
    assert np.abs(run.disturbance).max() > 20, 'a disturbance without effect would be noticed'


def test_twist_is_in_the_child_frame(done: Path) -> None:
    run = load_run(done / 'one' / 'gvc')
    assert np.abs(run.eta[:, 5]).min() > 0.5, 'yaw is not zero'
    from auv_dynamics.vehicle.kinematics import rotation

    for k in range(0, 150, 10):
        moved = (run.eta[k + 1, :3] - run.eta[k, :3]) / run.step
        nu, euler = (run.nu[k] + run.nu[k + 1]) / 2, (run.eta[k] + run.eta[k + 1])[3:] / 2
        assert np.allclose(moved, rotation(quaternion(euler)) @ nu[:3], atol=1e-4)


def test_what_a_run_leaves(done: Path) -> None:
    out = done / 'one'
    summary = json.loads((out / 'summary.json').read_text())
    assert summary['gvc']['source'] == 'bag'
    assert summary['gvc']['samples'] == 151
    parameters = yaml.safe_load((out / 'gvc' / 'params.yaml').read_text())
    assert parameters['/**/plant_node']['ros__parameters']['lockstep'] is True


def test_a_run_that_replaces_another_result_lies_in_its_place(done: Path) -> None:
    out = done / 'two'
    left = {'summary.json', 'scenario.yaml', 'vehicle.yaml', 'logs', 'gvc', 'cl', 'manifest.json'}
    assert {path.name for path in out.iterdir()} == left
    assert str(out / 'vehicle.yaml') in (out / 'cl' / 'params.yaml').read_text()


def test_analyze_and_info_read_what_run_recorded(done: Path, tmp_path: Path) -> None:
    bags = [str(done / name / 'gvc') for name in ('one', 'two')]
    ended = auv('analyze', *bags, '--out', str(tmp_path / 'both'), '--json', '--no-report')
    assert ended.returncode == 0, ended.stderr
    summaries = json.loads(ended.stdout)
    original = json.loads((done / 'one' / 'summary.json').read_text())['gvc']
    assert list(summaries.values()) == [original, original]
    ended = auv('info', bags[0])
    assert ended.returncode == 0
    assert '/odom' in ended.stdout
    assert 'scenario.yaml' in ended.stdout


def test_a_run_can_be_repeated_from_what_it_left(done: Path, tmp_path: Path) -> None:
    left = done / 'one' / 'scenario.yaml'
    again = simulate(load_scenario(left), 'gvc', 'zoh')
    first = simulate(load_scenario(done / 'six_dofs.yaml'), 'gvc', 'zoh')
    assert np.array_equal(again.nu, first.nu)


@pytest.mark.parametrize(
    'how',
    [
        *(pytest.param(how, marks=pytest.mark.long) for how in ENDING if how != signal.SIGHUP),
        signal.SIGHUP,
        signal.SIGKILL,
    ],
)
def test_ending_auv_ends_its_nodes_and_keeps_earlier_results(tmp_path: Path, how: int) -> None:
    with results_folder(tmp_path / 'out', overwrite=False) as results:
        (results.folder / 'summary.json').write_text('earlier')
    out = tmp_path / 'out' / 'unfinished'
    scenario = write(tmp_path / 's.yaml', duration=600.0)
    begin = start_installed if how == signal.SIGKILL else start  # who dies ends no child of others
    process = begin(scenario, results.out, '--overwrite')
    node_of(out, 'plant_node')
    policies = {name: os.sched_getscheduler(node.pid) for name, node in nodes(out).items()}
    process.send_signal(how)
    _, errors = process.communicate(timeout=patience(60))
    assert how == signal.SIGKILL or errors.splitlines()[-1] == 'interrupted'
    prompt = {name for name, policy in policies.items() if policy != os.SCHED_BATCH}
    assert len(policies) == 5
    assert prompt == {'plant_node', 'controller_node'}, 'observers give way to them'
    limit = time.monotonic() + patience(10)
    while nodes(out):
        assert time.monotonic() < limit, 'its nodes outlive auv'
        time.sleep(0.05)
    notes = ' '.join(load_run(out / 'gvc').notes)
    assert 'not finished' not in notes, 'the recorder has closed its bag'
    assert (results.out / 'summary.json').read_text() == 'earlier'


@pytest.mark.long
def test_a_diverging_loop_says_so(tmp_path: Path) -> None:
    unstable = {'bad': {'law': 'cl', **GAINS, 'k_D': -1e6}}
    scenario = write(tmp_path / 's.yaml', controllers=unstable)
    ended = auv('run', str(scenario), '--out', str(tmp_path / 'out'))
    assert ended.returncode == 1
    assert 'plant_node ended with exit code 1' in ended.stderr
    assert 'diverges' in ended.stderr
    assert not nodes(tmp_path)


def test_a_domain_with_another_vehicle_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setattr(recorded_runs, 'ForkServer', nullcontext)  # it would have threads
    domain = fresh_domain()
    peer = Peer(domain)
    peer.node.create_publisher(topics.WRENCH.type, '/other/wrench', 10)
    told = '--out', str(tmp_path / 'out'), '--domain-id', str(domain)
    with patch.dict(os.environ), pytest.raises(SystemExit, match='2'):
        main(['run', str(write(tmp_path / 's.yaml')), *told])
    peer.close()
    assert 'test_peer on /other/wrench' in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


@pytest.mark.long
def test_ten_runs_in_a_row_lose_and_double_nothing(tmp_path: Path) -> None:
    controllers = {f'gvc{i}': {'law': 'gvc', **GAINS} for i in range(10)}
    scenario = write(tmp_path / 's.yaml', duration=30.0, controllers=controllers)
    ended = auv('run', str(scenario), '--out', str(tmp_path / 'out'))
    assert ended.returncode == 0, ended.stderr
    for name in controllers:
        contents = read_bag(tmp_path / 'out' / name, decode=False)
        for topic in interface.STEP_TOPICS:
            assert contents.counts[f'/{topic}'] == 3001, (name, topic)
        assert contents.counts['/analysis/lumped_error'] == 301
