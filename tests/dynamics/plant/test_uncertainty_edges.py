"""Edges of what a plant may be given: asymmetry relative to size, and which entry is blamed."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.uncertainty import make_uncertainty

VEHICLE = load_vehicle('rexrov')
WHOLE = load_vehicle('herman2018')  # its file gives M itself
PUSH = {'kind': 'harmonic', 'surge': {'offset': 1.0}}
STEADY = {'kind': 'current', 'velocity': [0.1, 0.0, 0.0]}
WAVE = {'terms': [{'amplitude': 0.1, 'omega': 1.0}]}


def made(*specs, vehicle=VEHICLE):
    return make_uncertainty(vehicle, specs, 'case.yaml', [f'd[{i}]' for i in range(len(specs))])


def refused(place, expected, *specs, vehicle=VEHICLE):
    with pytest.raises(InputError, match=re.escape(place) + '.*' + expected):
        made(*specs, vehicle=vehicle)


def lopsided(size, share):
    dM = size * np.eye(6)
    dM[1, 4] = size * share
    return {'kind': 'model_error', 'dM': dM.tolist()}


@pytest.mark.parametrize('size', [0.01, 1.0, 100.0])
def test_asymmetry_is_relative_to_the_largest_entry(size):
    model = made(lopsided(size, 5e-4)).truth.model
    dM = model.M.reshape(6, 6) - VEHICLE.M
    assert_allclose(dM[1, 4], size * 2.5e-4, rtol=1e-3, atol=1e-9)
    assert_allclose(dM, dM.T, atol=1e-9)
    refused('d[0].dM', 'a symmetric matrix', lopsided(size, 2e-3))


def test_the_entry_that_makes_M_indefinite_is_named():
    bad = {'kind': 'model_error', 'dM': [0, 0, 0, 0, 0, -1e6]}  # one axis is enough
    for before in ([], [PUSH], [PUSH, STEADY]):
        refused(f'd[{len(before)}]:', 'a positive definite M', *before, bad, PUSH)


@pytest.mark.parametrize('axis', ['north', 'east', 'down'])
def test_a_current_that_varies_needs_to_know_the_rigid_body(axis):
    waving = STEADY | {axis: WAVE}
    assert made(waving, {'kind': 'model_error', 'dD': 1.0}).current is not None
    refused(f'd[1].{axis}', 'a constant current', PUSH, waving, vehicle=WHOLE)
    others = {one: {'offset': 0.3} for one in ('north', 'east', 'down')}
    refused(f'd[0].{axis}', 'a constant current', {**waving, **others, axis: WAVE}, vehicle=WHOLE)
    dM = {'kind': 'model_error', 'dM': 1.0}
    refused(f'd[0].{axis}', 'a constant current beside dM', waving, dM)
    made(STEADY, dM)
    made(STEADY, vehicle=WHOLE)


@pytest.mark.parametrize('key', ['mass', 'added_mass', 'damping'])
def test_relative_errors_need_the_parts_of_M(key):
    refused(f'd[0].{key}', 'dM and dD', {'kind': 'model_error', key: 0.1}, vehicle=WHOLE)
    made({'kind': 'model_error', 'buoyancy': 0.1}, vehicle=WHOLE)


def test_when_F_is_the_explicit_part_alone():
    for specs, exact in (([], True), ([PUSH], True), ([STEADY], False),
                         ([{'kind': 'model_error', 'mass': 0.1}], False)):  # fmt: skip
        assert made(*specs).truth.exact is exact


def test_relative_errors_scale_their_part():
    errors = [{'kind': 'model_error', 'mass': 0.1, 'added_mass': -0.3, 'damping': 0.5},
              {'kind': 'model_error', 'mass': 0.2, 'buoyancy': 0.05}]  # fmt: skip
    truth = made(*errors).truth
    M_RB, M_A = 1.3 * VEHICLE.M_RB, 0.7 * VEHICLE.M_A
    assert_allclose(truth.M_RB, M_RB.ravel(), rtol=1e-12)
    assert_allclose(truth.model.M, (M_RB + M_A).ravel(), rtol=1e-12)
    assert_allclose(truth.model.D_linear, 1.5 * VEHICLE.D_linear.ravel(), rtol=1e-12)
    assert_allclose(truth.model.D_quadratic, 1.5 * VEHICLE.D_quadratic.ravel(), rtol=1e-12)
    weight, buoyancy = 1.3 * VEHICLE.weight, 1.05 * VEHICLE.buoyancy
    couple = weight * VEHICLE.r_G - buoyancy * VEHICLE.r_B
    assert_allclose(truth.model.hydrostatics, [weight - buoyancy, *couple], rtol=1e-12)
    assert_allclose(truth.known.M, VEHICLE.M.ravel(), rtol=1e-15)
    assert not made({'kind': 'model_error', 'dM': 1.0}, vehicle=WHOLE).truth.M_RB.any()
