"""Wrench to pilot's axes, against a mixer that was written from ArduSub's tables alone."""

import numpy as np
import pytest
from ardusub_mixer import VECTORED_6DOF, motor_pulses, thrust
from helpers.mavlink_pair import Booted, Pair
from helpers.strategies import QUICK, vectors
from hypothesis import given
from numpy.testing import assert_allclose
from wrench_mapping import (
    FOUR,
    SIGNS,
    PilotAxes,
    WrenchMapping,
    manual_control,
    pulses_of,
    rc_override,
)

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import read_yaml
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

VEHICLES = {name: load_vehicle(name) for name in ('bluerov2_heavy', 'bluerov2')}
ALL = tuple(range(6))
MAPPINGS = {name: WrenchMapping(vehicle, ALL, 16.0) for name, vehicle in VEHICLES.items()}
DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
# an input pulse is 1/400 of full and a motor does nothing within 25 of them: N and N m
FINEST = np.array([0.4, 0.4, 0.5, 0.12, 0.12, 0.12])


def delivered(name: str, axes: PilotAxes, voltage: float = 16.0) -> np.ndarray:
    T = VEHICLES[name].thrusters.matrix
    message = rc_override(axes, 1, 1)
    channels = [getattr(message, f'chan{i}_raw') for i in range(1, 7)]
    return T @ thrust(motor_pulses(channels, T.shape[1]), 'square', voltage)


@pytest.mark.parametrize('name', VEHICLES)
@QUICK
@given(vectors(6, 1.0))
def test_the_wrench_that_arrives_is_the_one_that_was_asked_for(name, values) -> None:
    mapping, tau = MAPPINGS[name], values * [40, 40, 40, 4, 4, 4]
    axes, share = mapping.axes(tau)
    assert np.abs(axes).max() <= 1.0
    found, dofs = delivered(name, axes), list(mapping.dofs)
    assert (np.abs(found - share * tau) <= FINEST)[dofs].all()


@pytest.mark.parametrize('dof', range(6))
@pytest.mark.parametrize('sign', [1, -1])
def test_a_force_moves_the_vehicle_its_own_way(dof: int, sign: int) -> None:
    tau = np.zeros(6)
    tau[dof] = sign * (10.0 if dof < 3 else 1.0)
    pair = Pair().flown()
    pair.run(0.5, tau=tau)
    nu = pair.autopilot.plant.x[7:]
    assert sign * nu[dof] > 0.05
    others = np.abs(np.delete(nu, dof))
    assert others.max() < 0.3 * abs(nu[dof])


@pytest.mark.parametrize('factor', range(6))
def test_a_wrong_sign_in_the_mixer_would_be_seen(factor: int) -> None:
    # the same check with one column of ArduSub's table turned round
    column = {0: 4, 1: 5, 2: 3, 3: 0, 4: 1, 5: 2}[factor]  # of forward, lateral, throttle, ...
    table = np.array(VECTORED_6DOF, float)
    table[:, column] *= -1
    inputs = np.zeros(6)
    inputs[column] = SIGNS[factor] * 0.5
    T = VEHICLES['bluerov2_heavy'].thrusters.matrix
    right = T @ (np.array(VECTORED_6DOF, float) @ inputs)
    wrong = T @ (table @ inputs)
    assert right[factor] > 0.1
    assert wrong[factor] < -0.1


def test_beyond_the_thrusters_the_direction_stays() -> None:
    tau = np.array([300.0, 100.0, -200.0, 5.0, 10.0, 20.0])
    axes, share = MAPPINGS['bluerov2_heavy'].axes(tau)
    assert share < 0.5
    assert max(map(abs, axes)) <= 1.0
    found = delivered('bluerov2_heavy', axes)
    assert (np.abs(found - share * tau) < 2 * FINEST).all()
    assert_allclose(found[:3] / found[0], tau[:3] / tau[0], rtol=0.05)


def test_a_pilot_gain_takes_thrust_by_its_square() -> None:
    mapping = MAPPINGS['bluerov2_heavy']
    tau = np.array([1000.0, 0, 0, 0, 0, 0])
    full, half = mapping.axes(tau)[1], mapping.axes(tau, reach=0.5)[1]
    assert half == pytest.approx(full / 4)


@pytest.mark.parametrize('turned', [[0], [2], [0, 3], [5], [4, 5, 6, 7], [*range(8)]])
def test_which_way_the_nose_of_a_thruster_points_does_not_matter(turned: list[int]) -> None:
    data = read_yaml(shipped('vehicles', 'bluerov2_heavy'), 'vehicle')
    for i in turned:
        one = data['thrusters'][i]
        back = {'direction': [-x for x in one['direction']], 'limit': one['limit'][::-1]}
        data['thrusters'][i] = {key: one[key] for key in ('name', 'position')} | back
    mapping = WrenchMapping(vehicle_from_dict(data, 'mine'), ALL, 16.0)
    usual = MAPPINGS['bluerov2_heavy']
    for tau in ([20.0, -15.0, 25.0, 1.0, -2.0, 3.0], [-5.0, 8.0, -4.0, -1.0, 0.5, -2.0]):
        axes, share = mapping.axes(np.array(tau))
        wanted, whole = usual.axes(np.array(tau))
        assert (axes, share) == (pytest.approx(wanted, abs=1e-6), whole)


