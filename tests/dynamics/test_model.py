"""The terms of equation (1): structure, published numbers, physics, and an independent model."""

import herman_reference as reference
import numpy as np
import pytest
import yaml
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal
from plants import plant_of, push
from strategies import QUICK, attitudes, vectors, vehicles

from auv_dynamics import load_vehicle
from auv_dynamics.config import shipped
from auv_dynamics.disturbance import make_disturbance
from auv_dynamics.plant import initial_state
from auv_dynamics.vehicle_file import vehicle_from_dict

DENSE_M_A = [
    [10, 1, 0, 0, 0, 0.5],
    [1, 20, 2, 0, 0, 0],
    [0, 2, 30, 0, 0, 0],
    [0, 0, 0, 5, 0.3, 0],
    [0, 0, 0, 0.3, 15, 1],
    [0.5, 0, 0, 0, 1, 25],
]


def with_inertia(M) -> dict:
    return {
        'name': 'worked',
        'source': 'a worked number',
        'rigid_body': {'mass': 30.0, 'center_of_gravity': [0.01, 0.02, 0.03]},
        'inertia_matrix': np.asarray(M, float).tolist(),
        'hydrostatics': {'volume': 0.031, 'center_of_buoyancy': [-0.01, 0.0, -0.02]},
        'damping': {'linear': [0.0] * 6, 'quadratic': [0.0] * 6},
        'environment': {'water_density': 1000.0, 'gravity': 10.0},
    }


def vehicle_of(data: dict):
    return vehicle_from_dict(data, 'vehicle.yaml')


def potential(data: dict, eta: np.ndarray) -> float:
    """Height is -z: m g and rho g V times the depths of the two centres."""
    m = reference.vehicle_matrices(data)
    down = reference.jacobian(eta)[2, :3]
    return -m['W'] * (eta[2] + down @ m['r_G']) + m['B'] * (eta[2] + down @ m['r_B'])


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


def test_coriolis_of_a_diagonal_inertia():
    C = vehicle_of(with_inertia(np.diag(np.arange(1, 7)))).C(np.arange(1.0, 7.0))
    assert_array_equal(C[:3, :3], np.zeros((3, 3)))
    assert_array_equal(C[:3, 3:], [[0, 9, -4], [-9, 0, 1], [4, -1, 0]])
    assert_array_equal(C[3:, :3], [[0, 9, -4], [-9, 0, 1], [4, -1, 0]])
    assert_array_equal(C[3:, 3:], [[0, 36, -25], [-36, 0, 16], [25, -16, 0]])


def test_munk_moment():
    data = with_inertia(np.eye(6))
    del data['inertia_matrix']
    data['rigid_body'] |= {'center_of_gravity': [0.0] * 3, 'inertia_reference': 'cg'}
    data['rigid_body']['inertia'] = np.eye(3).tolist()
    data['added_mass'] = [5, 100, 100, 0, 10, 10]
    nu = np.array([1, 0.5, 0, 0, 0, 0])
    assert_allclose(-(vehicle_of(data).C(nu) @ nu), [0, 0, 0, 0, 0, -47.5], atol=1e-12)


def test_coriolis_of_a_dense_added_mass():
    nu = np.array([1, -0.5, 0.3, 0.1, -0.2, 0.4])
    expected = [1.76, 3.08, 1.10, -2.512, -5.944, -3.719]
    assert_allclose(vehicle_of(with_inertia(DENSE_M_A)).C(nu) @ nu, expected, atol=1e-12)


def test_restoring_wrench_of_a_worked_attitude():
    g = vehicle_of(with_inertia(DENSE_M_A)).g(np.array([0, 0, 0, -0.1, 0.2, 0]))
    expected = [-1.986693308, -0.97843395, 9.751703272, -7.338241567, 8.968312824, -0.595171275]
    assert_allclose(g, expected, atol=1e-8)


@QUICK
@given(vectors(), vectors(), vectors(), vectors())
def test_diagonal_damping_only_takes_energy(linear, quadratic, nu, x):
    data = with_inertia(np.eye(6))
    data['damping'] = {k: np.abs(v).tolist() for k, v in
                       (('linear', linear), ('quadratic', quadratic))}  # fmt: skip
    D = vehicle_of(data).D(nu)
    assert x @ D @ x >= 0.0
    assert_allclose(np.diagonal(D), np.abs(linear) + np.abs(quadratic) * np.abs(nu), rtol=1e-15)


def test_dense_quadratic_damping_multiplies_column_by_column():
    data = with_inertia(np.eye(6))
    data['damping']['quadratic'] = (np.eye(6) + 0.1 * np.arange(36).reshape(6, 6)).tolist()
    nu = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0])
    expected = np.array(data['damping']['quadratic']) * [1, 2, 3, 4, 5, 6]
    assert_allclose(vehicle_of(data).D(nu), expected, rtol=1e-15)


