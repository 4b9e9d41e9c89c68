"""The velocity controller between its guards: pairing, silence, gaps, limits, recovery."""

import contextlib
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_dynamics import load_vehicle
from auv_gvc_controller.control.controller import OutputStage, Timeouts, VelocityController
from auv_gvc_controller.control.odometry_guard import ZERO, Limits, Now, OdometryGuard
from auv_gvc_controller.control.sampled_law import SampledLaw
from auv_gvc_controller.control.setpoint_buffer import (
    DIFFERENCE,
    SAME,
    ReferenceFilter,
    SetpointBuffer,
)
from auv_gvc_controller.laws.gvc import GVC
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

MS = 1_000_000
PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
MODEL = control_model(load_vehicle('rexrov'))
GAINS = make_gains('gvc', PAPER)
NU_D = (0.5, 0.0, -0.2, 0.0, 0.0, 0.1)
UP = (1.0, 0.0, 0.0, 0.0)
NU_D_DOT = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0)


def odometry(u: float = 0.1) -> tuple:
    return (0.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0, u, 0.0, 0.05, 0.0, 0.0, 0.02)


class Bench:
    """A controller with its pairing, and the law alone for comparison.

    In real time the clock on the wall shows what the stamps show, unless `at` (s) says otherwise.
    """

    def __init__(
        self,
        lockstep=False,
        exact=False,
        acceleration=DIFFERENCE,
        limit=(math.inf,) * 6,
        gains=GAINS,
        ramp=0.0,
        odometry=0.2,
        setpoint=0.05,
        steepest=None,
        reference=None,
    ):
        self.pairing = SetpointBuffer(exact, acceleration, steepest=steepest)
        self.controller = VelocityController(
            SampledLaw(gains, MODEL),
            self.pairing,
            OdometryGuard(100 * MS, Limits(50.0, 50.0), lockstep, patience=odometry),
            OutputStage(limit, ramp=ramp),
            timeouts=None if lockstep else Timeouts(odometry, setpoint),
            reference_filter=reference,
        )
        self.law = SampledLaw(gains, MODEL)

    def setpoint(self, ms: float, nu_d: tuple = NU_D, at: float | None = None) -> None:
        self.pairing.setpoint(round(ms * MS), nu_d, ms / 1000 if at is None else at)
        self.pairing.derivative(round(ms * MS), NU_D_DOT)

    def odometry(self, ms: float, u: float = 0.1, at: float | None = None):
        now = Now(ms / 1000 if at is None else at)
        return self.controller.odometry(round(ms * MS), odometry(u), now)

    def watch(self, at: float):
        return self.controller.watch(Now(at))

    def alone(self, t: float, dt: float, u: float = 0.1, nu_d=NU_D, nu_d_dot=ZERO):
        x = odometry(u)
        return self.law.sample(t, dt, x[7:], x[3:7], nu_d, nu_d_dot)[0]


def lockstep_bench(**options) -> Bench:
    return Bench(lockstep=True, exact=True, acceleration=SAME, **options)


def test_lockstep_answers_what_the_law_says():
    bench = lockstep_bench()
    for k in range(5):
        bench.setpoint(700 + 10 * k)
        answer = bench.odometry(700 + 10 * k, 0.1 * k)
        tau = bench.alone(0.01 * k, 0.01 if k else 0.0, 0.1 * k, nu_d_dot=NU_D_DOT)
        assert answer.ns == (700 + 10 * k) * MS
        assert answer.tau == tau
        assert answer.trouble == ''
        assert len(answer.f) == 6
    assert any(answer.f)


def test_exact_waits_for_the_set_point():
    bench = lockstep_bench()
    assert bench.controller.answer() is None
    assert bench.odometry(10) is None
    assert bench.controller.unanswered == 10 * MS
    bench.pairing.setpoint(10 * MS, NU_D)
    assert bench.controller.answer() is None  # nor without its derivative
    bench.pairing.derivative(10 * MS, NU_D_DOT)
    answer = bench.controller.answer()
    assert answer.ns == 10 * MS
    assert answer.tau == bench.alone(0.0, 0.0, nu_d_dot=NU_D_DOT)
    assert bench.controller.unanswered is None
    assert bench.controller.answer() is None  # once


def test_latest_without_a_set_point_is_a_zero_wrench_that_says_so():
    bench = Bench()
    answer = bench.odometry(10)
    assert (answer.ns, answer.tau, answer.f) == (10 * MS, ZERO, ZERO)
    assert answer.trouble == 'no set-point yet: zero wrench'
    assert bench.controller.unanswered is None


