"""Parametrisation: any theta is a physical vehicle, and back; small rotations; names."""

import numpy as np
import pytest
from helpers.strategies import QUICK, attitudes, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose

from auv_analysis.studies.identify.record import continuous, rotated, small_rotation
from auv_analysis.studies.identify.unknowns import DEFAULT, unknowns
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.vehicle_file import load_vehicle, vehicle_from_dict

EVERY = (*DEFAULT, 'gain', 'bias', 'current', 'D_linear.full', 'D_quadratic.full')


def made(vehicle, free=EVERY, fixed=(), **others):
    return unknowns(
        vehicle, free, fixed, speeds=np.full(6, 0.3), wrenches=np.full(6, 20.0), **others
    )


@QUICK
@given(vehicles(), vectors(120, largest=2.0))
def test_theta_is_a_vehicle_and_back(data, numbers):
    u = made(vehicle_from_dict(data, 'drawn'), lag=0.1)
    theta = numbers[: len(u.entries)]
    found = u.coefficients(theta)
    assert_allclose(found.M, found.M.T, rtol=1e-14, atol=1e-12 * np.abs(found.M).max())
    assert np.linalg.eigvalsh(found.M)[0] > 0
    assert found.lag > 0
    assert np.all(found.gain > 0)
    assert_allclose(u.theta(found), theta, atol=1e-6)


def test_theta_zero_is_the_prior():
    vehicle = load_vehicle('herman2018')
    found = made(vehicle).coefficients(np.zeros(len(made(vehicle).entries)))
    assert_allclose(found.M, vehicle.M, atol=1e-9)
    assert_allclose(found.D_quadratic, vehicle.D_quadratic)
    assert_allclose(found.hydrostatics, vehicle.model.hydrostatics)


@QUICK
@given(attitudes(), vectors(3, largest=0.02))
def test_a_small_rotation_leads_from_one_attitude_to_the_other(eta, by):
    q = quaternion(eta[3:])
    assert_allclose(small_rotation(q, rotated(q, by)), by, atol=1e-5)
    assert_allclose(small_rotation(q, -rotated(q, by)), by, atol=1e-5)


def test_quaternions_whose_signs_jump_are_made_continuous():
    q = quaternion(np.stack([np.zeros(50), np.zeros(50), np.linspace(0, 9, 50)], axis=1))
    jumping = q * np.where(np.arange(50) % 3, 1.0, -1.0)[:, None]
    assert np.abs(np.diff(continuous(jumping), axis=0)).max() < 0.2


@pytest.mark.parametrize(
    ('free', 'fixed', 'expected'),
    [
        (('M.diagonal',), (), 6),
        (('M',), ('M.diagonal',), 15),
        (('M.heave.pitch', 'M.pitch.heave'), (), 1),
        (('D_linear',), (), 6),
        (('D_linear.full',), (), 36),
        (DEFAULT, (), 21 + 12 + 4 + 1),
        (DEFAULT, ('restoring', 'lag'), 21 + 12),
        (('current', 'bias', 'gain'), (), 15),
    ],
)
def test_names_choose_what_is_free(free, fixed, expected):
    assert len(made(load_vehicle('rexrov'), free, fixed).entries) == expected


def test_a_deviation_of_theta_is_a_factor_of_two_in_inertia():
    u = made(load_vehicle('bluerov2_heavy'), ('M.diagonal', 'lag'), lag=0.1)
    ratios = u.values(np.eye(7)).diagonal() / u.values(np.zeros(7))
    assert_allclose(ratios, [*[2.0] * 6, 4.0], rtol=0.03)


def test_what_somebody_knows_is_the_prior_also_of_what_is_not_searched():
    believed = {'M.heave.heave': (300.0, 5.0), 'D_linear.yaw': (20.0, 1.0)}
    every = made(load_vehicle('herman2018'), DEFAULT, believed=believed)
    assert every.prior_cost(np.zeros(len(every.entries))) == pytest.approx(0.0)
    fewer = every.without(list(believed))
    n = len(fewer.entries)
    assert n == len(every.entries) - 2
    found = fewer.coefficients(np.zeros(n))
    assert found.M[2, 2] == pytest.approx(300.0)
    assert found.D_linear[5, 5] == 20.0
    assert np.linalg.eigvalsh(found.M)[0] > 0
    assert fewer.prior_cost(np.ones(n)) == pytest.approx(n)
    assert_allclose(fewer.precision(np.zeros(n))[0], np.eye(n))


