"""`auv identify` recovers what was simulated, says what it cannot, and refuses what is wrong."""

import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from helpers.sea_trials import DELAY, trial, truth, wrong_prior
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

from auv_analysis.bag.tracks import Track
from auv_analysis.studies.identify import plausibility
from auv_analysis.studies.identify.couplings import _excludes_zero, _told, couplings
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.identify import (
    Settings,
    _dissipative,
    _of_still,
    _with_best_delay,
    feeding,
    identify,
    split,
)
from auv_analysis.studies.identify.output_error import Normal, OutputError
from auv_analysis.studies.identify.plausibility import (
    _scale,
    _useless,
    check_rates,
    contradictions,
    excitation,
    too_coarse,
)
from auv_analysis.studies.identify.prediction import held_of
from auv_analysis.studies.identify.record import Record, of_tracks, segments_of
from auv_analysis.studies.identify.unknowns import unknowns
from auv_analysis.studies.identify.vehicle_text import vehicle_text, with_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.frames import swap_attitude, swap_body
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.vehicle_file import is_semidefinite, load_vehicle, vehicle_from_dict
from auv_gvc_controller.laws.model import decompose

REST = {dof: {} for dof in DOFS}
SINE = {'surge': {'terms': [{'amplitude': 0.3, 'omega': 0.5}]}}
FEW = ('M.diagonal', 'D_linear', 'lag', 'delay')  # free where the rest is known: a fit of a second


@pytest.fixture(scope='module')
def herman(tmp_path_factory):
    return trial(tmp_path_factory.mktemp('herman'), 'herman2018', 3, duration=60.0)


@pytest.fixture(scope='module')
def found(herman):
    training, held = split([herman[0]], 0.25)
    return identify(training, held, wrong_prior(load_vehicle('herman2018'), 3))


def test_the_truth_is_recovered_and_covered(found):
    true = truth(found.fit.unknowns, load_vehicle('herman2018'))
    rows = {row['name']: row for row in found.coefficients()}
    for dof in DOFS:
        name = f'M.{dof}.{dof}'
        assert rows[name]['value'] == pytest.approx(true[name], rel=0.01)
    assert rows['M.pitch.heave']['value'] == pytest.approx(-37.5, rel=0.03)
    assert rows['lag']['value'] + rows['delay']['value'] == pytest.approx(0.12, abs=0.004)
    known = [row for row in rows.values() if row['status'] == 'identified']
    assert len(known) >= 35
    inside = [row['low'] <= true[row['name']] <= row['high'] for row in known]
    assert np.mean(inside) >= 0.85, [
        r['name'] for r, ok in zip(known, inside, strict=True) if not ok
    ]


def test_what_was_held_out_is_predicted_better_than_by_others(found):
    rows = [row for row in found.predictions if row['horizon'] >= 0.5]
    for other in ('prior', 'persistence', 'black box'):
        assert all(row['ratio_high'] < 0.5 for row in rows if row['predictor'] == other)
    assert not contradictions(found)


def test_couplings_have_intervals(found):
    vehicle, tables = load_vehicle('herman2018'), couplings(found)
    for row in tables['inertia']:
        i, j = (DOFS.index(dof) for dof in row['pair'].split(', '))
        if abs(vehicle.M[i, j]) > 1.0:
            assert row['verdict'] == 'real'
            assert row['M'] == pytest.approx(vehicle.M[i, j], rel=0.05)
            assert row['M_low'] < row['M'] < row['M_high']
    shares = [row['share'] for row in tables['shares']]
    assert sum(shares) == pytest.approx(1.0)


def test_models_are_drawn_also_where_nearly_all_doubt_is_in_one_direction(found):
    """As after a fit that diverged; rounding leaves its covariance eigenvalues below zero."""
    names, entries = found.fit.unknowns.names, found.fit.unknowns.entries
    drawn = replace(found, covariance=np.full((len(names),) * 2, 1e8)).draws(50)
    decompose(drawn.M)
    moves = [np.ptp(drawn.D_linear[:, i, i]) / entries[names.index(f'D_linear.{dof}')].unit
             for i, dof in enumerate(DOFS[:2])]  # fmt: skip
    assert_allclose(moves, 8.0, rtol=1e-6)


