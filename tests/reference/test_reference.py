"""The reference checks itself: published numbers, energy, two forms of a current, kinematics."""

import herman_reference as reference
import numpy as np
import pytest
from numpy.testing import assert_allclose
from reference_cases import CONSTANT, DENSE_M_A, ERRORS, VARYING, file_of, off_centre, sphere


def states(n: int = 5):
    """(t, R, nu, tau), random."""
    one = np.random.default_rng(3)
    for _ in range(n):
        nu, tau = one.normal(size=6), 1000.0 * one.normal(size=6)
        yield one.uniform(0, 10), reference.rodrigues(2.0 * one.normal(size=3)), nu, tau


def test_coriolis_of_m2c():
    C = reference.coriolis(np.diag(np.arange(1.0, 7.0)), np.arange(1.0, 7.0))
    assert_allclose(C[:3, :3], np.zeros((3, 3)))
    assert_allclose(C[:3, 3:], [[0, 9, -4], [-9, 0, 1], [4, -1, 0]])
    assert_allclose(C[3:, :3], C[:3, 3:])
    assert_allclose(C[3:, 3:], [[0, 36, -25], [-36, 0, 16], [25, -16, 0]])


def test_munk_moment():
    M_A, nu = np.diag([5.0, 100.0, 100.0, 0.0, 10.0, 10.0]), np.array([1, 0.5, 0, 0, 0, 0])
    assert_allclose(-(reference.coriolis(M_A, nu) @ nu)[5], -47.5)
    assert_allclose(-reference.kirchhoff(M_A, nu)[5], -47.5)


def test_dense_added_mass():
    nu = np.array([1, -0.5, 0.3, 0.1, -0.2, 0.4])
    expected = [1.76, 3.08, 1.10, -2.512, -5.944, -3.719]
    assert_allclose(reference.coriolis(DENSE_M_A, nu) @ nu, expected, rtol=1e-12)
    assert_allclose(reference.kirchhoff(DENSE_M_A, nu), expected, rtol=1e-12)


def test_newton_euler_is_the_coriolis_force_of_the_rigid_body():
    M_RB = reference.vehicle_matrices(off_centre())['M_RB']
    for _, _, nu, _ in states():
        force = reference.coriolis(M_RB, nu) @ nu
        assert_allclose(reference.newton_euler(M_RB, nu), force, rtol=1e-11)


def test_restoring_forces():
    mats = {
        'W': 300.0,
        'B': 310.0,
        'r_G': np.array([0.01, 0.02, 0.03]),
        'r_B': np.array([-0.01, 0, -0.02]),
    }
    eta = np.array([0, 0, 0, -0.1, 0.2, 0.7])
    expected = [-1.986693308, -0.97843395, 9.751703272, -7.338241567, 8.968312824, -0.595171275]
    assert_allclose(reference.restoring(mats, eta), expected, atol=1e-9)
    R = reference.jacobian(eta)[:3, :3]
    assert_allclose(reference.restoring_from_rotation(mats, R), expected, atol=1e-9)


def test_rotation_and_rates_of_euler_angles():
    eta = np.array([0, 0, 0, 0.1, -0.2, 0.3])
    J = reference.jacobian(eta)
    R = [
        [0.936293364, -0.312991826, -0.159345079],
        [0.289629478, 0.944702486, -0.153791998],
        [0.198669331, 0.097843395, 0.975170327],
    ]
    T = [
        [1, -0.020237235, -0.20169733],
        [0, 0.995004165, -0.099833417],
        [0, 0.101863913, 1.015241401],
    ]
    assert_allclose(J[:3, :3], R, atol=1e-9)
    assert_allclose(J[3:, 3:], T, atol=1e-9)
    assert_allclose(reference.euler_angles(J[:3, :3]), eta[3:], atol=1e-14)
    z_y_x = [reference.rodrigues(a * e) for a, e in zip([0.1, -0.2, 0.3], np.eye(3), strict=True)]
    assert_allclose(z_y_x[2] @ z_y_x[1] @ z_y_x[0], R, atol=1e-9)


def test_kinetic_energy_of_case_1():
    vehicle = file_of('herman2018')
    run = reference.simulate(vehicle, file_of('case1', 'scenarios'), 'gvc', 'continuous', 10.0)
    U, N = reference.decompose(reference.vehicle_matrices(vehicle)['M'])
    assert_allclose(np.diag(N), [300, 500, 500, 39.988, 175.5, 141.114], atol=5e-4)
    total, parts = reference.kinetic_energy(N, U, run['nu'])
    assert_allclose(total.mean(), 528.18, atol=0.01)
    shares = 100 * parts.mean(axis=0) / total.mean()
    assert_allclose(shares, [22.57, 0.0, 77.34, 0.006, 0.0, 0.081], atol=0.006)
    error = np.abs(run['nu_d'] - run['nu'])[200:].max(axis=0)
    assert_allclose(error[[0, 2, 4]], [0.0003, 0.0039, 0.0005], atol=5e-5)


