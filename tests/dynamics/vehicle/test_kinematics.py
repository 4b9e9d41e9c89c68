"""Attitude: quaternion and Euler angles, J, the singularity, and runs through it."""

import herman_reference as reference
import numpy as np
import pytest
from helpers.physics import R_ANGLES, R, T, body, drive, vehicle_of
from helpers.strategies import QUICK, attitudes, vectors, vehicles
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from auv_dynamics.kernel.compile import plain
from auv_dynamics.plant.plant import eta_of, initial_state
from auv_dynamics.vehicle.kinematics import (
    attitude_rate,
    euler,
    jacobian,
    position_rate,
    quaternion,
    rotation,
    unwrapped,
)

ANGLES = st.floats(-3.1, 3.1)


def unit(values: np.ndarray) -> np.ndarray:
    return values / np.linalg.norm(values)


QUATERNIONS = vectors(4).filter(lambda q: np.linalg.norm(q) > 1e-3).map(unit)


def test_rotation_of_worked_angles():
    J = jacobian(np.array([0, 0, 0, *R_ANGLES]))
    assert_allclose(J[:3, :3], R, atol=1e-9)
    assert_allclose(rotation(quaternion(R_ANGLES)), R, atol=1e-9)
    assert not J[:3, 3:].any()
    assert not J[3:, :3].any()


def test_rates_of_worked_angles():
    assert_allclose(jacobian(np.array([0, 0, 0, *R_ANGLES[:2], 9.0]))[3:, 3:], T, atol=1e-9)


@QUICK
@given(attitudes(pitch=1.55))
def test_the_first_part_of_J_is_a_rotation(eta):
    first = jacobian(eta)[:3, :3]
    assert_allclose(first.T @ first, np.eye(3), rtol=0, atol=1e-14)
    assert np.linalg.det(first) == pytest.approx(1.0, rel=1e-14)


@QUICK
@given(attitudes())
def test_the_second_part_of_J_inverts_rates_about_three_axes(eta):
    # psi_dot about the vertical, theta_dot about the y axis before roll, phi_dot about the x axis:
    # omega is their sum in the body frame, whatever J says
    phi, theta, _ = eta[3:]
    vertical = [-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)]
    axes = np.stack([[1.0, 0.0, 0.0], [0.0, np.cos(phi), -np.sin(phi)], vertical], axis=1)
    assert_allclose(jacobian(eta)[3:, 3:] @ axes, np.eye(3), rtol=0, atol=1e-14 / np.cos(theta))


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


def turn(eta: np.ndarray, nu: np.ndarray, steps: int) -> np.ndarray:
    """States of a body on which nothing acts: it keeps the rate it is given."""
    return drive(vehicle_of(body()), initial_state(eta, nu), steps=steps)


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


@QUICK
@given(attitudes(1.5), vectors())
def test_the_attitude_stays_a_rotation(eta, nu):
    # each step of Euler's method alone would lengthen the quaternion by some (omega h)^2 / 8
    x = drive(vehicle_of(body()), initial_state(eta, nu), integrator='euler', step=0.05, steps=40)
    assert_allclose(np.linalg.norm(x[:, 3:7], axis=1), 1.0, rtol=1e-15)


def test_velocity_is_in_the_body_frame_with_yaw():
    x = turn(np.array([0, 0, 0, 0, 0, np.pi / 2]), np.array([1.0, 0.5, 0, 0, 0, 0]), 100)
    assert_allclose(x[-1, :3], [-0.5, 1.0, 0.0], atol=1e-12)
    assert_allclose(x[-1, 7:10], [1.0, 0.5, 0.0], atol=1e-12)


STEP, STEPS = (
    0.0005,
    200,
)  # short enough for the stiffest of vehicles(), and for no Euler singularity


def after(rate, y: np.ndarray) -> np.ndarray:
    """State at the end of the run that `drive` makes, by SciPy's own method."""
    return solve_ivp(
        lambda _, y: rate(y), (0, STEP * STEPS), y, method='DOP853', rtol=1e-11, atol=1e-11
    ).y[:, -1]


def acceleration(m: dict, nu: np.ndarray, g: np.ndarray, tau: np.ndarray) -> np.ndarray:
    wrench = tau - reference.coriolis(m['M'], nu) @ nu - reference.damping(m, nu) @ nu - g
    return np.linalg.solve(m['M'], wrench)