def test_what_is_unknown_by_itself_is_no_combination(found):
    """Of coefficients that are as unknown, every mixture is as unknown as well."""
    names = found.fit.unknowns.names
    apart = 1e-6 * np.random.default_rng(0).normal(size=(len(names),) * 2)
    apart[0, 1] = -25.0  # and once more below: of variances of 100, by a prior ten times as wide
    fit = replace(found.fit, information=np.zeros_like(found.fit.information))
    every = replace(found, fit=fit, covariance=np.eye(len(names)) + apart + apart.T).combinations()
    both = [one['words'] for one in every if set(one['names']) == set(names[:2])]
    assert ['becomes less' in words for words in both] == [True, False]
    words = {one['words'] for one in every} - set(both)
    assert words == {f'nothing is known of {name}' for name in names[2:]}


@pytest.mark.parametrize(
    ('wrong', 'said'),
    [
        (lambda r: replace(r, command=10.0 * r.command), 'too large'),
        (
            lambda r: replace(r, attitude=swap_attitude(r.attitude),
                              velocity=swap_body(r.velocity), command=swap_body(r.command)),
            'ENU and FLU',
        ),
    ],
)  # fmt: skip
def test_a_wrong_reading_is_told(herman, wrong, said, approved):
    training, held = split([wrong(herman[0].part(0.0, 20.0))], 0.25)
    result = identify(training, held, wrong_prior(load_vehicle('herman2018'), 3))
    assert said in contradictions(result)[0]
    approved.within = 0.02
    approved.add(contradictions(result))


@pytest.mark.parametrize(('step', 'told'), [(0.05, False), (1.0, True)])
def test_commands_that_come_too_seldom_for_the_damping_are_told(herman, step, told, monkeypatch):
    for name in ('_scale', '_mirrored'):
        monkeypatch.setattr(plausibility, name, lambda found: [])
    worse = {'predictor': 'persistence', 'horizon': 1.0, 'ratio_low': 1.5}
    found = SimpleNamespace(vehicle=load_vehicle('lauv'), training=[herman[0]],
                            problem=SimpleNamespace(step=step), predictions=[worse])  # fmt: skip
    assert [f'every {step:.1f} s' in text for text in too_coarse(found)] == [True] * told
    (reason,) = contradictions(found)
    assert ('record them more often' in reason, 'another vehicle' in reason) == (told, not told)


@pytest.mark.parametrize(('share', 'told'), [(0.4, True), (0.6, False)])
def test_inertia_far_below_that_of_the_rigid_body_alone_is_told(share, told):
    """Of lauv nearly all inertia in surge is its own."""
    vehicle = load_vehicle('lauv')
    M = vehicle.M * np.diag([share, 1, 1, 1, 1, 1])
    rows = [
        {'name': f'M.{dof}.{dof}', 'status': 'identified', 'value': M[i, i],
         'prior': vehicle.M[i, i]} for i, dof in enumerate(DOFS)
    ]  # fmt: skip
    found = SimpleNamespace(vehicle=vehicle, found=SimpleNamespace(M=M), coefficients=lambda: rows)
    said = _scale(found)
    assert ['far below that of the rigid body alone' in text for text in said] == [True] * told


@pytest.mark.parametrize(('value', 'said'), [
    (1.0, 'as 1/10 of that of the vehicle file: the wrench is that much too small'),
    (100.0, 'as 10 times that of the vehicle file: the wrench is that much too large'),
])  # fmt: skip
def test_a_wrench_in_another_unit_is_told_with_its_factor(value, said):
    rows = [{'name': f'M.{dof}.{dof}', 'status': 'identified', 'value': value, 'prior': 10.0}
            for dof in DOFS]  # fmt: skip
    assert said in _scale(SimpleNamespace(coefficients=lambda: rows))[0]


