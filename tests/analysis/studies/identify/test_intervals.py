"""What `auv identify` does on request: observer, bootstrap, profiles; whiteness of residuals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.sea_trials import SWINGS, gauss_markov, trial, truth
from numpy.testing import assert_allclose

from auv_analysis.studies.identify import output_error
from auv_analysis.studies.identify.identify import (
    Settings,
    _between,
    _bias,
    as_filed,
    identify,
    segment_length,
    split,
)
from auv_analysis.studies.identify.intervals import far_from_quadratic, profile
from auv_analysis.studies.identify.output_error import OutputError
from auv_analysis.studies.identify.record import Record, segments_of
from auv_analysis.studies.identify.report import results_of, verdict
from auv_analysis.studies.identify.unknowns import unknowns
from auv_analysis.studies.identify.whiteness import reservation, told, whiteness
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
    record, _ = trial(tmp_path_factory.mktemp('quiet'), 'herman2018', 3, duration=40.0)
    return identified(record, free=FREE, bootstrap=40, profile=('lag', 'auto', 'M.surge.surge'))


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
    assert quiet.resampled.shape == (40, len(quiet.fit.theta))
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
    assert (said := reservation(rows))
    assert said in results_of(found, []).facts['verdict']


def test_a_verdict_carries_slow_residuals_that_outweigh_the_noise():
    row = {'dof': 'sway', 'verdict': 'slow', 'rms': 1.5}
    louder = {'dof': 'yaw', 'verdict': 'slow', 'rms': 25.3}
    quiet = [{**row, 'rms': 1.4}, {**louder, 'verdict': 'coloured'}, {**louder, 'verdict': 'white'}]
    assert reservation(quiet) == reservation([]) == ''
    reserved = reservation([*quiet, row, louder])
    assert '25 times the noise in yaw' in reserved
    assert 'sway' in reservation([*quiet, row])
    one = {'predictor': 'prior', 'horizon': 2.0, 'ratio': 0.4, 'ratio_low': 0.3, 'ratio_high': 0.5}
    for rows in ([one], []):
        assert verdict(rows, [], reserved) == f'{verdict(rows, [])[:-1]}{reserved}.'
    assert verdict([one], ['it is another vehicle'], reserved) == (
        'No vehicle file: it is another vehicle.'
    )


def test_residuals_that_alternate_are_coloured_and_not_slow():
    """Of e_k = w_k - w_k-1 / 2 the autocorrelation is -0.4 after one sample, then zero.

    Its power per frequency goes as 1.25 - cos(theta), of which 0.8 % lie below pi / 25.
    """
    white = np.random.default_rng(0).normal(size=(2001, 9))
    e, segment = white[1:] - 0.5 * white[:-1], SimpleNamespace(nu=np.zeros((2000, 6)))
    segment.at = np.arange(2000.0)
    rows = whiteness([(segment, e)], 0.02)
    assert [row['verdict'] for row in rows] == ['coloured'] * 6
    assert [row['largest'] for row in rows] == pytest.approx([-0.4] * 6, abs=0.1)
    assert_allclose([row['slow_if_white'] for row in rows], 1.0 / 25.0, rtol=0.05)  # Hz of Hz
    assert [row['slow'] for row in rows] == pytest.approx([0.0081] * 6, abs=0.004)


@pytest.mark.parametrize(('share', 'verdict'), [(0.035, 'white'), (0.07, 'coloured')])
def test_a_little_autocorrelation_is_no_finding_however_certain(share, verdict):
    white = np.random.default_rng(1).normal(size=(40001, 9))
    e, segment = white[1:] - share * white[:-1], SimpleNamespace(nu=np.zeros((40000, 6)))
    segment.at = np.arange(40000.0)
    rows = whiteness([(segment, e)], 0.02)
    assert [row['verdict'] for row in rows] == [verdict] * 6
    assert max(row['p'] for row in rows) < 0.01 / 6


def test_what_is_constant_has_the_power_of_its_square_and_a_sine_half_of_it():
    """The one lies below 1 Hz, the other one, at 5 Hz, above."""
    t, sizes = 0.02 * np.arange(2000), np.linspace(0.5, 3.0, 6)
    e = np.zeros((2000, 9))
    e[:, :6] = 1.0 + np.outer(np.sin(2.0 * np.pi * 5.0 * t), sizes)
    segment = SimpleNamespace(at=np.arange(2000.0), nu=np.zeros((2000, 6)))
    rows = whiteness([(segment, e)], 0.02)
    assert_allclose([row['rms'] for row in rows], np.sqrt(1.0 + sizes**2 / 2.0))
    assert_allclose([row['slow'] for row in rows], 1.0 / (1.0 + sizes**2 / 2.0))


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


def test_fits_with_other_delays_count_by_their_likelihood():
    """As likely as the best one, a third and a quarter as likely: weights of 12, 4 and 3."""
    fits = [
        SimpleNamespace(cost=50.0 + 2.0 * np.log(less), theta=np.array(theta))
        for less, theta in ((1, [1.0, 2.0]), (3, [2.0, 0.0]), (4, [1.0, 6.0]))
    ]
    expected = 4.0 * np.outer([1, -2], [1, -2]) + 3.0 * np.outer([0, 4], [0, 4])
    assert_allclose(_between(fits), expected / 19.0)


@pytest.mark.parametrize(('deviation', 'seen'), [(2.9, True), (3.1, False)])
def test_what_shorter_segments_move_is_a_bias_where_it_is_no_chance(deviation, seen):
    """Two deviations and more, of one unknown: then what all of them moved by."""
    other = SimpleNamespace(theta=np.array([1.0, 9.0]))
    halves = SimpleNamespace(
        fit=lambda *_, **__: other, covariance=lambda _: np.diag([100.0, deviation**2])
    )
    found = _bias(SimpleNamespace(unknowns=None, theta=np.array([1.5, 3.0])), halves)
    assert_allclose(found, seen * np.array([[0.25, -3.0], [-3.0, 36.0]]))


@pytest.mark.parametrize(
    ('growth', 'length'),
    [([1, 2, 9.9, 10.1, 3, 20], 1.5), ([1, 10, 10, 10, 10, 10], 4.0), ([1, 11, 1, 1, 1, 1], 1.25)],
)
def test_a_segment_ends_where_an_error_has_grown_tenfold(growth, length):
    problem = SimpleNamespace(
        growth=lambda *_: np.array(growth), step=0.5,
        segments=[SimpleNamespace(command=np.zeros((8, 6)))],
    )  # fmt: skip
    assert segment_length(problem, None, None) == length


@pytest.mark.parametrize('rate', [0.7, -0.3])
def test_an_error_grows_as_the_vehicle_is_unstable(rate):
    """nu_dot = rate nu: of each axis by exp(rate t), all relative to the first second."""
    rov, rates = load_vehicle('bluerov2_heavy'), rate * np.array([1.0, 0.8, -0.1, 0.5, 0.3, 0.9])
    M = np.diag(np.diag(rov.M))
    vehicle = rov.changed(M=M, D_linear=-rates * M, D_quadratic=np.zeros((6, 6)),
                          buoyancy=float(rov.weight), r_B=rov.r_G)  # fmt: skip
    t, ahead = 0.05 * np.arange(141), np.tile([1.0, 0.0, 0.0, 0.0], (141, 1))
    still = Record('x', t, ahead, t, np.zeros((141, 6)), 0.05, np.zeros((140, 6)), 0.0)
    noise = np.linspace(0.01, 0.09, 9)
    problem = OutputError(vehicle, segments_of(still, 2.0, 0.6), 0.05, noise)
    growth, t = problem.growth(*as_filed(vehicle)), t[:41]
    expected = np.sqrt(np.exp(2.0 * np.outer(t, rates)).sum(axis=1))
    assert_allclose(growth, expected / expected[:21].max(), rtol=1e-5)


def test_blocks_of_time_are_segments_parts_of_them_or_several(quiet, monkeypatch):
    """They add up to what all segments tell, however many are simulated at once."""
    segments = segments_of(quiet.training[0], 2.0, 0.6)[:5]
    problem = replace(quiet.problem, segments=segments)
    u, theta = quiet.fit.unknowns, quiet.fit.theta

    def blocks(fewest, most, size=1 << 24):
        for name, value in (('BLOCKS', fewest), ('MOST_BLOCKS', most), ('BYTES', size)):
            monkeypatch.setattr(output_error, name, value)
        fit = problem.fit(u, theta, most=0)
        found = problem.blocks(fit)
        assert [len(of) for of in found] == [fit.blocks] * 2
        return found

    one = blocks(5, 400)
    few = len(theta) * len(segments[0].command) * 13 * 8 * 3  # fewer than all at once
    for of, alone in enumerate(one):
        assert len(alone) == 5
        halves, several, in_turn = (
            made[of] for made in (blocks(9, 400), blocks(1, 2), blocks(5, 400, few))
        )
        assert_allclose(halves[::2] + halves[1::2], alone, rtol=1e-9, atol=1e-9)
        assert np.abs(halves[0] - halves[1]).max() > 1e-3
        assert_allclose(several, [alone[:3].sum(axis=0), alone[3:].sum(axis=0)])
        assert_allclose(in_turn, alone, rtol=0.0, atol=1e-5 * np.abs(alone).max())


class Bent:
    """A problem of one coefficient whose cost is a parabola, of which one side may be bent."""

    def __init__(self, u, deviation, bend):
        self._u, self._deviation, self._bend = u, deviation, bend

    def cost(self, u, theta, starts):
        away = float(self._u.values(theta)[0] - self._u.values(np.zeros(1))[0]) / self._deviation
        return 50.0 + (away**2 if away > 0 else self._bend(away**2))

    def fit(self, held, theta, starts, **_):
        """Where the coefficient is held."""
        ((wanted, _),) = held.believed.values()
        moved = (wanted - self._u.values(np.zeros(1))[0]) / self._u.entries[0].unit
        return SimpleNamespace(theta=np.array([moved]), starts=starts)

    def normal(self, *_):
        return SimpleNamespace(eliminated=lambda: (None, None, np.zeros((1, 9, 2))))


@pytest.mark.parametrize(
    ('bend', 'low', 'far'),
    [(lambda x: x, -1.0, False), (lambda x: 0.0, None, True), (lambda x: 4.0 * x, -0.5, True)],
)
def test_a_profile_ends_where_the_cost_has_risen_enough_or_nowhere(bend, low, far):
    """The sandwich is twice as wide as white noise: a rise counts for a quarter."""
    u = unknowns(HERMAN, ('D_linear.yaw',), speeds=np.ones(6), wrenches=np.ones(6))
    prior, white = HERMAN.D_linear[5, 5], 0.25
    information = np.array([[(u.entries[0].unit / white) ** 2 - 1.0]])  # beside the prior's
    fit = SimpleNamespace(unknowns=u, theta=np.zeros(1), starts=np.zeros((1, 9)), cost=50.0,
                          quantile=2.5, information=information)  # fmt: skip
    covariance = np.array([[(2.0 * white / u.entries[0].unit) ** 2]])
    problem = Bent(u, white, bend)
    found = profile(problem, fit, covariance, 'D_linear.yaw')
    half = 2.5 * 0.5
    assert found.deviation == pytest.approx(0.5)
    assert found.high == pytest.approx(prior + half)
    assert found.low == (low if low is None else pytest.approx(prior + low * half, rel=1e-3))
    assert np.all(np.diff(found.values) > 0)
    away = (found.values - prior) / 0.5
    expected = [x**2 if x > 0 else bend((2.0 * x) ** 2) / 4.0 for x in away]
    assert_allclose(found.rise, expected, atol=1e-9)
    assert found.rise.max() > 2.5**2
    assert (found.rise > 6.26).sum() <= 2, 'a point beyond the end of either side'
    assert far_from_quadratic(problem, fit, covariance) == ['D_linear.yaw'] * far
