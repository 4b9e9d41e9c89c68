"""Rollouts in lanes give what single runs give, whatever runs beside them."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.closed_loops import SIX, TURNED, wave
from helpers.needs import needing
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import auv_analysis.simulation.rollouts as module
from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.simulation import batch
from auv_analysis.simulation.reduction import COLUMNS
from auv_analysis.simulation.rollouts import rollouts
from auv_analysis.simulation.simulate import DivergedError
from auv_analysis.simulation.variants import in_columns, packed_variants, within
from auv_dynamics.files.errors import InputError
from auv_dynamics.kernel.compile import JITTED
from auv_dynamics.vehicle import DOFS

LAWS = {
    'gvc': {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0},
    'cl': {'k_D': 400.0, 'k_I': 20.0, 'Lambda': 0.5, 'Gamma': 200.0},
    'pid': {'k_P': 400.0, 'k_I': 50.0, 'k_D': 5.0},
    'smc': {'k_D': 300.0, 'Lambda': 0.5, 'Gamma': 50.0, 'k_S': 20.0},
}
ROUGH = [
    {'kind': 'harmonic', 'sway': {'offset': 25.0, 'terms': [{'amplitude': 40.0, 'omega': 0.8}]}},
    {'kind': 'model_error', 'mass': 0.05, 'added_mass': -0.2, 'damping': 0.3},
    {
        'kind': 'current',
        'velocity': [0.3, 0.1, 0.0],
        'down': {'terms': [{'amplitude': 0.1, 'omega': 1.0}]},
    },
]
LIMITS = {'limit': [60, 60, 80, 20, 20, 20], 'rate': 400.0, 'lag': 0.05, 'delay': 0.02}
NOISY = {'velocity_noise': 0.02, 'attitude_noise': 0.01, 'drop_out': 0.1}


def scenario_of(law, vehicle='rexrov', duration=0.6, **changes):
    values = {
        'vehicle': vehicle,
        'duration': duration,
        'controllers': {law: {'law': law, **LAWS[law]}},
        'setpoint': SIX,
        'initial': TURNED,
        **changes,
    }
    return changed_scenario(load_scenario('case1'), values)


def flat(summary):
    """Figures of a summary by the names of the columns."""
    found = {}
    for name in COLUMNS:
        group, key, *dof = name.split('.')[:3] if '.' in name else (name, None)
        if key is None:
            continue
        value = summary[group][key]
        value = value[DOFS.index(dof[0])] if dof and value is not None else value
        found[name] = np.nan if value is None else value
    return found


def same_as_alone(scenario, controller, changes, hold, columns, rows, seeds=None):
    """Compare some rollouts with single runs of their scenarios."""
    for i in rows:
        values = {path: column[i] for path, column in changes.items()}
        if seeds is not None:
            values['seed'] = int(seeds[i])
        expected = flat(summarize(simulate(changed_scenario(scenario, values), controller, hold)))
        for name, value in expected.items():
            np.testing.assert_allclose(
                columns[name][i], value, rtol=1e-9, atol=1e-11, err_msg=f'{name} of {i}'
            )


# what numba must compile first is compared once; all laws without it, see the last test
SMC_ZOH = pytest.param('smc', 'zoh', marks=pytest.mark.long)
COMPILED = [('gvc', 'continuous'), ('gvc', 'zoh'), SMC_ZOH]
EVERY = [(law, hold) for law in LAWS for hold in ('continuous', 'zoh')]


@pytest.mark.parametrize(('law', 'hold'), COMPILED if JITTED else EVERY)
def test_columns_give_what_single_runs_give(law, hold):
    count = 11
    generator = np.random.default_rng(3)
    gain = next(iter(LAWS[law]))
    scenario = scenario_of(law, disturbance=[ROUGH[0], {'kind': 'model_error', 'mass': 0.1}])
    changes = {
        f'controllers.{law}.{gain}': LAWS[law][gain] * generator.uniform(0.5, 1.5, count),
        'vehicle.rigid_body.mass': 1862.87 * generator.uniform(0.8, 1.2, count),
        'vehicle.rigid_body.center_of_gravity[2]': generator.uniform(-0.02, 0.02, count),
        'vehicle.damping.linear': generator.uniform(50, 100, (count, 6)),
        'disturbance[1].damping': generator.uniform(-0.5, 0.5, count),
        'disturbance[1].mass': generator.uniform(-0.1, 0.1, count),
        'initial.nu[1]': generator.normal(size=count) * 0.3,
        'initial.eta': generator.normal(size=(count, 6)),
    }
    columns = rollouts(scenario, law, changes, hold=hold)
    assert set(columns['status']) == {'ok'}
    same_as_alone(scenario, law, changes, hold, columns, (0, 6, 10))


def test_columns_of_lift_give_what_single_runs_give():
    changes = {
        'vehicle.lift[1][1]': np.array([0.0, 20.6, 300.0]),
        'vehicle.lift[5][1]': np.array([-6.0, 6.0, -40.0]),
        'disturbance[0].damping': np.array([0.0, 0.5, -0.5]),
    }
    scenario = scenario_of('gvc', 'lauv', disturbance=[{'kind': 'model_error', 'damping': 0.1}])
    columns = rollouts(scenario, 'gvc', changes)
    assert set(columns['status']) == {'ok'}
    assert len(set(columns['effort.rms.sway'])) == 3
    same_as_alone(scenario, 'gvc', changes, 'continuous', columns, range(3))
    mixed = {'vehicle': ['lauv', 'rexrov', 'lauv']}  # with and without
    columns = rollouts(scenario, 'gvc', mixed)
    same_as_alone(scenario, 'gvc', mixed, 'continuous', columns, range(2))


SMC = pytest.param('smc', marks=pytest.mark.long)


@pytest.mark.parametrize('law', ['gvc', SMC] if JITTED else LAWS)
def test_actuators_sensors_and_a_current_act_on_each_rollout(law):
    thrusters = {'thrusters': True, **LIMITS}
    scenario = scenario_of(
        law, 'bluerov2_heavy', disturbance=ROUGH, actuators=thrusters, sensors=NOISY
    )
    count = 10
    gain = next(iter(LAWS[law]))
    changes = {f'controllers.{law}.{gain}': np.geomspace(1.0, 300.0, count)}
    seeds = np.arange(100, 100 + count)
    columns = rollouts(scenario, law, changes, seeds=seeds, hold='zoh')
    same_as_alone(scenario, law, changes, 'zoh', columns, (0, 4, 9), seeds)
    others = rollouts(scenario, law, changes, seeds=seeds + 1, hold='zoh')
    assert (others['effort.rms.yaw'] != columns['effort.rms.yaw']).all()


def test_rollouts_over_lag_dead_band_and_voltage():
    acting = {'thrusters': True, 'saturation': 'priority', 'rotors': True, 'voltage': 16.0}
    scenario = scenario_of('gvc', 'bluerov2_heavy', actuators=acting)
    changes = {
        'actuators.rotor_lag': np.linspace(0.02, 0.3, 9),
        'actuators.dead_band': np.linspace(0.0, 6.0, 9),
        'actuators.voltage': np.linspace(17.0, 11.5, 9),
    }
    columns = rollouts(scenario, 'gvc', changes, hold='zoh')
    assert set(columns['status']) == {'ok'}
    assert len(set(columns['velocity_error.rms.surge'])) == 9
    same_as_alone(scenario, 'gvc', changes, 'zoh', columns, (0, 4, 8))


def test_rollouts_with_tables_of_their_own_are_more_than_a_table_holds():
    scenario = scenario_of('gvc', duration=3.0, sensors=NOISY)
    changes = {'setpoint.surge.offset': np.linspace(-0.4, 0.4, 21)}
    seeds = np.arange(21)
    columns = rollouts(scenario, 'gvc', changes, seeds=seeds, hold='zoh')
    same_as_alone(scenario, 'gvc', changes, 'zoh', columns, (0, 17, 20), seeds)


PUSHED = {'disturbance': [{'kind': 'model_error', 'dD': 1.0}]}
LIMITED, PRINTED = {'limit': 60.0, 'delay': 0.0}, {'kind': 'herman2018', 'scale': 2.0}


@pytest.mark.parametrize(
    ('path', 'values', 'hold', 'base'),
    [
        ('disturbance[0].sway.offset', [0.0, 25.0, 80.0], 'continuous', {'disturbance': ROUGH[:1]}),
        ('disturbance[0].dD', [1.0, 300.0], 'continuous', PUSHED),
        ('disturbance[0].scale', [1.0, 3.0], 'continuous', {'disturbance': [PRINTED]}),
        (
            'disturbance[2].velocity',
            [[0.3, 0.1, 0.0], [-0.1, 0.2, 0.4]],
            'continuous',
            {'disturbance': ROUGH},
        ),
        ('actuators.delay', [0.0, 0.02, 0.05], 'zoh', {'actuators': LIMITED}),
        ('controllers.gvc.anti_windup', [False, True], 'zoh', {'actuators': LIMITED}),
    ],
)
def test_rollouts_over_what_is_no_column_of_numbers(path, values, hold, base):
    scenario = scenario_of('gvc', **base)
    columns = rollouts(scenario, 'gvc', {path: values}, hold=hold)
    assert len(set(columns['effort.rms.sway'])) == len(values)
    same_as_alone(scenario, 'gvc', {path: values}, hold, columns, range(len(values)))


def test_each_rollout_has_the_settling_band_of_its_own_set_point():
    moderate = {'surge': wave(0.2, 0.0, 1.0)}
    scenario = scenario_of('gvc', 'herman2018', duration=4.0, setpoint=moderate, initial={})
    changes = {'setpoint.surge.offset': [0.1, 3.0]}
    columns = rollouts(scenario, 'gvc', changes)
    same_as_alone(scenario, 'gvc', changes, 'continuous', columns, range(2))
    times = columns['velocity_error.settling_time.surge']
    assert np.isfinite(times).all()
    assert times[0] != times[1]
    apart = {'setpoint.surge': [moderate['surge'] | {'offset': x} for x in (0.1, 3.0, 0.1)]}
    equal(rollouts(scenario, 'gvc', apart), {name: c[[0, 1, 0]] for name, c in columns.items()})


def test_the_peak_of_a_set_point_is_that_of_all_samples(monkeypatch):
    monkeypatch.setattr(module, 'BLOCK', 10)
    growing = {'surge': wave(0.0, -1.0, 0.5), 'yaw': wave(0.3, 0.1, 20.0)}
    scenario = scenario_of('gvc', duration=0.2, setpoint=growing)
    nu_d = scenario.setpoint.value(np.arange(21) * 0.01)
    expected = np.abs(nu_d).max(axis=0)
    assert expected[0] == -nu_d[-1, 0]
    assert_array_equal(module._peak(scenario.setpoint, scenario), expected)


def equal(one, other):
    for name, column in one.items():
        assert_array_equal(column, other[name], err_msg=name)


@pytest.mark.parametrize(
    'drawn',
    [{'sensors': NOISY}, {'faults': [{'kind': 'wrench_loss', 'probability': 0.5}]}],
)
def test_what_is_drawn_is_that_of_the_seed_wherever_it_stands(drawn):
    errors = [{'kind': 'model_error', 'damping': -0.6}, ROUGH[1]]
    scenario = scenario_of('gvc', duration=0.1, disturbance=errors, seed=3, **drawn)
    changes = {'disturbance[1].damping': np.array([-0.4, 0.1])}  # without any, by a file alone
    for seeds in (None, np.array([0, 6])):
        columns = rollouts(scenario, 'gvc', changes, seeds=seeds, hold='zoh')
        same_as_alone(scenario, 'gvc', changes, 'zoh', columns, range(2), seeds)
    columns = rollouts(scenario, 'gvc', {'seed': [5.0, 6.0]}, hold='zoh')  # whole, like 6e0
    same_as_alone(scenario, 'gvc', {'seed': [5, 6]}, 'zoh', columns, range(2))
    columns = rollouts(scenario, 'gvc', {}, seeds=np.array([5, 6]), hold='zoh')
    same_as_alone(scenario, 'gvc', {'seed': [5, 6]}, 'zoh', columns, range(2))


GVC = scenario_of('gvc', 'herman2018', duration=0.3)
MANY = {
    'controllers.gvc.k_D': np.linspace(2.0, 20.0, 37),
    'vehicle.inertia_matrix[0][0]': np.linspace(100.0, 200.0, 37),
    'initial.nu[0]': np.linspace(-0.5, 0.5, 37),
}
ALL = rollouts(GVC, 'gvc', MANY)


@needing('numba', JITTED)
@examples(8)
@given(st.lists(st.integers(0, 36), min_size=1, max_size=40), st.integers(1, 3))
def test_no_rollout_depends_on_those_beside_it(rows, threads):
    """Bit for bit, whatever their number, order and lane, and the number of threads."""
    chosen = {path: column[rows] for path, column in MANY.items()}
    found = rollouts(GVC, 'gvc', chosen, threads=threads)
    equal(found, {name: column[rows] for name, column in ALL.items()})


def test_a_long_run_makes_its_tables_anew_for_each_part(monkeypatch):
    monkeypatch.setattr(batch, 'LISTED', 0)
    monkeypatch.setattr(batch, 'SHARED_STEPS', 10)
    equal(rollouts(GVC, 'gvc', MANY, threads=2), ALL)


def test_columns_and_scenarios_of_their_own_give_the_same_bits(monkeypatch):
    scenario = scenario_of('gvc', duration=0.1, disturbance=ROUGH)
    generator = np.random.default_rng(5)
    count = 9
    changes = {
        'controllers.gvc.Gamma': generator.uniform(10, 50, (count, 6)),
        'controllers.gvc.k_D': generator.uniform(5, 15, count),
        'vehicle.rigid_body.inertia[0][0]': generator.uniform(500, 600, count),
        'vehicle.rigid_body.center_of_gravity': generator.uniform(-0.1, 0.1, (count, 3)),
        'vehicle.hydrostatics.volume': generator.uniform(1.7, 1.9, count),
        'vehicle.environment.gravity': generator.uniform(9.7, 9.9, count),
        'disturbance[1].added_mass': generator.uniform(-0.3, 0.3, count),
        'disturbance[1].mass': generator.uniform(-0.3, 0.3, count),
        'initial.eta[4]': generator.uniform(-1.5, 1.5, count),
        'setpoint.surge.offset': generator.uniform(-0.5, 0.5, count),
        'setpoint.yaw.terms[0].omega': generator.uniform(0.1, 3.0, count),
        'setpoint.sway.terms[0].amplitude': generator.uniform(-0.5, 0.5, count),
        'setpoint.heave.terms[0].phase': generator.uniform(-3.0, 3.0, count),
    }
    in_columns = rollouts(scenario, 'gvc', changes)
    monkeypatch.setattr(module, 'in_columns', lambda *_: False)
    equal(rollouts(scenario, 'gvc', changes), in_columns)


def test_values_that_are_no_numbers():
    names = ['herman2018', 'rexrov', 'girona500', 'rexrov']
    changes = {'vehicle': names, 'initial.nu[0]': [0.1, 0.2, 0.3, 0.4]}
    columns = rollouts(scenario_of('gvc', duration=0.2), 'gvc', changes)
    assert set(columns['status']) == {'ok'}
    same_as_alone(scenario_of('gvc', duration=0.2), 'gvc', changes, 'continuous', columns, range(4))


def test_set_points_durations_and_steps_of_their_own():
    changes = {
        'setpoint.surge.offset': [0.1, 0.2, 0.2, 0.5, 0.3],
        'duration': [0.1, 0.2, 0.1, 0.1, 0.2],
        'step': [0.01, 0.01, 0.01, 0.01, 0.02],
        'integrator': ['rk4', 'ode5', 'rk4', 'euler', 'rk4'],
    }
    columns = rollouts(GVC, 'gvc', changes)
    same_as_alone(GVC, 'gvc', changes, 'continuous', columns, range(5))


TERMS = SIX['sway']['terms']
LOST = {'kind': 'wrench_loss', 'from': 0.05}
SLOW, FREE = {'lag': 0.05}, {'law': 'gvc', **LAWS['gvc'], 'anti_windup': False}


@pytest.mark.parametrize(
    ('changes', 'hold', 'base'),
    [
        ({'duration': [0.1, 0.2]}, 'continuous', {}),
        ({'controllers.gvc.law': ['gvc', 'cl']}, 'continuous', {}),
        ({'disturbance': [[], ROUGH[1:2]]}, 'continuous', {}),
        ({'disturbance': [ROUGH[1:2], ROUGH[1:]]}, 'continuous', {}),
        (
            {'setpoint.sway.terms': [TERMS, TERMS * 2], 'setpoint.surge.offset': [0.1, 0.4]},
            'continuous',
            {},
        ),
        ({'actuators': [SLOW, SLOW | {'limit': 60.0}]}, 'zoh', {'controllers': {'gvc': FREE}}),
        ({'faults': [[], [LOST]]}, 'zoh', {}),
        ({'faults': [[], [LOST | {'kind': 'sensor_drop_out'}]]}, 'zoh', {}),
        ({'faults': [[LOST], [LOST | {'kind': 'sensor_drop_out'}]]}, 'zoh', {}),
        (
            {'vehicle': ['bluerov2', 'bluerov2_heavy']},
            'zoh',
            {'vehicle': 'bluerov2', 'actuators': {'thrusters': True}},
        ),
    ],
)
def test_rollouts_of_other_structures_run_apart(changes, hold, base):
    scenario = scenario_of('gvc', duration=0.2, **base)
    columns = rollouts(scenario, 'gvc', changes, hold=hold)
    same_as_alone(scenario, 'gvc', changes, hold, columns, range(2))
    assert columns['effort.rms.sway'][0] != columns['effort.rms.sway'][1]


def test_rollouts_that_run_keep_what_is_theirs_beside_one_that_is_refused():
    scenario = scenario_of('gvc', duration=0.1, sensors=NOISY)
    changes = {
        'setpoint.surge.offset': np.array([0.1, 0.2, 0.3, 0.4]),
        'vehicle.rigid_body.mass': np.array([-1.0, 1800.0, 1850.0, 1900.0]),
        'disturbance': [ROUGH[:1], ROUGH[:1], [], []],
    }
    seeds = np.array([5, 6, 7, 8])
    columns = rollouts(scenario, 'gvc', changes, seeds=seeds, hold='zoh')
    assert columns['status'].tolist() == ['refused', 'ok', 'ok', 'ok']
    same_as_alone(scenario, 'gvc', changes, 'zoh', columns, (1, 2, 3), seeds)


def test_what_makes_no_scenario_is_refused_and_the_rest_runs():
    scenario = scenario_of('gvc', duration=0.1, disturbance=ROUGH[1:2])
    mass = [1800.0, -1.0, 1900.0, np.nan, 1e200, 1850.0]
    changes = {
        'vehicle.rigid_body.mass': mass,
        'vehicle.rigid_body.inertia[0][0]': [500.0, 500.0, 1.0e5, 500.0, 500.0, 500.0],
        'disturbance[0].mass': [0.1, 0.1, 0.1, 0.1, 0.1, -1.5],
    }
    columns = rollouts(scenario, 'gvc', changes)
    assert columns['status'].tolist() == ['ok', *['refused'] * 5]
    assert columns['reason'][0] == ''
    keys = ['mass', 'inertia', 'mass', 'mass', 'disturbance[0]']
    for i, key in enumerate(keys, start=1):
        assert key in columns['reason'][i]
        assert ', found ' in columns['reason'][i]
        with pytest.raises(InputError) as refused:
            changed_scenario(scenario, {path: column[i] for path, column in changes.items()})
        assert columns['reason'][i] in str(refused.value)
        assert np.isnan(columns['effort.rms.surge'][i])
    same_as_alone(scenario, 'gvc', changes, 'continuous', columns, [0])


LATE = {'actuators': {'limit': 60.0}, 'sensors': NOISY}
M_RB = load_scenario('case1_rexrov').vehicle.M_RB
WEIGHTLESS = {'kind': 'model_error', 'dM': (-M_RB).tolist()}  # but for its added mass
LEFT = {'disturbance': [{'kind': 'model_error', 'damping': -0.6, 'mass': -0.5}, ROUGH[1]]}


@pytest.mark.parametrize(
    ('changes', 'base', 'key'),
    [
        ({'vehicle': [1.0]}, {}, 'vehicle'),
        ({'controllers': [1.0]}, {}, 'controllers'),
        ({'seed': [-1]}, LATE, 'seed'),
        ({'seed': [1.5]}, LATE, 'seed'),
        ({'seed': np.array([1 << 63], np.uint64)}, LATE, 'seed'),
        ({'controllers.gvc.k_D': [[1.0, 2.0]]}, {}, 'k_D'),
        ({'controllers.gvc.k_D': [[1, 1, 1, 1, 1, 1e150]]}, {}, 'k_D'),
        ({'controllers.gvc.anti_windup': [1]}, {'controllers': {'gvc': FREE}}, 'anti_windup'),
        ({'vehicle.environment.gravity': [0.0]}, {}, 'gravity'),
        ({'setpoint.surge.offset': [[0.1, 0.2]]}, {}, 'setpoint.surge.offset'),
        (
            {'setpoint.surge': [{'terms': []}], 'setpoint.surge.terms[0].phase': [0.1]},
            {},
            'setpoint.surge.terms[0]',
        ),
        ({'disturbance[0].mass': [0.1]}, {'vehicle': 'herman2018', **PUSHED}, 'mass'),
        ({'disturbance[0].mass': [[0.1] * 6]}, PUSHED, 'mass'),
        ({'disturbance[1].damping': [-0.5]}, LEFT, 'damping'),
        ({'disturbance[1].mass': [-0.5]}, LEFT, 'mass'),
        ({'disturbance[0].added_mass': [-1.0]}, {'disturbance': [WEIGHTLESS]}, 'disturbance[0]'),
        ({'disturbance[0].mass': [-0.5]}, {'disturbance': [WEIGHTLESS]}, 'disturbance[0]'),
        (
            {'vehicle.thrusters[0].direction': [[0.0, 0.0, 0.0]]},
            {'vehicle': 'bluerov2'},
            'thrusters[0].direction',
        ),
    ],
)
def test_a_value_that_a_file_may_not_have_is_refused(changes, base, key):
    scenario = scenario_of('gvc', duration=0.1, **base)
    columns = rollouts(scenario, 'gvc', changes, hold='zoh')
    assert columns['status'].tolist() == ['refused']
    assert key in columns['reason'][0]
    with pytest.raises(InputError, match='found') as refused:
        changed_scenario(scenario, {path: values[0] for path, values in changes.items()})
    assert columns['reason'][0] in str(refused.value)


def test_a_row_without_the_controller_that_is_asked_for_is_refused():
    scenario = scenario_of('gvc', duration=0.1)
    others = [{'cl': {'law': 'cl', **LAWS['cl']}}, scenario.data['controllers']]
    columns = rollouts(scenario, 'gvc', {'controllers': others})
    assert columns['status'].tolist() == ['refused', 'ok']
    assert 'gvc' in columns['reason'][0]


def test_gains_that_a_law_refuses_are_known_row_by_row():
    pid = {'law': 'pid', **LAWS['pid'], 'omega_f': 20.0}
    scenario = scenario_of('pid', controllers={'pid': pid, 'other': pid})
    cut_off, rows = np.array([20.0, -1.0, 30.0]), np.arange(3)
    columns = {'controllers.pid.omega_f': cut_off}
    _, good = packed_variants(scenario, 'pid', columns, rows, rows)
    assert good.tolist() == [True, False, True]
    assert not in_columns(scenario, 'pid', 'controllers.other.omega_f', cut_off)


def test_numbers_within_what_is_replaced_are_refused_where_there_is_no_place_for_them(tmp_path):
    table = tmp_path / 'way.csv'
    table.write_text('t,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n9,1,0,0,0,0,0\n')
    scenario = scenario_of('gvc', duration=0.1, disturbance=ROUGH[1:2])
    others = [ROUGH[1:2], [], ROUGH[:1], ROUGH[1:2]]
    changes = {
        'disturbance': others,
        'disturbance[0].mass': [0.1, 0.1, 0.1, 0.2],
        'setpoint': [SIX, SIX, SIX, {'file': str(table)}],
        'setpoint.surge.offset': [0.1, 0.1, 0.1, 0.1],
    }
    columns = rollouts(scenario, 'gvc', changes)
    assert columns['status'].tolist() == ['ok', *['refused'] * 3]
    same_as_alone(scenario, 'gvc', changes, 'continuous', columns, [0])
    (reason,) = rollouts(scenario, 'gvc', {'setpoint': [1.0]})['reason']
    assert reason == 'setpoint: expected a mapping of degrees of freedom, or file: CSV, found 1.0'


def test_what_lies_within_the_bounds_of_the_schema():
    sensed = scenario_of('gvc', sensors=NOISY)
    shares = np.array([-0.5, 0.0, 0.5, 1.0, 1.5])
    assert within(sensed, 'sensors.drop_out', shares).tolist() == [False, True, True, True, False]
    assert within(sensed, 'sensors.velocity_noise', shares).tolist() == [False, *[True] * 4]
    assert not within(sensed, 'seed', shares).any(), 'a whole number is more than bounds'


def test_all_refused():
    columns = rollouts(GVC, 'gvc', {'vehicle.inertia_matrix[0][0]': [-1.0, 0.0, -5.0]})
    assert set(columns['status']) == {'refused'}


def test_a_rollout_that_diverges_says_when_and_leaves_the_others_alone():
    scenario = scenario_of('gvc', 'herman2018', duration=0.5)
    gains = np.array([12.0, 1e3, 1e7, 12.0])
    columns = rollouts(scenario, 'gvc', {'controllers.gvc.k_D': gains})
    assert columns['status'].tolist() == ['ok', 'diverged', 'diverged', 'ok']
    for i in (1, 2):
        with pytest.raises(DivergedError) as diverged:
            simulate(changed_scenario(scenario, {'controllers.gvc.k_D': gains[i]}), 'gvc')
        assert f'{columns["reason"][i]}' in str(diverged.value)
        assert columns['reason'][i] == f'not finite from t = {columns["diverged_at"][i]:g} s'
        assert [name for name in COLUMNS if not np.isnan(columns[name][i])] == ['diverged_at']
    assert columns['diverged_at'][1] > columns['diverged_at'][2]
    assert columns['kinetic_energy.mean'][0] == columns['kinetic_energy.mean'][3]


@pytest.mark.parametrize(
    ('changes', 'options', 'match'),
    [
        ({'controllers.gvc.k_d': [1.0]}, {}, 'k_D'),
        ({'nothing': [1.0]}, {}, 'expected one of'),
        ({'setpoint.surge.terms[9].amplitude': [1.0]}, {}, 'expected an index below 1'),
        ({'setpoint.surge.terms[0].height': [1.0]}, {}, 'one of amplitude'),
    ],
)
def test_a_path_that_leads_nowhere_is_refused_at_once(changes, options, match):
    with pytest.raises(InputError, match=match):
        rollouts(GVC, 'gvc', changes, **options)


def test_other_wrong_arguments():
    with pytest.raises(InputError, match='one of gvc'):
        rollouts(GVC, 'lqr', {})
    with pytest.raises(ValueError, match='as many values'):
        rollouts(GVC, 'gvc', {'duration': [0.1], 'initial.nu[0]': [0.1, 0.2]})
    for values, found in ((0.1, '0.1'), ('rexrov', "'rexrov'"), (np.array(1.0), 'array')):
        with pytest.raises(ValueError, match=rf'vehicle: expected a value for each.*{found}'):
            rollouts(GVC, 'gvc', {'vehicle': values})
    with pytest.raises(ValueError, match="hold: expected continuous or zoh, found 'foh'"):
        rollouts(GVC, 'gvc', {}, hold='foh')
    sensed = scenario_of('gvc', sensors=NOISY)
    with pytest.raises(InputError, match='zoh'):
        rollouts(sensed, 'gvc', {})
    with pytest.raises(InputError, match='actuators: expected hold'):
        rollouts(scenario_of('gvc', sensors=NOISY, actuators=LIMITED), 'gvc', {})


@pytest.mark.parametrize(('step', 'samples'), [(0.01, 200), (0.01, 201), (0.1, 21)])
def test_the_first_late_sample_is_that_of_the_transient(step, samples):
    short = changed_scenario(GVC, {'step': step, 'duration': (samples - 1) * step})
    columns = rollouts(short, 'gvc', {})
    same_as_alone(short, 'gvc', {}, 'continuous', columns, [0])
    assert np.isnan(columns['velocity_error.max_after_2s.surge'][0]) == (samples == 200)


def test_no_changes_give_the_run_of_the_scenario():
    columns = rollouts(GVC, 'gvc', {})
    same_as_alone(GVC, 'gvc', {}, 'continuous', columns, [0])
    assert len(columns['status']) == 1


@pytest.mark.long
@needing('numba', JITTED)
def test_the_same_source_runs_without_numba_for_every_law():
    command = [sys.executable, '-m', 'pytest', '-q', '-x', '-p', 'no:cacheprovider', __file__]
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': '1'}
    root = Path(__file__).parents[3]
    done = subprocess.run(
        command, check=False, env=environment, cwd=root, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:]
