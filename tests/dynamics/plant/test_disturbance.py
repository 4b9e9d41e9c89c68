"""Lumped uncertainty F(t): equation (39), harmonics, sums, and its effect on the plant."""

import herman_reference as reference
import numpy as np
import pytest
from helpers.plants import plant_of, push
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.plant.disturbance import KINDS, herman2018, make_disturbance
from auv_dynamics.plant.plant import BLOCK, initial_state

T = np.linspace(0.0, 30.0, 601)
HARMONIC = {
    'kind': 'harmonic',
    'heave': {'offset': -30.0, 'terms': [{'amplitude': 10.0, 'omega': 0.3, 'phase': 0.2}]},
    'yaw': {'offset': 4.0},
}


@pytest.mark.parametrize('sign', [-1, 1])
def test_equation_39_agrees_with_the_reference(sign):
    spec = {'kind': 'herman2018', 'exponent_sign': sign}
    expected = [reference.disturbance(spec, t) for t in T]
    rounding = 1e-13 * np.abs(expected).max()
    assert_allclose(herman2018(T, sign), expected, rtol=0, atol=rounding)
    assert_allclose(make_disturbance([spec])(T), expected, rtol=0, atol=rounding)


def test_exponents_are_negative_unless_said():
    assert_array_equal(make_disturbance([{'kind': 'herman2018'}])(T), herman2018(T, -1))
    assert np.abs(herman2018(T, 1) - herman2018(T, -1)).max() > 100.0


def test_equation_39_at_the_start_by_hand():
    f1, f2, f3 = np.pi / 4, 0.1 * np.exp(np.cos(0.7)), np.pi / 4
    expected = [100 * f1 * np.exp(-2.5) + 20, 20 * f1 * np.exp(-2.5) + 4,
                150 * f2 / np.e + 1, 3 * f2 / np.e + 1,
                150 * f3 * np.exp(-3) + 12, 50 * f3 * np.exp(-3) + 4]  # fmt: skip
    assert_allclose(herman2018(np.zeros(1))[0], expected, rtol=1e-14)


def test_peaks_of_equation_39():
    peaks = np.abs(herman2018(np.linspace(0, 30, 3001))).max(axis=0)
    assert_allclose(peaks[[0, 2, 4, 5]], [28.9, 18.9, 22.0, 7.3], atol=0.05)


def test_harmonic_and_sum():
    other = {'kind': 'herman2018', 'exponent_sign': 1}
    expected = [reference.disturbance([HARMONIC, other], t) for t in T]
    assert_allclose(make_disturbance([HARMONIC, other])(T), expected, rtol=1e-12)
    alone = make_disturbance([HARMONIC])(T)
    assert_allclose(alone[:, 2], -30 + 10 * np.sin(0.3 * T + 0.2), rtol=1e-13)
    assert not alone[:, [0, 1, 3, 4]].any()


def test_none_is_zero_and_every_kind_has_the_shape():
    assert not make_disturbance([])(T).any()
    for kind in KINDS:
        assert make_disturbance([{'kind': kind}])(T).shape == (len(T), 6)


def still(specs):
    vehicle = load_vehicle('herman2018_neutral')
    x = initial_state(np.zeros(6), np.zeros(6))
    return vehicle, plant_of(vehicle, specs, 0.01, 'ode5', x)


def test_a_positive_disturbance_opposes_the_wrench():
    _, plant = still([{'kind': 'harmonic', 'surge': {'offset': 50.0}}])
    push(plant, (0.0,) * 6)
    assert plant.x[7] < -1e-3
    _, balanced = still([{'kind': 'harmonic', 'surge': {'offset': 50.0}}])
    vehicle, free = still([])
    restoring, surge = vehicle.g(np.zeros(6)), 50.0 * np.eye(6)[0]
    push(balanced, restoring + surge)
    push(free, restoring)
    assert_array_equal(balanced.x[7:], np.zeros(6))
    assert_array_equal(free.x[7:], np.zeros(6))


@pytest.mark.parametrize('dof', range(6))
def test_no_component_is_without_effect(dof):
    name = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')[dof]
    vehicle, plant = still([{'kind': 'harmonic', name: {'offset': 30.0}}])
    _, free = still([])
    for one in (plant, free):
        push(one, (0.0,) * 6)
    expected = -0.01 * np.linalg.inv(vehicle.M)[:, dof] * 30.0
    assert_allclose((plant.x - free.x)[7:], expected, atol=0.05 * np.abs(expected).max())


def test_the_plant_looks_up_the_very_same_disturbance_in_every_block():
    specs = [HARMONIC, {'kind': 'herman2018'}]
    whole = make_disturbance(specs)(0.01 * np.arange(2 * BLOCK + 8))
    _, plant = still(specs)
    for F in whole:
        assert_array_equal(push(plant, (0.0,) * 6)[1], F)
