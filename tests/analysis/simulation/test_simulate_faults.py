"""Closed loops under faults: against the independent implementation, one by one and in batches."""

import numpy as np
import pytest
from helpers.closed_loops import file_of, pair, wave
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis import simulate
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario, load_scenario
from auv_analysis.simulation.rollouts import rollouts

SERIES = ('nu', 'tau', 'disturbance_estimate', 'eta', 'nu_measured', 'tau_applied')
SENSORS = {'velocity_noise': 0.002, 'attitude_noise': 0.01, 'drop_out': 0.1}
CORNERS = [[x, y, z] for x in (-1.0, 1.1) for y in (-0.6, 0.7) for z in (-0.2, 0.3)]
EIGHT = [
    {'name': f't{i}', 'position': r, 'direction': [1, (-1) ** i, 0.3 * i - 1], 'limit': [250, 300]}
    for i, r in enumerate(CORNERS)
]
VEHICLE = file_of('rexrov') | {'thrusters': EIGHT}
THRUSTERS = {'thrusters': True, 'lag': 0.04, 'delay': 0.02, 'limit': [400, 300, 700, 90, 150, 60]}
BIAS = {'kind': 'sensor_bias', 'velocity': [0.1, 0, -0.05, 0, 0.02, 0.05], 'from': 0.5, 'to': 1.5}
TILT = {'kind': 'sensor_bias', 'attitude': [0.1, -0.2, 0.3], 'from': 1.0}
LATE = {'kind': 'sensor_delay', 'delay': 0.08, 'from': 0.4, 'to': 1.2}
LATER = {'kind': 'sensor_delay', 'delay': 0.03, 'from': 1.2, 'to': 1.6}
GONE = {'kind': 'sensor_drop_out', 'from': 0.7, 'to': 0.9}
SOME = {'kind': 'sensor_drop_out', 'probability': 0.4}
DEAD = {'kind': 'thruster', 'thruster': 2, 'efficiency': 0.0, 'from': 0.5}
WEAK = {'kind': 'thruster', 'thruster': 2, 'efficiency': 0.5, 'to': 1.0}
STUCK = {'kind': 'thruster', 'thruster': 5, 'stuck': -120.0, 'from': 0.3, 'to': 1.4}
HALF = {'kind': 'actuator', 'axis': 'surge', 'efficiency': 0.5, 'from': 0.2, 'to': 1.1}
BLOCKED = {'kind': 'actuator', 'axis': 'yaw', 'stuck': 60.0, 'from': 0.6, 'to': 1.2}
SILENT = {'kind': 'wrench_loss', 'from': 0.5, 'to': 0.8}
SHORT = {'kind': 'wrench_loss', 'from': 1.0, 'to': 1.5, 'timeout': 0.055}
NOISY = {'kind': 'wrench_loss', 'probability': 0.5, 'timeout': 0.02}
CASES = {
    'bias': {'faults': [BIAS, TILT]},
    'delay': {'faults': [LATE, LATER]},
    'delay from the start': {'faults': [{'kind': 'sensor_delay', 'delay': 0.05}]},
    'drop-out': {'faults': [GONE]},
    'random drop-out': {'faults': [SOME, GONE, SOME]},
    'late, lost, biased, noisy': {
        'faults': [LATE, SOME, BIAS, GONE, TILT, LATER],
        'sensors': SENSORS,
    },
    'axes': {'faults': [HALF, BLOCKED, HALF]},
    'axes behind limits and lag': {
        'faults': [HALF, BLOCKED],
        'actuators': {'limit': 400.0, 'lag': 0.05, 'rate': 5e3, 'delay': 0.03},
    },
    'thrusters': {'faults': [DEAD, WEAK, STUCK], 'actuators': {'thrusters': True}},
    'thrusters and the rest': {'faults': [DEAD, WEAK, STUCK, HALF], 'actuators': THRUSTERS},
    'wrench lost': {'faults': [SILENT, SHORT]},
    'wrench lost from the start': {'faults': [{'kind': 'wrench_loss', 'to': 0.3}]},
    'wrench lost at random': {'faults': [NOISY, SILENT], 'actuators': THRUSTERS},
    'everything': {
        'faults': [SOME, NOISY, LATE, BIAS, DEAD, STUCK, HALF, SHORT, LATER, SOME, NOISY],
        'sensors': SENSORS,
        'actuators': THRUSTERS,
    },
}
MILD = {
    'surge': wave(0.1, 0.2, 0.5), 'sway': wave(-0.1, 0.1, 0.7, 1.0), 'heave': wave(0.1, 0.1, 0.4),
    'roll': wave(0.0, 0.05, 0.9), 'pitch': wave(0.02, 0.04, 0.8), 'yaw': wave(0.1, 0.2, 0.6),
}  # fmt: skip
TILTED = {'eta': [1.0, -2.0, 3.0, 0.2, -0.3, 2.5], 'nu': [0.1, -0.1, 0.1, 0.02, -0.02, 0.1]}
BASE = {'setpoint': MILD, 'initial': TILTED, 'duration': 1.0, 'seed': 3}