def test_the_law_starts_fresh_when_the_set_point_comes():
    bench = Bench()
    bench.odometry(0)
    bench.odometry(10)
    bench.setpoint(12)
    answer = bench.odometry(20)
    assert answer.trouble == ''
    assert answer.tau == bench.alone(0.02, 0.01)


def test_a_stale_set_point_is_a_zero_wrench_until_the_next():
    bench = Bench()
    bench.setpoint(0)
    bench.odometry(0)
    bench.alone(0.0, 0.0)
    assert bench.odometry(50).tau == bench.alone(0.05, 0.05)  # just not stale
    stale = bench.odometry(60, 0.4)
    assert stale.tau == stale.f == ZERO
    assert stale.trouble == 'no set-point for 0.06 s: zero wrench'
    bench.setpoint(65)
    bench.law.reset()  # its integrals are of before
    recovered = bench.odometry(70)
    assert recovered.trouble == ''
    assert recovered.tau == bench.alone(0.07, 0.01)
    bench.setpoint(75)
    assert bench.odometry(80).tau == bench.alone(0.08, 0.01)  # and then it integrates again


def test_lockstep_does_not_judge_the_age_of_a_set_point():
    bench = Bench(lockstep=True, exact=False)
    bench.setpoint(0)
    for ms in (0, 90, 180):
        assert bench.odometry(ms).trouble == ''


def test_a_gap_is_refused_then_believed_and_not_integrated():
    bench = Bench()
    bench.setpoint(0)
    bench.odometry(0)
    bench.alone(0.0, 0.0)
    with pytest.raises(ValueError, match='stamp jumped: expected at most'):
        bench.odometry(2000)
    bench.setpoint(2005)
    answer = bench.odometry(2010)
    assert answer.trouble == ''
    assert answer.tau == bench.alone(2.01, 0.0)
    assert bench.odometry(2020).tau == bench.alone(2.02, 0.01)


def test_refused_odometry_changes_nothing():
    bench, other = lockstep_bench(), lockstep_bench()
    for one in (bench, other):
        for ms in (0, 10):
            one.setpoint(ms)
        one.odometry(0)
    for ms in (0, -10, 5000):
        with pytest.raises(ValueError, match=r'stamp [a-z ]+: expected'):
            bench.odometry(ms)
    with pytest.raises(ValueError, match=r'twist\.linear: expected at most 50 m/s'):
        bench.odometry(10, 60.0)
    assert bench.odometry(10) == other.odometry(10)


@pytest.mark.parametrize('bad', [1e308, math.inf, -math.inf])
def test_no_wrench_is_ever_not_finite(bad):
    bench = Bench()
    bench.setpoint(0)
    bench.odometry(0)
    bench.alone(0.0, 0.0)
    bench.setpoint(10, (bad, 0.0, 0.0, 0.0, 0.0, 0.0))
    answer = bench.odometry(10)
    assert answer.tau == answer.f == ZERO
    assert 'not finite' in answer.trouble
    bench.controller.reset()
    bench.pairing.reset()
    bench.law.reset()
    bench.setpoint(20)
    again = bench.odometry(20)
    assert again.trouble == ''
    assert again.tau == bench.alone(0.02, 0.0)


def test_a_measurement_that_is_not_a_number_does_not_spoil_the_integrals():
    bench = Bench()
    for ms in (0, 10, 20, 30):
        bench.setpoint(ms, NU_D)
    bench.odometry(0)
    bench.alone(0.0, 0.0)
    with pytest.raises(ValueError, match=r'twist\.linear: expected at most 50 m/s, found nan'):
        bench.odometry(10, math.nan)
    assert bench.odometry(20).tau == bench.alone(0.02, 0.02)
    assert bench.odometry(30).tau == bench.alone(0.03, 0.01)


def test_a_law_that_is_not_finite_gives_no_wrench_and_keeps_its_integrals():
    bench = Bench()
    for ms, nu_d in ((0, NU_D), (10, (1e308,) * 6), (20, NU_D), (30, NU_D)):
        bench.setpoint(ms, nu_d)
    bench.odometry(0)
    bench.alone(0.0, 0.0)
    answer = bench.odometry(10)
    assert answer.tau == ZERO
    assert 'not finite' in answer.trouble
    assert np.isfinite(bench.odometry(30).tau).all()


