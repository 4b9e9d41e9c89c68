"""The terms of equation (1): structure, published numbers, physics, and an independent model."""

import herman_reference as reference
import numpy as np
import pytest
import yaml
from helpers.physics import (
    DENSE_C_NU,
    DENSE_M_A,
    DENSE_NU,
    G_ETA,
    G,
    diagonal_C,
    particle_wrench,
    particles,
    potential_gradient,
    vehicle_of,
    with_inertia,
)
from helpers.strategies import QUICK, attitudes, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.files.shipped import shipped


def test_the_drawn_vehicles_are_as_hard_as_they_should_be():
    # what the properties below hold for: dense M_A, far above M_RB, and the CG off in all axes
    dense, heavier = [], []

    @QUICK
    @given(vehicles(heavy_water=True))
    def look(data):
        vehicle = vehicle_of(data)
        sizes = np.sqrt(np.diagonal(vehicle.M_A))
        dense.append((np.abs(vehicle.M_A) > 1e-3 * np.outer(sizes, sizes)).all())
        heavier.append(np.linalg.norm(vehicle.M_A, 2) / data['rigid_body']['mass'])
        assert (np.abs(vehicle.r_G) >= 0.01).all()

    look()
    assert np.mean(dense) > 0.5
    assert min(heavier) >= 2.0
    assert np.median(heavier) > 5.0  # examples differ with the modules that are loaded


@QUICK
@given(vehicles(), vectors())
def test_coriolis_is_skew_for_every_velocity(data, nu):
    C = vehicle_of(data).C(nu)
    assert_array_equal(C, -C.T)


@QUICK
@given(vehicles(), vectors(), vectors())
def test_coriolis_is_linear_in_the_velocity(data, nu, other):
    vehicle = vehicle_of(data)
    sum_of_two = 2.0 * vehicle.C(nu) - 3.0 * vehicle.C(other)
    scale = np.abs(vehicle.M).max() * 100.0
    assert_allclose(vehicle.C(2.0 * nu - 3.0 * other), sum_of_two, rtol=0, atol=1e-14 * scale)


@QUICK
@given(vehicles(), vectors())
def test_coriolis_is_the_turning_of_the_momentum(data, nu):
    vehicle = vehicle_of(data)
    expected = reference.kirchhoff(vehicle.M, nu)
    assert_allclose(vehicle.C(nu) @ nu, expected, rtol=0, atol=1e-13 * scale_of(vehicle.M, nu))


def scale_of(M, nu):
    return np.abs(M).max() * (1.0 + np.abs(nu).max()) ** 2


@QUICK
@given(vehicles(), vectors(), vectors(largest=50.0))
def test_rigid_body_is_that_of_its_particles(data, nu, nu_dot):
    # M_RB nu_dot + C_RB(nu) nu, from Newton for particles of that mass, centre and inertia
    body = data['rigid_body']
    r_G, inertia = np.array(body['center_of_gravity']), np.array(body['inertia'])
    wrench = particle_wrench(*particles(body['mass'], r_G, inertia), nu, nu_dot)
    vehicle = vehicle_of(data)
    alone = vehicle_of(with_inertia(vehicle.M_RB))
    found = vehicle.M_RB @ nu_dot + alone.C(nu) @ nu
    scale = np.abs(vehicle.M_RB).max() * (1 + np.abs(nu).max() ** 2 + np.abs(nu_dot).max())
    assert_allclose(found, wrench, rtol=0, atol=1e-12 * scale)


def test_coriolis_of_a_diagonal_inertia():
    C = vehicle_of(with_inertia(np.diag(np.arange(1, 7)))).C(np.arange(1.0, 7.0))
    assert_array_equal(C, diagonal_C())


def test_munk_moment():
    data = with_inertia(np.eye(6))
    del data['inertia_matrix']
    data['rigid_body'] |= {'center_of_gravity': [0.0] * 3, 'inertia_reference': 'cg'}
    data['rigid_body']['inertia'] = np.eye(3).tolist()
    data['added_mass'] = [5, 100, 100, 0, 10, 10]
    nu = np.array([1, 0.5, 0, 0, 0, 0])
    assert_allclose(-(vehicle_of(data).C(nu) @ nu), [0, 0, 0, 0, 0, -47.5], atol=1e-12)


def test_coriolis_of_a_dense_added_mass():
    C = vehicle_of(with_inertia(DENSE_M_A)).C(DENSE_NU)
    assert_allclose(C @ DENSE_NU, DENSE_C_NU, atol=1e-12)


def test_restoring_wrench_of_a_worked_attitude():
    assert_allclose(vehicle_of(with_inertia(DENSE_M_A)).g(G_ETA), G, atol=1e-8)


@QUICK
@given(vectors(), vectors(), vectors(), vectors())
def test_diagonal_damping_only_takes_energy(linear, quadratic, nu, x):
    data = with_inertia(np.eye(6))
    data['damping'] = {k: np.abs(v).tolist() for k, v in
                       (('linear', linear), ('quadratic', quadratic))}  # fmt: skip
    D = vehicle_of(data).D(nu)
    assert x @ D @ x >= 0.0
    assert_allclose(np.diagonal(D), np.abs(linear) + np.abs(quadratic) * np.abs(nu), rtol=1e-15)