@pytest.mark.parametrize('name', CASES)
def test_every_fault_is_that_of_the_documentation(name):
    halved = [fault | {end: fault[end] / 2 for end in ('from', 'to') if end in fault}
              for fault in CASES[name]['faults']]  # fmt: skip
    case = CASES[name] | {'faults': halved}
    ours, theirs = pair('gvc', 'zoh', VEHICLE, **BASE, **case)
    for key in SERIES:
        scale = max(np.abs(theirs[key]).max(), 1e-3)
        assert_allclose(getattr(ours, key), theirs[key], rtol=0, atol=1e-9 * scale, err_msg=key)
    scale = np.abs(theirs['tau']).max() + np.abs(theirs['F']).max()
    assert_allclose(ours.disturbance, theirs['F'], rtol=0, atol=1e-9 * scale)
    for kinds, truth, seen in (
        (('sensor_drop_out', 'sensor_delay', 'sensor_bias'), 'nu', 'nu_measured'),
        (('thruster', 'actuator', 'wrench_loss'), 'tau', 'tau_applied'),
    ):
        if any(spec['kind'] in kinds for spec in CASES[name]['faults']):
            assert np.abs(theirs[truth] - theirs[seen]).max() > 1e-3, 'the fault does something'


ALL = [SOME, NOISY, LATE, BIAS, WEAK, STUCK, HALF, SHORT, LATER, SOME, NOISY]


def scenario(**changes) -> Scenario:
    values = {'vehicle': VEHICLE, 'duration': 2.0, 'faults': ALL, 'setpoint': MILD, **changes}
    return changed_scenario(load_scenario('case1_rexrov'), values)


def error_of(one: Scenario) -> np.ndarray:
    run = simulate(one, 'gvc', 'zoh')
    return np.sqrt(((run.nu_d - run.nu) ** 2).mean(axis=0))


def rms(found: dict) -> np.ndarray:
    names = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
    return np.stack([found[f'velocity_error.rms.{name}'] for name in names], axis=-1)


def test_faults_and_noise_late_in_a_run():
    late = {**HALF, 'from': 11.0, 'to': 11.5}  # the tables of 1024 steps are full by then
    noisy = {'velocity_noise': 0.002}
    run = simulate(scenario(duration=12.0, faults=[late], sensors=noisy), 'gvc', 'zoh')
    at = np.flatnonzero(np.any(run.tau_applied != run.tau, axis=1)) * run.step
    assert_allclose((at[0], at[-1]), (11.0, 11.49))
    error = run.nu_measured - run.nu
    assert np.abs(error[1024:1100] - error[:76]).max() > 0.002


