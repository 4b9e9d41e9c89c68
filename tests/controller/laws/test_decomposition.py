"""M = Upsilon^-T N Upsilon^-1: the factors' form, their product, and what is refused."""

from fractions import Fraction

import herman_reference as reference
import numpy as np
import pytest
from helpers.strategies import QUICK, positive_definite, vectors, vehicles
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller import decompose
from auv_gvc_controller.laws.model import control_model, inverse_upper


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
def test_the_factors_have_their_form(data):
    check_form(*decompose(vehicle_from_dict(data, 'f').M))


@QUICK
@given(vehicles())
def test_the_product_of_the_factors_is_M(data):
    M = vehicle_from_dict(data, 'f').M
    assert_allclose(product(*decompose(M)), M, rtol=0, atol=1e-12 * np.abs(M).max())


@QUICK
@given(vehicles())
def test_the_factors_agree_with_the_reference(data):
    M = vehicle_from_dict(data, 'f').M
    Upsilon, N = decompose(M)
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


@st.composite
def badly_conditioned(draw: st.DrawFn) -> np.ndarray:
    """(6, 6) of any orientation, or of entries of very different size, condition up to 1e8."""
    spread = np.logspace(0.0, -draw(st.floats(0.0, 8.0)), 6)
    generator = np.random.default_rng(draw(st.integers(0, 10_000)))
    Q, _ = np.linalg.qr(generator.normal(size=(6, 6)))
    size = generator.permutation(spread)
    if draw(st.booleans()):
        M = Q @ np.diag(size) @ Q.T
    else:
        M = np.outer(np.sqrt(size), np.sqrt(size)) * (np.eye(6) + 0.3 * np.cos(Q + Q.T))
    return (M + M.T) / 2


def check_accuracy(M: np.ndarray) -> None:
    """Factors as accurate as their equations allow, whatever the condition of M.

    Cholesky's factor L is that of a matrix within (n + 1) eps abs(L) N abs(L^T) of M (Higham,
    Accuracy and Stability of Numerical Algorithms, 2002, theorem 10.3), and its inverse by
    substitution has a residual of at most n eps abs(Upsilon^-1) abs(Upsilon) (theorem 8.5 and
    section 14.2). So in U^T M U = N, computed by the test with n products each, no entry is
    further off than some 4 n eps of the sums of absolute values that cancel there; and the product
    Upsilon^-T N Upsilon^-1, with the inverse taken a second time, is off M by a few n eps times
    the (componentwise) condition of Upsilon, a small number beside that of M.
    """
    n_eps = 6 * np.finfo(float).eps
    Upsilon, N = decompose(M)
    check_form(Upsilon, N)
    off = np.abs(Upsilon.T @ M @ Upsilon - np.diag(N))
    assert (off <= 4 * n_eps * (np.abs(Upsilon).T @ np.abs(M) @ np.abs(Upsilon))).all()
    inverse = inverse_upper(Upsilon)
    error = np.linalg.norm(inverse.T @ np.diag(N) @ inverse - M, 2)
    condition = np.linalg.norm(np.abs(inverse) @ np.abs(Upsilon), 2)
    assert error <= 2 * n_eps * condition * np.linalg.norm(M, 2)
    assert error <= 1e-12 * np.linalg.norm(M, 2)


@QUICK
@given(badly_conditioned())
def test_of_badly_conditioned_inertia(M):
    check_accuracy(M)


@pytest.mark.parametrize('seed', range(10))
def test_condition_number_1e8_of_any_orientation(seed):
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(6, 6)))
    M = Q @ np.diag(np.logspace(4.0, -4.0, 6)) @ Q.T
    M = (M + M.T) / 2
    assert np.linalg.cond(M) == pytest.approx(1e8, rel=1e-3)
    check_accuracy(M)


def test_condition_number_1e8_by_the_size_of_the_entries():
    scale = np.logspace(0, 4, 6)
    M = (np.eye(6) + 0.1) * np.outer(scale, scale)
    assert np.linalg.cond(M) > 1e8
    check_accuracy(M)
    Upsilon, N = decompose(M)
    assert_allclose(product(Upsilon, N), M, rtol=1e-12)


def exact(M: np.ndarray) -> tuple[list[list[Fraction]], list[Fraction]]:
    """Upsilon^-1 and N in rational numbers: Lagrange's completion of squares of nu' M nu."""
    A = [[Fraction(float(entry)) for entry in row] for row in M]
    U_inv, N = [], []
    for k in range(6):
        N.append(A[k][k])
        row = [A[k][j] / A[k][k] if j >= k else Fraction(0) for j in range(6)]
        for i in range(k, 6):
            for j in range(k, 6):
                A[i][j] -= N[k] * row[i] * row[j]
        U_inv.append(row)
    return U_inv, N


@QUICK
@given(badly_conditioned())
def test_against_rational_arithmetic(M):
    Upsilon, N = decompose(M)
    U_inv, N_exact = exact(M)
    # N_k is 1 over an entry of an inverse: its relative error is at most that of the condition
    bound = 4 * 6 * np.finfo(float).eps * np.linalg.cond(M)
    assert_allclose(N, [float(x) for x in N_exact], rtol=bound)
    expected = np.array([[float(x) for x in row] for row in U_inv])
    assert_allclose(inverse_upper(Upsilon), expected, rtol=0, atol=bound * np.abs(expected).max())


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
