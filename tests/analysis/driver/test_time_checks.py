"""Rate, gaps, order, age and drift of stamps."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.made_odometry import BEGAN, found_in, healthy, motion, odometry_log

from auv_analysis.driver.evidence import FAIL, NOT_CHECKED, PASS, CheckResult
from auv_analysis.driver.odometry_log import OdometryBuffer, OdometryLog

pytestmark = pytest.mark.usefixtures('approved')

SECOND = 10**9


def timing_of(heard: OdometryLog, **settings: object) -> dict[str, CheckResult]:
    return found_in(heard, 'rate', 'gaps', 'stamps', 'age', 'drift', **settings)


def stamped(stamps: np.ndarray) -> OdometryLog:
    return healthy(stamp_ns=np.asarray(stamps).astype(np.int64))


def failed(heard: OdometryLog, **settings: object) -> set[str]:
    return {id for id, one in timing_of(heard, **settings).items() if one.verdict == FAIL}


def test_a_healthy_recording_passes() -> None:
    found = timing_of(healthy())
    assert {one.verdict for one in found.values()} == {PASS}
    assert found['rate'].numbers['rate_hz'] == pytest.approx(50.0)
    assert found['age'].numbers['age_median_s'] == pytest.approx(0.004)
    assert found['drift'].numbers['drift'] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ('rate', 'expected', 'verdict'),
    [(2.0, None, FAIL), (9.0, None, FAIL), (11.0, None, PASS), (50.0, 50.0, PASS),
     (50.0, 60.0, FAIL), (50.0, 20.0, FAIL)],
)  # fmt: skip
def test_a_rate_is_that_which_was_promised_or_enough(rate, expected, verdict) -> None:
    heard = odometry_log(motion(rate=rate), rate)
    finding = timing_of(heard, rate=expected)['rate']
    assert finding.verdict == verdict
    assert finding.numbers['rate_hz'] == pytest.approx(rate, rel=0.01)


def test_a_silence_in_the_middle_and_at_the_end_fail() -> None:
    heard = healthy()
    late = heard.arrived_ns + np.where(np.arange(500) >= 250, round(0.6 * SECOND), 0)
    ended = healthy(ended_ns=int(heard.arrived_ns[-1]) + SECOND)
    middle = healthy(arrived_ns=late, ended_ns=int(late[-1]))
    for one, longest in ((middle, 0.62), (ended, 1.0)):
        finding = timing_of(one)['gaps']
        assert finding.verdict == FAIL
        assert finding.numbers['longest_s'] == pytest.approx(longest)


def test_frozen_stamps_fail() -> None:
    stamps = np.full(500, healthy().stamp_ns[0])
    found = timing_of(stamped(stamps))
    assert found['stamps'].verdict == found['age'].verdict == FAIL
    assert '499 repeated' in found['stamps'].found
    assert found['drift'].verdict == NOT_CHECKED


def test_zero_stamps_are_told_as_such() -> None:
    finding = timing_of(stamped(np.zeros(500)))['stamps']
    assert finding.verdict == FAIL
    assert '499 repeated and 499 zero' in finding.found
    assert 'stamp each message' in finding.advice


def test_negative_stamps_fail() -> None:
    finding = timing_of(stamped(healthy().stamp_ns - 2 * BEGAN))['stamps']
    assert finding.verdict == FAIL
    assert '500 negative or with 1e9 ns and more' in finding.found


@pytest.mark.parametrize(
    ('fault', 'word'),
    [('twice', 'seen'), ('back', 'never set back'), ('ahead', 'limits.gap')],
)
def test_stamps_that_do_not_rise_by_little_fail(fault: str, word: str) -> None:
    stamps = healthy().stamp_ns.copy()
    if fault == 'twice':
        stamps[10] = stamps[9]
    elif fault == 'back':
        stamps[10:] -= round(0.5 * SECOND)
    else:
        stamps[10:] += 2 * SECOND
    finding = timing_of(stamped(stamps))['stamps']
    assert finding.verdict == FAIL
    assert word in finding.advice


def test_a_jump_within_limits_gap_is_integrated_and_no_fault() -> None:
    stamps = healthy().stamp_ns.copy()
    stamps[10:] += round(0.7 * SECOND)
    assert found_in(stamped(stamps), 'stamps')['stamps'].verdict == PASS


@pytest.mark.parametrize(
    ('age', 'verdict'), [(0.2, PASS), (0.3, FAIL), (5.0, FAIL), (-0.015, PASS), (-0.1, FAIL)]
)
def test_stamps_that_are_old_or_of_the_future_fail(age: float, verdict: str) -> None:
    heard = healthy()
    finding = timing_of(stamped(heard.arrived_ns - round(age * SECOND)))['age']
    assert finding.verdict == verdict
    assert ('disciplined' in finding.advice or 'ahead of ours' in finding.advice) == (
        verdict == FAIL
    )


def test_another_epoch_is_no_age_and_gets_advice() -> None:
    heard = healthy()
    found = timing_of(stamped(heard.stamp_ns - BEGAN + 3 * SECOND))
    assert found['age'].verdict == NOT_CHECKED
    assert 'another epoch' in found['age'].found
    assert 'stamp_clock: own' in found['age'].advice
    assert 'the start of the computer' in found['age'].found
    assert found['stamps'].verdict == found['drift'].verdict == PASS
    later = found_in(stamped(heard.stamp_ns + 3 * 86_400 * SECOND), 'age')['age']
    assert later.verdict == NOT_CHECKED
    assert 'another day' in later.found


@pytest.mark.parametrize(('drift', 'verdict'), [(0.001, PASS), (0.02, FAIL), (-0.02, FAIL)])
def test_a_clock_that_runs_at_another_speed_fails(drift: float, verdict: str) -> None:
    heard = healthy()
    stamps = BEGAN + (heard.stamp_ns - BEGAN) * (1.0 + drift)
    finding = timing_of(stamped(stamps))['drift']
    assert finding.verdict == verdict
    assert finding.numbers['drift'] == pytest.approx(drift, abs=1e-6)


def test_simulated_time_is_compared_with_the_clock() -> None:
    heard = healthy()
    step = SECOND // 10
    stamps = 10 * SECOND + np.arange(500) * step
    # /clock follows each odometry, four times as fast as ours
    arrived = BEGAN + np.arange(500) * step // 4
    simulated = replace(
        heard, stamp_ns=stamps, arrived_ns=arrived, ended_ns=int(arrived[-1]),
        clock_ns=stamps, clock_arrived_ns=arrived + 1,
    )  # fmt: skip
    found = timing_of(simulated, sim_time=True)
    assert found['age'].verdict == found['drift'].verdict == PASS
    assert found['age'].numbers['age_median_s'] == pytest.approx(-0.1)  # a step of the clock
    assert timing_of(simulated)['age'].verdict == NOT_CHECKED
    old = replace(simulated, stamp_ns=stamps - SECOND)
    assert failed(old, sim_time=True) == {'age'}
    assert timing_of(heard, sim_time=True)['age'].verdict == NOT_CHECKED  # no /clock
    stands = replace(heard, clock_ns=stamps[:3], clock_arrived_ns=heard.arrived_ns[:3] - 1)
    assert timing_of(stands, sim_time=True)['drift'].found == 'simulated time stood still'


def test_a_buffer_counts_what_the_middleware_numbered_and_lost() -> None:
    buffer = OdometryBuffer()
    for number in (1, 2, 5, 6, 9):
        buffer.odometry(number, number, number, (0.0,) * 13, ('a', 'b'), number)
    buffer.unreadable('/odom', 10)  # which has arrived
    buffer.odometry(11, 11, 11, (0.0,) * 13, ('a', 'b'), 11)
    assert buffer.log(0, 10).lost == 4
    buffer.odometry(12, 12, 12, (0.0,) * 13, ('a', 'b'), 1)  # a publisher that was started again
    assert buffer.log(0, 10).lost == 4
    assert len(buffer) == 7
    assert timing_of(buffer.log(0, 10))['gaps'].numbers['lost'] == 4


def test_a_single_message_is_no_rate() -> None:
    heard = odometry_log(motion()[:1])
    assert timing_of(heard)['rate'].verdict == FAIL
    assert timing_of(heard)['drift'].verdict == NOT_CHECKED
