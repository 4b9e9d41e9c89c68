"""Thrusters as they are: each part of what happens to a thrust, against its formula."""

import copy
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.strategies import QUICK, vectors
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from auv_dynamics import InputError, load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.kernel.compile import plain
from auv_dynamics.plant.actuators import fill_applied, make_actuators, memory
from auv_dynamics.vehicle.thruster_curves import load_curve
from auv_dynamics.vehicle.thrusters import make_reach, reachable
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

STEP = 0.01
HEAVY = load_vehicle('bluerov2_heavy')
T, INVERSE = HEAVY.thrusters.matrix, HEAVY.thrusters.inverse
DATA = yaml.safe_load(shipped('vehicles', 'bluerov2_heavy').read_text(encoding='utf-8'))
TAU = np.array([12.0, -7.0, 15.0, 1.5, -1.0, 2.0])


def vehicle_with(rotor):
    """The heavy BlueROV2 with this rotor at every thruster."""
    data = copy.deepcopy(DATA)
    for one in data['thrusters']:
        one['rotor'] = rotor
    return vehicle_from_dict(data, 'v')


def without_rotors():
    """The same with none."""
    data = copy.deepcopy(DATA)
    for one in data['thrusters']:
        del one['rotor']
    return vehicle_from_dict(data, 'v')


def chain(spec, commands, vehicle=HEAVY, step=STEP):
    """Applied wrenches of a series of commands."""
    actuators = make_actuators({'thrusters': True, **spec}, vehicle, step, 'f')
    state = memory(actuators)
    fill = plain(fill_applied)
    return np.array([fill(actuators, k, tuple(c), state) for k, c in enumerate(commands)])


def steady(spec, tau, vehicle=HEAVY):
    return chain(spec, [tau], vehicle)[0]


def test_a_rotor_in_the_vehicle_file_acts_only_where_a_scenario_asks_for_it():
    expected = chain({}, [TAU] * 5, without_rotors())
    assert_array_equal(chain({}, [TAU] * 5), expected)
    assert np.abs(chain({'rotors': True}, [TAU] * 5) - expected).max() > 1.0


@pytest.mark.parametrize('rotor', [{'omega': 14.0, 'zeta': 0.3}, {'lag': 0.1, 'lag_at': 20.0}])
def test_the_lag_of_a_scenario_takes_the_place_of_any_dynamics(rotor):
    found = chain({'rotors': True, 'rotor_lag': 0.15}, [TAU] * 20, vehicle_with(rotor))
    assert_allclose(found, chain({'rotor_lag': 0.15}, [TAU] * 20, without_rotors()), atol=1e-12)


def test_a_thrust_below_the_dead_band_is_swallowed():
    u = INVERSE @ TAU
    band = np.median(np.abs(u))
    assert (u < -band).any()
    assert (u > band).any()
    expected = T @ np.where(np.abs(u) < band, 0.0, u)
    assert_allclose(steady({'dead_band': float(band)}, TAU), expected, atol=1e-12)
    ahead = T @ np.where((u > 0) & (u < band), 0.0, u)
    assert_allclose(steady({'dead_band': [0.0, float(band)]}, TAU), ahead, atol=1e-12)
    own = vehicle_with({'dead_band': float(band)})
    assert_allclose(steady({'rotors': True}, TAU, own), expected, atol=1e-12)


