"""Rates, gaps and repeated stamps of one topic, from messages with known numbers and stamps."""

import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st

from auv_analysis.watch.monitor import ENOUGH, WINDOW, Stream

STEP = 10_000_000  # ns
PERIOD = 0.01  # s of the wall between two messages


def hear(stream: Stream, ks, *, number=None, begin: float = 0.0) -> float:
    """Messages k with stamp k * STEP, `number` of each (k + 1 if none is given); the last time."""
    now = begin
    for i, k in enumerate(ks):
        now = begin + i * PERIOD
        stream.hear(now, k + 1 if number is None else number(i), k * STEP)
    return now


def test_a_topic_without_messages_is_unknown() -> None:
    stream = Stream()
    assert (stream.rate(1.0), stream.pace(1.0), stream.age(1.0)) == (None, None, None)
    assert (stream.gaps, stream.repeats, stream.newest) == (None, None, None)


def test_rate_and_pace_of_even_messages() -> None:
    stream = Stream()
    now = hear(stream, range(201))
    assert stream.rate(now) == pytest.approx(100.0)
    assert stream.pace(now) == pytest.approx(1.0)
    assert stream.age(now + 0.25) == pytest.approx(0.25)
    assert (stream.gaps, stream.repeats) == (0, 0)
    assert (stream.heard, stream.published) == (201, 201)


def test_a_clock_that_begins_anew_does_not_run_backwards() -> None:
    stream = Stream()
    now = hear(stream, range(1000))
    for k in range(100):  # the next loop of a replay
        now += PERIOD
        stream.hear(now, 1001 + k, k * STEP)
    assert stream.pace(now) == pytest.approx(1.0)
    assert stream.rate(now) == pytest.approx(100.0)
    assert (stream.gaps, stream.repeats) == (0, 1)


def test_a_rate_follows_the_last_seconds_and_ends_with_the_messages() -> None:
    stream = Stream()
    now = hear(stream, range(200))
    for i in range(200):  # half as many, stamps twice as fast
        now += 2 * PERIOD
        stream.hear(now, 201 + i, (200 + 4 * i) * STEP)
    assert stream.rate(now) == pytest.approx(50.0)
    assert stream.pace(now) == pytest.approx(2.0)
    assert stream.rate(now + 2 * WINDOW) == 0.0
    assert stream.pace(now + 2 * WINDOW) is None


@QUICK
@given(st.lists(st.integers(1, 40), min_size=10, max_size=60))
def test_what_is_not_heard_is_counted_but_no_gap(pauses: list[int]) -> None:
    """Of messages that nobody took the numbers are missing as well."""
    stream = Stream()
    hear(stream, range(20))
    k = 19
    for i, pause in enumerate(pauses):
        k += pause
        stream.hear(1.0 + i * PERIOD, k + 1, k * STEP)
    assert stream.published == k + 1
    assert stream.heard == 20 + len(pauses)
    assert (stream.gaps, stream.repeats) == (0, 0)


@QUICK
@given(st.integers(20, 100), st.integers(1, 9))
def test_stamps_that_are_missing_between_messages_are_gaps(place: int, missing: int) -> None:
    stream = Stream()
    ks = [k if k < place else k + missing for k in range(120)]
    hear(stream, ks, number=lambda i: i + 1)
    assert (stream.gaps, stream.repeats) == (missing, 0)


@QUICK
@given(st.sets(st.integers(20, 100), max_size=9))
def test_stamps_that_come_twice_are_counted(twice: set[int]) -> None:
    stream = Stream()
    ks = sorted([*range(120), *twice])
    hear(stream, ks, number=lambda i: i + 1)
    assert (stream.gaps, stream.repeats) == (0, len(twice))


def test_a_stamp_that_goes_back_is_a_repeat_where_no_number_is_missing() -> None:
    stream = Stream()
    hear(stream, range(20))
    assert not stream.hear(1.0, 21, 5 * STEP)
    assert (stream.gaps, stream.repeats) == (0, 1)


@pytest.mark.parametrize(('before', 'gaps'), [(ENOUGH, 0), (ENOUGH + 1, 2)])
def test_a_gap_is_told_after_enough_steps(before: int, gaps: int) -> None:
    stream = Stream()
    hear(stream, [*range(before), before + 2], number=lambda i: i + 1)
    assert stream.gaps == gaps


def test_messages_of_one_moment_have_no_time_between_them() -> None:
    stream = Stream()
    for k, now in enumerate((0.0, 0.0, 0.0, 1.0)):
        stream.hear(now, k, k * STEP)
    assert (stream.rate(1.0), stream.pace(1.0)) == (1.0, 0.01)


def test_an_uneven_driver_has_no_gaps() -> None:
    stream = Stream()
    for i in range(200):
        stream.hear(i * PERIOD, i, i * STEP + (i % 3) * STEP // 8)
    assert (stream.gaps, stream.repeats) == (0, 0)


def test_stamps_that_need_not_be_even_are_not_judged() -> None:
    stream = Stream(judged=False)
    hear(stream, [0, 5, 5, 9, 100], number=lambda i: i)
    assert (stream.gaps, stream.repeats) == (None, None)


def test_without_numbers_messages_are_counted_and_stamps_not_judged() -> None:
    stream = Stream()
    hear(stream, [*range(50), *range(60, 80)], number=lambda _: None)
    assert (stream.heard, stream.published, stream.gaps) == (70, 70, None)


def test_another_run_begins_anew() -> None:
    stream = Stream()
    hear(stream, [*range(50), *range(51, 101)], number=lambda i: i + 1)
    assert not stream.hear(1.0, 101, 101 * STEP)
    assert stream.gaps == 1
    assert stream.hear(2.0, 1, 0), 'a publisher with early numbers and stamps'
    now = hear(stream, range(3, 300, 3), number=lambda i: i + 2, begin=2.0 + PERIOD)
    assert (stream.gaps, stream.repeats) == (0, 0), 'of the new run and its longer step alone'
    assert stream.pace(now) == pytest.approx(3.0)


def test_another_run_of_which_the_beginning_was_not_heard() -> None:
    stream = Stream()
    hear(stream, range(10), number=lambda i: i + 1, begin=0.0)
    stream.hear(1.0, 11, 1000 * STEP)
    assert stream.hear(2.0, 400, 399 * STEP)


def test_of_two_publishers_messages_are_counted_and_nothing_is_judged() -> None:
    stream = Stream()
    stream.publishers = 2
    for i in range(100):
        stream.hear(i * PERIOD, i // 2 if i % 2 else 5000 + i // 2, i // 2 * STEP)
    assert stream.published == 100
    assert stream.rate(0.99) == pytest.approx(100.0)
    assert (stream.gaps, stream.repeats) == (None, None)
