"""Small bodies on a vehicle: against kinetic energy, and thin spheroids."""

import numpy as np
import pytest
from helpers.strategies import QUICK, vectors
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_analysis.studies.design.change import (
    disc_added_mass,
    disc_drag,
    disc_mass,
    normal_of,
    point_mass,
)

RHO = 1025.0
angles = st.floats(-90.0, 90.0)


@QUICK
@given(st.floats(0.1, 100.0), vectors(3), vectors())
def test_a_point_mass_has_the_energy_of_its_velocity(mass, r, nu):
    v = nu[:3] + np.cross(nu[3:], r)
    assert nu @ point_mass(mass, r) @ nu == pytest.approx(mass * v @ v, rel=1e-9, abs=1e-9)


def test_point_masses_have_leading_axes():
    r = np.arange(6.0).reshape(2, 3)
    both = point_mass(np.array([1.0, 2.0]), r)
    assert_allclose(both[1], point_mass(2.0, r[1]))
    assert_allclose(point_mass(2.0, r)[1], both[1])


@QUICK
@given(angles, angles)
def test_the_normal_has_length_1(azimuth, elevation):
    assert np.linalg.norm(normal_of(azimuth, elevation)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ('azimuth', 'elevation', 'normal'), [(0, 0, (1, 0, 0)), (90, 0, (0, 1, 0)), (0, 90, (0, 0, 1))]
)
def test_the_normal_turns_from_surge_to_sway_and_to_heave(azimuth, elevation, normal):
    found = normal_of(np.float64(azimuth), np.float64(elevation))
    assert_allclose(found, normal, atol=1e-15)


def spheroid(a, c):
    """Added mass along the short axis and added inertia about a long one: Lamb's integrals."""
    e = np.sqrt(1 - (c / a) ** 2)
    along = 2 / e**2 * (1 - np.sqrt(1 - e**2) / e * np.arcsin(e))
    across = np.sqrt(1 - e**2) / e**3 * np.arcsin(e) - (1 - e**2) / e**2
    mass = 4 / 3 * np.pi * RHO * a**2 * c
    apart, together = a**2 - c**2, a**2 + c**2
    turned = apart**2 * (along - across) / (2 * apart - together * (along - across))
    return mass * along / (2 - along), mass / 5 * turned


def test_a_disc_is_the_limit_of_thin_spheroids():
    mass, inertia = spheroid(0.4, 0.4e-5)
    M_A = disc_added_mass(np.float64(0.4), np.zeros(3), np.array([0.0, 0.0, 1.0]), RHO)
    assert_allclose(np.diag(M_A), [0, 0, mass, inertia, inertia, 0], rtol=1e-4)
    assert disc_mass(0.4, RHO) == pytest.approx(mass, rel=1e-4)


@QUICK
@given(st.floats(0.01, 1.0), vectors(3), angles, angles, vectors())
def test_a_disc_takes_energy_to_move_and_to_drag(radius, r, azimuth, elevation, nu):
    normal = normal_of(azimuth, elevation)
    M_A = disc_added_mass(np.float64(radius), r, normal, RHO)
    assert_allclose(M_A, M_A.T)
    assert np.linalg.eigvalsh(M_A)[0] >= -1e-9 * np.abs(M_A).max()
    broadside = normal @ (nu[:3] + np.cross(nu[3:], r))
    turned = nu[3:] - normal * (normal @ nu[3:])
    energy = disc_mass(radius, RHO) * broadside**2 + 16 / 45 * RHO * radius**5 * turned @ turned
    assert nu @ M_A @ nu == pytest.approx(energy, rel=1e-6, abs=1e-9)
    assert (disc_drag(np.float64(radius), r, normal, RHO) >= 0).all()


@pytest.mark.parametrize('dof', range(6))
def test_the_drag_of_a_disc_is_exact_for_one_degree_of_freedom(dof):
    r, normal, speed = np.array([-0.5, 0.2, 0.3]), normal_of(20.0, -50.0), 0.7
    nu = speed * np.eye(6)[dof]
    broadside = normal @ (nu[:3] + np.cross(nu[3:], r))
    force = 0.5 * RHO * 1.17 * np.pi * 0.3**2 * abs(broadside) * broadside * normal
    wrench = np.concatenate([force, np.cross(r, force)])
    drag = disc_drag(np.float64(0.3), r, normal, RHO)[dof] * speed**2
    assert drag == pytest.approx(wrench[dof])
