"""Couplings (31) to (34): what the others add to a degree of freedom, and structural zeros."""

import herman_reference as reference
import numpy as np
import pytest
from helpers.strategies import QUICK, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.metrics.coupling import (
    Products,
    coupling_terms,
    delta_pi,
    delta_xi,
    input_deformation,
    structural_zeros,
    velocity_deformation,
)
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.laws.model import decompose, inverse_upper

SURGE, SWAY, HEAVE, ROLL, PITCH, YAW = DOFS
NU = np.array([1.1, -0.7, 0.4, 0.9, -1.3, 0.6])


def factors(vehicle):
    Upsilon, _ = decompose(vehicle.M)
    return Upsilon, inverse_upper(Upsilon)


@QUICK
@given(vehicles(), vectors(), vectors(largest=500.0))
def test_by_the_definitions(data, nu, tau):
    vehicle = vehicle_from_dict(data, 'f')
    Upsilon, inverse = factors(vehicle)
    U, _ = reference.decompose(vehicle.M)
    xi, pi = np.linalg.solve(U, nu), U.T @ tau
    assert_allclose(delta_xi(inverse, nu), xi - nu, atol=1e-10 * (1 + np.abs(xi).max()))
    assert_allclose(delta_pi(Upsilon, tau), pi - tau, atol=1e-10 * (1 + np.abs(pi).max()))
    # the power of the wrench does not depend on the coordinates
    power = (pi @ xi, (tau + delta_pi(Upsilon, tau)) @ (nu + delta_xi(inverse, nu)))
    for value in power:
        assert value == pytest.approx(tau @ nu, rel=1e-8, abs=1e-8 * np.abs(tau * nu).sum() + 1e-9)


@QUICK
@given(vehicles(), vectors())
def test_the_generalised_components_carry_all_of_the_energy(data, nu):
    vehicle = vehicle_from_dict(data, 'f')
    Upsilon, N = decompose(vehicle.M)
    xi = nu + delta_xi(inverse_upper(Upsilon), nu)
    assert 0.5 * N @ xi**2 == pytest.approx(0.5 * nu @ vehicle.M @ nu, rel=1e-10, abs=1e-12)


def test_delta_xi_of_the_papers_vehicle():
    _, inverse = factors(load_vehicle('herman2018'))
    p, q, r = NU[3:]
    found = delta_xi(inverse, NU)
    assert_allclose(found[:3], [0.025 * q, -0.015 * p + 0.075 * r, -0.075 * q], atol=1e-14)
    assert found[3] == pytest.approx(0.514 * r, rel=1e-3)
    assert_array_equal(found[4:], [0.0, 0.0])
    other = delta_xi(inverse, np.array([5.0, -5.0, 5.0, p, q, r]))  # u, v, w deform nothing
    assert_allclose(other, found, atol=1e-14)


def test_delta_pi_of_the_papers_vehicle():
    Upsilon, _ = factors(load_vehicle('herman2018'))
    X, Y, Z, K = 10.0, 20.0, 30.0, 4.0
    roll_yaw = -(20.0 + 7.5 * 37.5 / 500.0) / (40.1 - 7.5**2 / 500.0)
    expected = [0, 0, 0, 0.015 * Y, -0.025 * X + 0.075 * Z,
                (-0.075 - 0.015 * -roll_yaw) * Y + roll_yaw * K]  # fmt: skip
    assert_allclose(delta_pi(Upsilon, np.array([X, Y, Z, K, 5.0, 6.0])), expected, atol=1e-12)


def test_structural_zeros_of_the_papers_vehicle():
    assert structural_zeros(factors(load_vehicle('herman2018'))[0]) == {
        'delta_xi': [PITCH, YAW],
        'delta_pi': [SURGE, SWAY, HEAVE],
    }


def test_every_vehicle_has_two_structural_zeros():
    zeros = structural_zeros(factors(load_vehicle('rexrov'))[0])
    assert zeros == {'delta_xi': [YAW], 'delta_pi': [SURGE]}


def test_a_diagonal_inertia_has_nothing_but_structural_zeros():
    Upsilon, _ = decompose(np.diag([1.0, 2, 3, 4, 5, 6]))
    inverse = inverse_upper(Upsilon)
    assert structural_zeros(Upsilon) == {'delta_xi': list(DOFS), 'delta_pi': list(DOFS)}
    assert not delta_xi(inverse, NU).any()
    assert not delta_pi(Upsilon, NU).any()


