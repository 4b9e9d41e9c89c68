"""Wrenches are sent at a steady rate, and the last ones are zero whatever happens."""

import signal
import threading
from contextlib import nullcontext
from itertools import groupby

import numpy as np
import pytest
from helpers.simulated_driver import SimulatedDriver, planned

from auv_analysis.driver.excitation import (
    GOODBYE,
    PERIOD,
    RECENT,
    TOO_FAST,
    AbortError,
    MotionGuard,
    actuate,
    carry_out,
)
from auv_analysis.driver.odometry_log import OdometryBuffer
from auv_analysis.driver.plan import LEVEL, PULSE, REST, SETTLE, UNHEARD, plan_of
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import ENDING, on_signals

ZERO = (0.0,) * 6
LAST = round(GOODBYE / PERIOD)


def sent_by(driver: SimulatedDriver, stopped=lambda: False):
    plan = planned(driver.vehicle, ('surge', 'yaw'), 0.1, None, None)
    return carry_out(driver, plan, 0.5, stopped)


def test_it_begins_and_ends_with_zero_and_goes_both_ways() -> None:
    driver = SimulatedDriver()
    excitation = sent_by(driver)
    assert not excitation.aborted
    assert [one.trial.dof for one in excitation.sent] == ['surge', 'yaw', 'surge']
    assert driver.sent[0] == ZERO
    assert driver.sent[-LAST:] == [ZERO] * LAST
    goodbye = driver.now_ns() - excitation.sent[-1].ended_ns
    assert goodbye == pytest.approx(GOODBYE * 1e9), 'as steadily as the others'
    rows = np.array(driver.sent)
    assert rows[:, 0].max() == -rows[:, 0].min() > 0
    assert rows[:, 5].max() == -rows[:, 5].min() > 0
    assert not rows[:, 1:5].any()
    apart = np.diff([ns for ns, _ in excitation.sent[0].steps]) / 1e9
    np.testing.assert_allclose(apart, PERIOD)


def test_parts_end_by_the_clock_where_each_period_overruns() -> None:
    driver, overrun = SimulatedDriver(), 0.02
    listen = driver.listen
    driver.listen = lambda seconds: listen(seconds + overrun)
    surge, _, silent = sent_by(driver).sent
    began = [next(run)[0] for _, run in groupby(surge.steps, key=lambda step: step[1])]
    lengths = np.diff([*began, surge.ended_ns]) / 1e9
    np.testing.assert_allclose(lengths, [SETTLE, PULSE, PULSE, REST], atol=PERIOD + overrun)
    unheard = (silent.ended_ns - silent.steps[-1][0]) / 1e9
    assert unheard == pytest.approx(UNHEARD, abs=2 * (PERIOD + overrun))


@pytest.mark.parametrize(
    ('fault', 'word'),
    [
        ('silent_after', 'no odometry for 0.5 s'),
        ('fast_after', 'm/s'),
        ('joined_after', '/somebody'),
    ],
)
def test_what_must_end_it_ends_it_with_zero(fault: str, word: str) -> None:
    driver = SimulatedDriver(**{fault: 1.0})
    excitation = sent_by(driver)
    assert word in excitation.aborted
    assert driver.sent[-LAST:] == [ZERO] * LAST
    assert len(driver.sent) < 1.8 / PERIOD + LAST
    assert not excitation.sent[-1].ended_ns


def test_the_vehicle_is_looked_at_while_nothing_is_sent_as_well() -> None:
    plan = planned(SimulatedDriver().vehicle, ('surge', 'yaw'), 0.1, None, None)
    in_silence = sum(trial.seconds for trial in plan.trials) - UNHEARD / 2
    driver = SimulatedDriver(fast_after=in_silence)
    excitation = sent_by(driver)
    assert 'm/s' in excitation.aborted
    assert excitation.sent[-1].trial.silent
    assert driver.sent[-LAST:] == [ZERO] * LAST


def test_a_vehicle_that_moves_already_gets_nothing_but_zero() -> None:
    driver = SimulatedDriver(fast_after=0.0)
    found = sent_by(driver)
    assert found.aborted.endswith(f'already, over {TOO_FAST * found.plan.speed:.3g}')
    assert set(driver.sent) == {ZERO}


@pytest.mark.parametrize(
    ('surge', 'yaw', 'word'),
    [
        (0.54, 0.29, ''),
        (0.56, 0.0, '0.56 m/s or rad/s, more than 0.55'),
        (0.2, 0.31, '0.31 m/s or rad/s, more than 0.3'),
    ],
)
def test_a_drift_is_let_pass_and_leaves_the_turning_its_limit(surge, yaw, word: str) -> None:
    buffer = OdometryBuffer()

    def heard(u: float, r: float) -> None:
        for _ in range(RECENT):
            buffer.odometry(0, 0, 0, (*LEVEL[:7], u, *(4 * [0.0]), r), ('', ''), None)

    driver = SimulatedDriver()
    driver.buffer, driver.now_ns = buffer, lambda: 0
    heard(0.25, 0.0)
    guard = MotionGuard(driver, 0.1, 0.5, lambda: False)
    heard(surge, yaw)
    with pytest.raises(AbortError, match=word) if word else nullcontext():
        guard.look(0.1)


