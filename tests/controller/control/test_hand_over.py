"""Between law and vehicle: limits, slew limits, the ramp."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from auv_gvc_controller.control.controller import FEWEST, OutputStage
from auv_gvc_controller.control.odometry_guard import ZERO

WANTED = (10.0, -20.0, 30.0, -1.0, 2.0, -3.0)
FREE = (math.inf,) * 6


def test_without_ramp_and_limits_the_wrench_passes_as_it_is():
    output = OutputStage(FREE)
    assert output.follow(WANTED, 0.0) == WANTED
    assert output.follow(ZERO, 0.0) == ZERO
    assert output.release(0.0) == ZERO


def test_limits_clip_each_axis():
    assert OutputStage((5.0, 100.0, 15.0, 0.5, 9.0, 9.0)).follow(WANTED, 0.0) == (
        *(5.0, -20.0, 15.0),
        *(-0.5, 2.0, -3.0),
    )


def test_the_law_comes_in_over_the_ramp_and_leaves_over_it():
    output = OutputStage(FREE, ramp=0.2)
    rising = [output.follow(WANTED, 0.01 * i)[0] for i in range(25)]
    assert rising[:20] == pytest.approx([0.5 * i for i in range(20)])
    assert rising[20:] == [10.0] * 5
    falling = [output.release(3.0 + 0.05 * i)[0] for i in range(6)]
    assert falling == pytest.approx([10.0, 7.5, 5.0, 2.5, 0.0, 0.0])
    assert output.idle


def test_however_rare_the_answers_the_law_takes_over_in_several():
    output = OutputStage(FREE, ramp=0.2)
    found = [output.follow(WANTED, 1.0 * i)[0] for i in range(12)]
    assert found == pytest.approx([10.0 * min(1.0, i / FEWEST) for i in range(12)])


def test_taken_back_half_way_it_goes_on_from_there():
    output = OutputStage(FREE, ramp=1.0)
    for i in range(51):
        half = output.follow(WANTED, 0.01 * i)
    assert half[0] == pytest.approx(5.0)
    assert output.release(0.55)[0] == pytest.approx(5.0)
    assert output.release(0.65)[0] == pytest.approx(4.5)
    assert output.follow(WANTED, 0.70)[0] == pytest.approx(4.5)
    assert output.follow(WANTED, 0.80)[0] == pytest.approx(5.05)


def test_a_law_that_begins_anew_comes_in_from_the_last_wrench():
    output = OutputStage(FREE, ramp=0.2)
    for i in range(25):
        output.follow(WANTED, 0.01 * i)
    output.restart()
    found = [output.follow(ZERO, 0.25 + 0.01 * i)[0] for i in range(21)]
    assert found == pytest.approx([10.0 - 0.5 * i for i in range(21)])


def test_a_wrench_is_taken_back_no_faster_than_it_may_change():
    output = OutputStage(FREE, slew=(50.0,) * 6, ramp=0.2)
    for i in range(31):
        output.follow(WANTED, 0.1 * i)
    found = [output.release(4.0 + 0.1 * i)[2] for i in range(5)]
    assert found == pytest.approx([30.0, 25.0, 20.0, 15.0, 10.0])
    assert not output.idle
    assert output.release(9.0) == ZERO
    assert output.idle


def test_a_silence_does_not_count_for_the_slew_limit():
    output = OutputStage(FREE, slew=(50.0,) * 6)
    for i in range(3):
        last = output.follow(WANTED, 1.0 * i)
    assert output.release(7.0) == last
    assert output.release(7.1)[2] == pytest.approx(25.0)


def test_the_slew_limit_holds_from_the_zero_wrench_on():
    output = OutputStage(FREE, slew=(100.0, 100.0, 10.0, 1e9, 1e9, 1e9))
    assert output.follow(WANTED, 0.0) == ZERO
    assert output.follow(WANTED, 0.05)[:3] == pytest.approx((5.0, -5.0, 0.5))
    assert output.follow(WANTED, 0.10)[:3] == pytest.approx((10.0, -10.0, 1.0))
    assert output.drop() == ZERO  # a vehicle that is left: safety before slew
    assert output.follow(WANTED, 99.0) == ZERO


finite = st.floats(-1e12, 1e12)


@given(
    st.lists(st.tuples(st.tuples(*[finite] * 6), st.floats(0.0, 1.0), st.booleans()), max_size=30),
    st.floats(0.0, 2.0),
)
def test_nothing_beyond_limit_and_slew_ever_passes(steps, ramp):
    limit, slew = (50.0, 1.0, 1e3, 7.0, 7.0, 7.0), (10.0, 1e6, 5.0, 1.0, 1.0, 1.0)
    output, now, last = OutputStage(limit, slew, ramp), 0.0, ZERO
    for tau, dt, in_charge in steps:
        now += dt
        found = output.follow(tau, now) if in_charge else output.release(now)
        for value, before, most, per_s in zip(found, last, limit, slew, strict=True):
            assert abs(value) <= most
            assert abs(value - before) <= per_s * dt * (1 + 1e-9) + 1e-9
            assert in_charge or abs(value) <= abs(before)
        last = found
