"""Recordings that are short, slow, or in part no measurement, become records or one line."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from helpers.sea_trials import DELAY, LAG, trial, wrong_prior
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.bag.foreign_checks import doubts_of_rates
from auv_analysis.bag.tracks import Track, assembled
from auv_analysis.studies.identify import identify as identifying
from auv_analysis.studies.identify.bags import on_one_step, parts, without_constants
from auv_analysis.studies.identify.couplings import signals_of
from auv_analysis.studies.identify.identify import (
    HISTORY,
    Settings,
    _noise,
    _search,
    _speeds,
    _still,
    _trusting,
    _with_best_delay,
    as_filed,
    check_motion,
    compared,
    identify,
    split,
)
from auv_analysis.studies.identify.output_error import _lagged, delayed, on_steps
from auv_analysis.studies.identify.plausibility import too_short
from auv_analysis.studies.identify.prediction import held_of, predict, sizes
from auv_analysis.studies.identify.record import (
    Record,
    cut_at_jumps,
    described,
    long_enough,
    of_tracks,
    rotated,
    segments_of,
    small_rotation,
    smoothed,
)
from auv_analysis.studies.identify.residuals import FARTHEST, fill_residuals
from auv_analysis.studies.identify.start import _definite, least_squares_start
from auv_analysis.studies.identify.unknowns import unknowns
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.vehicle_file import load_vehicle

AHEAD = [1.0, 0.0, 0.0, 0.0]
ROWS = {'pose': [0.0, 0.0, 0.0, *AHEAD], 'twist': [0.0] * 6, 'wrench': [0.0] * 6}


@pytest.fixture(scope='module')
def herman(tmp_path_factory):
    return trial(tmp_path_factory.mktemp('herman'), 'herman2018', 3, duration=60.0)[0]


def record(duration: float, step: float = 0.01, seed: int = 0) -> Record:
    """Noise as motion and as command."""
    n, rng = round(duration / step), np.random.default_rng(seed)
    t = step * np.arange(n + 1)
    nu, command = rng.normal(size=(n + 1, 6)), rng.normal(size=(n, 6))
    return Record('x', t, np.tile(AHEAD, (n + 1, 1)), t, nu, step, command, 0.0)


def shifted(one: Record, by: float) -> Record:
    """The same at other times."""
    return replace(one, start=one.start + by, attitude_t=one.attitude_t + by,
                   velocity_t=one.velocity_t + by)  # fmt: skip


def tracks(stamps: dict[str, np.ndarray]) -> dict[str, Track]:
    """A vehicle at rest, of which something is recorded at these stamps, ns."""
    return {
        role: Track(role, f'/{role}', ns, np.tile(ROWS[role], (len(ns), 1)), 2e8, role == 'wrench')
        for role, ns in stamps.items()
    }


@pytest.mark.parametrize('duration', [30.1, 60.02])
def test_four_equal_records_leave_no_empty_one(duration):
    training, held = split([record(duration)] * 4, 0.25)
    assert [len(one.command) for one in training] == [round(100 * duration)] * 3
    assert [len(one.command) for one in held] == [round(100 * duration)]


def test_what_is_held_out_begins_where_the_share_does():
    """The last 30 % of 4 s that begin at 3 s and of 6 s that begin at 10 s."""
    one, other = shifted(record(4.0), 3.0), shifted(record(6.0), 10.0)
    training, held = split([one, other], 0.3)
    found = [(part.start, part.end) for part in (*training, *held)]
    assert_allclose(found, [(3.0, 7.0), (10.0, 13.0), (13.0, 16.0)])
    assert_array_equal(held[0].command, other.command[300:])


def test_nothing_to_learn_from_is_told():
    with pytest.raises(InputError, match=r'to learn from, found 0\.9 of 8 s'):
        split([record(8.0)], 0.9)
    with pytest.raises(InputError, match=r'--part: expected .* for a second and more'):
        parts([record(30.0)], [(10.0, 10.1)])
    spans = (10.0, 11.0), (-5.0, 40.0), (25.0, np.inf)
    found = [parts([record(30.0)], [span]) for span in spans]
    assert_allclose([(one.start, one.end) for (one,) in found], [(10, 11), (0, 30), (25, 30)])
    spans = [(43.0, 45.0), (28.0, 31.0), (32.0, 36.0), (38.0, 43.0)]
    found = parts([record(30.0), shifted(record(20.0), 40.0)], spans)
    assert_allclose([(one.start, one.end) for one in found], [(28, 30), (43, 45), (40, 43)])


def test_a_record_begins_where_all_signals_have_and_ends_where_one_does():
    """Commands at 50 Hz, velocities at 25 Hz and attitudes at 10 Hz, none at the same time."""
    t = {'pose': 1.0 + 0.1 * np.arange(31), 'twist': 1.2 + 0.04 * np.arange(70),
         'wrench': 1.1 + 0.02 * np.arange(150)}  # fmt: skip
    given = tracks({role: np.rint(1e9 * times).astype(np.int64) for role, times in t.items()})
    given['pose'].rows[:, :3] = 7.0
    for role, column in (('twist', 2), ('wrench', 4)):
        given[role].rows[:, column] = t[role]
    (found,) = of_tracks('x', given)  # of 1.2 to 3.96 s
    assert (found.name, found.step, found.start) == ('x', 0.02, pytest.approx(0.2))
    assert found.end == pytest.approx(2.96)
    assert_allclose(found.command[:, 4], 1.2 + 0.02 * np.arange(138), atol=1e-9)
    assert_allclose(found.velocity[:, 2], found.velocity_t + 1.0, atol=1e-9)
    assert_allclose(found.velocity_t[[0, -1]], (0.2, 2.96))
    assert_allclose(found.attitude_t, 0.2 + 0.1 * np.arange(28), atol=1e-9)
    assert_array_equal(found.attitude, np.tile(AHEAD, (28, 1)))


def test_what_a_recording_is_described_by():
    t, signs = 0.02 * np.arange(101), np.where(np.arange(101) % 2, -1.0, 1.0)[:, None]
    nu = signs * [1.0, 2.0, 3.0, np.nan, 5.0, 6.0]
    attitude_t = 0.05 * np.arange(41)
    wrench = signs[:60] * [60.0, 50.0, 40.0, 30.0, 20.0, 10.0]
    one = Record('x', attitude_t, np.tile(AHEAD, (41, 1)), t, nu, 0.04, wrench, 0.5)
    found = described(one)
    assert found.pop('name') == 'x'
    assert found.pop('velocity_rms') == pytest.approx([1.0, 2.0, 3.0, None, 5.0, 6.0])
    assert found.pop('wrench_rms') == pytest.approx([60.0, 50.0, 40.0, 30.0, 20.0, 10.0])
    assert found == pytest.approx({'duration': 2.4, 'velocity_rate': 50.0, 'attitude_rate': 20.0})


def test_a_velocity_that_was_measured_once_is_that_throughout():
    velocity = record(3.0).velocity
    velocity[:, 4] = np.nan
    velocity[120, 4] = 0.25
    states = replace(record(3.0), velocity=velocity).states(np.array([0.5, 1.2, 2.5]))
    assert_array_equal(states[:, 8], 0.25)
    assert np.isfinite(states).all()


@pytest.mark.parametrize('burst', [1, 3])
def test_samples_that_come_in_bursts_are_smoothed_over_as_many(burst):
    """Over 0.4 s: twenty at 50 Hz, of a step in the middle, whatever their stamps."""
    even = 0.02 * np.arange(300)
    t = even[::burst].repeat(burst) + np.tile(1e-6 * np.arange(burst), 300 // burst)
    rows = np.where(even < 3.0, 0.0, 1.0)[:, None]
    found = smoothed(t, rows, np.array([2.7, 3.3]))[:, 0]
    assert_allclose(found, [0.0, 1.0], atol=1e-6)


def test_between_two_pauses_close_together_there_is_no_record():
    t = np.arange(0.0, 10.0, 0.02)
    ns = (1e9 * t[(t < 4) | ((t > 5) & (t < 5.9)) | (t > 7)]).astype(np.int64)
    assert [round(one.end) for one in of_tracks('x', tracks(dict.fromkeys(ROWS, ns)))] == [4, 10]


def turning(t: np.ndarray, yaw: float = 0.0, sway: float = 0.0) -> dict[str, Track]:
    """Noise on yaw and sway, at times in s; behind 6 s they are so much more, as by a reset."""
    given = tracks(dict.fromkeys(ROWS, np.rint(1e9 * t).astype(np.int64)))
    rng, late = np.random.default_rng(0), t > 6.01
    twist = given['twist'].rows
    twist[:] = rng.normal(0.0, 0.005, (len(t), 6))
    twist[:, [1, 5]] += np.stack([0.2 * np.cos(t) + sway * late, 1.0 + 0.2 * np.cos(t)], axis=1)
    twist[::7, 1] = np.nan
    half = (t + 0.2 * np.sin(t) + yaw * late + rng.normal(0.0, 0.003, len(t))) / 2.0
    given['pose'].rows[:, [3, 6]] = np.stack([np.cos(half), np.sin(half)], axis=1)
    return given


@pytest.mark.parametrize(('jump', 'said'), [
    ({'yaw': -1.8}, ['attitude']), ({'yaw': 0.08}, ['attitude']), ({'sway': 0.2}, ['velocity']),
    ({'yaw': 1.0, 'sway': -0.2}, ['attitude', 'velocity']),
])  # fmt: skip
def test_a_jump_of_attitude_or_velocity_ends_a_stretch(jump, said):
    given, notes = cut_at_jumps(turning(0.05 * np.arange(201), **jump))
    found = [(one.start, one.end) for one in of_tracks('x', given)]
    assert_allclose(found, [(0.0, 6.0), (6.05, 10.0)])
    assert notes == [f'the {name} jumps at 6.05 s, as by a reset: cut there' for name in said]


def test_rates_are_held_against_the_attitude_within_a_stretch():
    """Across a reset they contradict it, whatever they are."""
    given = turning(0.05 * np.arange(201), yaw=-1.8)
    assert doubts_of_rates(given['pose'], given['twist'])
    cut, _ = cut_at_jumps(given)
    assert not doubts_of_rates(cut['pose'], cut['twist'])


@pytest.mark.parametrize(('period', 'sway'), [
    (0.02, lambda t, e: 0.2 * np.cos(t) + e),
    (0.02, lambda t, e: 0.2 * np.cos(t) + 0.02 * e + 0.015 * (t > 6.0)),  # little
    (0.02, lambda t, e: 0.2 * np.cos(t) + e + (np.arange(len(t)) % 270 == 7)),  # spikes
    (0.02, lambda t, e: np.where(t % 4.3 < 0.15, np.nan, 0.3 * np.sin(5.0 * t))),  # drop-outs
    (0.02, lambda t, e: np.round((0.3 * t + 0.1 * np.sin(1.3 * t) + 0.4 * e) / 0.03) * 0.03),
    (0.02, lambda t, e: np.round(4.0 * np.cos(0.3 * t)) * 0.05),  # quanta, here such as come seldom
    (0.02, lambda t, e: (e + 0.2 * (t > 6.0))[np.arange(len(t)) // 50 * 50]),  # repeated
    (0.02, lambda t, e: np.abs(t % 4.0 - 2.0)),  # thrusters that turn round
    (0.20, lambda t, e: np.where(t < 6.0, 0.0, 0.3 - 0.3 * np.exp(5.0 * (6.0 - t)))),
    (0.50, lambda t, e: e + 0.3 * (t > 6.0)),  # in a long time
])  # fmt: skip
def test_what_noise_sensors_and_thrusters_do_is_no_jump(period, sway):
    t = np.arange(0.0, 20.0, period)
    given = turning(t)
    given['twist'].rows[:, 1] = sway(t, np.random.default_rng(3).normal(0.0, 0.005, len(t)))
    cut, notes = cut_at_jumps(given)
    assert (notes, len(cut['pose'].resets)) == ([], 0)


def test_commands_of_recordings_come_to_the_finest_step():
    coarse, fine = record(7.2, 0.06), record(5.0, 0.02)  # of which 7.2 are 359.99999999999994
    found, same = on_one_step([coarse, fine])
    assert same is fine
    assert found.step == 0.02
    assert found.end == pytest.approx(coarse.end)
    middles = found.step * (np.arange(len(found.command)) + 0.5)
    assert_array_equal(found.command, coarse.command[(middles / coarse.step).astype(int)])


def test_a_command_that_never_changes_tells_nothing(herman):
    held = replace(herman, command=np.full_like(herman.command, 3.0))
    check_motion([held, herman], herman.noise())
    with pytest.raises(InputError, match='wrench: expected a command that changes, found a const'):
        check_motion([held], herman.noise())


@pytest.mark.parametrize(('size', 'at_rest'), [(0.04, True), (0.06, False)])
def test_a_vehicle_is_not_at_rest_where_one_recording_shows_it_move(size, at_rest):
    """By more than five times the noise, in one velocity that another one lacks."""
    blind, seeing = (
        replace(one, velocity=1e-3 * one.velocity) for one in (record(9.0), record(9.0, seed=1))
    )
    noise = np.where(np.arange(6) == 3, np.nan, 0.01)  # what nobody measured
    blind.velocity[:, 3] = seeing.velocity[:, 3] = np.nan
    blind.velocity[:, 2], seeing.velocity[:, 2] = np.nan, size * np.resize([1.0, -1.0], 901)
    told = pytest.raises(InputError, match='at rest') if at_rest else nullcontext()
    with told:
        check_motion([blind, seeing], noise)


def test_a_segment_fits_into_a_record(herman, monkeypatch):
    """The longest one, and nothing is fitted before that is known."""
    monkeypatch.setattr(identifying, '_search', None)
    some = [herman.part(0.0, 3.0), herman.part(5.0, 13.0)]
    with pytest.raises(InputError, match=r'--segment: expected at most 7\.4 s, found 100 s'):
        identify(some, [], load_vehicle('herman2018'), Settings(segment=100.0))


@pytest.mark.parametrize(('short', 'longest'), [(8, 2.4), (4, 6.25)])
def test_segments_are_no_longer_than_most_of_what_is_recorded(short, longest, herman, monkeypatch):
    """Stretches of 3 s beside one of 13 s: longer segments would leave all of them out."""
    asked = []

    def enough(problem, begun, lengths, *_):
        asked.append(lengths[1])
        raise StopIteration

    monkeypatch.setattr(identifying, '_search', enough)
    some = [herman.part(3.0 * k, 3.0 * k + 3.0) for k in range(short)] + [herman.part(25.0, 38.0)]
    with pytest.raises(StopIteration):
        identify(some, [], load_vehicle('herman2018'), Settings(('M',)))
    assert asked == [pytest.approx(longest)]


@pytest.mark.parametrize(('unmeasured', 'length'), [(None, 1.25), (2, 5.0)])
def test_the_first_fit_is_over_a_few_segments_evenly_chosen(
    unmeasured, length, herman, monkeypatch
):
    """Longer ones where a velocity is not measured, of which each start is a guess."""
    found = []

    def enough(problem, *_):
        found.extend(problem.segments)
        raise StopIteration

    monkeypatch.setattr(identifying, 'FIRST', 5)
    monkeypatch.setattr(identifying, '_with_best_delay', enough)
    some = replace(herman, velocity=np.where(np.arange(6) == unmeasured, np.nan, herman.velocity))
    with pytest.raises(StopIteration):
        identify([some], [], load_vehicle('herman2018'), Settings(('M',)))
    apart = np.diff([one.begin for one in found])
    assert len(found) in (4, 5)
    assert apart.min() == pytest.approx(apart.max())
    assert found[-1].begin > 45.0
    assert len(found[0].command) * herman.step == pytest.approx(length, abs=0.02)


@pytest.mark.parametrize(
    ('segment', 'observer', 'length', 'gain'),
    [(None, 0.0, 6.0, 0.0), (None, None, 10.0, 0.3), (None, 0.2, 7.0, 0.2), (2.0, None, 2.0, 0.3)],
)
def test_a_search_goes_from_short_segments_to_those_that_the_instability_allows(
    segment, observer, length, gain, monkeypatch
):
    """Longer ones with an observer, at most all there is; and beside them those of half."""
    asked, delays, said = [], [], []

    def problem(length, gain=0.0, most=None):
        asked.append(most)
        return length, gain

    def best(of, u, theta, late, nearby):
        delays.append((of, theta, late, nearby))
        return [SimpleNamespace(unknowns=u, theta='better')]

    grown = {0.0: 6.0, 0.2: 7.0, 0.3: 12.0}
    monkeypatch.setattr(identifying, '_with_best_delay', best)
    monkeypatch.setattr(identifying, '_best_observer', lambda *_: 0.3)
    monkeypatch.setattr(identifying, 'segment_length', lambda of, *_: grown[of[1]])
    u = SimpleNamespace(prior=SimpleNamespace(delay=0.25),
                        coefficients=lambda _: SimpleNamespace(lag=0.5))  # fmt: skip
    settings = Settings(segment=segment, observer=observer)
    final, halves, tried = _search(problem, (u, 'start', 0.1), (1.25, 10.0), settings, said.append)
    assert (final, halves) == ((length, gain), (length / 2, gain))
    assert delays == [
        ((1.25, 0.0), 'start', 0.1, 30.0), ((length, gain), 'better', 0.75, 9.0)
    ]  # fmt: skip
    assert asked[0] == identifying.FIRST
    assert said == [f'output error over segments of {length:g} s']
    assert len(tried) == 1


@pytest.mark.parametrize(('prior', 'begun'), [(0.0, 3), (0.08, 4)])
def test_delays_are_tried_to_either_side_as_long_as_the_cost_rises_little(prior, begun):
    """Lag and delay together stay as late as they were: only their shares are tried."""
    costs, tried = (90.0, 60.0, 70.0, 50.0, 52.0, 95.0, 10.0), []

    def fit(u, theta, starts=None, **_):
        k = round(float(u.prior.delay) / 0.02)
        assert starts is (None if k == begun else tried[0].starts)
        found = u.coefficients(theta)
        assert float(found.lag + found.delay) == pytest.approx(0.12)
        tried.append(SimpleNamespace(unknowns=u, theta=theta, cost=costs[k], starts='starts'))
        return tried[-1]

    problem = SimpleNamespace(step=0.02, fit=fit)
    u = unknowns(load_vehicle('herman2018'), ('lag', 'delay'), speeds=np.ones(6),
                 wrenches=np.ones(6), lag=0.1).with_delay(prior)  # fmt: skip
    fits = _with_best_delay(problem, u, np.zeros(1), 0.12, 30.0)
    assert [one.cost for one in fits] == [50.0, 52.0, 60.0, 70.0, 90.0, 95.0]
    tried.clear()
    known = replace(u, is_delay_free=False).with_delay(0.06)
    begun = 3
    (alone,) = _with_best_delay(problem, known, np.zeros(1), 0.12, 30.0)
    assert alone.cost == 50.0


def test_many_short_stretches_are_enough(herman):
    """Twenty stretches of 3 s are together longer than the longest segment."""
    stretches = [herman.part(2.9 * i, 2.9 * i + 3.0) for i in range(20)]
    few = Settings(('M.diagonal',))
    found = identify(stretches, [], load_vehicle('herman2018'), few)
    assert len(found.problem.segments) == 20


@pytest.mark.parametrize(('period', 'step'), [(1e-3, 0.002), (0.0123456, 0.012), (0.1, 0.05)])
def test_commands_are_held_for_a_period_of_two_digits_within_bounds(period, step):
    ns = np.rint(1e9 * period * np.arange(2.0 / period)).astype(np.int64)
    (found,) = of_tracks('x', tracks(dict.fromkeys(ROWS, ns)))
    assert found.step == step


def test_a_segment_has_two_steps_at_least_and_one_in_which_nothing_is_measured_is_left_out():
    one = record(3.0)
    assert [len(part.command) for part in segments_of(record(1.0, 0.1), 0.05, 0.6)] == [2, 2]
    there = (one.velocity_t < 1.005) | (one.velocity_t > 1.405)
    gap = replace(one, attitude_t=one.attitude_t[there], attitude=one.attitude[there],
                  velocity_t=one.velocity_t[there], velocity=one.velocity[there])  # fmt: skip
    begins = [part.begin for part in segments_of(gap, 0.2, 0.0)]
    assert_allclose(begins, 0.2 * np.delete(np.arange(15), [5, 6]), atol=1e-9)


def test_a_record_needs_a_second_and_nine_samples_of_either():
    one = record(1.0)
    assert long_enough([one, one.part(0.0, 0.98)]) == [one]
    for count, enough in ((9, True), (8, False)):
        few = slice(0, count)
        velocity = replace(one, velocity_t=one.velocity_t[few], velocity=one.velocity[few])
        attitude = replace(one, attitude_t=one.attitude_t[few], attitude=one.attitude[few])
        assert [len(long_enough([some])) for some in (velocity, attitude)] == [enough] * 2


def test_a_usual_speed_is_that_of_the_recordings_where_they_tell_it():
    one, other = record(2.0), record(3.0, seed=1)
    one.velocity[:, 3] = other.velocity[:, 3] = np.nan
    one.velocity[:, 4], other.velocity[:, 4] = np.nan, 0.5
    one.velocity[:, 5] = other.velocity[:, 5] = 1e-6
    one.velocity[::2, 2] = other.velocity[::2, 2] = np.nan  # measured half as often
    one.velocity[1::2, 2], other.velocity[1::2, 2] = 3.0, -3.0
    both = np.concatenate([one.velocity, other.velocity])[:, :2]
    expected = [*np.sqrt((both**2).mean(axis=0)), 3.0, 0.3, 0.5, 1e-3]
    assert_allclose(_speeds([one, other]), expected)


@pytest.mark.parametrize(('duration', 'count'), [(2.9, 2), (3.0, 3), (3.9, 3)])
def test_segments_are_of_one_length(duration, count):
    found = segments_of(record(duration, 0.1), 1.0, 0.0)
    assert [len(one.command) for one in found] == [10] * count


def test_a_start_keeps_the_prior_of_what_is_not_linear(herman):
    """Gain, bias and current: the prior is theta = 0."""
    free = ('M', 'D_linear', 'gain', 'bias', 'current')
    u = unknowns(load_vehicle('herman2018'), free, speeds=np.ones(6), wrenches=np.ones(6), lag=0.05)
    theta, late, _ = least_squares_start([herman], u)
    assert late == 0.05
    kept = [k for k, one in enumerate(u.entries) if one.group in ('gain', 'bias', 'current')]
    assert len(kept) > 12
    assert_allclose(theta[kept], 0.0, atol=1e-12)
    assert np.abs(np.delete(theta, kept)).max() > 0
    blind = replace(herman, velocity=np.where(np.arange(6) == 2, np.nan, herman.velocity))
    theta, late, _ = least_squares_start([blind], u.with_delay(0.02))
    assert not theta.any()
    assert late == pytest.approx(0.07)


@pytest.mark.parametrize('rate', [5.0, 9.5, 10.0, 10.4, 12.0])
def test_a_start_is_found_from_a_slow_velocity(herman, rate):
    """As a Doppler log gives it; the prior is 25 % off."""
    rows = np.rint(np.arange(0.0, herman.end, 1.0 / rate) / herman.step).astype(int)
    slow = replace(herman, velocity_t=herman.velocity_t[rows], velocity=herman.velocity[rows])
    vehicle = load_vehicle('herman2018')
    speeds, wrenches = (np.sqrt((x**2).mean(axis=0)) for x in (slow.velocity, slow.command))
    u = unknowns(wrong_prior(vehicle, 3), speeds=speeds, wrenches=wrenches)
    theta, late, _ = least_squares_start([slow], u)
    found = u.coefficients(theta)
    assert_allclose(np.diag(found.M), np.diag(vehicle.M), rtol=0.1)
    beside, true = (A[np.tril_indices(6, -1)] for A in (found.M, vehicle.M))
    assert_allclose(beside, true, atol=0.15 * np.abs(true).max())
    assert_allclose(found.hydrostatics, vehicle.model.hydrostatics, rtol=0.05, atol=1.0)
    drag, true = (np.diag(a.D_linear) + np.diag(a.D_quadratic) * speeds for a in (found, vehicle))
    assert_allclose(drag, true, rtol=0.2)
    quadratic, true = (np.diag(a.D_quadratic)[:3] for a in (found, vehicle))
    assert_allclose(quadratic, true, rtol=0.2)
    assert late == pytest.approx(LAG + DELAY, abs=0.03)


def test_a_command_is_reversed_where_it_accelerates_the_vehicle_and_not_where_drag_takes_it(herman):
    vehicle = load_vehicle('herman2018')
    u = unknowns(vehicle, speeds=np.full(6, 0.1), wrenches=np.full(6, 10.0))
    for drag, said in ((0.0, ['roll']), (3e4, [])):
        command = herman.command.copy()
        command[:, 3] = drag * herman.velocity[:-1, 3] - command[:, 3]
        assert least_squares_start([replace(herman, command=command)], u)[2] == said


def test_a_start_counts_lift_and_couplings_of_damping(tmp_path):
    """Without them inertia of pitch and yaw comes out a third too large."""
    data = yaml.safe_load(shipped('vehicles', 'herman2018').read_text())
    lift, linear = np.zeros((6, 6)), np.diag(np.diag(load_vehicle('herman2018').D_linear))
    lift[[1, 1, 2, 2, 4, 4, 5, 5], [1, 5, 2, 4, 2, 4, 1, 5]] = (
        400,
        -300,
        400,
        300,
        -900,
        900,
        900,
        900,
    )
    linear[1, 5], linear[5, 1] = -90.0, 90.0
    data |= {'lift': lift.tolist(), 'damping': data['damping'] | {'linear': linear.tolist()}}
    (tmp_path / 'finned.yaml').write_text(yaml.safe_dump(data))
    vehicle = load_vehicle(tmp_path / 'finned.yaml')
    one, _ = trial(tmp_path, 'herman2018', 3, vehicle='finned.yaml', duration=40.0)
    speeds, wrenches = (np.sqrt((x**2).mean(axis=0)) for x in (one.velocity, one.command))
    u = unknowns(vehicle, speeds=speeds, wrenches=wrenches)
    theta, _, wrong = least_squares_start([one], u, vehicle.lift)
    assert not wrong
    assert_allclose(np.diag(u.coefficients(theta).M), np.diag(vehicle.M), rtol=0.05)


def test_pauses_of_several_topics_end_a_stretch_as_those_of_one_do_and_a_told_gap_as_told():
    ns = 10**8 * np.arange(100)
    paused = {'pose': ns, 'twist': ns[(ns < 4e9) | (ns > 4.2e9)], 'wrench': ns}
    one = tracks(paused)
    half = one['twist'].rows.copy()
    half[:, 3:] = np.nan
    both = (replace(one['twist'], rows=half), replace(one['twist'], rows=half[:, ::-1]))
    for gap, told in ((2e8, False), (2e8, True), (5e8, True)):
        parts = tuple(replace(part, limit=gap, told=told) for part in both)
        for twist in (parts[0], assembled(parts, Path('x'))):
            found = of_tracks('x', one | {'twist': twist})
            assert len(found) == (2 if told and gap < 4e8 else 1)


@pytest.mark.parametrize(('steps', 'said'), [
    ((30, 30), ''), ((29, 45, 40), '1.45 s in 1 of 3 stretches are used for the first guess only'),
    ((29, 45, 20), '2.45 s in 2 of 3 stretches'),
])  # fmt: skip
def test_recordings_too_short_for_a_segment_are_told(steps, said):
    training = [record(10.0, 0.05).part(0.0, 0.05 * n) for n in steps]
    segment = SimpleNamespace(before=np.zeros((10, 6)), command=np.zeros((20, 6)))
    problem = SimpleNamespace(segments=[segment], step=0.05)
    found = too_short(SimpleNamespace(training=training, problem=problem))
    assert len(found) == bool(said)
    assert said in ''.join(found)


def test_a_component_that_never_changes_is_no_measurement():
    rows = np.random.default_rng(0).normal(size=(50, 6))
    rows[:, 2], rows[:, 4] = 0.0, np.nan
    notes = []
    found = without_constants(Track('twist', '/v', np.arange(50), rows, np.inf, held=False), notes)
    assert_array_equal(found.given, [True, True, False, True, False, True])
    assert notes == ['/v: w is constant, taken as not measured']


def test_what_stands_still_tells_no_noise():
    """Residuals in deviations of a noise of zero would all be as large as can be."""
    still = record(10.0)
    velocity = still.velocity.copy()
    velocity[:, 2] = 0.1
    found = replace(still, velocity=velocity).noise()
    assert_array_equal(np.isnan(found), np.isin(np.arange(9), [2, 6, 7, 8]))
    assert_allclose(found[[0, 1, 3, 4, 5]], 1.0, rtol=0.1)


def test_noise_of_several_recordings_is_of_those_that_measure():
    """The variance is a mean over them, whatever their length."""
    some = [record(10.0, seed=k) for k in (1, 2)]
    blind = replace(some[1], velocity=2.0 * some[1].velocity)
    blind.velocity[:, 4] = np.nan
    one, other = (part.noise()[:6] for part in (some[0], blind))
    expected = np.sqrt((one**2 + other**2) / 2)
    expected[4] = one[4]
    assert_allclose(_noise([some[0], blind])[:6], expected)


def test_the_prior_of_what_an_unmeasured_axis_would_tell_is_trusted_more():
    vehicle, free = load_vehicle('herman2018'), ('M', 'D_linear.full', 'restoring', 'lag')
    u = unknowns(vehicle, free, speeds=np.ones(6), wrenches=np.ones(6))
    found = _trusting(u, np.arange(6) != 2)
    for before, after in zip(u.entries, found.entries, strict=True):
        told = before.group in ('M', 'D_linear') and 2 in before.index
        assert after.unit == (0.3 if told else 1.0) * before.unit, before.name


def test_residuals_are_measured_less_simulated_at_the_time_of_the_measurement():
    draw = np.random.default_rng(2)
    turns = 0.1 * draw.normal(size=(2, 3, 6, 3))
    states = draw.normal(size=(2, 3, 6, 13))  # of two variants, three segments after each step
    states[..., 3:7] = rotated(np.tile(AHEAD, (2, 3, 6, 1)), turns)
    start, later = states[:, :, 0, 3:].copy(), np.ascontiguousarray(states[:, :, 1:])
    at = np.array([0.4, 1.0, 2.0 + 1e-9, 3.25, 5.0])
    nu, q = draw.normal(size=(5, 6)), -rotated(np.tile(AHEAD, (5, 1)), turns[0, 0, :5])
    nu[1, 2], q[3] = np.nan, np.nan
    later[1, 1, 1, 7] = np.nan  # has diverged
    scale, e = np.arange(1.0, 10.0), np.empty((2, 5, 9))
    fill_residuals(start, later, 1, at, nu, q, scale, e)
    for v in range(2):
        then = np.concatenate([start[v, 1, None], later[v, 1, :, 3:]])
        seen = np.stack([np.interp(at, range(6), column) for column in then.T], axis=1)
        expected = np.concatenate([nu - seen[:, 4:], small_rotation(seen[:, :4], q)], axis=1)
        expected = np.where(np.isnan(np.concatenate([nu, q[:, 1:]], axis=1)), 0.0, expected / scale)
        assert_allclose(e[v], np.nan_to_num(expected, nan=-FARTHEST), atol=1e-7)
    assert e[1, 2, 0] == -FARTHEST


def test_the_observer_sees_velocity_and_attitude_with_stamps_of_their_own():
    one = record(2.0)
    later = replace(one, attitude_t=one.attitude_t + 1e-3, velocity_t=one.velocity_t - 1e-3)
    expected, found = (on_steps(segments_of(r, 1.0, 0.6)[0]) for r in (one, later))
    assert np.isfinite(expected).all()
    assert_array_equal(found[:-1], expected[:-1])  # the last attitude is behind the end


@pytest.mark.parametrize('steps', [0.0, 0.4, 2.0, 2.3])
def test_commands_are_delayed_by_any_number_of_steps(steps):
    commands, k = np.random.default_rng(3).normal(size=(2, 9, 6)), np.arange(9.0)
    found = delayed(commands, steps)
    for i, j in np.ndindex(2, 6):
        assert_allclose(found[i, :, j], np.interp(k - steps, k, commands[i, :, j]), atol=1e-12)


def test_a_lag_leaves_of_past_wrenches_what_it_makes_of_them_one_by_one():
    draw = np.random.default_rng(4)
    past, follow = draw.normal(size=(3, 7, 6)), draw.uniform(0.05, 0.9, (2, 6))
    found = _lagged(past, follow)
    for v, s in np.ndindex(2, 3):
        tau = past[s, 0]
        for asked in past[s]:
            tau = tau + follow[v] * (asked - tau)
        assert_allclose(found[v, s], tau)


@pytest.mark.parametrize(
    ('duration', 'apart', 'block'), [(3.0, 0.25, 2.25), (30.0, 0.25, 5.0), (195.0, 0.525, 5.0)]
)
def test_moments_of_prediction_are_apart_and_blocks_lie_in_one_recording(duration, apart, block):
    records = [record(duration, 0.025), record(15.0, 0.025)]
    held = held_of(records, 0.5)
    begins = [np.array([one.begin for one in some]) for some in held.segments]
    for one in begins:
        assert_allclose(np.diff(one), apart, atol=1e-9)
    first, second = np.split(held.blocks, [len(begins[0])])
    assert_array_equal(first, (begins[0] // block).astype(int))
    assert_array_equal(second - second[0], (begins[1] // block).astype(int))
    assert second.min() > first.max()


def test_a_stretch_shorter_than_the_horizons_is_left_out(herman):
    vehicle, long, short = load_vehicle('herman2018'), herman.part(0.0, 12.0), herman.part(20, 21.5)
    several, alone = (compared([long], held_of(some, HISTORY), vehicle)
                      for some in ([long, short], [long]))  # fmt: skip
    assert len(several) == len(alone) == 3 * 5
    for one, other in zip(several, alone, strict=True):
        assert one['predictor'] == other['predictor']
        assert one['error'] == pytest.approx(other['error'])


def test_stretches_that_are_short_are_predicted_as_far_as_they_reach():
    """Of a minute 12 s would be a fifth, but none of the ten lasts as long."""
    some = [shifted(record(6.0, 0.05), 10.0 * k) for k in range(10)]
    held = held_of(some, HISTORY)
    assert held.horizons.tolist() == [0.1, 0.2, 0.5, 1.0, 2.0]
    assert held.count == 10 * 14  # from 0.6 s on, every 0.25 s, 2 s before their end


def test_an_error_counts_by_its_energy_and_as_a_thousand_at_most():
    errors = np.array([[[1e9, 3.0, np.nan, 0.0, 0.0, -2.0]]])
    found = sizes(errors, np.diag([4.0, 8.0, 1.0, 1.0, 1.0, 5.0]))
    assert_allclose(found, [[(4e6 + 72.0 + 20.0) / 4.0]])


def test_a_prediction_is_compared_at_the_time_of_the_measurement():
    """At 25 Hz 0.1 s lie between two steps."""
    vehicle, push = load_vehicle('bluerov2_heavy'), [20.0, 10.0, 10.0, 0.5, 0.5, 0.5]

    def predicted(step):
        n = round(20.0 / step)
        t, q, rest = step * np.arange(n + 1), np.tile(AHEAD, (n + 1, 1)), np.zeros((n + 1, 6))
        held = held_of([Record('x', t, q, t, rest, step, np.tile(push, (n, 1)), 0.0)], 0.6)
        assert held.horizons[0] == 0.1
        return predict(held, vehicle, *as_filed(vehicle))[0]

    assert_allclose(predicted(0.04), predicted(0.02), rtol=0.02)


def test_a_vehicle_as_filed_acts_behind_the_lag_and_the_delay_that_are_given(herman):
    vehicle, part = load_vehicle('herman2018'), herman.part(0.0, 10.0)
    u, theta = as_filed(vehicle, 0.2, 0.06)
    found = u.coefficients(theta)
    assert (found.lag, found.delay) == (0.2, 0.06)
    errors = predict(held_of([part], HISTORY), vehicle, u, theta)[:, 0, :3]
    first, *_ = compared([part], held_of([part], HISTORY), vehicle, lag=0.2, delay=0.06)
    assert first['predictor'] == 'herman2018'
    assert first['linear'] == pytest.approx(np.sqrt((errors**2).sum(axis=1).mean()))


def test_the_length_of_a_segment_is_as_asked_and_what_is_kept_counts(herman, monkeypatch):
    for name, size in (('_between', 100.0), ('_bias', 200.0), ('_of_still', 400.0)):
        monkeypatch.setattr(identifying, name, lambda *_, size=size: size * np.eye(6))
    monkeypatch.setattr(identifying, 'far_from_quadratic', lambda *_: ['M.yaw.yaw'])
    monkeypatch.setattr(identifying, 'profile', lambda *of: of[-1])
    few = Settings(('M.diagonal',), segment=2.0, profile=('M.heave.heave', 'auto'))
    found = identify([herman.part(0.0, 20.0)], [], load_vehicle('herman2018'), few)
    assert found.profiles == ['M.heave.heave', 'M.yaw.yaw']
    assert len(found.problem.segments[0].command) * found.problem.step == pytest.approx(2.0)
    assert_allclose(np.diag(found.covariance), 700.0, atol=1.0)


def test_when_a_recording_began_changes_nothing():
    """Times of a power of two have no rounding that would take another window of samples."""
    vehicle, now = load_vehicle('herman2018'), record(15.0, 1.0 / 64.0)
    later = shifted(now, 128.0)
    u = unknowns(vehicle, speeds=np.full(6, 0.2), wrenches=np.full(6, 50.0))
    (theta, late, _), (other, lag, _) = (least_squares_start([one], u) for one in (now, later))
    assert late == lag
    assert_allclose(other, theta, atol=1e-9)
    assert_allclose(later.evenly()[:140], now.evenly()[:140], atol=1e-9)
    before, after = (compared([one], held_of([one], HISTORY), vehicle) for one in (now, later))
    for one, same in zip(before, after, strict=True):
        # the black box learns from one sample more or less
        within = 0.05 if one['predictor'] == 'black box' else 1e-6
        assert same['error'] == pytest.approx(one['error'], rel=within)
    for one, same in zip(*(segments_of(record, 2.0, 0.6) for record in (now, later)), strict=True):
        assert same.begin == pytest.approx(one.begin + 128.0)
        assert_allclose(same.start, one.start, atol=1e-9)
        assert_array_equal(same.command, one.command)


def test_velocity_and_command_of_a_coupling_are_of_one_moment():
    """Of recordings of different lengths about as many samples each, at most a few thousand."""
    some = []
    for duration, begin in ((30.0, 5.0), (4.0, 50.0)):
        one = shifted(record(duration), begin)
        middles = one.start + 0.01 * (np.arange(len(one.command)) + 0.5)
        ramps = one.velocity_t, middles
        velocity, command = (np.outer(t, np.arange(1.0, 7.0)) for t in ramps)
        some.append(replace(one, velocity=velocity, command=-command))
    nu, tau = signals_of(SimpleNamespace(training=some))
    assert len(nu) == 1000 + 400
    assert_allclose(nu, -tau, rtol=1e-6)
    assert_allclose(nu[[0, -1], 0], (5.005, 53.995), rtol=1e-6)


def test_what_hardly_moves_is_not_searched():
    some = record(10.0)
    some.velocity[:, 1] *= 1e-3
    u = unknowns(load_vehicle('herman2018'), ('M', 'D_linear'), speeds=np.ones(6),
                 wrenches=np.ones(6))  # fmt: skip
    noise, lacking = np.full(9, 0.01), record(30.0, seed=1)
    lacking.velocity[:, 1] = np.nan
    found = _still([some], noise, u)
    assert [e.name for e in found] == ['M.sway.sway', 'D_linear.sway']
    some.velocity[:, 1] *= 0.03 / some.evenly()[:, 1].std()  # three times its noise
    assert not _still([some], noise, u)
    assert not _still([some, lacking], noise, u), 'what was not measured did not stand still'


def test_a_start_has_the_inertia_that_is_definite_and_nearest():
    M = load_vehicle('herman2018').M
    assert_allclose(_definite(M, M), M, rtol=1e-12, atol=1e-9)
    prior, wrong = np.diag(np.arange(1.0, 7.0)), np.diag(np.arange(1.0, 7.0))
    wrong[0, 0] = -3.0  # a twentieth of the prior takes its place
    wrong[4, 2] = wrong[2, 4] = 2.0 * np.sqrt(5.0 * 3.0)  # twice what is possible
    found = _definite(wrong, prior)
    assert found[0, 0] == pytest.approx(0.05)
    # of [[1, 2], [2, 1]] the eigenvalue -1 becomes 0.02
    assert (found[2, 2], found[4, 4]) == pytest.approx((3.0 * 1.51, 5.0 * 1.51))
    assert found[4, 2] == pytest.approx(1.49 * np.sqrt(5.0 * 3.0))
    assert_allclose(np.diag(found)[[1, 3, 5]], [2.0, 4.0, 6.0])