def in_euler_angles(data: dict, eta: np.ndarray, nu: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Eta and nu (12,) at the end by (2) in its Euler form."""
    m = reference.vehicle_matrices(data)

    def rate(y: np.ndarray) -> np.ndarray:
        nu_dot = acceleration(m, y[6:], reference.restoring(m, y[:6]), tau)
        return np.concatenate([reference.jacobian(y[:6]) @ y[6:], nu_dot])

    return after(rate, np.concatenate([eta, nu]))


def in_rotation_matrices(data: dict, x: np.ndarray, tau: np.ndarray) -> tuple:
    """Position, R and nu at the end by R_dot = R S(omega), which has no singularity."""
    m = reference.vehicle_matrices(data)
    couple = m['W'] * m['r_G'] - m['B'] * m['r_B']

    def rate(y: np.ndarray) -> np.ndarray:
        attitude, nu = y[3:12].reshape(3, 3), y[12:]
        g = -np.concatenate([(m['W'] - m['B']) * attitude[2], np.cross(couple, attitude[2])])
        turning = attitude @ reference.skew(nu[3:])
        return np.concatenate([attitude @ nu[:3], turning.ravel(), acceleration(m, nu, g, tau)])

    w, v = x[3], x[4:7]  # R = 1 + 2 w S(v) + 2 S(v)^2
    S = reference.skew(v)
    start = np.eye(3) + 2 * w * S + 2 * S @ S
    y = after(rate, np.concatenate([x[:3], start.ravel(), x[7:]]))
    return y[:3], y[3:12].reshape(3, 3), y[12:]


@QUICK
@given(vehicles(), attitudes(0.5), vectors(largest=1.0), vectors(largest=1.0))
def test_a_run_is_the_same_in_quaternions_and_in_euler_angles(data, eta, nu, push):
    data['damping']['quadratic'] = [0.0] * 6  # a kink in abs(nu) would lower either's order
    data.pop('lift', None)
    tau = data['rigid_body']['mass'] * push
    expected = in_euler_angles(data, eta, nu, tau)
    x = drive(vehicle_of(data), initial_state(eta, nu), tau=tau, step=STEP, steps=STEPS)
    scale = 1.0 + np.abs(expected[6:]).max()
    found = eta_of(x[-1])
    assert_allclose(found[:3], expected[:3], rtol=0, atol=1e-7 * scale)
    assert_allclose(np.exp(1j * found[3:]), np.exp(1j * expected[3:6]), rtol=0, atol=1e-7 * scale)
    assert_allclose(x[-1, 7:], expected[6:], rtol=0, atol=1e-7 * scale)


@pytest.mark.parametrize('side', [1.0, -1.0])
@QUICK
@given(vehicles(), ANGLES, ANGLES, vectors(largest=1.0), vectors(largest=1.0))
def test_a_run_from_the_singularity_itself_is_right(side, data, phi, psi, nu, push):
    data['damping']['quadratic'] = [0.0] * 6
    data.pop('lift', None)
    tau = data['rigid_body']['mass'] * push
    start = initial_state(np.array([1.0, -2.0, 3.0, phi, side * np.pi / 2, psi]), nu)
    p, attitude, velocity = in_rotation_matrices(data, start, tau)
    x = drive(vehicle_of(data), start, tau=tau, step=STEP, steps=STEPS)
    scale = 1.0 + np.abs(velocity).max()
    assert np.isfinite(x).all()
    assert np.isfinite(eta_of(x)).all()
    assert_allclose(x[-1, :3], p, rtol=0, atol=1e-7 * scale)
    assert_allclose(rotation(x[-1, 3:7]), attitude, rtol=0, atol=1e-7 * scale)
    assert_allclose(rotation(quaternion(eta_of(x[-1])[3:])), attitude, rtol=0, atol=1e-7 * scale)
    assert_allclose(x[-1, 7:], velocity, rtol=0, atol=1e-7 * scale)


def test_the_caller_keeps_its_arrays():
    eta, nu = np.arange(6.0), np.ones(6)
    x = initial_state(eta, nu)
    before = x.copy()
    drive(vehicle_of(body()), x, tau=(1.0,) * 6, integrator='rk4', step=0.1, steps=1)
    assert_allclose(x, before)
    assert_allclose(eta, np.arange(6.0))