def test_the_wrench_is_limited_per_axis():
    free, limit = lockstep_bench(), (50.0, 1e9, 30.0, 1e9, 1e9, 1e-3)
    held = lockstep_bench(limit=limit)
    for bench in (free, held):
        bench.setpoint(0)
    wanted, found = free.odometry(0).tau, held.odometry(0).tau
    assert_allclose(found, np.clip(wanted, -np.array(limit), limit))
    assert found[0] == 50.0
    assert found[2] == -30.0
    assert found != wanted


def test_reset_forgets_the_integrals():
    bench = lockstep_bench()
    for ms in (0, 10, 20):
        bench.setpoint(ms)
        bench.odometry(ms)
    bench.controller.reset()
    bench.setpoint(30)
    answer = bench.odometry(30)
    assert answer.tau == bench.alone(0.0, 0.0, nu_d_dot=NU_D_DOT)
    assert not any(answer.f)


def test_silence_answers_the_last_odometry_with_zero():
    bench = lockstep_bench()
    bench.setpoint(0)
    bench.odometry(0)
    bench.odometry(10)
    answer = bench.controller.silence()
    assert (answer.ns, answer.tau, answer.f) == (10 * MS, ZERO, ZERO)
    assert answer.trouble == ''
    assert bench.controller.unanswered is None
    bench.setpoint(10)
    assert bench.controller.answer() is None


def test_time_is_counted_from_the_first_odometry():
    seen = []

    class Clock(GVC):
        @staticmethod
        def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
            seen.append(t)
            return ZERO, ZERO

    bench = Bench(gains=Clock(*make_gains('gvc', PAPER)))
    bench.setpoint(5000)
    seen.clear()
    for ms in (5000, 5010, 5050):
        bench.odometry(ms)
    assert seen == [0.0, 0.01, 0.05]


def test_time_between_answers_is_integrated_when_an_odometry_goes_unanswered():
    bench = Bench(exact=True, acceleration=SAME)
    bench.setpoint(0)
    bench.odometry(0)
    bench.alone(0.0, 0.0, nu_d_dot=NU_D_DOT)
    assert bench.odometry(10) is None  # its set-point comes too late
    bench.setpoint(20)
    tau = bench.odometry(20).tau
    assert tau == bench.alone(0.02, 0.02, nu_d_dot=NU_D_DOT)


def test_odometry_that_falls_silent_takes_the_wrench_back_over_the_ramp():
    bench = Bench(ramp=0.2, odometry=0.5, setpoint=10.0)
    for ms in range(0, 500, 10):
        bench.setpoint(ms)
        last = bench.odometry(ms)
    assert bench.watch(0.98) is None  # 0.49 s without
    found = [bench.watch(0.99 + 0.02 * i) for i in range(20)]
    assert found[0] is None
    said = [answer for answer in found if answer is not None]
    sizes = [abs(answer.tau[0]) for answer in said]
    assert abs(last.tau[0]) == sizes[0] > sizes[3] > 0
    assert sizes == sorted(sizes, reverse=True)
    assert said[-1].tau == ZERO
    assert said[-1].trouble == 'no odometry for 0.5 s: zero wrench'
    assert all(answer.ns == 490 * MS and answer.f == ZERO for answer in said)
    assert found[-1] is None  # it has been said
    assert (bench.controller.watchdog, bench.controller.trips) == ('no odometry for 0.5 s', 1)


@pytest.mark.parametrize(('stopped', 'left'), [(0.38, 1.0), (0.42, 0.0)])
def test_a_controller_that_was_stopped_itself_does_not_publish_an_old_wrench(stopped, left):
    bench = Bench(ramp=1.0)
    for ms in range(0, 2000, 10):
        bench.setpoint(ms)
        full = bench.odometry(ms).tau
    assert bench.watch(1.99 + stopped).tau == tuple(left * value for value in full)
    later = bench.watch(1.99 + stopped + 0.1)
    assert (later.tau[0] if later else 0.0) == pytest.approx(0.9 * left * full[0])


def test_it_recovers_when_odometry_returns_and_comes_in_over_the_ramp():
    bench = Bench(ramp=0.2, odometry=0.5, setpoint=10.0)
    for ms in range(0, 500, 10):
        bench.setpoint(ms)
        held = bench.odometry(ms)
    for i in range(30):
        bench.watch(1.0 + 0.02 * i)
    answers = []
    with pytest.raises(ValueError, match='stamp jumped'):
        bench.odometry(1990)
    for ms in range(2000, 2500, 10):
        bench.setpoint(ms)
        answers.append(bench.odometry(ms))
    sizes = [abs(answer.tau[0]) for answer in answers]
    assert 0 == sizes[0] < sizes[1] < 0.2 * abs(held.tau[0])
    assert sizes[:15] == sorted(sizes[:15])
    assert sizes[-1] > 0.9 * abs(held.tau[0])
    assert answers[-1].trouble == bench.controller.watchdog == ''


