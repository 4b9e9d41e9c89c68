"""From command to applied wrench: every part of the chain against its formula."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers.strategies import QUICK, vectors
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.kernel.compile import plain
from auv_dynamics.plant.actuators import (
    IDEAL,
    fill_applied,
    make_actuators,
    memory,
)
from auv_dynamics.vehicle.thrusters import Thrusters, make_reach, reachable

STEP = 0.01
VEHICLE = load_vehicle('rexrov')
COMMANDS = np.random.default_rng(4).normal(size=(60, 6)) * [400, 300, 500, 80, 60, 90]


def chain(spec: dict, commands: np.ndarray = COMMANDS) -> np.ndarray:
    """Applied wrenches of a series of commands."""
    actuators = make_actuators(spec, VEHICLE, STEP, 'case.yaml')
    state = memory(actuators)
    rows = [fill_applied(actuators, k, tuple(c), state) for k, c in enumerate(commands)]
    return np.array(rows)


def by_the_book(spec: dict, commands: np.ndarray = COMMANDS) -> np.ndarray:
    """docs/model.md, written down in NumPy."""
    limit = np.broadcast_to(spec.get('limit', np.inf), 6)
    slew = np.broadcast_to(spec.get('rate', np.inf), 6) * STEP
    lag, d = spec.get('lag', 0.0), round(spec.get('delay', 0.0) / STEP)
    follow = 1 - np.exp(-STEP / lag) if lag else 1.0
    a, rows = np.zeros(6), []
    for k in range(len(commands)):
        c = np.clip(commands[k - d] if k >= d else np.zeros(6), -limit, limit)
        a = a + np.clip(follow * (c - a), -slew, slew)
        rows.append(a)
    return np.array(rows)


@pytest.mark.parametrize(
    'spec',
    [
        {'limit': 200.0},
        {'limit': [100, 200, 300, 10, 20, 30]},
        {'rate': 5000.0},
        {'lag': 0.05},
        {'delay': 0.03},
        {'limit': 250.0, 'rate': [4e3, 4e3, 4e3, 9e2, 9e2, 9e2], 'lag': 0.02, 'delay': 0.05},
    ],
)
def test_the_chain_by_the_book(spec):
    assert_allclose(chain(spec), by_the_book(spec), rtol=0, atol=1e-11)


@QUICK
@given(st.floats(1.0, 300.0), st.floats(10.0, 1e4), st.floats(0.0, 0.2), st.integers(0, 5))
def test_limits_and_slew_hold_whatever_comes(limit, rate, lag, delay):
    found = chain({'limit': limit, 'rate': rate, 'lag': lag, 'delay': delay * STEP})
    assert np.abs(found).max() <= limit * (1 + 1e-12)
    steps = np.diff(np.vstack([np.zeros(6), found]), axis=0)
    assert np.abs(steps).max() <= rate * STEP * (1 + 1e-9)


def test_no_entry_changes_nothing():
    assert make_actuators(None, VEHICLE, STEP, 'f') is IDEAL
    state = memory(IDEAL)
    assert fill_applied(IDEAL, 0, tuple(COMMANDS[0]), state) == tuple(COMMANDS[0])
    assert_array_equal(chain({'lag': 0.0, 'delay': 0.0}), COMMANDS)


def test_a_step_through_the_lag_is_an_exponential():
    found = chain({'lag': 0.1}, np.full((50, 6), 7.0))
    expected = 7.0 * (1 - np.exp(-STEP * np.arange(1, 51) / 0.1))
    assert_allclose(found, np.tile(expected[:, None], 6), rtol=1e-12)


def test_a_delay_shifts_and_begins_with_zero():
    found = chain({'delay': 0.04})
    assert_array_equal(found[:4], np.zeros((4, 6)))
    assert_array_equal(found[4:], COMMANDS[:-4])


def test_a_delay_that_is_no_multiple_of_the_step_is_refused():
    with pytest.raises(InputError, match='expected a multiple of step') as caught:
        make_actuators({'delay': 0.015}, VEHICLE, STEP, 'case.yaml')
    assert '\n' not in str(caught.value)


def eight_thrusters():
    """A full-rank configuration, written down here."""
    generator = np.random.default_rng(1)
    e = generator.normal(size=(8, 3))
    e /= np.linalg.norm(e, axis=1)[:, None]
    r = generator.normal(size=(8, 3))
    T = np.vstack([e.T, np.cross(r, e).T])
    names = tuple('abcdefgh')
    thrusters = Thrusters(names, T, np.full(8, 40.0), np.full(8, 50.0))
    return SimpleNamespace(thrusters=thrusters), T


@QUICK
@given(vectors(largest=200.0))
def test_allocation_keeps_the_direction_and_the_thrusters_limits(tau):
    vehicle, T = eight_thrusters()
    found = np.array(plain(reachable)(make_reach(None, vehicle.thrusters), tuple(tau)))
    u = np.linalg.pinv(T) @ tau
    most = np.where(u > 0, 50.0, 40.0)
    share = min(1.0, (most / np.maximum(np.abs(u), 1e-12)).min())
    assert_allclose(found, share * tau, rtol=0, atol=1e-9)
    assert (np.abs(share * u) <= most * (1 + 1e-12)).all()


def test_axis_limits_come_after_the_allocation():
    vehicle, T = eight_thrusters()
    tau = tuple(T @ np.full(8, 10.0))
    reach = make_reach([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], vehicle.thrusters)
    expected = np.clip(tau, -np.arange(1.0, 7.0), np.arange(1.0, 7.0))
    assert_allclose(plain(reachable)(reach, tau), expected, atol=1e-12)


@pytest.mark.parametrize('name', ['bluerov2', 'bluerov2_heavy'])
@pytest.mark.parametrize('size', [1.0, 30.0, 900.0])
def test_the_kernel_allocates_as_the_vehicle_says(name, size):
    vehicle = load_vehicle(name)
    tau = size * np.array([1.0, -0.8, 0.7, 0.1, -0.05, 0.2])
    _, delivered = vehicle.thrusters.allocate(tau)
    found = plain(reachable)(make_reach(None, vehicle.thrusters), tuple(tau))
    assert_allclose(found, delivered, rtol=0, atol=1e-9 * size)


def test_a_delay_that_would_not_fit_into_memory_is_refused():
    with pytest.raises(InputError, match=r'actuators\.delay: expected at most 1000000 steps'):
        make_actuators({'delay': 1e5}, VEHICLE, STEP, 'case.yaml')


def test_thrusters_that_a_vehicle_lacks_are_refused():
    expected = 'actuators.thrusters: expected a vehicle with thrusters, herman2018 has none'
    with pytest.raises(InputError, match=expected):
        make_actuators({'thrusters': True}, load_vehicle('herman2018'), STEP, 'case.yaml')