@pytest.mark.parametrize('name', ['herman2018', 'herman2018_neutral', 'rexrov'])
def test_what_is_called_a_structural_zero_vanishes_for_every_motion_and_nothing_else(name):
    Upsilon, inverse = factors(load_vehicle(name))
    zeros = structural_zeros(Upsilon)
    many = np.random.default_rng(3).normal(size=(50, 6))
    for key, values in (
        ('delta_xi', delta_xi(inverse, many)),
        ('delta_pi', delta_pi(Upsilon, many)),
    ):
        peak = np.abs(values).max(axis=0)
        silent = [dof for dof, size in zip(DOFS, peak, strict=True) if size < 1e-9]
        assert zeros[key] == silent


def test_many_samples_at_once():
    Upsilon, inverse = factors(load_vehicle('rexrov'))
    many = np.random.default_rng(2).normal(size=(7, 6))
    for function, matrix in ((delta_xi, inverse), (delta_pi, Upsilon)):
        whole = function(matrix, many)
        assert_allclose(whole, [function(matrix, one) for one in many], atol=1e-14)


def pieces(weights, signals):
    """What signal j adds to component i, (31) and (32): signals (..., 6) to (..., 6, 6)."""
    return weights * signals[..., np.newaxis, :]


@QUICK
@given(vehicles(), vectors(), vectors(largest=500.0))
def test_the_pieces_add_up_to_the_deformations(data, nu, tau):
    Upsilon, inverse = factors(vehicle_from_dict(data, 'f'))
    xi, pi = pieces(velocity_deformation(inverse), nu), pieces(input_deformation(Upsilon), tau)
    for parts, whole in ((xi, delta_xi(inverse, nu)), (pi, delta_pi(Upsilon, tau))):
        scale = np.abs(parts).sum()
        assert_allclose(parts.sum(axis=-1), whole, rtol=0, atol=1e-14 * scale)
    # (31): xi_i = nu_i + the pieces of j > i; (32): pi_i = tau_i + those of j < i
    assert not np.tril(xi).any()
    assert not np.triu(pi).any()
    assert_allclose(nu + xi.sum(axis=-1), inverse @ nu, atol=1e-12 * (1 + np.abs(xi).sum()))
    assert_allclose(tau + pi.sum(axis=-1), Upsilon.T @ tau, atol=1e-12 * (1 + np.abs(pi).sum()))


@QUICK
@given(vehicles())
def test_terms_are_the_figures_of_the_pieces(data):
    _, inverse = factors(vehicle_from_dict(data, 'f'))
    weights = velocity_deformation(inverse)
    nu = np.random.default_rng(4).normal(size=(50, 6))
    products = Products()
    for block in (nu[:17], nu[17:17], nu[17:]):
        products.add(block)
    terms = coupling_terms(weights, products)
    parts, whole = pieces(weights, nu), delta_xi(inverse, nu)
    for term in terms:
        i, j = DOFS.index(term['to']), DOFS.index(term['from'])
        assert term['coefficient'] == weights[i, j]
        assert term['rms'] == pytest.approx(np.sqrt((parts[:, i, j] ** 2).mean()))
        assert term['max'] == pytest.approx(np.abs(parts[:, i, j]).max())
        share = 100.0 * (parts[:, i, j] * whole[:, i]).mean() / (whole[:, i] ** 2).mean()
        scale = sum(abs(t['share_percent']) for t in terms if t['to'] == term['to'])
        assert term['share_percent'] == pytest.approx(share, abs=1e-9 * scale)
    for dof in {term['to'] for term in terms}:
        shares = [term['share_percent'] for term in terms if term['to'] == dof]
        assert sum(shares) == pytest.approx(100.0, abs=1e-9 * np.abs(shares).sum())


def test_terms_of_a_vehicle_at_rest_have_no_shares():
    _, inverse = factors(load_vehicle('rexrov'))
    products = Products()
    products.add(np.zeros((3, 6)))
    terms = coupling_terms(velocity_deformation(inverse), products)
    assert len(terms) == 15
    assert {(term['rms'], term['max'], term['share_percent']) for term in terms} == {
        (0.0, 0.0, None)
    }