@pytest.mark.parametrize(('times', 'known', 'said'), [
    (3.5, 6, '(M.heave.heave 3.5 times the prior): another vehicle'), (2.5, 6, ''),
    (0.25, 6, '(M.heave.heave 0.25 times the prior): another vehicle'), (0.4, 6, ''),
    (9.0, 1, ''),
])  # fmt: skip
def test_an_axis_that_is_unlike_the_others_is_told(times, known, said):
    """More than three times either way; of one axis alone nothing can be said."""
    rows = [
        {'name': f'M.{dof}.{dof}', 'prior': 10.0, 'value': 10.0 * (times if i == 0 else 1.0),
         'status': 'identified' if i < known else 'prior'}
        for i, dof in enumerate(('heave', 'surge', 'sway', 'roll', 'pitch', 'yaw'))
    ]  # fmt: skip
    vehicle = SimpleNamespace(M_RB=None)
    found = _scale(SimpleNamespace(vehicle=vehicle, coefficients=lambda: rows))
    assert len(found) == bool(said)
    assert said in ''.join(found)


@pytest.mark.parametrize(('low', 'told'), [(0.9, False), (1.1, True)])
def test_a_model_that_predicts_worse_than_standing_still_is_told(low, told):
    """At horizons of half a second and more, all of them."""
    rows = [
        {'predictor': predictor, 'horizon': horizon, 'ratio_low': ratio}
        for predictor, horizon, ratio in (
            ('persistence', 0.2, 0.5), ('persistence', 0.5, 1.5), ('persistence', 1.0, low),
            ('black box', 1.0, 0.1),
        )
    ]  # fmt: skip
    said = _useless(SimpleNamespace(predictions=rows))
    assert ['worse than a velocity that stays' in text for text in said] == [True] * told


@pytest.mark.parametrize(('disturbance', 'free', 'name', 'true'), [
    ({'kind': 'harmonic', 'surge': {'offset': 20.0}}, 'bias', 'bias.surge', -20.0),
    ({'kind': 'current', 'velocity': [0.2, 0.0, 0.0]}, 'current', 'current.north', 0.2),
])  # fmt: skip
def test_what_pushes_is_found_with_its_sign(disturbance, free, name, true, tmp_path):
    record, _ = trial(
        tmp_path, 'rexrov', 3, duration=10.0, disturbance=disturbance, actuators={'lag': 0.0}
    )
    found = identify(*split([record], 0.25), load_vehicle('rexrov'), Settings((free,)))
    rows = {row['name']: row['value'] for row in found.coefficients()}
    assert rows[name] == pytest.approx(true, rel=0.1), rows


def test_angular_velocity_in_other_axes_than_the_attitude_is_refused(herman):
    check_rates(herman[0])
    with pytest.raises(InputError, match=r'pitch .* and yaw'):
        check_rates(replace(herman[0], velocity=swap_body(herman[0].velocity)))


def test_a_wrench_in_other_axes_is_refused(tmp_path):
    record, _ = trial(tmp_path, 'bluerov2_heavy', duration=60.0)
    training, held = split([replace(record, command=swap_body(record.command))], 0.25)
    with pytest.raises(InputError, match='axes FLU'):
        identify(training, held, load_vehicle('bluerov2_heavy'))


def test_a_recording_at_rest_is_refused(tmp_path):
    record, _ = trial(tmp_path, 'herman2018', duration=30.0, setpoint=REST)
    with pytest.raises(InputError, match='at rest'):
        identify([record], [record], load_vehicle('herman2018'))


