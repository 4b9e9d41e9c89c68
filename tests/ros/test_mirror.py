"""Messages between ENU/FLU and NED/FSD: stamps kept, covariances turned, broken ones refused."""

import re

import numpy as np
import pytest
from geometry_msgs.msg import AccelStamped, TwistStamped, WrenchStamped
from helpers.strategies import QUICK, vectors
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_dynamics.nodes.frame_converter_node import WORLD, mirrored, mirrored_odometry
from auv_dynamics.ros import convert, interface
from auv_dynamics.ros.interface import BadMessageError, Frames
from auv_dynamics.vehicle.kinematics import quaternion, rotation

NED, ENU = Frames(), Frames('odom', 'base_link')
E = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
S = np.diag([1, -1, -1])
MAKERS = {TwistStamped: convert.twist, AccelStamped: convert.accel, WrenchStamped: convert.wrench}
READERS = {
    TwistStamped: interface.read_twist,
    AccelStamped: interface.read_accel,
    WrenchStamped: interface.read_wrench,
}
STAMPS = st.integers(0, 2**31 * 10**9 - 1)
STATES = st.tuples(vectors(3, 50.0), vectors(3, 3.1), vectors()).map(
    lambda parts: np.concatenate([parts[0], quaternion(parts[1]), parts[2]])
)


def covariance(values: np.ndarray) -> np.ndarray:
    half = values.reshape(6, 6)
    return half @ half.T


def odometry(ns: int, x: np.ndarray, frames: Frames, values: np.ndarray):
    message = convert.odometry(ns, x, frames)
    message.pose.covariance = covariance(values[:36]).ravel()
    message.twist.covariance = covariance(values[36:]).ravel()
    return message


@pytest.mark.parametrize('kind', MAKERS)
@QUICK
@given(STAMPS, vectors())
def test_there_and_back_is_the_same_message(kind, ns, values):
    message = MAKERS[kind](ns, values, NED)
    there = mirrored(message, NED, ENU, 'x')
    assert READERS[kind](there, ENU, 'x') == (ns, tuple(values * [1, -1, -1, 1, -1, -1]))
    assert mirrored(there, ENU, NED, 'x') == message


@QUICK
@given(STAMPS, STATES, vectors(72))
def test_odometry_there_and_back_is_the_same(ns, x, values):
    message = odometry(ns, x, NED, values)
    there = mirrored_odometry(message, NED, ENU, 'odom')
    assert (there.header.frame_id, there.child_frame_id) == ('odom', 'base_link')
    back = mirrored_odometry(there, ENU, NED, 'odom')
    assert interface.read_odometry(back, NED)[0] == ns
    q = np.sign(x[3:7] @ np.array(interface.read_odometry(back, NED)[1])[3:7])
    found = np.array(interface.read_odometry(back, NED)[1])
    found[3:7] *= q
    assert_allclose(found, x, rtol=0, atol=1e-12)
    for part in ('pose', 'twist'):
        one, other = (getattr(m, part).covariance for m in (message, back))
        assert_allclose(other, one, rtol=0, atol=1e-12 * (1 + np.abs(one).max()))


@QUICK
@given(STATES, vectors(72))
def test_covariances_keep_the_meaning_of_each_direction(x, values):
    # the variance along a direction of the earth, or of the body, is the same in both frames
    message = odometry(0, x, NED, values)
    there = mirrored_odometry(message, NED, ENU, 'odom')
    for part, turn in (('pose', E), ('twist', S)):
        here, other = (
            np.array(getattr(m, part).covariance).reshape(6, 6) for m in (message, there)
        )
        direction = np.array([0.3, -0.5, 0.8, 0.1, 0.7, -0.2])
        turned = np.concatenate([turn @ direction[:3], turn @ direction[3:]])
        assert turned @ other @ turned == pytest.approx(direction @ here @ direction, rel=1e-9)


@QUICK
@given(STATES, vectors(72))
def test_twist_in_the_world_frame_is_turned_into_the_child_frame(x, values):
    child = odometry(7, x, ENU, values)
    R = np.kron(np.eye(2), rotation(x[3:7]))
    world = odometry(7, np.concatenate([x[:7], R @ x[7:]]), ENU, values)
    turned = R @ np.array(child.twist.covariance).reshape(6, 6) @ R.T
    world.twist.covariance = turned.ravel()
    one = mirrored_odometry(child, ENU, NED, 'odom')
    other = mirrored_odometry(world, ENU, NED, 'odom', WORLD)
    for read in (lambda m: interface.read_odometry(m, NED)[1], lambda m: m.twist.covariance):
        assert_allclose(read(other), read(one), rtol=0, atol=1e-10)


def test_a_driver_that_heads_east_heads_east_here():
    # ENU yaw 0 is east; there 2 m/s ahead, 1 m/s to port, 0.5 m/s up
    x = np.array([10.0, 20.0, 3.0, 1, 0, 0, 0, 2.0, 1.0, 0.5, 0.1, 0.2, 0.3])
    found = interface.read_odometry(
        mirrored_odometry(convert.odometry(5, x, ENU), ENU, NED, 'odom'), NED
    )[1]
    assert_allclose(found[:3], [20.0, 10.0, -3.0])
    assert_allclose(rotation(np.array(found[3:7])) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    assert_allclose(found[7:], [2.0, -1.0, -0.5, 0.1, -0.2, -0.3])


@pytest.mark.parametrize(
    ('spoil', 'said'),
    [
        (lambda m: setattr(m.header, 'frame_id', 'map'), "header.frame_id: expected 'odom'"),
        (lambda m: setattr(m, 'child_frame_id', 'imu'), "child_frame_id: expected 'base_link'"),
        (lambda m: setattr(m.twist.twist.linear, 'x', np.nan), 'expected finite numbers'),
        (lambda m: setattr(m.pose.pose.orientation, 'w', 1.1), 'expected a unit quaternion'),
        (
            lambda m: m.pose.covariance.__setitem__(3, np.inf),
            'pose.covariance: not finite: expected finite numbers, found inf',
        ),
        (
            lambda m: m.twist.covariance.__setitem__(0, np.nan),
            'twist.covariance: not finite: expected finite numbers, found nan',
        ),
    ],
)
def test_odometry_that_must_not_be_used_is_refused(spoil, said):
    message = convert.odometry(0, np.array([0.0] * 3 + [1.0] + [0.0] * 9), ENU)
    spoil(message)
    with pytest.raises(BadMessageError, match=f'enu_flu/odom: .*{re.escape(said)}'):
        mirrored_odometry(message, ENU, NED, 'enu_flu/odom')


def test_a_wrench_in_another_frame_is_refused():
    with pytest.raises(
        BadMessageError, match=r"wrench: header\.frame_id: expected 'base_link_fsd'"
    ):
        mirrored(convert.wrench(0, (0.0,) * 6, ENU), NED, ENU, 'wrench')
