"""Which currents vary in time, and their sum."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.plant.uncertainty import make_current, varies


def term(amplitude, omega, **more):
    return {'amplitude': amplitude, 'omega': omega, **more}


@pytest.mark.parametrize('axis', ['north', 'east', 'down'])
@pytest.mark.parametrize(
    ('terms', 'expected'),
    [
        ([], False),
        ([term(0.0, 1.0)], False),
        ([term(1.0, 0.0)], False),
        ([term(0.5, 0.5)], True),
        ([term(-0.5, 0.5)], True),
        ([term(0.5, -0.5)], True),
        ([term(1.0, 0.0), term(-2.0, -3.0)], True),
    ],
)
def test_a_current_varies_by_amplitude_and_frequency_of_either_sign(axis, terms, expected):
    assert varies({axis: {'offset': 1.0, 'terms': terms}}) is expected
    assert varies({'velocity': [1.0, 2.0, 3.0]}) is False


def test_currents_add_up():
    assert make_current([]) is None
    one = {'velocity': [0.1, 0.2, 0.3], 'down': {'offset': 0.5, 'terms': [term(-0.4, 2.0)]}}
    other = {'north': {'terms': [term(0.3, 1.5, phase=0.2)]}}
    steady = {'velocity': [1.0, 1.0, 1.0]}
    t = np.linspace(0.0, 3.0, 7)
    found = make_current([one, other, steady])(t)
    v = [1.1 + 0.3 * np.sin(1.5 * t + 0.2), np.full(7, 1.2), 1.8 - 0.4 * np.sin(2.0 * t)]
    a = [0.45 * np.cos(1.5 * t + 0.2), np.zeros(7), -0.8 * np.cos(2.0 * t)]
    assert_allclose(found, np.transpose([*v, *a]), rtol=1e-12, atol=1e-15)
    assert_array_equal(make_current([steady])(t), np.tile([1.0, 1.0, 1.0, 0, 0, 0], (7, 1)))