def test_a_single_sine_leaves_open_what_it_does_not_move(tmp_path):
    vehicle = load_vehicle('rexrov')
    record, _ = trial(tmp_path, 'rexrov', duration=60.0, setpoint=SINE)
    assert 'one frequency' in excitation([record])[0]
    training, held = split([record], 0.25)
    result = identify(training, held, wrong_prior(vehicle, 1))
    true, rows = truth(result.fit.unknowns, vehicle), result.coefficients()
    open_ = [row for row in rows if row['status'] == 'prior']
    assert len(open_) >= 5
    assert all(row['low'] is None for row in open_)
    assert {'lag', 'delay'} <= {row['name'] for row in open_}, 'one frequency tells little of them'
    known = [row for row in rows if row['status'] == 'identified']
    outside = [r['name'] for r in known if not r['low'] <= true[r['name']] <= r['high']]
    assert len(outside) <= 0.1 * len(known) + 1, outside


@pytest.mark.parametrize(('beside', 'said'), [(0.3, ['92 % of the power']), (0.36, [])])
def test_nine_tenths_of_the_power_at_one_frequency_tell_little(beside, said):
    """Sines of 1 and 3 Hz as a command; the velocity is noise."""
    t, rng = 0.02 * np.arange(1001), np.random.default_rng(0)
    sines = np.sin(2.0 * np.pi * t[:-1]) + beside * np.sin(6.0 * np.pi * t[:-1])
    command = 5.0 + np.outer(sines, np.arange(6.0))
    ahead = np.tile([1.0, 0.0, 0.0, 0.0], (1001, 1))
    record = Record('x', t, ahead, t, rng.normal(size=(1001, 6)), 0.02, command, 0.0)
    assert [text[:17] for text in excitation([record])] == said
    rich = replace(record, command=rng.normal(size=command.shape))
    assert not excitation([record, rich]), 'one that tells is enough'
    for periods, told in ((3, False), (5, True)):
        slow = np.outer(np.sin(0.1 * np.pi * periods * t[:-1]), np.arange(6.0))
        found = excitation([replace(record, command=slow)])
        assert len(found) == told, 'in 20 s others are few lines apart from three periods'


def test_gains_of_the_wrench_cannot_be_told_from_all_inertia(herman):
    training, held = split([herman[0].part(0.0, 20.0)], 0.25)
    free = ('M', 'D_linear', 'D_quadratic', 'restoring', 'lag', 'delay', 'gain')
    result = identify(training, held, load_vehicle('herman2018'), Settings(free))
    rows = {row['name']: row for row in result.coefficients()}
    assert rows['gain.surge']['status'] == 'prior'
    M = rows['M.surge.surge']
    assert M['value'] == pytest.approx(300.0, rel=0.1), 'stays near the prior'
    assert M['high'] is None or M['high'] - M['low'] > 0.5 * M['value'], 'as unsure as the gain'
    every = result.combinations()
    for one in every:
        parts = np.abs(one['parts'])
        assert len(parts) == len(one['names'])
        assert_allclose(parts, sorted(parts, reverse=True))
        assert parts[0] == 1.0
        assert parts[-1] >= 0.35
    left = [one['left'] for one in every]
    assert left == sorted(left, reverse=True)
    assert left[-1] >= 0.5
    widest = every[0]
    assert widest['left'] > 0.5
    assert 'scale of the wrench' in widest['words']


def test_a_velocity_that_is_not_measured_is_found_where_the_model_shows_it(herman):
    velocity = herman[0].velocity.copy()
    velocity[:, 2] = np.nan
    training, held = split([replace(herman[0], velocity=velocity)], 0.25)
    vehicle = load_vehicle('herman2018')
    result = identify(training, held, vehicle, Settings(('M', *FEW[1:])))
    true = truth(result.fit.unknowns, vehicle)
    rows = {row['name']: row for row in result.coefficients()}
    assert rows['M.surge.surge']['value'] == pytest.approx(300.0, rel=0.02)
    outside = [name for name, row in rows.items() if row['status'] == 'identified'
               and not row['low'] <= true[name] <= row['high']]  # fmt: skip
    assert len(outside) <= 0.15 * len(rows), outside


