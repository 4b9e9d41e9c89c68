"""Rotors of thrusters: what a vehicle file says of them, and curves at another voltage."""

import copy
import re

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import InputError, load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.thruster_curves import at_voltage, load_curve
from auv_dynamics.vehicle.thrusters import Rotor
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

HEAVY = yaml.safe_load(shipped('vehicles', 'bluerov2_heavy').read_text(encoding='utf-8'))
KGF = 9.80665
TABLE = {'command': [-1.0, -0.1, 0.2, 1.0], 'thrust_n': [-60.0, 0.0, 0.0, 80.0]}


def changed(rotor=None, **entries):
    """The heavy BlueROV2 with another rotor, or entries, of its second thruster."""
    data = copy.deepcopy(HEAVY)
    for one in data['thrusters']:
        one.pop('rotor')
    data['thrusters'][1] |= entries if rotor is None else {'rotor': rotor}
    return data


def rotors_of(data):
    return vehicle_from_dict(data, 'odd.yaml').thrusters.rotors


def test_without_a_rotor_every_thrust_is_delivered_at_once():
    assert rotors_of(changed()) == ()
    ideal = Rotor()
    assert (ideal.curve, ideal.dead_band, ideal.lag, ideal.omega) == (None, (0.0, 0.0), 0.0, 0.0)


def test_what_a_file_says_of_one_rotor_is_of_that_thruster_alone():
    spec = {'voltage': 14.8, 'dead_band': 0.5, 'omega': 20.0, 'zeta': 0.7}
    rotors = rotors_of(changed(spec))
    assert rotors[1] == Rotor(None, 14.8, (0.5, 0.5), 0.0, 20.0, 0.7)
    assert {rotors[i] == Rotor() for i in (0, 2, 3, 4, 5, 6, 7)} == {True}


@pytest.mark.parametrize('name', ['bluerov2', 'bluerov2_heavy'])
def test_the_bluerov2_has_the_t200_at_16_volts(name):
    thrusters = load_vehicle(name).thrusters
    for rotor in thrusters.rotors:
        assert (rotor.curve.name, rotor.voltage, rotor.lag) == ('t200_16v', 16.0, 0.029)
        turning = np.abs(rotor.curve.thrusts[rotor.curve.thrusts != 0.0])
        assert 0.9 * turning.min() < min(rotor.dead_band) < max(rotor.dead_band) < 0.5


def test_a_table_in_kilogram_force_is_one_in_newton():
    table = {'command': [-1.0, 0.0, 1.0], 'thrust_kgf': [-6.0, 0.0, 8.0]}
    curve = rotors_of(changed({'curve': table, 'voltage': 24.0}))[1].curve
    assert_allclose(curve.thrusts, KGF * np.array([-6.0, 0.0, 8.0]))


def test_a_table_in_the_file_is_a_curve():
    curve = rotors_of(changed({'curve': TABLE, 'voltage': 24.0}))[1].curve
    assert_array_equal(curve.thrust([-1, -0.55, 0, 0.6, 1]), [-60, -30, 0, 40, 80])
    assert curve.dead_band == (-0.1, 0.2)
    assert curve.voltage is None


REFUSED = {
    'no such curve': ({'curve': 't200_15v'}, 'rotor.curve', 'a table, or ', 't200_15v'),
    'its own voltage': (
        {'curve': 't200_16v', 'voltage': 15}, 'rotor.voltage', 'that of t200_16v, 16 V', '15 V'),
    'a weak curve': (
        {'curve': 't200_10v'}, 'limit', 'at most what the curve of its rotor gives, 22.65 N',
        '40.2 N'),
    'a curve that is weak ahead': (
        {'curve': TABLE | {'thrust_n': [-60.0, 0.0, 0.0, 40.0]}}, 'limit',
        'at most what the curve of its rotor gives, 40 N', '51.5 N'),
    'a wide dead band astern': (
        {'dead_band': [40.2, 1]}, 'rotor.dead_band', 'less than the limits, 40.2 and 51.5 N',
        '[40.2, 1]'),
    'a wide dead band': (
        {'dead_band': [1, 51.5]}, 'rotor.dead_band', 'less than the limits, 40.2 and 51.5 N',
        '[1, 51.5]'),
    'two lags': ({'lag': 0.1, 'omega': 9.0}, 'rotor.omega', 'one of lag and omega', 'both'),
    'a thrust of no lag': ({'lag_at': 9.0}, 'rotor.lag_at', 'a positive lag beside', 'nothing'),
    'damping of nothing': ({'zeta': 0.7}, 'rotor.zeta', 'omega beside it', 'nothing'),
    'one column': ({'curve': {'percent': [0, 1]}}, 'rotor.curve', 'one column thrust_n', 'percent'),
    'unequal columns': (
        {'curve': TABLE | {'thrust_n': [-1, 1]}}, 'rotor.curve',
        'command and thrust_n of equal length', '4 and 2'),
    'a falling table': (
        {'curve': TABLE | {'thrust_n': [-60, 0, -20, 80]}}, 'rotor.curve',
        'thrust that rises with the command', 'a fall of 20'),
    'negative lag': ({'lag': -0.1}, 'rotor.lag', 'a number from 0 up (s)', '-0.1'),
    'unknown': ({'gain': 1}, 'rotor.gain', 'one of curve, voltage, dead_band', 'an unknown key'),
}  # fmt: skip


@pytest.mark.parametrize('case', REFUSED)
def test_one_line_names_what_cannot_be(case):
    rotor, key, expected, found = REFUSED[case]
    text = re.escape(f'odd.yaml: thrusters[1].{key}: expected {expected}')
    with pytest.raises(InputError, match=f'^{text}.*{re.escape(found)}'):
        vehicle_from_dict(changed(rotor), 'odd.yaml')


def test_between_tabulated_voltages_thrust_is_linear_at_each_command():
    nominal, low, high = (load_curve(f't200_{v}v') for v in (16, 14, 16))
    found = at_voltage(nominal, 16.0, 14.5)
    assert_array_equal(found.commands, nominal.commands)
    assert found.voltage is None
    assert_allclose(found.thrusts, 0.75 * low.thrusts + 0.25 * high.thrusts, atol=1e-12)
    assert_allclose(at_voltage(nominal, 16.0, 12.0).thrusts, load_curve('t200_12v').thrusts)


def test_beyond_the_tables_thrust_goes_by_the_square_of_the_voltage():
    nominal = load_curve('t200_16v')
    for voltage, end, share in ((8.0, 't200_10v', 0.64), (25.0, 't200_20v', 1.5625)):
        found = at_voltage(nominal, 16.0, voltage).thrusts
        assert_allclose(found, load_curve(end).thrusts * share, rtol=1e-12)
    alone = rotors_of(changed({'curve': TABLE, 'voltage': 24.0}))[1].curve
    assert_allclose(at_voltage(alone, 24.0, 12.0).thrusts, [-15.0, 0.0, 0.0, 20.0])


def test_a_lower_voltage_is_less_thrust_and_a_wider_dead_band():
    nominal = load_curve('t200_16v')
    sagged = at_voltage(nominal, 16.0, 13.0)
    assert np.all(np.abs(sagged.thrusts) <= np.abs(nominal.thrusts))
    assert sagged.dead_band[0] < nominal.dead_band[0] < nominal.dead_band[1] < sagged.dead_band[1]
