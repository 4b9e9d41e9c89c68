"""Scenario keys as ROS parameters and back: names, types, round trips, what is refused."""

import numpy as np
import pytest
from helpers.strategies import QUICK, SPECS, WORKED
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.disturbance import Harmonics
from auv_dynamics.plant.parameters import flattened, nested, parameters_of, part
from auv_dynamics.ros.settings import PlantSettings, as_parameters, entries, read_settings
from auv_dynamics.vehicle import DOFS

GOOD = {'amplitude': [1.0, 2.0], 'omega': [3.0, 4.0], 'phase': [0.5, 0.6]}
MATRIX = [[float(i == j) + 0.1 * (i + j) for j in range(6)] for i in range(6)]
WAVE = {'offset': 0.5, 'terms': [{'amplitude': 1.0, 'omega': 2.0, 'phase': 0.1}]}
WRITTEN = [  # key of a scenario, entry as it comes back: one of each kind
    ('disturbance', {'kind': 'herman2018', 'exponent_sign': 1.0, 'scale': MATRIX}),
    ('disturbance', {'kind': 'herman2018', 'scale': 2.0}),
    ('disturbance', {'kind': 'harmonic', 'sway': WAVE, 'yaw': {'offset': 1.0}}),
    ('disturbance', {'kind': 'model_error', 'mass': 0.1, 'buoyancy': -0.1, 'dM': [1.0] * 6}),
    ('disturbance', {'kind': 'current', 'velocity': [0.1, 0.2, 0.3], 'down': WAVE}),
    ('actuators', {'limit': 5.0, 'rate': [1.0] * 6, 'lag': 0.1, 'delay': 0.2, 'thrusters': True}),
    ('sensors', {'velocity_noise': [0.1] * 6, 'attitude_noise': 0.2, 'drop_out': 0.5}),
    ('faults', {'kind': 'sensor_drop_out', 'from': 1.0, 'to': 2.0, 'probability': 0.5}),
    ('faults', {'kind': 'sensor_delay', 'delay': 0.1}),
    ('faults', {'kind': 'sensor_bias', 'velocity': [0.1] * 6, 'attitude': [0.1, 0.2, 0.3]}),
    ('faults', {'kind': 'thruster', 'thruster': 'bow', 'stuck': 3.0}),
    ('faults', {'kind': 'actuator', 'axis': 'yaw', 'efficiency': 0.5}),
    ('faults', {'kind': 'wrench_loss', 'timeout': 0.5}),
    ('setpoint', {'file': 'path.csv'}),
]


def back(values, key='setpoint'):
    return nested(part(key), values, 'node', key)


@pytest.mark.parametrize(('key', 'spec'), WRITTEN)
def test_every_kind_leads_back_to_itself(key, spec):
    flat = flattened(part(key), spec)
    known = {one.name: one.kind for one in parameters_of(part(key), spec.get('kind'))}
    assert flat.keys() <= known.keys()
    for name, value in flat.items():
        kind = type(value) if not isinstance(value, list) else list[float]
        assert kind == known[name], name
        assert not isinstance(value, list) or {type(number) for number in value} == {float}
    assert back(flat, key) == spec


@QUICK
@given(SPECS, st.floats(0.0, 100.0))
def test_columns_lead_back_to_the_same_signal(spec, t):
    columns = flattened(part('setpoint'), spec)
    again = Harmonics.from_spec(back(columns))
    assert_array_equal(again.value(t), Harmonics.from_spec(spec).value(t))
    assert_array_equal(again.derivative(t), Harmonics.from_spec(spec).derivative(t))
    assert flattened(part('setpoint'), back(columns)) == columns


def test_columns_of_a_worked_setpoint():
    assert flattened(part('setpoint'), WORKED) == {
        'surge.offset': 0.2, 'surge.amplitude': [1.0], 'surge.omega': [np.pi / 20],
        'surge.phase': [0.0], 'heave.offset': 0.0, 'heave.amplitude': [1.5, -0.5],
        'heave.omega': [0.4, 2.0], 'heave.phase': [np.pi / 2, 0.0], 'yaw.offset': -0.1,
    }  # fmt: skip


def test_settings_come_back_from_their_parameters():
    faults = [spec for key, spec in WRITTEN if key == 'faults'][:2]
    settings = PlantSettings(
        vehicle='rexrov',
        recorder_window=7,
        initial_nu=(0.1,) * 6,
        actuators={'limit': 5.0, 'thrusters': True},
        disturbance=entries('disturbance', [{'kind': 'harmonic', 'sway': WAVE}]),
        faults=entries('faults', faults),
    )
    flat = as_parameters(settings)
    assert flat['faults.names'] == ['f1_sensor_drop_out', 'f2_sensor_delay']
    assert flat['faults.f2_sensor_delay.delay'] == 0.1
    assert 'start_after' not in flat  # an empty list has no type
    assert read_settings(PlantSettings, reader_of(flat), 'file') == settings


def test_settings_that_are_needed_are_named():
    with pytest.raises(InputError, match='node: vehicle: expected a vehicle file, found nothing'):
        read_settings(PlantSettings, reader_of({}), 'node')


def reader_of(values):
    return lambda name, kind, default, text, **accepted: values.get(name, default)


@pytest.mark.parametrize('dof', DOFS)
@pytest.mark.parametrize('key', GOOD)
@pytest.mark.parametrize('values', [[1.0], [1.0, 2.0, 3.0]])
def test_a_list_of_another_length_is_refused(dof, key, values):
    columns = {f'{dof}.{name}': entry for name, entry in (GOOD | {key: values}).items()}
    with pytest.raises(InputError, match=f'setpoint.{dof}: expected amplitude, omega, phase of eq'):
        back(columns)


@pytest.mark.parametrize('missing', [['amplitude'], ['omega'], ['amplitude', 'omega']])
def test_amplitude_and_omega_belong_together(missing):
    columns = {f'yaw.{name}': entry for name, entry in GOOD.items() if name not in missing}
    with pytest.raises(InputError, match='yaw: '):
        back(columns)


def test_phase_may_be_absent_and_terms_keep_their_order():
    columns = {f'yaw.{name}': GOOD[name] for name in ('amplitude', 'omega')} | {'yaw.offset': 9.0}
    terms = [
        {'amplitude': 1.0, 'omega': 3.0, 'phase': 0.0},
        {'amplitude': 2.0, 'omega': 4.0, 'phase': 0.0},
    ]
    assert back(columns) == {'yaw': {'offset': 9.0, 'terms': terms}}


@pytest.mark.parametrize(
    ('key', 'values', 'words'),
    [
        ('disturbance', {}, 'disturbance.kind: expected herman2018, harmonic'),
        ('disturbance', {'kind': 'tide'}, 'disturbance.kind: expected herman2018, harmonic'),
        ('disturbance', {'kind': 'model_error'}, 'at least one of mass'),
        ('actuators', {'limit': [1.0, 2.0]}, 'actuators.limit: expected a positive number or 6'),
        ('actuators', {'rate': [-1.0]}, 'actuators.rate: expected a positive number'),
        ('faults', {'kind': 'sensor_bias'}, 'faults: expected a mapping with velocity, attitude'),
        ('faults', {'kind': 'actuator', 'axis': 'yaw'}, 'faults: expected efficiency or stuck'),
        ('setpoint', {'file': 'a.csv', 'yaw.offset': 1.0}, 'file alone, found yaw beside it'),
    ],
)
def test_what_the_schema_does_not_take_is_refused(key, values, words):
    with pytest.raises(InputError, match=words):
        back(values, key)