def test_silence_of_set_points_counts_by_the_clock_on_the_wall_as_well():
    """Time stands nearly still in the stamps: their age alone would never tell."""
    bench = Bench(setpoint=0.5)
    bench.setpoint(0, at=0.0)
    assert bench.odometry(1, at=0.1).trouble == ''
    assert bench.odometry(2, at=0.49).trouble == ''
    silent = bench.odometry(3, at=0.51)
    assert silent.tau == ZERO
    assert silent.trouble == 'no set-point heard for 0.5 s: zero wrench'
    bench.setpoint(4, at=0.52)
    assert bench.odometry(5, at=0.53).trouble == ''


def test_silence_of_set_points_does_not_wait_for_an_odometry():
    """A measurement every 0.4 s, of which one is lost: nearly a second."""
    bench = Bench(setpoint=0.5, odometry=2.0, ramp=0.2)
    for ms in range(0, 400, 10):
        bench.setpoint(ms)
        assert bench.odometry(ms).trouble == ''
    said = [bench.watch(ms / 1000) for ms in range(400, 1200, 20)]
    assert [answer is not None for answer in said] == [
        880 < ms < 1120 for ms in range(400, 1200, 20)
    ]
    assert {answer.ns for answer in said if answer} == {390 * MS}, 'the last odometry'
    wrenches = [answer.tau[0] for answer in said if answer]
    assert sorted(wrenches, key=abs, reverse=True) == wrenches
    assert wrenches[0] != wrenches[-1] == 0.0
    assert bench.controller.watchdog == 'no set-point heard for 0.5 s'


@pytest.mark.parametrize('exact', [True, False])
def test_a_wrench_that_is_taken_back_does_not_wait_for_an_odometry(exact):
    """The set-point is too old by its stamp, and the odometry falls silent within the ramp."""
    bench = Bench(exact=exact, acceleration=SAME, setpoint=0.3, odometry=2.0, ramp=0.2)
    for ms in range(0, 100, 10):
        bench.setpoint(ms)
        bench.odometry(ms)
    for ms in range(100, 501, 10):
        if not exact:
            bench.pairing.heard = ms / 1000
        bench.odometry(ms)
        begun = bench.watch(ms / 1000 + 0.005)
    assert bench.controller.trips == 1
    found = [bench.watch(ms / 1000) for ms in range(520, 800, 20)]
    sizes = [abs(answer.tau[0]) for answer in (begun, *found) if answer]
    assert sizes[0] > sizes[-1] == 0.0
    assert sizes == sorted(sizes, reverse=True)
    assert bench.controller.trips == 1


def test_a_publisher_that_falls_silent_is_missed_however_far_ahead_it_was():
    bench = Bench(setpoint=0.5)
    for ms in range(0, 2000, 10):
        bench.setpoint(ms, at=0.0)
    found = [bench.odometry(ms).trouble for ms in range(0, 1000, 10)]
    assert not any(found[:51])
    assert all(found[51:])


@pytest.mark.parametrize('acceleration', [DIFFERENCE, SAME])
@pytest.mark.parametrize('begins', [0, 1500])
def test_what_a_silent_publisher_left_ahead_is_not_obeyed_when_another_begins(acceleration, begins):
    bench, stop = Bench(setpoint=0.5, acceleration=acceleration), (0.0,) * 6
    for ms in range(begins, 3000, 10):
        bench.setpoint(ms, at=0.0)
    for ms in range(0, 1000, 10):
        bench.odometry(ms)
    for ms in range(1000, 2000, 10):
        bench.pairing.derivative((ms - 7) * MS, stop)  # which may come first
        bench.odometry(ms - 5)
        bench.pairing.setpoint((ms - 7) * MS, stop, ms / 1000)
        assert bench.odometry(ms).trouble == ''
        assert bench.pairing.find(ms * MS).nu_d == stop


