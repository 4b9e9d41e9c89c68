"""A few steps of everything at once against the independent implementation: laws, holds, devices.

The steps are few, so that plain Python is fast enough to try a mutant of the kernel; every number
of each series counts by itself, so that a wrong axis cannot hide behind a larger one.
"""

import numpy as np
import pytest
from helpers.closed_loops import FULL, HARMONIC, PER_AXIS, SIX, TURNED, file_of, pair, wave
from numpy.testing import assert_allclose
from reference_cases import CL, ERRORS, PID, SMC, VARYING, off_centre

SERIES = (
    't', 'eta', 'nu', 'nu_d', 'tau', 'disturbance', 'disturbance_estimate', 'nu_measured',
    'tau_applied', 'law_state',
)  # fmt: skip
NAMES = {'disturbance': 'F'}  # ours is the lumped one
DENSE = np.array(FULL['Lambda'])
SWITCHING = {'Lambda': DENSE, 'k_S': [90.0, 80.0, 70.0, 60.0, 50.0, 40.0]}
LAWS = {
    'gvc': FULL,
    'cl': CL | {'Gamma': (3000.0 * DENSE).tolist(), 'Lambda': PER_AXIS['Lambda']},
    'pid': PID | {'k_D': (40.0 * DENSE).tolist(), 'omega_f': [8, 9, 10, 11, 12, 13], 'k_FF': 0.9},
    'smc': SMC | {'Lambda': DENSE.tolist(), 'k_S': [90, 80, 70, 60, 50, 40],
                  'phi': [0.9, 0.05, 0.5, 2.0, 0.02, 1.0]},
}  # fmt: skip
SPLIT = {'kind': 'model_error', 'dM': (20.0 * DENSE).tolist(), 'dD': (30.0 * DENSE).tolist()}
LIGHT = {'kind': 'model_error', 'buoyancy': -0.1}
STEADY = {'kind': 'current', 'velocity': [0.5, -0.3, 0.2]}
SCALED = {'kind': 'herman2018', 'scale': [3.0, 2.0, 1.0, 4.0, 5.0, 6.0]}
PUSHED = [VARYING, ERRORS, HARMONIC, SCALED]
SEEN = {
    'velocity_noise': [0.01, 0.02, 0.03, 0.015, 0.005, 0.01],
    'attitude_noise': [0.02, 0.05, 0.03],
    'drop_out': 0.3,
}
SERVO = {'limit': [400, 300, 200, 100, 250, 150], 'rate': [9000, 8000, 7000, 6000, 5000, 4000],
         'lag': 0.03, 'delay': 0.02}  # fmt: skip


def check(law, hold, vehicle, **changes):
    changes = {'duration': 0.1, 'setpoint': SIX, 'initial': TURNED, 'gains': LAWS[law]} | changes
    ours, theirs = pair(law, hold, vehicle, **changes)
    for key in SERIES:
        found, expected = getattr(ours, key), theirs[NAMES.get(key, key)]
        scale = np.maximum(np.abs(expected).max(axis=0), 1e-4)
        assert_allclose(found / scale, expected / scale, rtol=0, atol=1e-7, err_msg=key)
    return ours


@pytest.mark.parametrize('law', LAWS)
def test_continuous(law):
    check(law, 'continuous', off_centre(), disturbance=PUSHED)


@pytest.mark.parametrize('law', LAWS)
def test_sampled_with_all_devices(law):
    run = check(law, 'zoh', off_centre(), disturbance=PUSHED, actuators=SERVO, sensors=SEEN, seed=3)
    assert np.any(run.tau_applied != run.tau)
    assert np.any(np.all(np.diff(run.nu_measured, axis=0) == 0.0, axis=1)), 'a sample is lost'


def test_rk4():
    check('gvc', 'continuous', off_centre(), disturbance=PUSHED, integrator='rk4', step=0.002)


def test_euler():
    vehicle = file_of('rexrov')  # weightless: one order is too few to compare forms of attitude
    vehicle['hydrostatics'] = {'volume': 1862.87 / 1028.0, 'center_of_buoyancy': [0.0] * 3}
    ours, theirs = pair('cl', 'zoh', vehicle, integrator='euler', setpoint=SIX, duration=0.1)
    assert_allclose(ours.nu, theirs['nu'], rtol=1e-9, atol=1e-12)


def test_thrusters_at_their_limits():
    gains = {'k_D': [60, 50, 40, 3, 4, 5], 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 30.0}
    target = {'surge': wave(2.0, 0.4, 0.5), 'sway': wave(-1.0, 0.2, 0.7), 'yaw': wave(1.0, 0, 0)}
    changes = {'gains': gains, 'setpoint': target, 'disturbance': [STEADY]}
    for name in ('bluerov2_heavy', 'bluerov2'):
        vehicle = file_of(name)
        for limit in ({}, {'limit': [25.0, 30.0, 1e3, 1e3, 1e3, 2.0]}):
            acting = {'thrusters': True, **limit}
            run = check('cl', 'zoh', vehicle, actuators=acting, **changes)
            assert np.abs(run.tau_applied - run.tau).max() > 1.0
    vehicle['thrusters'] = [
        one | {'limit': [11.0 + i, 25.0 - 2 * i]} for i, one in enumerate(vehicle['thrusters'])
    ]
    check('cl', 'zoh', vehicle, actuators={'thrusters': True}, **changes)


def test_errors_given_as_matrices():
    vehicle = file_of('herman2018')
    paper = {'kind': 'herman2018', 'exponent_sign': 1}
    check('gvc', 'continuous', vehicle, disturbance=[SPLIT, STEADY, paper, LIGHT])
    check('gvc', 'zoh', vehicle, disturbance=[SPLIT, SPLIT, STEADY])
