"""Kinetic energy in generalised velocity components, equation (30)."""

import herman_reference as reference
import numpy as np
import pytest
from helpers.strategies import QUICK, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.metrics.energy import generalised_velocity, kinetic_energy, shares
from auv_dynamics import load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.laws.model import control_model

VEHICLES = sorted(shipped('vehicles', 'herman2018').parent.glob('*.yaml'))


def model_of(vehicle):
    model = control_model(vehicle)
    return model.Upsilon_inv.reshape(6, 6), model.N


@QUICK
@given(vehicles(), vectors())
def test_the_components_add_up_to_the_kinetic_energy(data, nu):
    vehicle = vehicle_from_dict(data, 'f')
    components = kinetic_energy(*model_of(vehicle), nu)
    assert (components >= 0).all()
    assert components.sum() == pytest.approx(0.5 * nu @ vehicle.M @ nu, rel=1e-10, abs=1e-12)
    U, N = reference.decompose(vehicle.M)
    _, theirs = reference.kinetic_energy(N, U, nu)
    assert_allclose(components, theirs, rtol=0, atol=1e-10 * (1e-12 + theirs.max()))


@QUICK
@given(vehicles(), vectors())
def test_generalised_velocity_is_that_of_nu_equal_to_Upsilon_xi(data, nu):
    vehicle = vehicle_from_dict(data, 'f')
    xi = generalised_velocity(model_of(vehicle)[0], nu)
    U, _ = reference.decompose(vehicle.M)
    assert_allclose(U @ xi, nu, atol=1e-11 * (1 + np.abs(xi).max()))


def test_of_the_papers_vehicle_by_hand():
    # xi_1 = u + 0.025 q: half of 300 kg times (2 + 0.1)^2
    components = kinetic_energy(
        *model_of(load_vehicle('herman2018')), np.array([2.0, 0, 0, 0, 4, 0])
    )
    expected = [0.5 * 300 * 2.1**2, 0, 0.5 * 500 * 0.3**2, 0, 0.5 * 175.5 * 16, 0]
    assert_allclose(components, expected, rtol=1e-12, atol=1e-12)


def test_many_velocities_at_once():
    nu = np.random.default_rng(1).normal(size=(4, 5, 6))
    model = model_of(load_vehicle('rexrov'))
    whole = kinetic_energy(*model, nu)
    assert whole.shape == (4, 5, 6)
    assert_allclose(whole[2, 3], kinetic_energy(*model, nu[2, 3]), rtol=1e-13)


def test_shares_add_up_to_a_hundred_and_rest_has_none():
    components = np.array([[1.0, 0, 2, 0, 0, 1], [0, 0, 0, 0, 0, 0]])
    found = shares(components)
    assert_array_equal(found, [[25, 0, 50, 0, 0, 25], [0, 0, 0, 0, 0, 0]])


@pytest.mark.parametrize('name', [path.stem for path in VEHICLES])
def test_energy_in_nu_is_energy_in_xi(name):
    vehicle = load_vehicle(name)
    Upsilon_inv, N = model_of(vehicle)
    nu = np.random.default_rng(6).normal(size=(1000, 6))
    of_nu = 0.5 * np.einsum('ki,ij,kj->k', nu, vehicle.M, nu)
    components = kinetic_energy(Upsilon_inv, N, nu)
    assert_allclose(components.sum(axis=1), of_nu, rtol=1e-12)
    assert_allclose(shares(components).sum(axis=1), 100.0, rtol=1e-12)
