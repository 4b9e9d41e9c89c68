"""Thrusters weaker than a newton: signs count, not sizes; and where nothing can be told apart."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.thrusters import Thrusters, thrusters_of

NAMES = ('a', 'b')
WEAK = Thrusters(NAMES, np.eye(6)[:, :2], np.array([0.1, 0.2]), np.array([0.4, 0.8]))


@pytest.mark.parametrize(
    ('tau', 'u'),
    [
        ([-0.4, 0.0], [-0.1, 0.0]),  # reverse
        ([0.8, 0.0], [0.4, 0.0]),  # forward
        ([0.2, -0.4], [0.1, -0.2]),
        ([-0.1, 0.8], [-0.1, 0.8]),  # each at its limit
        ([0.0, 0.0], [0.0, 0.0]),
    ],
)
def test_limits_of_weak_thrusters(tau, u):
    found, delivered = WEAK.allocate(np.array([*tau, 0, 0, 0, 0]))
    assert_allclose(found, u, rtol=1e-12)
    assert_allclose(delivered, [*u, 0, 0, 0, 0], rtol=1e-12)


def test_the_largest_wrench_is_that_of_the_stronger_way():
    T = np.array([[1.0, -1.0], [0.0, 1.0], *np.zeros((4, 2))])
    found = Thrusters(NAMES, T, np.array([5.0, 0.2]), np.array([0.4, 0.8])).largest()
    assert_allclose(found, [5.8, 0.8, 0, 0, 0, 0])


@pytest.mark.parametrize('scale', [1e-3, 1.0, 1e3])
def test_what_rounding_makes_non_zero_does_not_count(scale):
    for small, rank in ((1e-8, 2), (1e-10, 1)):
        T = scale * np.array([[1.0, 1.0], [0.0, small], *np.zeros((4, 2))])
        one = Thrusters(NAMES, T, np.ones(2), np.ones(2))
        assert one.rank == rank
        assert ('sway' in one.unactuated()) == (rank == 1)
        assert (np.abs(one.inverse).max() > 1e3 / scale) == (rank == 2)


def test_what_an_axis_comes_along_with():
    # heave is surge minus twice sway, yaw is roll alone, pitch has nothing
    rows = np.array([[1, 2, 3], [0, 1, 1], [1, 0, 1], [0, 0, 5], [0, 0, 0], [0, 0, -7]], float)
    found = Thrusters(('a', 'b', 'c'), rows, np.ones(3), np.ones(3)).unactuated()
    assert found == {'heave': ('surge', 'sway'), 'pitch': (), 'yaw': ('roll',)}


def thruster(name='a', direction=(1, 0, 0), limit=5.0):
    return {'name': name, 'position': [0, 0, 0], 'direction': list(direction), 'limit': limit}


def test_entries_are_named_by_their_place():
    with pytest.raises(InputError, match=r'thrusters\[2\].name: expected each name once'):
        thrusters_of([thruster('a'), thruster('b'), thruster('a')], 'f')
    with pytest.raises(InputError, match=r'thrusters\[1\].direction'):
        thrusters_of([thruster('a'), thruster('b', (0, 0, 0))], 'f')


@pytest.mark.parametrize(('length', 'odd'), [(1.0099, False), (1.011, True), (0.9901, False)])
def test_a_length_near_one_is_no_warning(length, odd):
    made, warnings = thrusters_of([thruster(direction=(0, 0, length))], 'f')
    assert ('thrusters[0].direction' in dict(warnings)) is odd
    assert_allclose(made.matrix[:, 0], [0, 0, 1, 0, 0, 0], rtol=1e-14)


def test_one_limit_is_both_and_two_are_reverse_then_forward():
    made, _ = thrusters_of([thruster('a', limit=7.0), thruster('b', limit=[3.0, 4.0])], 'f')
    assert_array_equal(made.reverse, [7.0, 3.0])
    assert_array_equal(made.forward, [7.0, 4.0])