@pytest.mark.parametrize('acceleration', [DIFFERENCE, SAME])
@pytest.mark.parametrize('late', [0, 7, 40])
@pytest.mark.parametrize('first', ['derivative', 'setpoint'])
def test_what_one_publisher_left_ahead_is_not_obeyed_once_another_is_heard(
    acceleration, late, first
):
    bench, stop = Bench(setpoint=0.5, acceleration=acceleration, steepest=STEEPEST), ZERO
    keep = {
        'setpoint': lambda ms, at: bench.pairing.setpoint(ms * MS, stop, at),
        'derivative': lambda ms, _: bench.pairing.derivative(ms * MS, stop),
    }
    for ms in range(0, 3000, 10):
        bench.setpoint(ms, at=0.9)
    for ms in range(0, 1000, 10):
        bench.odometry(ms)
    for ms in range(1000, 2500, 10):
        for name in sorted(keep, key=first.__ne__):
            with contextlib.suppress(ValueError):  # older than the last one that was obeyed
                keep[name](ms - late, ms / 1000)
        assert bench.odometry(ms).trouble == ''
        found = bench.pairing.find(ms * MS)
        assert found.ns == 990 * MS or (found.nu_d, found.nu_d_dot[1]) == (stop, 0.0)
    assert found.nu_d == stop


def test_integrals_do_not_outlive_a_watchdog():
    bench = Bench(odometry=0.5, setpoint=10.0)
    for ms in range(0, 300, 10):
        bench.setpoint(ms)
        assert bench.odometry(ms).trouble == ''
    assert bench.watch(0.9).tau == ZERO
    with pytest.raises(ValueError, match='stamp jumped'):
        bench.odometry(990)
    assert bench.odometry(1000).tau == bench.alone(1.0, 0.0)


def test_a_reset_while_the_law_is_in_charge_is_no_jump():
    bench = Bench(ramp=0.2)
    for ms in range(0, 500, 10):
        bench.setpoint(ms)
        before = bench.odometry(ms).tau
    bench.controller.reset()
    bench.setpoint(500)
    assert bench.odometry(500).tau == before
    bench.setpoint(510)
    assert bench.odometry(510).tau[0] == pytest.approx(before[0], rel=0.1)
    for ms in range(520, 800, 10):
        bench.setpoint(ms)
        after = bench.odometry(ms).tau
    assert after[0] < 0.9 * before[0]


STEEPEST = (0.2,) * 6


def a_filter() -> ReferenceFilter:
    return ReferenceFilter(1.0, 1.0, (3.0,) * 3 + (1.0,) * 3, STEEPEST)


BY_HAND = {  # stamp in ms -> surge, m/s
    'a step': {0: 0.0, 100: 0.5},
    'steps at 10 Hz': {0: 0.0, 100: 0.25, 200: 0.5, 300: 0.25, 400: 0.5},
    'back to back': {0: 0.5, 1000: 0.5, 1000.1: 0.505},
}


@pytest.mark.parametrize('how', BY_HAND)
@pytest.mark.parametrize('acceleration', ['filter', 'none', 'difference'])
def test_set_points_by_hand_take_little_more_than_holds_the_speed(how, acceleration):
    """The vehicle follows exactly: what is asked is the feed-forward of the set-point alone."""
    bench = Bench(
        acceleration=acceleration, setpoint=60.0, steepest=STEEPEST,
        reference=a_filter() if acceleration == 'filter' else None,
        gains=make_gains('gvc', {'k_D': 1e-6, 'k_I': 0.0, 'Lambda': 1e-6, 'Gamma': 0.0}),
    )  # fmt: skip
    still = (0.0, 0.0, 3.0, 1.0, *[0.0] * 9)
    left, found = dict(BY_HAND[how]), []
    for ms in range(0, 15000, 10):
        for at in [at for at in left if at <= ms]:
            bench.setpoint(at, (left.pop(at), *[0.0] * 5))
        now = Now(ms / 1000)
        found.append(abs(bench.controller.odometry(ms * MS, still, now).tau[0]))
    held = bench.law.sample(0.0, 0.0, ZERO, UP, (0.5, *ZERO[1:]), ZERO)[0][0]
    assert found[-1] == pytest.approx(held, rel=0.02)
    assert max(found) <= found[-1] + load_vehicle('rexrov').M[0, 0] * STEEPEST[0]


