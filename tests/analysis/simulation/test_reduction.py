"""Where a run leaves the finite numbers, seen from its samples alone."""

import numpy as np
import pytest

from auv_analysis.simulation.closed_loop import Sample
from auv_analysis.simulation.reduction import keep_divergence

STATES = 8  # six and a rest
STILL = Sample(np.zeros(13), np.zeros(13), np.zeros(STATES), *[(0.0,) * 6] * 5)
NUMBERS = {'x': 13, 'state': STATES, 'tau': 6, 'applied': 6, 'f': 6, 'F': 6}


def sample_with(name: str, i: int, value: float) -> Sample:
    numbers = np.zeros(NUMBERS[name])
    numbers[i] = value
    return STILL._replace(**{name: numbers})


def first_of(samples: list[Sample]) -> float:
    diverged = np.array([np.inf])
    for k, sample in enumerate(samples):
        keep_divergence(diverged, k, sample)
    return diverged[0]


@pytest.mark.parametrize('value', [np.nan, -np.inf, -1e100])
@pytest.mark.parametrize('name', NUMBERS)
def test_every_number_of_a_sample_counts(name: str, value: float) -> None:
    for i in range(NUMBERS[name]):
        assert first_of([STILL, sample_with(name, i, value)]) == 1.0, i


def test_of_several_samples_that_are_not_finite_the_first_is_kept() -> None:
    lost = sample_with('tau', 2, np.nan)
    assert first_of([STILL, STILL, lost, STILL, lost]) == 2.0
    assert first_of([lost, lost]) == 0.0
    assert first_of([STILL, STILL]) == np.inf