def test_power_balance():
    for mats, plant in (
        (reference.vehicle_matrices(off_centre()), reference.Plant(off_centre(), None)),
        (reference.plant_matrices(off_centre(), [ERRORS]), reference.Plant(off_centre(), ERRORS)),
    ):
        for t, R, nu, tau in states():
            nu_dot = plant.acceleration(t, R, nu, tau)
            sink = [R[2] @ (nu[:3] + np.cross(nu[3:], mats[key])) for key in ('r_G', 'r_B')]
            potential = -mats['W'] * sink[0] + mats['B'] * sink[1]
            lost = nu @ reference.damping(mats, nu) @ nu
            power = nu @ mats['M'] @ nu_dot + potential + lost
            assert_allclose(power, nu @ tau, rtol=1e-10)


@pytest.mark.parametrize('spec', [[CONSTANT], [VARYING], [CONSTANT, ERRORS, VARYING]])
def test_two_forms_of_a_current_agree(spec):
    split = reference.Plant(off_centre(), spec)
    relative = reference.Plant(off_centre(), spec, form='relative')
    still = reference.Plant(off_centre(), [item for item in spec if item is ERRORS])
    assert (split.form, relative.form) == ('split', 'relative')
    for state in states():
        found = split.acceleration(*state)
        assert_allclose(found, relative.acceleration(*state), atol=1e-11)
        assert np.abs(found - still.acceleration(*state)).max() > 0.1


def test_dM_is_of_the_relative_velocity_in_both_forms():
    spec = [CONSTANT, {'kind': 'model_error', 'dM': (5.0 * DENSE_M_A).tolist(), 'dD': [50.0] * 6}]
    split = reference.Plant(off_centre(), spec)
    relative = reference.Plant(off_centre(), spec, form='relative')
    for state in states():
        assert_allclose(split.acceleration(*state), relative.acceleration(*state), atol=1e-11)


def test_what_drifts_with_the_water_keeps_its_velocity_over_ground():
    plant = reference.Plant(sphere(), [CONSTANT])
    for t, R, nu, _ in states():
        nu[:3] = R.T @ CONSTANT['velocity']
        nu_dot = plant.acceleration(t, R, nu, np.zeros(6))
        assert_allclose(nu_dot, [*-np.cross(nu[3:], nu[:3]), 0, 0, 0], atol=1e-12)


def test_an_accelerating_current_pulls_by_the_added_mass():
    plant = reference.Plant(sphere(mass=10.0, added=5.0), [VARYING])
    for t, R, nu, _ in states():
        nu[3:] = 0.0
        v_c_dot = reference.current([VARYING], t)[1]
        nu_dot = plant.acceleration(t, R, nu, np.zeros(6))
        assert_allclose(nu_dot[:3], 5.0 / 15.0 * R.T @ v_c_dot, atol=1e-12)


def test_derivative_of_a_current():
    ahead, behind = (reference.current([VARYING, CONSTANT], 2.0 + d)[0] for d in (1e-6, -1e-6))
    value, rate = reference.current([VARYING, CONSTANT], 2.0)
    assert_allclose(rate, (ahead - behind) / 2e-6, atol=1e-8)
    east = 2 * -0.3 + 0.1 + 0.4 * np.sin(0.7 * 2.0 + 0.3)
    assert_allclose(value, [1.0, east, 0.4 + 0.2 * np.sin(2.6)], rtol=1e-14)


def test_errors_of_several_entries_add():
    one = {'kind': 'model_error', 'mass': 0.1, 'dM': [1.0] * 6, 'damping': 0.2}
    other = {'kind': 'model_error', 'mass': 0.2, 'dM': 2.0, 'dD': [3.0] * 6}
    file = reference.vehicle_matrices(off_centre())
    mats = reference.plant_matrices(off_centre(), [one, other])
    assert_allclose(mats['M'], 1.3 * file['M_RB'] + file['M_A'] + 3.0 * np.eye(6))
    assert_allclose(mats['W'], 1.3 * file['W'])
    assert_allclose(mats['D_linear'], 1.2 * file['D_linear'] + 3.0 * np.eye(6))
    assert_allclose(mats['D_quadratic'], 1.2 * file['D_quadratic'])
    assert mats['B'] == file['B']


@pytest.mark.parametrize(
    ('name', 'spec', 'message'),
    [
        ('herman2018', {'kind': 'model_error', 'mass': 0.1}, 'inertia_matrix'),
        ('herman2018', VARYING, 'needs M_RB'),
        ('rexrov', [VARYING, {'kind': 'model_error', 'dM': 1.0}], 'split of dM'),
        ('rexrov', {'kind': 'model_error', 'dM': np.tri(6).tolist()}, 'symmetric'),
        ('rexrov', {'kind': 'model_error', 'mas': 0.1}, 'mas'),
        ('rexrov', {'kind': 'model_error', 'dM': -1e6}, 'positive definite'),
        ('rexrov', {'kind': 'waves'}, "'waves' is not covered"),
    ],
)
def test_refused_disturbances(name, spec, message):
    with pytest.raises(ValueError, match=message):
        reference.Plant(file_of(name), spec)


def test_scale_multiplies_from_the_left():
    plain = reference.disturbance({'kind': 'herman2018'}, 1.0)
    scale = np.arange(36.0).reshape(6, 6)
    for value, expected in ((0.5, 0.5 * plain), ([1, 2, 3, 4, 5, 6], plain * np.arange(1, 7)),
                            (scale.tolist(), scale @ plain)):  # fmt: skip
        found = reference.disturbance({'kind': 'herman2018', 'scale': value}, 1.0)
        assert_allclose(found, expected, rtol=1e-14)
