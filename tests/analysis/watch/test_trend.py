"""Largest values, rms and history of the last seconds."""

import numpy as np
import pytest
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_analysis.watch.monitor import BUCKET, BUCKETS, Trend

SPAN = BUCKET * BUCKETS
VALUES = st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6)


def test_nothing_is_known_at_first() -> None:
    trend = Trend()
    assert (trend.largest, trend.rms, trend.history) == (None, None, ())


@QUICK
@given(st.lists(VALUES, min_size=1, max_size=50))
def test_figures_of_what_lies_in_the_window(samples: list[list[float]]) -> None:
    trend = Trend()
    for i, sample in enumerate(samples):
        trend.add(i * SPAN / 60, np.array(sample))
    assert_allclose(trend.largest, np.abs(samples).max(axis=0))
    assert_allclose(trend.rms, np.sqrt(np.mean(np.square(samples), axis=0)), atol=1e-12)
    assert_allclose(np.max(trend.history, axis=0), trend.largest)


def test_what_is_older_is_forgotten() -> None:
    trend = Trend()
    trend.add(0.0, np.full(6, -9.0))
    for i in range(BUCKETS):
        trend.add(1.0 + i * BUCKET, np.full(6, 0.5))
    assert trend.largest == trend.rms == (0.5,) * 6
    assert len(trend.history) == BUCKETS


@pytest.mark.parametrize('later', [SPAN, 100.0])
def test_what_is_older_is_forgotten_however_few_come(later: float) -> None:
    trend = Trend()
    trend.add(0.0, np.full(6, 5.0))
    trend.add(1.0, np.full(6, 0.25))
    trend.add(later, np.full(6, 0.25))
    assert trend.largest == trend.rms == (0.25,) * 6
