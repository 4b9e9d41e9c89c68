"""Which odometry may be used: stamps, jumps and speeds."""

import math

import pytest

from auv_gvc_controller.control.odometry_guard import Limits, Now, OdometryGuard, StampAge

MS = 1_000_000
SLOW = (0.1, 0.0, 0.0, 0.0, 0.0, 0.05)


def make(lockstep: bool = False) -> OdometryGuard:
    return OdometryGuard(100 * MS, Limits(speed=5.0, rate=2.0), lockstep)


def test_time_between_stamps():
    guard = make()
    found = [guard.accept(ns * MS, SLOW) for ns in (1000, 1010, 1030, 1130)]
    assert found == [0.0, 0.01, 0.02, 0.1]
    assert guard.last == 1130 * MS


@pytest.mark.parametrize('lockstep', [True, False])
def test_a_stamp_that_does_not_go_forward_is_refused(lockstep):
    guard = make(lockstep)
    guard.accept(1000 * MS, SLOW)
    for ns in (1000 * MS, 999 * MS, 0):
        word = 'repeated' if ns == 1000 * MS else 'went back'
        line = f'stamp {word}: expected later than {1000 * MS} ns, found {ns} ns'
        with pytest.raises(ValueError, match=line):
            guard.accept(ns, SLOW)
    assert guard.accept(1010 * MS, SLOW) == 0.01


@pytest.mark.parametrize('lockstep', [True, False])
def test_one_stray_stamp_does_not_lock_out_the_others(lockstep):
    guard = make(lockstep)
    guard.accept(1000 * MS, SLOW)
    line = f'stamp jumped: expected at most {1100 * MS} ns, found {9000 * MS} ns'
    with pytest.raises(ValueError, match=line):
        guard.accept(9000 * MS, SLOW)
    assert guard.accept(1010 * MS, SLOW) == 0.01
    assert guard.last == 1010 * MS


def test_real_time_believes_the_second_after_a_jump_and_integrates_nothing():
    guard = make()
    guard.accept(1000 * MS, SLOW)
    with pytest.raises(ValueError, match='stamp jumped: expected at most'):
        guard.accept(9000 * MS, SLOW)
    assert guard.accept(9010 * MS, SLOW) == 0.0
    assert guard.accept(9020 * MS, SLOW) == 0.01


def test_two_stray_stamps_apart_are_both_refused():
    guard = make()
    guard.accept(1000 * MS, SLOW)
    for ns in (9000, 20000, 8000):
        with pytest.raises(ValueError, match='stamp jumped: expected at most'):
            guard.accept(ns * MS, SLOW)
    assert guard.accept(1010 * MS, SLOW) == 0.01


def test_a_good_stamp_clears_the_suspicion():
    guard = make()
    guard.accept(1000 * MS, SLOW)
    for ns in (9000, 9010):
        with pytest.raises(ValueError, match='stamp jumped: expected at most'):
            guard.accept(ns * MS, SLOW)
        guard.accept(guard.last + 10 * MS, SLOW)


def test_lockstep_never_believes_a_jump():
    guard = make(lockstep=True)
    guard.accept(1000 * MS, SLOW)
    for ns in (9000, 9010, 9020):
        with pytest.raises(ValueError, match='stamp jumped: expected at most'):
            guard.accept(ns * MS, SLOW)


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
        guard.accept(0, nu)
    assert guard.last is None
    guard.accept(1000 * MS, SLOW)
    with pytest.raises(ValueError, match=line):
        guard.accept(1010 * MS, nu)
    assert guard.accept(1020 * MS, SLOW) == 0.02


def test_the_largest_speeds_themselves_are_believed():
    assert make().accept(0, (3.0, 4.0, 0.0, 0.0, 0.0, -2.0)) == 0.0


def aged(clock: str, most: float = 0.5) -> OdometryGuard:
    age = StampAge(clock, most)
    return OdometryGuard(100 * MS, Limits(5.0, 2.0), lockstep=False, patience=0.5, age=age)