@pytest.mark.parametrize(('arrived', 'stamp', 'silent'), [(0.6, 0.0, False), (0.4, 1.0, True)])
def test_silence_is_counted_from_arrivals_whatever_the_stamps_say(arrived, stamp, silent) -> None:
    driver = SimulatedDriver()
    driver.buffer, driver.now_ns = OdometryBuffer(), lambda: 10**9
    ns = round(arrived * 1e9), round(stamp * 1e9)
    driver.buffer.odometry(*ns, 0, tuple(LEVEL), ('', ''), None)
    guard = MotionGuard(driver, 0.1, 0.5, lambda: False)
    with pytest.raises(AbortError, match='no odometry') if silent else nullcontext():
        guard.look(0.1)


def test_a_measurement_that_is_repeated_is_silence() -> None:
    driver, now = SimulatedDriver(), 0
    driver.buffer, driver.now_ns = OdometryBuffer(), lambda: now
    guard = MotionGuard(driver, 0.1, 0.5, lambda: False)
    for now, stamp in ((0, 7), (200_000_000, 8), (400_000_000, 8), (700_000_000, 8)):
        driver.buffer.odometry(now, stamp, 0, tuple(LEVEL), ('', ''), None)
        guard.look(0.1)
    now = 701_000_000
    driver.buffer.odometry(now, 8, 0, tuple(LEVEL), ('', ''), None)
    with pytest.raises(AbortError, match='no odometry of a new stamp for'):
        guard.look(0.1)


def test_a_wrench_above_a_dead_band_leaves_the_others_their_speed() -> None:
    heavy = load_vehicle('bluerov2_heavy')  # whose file tells the dead band of its thrusters
    plan = plan_of(heavy, ['surge', 'yaw'], 0.01, None, None, raised=0.5)
    surge, yaw, _ = plan.trials
    assert surge.speed == 0.01 or surge.turns
    assert yaw.turns
    assert 0.01 < yaw.speed < 0.5
    assert plan.speed == max(one.speed for one in plan.trials)


def test_nan_is_too_fast() -> None:
    driver = SimulatedDriver(mapping=lambda tau: tau * (np.nan if tau.any() else 1.0))
    assert 'nan' in sent_by(driver).aborted
    assert driver.sent[-LAST:] == [ZERO] * LAST


def test_a_user_who_wants_an_end_gets_it_and_the_vehicle_gets_zero() -> None:
    driver = SimulatedDriver()
    with pytest.raises(KeyboardInterrupt):
        sent_by(driver, stopped=lambda: len(driver.sent) > SETTLE / PERIOD + 15)
    assert any(tau != ZERO for tau in driver.sent)
    assert driver.sent[-LAST:] == [ZERO] * LAST


@pytest.mark.parametrize('number', ENDING)
def test_a_signal_is_no_exception_but_a_wish_while_wrenches_are_sent(number: int) -> None:
    driver, stop = SimulatedDriver(), threading.Event()
    before = signal.getsignal(number)

    def stopped() -> bool:
        if len(driver.sent) == 40:
            signal.raise_signal(number)
        return stop.is_set()

    with pytest.raises(KeyboardInterrupt), on_signals(stop.set):
        sent_by(driver, stopped)
    assert len(driver.sent) == 40 + LAST
    assert driver.sent[-LAST:] == [ZERO] * LAST
    assert signal.getsignal(number) == before


def test_a_hang_up_that_nohup_ignores_is_no_wish() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    stop = threading.Event()
    try:
        with on_signals(stop.set):
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
    assert not stop.is_set()


def test_nothing_is_sent_where_another_begins_to_command_in_the_countdown(monkeypatch) -> None:
    driver, asked = SimulatedDriver(joined_after=0.0), []
    driver.advertise = lambda: asked.append('advertise')
    driver.retire = lambda: asked.append('retire')
    monkeypatch.setattr('auv_analysis.driver.excitation.COUNTDOWN', 0)
    plan = planned(driver.vehicle, ('surge',), 0.1, None, None)
    excitation = actuate(driver, plan, 0.5)
    assert excitation.aborted == '/somebody publishes the wrench as well'
    assert driver.sent == []
    assert asked == ['advertise', 'retire']


def test_a_user_who_wants_an_end_in_the_countdown_gets_it_before_anything_is_sent() -> None:
    driver, asked = SimulatedDriver(), []
    driver.advertise = lambda: asked.append('advertise')
    driver.retire = lambda: asked.append('retire')
    driver.listen = lambda _: asked.append('listen') or signal.raise_signal(signal.SIGINT)
    plan = planned(driver.vehicle, ('surge',), 0.1, None, None)
    with pytest.raises(KeyboardInterrupt):
        actuate(driver, plan, 0.5)
    assert asked == ['advertise', 'listen', 'retire']
    assert driver.sent == []


def test_nothing_is_sent_to_a_driver_that_does_not_hear_it(monkeypatch) -> None:
    driver = SimulatedDriver()
    driver.advertise, driver.retire = lambda: False, lambda: None
    for name in ('COUNTDOWN', 'MATCHES', 'LOOK_AGAIN'):
        monkeypatch.setattr(f'auv_analysis.driver.excitation.{name}', 0)
    plan = planned(driver.vehicle, ('surge',), 0.1, None, None)
    assert 'does not hear' in actuate(driver, plan, 0.5).aborted
    assert driver.sent == []


def test_any_other_error_ends_it_with_zero_as_well() -> None:
    driver = SimulatedDriver()

    def broken() -> bool:
        if len(driver.sent) > 40:
            raise OSError('the network is gone')
        return False

    with pytest.raises(OSError, match='network'):
        sent_by(driver, stopped=broken)
    assert driver.sent[-LAST:] == [ZERO] * LAST