def test_the_reference_begins_at_the_velocity_of_the_vehicle():
    reference = a_filter()
    bench = Bench(reference=reference, setpoint=0.05)
    bench.setpoint(0, (2.0, *[0.0] * 5))
    at_rest = bench.law.sample(0.0, 0.0, odometry(0.7)[7:], UP, odometry(0.7)[7:], ZERO)[0]
    assert bench.odometry(0, 0.7).tau == at_rest
    bench.odometry(60, 0.7)  # the watchdog
    bench.setpoint(65, (2.0, *[0.0] * 5))
    bench.odometry(70, 0.4)
    assert reference.advance(0.0, ZERO)[0][0] == 0.4


def test_exact_pairing_in_real_time_lets_go_when_set_points_stay_away():
    bench = Bench(exact=True, acceleration=SAME, setpoint=0.3, odometry=0.5)
    for ms in range(0, 100, 10):
        bench.setpoint(ms)
        assert bench.odometry(ms).tau[0] != 0.0
    heard = []
    for ms in range(100, 600, 10):  # odometry goes on
        heard += [bench.odometry(ms), bench.watch(ms / 1000 + 0.005)]
    said = [answer for answer in heard if answer is not None]
    assert said[0].tau == ZERO
    assert said[0].trouble == 'no set-point of its stamp: zero wrench'
    assert said[0].ns == 400 * MS
    bench.setpoint(610)
    assert bench.odometry(610).trouble == ''


def test_exact_pairing_lets_go_over_the_ramp():
    bench = Bench(exact=True, acceleration=SAME, setpoint=0.3, odometry=0.5, ramp=0.1)
    for ms in range(0, 300, 10):
        bench.setpoint(ms)
        last = bench.odometry(ms).tau[0]
    found = []
    for ms in range(300, 800, 10):
        for answer in (bench.odometry(ms), bench.watch(ms / 1000 + 0.005)):
            found += [] if answer is None else [answer.tau[0] / last]
    assert found[0] == 1.0
    assert found[-1] == 0.0
    steps = -np.diff(found)
    assert (steps >= 0.0).all()
    assert steps.max() < 0.11, 'never faster than the ramp, which is looked at every 10 ms'


def test_stamps_that_begin_anew_are_believed_after_a_pause_and_the_law_goes_on():
    seen = []

    class Clock(GVC):
        @staticmethod
        def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
            seen.append(round(t, 9))
            return ZERO, ZERO

    bench = Bench(gains=Clock(*make_gains('gvc', PAPER)), odometry=0.2)
    for ms in (50_000, 50_010):
        bench.setpoint(ms)
        bench.odometry(ms)
    seen.clear()
    for ms in (10, 20):  # the driver was started again, but those could also be late
        with pytest.raises(ValueError, match='stamp went back'):
            bench.odometry(ms, at=50.02)
    with pytest.raises(ValueError, match='stamp went back'):
        bench.odometry(1000, at=51.0)
    again = bench.odometry(1010, at=51.01)
    assert again.trouble == 'no set-point yet: zero wrench'  # those of the old time are forgotten
    bench.setpoint(1015, at=51.015)
    assert bench.odometry(1020, at=51.02).trouble == ''
    assert bench.odometry(1030, at=51.03).trouble == ''
    assert seen == [0.02, 0.03]


def test_trips_are_counted_once_each():
    bench = Bench(setpoint=0.05)
    bench.odometry(0)
    assert bench.controller.trips == 0  # it was never in charge
    for start in (10, 200):
        bench.setpoint(start)
        bench.odometry(start)
        for ms in (70, 80, 90):
            bench.odometry(start + ms)
    assert bench.controller.trips == 2


def test_a_reset_while_the_wrench_is_taken_back_changes_nothing():
    bench = Bench(ramp=1.0)
    for ms in range(0, 2000, 10):
        bench.setpoint(ms)
        full = bench.odometry(ms).tau[0]
    taken = []
    for at in range(2200, 3300, 100):
        bench.controller.reset()
        taken.append(bench.watch(at / 1000).tau[0] / full)
    assert taken == pytest.approx([*np.arange(1.0, 0.05, -0.1), 0.0], abs=1e-9)


def test_after_an_answer_that_nobody_heard_it_begins_anew():
    def made() -> Bench:
        return Bench(acceleration='filter', ramp=0.2, reference=a_filter())

    def said(bench: Bench, k: int) -> tuple:
        bench.setpoint(10 * k)
        return bench.odometry(10 * k, 0.01 * k).tau

    bench, fresh = made(), made()
    assert any([said(bench, k) for k in range(30)][-1])
    bench.controller.unheard()
    for k in range(30, 60):
        assert said(bench, k) == said(fresh, k)
