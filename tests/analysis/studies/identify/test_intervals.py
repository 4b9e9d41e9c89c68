"""What `auv identify` does on request: observer, bootstrap, profiles; whiteness of residuals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.sea_trials import SWINGS, gauss_markov, trial, truth
from numpy.testing import assert_allclose

from auv_analysis.studies.identify.identify import Settings, identify, split
from auv_analysis.studies.identify.whiteness import told, whiteness
from auv_dynamics.vehicle.vehicle_file import load_vehicle

FREE = ('M.diagonal', 'D_linear', 'lag', 'delay')  # few, so that a refit costs little
HERMAN = load_vehicle('herman2018')
SWING = 0.05 * np.diag(HERMAN.M) * SWINGS['herman2018'][0]  # N, N m of what the model lacks


def identified(record, **settings):
    training, held = split([record], 0.25)
    return identify(training, held, HERMAN, Settings(**settings))


def known(found):
    return {row['name']: row for row in found.coefficients() if row['status'] == 'identified'}


@pytest.fixture(scope='module')
def quiet(tmp_path_factory):
    record, _ = trial(tmp_path_factory.mktemp('quiet'), 'herman2018', 3, duration=60.0)
    return identified(record, free=FREE, bootstrap=60, profile=('lag', 'auto', 'M.surge.surge'))


@pytest.fixture(scope='module')
def disturbed(tmp_path_factory):
    record, _ = trial(tmp_path_factory.mktemp('disturbed'), 'herman2018', 3, duration=60.0,
                      disturbance=gauss_markov(SWING, 3))  # fmt: skip
    return {gain: identified(record, free=FREE, observer=gain) for gain in (0.0, None)}


def test_a_bootstrap_over_blocks_is_as_wide_as_the_sandwich(quiet):
    rows = known(quiet).values()
    width = [
        (row['bootstrap_high'] - row['bootstrap_low']) / (row['high'] - row['low'])
        for row in rows if row['name'] in quiet.fit.unknowns.names
    ]  # fmt: skip
    assert len(width) >= 10
    assert 0.7 < np.median(width) < 1.3
    assert quiet.resampled.shape == (60, len(quiet.fit.theta))
    middle = np.median(quiet.resampled, axis=0) - quiet.fit.theta
    assert np.all(np.abs(middle) < np.sqrt(np.diag(quiet.covariance)))


def test_a_profile_of_what_is_quadratic_ends_where_the_sandwich_does(quiet):
    rows = known(quiet)
    assert {'lag', 'M.surge.surge'} <= {one.name for one in quiet.profiles}
    for one in quiet.profiles:
        if one.name in ('lag', 'M.surge.surge'):
            low, high = rows[one.name]['low'], rows[one.name]['high']
            assert_allclose([one.low, one.high], [low, high], atol=0.1 * (high - low))
            assert rows[one.name]['profile_low'] == one.low
            assert one.rise.min() == 0.0
            assert one.values[np.argmin(one.rise)] == rows[one.name]['value']


def test_residuals_are_white_where_the_model_explains_all(quiet):
    rows = whiteness(list(quiet.problem.misfit(quiet.fit)), quiet.problem.step)
    assert [row['verdict'] for row in rows] == ['white'] * 6
    assert 'are white' in told(rows)


@pytest.mark.parametrize('jitter', [5e-6, 4e-3])
def test_stamps_of_a_real_clock_change_no_verdict(quiet, disturbed, jitter):
    """Steps of 20 ms; a sample that lacks is no jitter."""
    rng = np.random.default_rng(0)
    for one in (quiet, disturbed[0.0]):
        step, pairs = one.problem.step, list(one.problem.misfit(one.fit))
        even = whiteness(pairs, step)
        off = [jitter / step * rng.uniform(-0.5, 0.5, len(segment.at)) for segment, _ in pairs]
        late = [(replace(segment, at=segment.at + by), e)
                for (segment, e), by in zip(pairs, off, strict=True)]  # fmt: skip
        rows = whiteness(late, step)
        assert [row['verdict'] for row in rows] == [row['verdict'] for row in even]
        assert_allclose([row['slow'] for row in rows], [row['slow'] for row in even], rtol=0.1)
    kept = np.delete(np.arange(len(pairs[0][0].at)), 30)
    holed = replace(pairs[0][0], at=pairs[0][0].at[kept], nu=pairs[0][0].nu[kept])
    assert whiteness([(holed, pairs[0][1][kept])], step) == []


def test_residuals_are_not_white_under_a_disturbance(disturbed):
    found = disturbed[0.0]
    rows = whiteness(list(found.problem.misfit(found.fit)), found.problem.step)
    assert [row['verdict'] for row in rows] == ['slow'] * 6
    assert all(row['slow'] > 0.5 for row in rows)
    assert 'not white in surge' in told(rows)


def test_residuals_that_alternate_are_coloured_and_not_slow():
    """Of e_k = w_k - w_k-1 / 2 the autocorrelation is -0.4 after one sample, then zero."""
    white = np.random.default_rng(0).normal(size=(2001, 9))
    e, segment = white[1:] - 0.5 * white[:-1], SimpleNamespace(nu=np.zeros((2000, 6)))
    segment.at = np.arange(2000.0)
    rows = whiteness([(segment, e)], 0.02)
    assert [row['verdict'] for row in rows] == ['coloured'] * 6
    assert [row['largest'] for row in rows] == pytest.approx([-0.4] * 6, abs=0.1)
    assert_allclose([row['slow_if_white'] for row in rows], 1.0 / 25.0, rtol=0.05)  # Hz of Hz
    assert all(row['slow'] < row['slow_if_white'] for row in rows)


def test_an_observer_makes_intervals_narrower_under_a_disturbance(disturbed):
    before, after = disturbed[0.0], disturbed[None]
    assert before.problem.observer == 0.0
    assert after.problem.observer > 0.0
    assert after.fit.cost < 0.2 * before.fit.cost
    rows, others = known(after), known(before)
    narrower = [
        (row['high'] - row['low']) / (others[name]['high'] - others[name]['low'])
        for name, row in rows.items() if name in others and name != 'delay'
    ]  # fmt: skip
    assert np.median(narrower) < 0.7
    true = truth(after.fit.unknowns, HERMAN)
    wrong = [
        np.median([abs(some[name]['value'] / true[name] - 1.0) for name in rows if name[0] == 'M'])
        for some in ({row['name']: row for row in one.coefficients()} for one in (before, after))
    ]
    assert wrong[1] < 0.7 * wrong[0]


def test_no_observer_where_there_is_no_disturbance(tmp_path):
    record, _ = trial(tmp_path, 'herman2018', 3, duration=40.0)
    assert identified(record, free=FREE, observer=None).problem.observer == 0.0
