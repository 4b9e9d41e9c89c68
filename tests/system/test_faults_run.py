"""`auv run` of a vehicle that fails: the graph equals the simulation, and the report says what
each law did under each fault."""

from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import psutil
import pyarrow.parquet as parquet
import pytest
from helpers.artists import undrawn
from helpers.graph_runs import assert_same, both
from helpers.node_processes import fresh_domain
from helpers.report_pages import Page

from auv_analysis.bag.load import load_run
from auv_analysis.bag.reading import read_bag
from auv_analysis.cli.main import main
from auv_analysis.graph import recorded_runs
from auv_analysis.metrics.fault_response import FILE, responses
from auv_analysis.runs.run import Run
from auv_dynamics.ros import interface

SCENARIO = """
name: failing
vehicle: bluerov2_heavy
duration: 6.0
step: 0.01
seed: 5
controllers:
  gvc: {law: gvc, k_D: 5.0, k_I: 1.0, Lambda: 0.8, Gamma: 5.0}
setpoint: {surge: {offset: 0.3}, heave: {offset: -0.1}, yaw: {offset: 0.1}}
actuators: {thrusters: true, lag: 0.05, delay: 0.02}
faults:
  - {kind: thruster, thruster: 2, efficiency: 0.25, from: 2.5, to: 3.0}
  - {kind: thruster, thruster: T6, stuck: -8.0, from: 2.8, to: 3.2}
  - {kind: actuator, axis: yaw, efficiency: 0.5, from: 1.0, to: 1.5}
  - {kind: sensor_delay, delay: 0.08, from: 3.4, to: 3.7}
  - {kind: sensor_bias, velocity: [0.05, 0, 0, 0, 0, 0.02], attitude: [0, 0.1, 0],
     from: 4.0, to: 4.4}
  - {kind: sensor_drop_out, probability: 0.6, from: 4.6, to: 4.8}
  - {kind: wrench_loss, probability: 0.7, from: 5.0, to: 5.2, timeout: 0.03}
  - {kind: wrench_loss, from: 5.6}
"""


@pytest.fixture(scope='module')
def done(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp('failing')
    (root / 'failing.yaml').write_text(SCENARIO)
    with undrawn(), pytest.MonkeyPatch.context() as patch:
        executes = Mock(begin=psutil.Popen)  # not forked from this process, which has threads
        patch.setattr(recorded_runs, 'ForkServer', lambda _: nullcontext(executes))
        patch.setattr(recorded_runs, 'ANNOUNCED', 0.0)  # s: nobody else is on a domain of its own
        patch.setenv('ROS_DOMAIN_ID', str(fresh_domain()))
        main(['run', str(root / 'failing.yaml'), '--out', str(root / 'out'), '--composed'])
    return root


@pytest.fixture(scope='module')
def recorded(done: Path) -> Run:
    return load_run(done / 'out' / 'gvc')


def test_the_graph_equals_the_simulation(done: Path) -> None:
    recorded, simulated = both(done / 'out', done / 'failing.yaml')
    assert_same(recorded, simulated)
    assert recorded.faults == simulated.faults
    assert len(recorded.faults) == 8


def test_no_message_is_withheld_and_every_step_has_truth_and_applied_wrench(done: Path) -> None:
    contents = read_bag(done / 'out' / 'gvc')
    topics = (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS)
    assert {contents.counts[f'/{topic}'] for topic in topics} == {601}


def test_the_bag_shows_each_fault(recorded: Run) -> None:
    def seen(begin: float, end: float) -> np.ndarray:
        inside = slice(round(begin / 0.01), round(end / 0.01))
        return np.abs(recorded.nu_measured - recorded.nu)[inside].max(axis=0)

    def missed(begin: float, end: float) -> np.ndarray:
        inside = slice(round(begin / 0.01), round(end / 0.01))
        return np.abs(recorded.tau_applied - recorded.tau)[inside].max(axis=0)

    assert seen(0.0, 3.4).max() == 0.0
    assert seen(3.4, 3.7).max() > 1e-4
    np.testing.assert_allclose(seen(4.0, 4.4), [0.05, 0, 0, 0, 0, 0.02], atol=1e-12)
    repeated = (np.diff(recorded.nu_measured[459:480], axis=0) == 0).all(axis=1)
    assert 4 <= repeated.sum() < 20
    assert missed(2.8, 3.2)[2] > 3.0, 'a thruster that pushes up all the time'
    assert np.ptp(recorded.tau_applied[590:], axis=0).max() < 1e-2, 'the last wrench is held'
    assert np.ptp(recorded.tau[590:], axis=0).max() > 1e-2


def test_the_report_says_what_the_law_did(done: Path, recorded: Run) -> None:
    page = Page((done / 'out' / 'report.html').read_text(encoding='utf-8'))
    tables = [name for name in page.tables if name.startswith('faults_')]
    assert tables == [f'faults_{number}' for number in range(1, 9)]
    rows = parquet.read_table(done / 'out' / FILE).to_pylist()
    assert len(rows) == 8 * 6
    assert {row['controller'] for row in rows} == {'gvc'}
    known = {(one.mark.number, one.dof): one for one in responses(recorded)}
    for row in rows:
        assert row['rms_during'] == known[row['fault'], row['dof']].rms[1]
    assert all(row['end'] is None and row['recovery'] is None for row in rows[-6:])
    assert (done / 'out' / 'figures' / 'faults.png').is_file()
