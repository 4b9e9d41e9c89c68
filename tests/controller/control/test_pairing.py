"""Which set-point belongs to an odometry: the same stamp, or the newest one before it."""

import contextlib

import numpy as np
import pytest
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st

from auv_gvc_controller.control.odometry_guard import Limits
from auv_gvc_controller.control.setpoint_buffer import (
    CAPACITY,
    DIFFERENCE,
    FILTER,
    NONE,
    SAME,
    Reference,
    SetpointBuffer,
    followed,
)

MS = 1_000_000


def six(value: float) -> tuple:
    return (value, 0.0, 0.0, 0.0, 0.0, -value)


ZERO = six(0.0)


def test_exact_takes_the_set_point_of_the_very_same_stamp():
    pairing = SetpointBuffer(exact=True, acceleration=SAME)
    for k in range(5):
        pairing.setpoint(k * MS, six(k))
        pairing.derivative(k * MS, six(10 * k))
    assert pairing.find(MS // 2) is None
    assert pairing.find(2 * MS) == Reference(2 * MS, six(2), six(20))
    assert pairing.find(2 * MS) == Reference(2 * MS, six(2), six(20))  # asked again
    assert pairing.find(5 * MS) is None
    assert pairing.find(3 * MS + 1) is None
    assert pairing.find(3 * MS) == Reference(3 * MS, six(3), six(30))


@pytest.mark.parametrize('exact', [True, False])
def test_topic_waits_for_the_derivative_of_the_same_stamp(exact):
    pairing = SetpointBuffer(exact=exact, acceleration=SAME)
    pairing.setpoint(MS, six(1))
    pairing.derivative(2 * MS, six(7))
    assert pairing.find(MS) is None
    pairing.derivative(MS, six(5))
    assert pairing.find(MS) == Reference(MS, six(1), six(5))
    assert pairing.find(2 * MS) == (None if exact else Reference(MS, six(1), six(5)))
    pairing.setpoint(2 * MS, six(2))
    assert pairing.find(2 * MS) == Reference(2 * MS, six(2), six(7))


def test_latest_takes_the_newest_at_or_before():
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE)
    assert pairing.find(0) is None
    for k in (1, 3, 5):
        pairing.setpoint(k * MS, six(k))
    assert pairing.find(MS - 1) is None
    assert pairing.find(MS).ns == MS
    assert pairing.find(3 * MS - 1).ns == MS
    assert pairing.find(4 * MS).ns == 3 * MS
    assert pairing.find(100 * MS).ns == 5 * MS
    assert pairing.find(100 * MS).nu_d == six(5)


def test_latest_does_not_depend_on_the_order_of_arrival():
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE)
    for k in (5, 1, 3):
        pairing.setpoint(k * MS, six(k))
    assert pairing.find(4 * MS) == Reference(3 * MS, six(3), six(1000.0))


@pytest.mark.parametrize('exact', [True, False])
def test_the_backward_difference_is_zero_at_the_first(exact):
    pairing = SetpointBuffer(exact=exact, acceleration=DIFFERENCE)
    pairing.setpoint(10 * MS, six(1.0))
    assert pairing.find(10 * MS) == Reference(10 * MS, six(1.0), ZERO)
    pairing.setpoint(30 * MS, six(2.0))
    later = pairing.find(30 * MS)
    assert later.nu_d_dot == pytest.approx(six(50.0))
    assert pairing.find(30 * MS).nu_d_dot == later.nu_d_dot  # held with its set-point


def test_the_difference_is_to_the_set_point_just_before_even_if_unused():
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE)
    for k, value in ((0, 0.0), (10, 5.0), (20, 6.0)):
        pairing.setpoint(k * MS, six(value))
    pairing.find(0)
    assert pairing.find(25 * MS).nu_d_dot == pytest.approx(six(100.0))


@pytest.mark.parametrize('keep', ['setpoint', 'derivative'])
def test_a_stamp_not_newer_than_the_one_in_use_is_refused(keep):
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE)
    pairing.setpoint(2 * MS, six(1))
    pairing.find(2 * MS)
    for ns in (MS, 2 * MS):
        with pytest.raises(
            ValueError, match=f'stamp late: expected later than {2 * MS} ns, found {ns} ns'
        ):
            getattr(pairing, keep)(ns, six(9))
    assert pairing.find(2 * MS).nu_d == six(1)


def test_before_anything_is_used_any_stamp_is_kept():
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE)
    pairing.setpoint(5 * MS, six(5))
    pairing.setpoint(MS, six(1))
    assert pairing.find(MS).nu_d == six(1)


def test_reset_forgets_what_was_used_and_keeps_what_waits():
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE)
    pairing.setpoint(MS, six(1))
    pairing.setpoint(9 * MS, six(9))
    pairing.find(MS)
    pairing.reset()
    assert pairing.find(2 * MS) is None
    assert pairing.find(9 * MS) == Reference(9 * MS, six(9), ZERO)
    pairing.reset()
    pairing.setpoint(MS, six(4))
    assert pairing.find(2 * MS) == Reference(MS, six(4), ZERO)


def test_the_oldest_go_when_there_is_no_room():
    pairing = SetpointBuffer(exact=True, acceleration=DIFFERENCE)
    for k in range(CAPACITY + 10):
        pairing.setpoint(k, six(k))
    assert pairing.find(9) is None
    assert pairing.find(10).nu_d == six(10)
    assert pairing.find(CAPACITY + 9).nu_d == six(CAPACITY + 9)


