"""Tasks that a command shares with a copy of itself: the same results, whoever does them."""

import os
import signal
from functools import partial

import psutil
import pytest

from auv_analysis.output import parallel
from auv_analysis.output.parallel import a_copy_beside, meanwhile, results

HERE = os.getpid()
TWO_CORES = parallel._two_cores  # before any other test


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    """Also where the machine has one: the copy then waits for it."""
    monkeypatch.setattr(os, 'sched_getaffinity', lambda process: {0, 1})
    monkeypatch.setattr(parallel, '_two_cores', TWO_CORES)


def doing(number):
    """The number, and the process that has done it."""
    return number, os.getpid()


def test_both_do_some_and_the_order_stays():
    here, beside = os.pipe(), os.pipe()
    met = []

    def meet(number):
        if not met:  # each waits at its first task until the other one has come to its own
            met.append(number)
            mine, other = (here, beside) if os.getpid() == HERE else (beside, here)
            os.write(other[1], b'.')
            os.read(mine[0], 1)
        return doing(number)

    with a_copy_beside():
        found = list(results([partial(meet, i) for i in range(20)]))
    assert [number for number, _ in found] == list(range(20))
    assert len({process for _, process in found}) == 2


def test_without_leave_all_is_done_here():
    assert {process for _, process in results([partial(doing, i) for i in range(5)])} == {HERE}


def test_what_a_copy_that_dies_has_taken_is_done_here():
    def die_beside(number):
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGKILL)
        return number

    with a_copy_beside():
        assert list(results([partial(die_beside, i) for i in range(6)])) == [0, 1, 2, 3, 4, 5]


def test_an_error_is_raised_whoever_meets_it_and_no_copy_is_left():
    def fail(number):
        raise ValueError(f'task {number}')

    before = psutil.Process().children()
    with a_copy_beside(), pytest.raises(ValueError, match='task'):
        list(results([partial(fail, i) for i in range(4)]))
    assert psutil.Process().children() == before


def test_a_copy_does_meanwhile_what_is_asked_for_later():
    before = psutil.Process().children()
    with a_copy_beside(), meanwhile(partial(doing, 7)) as made:
        number, process = made()
    assert (number, process != HERE) == (7, True)
    with meanwhile(partial(doing, 7)) as made:
        assert made() == (7, HERE)
    assert psutil.Process().children() == before


def test_what_it_does_not_give_is_done_here():
    def fail():
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGKILL)
        raise ValueError('here')

    with a_copy_beside(), meanwhile(fail) as made, pytest.raises(ValueError, match='here'):
        made()


def test_a_copy_that_hangs_is_ended(monkeypatch):
    monkeypatch.setattr(parallel, 'PATIENCE', 0.0)

    def hang_beside():
        while os.getpid() != HERE:
            signal.pause()
        return 7

    with a_copy_beside(), meanwhile(hang_beside) as made:
        assert made() == 7
