"""The measures of the atlas: without units, and what they say of energies."""

import numpy as np
import pytest
from helpers.strategies import QUICK, positive_definite, vectors
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.metrics.energy import kinetic_energy
from auv_analysis.studies.atlas.atlas import (
    coupling_strength,
    couplings_of,
    inertial_correlation,
    input_shares,
    velocity_shares,
)
from auv_dynamics import load_vehicle
from auv_gvc_controller.laws.model import decompose, inverse_upper

MEASURES = (inertial_correlation, velocity_shares, input_shares, coupling_strength)
SCALES = arrays(float, 6, elements=st.floats(-3, 3)).map(lambda powers: 10.0**powers)
SOME = 1e-9  # of a share: rounding of the decomposition


@pytest.mark.parametrize('measure', MEASURES)
@QUICK
@given(positive_definite(), SCALES)
def test_no_unit_changes_a_measure(measure, M, scale) -> None:
    """Other units of length, mass or angle multiply rows and columns of M."""
    assert_allclose(measure(scale[:, None] * M * scale), measure(M), rtol=1e-7, atol=SOME)


def test_feet_and_pounds_leave_the_measures_of_a_vehicle() -> None:
    M = load_vehicle('rexrov').M
    foot, pound = 0.3048, 0.45359237
    length = np.array([1.0, 1.0, 1.0, 1 / foot, 1 / foot, 1 / foot])  # kg m to lb ft
    for measure in MEASURES:
        assert_allclose(measure(length[:, None] * M * length / pound), measure(M), atol=SOME)


@QUICK
@given(positive_definite(), st.integers(0, 5))
def test_velocity_shares_are_those_of_the_energy_of_one_motion(M, j) -> None:
    Upsilon, N = decompose(M)
    nu = np.zeros(6)
    nu[j] = 0.7
    parts = kinetic_energy(inverse_upper(Upsilon), N, nu)
    assert parts.sum() == pytest.approx(0.5 * M[j, j] * 0.49)
    assert_allclose(velocity_shares(M)[:, j], parts / parts.sum(), atol=SOME)


@QUICK
@given(positive_definite(), st.integers(0, 5))
def test_input_shares_are_those_of_the_energy_after_an_impulse(M, j) -> None:
    Upsilon, N = decompose(M)
    nu = np.linalg.solve(M, np.eye(6)[j])
    parts = kinetic_energy(inverse_upper(Upsilon), N, nu)
    assert_allclose(input_shares(M)[:, j], parts / parts.sum(), atol=1e-7)


@QUICK
@given(positive_definite())
def test_shares_are_triangular_and_sum_to_one(M) -> None:
    velocity, wrench = velocity_shares(M), input_shares(M)
    assert_allclose(velocity.sum(axis=0), 1.0)
    assert_allclose(wrench.sum(axis=0), 1.0)
    assert_array_equal(velocity, np.triu(velocity))
    assert_array_equal(wrench, np.tril(wrench))


def cross_over_diagonal(M, nu):
    own = 0.5 * np.diagonal(M) @ nu**2
    return (0.5 * nu @ M @ nu - own) / own


@QUICK
@given(positive_definite(), vectors())
def test_no_motion_has_larger_cross_terms_than_the_strength(M, nu) -> None:
    if np.abs(nu).max() > 1e-3:
        assert abs(cross_over_diagonal(M, nu)) <= coupling_strength(M) + SOME


@QUICK
@given(positive_definite())
def test_a_motion_reaches_the_strength(M) -> None:
    values, vectors_ = np.linalg.eigh(inertial_correlation(M))
    i = 5 if values[5] - 1 > 1 - values[0] else 0
    nu = vectors_[:, i] / np.sqrt(np.diagonal(M))
    assert abs(cross_over_diagonal(M, nu)) == pytest.approx(coupling_strength(M))
    assert coupling_strength(M) >= np.abs(np.triu(inertial_correlation(M), 1)).max() - SOME


@QUICK
@given(positive_definite(), st.sampled_from([(0, 4), (1, 3), (3, 5)]))
def test_correlation_is_the_cross_term_of_equal_energies(M, pair) -> None:
    i, j = pair
    nu = np.zeros(6)
    nu[i], nu[j] = 1 / np.sqrt(M[i, i]), 1 / np.sqrt(M[j, j])
    assert cross_over_diagonal(M, nu) == pytest.approx(inertial_correlation(M)[i, j], abs=SOME)
    nu[j] *= -1.0
    assert cross_over_diagonal(M, nu) == pytest.approx(-inertial_correlation(M)[i, j], abs=SOME)


def test_a_diagonal_inertia_couples_nothing() -> None:
    found = couplings_of(load_vehicle('lauv'), 'lauv')
    assert found.is_diagonal
    assert (found.strength, found.largest, found.pairs) == (0.0, 0.0, [])
    assert_array_equal(found.velocity_shares, np.eye(6))
    assert found.damped == [('sway', 'yaw'), ('heave', 'pitch')]
    lifted = load_vehicle('lauv')
    own = {key: np.diag(np.diag(getattr(lifted, key))) for key in ('D_linear', 'D_quadratic')}
    assert couplings_of(lifted.changed(**own), 'lauv').damped == found.damped, 'by lift alone'
    assert couplings_of(lifted.changed(**own, lift=None), 'lauv').damped == []


def test_the_couplings_of_the_papers_vehicle() -> None:
    found = couplings_of(load_vehicle('herman2018'), 'herman2018')
    assert found.pairs[0] == ('roll', 'yaw')
    assert found.correlation[3, 5] == pytest.approx(20 / np.sqrt(40.1 * 154.5))
    assert found.correlation[1, 3] == pytest.approx(-250 * 0.03 / np.sqrt(500 * 40.1))
    assert found.velocity_shares[1, 5] == pytest.approx(500 * 0.075**2 / 154.5)
    assert_allclose(found.input_shares, input_shares(found.M), atol=1e-12)
    assert set(found.pairs) == {
        ('roll', 'yaw'), ('sway', 'yaw'), ('heave', 'pitch'), ('sway', 'roll'), ('surge', 'pitch'),
    }  # fmt: skip