def test_what_was_used_is_not_kept():
    pairing = SetpointBuffer(exact=True, acceleration=SAME)
    for k in range(3):
        pairing.setpoint(k, six(k))
        pairing.derivative(k, six(k))
    pairing.find(1)
    assert pairing.find(0) is None
    assert pairing.find(2) is not None


def test_what_is_not_believed_is_refused() -> None:
    pairing = SetpointBuffer(
        exact=True, acceleration=SAME, limits=Limits(speed=2.0, acceleration=5.0)
    )
    with pytest.raises(ValueError, match=r'twist\.linear: expected at most 2 m/s, found 3'):
        pairing.setpoint(0, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r'accel\.angular: expected at most 5 rad/s2, found 6'):
        pairing.derivative(0, (0.0, 0.0, 0.0, 0.0, 0.0, 6.0))
    assert pairing.find(0) is None


def test_a_bounded_difference_ends_with_the_interval_that_it_was_taken_over() -> None:
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE, steepest=(0.2,) * 6)
    for ms, value in ((0, 0.0), (100, 0.01), (200, 0.5), (200.1, 0.505)):
        pairing.setpoint(round(ms * MS), six(value))
        slope = pairing.find(round(ms * MS)).nu_d_dot
    assert slope == six(0.2), 'two that come back to back'
    assert pairing.find(205 * MS).nu_d_dot == six(0.2)
    assert pairing.find(206 * MS) == Reference(200_100_000, six(0.505), ZERO)
    pairing.setpoint(300 * MS, six(0.515))
    assert pairing.find(400 * MS - 100_000).nu_d_dot == pytest.approx(six(0.01 / 0.0999))
    assert pairing.find(400 * MS).nu_d_dot == ZERO


def test_an_acceleration_from_its_topic_is_held_with_its_set_point() -> None:
    pairing = SetpointBuffer(exact=False, acceleration=SAME, steepest=(0.2,) * 6)
    for k in (0, 10):
        pairing.setpoint(k * MS, six(1.0))
        pairing.derivative(k * MS, six(7.0))
        for ms in (k, k + 1, k + 9):
            assert pairing.find(ms * MS) == Reference(k * MS, six(1.0), six(7.0))


def test_a_stamp_of_another_time_is_refused_and_leaves_what_lies_ahead() -> None:
    pairing = SetpointBuffer(exact=False, acceleration=SAME, steepest=(0.2,) * 6)
    for s in (100, 101, 102):
        pairing.setpoint(s * 1000 * MS, six(s))
        pairing.derivative(s * 1000 * MS, six(-s))
    assert pairing.find(100_500 * MS).nu_d == six(100)
    for keep in (pairing.setpoint, pairing.derivative):
        with pytest.raises(ValueError, match='stamp late'):
            keep(0, six(0.0))  # without a stamp
    assert pairing.find(101_500 * MS) == Reference(101_000 * MS, six(101), six(-101))
    with pytest.raises(ValueError, match='stamp late'):
        pairing.setpoint(41_000 * MS, six(0.0))  # late, but of this time: of another publisher
    assert pairing.find(103_000 * MS).nu_d == six(101)


@pytest.mark.parametrize('acceleration', [NONE, FILTER])
def test_without_a_difference_the_derivative_is_zero(acceleration) -> None:
    pairing = SetpointBuffer(exact=False, acceleration=acceleration)
    for k in range(2):
        pairing.setpoint(k * MS, six(k))
        assert pairing.find(k * MS) == Reference(k * MS, six(k), (0.0,) * 6)


def test_a_jump_of_the_set_point_has_no_derivative() -> None:
    limits = Limits(acceleration=100.0)
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE, limits=limits)
    pairing.setpoint(0, (0.0,) * 6)
    assert pairing.find(0) is not None
    pairing.setpoint(10_000_000, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert pairing.find(10_000_000).nu_d_dot[0] == pytest.approx(50.0)
    pairing.setpoint(20_000_000, (2.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert pairing.find(20_000_000).nu_d_dot == (0.0,) * 6


def test_a_set_point_that_came_out_of_order_is_not_gone_back_to():
    pairing = SetpointBuffer(exact=False, acceleration=SAME)
    for k in (20, 50, 10):
        pairing.setpoint(k * MS, six(k))
        pairing.derivative(k * MS, six(-k))
    for k in (30, 35, 49):
        assert pairing.find(k * MS) == Reference(20 * MS, six(20), six(-20))
    assert pairing.find(50 * MS).ns == 50 * MS


@given(stamps=st.lists(st.integers(0, 9), max_size=30))
@examples(15)
def test_of_columns_those_are_followed_that_are_kept_one_by_one(stamps):
    pairing = SetpointBuffer(exact=False, acceleration=NONE, steepest=(1.0,) * 6)
    for k, ns in enumerate(stamps):
        with contextlib.suppress(ValueError):
            pairing.setpoint(ns, six(float(k)))
    kept = followed(np.array(stamps, np.int64)).tolist()
    for now in range(10):
        found = pairing.find(now)
        earlier = [k for k in kept if stamps[k] <= now]
        assert (found and found.nu_d) == (six(float(earlier[-1])) if earlier else None)
