"""`auv run` with everything that a real vehicle has and a model has not: the graph equals the
simulation, and the bag says what was commanded, applied, true and measured."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.graph_runs import assert_same, both
from helpers.node_processes import auv
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate
from auv_analysis.bag.load import load_run
from auv_analysis.bag.reading import read_bag
from auv_analysis.runs.run import Run
from auv_dynamics.ros import interface

SCENARIO = """
name: uncertain
vehicle: bluerov2_heavy
duration: 2.0
step: 0.01
seed: 5
initial: {eta: [0, 0, 2, 0.1, -0.2, 1.0], nu: [0.1, 0, 0, 0, 0, 0.1]}
controllers:
  gvc: {law: gvc, k_D: 12.0, k_I: 1.0, Lambda: 0.8, Gamma: 60.0}
  pid: {law: pid, k_P: [90, 90, 90, 5, 5, 5], k_I: 10.0, k_D: 0.5, anti_windup: false}
setpoint: {surge: {offset: 0.8}, heave: {offset: -0.3}, yaw: {offset: 0.4}}
disturbance:
  - {kind: harmonic, sway: {offset: 3.0, terms: [{amplitude: 5.0, omega: 2.0}]}}
  - {kind: model_error, mass: 0.05, added_mass: -0.2, damping: 0.3}
  - {kind: current, velocity: [0.3, 0.1, 0.0], east: {terms: [{amplitude: 0.1, omega: 1.0}]}}
actuators: {limit: [80, 60, 90, 9, 9, 9], rate: 3000, lag: 0.05, delay: 0.02, thrusters: true,
  saturation: priority, rotors: true, rotor_lag: 0.02, dead_band: [0.5, 0.7],
  voltage: [16.0, 14.5, 1.5]}
sensors: {velocity_noise: 0.01, attitude_noise: 0.02, drop_out: 0.2}
"""


@pytest.fixture(scope='module')
def done(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp('uncertain')
    (root / 'uncertain.yaml').write_text(SCENARIO)
    options = '--out', str(root / 'out'), '--json', '--composed', '--no-report'
    ended = auv('run', str(root / 'uncertain.yaml'), *options)
    assert ended.returncode == 0, ended.stderr
    (root / 'summary.json').write_text(ended.stdout)
    return root


@pytest.fixture(scope='module', params=['gvc', 'pid'])
def pair(request, done: Path) -> tuple[Run, Run]:
    return both(done / 'out', done / 'uncertain.yaml', request.param)


def test_the_graph_equals_the_simulation(pair: tuple[Run, Run]) -> None:
    recorded, simulated = pair
    assert_same(recorded, simulated)
    assert recorded.kinds == simulated.kinds == {'harmonic', 'model_error', 'current'}


def test_command_and_applied_wrench_truth_and_measurement_differ(pair: tuple[Run, Run]) -> None:
    run, _ = pair
    assert np.abs(run.tau).max() > 90.0
    assert (np.abs(run.tau_applied) <= [80, 60, 90, 9, 9, 9]).all()
    assert 0.0 < np.abs(run.nu_measured - run.nu).max() < 0.2


def test_every_topic_has_every_step(done: Path) -> None:
    contents = read_bag(done / 'out' / 'gvc')
    topics = (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS)
    assert {contents.counts[f'/{topic}'] for topic in topics} == {201}


def test_twist_is_what_odom_measured_and_lost_samples_are_repeated(done: Path) -> None:
    run = load_run(done / 'out' / 'gvc')
    stamps, rows = read_bag(done / 'out' / 'gvc').messages['/odom']
    rows = np.array(rows)
    lost = (np.diff(rows, axis=0) == 0).all(axis=1)
    assert 0.1 < lost.mean() < 0.3
    assert (np.diff(stamps) == 10_000_000).all()
    assert (np.diff(run.nu, axis=0) != 0).any(axis=1).all(), 'the truth is never repeated'


def test_the_bag_alone_gives_F_by_its_definition(done: Path) -> None:
    """F = tau_applied - [M nu_dot + C nu + D nu + g] of the vehicle file, step k after wrench k."""
    run = load_run(done / 'out' / 'gvc')
    vehicle, h = run.vehicle, run.step
    for k in range(len(run.t) - 1):
        # the applied wrench is held: nu_dot at the start of the step, from that step alone
        middle = [(a[k] + a[k + 1]) / 2 for a in (run.eta, run.nu)]
        rate = (run.nu[k + 1] - run.nu[k]) / h
        found = run.tau_applied[k] - vehicle.inverse_dynamics(*middle, rate)
        assert_allclose(found, run.disturbance[k], atol=0.05 * np.abs(run.disturbance).max())


def test_the_summary_says_why_there_is_no_certificate(done: Path) -> None:
    summary = json.loads((done / 'summary.json').read_text())
    for controller, words in (
        ('gvc', ('model_error', 'true velocity', 'applied')),
        ('pid', ('pid',)),
    ):
        lyapunov = summary[controller]['lyapunov']
        assert not lyapunov['applicable']
        assert all(word in lyapunov['reason'] for word in words)


def test_the_resolved_scenario_repeats_the_run(done: Path) -> None:
    again = simulate(load_scenario(done / 'out' / 'scenario.yaml'), 'gvc', 'zoh')
    given = simulate(load_scenario(done / 'uncertain.yaml'), 'gvc', 'zoh')
    np.testing.assert_array_equal(again.nu, given.nu)
    # the node compiles the law by itself: what fuses a product with a sum there may differ
    np.testing.assert_allclose(again.nu, load_run(done / 'out' / 'gvc').nu, rtol=0, atol=1e-13)
    assert (
        yaml.safe_load((done / 'out' / 'scenario.yaml').read_text())['sensors']['drop_out'] == 0.2
    )
