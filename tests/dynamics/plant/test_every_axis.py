"""Actuators and sensors axis by axis: an axis that takes its neighbour's number is noticed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.kernel.compile import plain
from auv_dynamics.plant.actuators import fill_applied, make_actuators, memory
from auv_dynamics.vehicle.thrusters import (
    demanded,
    make_reach,
    reachable,
    share_within,
)

STEP = 0.01
VEHICLE = load_vehicle('rexrov')
RATE = np.array([500.0, 400.0, 300.0, 200.0, 100.0, 50.0])
AXES = pytest.mark.parametrize('axis', range(6))
SIGNS = pytest.mark.parametrize('sign', [1.0, -1.0])


def after(spec: dict, *commands: np.ndarray) -> np.ndarray:
    """Wrench applied in answer to the last of some commands."""
    actuators = make_actuators(spec, VEHICLE, STEP, 'case.yaml')
    state = memory(actuators)
    rows = [fill_applied(actuators, k, tuple(c), state) for k, c in enumerate(commands)]
    return np.array(rows[-1])


@AXES
@SIGNS
def test_the_slew_of_an_axis_is_its_own(axis, sign):
    far = sign * 1e4 * np.eye(6)[axis]
    expected = sign * RATE[axis] * STEP * np.eye(6)[axis]
    assert_allclose(after({'rate': RATE}, far), expected, rtol=1e-12)
    assert_allclose(after({'rate': RATE}, far, far, far), 3 * expected, rtol=1e-12)
    near = 0.99 * expected
    assert_array_equal(after({'rate': RATE}, near), near)


@AXES
@SIGNS
def test_the_limit_of_an_axis_is_its_own(axis, sign):
    far, limit = sign * 1e4 * np.eye(6)[axis], RATE
    assert_array_equal(after({'limit': limit}, far), sign * limit[axis] * np.eye(6)[axis])
    near = 0.99 * sign * limit[axis] * np.eye(6)[axis]
    assert_array_equal(after({'limit': limit}, near), near)


@AXES
def test_the_lag_of_an_axis_starts_from_that_axis(axis):
    c = np.arange(1.0, 7.0) * np.eye(6)[axis]
    left = np.exp(-STEP / 0.05)
    assert_allclose(after({'lag': 0.05}, c, c), (1 - left**2) * c, rtol=1e-12)


def test_a_slew_that_is_just_enough_reaches_the_command():
    c = 0.5 * np.arange(1.0, 7.0)
    assert_array_equal(after({'rate': c / STEP}, c), c)


@pytest.mark.parametrize('delay', [1, 2, 3])
def test_a_delay_keeps_the_order_of_the_commands(delay):
    commands = np.arange(48.0).reshape(8, 6)
    for n in range(1, 9):
        expected = commands[n - 1 - delay] if n > delay else np.zeros(6)
        assert_array_equal(after({'delay': delay * STEP}, *commands[:n]), expected)


@pytest.mark.parametrize(('delay', 'fits'), [(2.0000005, True), (1.99999, False), (2.00001, False)])
def test_a_delay_is_a_whole_number_of_steps(delay, fits):
    if fits:
        assert make_actuators({'delay': delay * STEP}, VEHICLE, STEP, 'f').delay == 2
    else:
        with pytest.raises(InputError, match='a multiple of step'):
            make_actuators({'delay': delay * STEP}, VEHICLE, STEP, 'f')


def test_without_bounds_everything_is_reached():
    reach = make_reach(None, None)
    assert not reach.bounded
    assert_array_equal(reach.limit, np.full(6, np.inf))
    assert reach.T.shape == (6, 0)
    assert reach.T_inv.shape == (0, 6)
    assert reach.reverse.shape == reach.forward.shape == (0,)
    tau = tuple(1e9 * np.arange(-2.0, 4.0))
    assert tuple(plain(reachable)(reach, tau)) == tau
    assert tuple(plain(demanded)(reach, tau)) == tau


def test_one_limit_holds_for_all_axes():
    reach = make_reach(3.0, VEHICLE.thrusters)
    assert reach.bounded
    assert_array_equal(reach.limit, np.full(6, 3.0))
    assert make_reach(None, load_vehicle('bluerov2').thrusters).bounded


def test_share_of_the_thrusts_that_is_within_limits():
    forward, reverse = np.array([10.0, 20.0, 30.0]), np.array([5.0, 6.0, 7.0])
    reach = one_thruster_per_axis(forward, reverse)
    assert share_of(reach, [0.0, 0.0, 0.0]) == 1.0
    assert share_of(reach, [10.0, -6.0, 30.0]) == 1.0  # each at its limit
    for i in range(3):
        ahead, astern = 4.0 * forward[i] * np.eye(3)[i], -8.0 * reverse[i] * np.eye(3)[i]
        assert share_of(reach, ahead) == 0.25
        assert share_of(reach, astern) == 0.125
    assert share_of(reach, [20.0, -24.0, 31.0]) == 0.25  # the smallest
    assert share_of(reach, [80.0, -24.0, 31.0]) == 0.125  # wherever it stands


def one_thruster_per_axis(forward, reverse):
    T = np.eye(6, len(forward))
    return make_reach(1.0, None)._replace(forward=forward, reverse=reverse, T=T, T_inv=T.T)


def share_of(reach, thrusts):
    """Share of thrusts that are the first entries of the wrench."""
    return plain(share_within)(reach, (*thrusts, *[0.0] * (6 - len(thrusts))))


def test_share_of_thrusts_below_a_newton():
    reach = one_thruster_per_axis(np.array([0.4]), np.array([0.1]))
    assert share_of(reach, [0.8]) == 0.5
    assert share_of(reach, [-0.2]) == 0.5


@pytest.mark.parametrize('name', ['bluerov2', 'bluerov2_heavy'])
def test_what_is_demanded_knows_no_limits(name):
    vehicle = load_vehicle(name)
    tau = np.array([900.0, -800.0, 700.0, 60.0, -50.0, 40.0])
    T = vehicle.thrusters.matrix
    expected = T @ np.linalg.pinv(T, rcond=1e-9) @ tau
    if name == 'bluerov2':
        expected[4] = -50.0  # six thrusters: no pitch of its own, the command stands
    reach = make_reach(None, vehicle.thrusters)
    assert_allclose(plain(demanded)(reach, tuple(tau)), expected, atol=1e-9)
    most = np.abs(plain(reachable)(reach, tuple(tau))).max()
    assert most < 0.5 * np.abs(expected).max()