def test_what_somebody_knows_is_kept(herman):
    training, held = split([herman[0].part(0.0, 20.0)], 0.25)
    believed = {'M.surge.surge': (280.0, 1e-3)}
    result = identify(training, held, load_vehicle('herman2018'), Settings(FEW, believed=believed))
    rows = {row['name']: row for row in result.coefficients()}
    assert rows['M.surge.surge']['value'] == pytest.approx(280.0, abs=0.01)
    assert rows['M.surge.surge']['status'] == 'prior', 'the recording adds nothing to it'


def test_the_minimum_is_that_of_scipy(herman):
    vehicle, record = load_vehicle('herman2018'), herman[0].part(5.0, 15.0)
    u = unknowns(vehicle, ('D_linear', 'M.diagonal'), speeds=np.full(6, 0.2),
                 wrenches=np.full(6, 50.0), lag=0.08).with_delay(DELAY)  # fmt: skip
    problem = OutputError(vehicle, segments_of(record, 2.0, 0.6), record.step,
                          np.r_[np.full(6, 0.005), np.full(3, 0.003)])  # fmt: skip
    n, count = len(u.entries), len(problem.segments)

    def residuals(p):
        theta, z = p[:n], p[n:].reshape(count, 9)
        rows = [e.ravel() for e in problem.residuals(u, theta, z)]
        return np.concatenate([*rows, (z / 10.0).ravel(), theta])

    ours = problem.fit(u, np.zeros(n), tolerance=1e-12)
    theirs = least_squares(residuals, np.zeros(n + 9 * count), method='lm', xtol=1e-12)
    assert ours.cost == pytest.approx(2.0 * theirs.cost, rel=1e-7)
    assert_allclose(ours.theta, theirs.x[:n], atol=2e-5)


def test_normal_equations_of_a_longer_recording_take_no_more_memory(herman):
    vehicle = load_vehicle('herman2018')
    u = unknowns(vehicle, speeds=np.full(6, 0.2), wrenches=np.full(6, 50.0), lag=0.08)
    noise = np.r_[np.full(6, 0.005), np.full(3, 0.003)]
    theta, some = np.zeros(len(u.entries)), segments_of(herman[0].part(0.0, 19.0), 1.25, 0.6)

    def normal(segments):
        problem = OutputError(vehicle, segments, herman[0].step, noise)
        tracemalloc.start()
        found = problem.normal(u, theta, np.zeros((len(segments), 9)))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found.eliminated()[0], peak

    once, peak = normal(8 * some)
    repeated, more = normal(16 * some)
    assert_allclose(repeated, 2.0 * once, rtol=1e-9, atol=1e-9 * np.abs(once).max())
    assert more < 1.2 * peak


def test_delays_are_looked_for_within_the_commands_that_are_known():
    """Where the recording tells nothing of it, every delay is as good as another."""
    prior = load_vehicle('herman2018')
    u = unknowns(prior, ('lag', 'delay'), (), speeds=np.ones(6), wrenches=np.ones(6))

    def fit(late, theta, starts, **_):
        return SimpleNamespace(unknowns=late, theta=theta, starts=starts, cost=1.0)

    tried = _with_best_delay(SimpleNamespace(step=0.05, fit=fit), u, np.zeros(1), 0.1, 9.0)
    delays = sorted(float(one.unknowns.prior.delay) for one in tried)
    assert_allclose(delays, 0.05 * np.arange(13), atol=1e-12)


def test_starts_that_a_diverging_model_cannot_tell_apart_are_no_error():
    """Beside 1e30 the 1e-2 of each start are rounded away: the matrix has rank one."""
    rng = np.random.default_rng(1)
    cross, right = rng.normal(size=(2, 9, 3)), rng.normal(size=(2, 9))
    inner = np.array([1e30 * np.ones((9, 9)), np.diag(np.arange(1.0, 10.0))])
    A, g, back = Normal(1.0, np.eye(3), np.ones(3), cross, inner, right).eliminated()
    of_second = cross[1] / np.arange(1.0, 10.0)[:, None]
    assert_allclose(A, np.eye(3) - cross[1].T @ of_second, rtol=1e-9, atol=1e-9)
    assert_allclose(g, 1.0 - right[1] @ of_second, rtol=1e-9, atol=1e-9)
    assert_allclose(back[1][:, :3], of_second, rtol=1e-9)


