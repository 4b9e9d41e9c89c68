"""Attitude: quaternion and Euler angles, J, the singularity, and runs through it."""

import herman_reference as reference
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from plants import plant_of, push
from strategies import QUICK, attitudes, vectors

from auv_dynamics.jit import plain
from auv_dynamics.kinematics import (
    attitude_rate,
    euler,
    jacobian,
    position_rate,
    quaternion,
    rotation,
    unwrapped,
)
from auv_dynamics.plant import eta_of, initial_state
from auv_dynamics.vehicle_file import vehicle_from_dict

ANGLES = st.floats(-3.1, 3.1)


def unit(values: np.ndarray) -> np.ndarray:
    return values / np.linalg.norm(values)


QUATERNIONS = vectors(4).filter(lambda q: np.linalg.norm(q) > 1e-3).map(unit)


def test_rotation_of_worked_angles():
    expected = [
        [0.936293364, -0.312991826, -0.159345079],
        [0.289629478, 0.944702486, -0.153791998],
        [0.198669331, 0.097843395, 0.975170327],
    ]
    J = jacobian(np.array([0, 0, 0, 0.1, -0.2, 0.3]))
    assert_allclose(J[:3, :3], expected, atol=1e-9)
    assert_allclose(rotation(quaternion([0.1, -0.2, 0.3])), expected, atol=1e-9)
    assert not J[:3, 3:].any()
    assert not J[3:, :3].any()


def test_rates_of_worked_angles():
    expected = [
        [1, -0.020237235, -0.20169733],
        [0, 0.995004165, -0.099833417],
        [0, 0.101863913, 1.015241401],
    ]
    assert_allclose(jacobian(np.array([0, 0, 0, 0.1, -0.2, 9.0]))[3:, 3:], expected, atol=1e-9)


@QUICK
@given(attitudes())
def test_jacobian_agrees_with_the_reference(eta):
    assert_allclose(jacobian(eta), reference.jacobian(eta), rtol=1e-12, atol=1e-13)


@QUICK
@given(ANGLES, st.floats(-1.57, 1.57), ANGLES)
def test_euler_angles_survive_the_quaternion(phi, theta, psi):
    there = quaternion([phi, theta, psi])
    assert np.linalg.norm(there) == pytest.approx(1.0, rel=1e-14)
    assert_allclose(euler(there), [phi, theta, psi], atol=1e-11)


@QUICK
@given(QUATERNIONS)
def test_a_quaternion_survives_the_euler_angles(q):
    back = euler(q)
    assert np.abs(back[1]) <= np.pi / 2
    assert np.abs(back[[0, 2]]).max() <= np.pi
    assert_allclose(rotation(quaternion(back)), rotation(q), atol=1e-7)
    assert_allclose(rotation(q) @ rotation(q).T, np.eye(3), atol=1e-14)


@pytest.mark.parametrize('theta', [np.pi / 2, -np.pi / 2])
@pytest.mark.parametrize(('phi', 'psi'), [(0.0, 0.7), (0.4, -1.1), (-2.0, 3.0)])
def test_at_the_singularity_phi_is_zero_and_psi_takes_the_rest(theta, phi, psi):
    q = quaternion([phi, theta, psi])
    angles = euler(q)
    assert angles[0] == 0.0
    assert angles[1] == pytest.approx(theta, abs=1e-7)
    rest = psi - np.sign(theta) * phi
    assert np.cos(angles[2] - rest) == pytest.approx(1.0, abs=1e-12)
    assert_allclose(rotation(quaternion(angles)), rotation(q), atol=1e-7)


@pytest.mark.parametrize('distance', [1e-9, 1e-7, 1e-5, 1e-3])
@pytest.mark.parametrize('side', [1.0, -1.0])
def test_close_to_the_singularity_the_attitude_is_kept(distance, side):
    angles = [0.3, side * (np.pi / 2 - distance), -0.8]
    back = euler(quaternion(angles))
    assert back[1] == pytest.approx(angles[1], abs=3e-8)
    assert_allclose(rotation(quaternion(back)), rotation(quaternion(angles)), atol=3e-6)


def test_psi_is_continued_over_pi_and_the_others_are_left():
    psi = np.linspace(0.0, 13.0, 200)
    wrapped = np.stack([0.1 + 0 * psi, 0.2 * np.sin(psi), np.angle(np.exp(1j * psi))], axis=1)
    before = wrapped.copy()
    angles = unwrapped(wrapped)
    assert_allclose(angles[:, 2], psi, atol=1e-12)
    assert_allclose(angles[:, :2], wrapped[:, :2])
    assert_allclose(wrapped, before)