def test_a_batch_with_faults_is_its_loops_one_by_one():
    one = scenario(actuators=THRUSTERS, sensors=SENSORS, duration=4.0)
    changes = {
        'faults[2].from': [0.4, 0.6, 0.5, 0.41, 0.7],  # of a delay: lanes that are late at times
        'faults[5].stuck': [-120.0, 0.0, 50.0, 120.0, -30.0],
        'faults[7].to': [1.5, 1.2, 1.3, 1.9, 3.4],  # behind 256 steps, which a table holds
        'seed': [1, 2, 3, 4, 5],
    }
    found = rollouts(one, 'gvc', changes, hold='zoh')
    assert (found['status'] == 'ok').all(), found['reason']
    for i in range(5):
        single = {path: values[i] for path, values in changes.items()}
        assert_allclose(rms(found)[i], error_of(changed_scenario(one, single)), rtol=1e-9)
    assert len(np.unique(rms(found)[:, 0])) == 5


def test_a_batch_over_gains_has_the_faults_in_every_lane():
    one = scenario(faults=[HALF, LATE, SILENT])
    k_D = [8.0, 9.0, 10.0]
    found = rollouts(one, 'gvc', {'controllers.gvc.k_D': k_D}, hold='zoh')
    for i, value in enumerate(k_D):
        alone = error_of(changed_scenario(one, {'controllers.gvc.k_D': value}))
        assert_allclose(rms(found)[i], alone, rtol=1e-9)


def test_a_batch_refuses_what_a_scenario_refuses():
    one = scenario(faults=[HALF, LATE])
    changes = {'faults[0].to': [1.0, 0.1], 'faults[1].delay': [0.08, 0.08]}
    found = rollouts(one, 'gvc', changes, hold='zoh')
    assert list(found['status']) == ['ok', 'refused']
    assert found['reason'][1].startswith('faults[0].to: expected a time after from')


def test_a_run_is_the_same_until_its_first_fault():
    before = simulate(scenario(faults=[]), 'gvc', 'zoh')
    late = [{**HALF, 'from': 1.0}, {**GONE, 'from': 1.2, 'to': 1.5}]
    after = simulate(scenario(faults=late), 'gvc', 'zoh')
    assert_array_equal(after.nu[:101], before.nu[:101])
    assert np.abs(after.nu[101:] - before.nu[101:]).max() > 1e-4
    assert before.measured is None
    assert before.applied is None
    assert after.measured is not None
    assert after.applied is not None


def test_a_fault_more_changes_no_draw_of_another_and_no_noise():
    """Seeing only: with the law deaf to it, what is drawn is the difference to the truth."""
    noisy = {'sensors': {'velocity_noise': 0.01, 'drop_out': 0.2}, 'seed': 4}
    quiet = {'k_D': 0.0, 'k_I': 0.0, 'Lambda': 0.0, 'Gamma': 0.0, 'law': 'gvc'}
    runs = [
        simulate(scenario(controllers={'gvc': quiet}, faults=faults, **noisy), 'gvc', 'zoh')
        for faults in ([], [SOME], [NOISY, SOME], [SOME, {**SOME, 'from': 1.99}])
    ]
    drawn = [run.measured - run.nu for run in runs[1:]]
    first = slice(0, 190)
    lost = [(np.diff(run.measured, axis=0) == 0).all(axis=1)[first] for run in runs]
    assert (lost[0] <= lost[1]).all(), 'what the noise loses is lost'
    assert lost[0].sum() + 20 < lost[1].sum()
    for other in lost[2:]:
        assert_array_equal(other, lost[1])
    kept = np.flatnonzero(~lost[1]) + 1
    fresh = (runs[0].measured - runs[0].nu)[kept]
    for noise in drawn:
        assert_allclose(noise[kept], fresh, atol=1e-12)


def test_the_resolved_scenario_says_the_same():
    one = scenario(faults=[{**DEAD, 'thruster': 't2'}], actuators={'thrusters': True})
    assert (
        one.faults.entries
        == scenario(faults=[DEAD], actuators=one.data['actuators']).faults.entries
    )
    assert one.sampled == ['actuators', 'faults']