@QUICK
@given(vehicles(), vectors(), vectors())
def test_damping_of_drawn_vehicles_only_takes_energy(data, nu, x):
    # full linear part, of which only the symmetric half takes part, and a diagonal quadratic one
    D = vehicle_of(data).D(nu)
    assert x @ D @ x >= -1e-14 * np.abs(D).max() * (x @ x)


def test_dense_quadratic_damping_multiplies_column_by_column():
    data = with_inertia(np.eye(6))
    data['damping']['quadratic'] = (np.eye(6) + 0.1 * np.arange(36).reshape(6, 6)).tolist()
    nu = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
    expected = np.array(data['damping']['quadratic']) * [1, 2, 3, 4, 5, 6]
    assert_allclose(vehicle_of(data).D(nu), expected, rtol=1e-15)


@QUICK
@given(vehicles(), attitudes())
def test_restoring_is_the_gradient_of_the_potential(data, eta):
    # the potential grows by grad' eta_dot = grad' J nu, and that is the power g' nu that g takes
    # from the kinetic energy, for every nu: g = J' grad, and the wrench that acts is -g
    vehicle, slope = vehicle_of(data), reference.jacobian(eta).T @ potential_gradient(data, eta)
    scale = vehicle.weight + vehicle.buoyancy
    assert_allclose(vehicle.g(eta), slope, rtol=0, atol=1e-13 * scale)
    opposite = np.abs(vehicle.g(eta) + slope).max()
    assert opposite > 1e-6 * scale  # random centres: g never vanishes


@QUICK
@given(vehicles(), attitudes(), vectors(), vectors(largest=50.0), vectors(largest=50.0))
def test_forward_dynamics_of_inverse_dynamics_is_the_acceleration(data, eta, nu, nu_dot, F):
    vehicle = vehicle_of(data)
    tau = vehicle.inverse_dynamics(eta, nu, nu_dot, F)
    scale = np.linalg.cond(vehicle.M) * (1.0 + np.abs(tau).max() / np.linalg.norm(vehicle.M, 2))
    found = vehicle.forward_dynamics(eta, nu, tau, F)
    assert_allclose(found, nu_dot, rtol=0, atol=1e-14 * scale)


@QUICK
@given(vehicles(), attitudes(), vectors(), vectors(largest=5e3), vectors(largest=50.0))
def test_inverse_dynamics_of_forward_dynamics_is_the_wrench(data, eta, nu, tau, F):
    vehicle = vehicle_of(data)
    nu_dot = vehicle.forward_dynamics(eta, nu, tau, F)
    rest = vehicle.inverse_dynamics(eta, nu, 0.0 * nu_dot, F)
    scale = np.linalg.cond(vehicle.M) * (1.0 + np.abs(tau).max() + np.abs(rest).max())
    found = vehicle.inverse_dynamics(eta, nu, nu_dot, F)
    assert_allclose(found, tau, rtol=0, atol=1e-14 * scale)


@QUICK
@given(vehicles(), attitudes(), vectors(), vectors(largest=50.0), vectors(largest=50.0))
def test_F_stands_on_the_left(data, eta, nu, nu_dot, F):
    vehicle = vehicle_of(data)
    tau = vehicle.inverse_dynamics(eta, nu, nu_dot)
    with_F = vehicle.inverse_dynamics(eta, nu, nu_dot, F)
    assert_allclose(with_F - tau, F, rtol=0, atol=1e-14 * (1 + np.abs(tau).max()))
    slower = vehicle.forward_dynamics(eta, nu, tau, F) - vehicle.forward_dynamics(eta, nu, tau)
    assert F @ slower <= 1e-9 * (1 + np.abs(nu_dot).max())  # -F' M^-1 F


def agree(ours, theirs, scale=None) -> None:
    scale = max(np.abs(theirs).max() if scale is None else scale, 1e-300)
    assert_allclose(ours, theirs, rtol=0, atol=1e-12 * scale)


def check_against_reference(data: dict, eta: np.ndarray, nu: np.ndarray) -> None:
    vehicle, other = vehicle_of(data), reference.vehicle_matrices(data)
    for ours in ('M', 'M_RB', 'M_A', 'D_linear', 'D_quadratic', 'lift', 'r_G', 'r_B'):
        if getattr(vehicle, ours) is not None:
            agree(getattr(vehicle, ours), other[ours])
    assert vehicle.weight == pytest.approx(other['W'], rel=1e-12)
    assert vehicle.buoyancy == pytest.approx(other['B'], rel=1e-12)
    agree(vehicle.C(nu), reference.coriolis(other['M'], nu))
    agree(vehicle.D(nu), reference.damping(other, nu))
    agree(vehicle.g(eta), reference.restoring(other, eta), other['W'] + other['B'])


@QUICK
@given(vehicles(), attitudes(), vectors())
def test_random_vehicles_agree_with_the_reference(data, eta, nu):
    check_against_reference(data, eta, nu)


@pytest.mark.parametrize('name', ['herman2018', 'herman2018_neutral', 'rexrov', 'lauv'])
def test_shipped_vehicles_agree_with_the_reference(name):
    data = yaml.safe_load(shipped('vehicles', name).read_text(encoding='utf-8'))
    eta, nu = np.array([1, 2, 3, 0.4, -0.5, 2.6]), np.array([1.1, -0.5, 0.3, 0.2, -0.7, 0.4])
    check_against_reference(data, eta, nu)
