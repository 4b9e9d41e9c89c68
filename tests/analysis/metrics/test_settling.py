"""Settling: the band of an error, the edge of it, and the dwell time."""

import numpy as np
import pytest

from auv_analysis.metrics.settling import settling_time


def settled(columns, peak=1.0):
    columns = np.array([*columns, *np.zeros(11)])
    t = np.arange(len(columns)) * 0.5
    nu_d = np.zeros((len(columns), 6))
    nu_d[0, 0] = -peak
    error = np.zeros_like(nu_d)
    error[:, 0] = columns
    return settling_time(t, error, nu_d)[0]


@pytest.mark.parametrize(
    ('errors', 'peak', 'time'),
    [
        ([1.0, 0.021, 0.02, -0.02, 0.0], 1.0, 1.0),  # 2 % of the peak, the edge belongs to it
        ([1.0, 0.0, -0.03, 0.0, 0.0], 1.0, 1.5),  # it must stay there
        ([0.01, 0.0, 0.0, 0.0, 0.0], 1.0, 0.0),  # inside from the start
        ([0.02, 0.0049, 0.005, 0.001, 0.0], 0.1, 0.5),  # the band is never below 0.005
        ([0.02, 0.0051, 0.0, 0.0, 0.0], 0.0, 1.0),
        ([0.05, 0.05, 0.0, 0.0, 0.0], 3.0, 0.0),  # of the peak of nu_d, in absolute value
    ],
)
def test_settling_time(errors, peak, time):
    assert settled(errors, peak) == time


@pytest.mark.parametrize(('samples', 'steps'), [(12, 10), (101, 10), (3001, 150)])
def test_an_error_has_settled_only_once_it_dwells_in_its_band(samples, steps):
    t, nu_d, error = np.arange(samples) * 0.01, np.ones((samples, 6)), np.zeros((samples, 6))
    entered = samples - 1 - steps
    error[entered - 1, :3] = error[entered, 3:] = 0.021
    assert settling_time(t, error, nu_d) == [*3 * [t[entered]], *3 * [None]]


def test_a_run_shorter_than_the_dwell_time_settles_only_where_it_never_leaves():
    t, nu_d, error = np.arange(6.0), np.ones((6, 6)), np.zeros((6, 6))
    error[0, 1] = 0.021
    assert settling_time(t, error, nu_d) == [0.0, None, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize('axis', range(6))
def test_each_axis_settles_by_itself(axis):
    t, nu_d, error = 3.0 + np.arange(13.0), np.zeros((13, 6)), np.zeros((13, 6))
    nu_d[2, axis] = 1.0
    error[1, axis] = 0.021
    expected = [3.0] * 6
    expected[axis] = 5.0
    assert settling_time(t, error, nu_d) == expected
    error[-1, axis] = -0.021
    expected[axis] = None
    assert settling_time(t, error, nu_d) == expected
