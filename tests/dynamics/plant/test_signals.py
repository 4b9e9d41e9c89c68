"""Offsets and sinusoids: values and derivatives."""

import herman_reference as reference
import numpy as np
import pytest
from helpers.strategies import QUICK, SPECS, WORKED
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.plant.disturbance import Harmonics


@QUICK
@given(SPECS, st.floats(-100.0, 100.0))
def test_values_and_derivatives_agree_with_the_reference(spec, t):
    signal = Harmonics.from_spec(spec)
    value, rate = reference.setpoint(spec, t)
    assert_allclose(signal.value(t), value, atol=1e-12)
    assert_allclose(signal.derivative(t), rate, atol=1e-12)


def test_worked_values():
    signal = Harmonics.from_spec(WORKED)
    assert_allclose(signal.value(0.0), [0.2, 0, 1.5, 0, 0, -0.1], atol=1e-15)
    assert_allclose(signal.value(10.0)[0], 1.2, atol=1e-15)
    assert_allclose(signal.derivative(0.0), [np.pi / 20, 0, -1.0, 0, 0, 0], atol=1e-15)


def test_derivative_is_the_slope_of_the_value():
    signal, t, h = Harmonics.from_spec(WORKED), np.linspace(0.0, 30.0, 301), 1e-5
    slope = (signal.value(t + h) - signal.value(t - h)) / (2 * h)
    assert_allclose(signal.derivative(t), slope, atol=1e-8)
    assert np.abs(slope).max() > 1.0


@pytest.mark.parametrize('shape', [(), (4,), (3, 5)])
def test_times_of_any_shape(shape):
    signal = Harmonics.from_spec(WORKED)
    t = np.arange(np.prod(shape, dtype=int), dtype=float).reshape(shape)
    for result in (signal.value(t), signal.derivative(t)):
        assert result.shape == (*shape, 6)
    one_by_one = [signal.value(moment) for moment in t.ravel()]
    assert_array_equal(signal.value(t).reshape(-1, 6), one_by_one)


def test_a_part_of_many_is_what_they_are():
    many = Harmonics(np.arange(18.0).reshape(3, 6), tuple(np.full((3, 1, 3), i) for i in range(6)))
    t = np.linspace(0.0, 1.0, 5)
    assert_array_equal(many.part([2, 0]).value(t), many.value(t)[[2, 0]])