def test_a_first_order_rotor_approaches_its_speed_exponentially():
    u, lag = INVERSE @ TAU, 0.15
    found = chain({'rotor_lag': lag}, [TAU] * 60)
    share = 1.0 - np.exp(-STEP * np.arange(1, 61) / lag)
    # n from rest: n_d times the share, and thrust its square
    assert_allclose(found, share[:, None] ** 2 * (T @ u), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize('zeta', [0.3, 1.0, 1.7])
def test_a_second_order_rotor_solves_its_equation(zeta):
    omega, commands = 14.0, [TAU] * 40 + [-0.5 * TAU] * 40
    found = chain({'rotors': True}, commands, vehicle_with({'omega': omega, 'zeta': zeta}))
    expected, u = np.zeros((80, 6)), INVERSE @ TAU
    for i in range(8):
        n = rate = np.zeros(1)
        for half, way in ((slice(40), 1.0), (slice(40, 80), -0.5)):
            n_d = np.sign(way * u[i]) * np.sqrt(abs(way * u[i]))
            n, rate = solve_ivp(
                lambda _, y, n_d=n_d: [y[1], omega**2 * (n_d - y[0]) - 2 * zeta * omega * y[1]],
                (0, 40 * STEP), [n[-1], rate[-1]], 'DOP853', STEP * np.arange(1, 41),
                rtol=1e-11, atol=1e-12,
            ).y  # fmt: skip
            expected[half] += np.outer(n * np.abs(n), T[:, i])
    assert_allclose(found, expected, atol=1e-7)


@pytest.mark.parametrize(
    'rotor', [{'lag': 0.15}, {'omega': 14.0, 'zeta': 0.3}, {'lag': 0.1, 'lag_at': 20.0}]
)
def test_thrusters_without_a_rotor_follow_at_once_beside_one_that_lags(rotor):
    data = copy.deepcopy(DATA)
    for one in data['thrusters']:
        del one['rotor']
    data['thrusters'][1]['rotor'] = rotor
    [found] = chain({'rotors': True}, [TAU], vehicle_from_dict(data, 'v'))
    missing, of_it = TAU - found, T[:, 1]
    share = missing @ of_it / (of_it @ of_it) / (INVERSE @ TAU)[1]
    assert 0.5 < share <= 1.0
    assert_allclose(missing, share * (INVERSE @ TAU)[1] * of_it, atol=1e-12)


FULL = T @ np.array([0, 0, 0, 0, 51.5, 51.5, 51.5, 51.5])  # heave, at the limit ahead


def dragged(n, u, seconds, lag=0.1, at=20.0):
    """Speed of a rotor with drag after so long, by its equation."""
    gain = 1 / (2 * lag * np.sqrt(at))
    flow = solve_ivp(
        lambda _, y: gain * (u - y * abs(y)), (0, seconds), [n], rtol=1e-10, atol=1e-12
    )
    return flow.y[0, -1]


def test_a_propeller_with_drag_solves_its_equation_to_second_order():
    vehicle, u = vehicle_with({'lag': 0.1, 'lag_at': 20.0}), INVERSE @ TAU
    n = [dragged(dragged(0.0, one, 0.32), -0.5 * one, 0.16) for one in u]
    expected = T @ (np.abs(n) * n)
    errors = []
    for step in (0.04, 0.02, 0.01, 0.005):
        way = [TAU] * round(0.32 / step) + [-0.5 * TAU] * round(0.16 / step)
        found = chain({'rotors': True}, way, vehicle, step)[-1]
        errors.append(np.abs(found - expected).max())
    assert errors[-1] < 1e-3 * np.abs(TAU).max()
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 1.7


@pytest.mark.parametrize('share', [1.0, 0.25, 0.01])
def test_the_time_constant_of_a_propeller_with_drag_goes_by_its_speed(share):
    vehicle = vehicle_with({'lag': 0.1, 'lag_at': 20.0})
    settled = [share * FULL] * round(2.5 / np.sqrt(share) / STEP)  # 40 time constants
    found = chain({'rotors': True}, [*settled, *[share * 0.9999 * FULL] * 30], vehicle)
    left = found[-30:, 2] / (share * FULL[2]) - 0.9999
    lag = 0.1 * np.sqrt(20.0 / (share * 51.5))
    assert_allclose(np.log(left[:-1] / left[1:]), STEP / lag, rtol=1e-3)
    # so slow a step that it would ring: it comes down without turning round
    found = chain({'rotors': True}, [FULL] * 60 + [0.9999 * FULL] * 9, vehicle, step=0.5)
    assert np.all(np.diff(found[59:, 2]) <= 1e-12)


def test_thrust_goes_through_zero_where_the_rotor_turns_round():
    one = chain({'rotor_lag': 0.1}, [TAU] * 100 + [-TAU] * 100)
    assert_allclose(one[99], TAU, rtol=1e-3, atol=1e-2)
    assert_allclose(one[199], -TAU, rtol=1e-3, atol=1e-2)
    along = one[100:] @ TAU / (TAU @ TAU)
    assert np.all(np.diff(along) <= 0.0)
    assert along[0] < 1.0
    assert along.min() > -1.0


@pytest.mark.parametrize('voltage', [10.0, 13.3, 16.0, 19.0])
def test_the_command_of_a_thrust_gives_another_one_at_another_voltage(voltage):
    """At the rows of the table: pulse width of the thrust at 16 V, thrust of it at the voltage."""
    known = [10, 12, 14, 16, 18, 20]
    nominal = load_curve('t200_16v')
    at = np.flatnonzero(nominal.thrusts)[[3, 40, 80, -60, -20, -2]]
    table = np.array([load_curve(f't200_{v}v').thrusts[at] for v in known])
    expected = [np.interp(voltage, known, column) for column in table.T]
    for u, given_ in zip(nominal.thrusts[at], expected, strict=True):
        tau = T @ np.full(8, u)  # heave alone: all four vertical ones push the same
        share = (INVERSE @ tau)[4] / u
        assert share == pytest.approx(1.0)
        found = steady({'voltage': voltage}, tau)
        assert found[2] == pytest.approx(4 * given_, rel=1e-9)


TABLE = {'command': [-1.0, 1.0], 'thrust_n': [-60.0, 80.0]}  # without a row of no thrust


@pytest.mark.parametrize('curve', [{}, {'curve': TABLE}])
def test_the_square_law_goes_by_the_square_of_the_voltage(curve):
    plainly = vehicle_with({'voltage': 15.0, **curve})
    assert_allclose(steady({'voltage': 12.0}, TAU, plainly), 0.64 * TAU, atol=1e-9)


def test_a_battery_that_runs_down_is_linear_in_time_and_stays():
    plainly = vehicle_with({'voltage': 15.0})
    found = chain({'voltage': [15.0, 12.0, 0.1]}, [TAU] * 15, plainly)
    share = 1.0 - 0.36 * np.minimum(np.arange(15) / 10.0, 1.0)
    assert_allclose(found, share[:, None] * TAU, rtol=1e-9, atol=1e-9)


def test_heave_and_attitude_come_before_surge_and_sway():
    tau = np.array([150.0, 0.0, 40.0, 0.0, 0.0, 15.0])
    together, first = (steady({'saturation': word}, tau) for word in ('scaled', 'priority'))
    assert together[5] < 13.0
    assert together[2] < 36.0
    assert_allclose(first[1:], tau[1:], atol=1e-9)
    assert 0.0 < first[0] < together[0] < tau[0]


def test_a_small_part_in_a_thruster_at_its_limit_takes_nothing_from_surge():
    tau = np.array([30.0, 0.0, 104.0, 0.0, 0.0, 0.0])  # two vertical thrusters give less
    reach = make_reach(None, load_vehicle('bluerov2').thrusters, 'priority')
    found = np.array(plain(reachable)(reach, tuple(tau)))
    assert 29.0 < found[0] < 30.0  # without the pitch that six thrusters cannot give
    assert 100.0 < found[2] < 103.0


@QUICK
@given(vectors(largest=300.0), st.booleans())
def test_priority_keeps_every_limit_and_uses_them_up(tau, compare):
    reach = make_reach(None, HEAVY.thrusters, 'priority')
    found = np.array(plain(reachable)(reach, tuple(tau)))
    u, limits = INVERSE @ found, HEAVY.thrusters
    assert (u <= limits.forward * (1 + 1e-9)).all()
    assert (u >= -limits.reverse * (1 + 1e-9)).all()
    served = np.array([0, 0, 1, 1, 1, 1.0]) * tau
    alone = 0.99 * HEAVY.thrusters.allocate(served / 0.99)[1]
    assert_allclose(found[2:], alone[2:], atol=1e-9)
    left = np.where(np.abs(tau[:2]) > 0, found[:2] / np.where(tau[:2] == 0, 1, tau[:2]), 0.0)
    if compare and left.max() < 1 - 1e-9 and any(np.abs(tau[:2]) > 1e-3):  # as much as fits
        most = np.maximum(u / limits.forward, -u / limits.reverse).max()
        assert most == pytest.approx(1.0, rel=1e-9)


REFUSED = {
    'rotors of thrusters that are not used': (
        {'thrusters': False, 'rotors': True}, HEAVY, 'actuators.rotors', 'thrusters: true beside'),
    'priority of nothing': (
        {'thrusters': False, 'saturation': 'priority'}, HEAVY, 'actuators.saturation', 'thrusters'),
    'no rotors': (
        {'rotors': True}, without_rotors(), 'actuators.rotors', 'those of bluerov2_heavy'),
    'no nominal voltage': (
        {'voltage': 12.0}, without_rotors(), 'actuators.voltage', 'a nominal voltage'),
}  # fmt: skip


@pytest.mark.parametrize('case', REFUSED)
def test_what_does_not_go_together_is_refused_in_a_line(case):
    spec, vehicle, key, expected = REFUSED[case]
    with pytest.raises(InputError, match=rf'^f: {re.escape(key)}: expected .*{expected}'):
        make_actuators({'thrusters': True, **spec}, vehicle, STEP, 'f')


def test_a_cell_of_several_lines_is_refused_in_one(tmp_path: Path) -> None:
    path = tmp_path / 'curve.csv'
    path.write_text('pwm_us,thrust_n,note\n1100,-40,"a\nb"\n1500,0,c\n1900,50,d\n')
    with pytest.raises(InputError, match=r'curve.csv: expected each row in a line, found'):
        load_curve(str(path))
