"""ENU and forward-left-up against NED and forward-starboard-down: known cases, and whole runs."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from helpers.physics import drive, vehicle_of
from helpers.strategies import QUICK, attitudes, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics.files.shipped import shipped
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.vehicle import frames
from auv_dynamics.vehicle.kinematics import euler, quaternion, rotation
from auv_dynamics.vehicle.vehicle import Vehicle, rigid_body_matrix

NORTH, EAST, DOWN = np.eye(3)
S = np.diag([1.0, -1.0, -1.0])
E = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
UNIT = vectors(4).filter(lambda q: np.linalg.norm(q) > 1e-3).map(lambda q: q / np.linalg.norm(q))
SWAPS = {
    frames.swap_position: (3,),
    frames.swap_body: (6,),
    frames.swap_attitude: (4,),
    frames.swap_state: (13,),
    frames.swap_body_matrix: (6, 6),
    frames.swap_inertia: (3, 3),
}


def enu(*, phi: float = 0.0, theta: float = 0.0, psi: float = 0.0) -> np.ndarray:
    """Roll, pitch, yaw (3,) in ENU and FLU of Euler angles in NED and FSD, all in degrees."""
    return np.degrees(euler(frames.swap_attitude(quaternion(np.radians([phi, theta, psi])))))


@pytest.mark.parametrize(
    ('heading', 'yaw'), [(0, 90), (90, 0), (180, -90), (270, 180), (45, 45), (30, 60)]
)
def test_heading_from_north_clockwise_is_yaw_from_east_counter_clockwise(heading, yaw):
    found = enu(psi=heading)
    assert_allclose(found[:2], [0.0, 0.0], atol=1e-12)
    assert np.exp(1j * np.radians(found[2])) == pytest.approx(np.exp(1j * np.radians(yaw)))


def test_nose_up_is_positive_pitch_here_and_negative_pitch_there():
    # about starboard a positive turn lifts the nose, about port it lowers it
    assert_allclose(enu(theta=20.0), [0.0, -20.0, 90.0], atol=1e-12)
    nose_down = frames.swap_attitude(quaternion(np.radians([0.0, 20.0, 90.0])))  # of ENU and FLU
    assert rotation(nose_down)[2, 0] == pytest.approx(np.sin(np.radians(20.0)))


def test_starboard_down_is_positive_roll_in_both():
    assert_allclose(enu(phi=15.0), [15.0, 0.0, 90.0], atol=1e-12)
    assert_allclose(enu(phi=10.0, theta=20.0, psi=30.0), [10.0, -20.0, 60.0], atol=1e-12)


def test_a_quaternion_written_out():
    # facing north upright: none here, a quarter turn about up there
    half = np.sqrt(0.5)
    assert_allclose(frames.swap_attitude([1, 0, 0, 0]), [half, 0, 0, half], atol=1e-15)
    assert_allclose(frames.swap_attitude([half, 0, 0, half]), [1, 0, 0, 0], atol=1e-15)  # east
    assert_allclose(frames.swap_attitude([0, 1, 0, 0]), [0, half, half, 0], atol=1e-15)


def test_places():
    assert_array_equal(frames.swap_position(NORTH), [0, 1, 0])
    assert_array_equal(frames.swap_position(EAST), [1, 0, 0])
    assert_array_equal(frames.swap_position(DOWN), [0, 0, -1])
    assert_array_equal(frames.swap_position([100.0, 20.0, 3.0]), [20.0, 100.0, -3.0])


def test_velocities_and_wrenches():
    nu = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert_array_equal(frames.swap_body(nu), [1.0, -2.0, -3.0, 4.0, -5.0, -6.0])


def test_products_of_inertia():
    # RexROV's, which its source gives in FLU: Ixy and Ixz change their sign, Iyz does not
    there = np.array([[525.39, 1.44, 33.41], [1.44, 794.20, 2.6], [33.41, 2.6, 691.23]])
    here = np.array([[525.39, -1.44, -33.41], [-1.44, 794.20, 2.6], [-33.41, 2.6, 691.23]])
    assert_array_equal(frames.swap_inertia(there), here)


def test_signs_of_a_matrix():
    found = frames.swap_body_matrix(np.ones((6, 6)))
    signs = [1, -1, -1, 1, -1, -1]
    assert_array_equal(found, [[a * b for b in signs] for a in signs])


@pytest.mark.parametrize('swap', SWAPS, ids=lambda swap: swap.__name__)
@QUICK
@given(vectors(72, 100.0))
def test_each_is_its_own_inverse_and_leaves_its_argument(swap, values):
    shape = SWAPS[swap]
    several = values[: 2 * np.prod(shape)].reshape(2, *shape)
    before = several.copy()
    there = swap(several)
    assert_array_equal(several, before)
    assert_allclose(swap(there), several, rtol=0, atol=1e-13)
    assert_array_equal(swap(several[1]), there[1])  # one at a time or several at once
    again = swap(swap(there))
    assert_allclose(again, there, rtol=0, atol=1e-13)
    assert np.linalg.norm(there) == pytest.approx(np.linalg.norm(several), rel=1e-14)


@pytest.mark.parametrize('swap', SWAPS, ids=lambda swap: swap.__name__)
@pytest.mark.parametrize('wrong', [(), (5,), (2, 5), (12,)])
def test_another_shape_is_refused(swap, wrong):
    expected = ', '.join(map(str, SWAPS[swap]))
    with pytest.raises(ValueError, match=rf'expected shape \(\.\.\., {expected}\), found \('):
        swap(np.zeros(wrong))


@QUICK
@given(UNIT)
def test_an_attitude_takes_both_changes(q):
    # R leads from the body to the earth: E and S on their own sides
    there = frames.swap_attitude(q)
    assert_allclose(rotation(there), E @ rotation(q) @ S, rtol=0, atol=1e-14)
    assert np.linalg.norm(there) == pytest.approx(1.0, rel=1e-15)


@QUICK
@given(UNIT, vectors(3))
def test_a_point_of_the_vehicle_is_at_the_same_place(q, point):
    # through either pair of frames: body to earth, then over; or over, then body to earth
    one = frames.swap_position(rotation(q) @ point)
    other = rotation(frames.swap_attitude(q)) @ (S @ point)
    assert_allclose(one, other, rtol=0, atol=1e-14 * (1 + np.abs(point).max()))


@QUICK
@given(UNIT, vectors(3), vectors())
def test_a_state_is_converted_part_by_part(q, p, nu):
    found = frames.swap_state(np.concatenate([p, q, nu]))
    assert_array_equal(found[:3], frames.swap_position(p))
    assert_array_equal(found[3:7], frames.swap_attitude(q))
    assert_array_equal(found[7:], frames.swap_body(nu))


def forward_left_up(vehicle: Vehicle) -> Vehicle:
    """The vehicle with its coefficients in FLU.

    The earth's z axis points up there, so that weight and buoyancy change their sign.
    """
    return replace(
        vehicle,
        M=frames.swap_body_matrix(vehicle.M),
        D_linear=frames.swap_body_matrix(vehicle.D_linear),
        D_quadratic=frames.swap_body_matrix(vehicle.D_quadratic),
        lift=None if vehicle.lift is None else frames.swap_body_matrix(vehicle.lift),
        weight=-vehicle.weight,
        buoyancy=-vehicle.buoyancy,
        r_G=S @ vehicle.r_G,
        r_B=S @ vehicle.r_B,
    )


@QUICK
@given(vehicles(), vectors())
def test_C_and_D_of_converted_matrices_are_converted(data, nu):
    vehicle = vehicle_of(data)
    other, there = forward_left_up(vehicle), frames.swap_body(nu)
    for one, converted in ((vehicle.C(nu), other.C(there)), (vehicle.D(nu), other.D(there))):
        scale = max(np.abs(one).max(), np.abs(vehicle.M).max() * 1e-3)
        assert_allclose(frames.swap_body_matrix(converted), one, rtol=0, atol=1e-13 * scale)


@QUICK
@given(vehicles())
def test_a_rigid_body_of_converted_numbers_is_converted(data):
    rigid = data['rigid_body']
    mass, r_G, inertia = (np.array(rigid[k]) for k in ('mass', 'center_of_gravity', 'inertia'))
    one = rigid_body_matrix(float(mass), r_G, inertia, 'cg')
    there = rigid_body_matrix(float(mass), S @ r_G, frames.swap_inertia(inertia), 'cg')
    atol = 1e-14 * np.abs(one).max()
    assert_allclose(there, frames.swap_body_matrix(one), rtol=0, atol=atol)


@QUICK
@given(vehicles(), attitudes(1.5), vectors(largest=1.0), vectors(largest=1.0))
def test_a_run_in_the_other_frames_is_the_same_run(data, eta, nu, push):
    vehicle, tau = vehicle_of(data), 0.2 * data['rigid_body']['mass'] * push
    start = initial_state(eta, nu)
    here = drive(vehicle, start, tau=tau, step=0.004)
    other, there = forward_left_up(vehicle), frames.swap_state(start)
    there = drive(other, there, tau=frames.swap_body(tau), step=0.004)
    assert_allclose(frames.swap_state(there), here, rtol=0, atol=1e-11 * np.abs(here).max())


@pytest.mark.parametrize('left_out', ['position', 'attitude', 'body'])
def test_a_run_of_which_one_part_is_not_converted_is_another(left_out):
    data = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
    eta = np.array([1.0, 2.0, 3.0, 0.2, -0.3, 0.5])
    start = initial_state(eta, np.array([0.5, -0.4, 0.3, 0.1, -0.2, 0.3]))
    here = drive(vehicle_of(data), start, steps=50)
    wrong = frames.swap_state(start)
    part = {'position': slice(0, 3), 'attitude': slice(3, 7), 'body': slice(7, 13)}[left_out]
    wrong[part] = start[part]
    there = drive(forward_left_up(vehicle_of(data)), wrong, steps=50)
    assert np.abs(frames.swap_state(there) - here).max() > 0.1


@pytest.mark.parametrize(
    ('frame', 'axes'),
    [
        ('odom_ned', frames.NED_FSD), ('frd', frames.NED_FSD),
        ('world_NED/vehicle', frames.NED_FSD),
        ('map_enu', frames.ENU_FLU), ('base_link_flu', frames.ENU_FLU),
        ('odom', None), ('undefined', None), ('enu_to_ned', None),
    ],
)  # fmt: skip
def test_axes_that_a_frame_id_names(frame, axes):
    assert frames.named_axes(frame) == axes


def test_the_covariance_of_a_pose_turns_with_its_axes():
    """cov(T x) = T cov(x) T^T of samples in NED, and the same written in ENU."""
    samples = np.random.default_rng(3).normal(size=(40, 6)) * np.arange(1.0, 7.0)
    swapped = np.hstack([samples[:, :3] @ E.T, samples[:, 3:] @ E.T])
    found = frames.swap_earth_matrix(np.cov(samples.T))
    assert_allclose(found, np.cov(swapped.T), rtol=1e-12, atol=1e-12)
    assert_allclose(frames.swap_earth_matrix(found), np.cov(samples.T), atol=1e-12)