def growing() -> Record:
    """Yaw grows by itself."""
    t, still = np.arange(0.0, 10.0, 0.05), np.zeros((200, 6))
    nu, eta = still.copy(), still.copy()
    nu[:, 5] = 0.02 * np.exp(0.2 * t)
    eta[:, 5] = nu[:, 5] / 0.2
    return Record('growing', t, quaternion(eta[:, 3:]), t, nu, 0.05, still, 0.0)


def test_a_model_of_which_damping_held_at_zero_is_all_that_was_free_has_its_rows_and_draws():
    vehicle = load_vehicle('lauv')
    u = unknowns(vehicle, ('D_linear.yaw',), speeds=np.full(6, 0.1), wrenches=np.ones(6))
    problem = OutputError(vehicle, segments_of(growing(), 2.0, 0.6), 0.05, np.full(9, 0.003))
    fit = problem.fit(u, np.zeros(1), most=10)
    after, zeros = _dissipative(problem, fit, problem.covariance(fit))
    assert after.unknowns.entries == ()
    found = Identified(vehicle, [], held_of([], 0.6), problem, after, problem.covariance(after), [],
                       zeros, ())  # fmt: skip
    rows = found.coefficients()
    assert [row['name'] for row in rows] == [entry.name for entry in zeros]
    assert {row['status'] for row in rows} == {'at zero'}
    assert (found.combinations(), found.draws(3).M.shape) == ([], (3, 6, 6))


def test_damping_of_a_vehicle_that_gains_speed_is_held_where_it_takes_energy():
    """Its yaw damping is held at zero, and lauv's couplings with sway too."""
    vehicle, record = load_vehicle('lauv'), growing()
    u = unknowns(vehicle, ('D_linear',), speeds=np.full(6, 0.1), wrenches=np.ones(6))
    problem = OutputError(vehicle, segments_of(record, 2.0, 0.6), 0.05, np.full(9, 0.003))
    fit = problem.fit(u, np.zeros(6), most=10)
    assert fit.unknowns.coefficients(fit.theta).D_linear[5, 5] < 0.0
    every = unknowns(vehicle, ('M.diagonal', 'D_linear'), speeds=np.full(6, 0.1),
                     wrenches=np.ones(6))  # fmt: skip
    unsure = _of_still(problem, fit, every)  # as the inertia is not searched
    assert np.diag(unsure)[5] > 0.0
    assert not _of_still(problem, fit, fit.unknowns).any()
    covariance = problem.covariance(fit) + 0.1 * np.eye(6)
    after, zeros = _dissipative(problem, fit, covariance)
    still = [every.entries[4]]
    found = Identified(vehicle, [], held_of([], 0.6), problem, after, problem.covariance(after), [],
                       zeros, still)  # fmt: skip
    rows = found.coefficients()
    assert len({frozenset(row) for row in rows}) == 1
    pitch, yaw = rows[-1], next(row for row in rows if row['name'] == 'D_linear.yaw')
    assert (pitch.pop('prior'), pitch.pop('value')) == pytest.approx((vehicle.M[4, 4],) * 2)
    assert pitch == {'name': 'M.pitch.pitch', 'unit': 'kg m²', 'left': 1.0, 'status': 'prior',
                     'deviation': None, 'low': None, 'high': None}  # fmt: skip
    most = fit.unknowns.coefficients(fit.theta).D_linear[5, 5]
    most += fit.quantile * np.sqrt(covariance[5, 5]) * u.entries[5].unit
    assert (yaw['low'], yaw['high']) == (0.0, pytest.approx(most))
    assert (yaw['prior'], yaw['value']) == (vehicle.D_linear[5, 5], 0.0)
    assert all((row['low'] is None) == (row['high'] is None) for row in rows)
    data = yaml.safe_load(shipped('vehicles', 'lauv').read_text()) | {'sign': 'sname'}
    data['lift'] = (-np.array(data['lift'])).tolist()
    text = vehicle_text(found, data, 'x', '')  # what is written is positive, whatever the prior was
    written = vehicle_from_dict(yaml.safe_load(text), 'written')
    D = written.D_linear
    assert_allclose(written.M, vehicle.M, rtol=1e-6, atol=1e-9)
    assert_allclose(written.lift, vehicle.lift, rtol=1e-5)
    assert_allclose(written.model.hydrostatics, vehicle.model.hydrostatics, rtol=1e-5, atol=1e-4)
    assert D[2, 4] == vehicle.D_linear[2, 4], 'what takes energy stays'
    assert 'D_linear.sway.yaw: held at 0, as it would feed energy' in text
    assert [e.name for e in zeros] == ['D_linear.yaw', 'D_linear.sway.yaw', 'D_linear.yaw.sway']
    assert all(D[entry.index] == 0.0 for entry in zeros)