def test_what_is_sent_keeps_each_axis_in_its_place_and_within_its_range() -> None:
    axes = PilotAxes(0.1, 0.2, 0.3, 0.35, 0.4, -0.45)
    assert axes.pulses() == (1660, 1640, 1620, 1320, 1540, 1580)
    message = rc_override(axes, 3, 7)
    assert (message.target_system, message.target_component) == (3, 7)
    others = [getattr(message, f'chan{i}_raw') for i in range(7, 19)]
    assert others == [65535] * 12, 'left as they are'
    message = manual_control(axes, 3, 0.5)
    found = message.target, message.x, message.y, message.z, message.r, message.buttons
    assert found == (3, 200, 400, 800, -900, 0)
    assert pulses_of(message, 0.5, 1.0) == (1500, 1500, 1620, 1320, 1540, 1580)
    beyond = manual_control(PilotAxes(1.0, -1.0, -1.0, yaw=1.0), 3, 0.5)  # a gain that has fallen
    assert (beyond.x, beyond.y, beyond.z, beyond.r) == (1000, -1000, 0, 1000)
    assert pulses_of(beyond, 0.5, 3.0) == (1500, 1500, 1100, 1700, 1700, 1300)


def test_what_cannot_be_commanded_is_left_out() -> None:
    four = WrenchMapping(VEHICLES['bluerov2_heavy'], FOUR, 16.0)
    axes, share = four.axes(np.array([5.0, 5.0, 5.0, 50.0, 50.0, 1.0]))
    assert (axes.roll, axes.pitch, share) == (0.0, 0.0, 1.0)
    assert four.axes(np.zeros(6)) == (PilotAxes(), 1.0)
    assert MAPPINGS['bluerov2'].dofs == (0, 1, 2, 3, 5)  # two vertical thrusters do not pitch


def test_small_thrusts_are_lost_in_the_dead_zone() -> None:
    axes, _ = MAPPINGS['bluerov2_heavy'].axes(np.array([0.3, 0, 0, 0, 0, 0]))
    assert delivered('bluerov2_heavy', axes)[0] == 0.0


@pytest.mark.parametrize('voltage', [12.0, 14.0, 20.0])
def test_the_supply_is_taken_into_account(voltage: float) -> None:
    mapping = WrenchMapping(VEHICLES['bluerov2_heavy'], ALL, voltage)
    tau = np.array([20.0, -15.0, 25.0, 1.0, 1.0, 2.0])
    axes, _ = mapping.axes(tau)
    found = delivered('bluerov2_heavy', axes, voltage)
    assert_allclose(found, tau, rtol=0.08, atol=FINEST.max())
    at_16, _ = MAPPINGS['bluerov2_heavy'].axes(tau)
    assert np.abs(delivered('bluerov2_heavy', at_16, voltage) - tau).max() > 0.7


@pytest.mark.parametrize(
    ('voltage', 'reverse', 'forward'),
    [(12.0, 2.92, 3.71), (16.0, 4.1, 5.25), (18.0, 4.575, 5.975), (20.0, 5.05, 6.7)],
)
def test_full_thrust_each_way_follows_the_supply(voltage, reverse, forward) -> None:
    """In kgf of a T200; four of them share a heave of 40 N, forward is down."""
    mapping = WrenchMapping(VEHICLES['bluerov2_heavy'], ALL, voltage)
    heave = np.eye(6)[2] * 40.0
    down, up = (mapping.axes(tau)[0].throttle for tau in (heave, -heave))
    assert down == pytest.approx(-np.sqrt(10.0 / (51.5 * forward / 5.25)))
    assert up == pytest.approx(np.sqrt(10.0 / (40.2 * reverse / 4.1)))


def test_other_thrusters_are_refused() -> None:
    with pytest.raises(InputError, match='expected a vehicle with thrusters, found none'):
        WrenchMapping(load_vehicle('rexrov'), ALL, 16.0)
    data = read_yaml(shipped('vehicles', 'bluerov2_heavy'), 'vehicle')
    for i in (0, 1):
        ahead = {'name': f'ahead {i}', 'position': [0.3, 0.2 - 0.4 * i, 0.0]}
        data['thrusters'].append(data['thrusters'][i] | ahead)
    with pytest.raises(InputError, match='found 6 thrusters for 3 degrees of freedom'):
        WrenchMapping(vehicle_from_dict(data, 'mine'), ALL, 16.0)
    data['thrusters'] = data['thrusters'][:4]  # none of them upright
    with pytest.raises(InputError, match='found 0 thrusters for 0 degrees of freedom'):
        WrenchMapping(vehicle_from_dict(data, 'mine'), ALL, 16.0)


def test_neutral_stays_where_it_is() -> None:
    pair = Pair(Booted()).flown()
    pair.run(1.0, tau=np.zeros(6))
    assert pair.autopilot.pulses == [1500] * 8