@QUICK
@given(vehicles(), attitudes())
def test_restoring_is_the_gradient_of_the_potential(data, eta):
    # g stands on the left of (1): along a body direction it is dV, so the wrench -g is -dV
    h, J = 1e-5, reference.jacobian(eta)
    slope = [
        (potential(data, eta + h * J[:, i]) - potential(data, eta - h * J[:, i])) / (2 * h)
        for i in range(6)
    ]
    vehicle = vehicle_of(data)
    scale = vehicle.weight + vehicle.buoyancy
    assert_allclose(vehicle.g(eta), slope, rtol=0, atol=1e-7 * scale)
    opposite = np.abs(vehicle.g(eta) + slope).max()
    assert opposite > 1e-6 * scale  # random centres: g never vanishes


@QUICK
@given(vehicles(), attitudes(), vectors(), vectors(largest=50.0), vectors(largest=50.0))
def test_forward_dynamics_inverts_inverse_dynamics(data, eta, nu, nu_dot, F):
    vehicle = vehicle_of(data)
    tau = vehicle.inverse_dynamics(eta, nu, nu_dot, F)
    assert_allclose(vehicle.forward_dynamics(eta, nu, tau, F), nu_dot, rtol=0, atol=1e-8)
    with_F = vehicle.inverse_dynamics(eta, nu, nu_dot, F) - vehicle.inverse_dynamics(
        eta, nu, nu_dot
    )
    assert_allclose(with_F, F, rtol=0, atol=1e-12 * (1 + np.abs(tau).max()))  # on the left of (1)


def agree(ours, theirs, scale=None) -> None:
    scale = max(np.abs(theirs).max() if scale is None else scale, 1e-300)
    assert_allclose(ours, theirs, rtol=0, atol=1e-12 * scale)


def check_against_reference(data: dict, eta: np.ndarray, nu: np.ndarray) -> None:
    vehicle, other = vehicle_of(data), reference.vehicle_matrices(data)
    for ours in ('M', 'M_RB', 'M_A', 'D_linear', 'D_quadratic', 'r_G', 'r_B'):
        if other[ours] is not None:
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


@pytest.mark.parametrize('name', ['herman2018', 'herman2018_neutral', 'rexrov'])
def test_shipped_vehicles_agree_with_the_reference(name):
    data = yaml.safe_load(shipped('vehicles', name).read_text(encoding='utf-8'))
    eta, nu = np.array([1, 2, 3, 0.4, -0.5, 2.6]), np.array([1.1, -0.5, 0.3, 0.2, -0.7, 0.4])
    check_against_reference(data, eta, nu)


def energy(data: dict, x: np.ndarray) -> float:
    w, a, b, c = x[3:7]
    down = np.array([2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)])
    m = reference.vehicle_matrices(data)
    moment = m['W'] * m['r_G'] - m['B'] * m['r_B']
    return 0.5 * x[7:] @ m['M'] @ x[7:] - (m['W'] - m['B']) * x[2] - down @ moment


@QUICK
@given(vehicles(heavy_water=True), vectors(largest=1.0), attitudes())
def test_without_damping_energy_is_kept(data, nu, eta):
    data['damping'] = {'linear': [0.0] * 6, 'quadratic': [0.0] * 6}
    x = initial_state(eta, nu)
    plant = plant_of(vehicle_of(data), [], 0.005, 'ode5', x)
    start = energy(data, plant.x)
    for _ in range(200):
        push(plant, (0.0,) * 6)
    turned = np.abs(plant.x - x).max()
    assert turned > 0.0
    assert energy(data, plant.x) == pytest.approx(
        start, abs=1e-7 * (abs(start) + data['rigid_body']['mass'])
    )


def test_power_balance_along_a_run():
    data = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
    vehicle, step = load_vehicle('rexrov'), 0.01
    tau = np.array([900.0, -300.0, 500.0, 80.0, -120.0, 200.0])
    specs = [{'kind': 'harmonic', 'sway': {'offset': 150.0, 'terms': []}, 'yaw': {'offset': 60.0}}]
    F = make_disturbance(specs)(np.zeros(1))[0]
    nu = np.array([0.5, -0.4, 0.3, 0.1, -0.2, 0.3])
    plant = plant_of(vehicle, specs, step, 'ode5', initial_state(np.zeros(6), nu))
    start, power = energy(data, plant.x), []
    for _ in range(401):
        nu = plant.x[7:]
        power.append(nu @ (tau - vehicle.D(nu) @ nu - F))
        end = energy(data, plant.x)
        push(plant, tau)
    simpson = step / 3 * (power[0] + power[-1] + 4 * sum(power[1:-1:2]) + 2 * sum(power[2:-1:2]))
    assert abs(simpson) > 100.0
    assert end - start == pytest.approx(simpson, rel=1e-6)
