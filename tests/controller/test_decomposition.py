"""M = Upsilon^-T N Upsilon^-1: the factors' form, their product, and what is refused."""

import herman_reference as reference
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from strategies import QUICK, positive_definite, vectors, vehicles

from auv_dynamics import load_vehicle
from auv_dynamics.vehicle_file import vehicle_from_dict
from auv_gvc_controller import decompose
from auv_gvc_controller.decomposition import inverse_upper
from auv_gvc_controller.model import control_model


def check_form(Upsilon: np.ndarray, N: np.ndarray) -> None:
    assert_array_equal(Upsilon, np.triu(Upsilon))
    assert_array_equal(np.diagonal(Upsilon), np.ones(6))
    assert N.shape == (6,)
    assert (N > 0).all()


def product(Upsilon: np.ndarray, N: np.ndarray) -> np.ndarray:
    inverse = np.linalg.inv(Upsilon)
    return inverse.T @ np.diag(N) @ inverse


@QUICK
@given(vehicles())
def test_of_random_vehicles(data):
    M = vehicle_from_dict(data, 'f').M
    Upsilon, N = decompose(M)
    check_form(Upsilon, N)
    assert_allclose(product(Upsilon, N), M, rtol=0, atol=1e-12 * np.abs(M).max())
    theirs, N_theirs = reference.decompose(M)
    assert_allclose(Upsilon, theirs, rtol=0, atol=1e-11 * np.abs(theirs).max())
    assert_allclose(N, np.diagonal(N_theirs), rtol=1e-10)


@QUICK
@given(positive_definite(), vectors())
def test_kinetic_energy_is_that_of_the_components(M, nu):
    Upsilon, N = decompose(M)
    xi = np.linalg.solve(Upsilon, nu)  # nu = Upsilon xi, (4)
    assert 0.5 * N @ xi**2 == pytest.approx(0.5 * nu @ M @ nu, rel=1e-10, abs=1e-12)
    assert_allclose(Upsilon.T @ M @ Upsilon, np.diag(N), atol=1e-11 * np.abs(M).max())  # (9)


@QUICK
@given(st.floats(0.0, 8.0), st.integers(0, 10_000))
def test_of_badly_conditioned_inertia(digits, seed):
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(6, 6)))
    M = Q @ np.diag(np.logspace(0.0, -digits, 6)) @ Q.T
    M = (M + M.T) / 2
    Upsilon, N = decompose(M)
    check_form(Upsilon, N)
    assert_allclose(product(Upsilon, N), M, rtol=0, atol=1e-10)


def test_condition_number_1e8_itself():
    scale = np.logspace(0, 4, 6)
    M = (np.eye(6) + 0.1) * np.outer(scale, scale)
    assert np.linalg.cond(M) > 1e8
    Upsilon, N = decompose(M)
    check_form(Upsilon, N)
    assert_allclose(product(Upsilon, N), M, rtol=1e-12)


def test_of_the_papers_vehicle():
    Upsilon, N = decompose(load_vehicle('herman2018').M)
    assert_allclose(N, [300, 500, 500, 39.988, 175.5, 141.114], atol=5e-4)
    expected = np.eye(6)  # the inverse of what equations.md says of delta_xi
    expected[0, 4], expected[1, 3], expected[1, 5], expected[2, 4] = 0.025, -0.015, 0.075, -0.075
    expected[3, 5] = (20.0 + 7.5 * 37.5 / 500.0) / (40.1 - 7.5**2 / 500.0)
    assert expected[3, 5] == pytest.approx(0.514, abs=5e-4)
    assert_allclose(np.linalg.inv(Upsilon), expected, atol=1e-14)


def test_a_diagonal_inertia_leaves_everything_as_it_is():
    Upsilon, N = decompose(np.diag([1.0, 20.0, 300.0, 4.0, 50.0, 6.0]))
    assert_array_equal(Upsilon, np.eye(6))
    assert_allclose(N, [1, 20, 300, 4, 50, 6], rtol=1e-15)


@QUICK
@given(vehicles())
def test_inverse_upper_inverts_and_keeps_the_form(data):
    vehicle = vehicle_from_dict(data, 'f')
    Upsilon, _ = decompose(vehicle.M)
    inverse = inverse_upper(Upsilon)
    assert_array_equal(inverse, np.triu(inverse))
    assert_array_equal(np.diagonal(inverse), np.ones(6))
    assert_allclose(inverse @ Upsilon, np.eye(6), atol=1e-11)
    model = control_model(vehicle)
    assert_array_equal(model.Upsilon.reshape(6, 6), Upsilon)
    assert_array_equal(model.Upsilon_inv.reshape(6, 6), inverse)


def test_the_argument_is_not_changed():
    M = load_vehicle('rexrov').M.copy()
    before = M.copy()
    decompose(M)
    assert_array_equal(M, before)


def broken(i: int, j: int, value: float) -> np.ndarray:
    M = 10.0 * np.eye(6)
    M[i, j] = value
    return M


@pytest.mark.parametrize(
    ('M', 'line'),
    [
        (np.eye(5), r'expected a finite \(6, 6\) matrix M, found shape \(5, 5\)'),
        (broken(2, 2, np.nan), r'expected a finite \(6, 6\) matrix M'),
        (broken(2, 2, np.inf), r'expected a finite \(6, 6\) matrix M'),
        (broken(0, 3, 1e-6), r'expected a symmetric M, found M\[i\]\[j\] != M\[j\]\[i\]'),
        (broken(4, 4, -0.5), 'expected a positive definite M, found smallest eigenvalue -0.5'),
        (broken(4, 4, 0.0), 'expected a positive definite M, found smallest eigenvalue 0'),
    ],
)
def test_what_is_no_inertia_is_refused(M, line):
    with pytest.raises(ValueError, match=line):
        decompose(M)