@QUICK
@given(attitudes(), vectors())
def test_rates_of_the_kernel_are_those_of_J(eta, nu):
    q = quaternion(eta[3:])
    q_dot = np.array(plain(attitude_rate)(tuple(q), tuple(nu)))
    h = 1e-6
    ahead, behind = unit(q + h * q_dot), unit(q - h * q_dot)
    turned = (rotation(ahead) - rotation(behind)) / (2 * h)
    p, r = nu[3:], rotation(q)
    assert_allclose(turned, np.stack([np.cross(p, row) * -1 for row in r]), atol=1e-7)
    assert q @ q_dot == pytest.approx(0.0, abs=1e-12)
    eta_dot = reference.jacobian(eta) @ nu
    assert_allclose(plain(position_rate)(tuple(q), tuple(nu)), eta_dot[:3], atol=1e-12)
    slope = np.angle(np.exp(1j * (euler(ahead) - euler(behind)))) / (2 * h)
    assert_allclose(slope, eta_dot[3:], atol=1e-5 * (1 + np.abs(eta_dot[3:]).max()))


def tumbling():
    """A vehicle on which nothing acts: it keeps the rate it is given."""
    return vehicle_from_dict(
        {
            'name': 'tumbling',
            'source': 'none needed',
            'rigid_body': {'mass': 1.0, 'center_of_gravity': [0.0, 0.0, 0.0]},
            'inertia_matrix': np.eye(6).tolist(),
            'hydrostatics': {'volume': 0.001, 'center_of_buoyancy': [0.0, 0.0, 0.0]},
            'damping': {'linear': [0.0] * 6, 'quadratic': [0.0] * 6},
            'environment': {'water_density': 1000.0, 'gravity': 9.81},
        },
        'tumbling.yaml',
    )


def turn(eta: np.ndarray, nu: np.ndarray, steps: int) -> np.ndarray:
    plant = plant_of(tumbling(), [], 0.01, 'ode5', initial_state(eta, nu))
    rows = []
    for _ in range(steps + 1):
        rows.append(plant.x.copy())
        push(plant, (0.0,) * 6)
    return np.array(rows)


def test_a_run_through_theta_90_degrees_stays_finite():
    # pi/4 rad/s from rest: the sample at 2 s is the singularity itself
    x = turn(np.zeros(6), np.array([0, 0, 0, 0, np.pi / 4, 0]), 400)
    eta, t = eta_of(x), 0.01 * np.arange(401)
    assert np.isfinite(eta).all()
    assert np.abs(eta[:, 4]).max() <= np.pi / 2
    assert eta[200, 4] == pytest.approx(np.pi / 2, abs=1e-6)
    assert_allclose(x[:, 11], np.pi / 4, rtol=1e-12)
    beyond = eta[t > 2.01, 4]
    assert_allclose(beyond, np.pi - np.pi / 4 * t[t > 2.01], atol=1e-7)
    forward = rotation(x[:, 3:7])[:, :, 0]
    expected = np.stack([np.cos(np.pi / 4 * t), 0 * t, -np.sin(np.pi / 4 * t)], axis=1)
    assert_allclose(forward, expected, atol=1e-9)


def test_psi_of_a_turning_run_has_no_jump():
    x = turn(np.zeros(6), np.array([0, 0, 0, 0, 0, 2.0]), 700)
    psi = unwrapped(eta_of(x)[:, 3:])[:, 2]
    assert_allclose(psi, 2.0 * 0.01 * np.arange(701), atol=1e-8)


def test_velocity_is_in_the_body_frame_with_yaw():
    x = turn(np.array([0, 0, 0, 0, 0, np.pi / 2]), np.array([1.0, 0.5, 0, 0, 0, 0]), 100)
    assert_allclose(x[-1, :3], [-0.5, 1.0, 0.0], atol=1e-12)
    assert_allclose(x[-1, 7:10], [1.0, 0.5, 0.0], atol=1e-12)


def test_the_caller_keeps_its_arrays():
    eta, nu = np.arange(6.0), np.ones(6)
    x = initial_state(eta, nu)
    before = x.copy()
    push(plant_of(tumbling(), [], 0.1, 'rk4', x), (1.0,) * 6)
    assert_allclose(x, before)
    assert_allclose(eta, np.arange(6.0))
