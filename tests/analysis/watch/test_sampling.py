"""When to listen: all the time, or now and then above a load."""

import pytest

from auv_analysis.watch.sampling import BUDGET, CALM, LISTEN, PERIOD, Sampling


def share(sampling: Sampling, load: float, begin: float, seconds: float = 10.0) -> float:
    """Part of the time in which is listened, looked at every hundredth of a second."""
    count = round(seconds * 100)
    return sum(sampling.listens(begin + i / 100, load) for i in range(count)) / count


def test_a_small_load_is_listened_to_without_a_pause() -> None:
    sampling = Sampling()
    assert share(sampling, BUDGET, 5.0) == 1.0
    assert not sampling.sampled


def test_a_large_load_is_sampled() -> None:
    sampling = Sampling()
    assert share(sampling, BUDGET * 20, 5.0) == pytest.approx(LISTEN / PERIOD, abs=0.03)
    assert sampling.sampled


def test_between_the_limits_it_goes_on_as_before() -> None:
    calm, busy = Sampling(), Sampling()
    busy.listens(0.0, 2 * BUDGET)
    between = (1 + CALM) / 2 * BUDGET
    assert share(calm, between, 1.0) == 1.0
    assert share(busy, between, 1.0) < 0.3
    assert share(busy, CALM * BUDGET / 2, 20.0) == 1.0
    assert not busy.sampled