def test_couplings_of_damping_are_held_until_none_feeds_energy():
    rng = np.random.default_rng(0)
    for _ in range(20):
        D = rng.normal(size=(6, 6))
        D[np.diag_indices(6)] = rng.uniform(0.0, 2.0, 6) * (rng.uniform(size=6) > 0.2)
        while pair := feeding(D):
            assert D[pair] + D[pair[::-1]] != 0.0
            D[pair] = D[pair[::-1]] = 0.0
        assert is_semidefinite((D + D.T) / 2)


def test_a_recording_is_split_at_pauses():
    ns = 10**8 * np.arange(100)
    kept = {
        'pose': ns,
        'twist': ns[(ns < 4e9) | (ns > 5e9)],
        'wrench': ns[(ns < 7e9) | (ns > 7.2e9)],
    }
    rows = {'pose': [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 'twist': [0.0] * 6, 'wrench': [0.0] * 6}
    tracks = {
        role: Track(role, f'/{role}', t, np.tile(rows[role], (len(t), 1)), 2e8, role == 'wrench')
        for role, t in kept.items()
    }
    first, last = of_tracks('x', tracks)  # 0.4 s are no pause
    assert_allclose([first.start, first.end, last.start, last.end], [0.0, 3.9, 5.1, 9.9])


def test_a_vehicle_with_what_was_identified_has_its_weight_and_moments():
    """Mass and centre of gravity stay: what the restoring forces tell is where the buoyancy is."""
    vehicle = load_vehicle('herman2018')
    told = {'M': 1.1 * vehicle.M, 'D_linear': 1.2 * vehicle.D_linear,
            'D_quadratic': 1.3 * vehicle.D_quadratic}  # fmt: skip
    found = SimpleNamespace(**told, hydrostatics=np.array([-50.0, 10.0, -20.0, 300.0]))
    new = with_vehicle(vehicle, found)
    assert_allclose(new.model.hydrostatics, found.hydrostatics, rtol=1e-9)
    assert (new.weight, new.r_G.tolist()) == (vehicle.weight, vehicle.r_G.tolist())
    for name, matrix in told.items():
        assert_allclose(getattr(new, name), matrix)


def test_an_interval_is_that_of_the_draws_and_begins_at_zero_where_nothing_is_certain():
    values = np.array([7.0, 8.0, *np.linspace(1.0, 5.0, 401)])
    expected = {'share_prior': 7.0, 'share': 8.0, 'share_low': 1.1, 'share_high': 4.9}
    assert _told('share', values) == pytest.approx(expected)
    assert _told('share', values, certain=False) == pytest.approx({**expected, 'share_low': 0.0})
    draws = np.tile(np.eye(6), (401, 1, 1))
    for row, middle in enumerate((1.0, 0.9, -1.0)):  # of which 0, 5 and 0 % lie beyond zero
        draws[:, row, 5] = np.linspace(-1.0, 1.0, 401) + middle
    found = _excludes_zero(draws)
    assert found[:3, 5].tolist() == [True, False, True]
    assert found.sum() == 2, 'the diagonal counts not'