@pytest.mark.parametrize(
    ('name', 'value', 'said'),
    [
        ('delay', 0.1, r'restoring\.force, found delay'),
        ('lag', 0.0, 'lag: expected a positive value, found 0'),
        ('M.pitch.surge', 1e4, 'M: expected values with which it is positive definite'),
    ],
)
def test_a_value_that_no_vehicle_has_is_not_believed(name, value, said):
    with pytest.raises(InputError, match=said):
        made(load_vehicle('rexrov'), DEFAULT, believed={name: (value, 0.01)})


def test_a_wrong_name_is_refused_with_the_nearest():
    with pytest.raises(InputError, match='nearest: restoring'):
        made(load_vehicle('rexrov'), ('restorin',))


def test_a_coupling_that_is_believed_is_so_whatever_is_believed_of_its_diagonal():
    vehicle = load_vehicle('herman2018')
    M = vehicle.M
    believed = {'M.pitch.heave': (0.8 * M[4, 2], 1.0), 'M.pitch.pitch': (1.3 * M[4, 4], 5.0)}
    u = made(vehicle, DEFAULT, believed=believed)
    found = u.coefficients(np.zeros(len(u.entries))).M
    assert_allclose((found[4, 2], found[4, 4]), (0.8 * M[4, 2], 1.3 * M[4, 4]))


def test_the_precision_of_the_prior_is_the_curvature_of_its_cost():
    M = load_vehicle('herman2018').M
    believed = {'M.heave.heave': (550.0, 5.0), 'M.pitch.heave': (0.9 * M[4, 2], 0.5),
                'lag': (0.15, 0.02), 'D_linear.yaw': (20.0, 3.0)}  # fmt: skip
    u = made(load_vehicle('herman2018'), DEFAULT, believed=believed, lag=0.1)
    n = len(u.entries)
    theta, h = 0.1 * np.random.default_rng(6).normal(size=n), 1e-5 * np.eye(n)

    def slope(of, at):
        return np.array([(of(at + move) - of(at - move)) / 2e-5 for move in h])

    _, gradient = u.precision(theta)
    expected = slope(u.prior_cost, theta) / 2.0
    assert_allclose(gradient, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())
    precision, at_prior = u.precision(np.zeros(n))
    assert_allclose(at_prior, 0.0, atol=1e-9)
    curved = slope(lambda at: u.precision(at)[1], np.zeros(n))
    assert_allclose(precision, curved, atol=0.02)


def test_a_deviation_of_damping_is_three_times_what_the_prior_resists():
    """At the speeds of the recording, a tenth of the wrench and of M nu / 10 s at least."""
    vehicle = load_vehicle('herman2018').changed(
        D_linear=np.diag([70.0, 100.0, 0.1, 4.0, 5.0, 6.0]),
        D_quadratic=np.diag([30.0, 40.0, 0.1, 1.0, 2.0, 3.0]),
    )
    speeds, wrenches = np.array([0.5, 0.4, 0.3, 0.2, 0.1, 0.25]), np.zeros(6)
    wrenches[1] = 900.0
    u = unknowns(vehicle, EVERY, speeds=speeds, wrenches=wrenches)
    drag = {'surge': (70.0 + 30.0 * 0.5) * 0.5, 'sway': 90.0,
            'heave': 0.01 * vehicle.M[2, 2] * 0.3}  # fmt: skip
    unit = {entry.name: entry.unit for entry in u.entries}
    for i, (dof, resisted) in enumerate(drag.items()):
        assert unit[f'D_linear.{dof}'] == pytest.approx(3.0 * resisted / speeds[i])
        assert unit[f'D_quadratic.{dof}'] == pytest.approx(3.0 * resisted / speeds[i] ** 2)
    shared = np.sqrt(drag['surge'] * drag['sway'])
    assert unit['D_linear.sway.surge'] == pytest.approx(3.0 * shared / np.sqrt(0.5 * 0.4))
    assert unit['D_quadratic.surge.sway'] == pytest.approx(3.0 * shared / (0.5 * 0.4))
    weight = float(vehicle.weight)
    assert [unit[f'bias.{dof}'] for dof in ('surge', 'sway', 'yaw')] == pytest.approx(
        [1e-3 * weight, 900.0, 1e-4 * weight]
    )


def test_units_of_coupled_damping_are_those_of_force_and_velocity():
    si = {entry.name: entry.si for entry in made(load_vehicle('herman2018')).entries}
    assert (si['D_linear.sway.yaw'], si['D_linear.yaw.sway']) == ('N/rad/s', 'N m/m/s')
    assert si['D_quadratic.sway.yaw'] == 'N/(rad/s)²'
    assert si['D_quadratic.yaw.sway'] == 'N m/(m/s)²'
