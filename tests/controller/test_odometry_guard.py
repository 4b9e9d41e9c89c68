"""Which odometry may be used: stamps, jumps and speeds."""

import math

import pytest

from auv_gvc_controller.limits import Limits
from auv_gvc_controller.odometry_guard import OdometryGuard

MS = 1_000_000
SLOW = (0.1, 0.0, 0.0, 0.0, 0.0, 0.05)


def make(lockstep: bool = False) -> OdometryGuard:
    return OdometryGuard(100 * MS, Limits(speed=5.0, rate=2.0), lockstep)


def test_time_between_stamps():
    guard = make()
    found = [guard.elapsed(ns * MS, SLOW) for ns in (1000, 1010, 1030, 1130)]
    assert found == [0.0, 0.01, 0.02, 0.1]
    assert guard.last == 1130 * MS


@pytest.mark.parametrize('lockstep', [True, False])
def test_a_stamp_that_does_not_go_forward_is_refused(lockstep):
    guard = make(lockstep)
    guard.elapsed(1000 * MS, SLOW)
    for ns in (1000 * MS, 999 * MS, 0):
        line = f'stamp: expected later than {1000 * MS} ns, found {ns} ns'
        with pytest.raises(ValueError, match=line):
            guard.elapsed(ns, SLOW)
    assert guard.elapsed(1010 * MS, SLOW) == 0.01


@pytest.mark.parametrize('lockstep', [True, False])
def test_one_stray_stamp_does_not_lock_out_the_others(lockstep):
    guard = make(lockstep)
    guard.elapsed(1000 * MS, SLOW)
    line = f'stamp: expected at most {1100 * MS} ns, found {9000 * MS} ns'
    with pytest.raises(ValueError, match=line):
        guard.elapsed(9000 * MS, SLOW)
    assert guard.elapsed(1010 * MS, SLOW) == 0.01
    assert guard.last == 1010 * MS


def test_real_time_believes_the_second_after_a_jump_and_integrates_nothing():
    guard = make()
    guard.elapsed(1000 * MS, SLOW)
    with pytest.raises(ValueError, match='stamp: expected at most'):
        guard.elapsed(9000 * MS, SLOW)
    assert guard.elapsed(9010 * MS, SLOW) == 0.0
    assert guard.elapsed(9020 * MS, SLOW) == 0.01


def test_two_stray_stamps_apart_are_both_refused():
    guard = make()
    guard.elapsed(1000 * MS, SLOW)
    for ns in (9000, 20000, 8000):
        with pytest.raises(ValueError, match='stamp: expected at most'):
            guard.elapsed(ns * MS, SLOW)
    assert guard.elapsed(1010 * MS, SLOW) == 0.01


def test_a_good_stamp_clears_the_suspicion():
    guard = make()
    guard.elapsed(1000 * MS, SLOW)
    for ns in (9000, 9010):
        with pytest.raises(ValueError, match='stamp: expected at most'):
            guard.elapsed(ns * MS, SLOW)
        guard.elapsed(guard.last + 10 * MS, SLOW)


def test_lockstep_never_believes_a_jump():
    guard = make(lockstep=True)
    guard.elapsed(1000 * MS, SLOW)
    for ns in (9000, 9010, 9020):
        with pytest.raises(ValueError, match='stamp: expected at most'):
            guard.elapsed(ns * MS, SLOW)


@pytest.mark.parametrize(
    ('nu', 'line'),
    [
        ((4.0, 4.0, 0, 0, 0, 0), 'twist.linear: expected at most 5 m/s, found 5.65'),
        ((0, 0, -5.1, 0, 0, 0), 'twist.linear: expected at most 5 m/s, found 5.1'),
        ((0, 0, 0, 1.5, 0, -1.5), 'twist.angular: expected at most 2 rad/s, found 2.1'),
        ((math.inf, 0, 0, 0, 0, 0), 'twist.linear: expected at most 5 m/s, found inf'),
    ],
)
def test_speeds_that_do_not_exist_are_refused(nu, line):
    guard = make()
    with pytest.raises(ValueError, match=line):
        guard.elapsed(0, nu)
    assert guard.last is None
    guard.elapsed(1000 * MS, SLOW)
    with pytest.raises(ValueError, match=line):
        guard.elapsed(1010 * MS, nu)
    assert guard.elapsed(1020 * MS, SLOW) == 0.02


def test_the_largest_speeds_themselves_are_believed():
    assert make().elapsed(0, (3.0, 4.0, 0.0, 0.0, 0.0, -2.0)) == 0.0


def test_reset_starts_anew():
    guard = make(lockstep=True)
    guard.elapsed(1000 * MS, SLOW)
    guard.reset()
    assert guard.elapsed(5 * MS, SLOW) == 0.0
    assert guard.elapsed(10 * MS, SLOW) == 0.005