def restart(guard: OdometryGuard, first: int, at: float, ros_ns: int = 0) -> float:
    """Two odometry that follow each other from `first` ms on."""
    with pytest.raises(ValueError, match='stamp went back'):
        guard.accept(first * MS, SLOW, Now(at, ros_ns))
    return guard.accept((first + 10) * MS, SLOW, Now(at + 0.01, ros_ns))


def test_stamps_that_went_back_are_believed_only_where_time_had_stopped():
    guard = aged('auto')
    guard.accept(9000 * MS, SLOW, Now(9.0))
    for ns, at in ((100, 9.1), (110, 9.2), (120, 9.4)):  # late ones, in a row
        with pytest.raises(ValueError, match='stamp went back: expected later than'):
            guard.accept(ns * MS, SLOW, Now(at))
    assert restart(guard, 400, 9.6) == 0.0
    assert guard.restarts == 1
    assert guard.accept(420 * MS, SLOW, Now(9.62)) == 0.01


def test_a_frozen_stamp_is_never_believed():
    guard = aged('auto')
    guard.accept(9000 * MS, SLOW, Now(9.0))
    for i in range(100):
        with pytest.raises(ValueError, match='stamp repeated: expected later than'):
            guard.accept(9000 * MS, SLOW, Now(9.0 + 0.1 * i))


DAY = 86_400 * 1000  # ms


def test_the_age_counts_where_both_clocks_have_the_same_beginning():
    guard, wall = aged('auto'), 20_000 * DAY
    guard.accept(wall * MS, SLOW, Now(1.0, (wall + 20) * MS))
    with pytest.raises(ValueError, match=r'stamp old: expected at most 0\.5 s, found 0\.6 s'):
        guard.accept((wall + 10) * MS, SLOW, Now(1.6, (wall + 610) * MS))
    with pytest.raises(
        ValueError, match=r'ahead of the clock: expected at most 0\.5 s .*, found 0\.7 s'
    ):
        guard.accept((wall + 20) * MS, SLOW, Now(1.0, (wall - 680) * MS))
    assert guard.accept((wall + 90) * MS, SLOW, Now(1.1, (wall + 100) * MS)) == 0.09


@pytest.mark.parametrize('ros_ns', [20_000 * DAY * MS, 0], ids=['years apart', 'not begun'])
@pytest.mark.parametrize('clock', ['own', 'auto'])
def test_a_free_running_clock_is_compared_with_its_freshest_stamp(clock, ros_ns):
    guard = aged(clock)
    for i in range(10):
        guard.accept(10 * i * MS, SLOW, Now(100.0 + 0.01 * i, ros_ns))
    guard.accept(100 * MS, SLOW, Now(100.5, ros_ns))  # 0.4 s on its way
    with pytest.raises(ValueError, match='stamp old: expected at most'):
        guard.accept(110 * MS, SLOW, Now(100.7, ros_ns))
    assert guard.accept(200 * MS, SLOW, Now(100.3, ros_ns)) == 0.1
    assert restart(guard, 5, 101.0, ros_ns) == 0.0  # and it may begin anew
    assert guard.accept(25 * MS, SLOW, Now(101.02, ros_ns)) == 0.01
    with pytest.raises(ValueError, match=r'stamp (old|ahead of the clock)'):
        aged('ros').accept(20 * 365 * DAY * MS // 3, SLOW, Now(1.0, ros_ns))


def test_free_running_clocks_may_drift_apart():
    """300 ppm make 1.1 s an hour; no stamp is ever older than a moment."""
    guard = aged('own', most=0.05)
    for i in range(36_000):
        guard.accept(100 * i * MS, SLOW, Now(0.1 * i * 1.0003))


@pytest.mark.parametrize(('days', 'anew'), [(0.9, False), (1.1, True)])
def test_a_clock_that_is_set_to_another_day_begins_anew(days, anew):
    guard = make()
    guard.accept(0, SLOW)
    guard.accept(10 * MS, SLOW)
    then = round(days * 86_400_000) * MS
    with pytest.raises(ValueError, match='stamp jumped'):
        guard.accept(then, SLOW)
    assert guard.accept(then + 10 * MS, SLOW) == 0.0
    assert (guard.origin, guard.restarts) == ((then, 1) if anew else (0, 0))
