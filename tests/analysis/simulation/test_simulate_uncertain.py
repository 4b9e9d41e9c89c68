"""Plants that are not the controller's model, actuators, sensors, pid and smc, and (`long`) 30 s
runs: every one against the independent implementation."""

import herman_reference as reference
import numpy as np
import pytest
from helpers.closed_loops import (
    FULL,
    HARMONIC,
    PAPER,
    PER_AXIS,
    SIX,
    TURNED,
    file_of,
    pair,
    wave,
)
from helpers.strategies import examples, vectors, vehicles
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.scenario.changes import changed_scenario

SERIES = ('t', 'nu', 'nu_d', 'tau', 'disturbance_estimate', 'eta', 'nu_measured', 'tau_applied')
CURRENT = {'kind': 'current', 'velocity': [0.3, 0.1, -0.05]}
TIDE = {'kind': 'current', 'north': wave(0.1, 0.2, 0.4), 'down': wave(0.0, 0.1, 1.1, 0.5)}
ERRORS = {
    'kind': 'model_error',
    'mass': 0.05,
    'added_mass': -0.2,
    'damping': 0.3,
    'buoyancy': -0.02,
}
MATRICES = {
    'kind': 'model_error',
    'dM': (20.0 * np.eye(6) + 3.0 * np.ones((6, 6))).tolist(),
    'dD': np.arange(36.0).reshape(6, 6).tolist(),
}
ACTUATORS = {'limit': [400, 300, 700, 90, 150, 60], 'rate': 5e3, 'lag': 0.04, 'delay': 0.02}
SENSORS = {'velocity_noise': 0.002, 'attitude_noise': [0.01, 0.02, 0.03], 'drop_out': 0.1}
CORNERS = [[x, y, z] for x in (-1.0, 1.1) for y in (-0.6, 0.7) for z in (-0.2, 0.3)]
THRUSTERS = [
    {'name': f't{i}', 'position': r, 'direction': [1, (-1) ** i, 0.3 * i - 1], 'limit': [250, 300]}
    for i, r in enumerate(CORNERS)
]
PID = {'k_P': 3000.0, 'k_I': 200.0, 'k_D': [20, 20, 20, 5, 5, 5]}
ROUGH = {'k_D': [60, 60, 90, 6, 6, 6], 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': [30, 30, 40, 3, 3, 3]}
SMC = {'k_D': 2500.0, 'Lambda': 0.6, 'Gamma': 900.0}
SWITCHED = SMC | {'k_S': 40.0, 'phi': [0.05, 0.05, 0.05, 0.02, 0.02, 0.02]}

UNCERTAIN = {
    'relative errors': {'disturbance': [ERRORS]},
    'full matrices': {'disturbance': [MATRICES]},
    'current': {'disturbance': [CURRENT]},
    'varying current': {'disturbance': [TIDE]},
    'everything at once': {'disturbance': [ERRORS, CURRENT, TIDE, HARMONIC, ERRORS]},
    'matrices and current': {'disturbance': [MATRICES, CURRENT, HARMONIC]},
    'M itself, matrices and current': {'vehicle': 'herman2018', 'disturbance': [MATRICES, CURRENT]},
    'a scaled disturbance': {
        'disturbance': [{'kind': 'herman2018', 'scale': (np.eye(6) + np.ones((6, 6))).tolist()}]
    },
}
SAMPLED = {
    'actuators': {'actuators': ACTUATORS},
    'limits': {'actuators': {'limit': [300, 200, 500, 60, 100, 40]}},
    'thrusters': {'actuators': {'thrusters': True}},
    'thrusters and the rest': {'actuators': ACTUATORS | {'thrusters': True}},
    'sensors': {'sensors': SENSORS},
    'actuators, sensors, errors': {
        'actuators': ACTUATORS,
        'sensors': SENSORS,
        'disturbance': [ERRORS, TIDE],
        'seed': 11,
    },
}
ROTORS = {
    'priority': {'saturation': 'priority'},
    'lag and dead band': {'rotor_lag': 0.15, 'dead_band': [4.0, 7.0]},
    'second order': {'rotors': True, 'lag': 0.02},
    'a battery beside its curve': {'voltage': 14.3, 'rotors': True},
    'a battery that runs down': {'voltage': [17.0, 9.5, 0.3], 'saturation': 'priority'},
    'all of it': {
        'rotors': True, 'dead_band': 3.0, 'saturation': 'priority', 'voltage': [16.0, 14.0, 0.75],
        'delay': 0.03, 'rate': 4e3, 'limit': [150, 120, 170, 30, 30, 25],
    },
}  # fmt: skip
T200 = {'curve': 't200_16v', 'lag': 0.08, 'dead_band': [0.4, 0.5]}
SQUARE = {'voltage': 15.0, 'omega': 18.0, 'zeta': 0.6}
FAILING = [
    {'kind': 'thruster', 'thruster': 'T2', 'efficiency': 0.4, 'from': 0.1, 'to': 0.3},
    {'kind': 'thruster', 'thruster': 'T6', 'stuck': 9.0, 'from': 0.2},
]
BASE = {'setpoint': SIX, 'initial': TURNED}
BACKWARDS = TURNED | {'nu': [-3.0, 0.3, 0.2, 0.1, -0.2, 0.3]}


def compare(ours, theirs, tolerance=1e-8) -> None:
    for key in SERIES:
        expected = theirs[key]
        scale = max(np.abs(expected).max(), 1e-3)
        found = getattr(ours, key)
        assert_allclose(found, expected, rtol=0, atol=tolerance * scale, err_msg=key)
    # F is the difference of forces that are as large as the wrench
    scale = np.abs(theirs['tau']).max() + np.abs(theirs['F']).max()
    assert_allclose(ours.disturbance, theirs['F'], rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
@pytest.mark.parametrize('name', UNCERTAIN)
def test_uncertain_plants(name, hold):
    changes = BASE | UNCERTAIN[name]
    vehicle = file_of(changes.pop('vehicle', 'rexrov'))
    compare(*pair('gvc', hold, vehicle, **changes))


@pytest.mark.parametrize('law', ['gvc', 'cl', 'pid', 'smc'])
@pytest.mark.parametrize('name', SAMPLED)
def test_actuators_and_sensors(name, law):
    vehicle = file_of('rexrov') | {'thrusters': THRUSTERS}
    gains = {'cl': {'k_D': 2e3, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 5e3}, 'pid': PID, 'smc': SMC}
    ours, theirs = pair(law, 'zoh', vehicle, **BASE, **SAMPLED[name], gains=gains.get(law, PAPER))
    compare(ours, theirs)


@pytest.mark.parametrize('faults', [[], FAILING], ids=['sound', 'failing'])
@pytest.mark.parametrize('name', ROTORS)
def test_thrusters_as_they_are(name, faults):
    """Commands beyond the limits, some within the dead band; T200s and others side by side."""
    vehicle = file_of('bluerov2_heavy')
    for i, one in enumerate(vehicle['thrusters']):
        one['rotor'] = SQUARE if i in (1, 4) else T200
    actuators = {'thrusters': True, **ROTORS[name]}
    data = BASE | {'initial': BACKWARDS, 'actuators': actuators}
    data |= {'faults': faults} if faults else {}
    ours, theirs = pair('cl', 'zoh', vehicle, **data, gains=ROUGH)
    assert np.abs(ours.tau - ours.tau_applied).max() > 10.0
    compare(ours, theirs, 1e-9)


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
@pytest.mark.parametrize(
    ('law', 'values'),
    [('pid', PID), ('pid', PID | {'k_FF': 0.0, 'omega_f': [5, 6, 7, 8, 9, 10]}),
     ('pid', PID | {'k_FF': [1, 0, 0.5, 1, 0, 1]}), ('smc', SMC), ('smc', SWITCHED),
     ('smc', SMC | {'Lambda': FULL['Lambda']})],
)  # fmt: skip
def test_pid_and_smc(law, values, hold):
    compare(*pair(law, hold, file_of('rexrov'), **BASE, gains=values, disturbance=[HARMONIC]))


LONG = {
    'initial attitude': {'initial': TURNED},
    'six active degrees of freedom': {'setpoint': SIX},
    'gains per axis': {'gains': PER_AXIS, 'setpoint': SIX},
    'full gains': {'gains': FULL, 'setpoint': SIX, 'initial': TURNED},
    'dense added mass': {'vehicle': 'rexrov', 'setpoint': SIX, 'initial': TURNED},
    'an uncertain plant': {'vehicle': 'rexrov', 'setpoint': SIX, 'disturbance': [ERRORS, TIDE]},
    'a current where M is given': {'setpoint': SIX, 'disturbance': [CURRENT, HARMONIC]},
}


@pytest.mark.long
@pytest.mark.parametrize('name', LONG)
def test_long_runs(name):
    hold = ('continuous', 'zoh')[list(LONG).index(name) % 2]
    changes = dict(LONG[name])
    vehicle = file_of(changes.pop('vehicle', 'herman2018'))
    compare(*pair('gvc', hold, vehicle, **changes, duration=30.0))


@pytest.mark.long
@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
@pytest.mark.parametrize(('case', 'law'), [('case1', 'gvc'), ('case1', 'cl'), ('case2', 'cl')])
def test_long_runs_of_the_papers_cases(case, law, hold):
    compare(*pair(law, hold, file_of('herman2018'), base=case, duration=30.0))


@examples(4)
@given(
    vehicle=vehicles(heavy_water=False),
    errors=st.fixed_dictionaries(
        {key: st.floats(-0.2, 0.2) for key in ('mass', 'added_mass', 'damping', 'buoyancy')}
    ),
    flow=vectors(3, 0.5),
)
def test_random_uncertain_vehicles(vehicle, errors, flow):
    mass = vehicle['rigid_body']['mass']
    specs = [
        {'kind': 'model_error', **errors},
        {'kind': 'current', 'velocity': flow.tolist()},
        {'kind': 'harmonic', 'sway': wave(0.3 * mass, 0.5 * mass, 0.8)},
    ]
    changes = {'setpoint': SIX, 'disturbance': specs, 'duration': 0.05, 'step': 0.001}
    for hold in ('continuous', 'zoh'):
        compare(*pair('gvc', hold, vehicle, **changes))


def test_kinetic_energy_of_case_1_does_not_depend_on_the_attitudes_form():
    file = file_of('herman2018')
    ours, by_angles = pair('gvc', 'continuous', file, duration=2.0)
    data = load_scenario('case1').data | {'duration': 2.0}
    by_matrix = reference.simulate(file, data, 'gvc', 'continuous', attitude='matrix')
    M, mean = np.array(file['inertia_matrix']), summarize(ours)['kinetic_energy']['mean']
    for theirs in (by_angles, by_matrix):
        nu = theirs['nu']
        energy = 0.5 * np.einsum('ni,ij,nj->n', nu, M, nu).mean()
        assert mean == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize(
    ('factor', 'change'),
    [
        pytest.param(0.0, 0.02, marks=pytest.mark.long),
        pytest.param(5.0, -0.06, marks=pytest.mark.long),
        (20.0, -0.18),
    ],
)
def test_kinetic_energy_of_case_1_hardly_depends_on_the_damping(factor, change):
    """vehicle.md of the reconstruction: damping x0, x5, x20 moves it by +0.02, -0.06, -0.18 %."""
    base, file = load_scenario('case1'), file_of('herman2018')
    scaled = {key: (factor * np.array(D)).tolist() for key, D in file['damping'].items()}
    means = []
    for vehicle in (file, file | {'damping': scaled}):
        run = simulate(changed_scenario(base, {'vehicle': vehicle, 'duration': 10.0}), 'gvc')
        means.append(summarize(run)['kinetic_energy']['mean'])
    found = 100.0 * (means[1] / means[0] - 1.0)
    assert found == pytest.approx(change, abs=0.01)
    assert abs(found) < 0.2
