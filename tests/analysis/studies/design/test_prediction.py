"""What a run foretells of a changed vehicle: inverse dynamics, shares, scores and gradients."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.strategies import QUICK, positive_definite, vectors
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.studies.design.change import NAMES, ChangeSpace, rounded
from auv_analysis.studies.design.prediction import (
    Metrics,
    Objective,
    Prediction,
    RecordedMotion,
    _weights,
    accelerations,
    effort_of,
    shares_of,
    sizes_of,
    smooth_peak,
)
from auv_analysis.studies.design.setting import changed_data
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.laws.model import decompose, inverse_upper


@pytest.fixture(scope='module', params=['rexrov', 'herman2018'])
def prediction(request):
    name = 'case1' if request.param == 'herman2018' else f'case1_{request.param}'
    scenario = changed_scenario(load_scenario(name), {'duration': 3.0})
    space = ChangeSpace.of(scenario.vehicle_data, 'x')
    run = simulate(scenario, 'gvc')
    row = space.effect(space.unchanged).row
    before = sizes_of(run, np.linalg.inv(space.vehicle.M))
    return Prediction(space, RecordedMotion.of(run, row), before), run


def place(space, unit):
    lower, upper = space.bounds
    return lower + unit * (upper - lower)


units = vectors(13, 0.49).map(lambda x: x + 0.5)


@QUICK
@given(units)
def test_the_input_is_that_of_inverse_dynamics(prediction, unit):
    """Dense M, C and g of the changed vehicle at every sample, and the drag of the disc."""
    (predicted, run), x = prediction, None
    space = predicted.space
    x = place(space, unit)
    vehicle = vehicle_from_dict(changed_data(space, x), 'x')
    where = np.array([0, 1, 17, 150, 300])
    part = run.part(where)
    nu_dot = accelerations(part)
    motion = RecordedMotion.of(part, np.zeros_like(predicted.motion.row))
    assert len(motion.nu) == len(where)
    expected = [
        vehicle.inverse_dynamics(*sample)
        for sample in zip(part.eta, part.nu, nu_dot, part.disturbance, strict=True)
    ]
    found = motion.inputs(space.effect(x).row)
    assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize('lift', [None, 40.0 * np.arange(36.0).reshape(6, 6)])
def test_the_acceleration_is_that_of_the_plant(prediction, lift):
    _, run = prediction
    run = replace(run, vehicle=replace(run.vehicle, lift=lift))
    part = run.part(slice(0, None, 50))
    samples = zip(part.eta, part.nu, part.tau, part.disturbance, strict=True)
    expected = np.array([run.vehicle.forward_dynamics(*sample) for sample in samples])
    assert_allclose(accelerations(part), expected, atol=1e-9 * np.abs(expected).max())


def test_the_unchanged_vehicle_is_predicted_as_it_was(prediction):
    predicted, run = prediction
    space, before = predicted.space, predicted.before
    found = predicted.metrics(space.unchanged)
    there = before.peaks > 0
    assert_allclose(predicted.ratios(space.unchanged)[there], 1.0)
    assert_allclose(found.ratios[there], 1.0)
    assert found.effort == pytest.approx(1.0, rel=0.05)  # a mean over some of the samples
    assert_allclose(found.shares, before.shares, rtol=0.1, atol=1e-3 * before.shares.max())
    assert found.size == pytest.approx(0.0, abs=0.05)
    assert found.at_rest == 0.0
    weights = predicted.motion.weights
    assert weights.sum() == pytest.approx(1.0)
    assert (weights > 0).all()
    U = decompose(run.vehicle.M)[0]
    assert_allclose(before.peaks[:6], np.abs(delta_xi(inverse_upper(U), run.nu)).max(axis=0))
    assert_allclose(before.peaks[6:], np.abs(delta_pi(U, run.tau)).max(axis=0))


def test_a_change_that_makes_no_inertia_is_impossible(prediction):
    predicted, _ = prediction
    far = np.zeros(len(NAMES))
    far[0] = 100.0  # m: the tensor about the centre of gravity cannot follow
    M = predicted.space.vehicle.M + predicted.space.effect(far).M
    value = float(Objective(predicted, 10).value(far))
    assert (value == 1e6) == (np.linalg.eigvalsh(M)[0] <= 0)


def test_couplings_are_those_of_the_decomposition_and_none_where_M_is_no_inertia():
    nu, tau = np.random.default_rng(0).normal(size=(2, 5, 6))
    space = SimpleNamespace(vehicle=SimpleNamespace(M=np.eye(6)),
                            effect=lambda M: SimpleNamespace(M=M, row=M))  # fmt: skip
    motion = SimpleNamespace(nu=nu, inputs=lambda row: np.broadcast_to(tau, (len(row), 5, 6)))
    coupled = np.diag(np.arange(1.0, 7.0))
    coupled[2, 4] = coupled[4, 2] = 1.5
    changes = np.stack([coupled, -np.eye(6), np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -3.0])])
    made = SimpleNamespace(space=space, motion=motion)
    deformed, _, _, _, N, definite = Prediction.signals(made, changes)
    U, diagonal = decompose(np.eye(6) + coupled)
    assert definite.tolist() == [True, False, False]
    assert_allclose(N[0], diagonal)
    assert_allclose(deformed[0, :, :6], delta_xi(inverse_upper(U), nu))
    assert_allclose(deformed[0, :, 6:], delta_pi(U, tau))
    assert not deformed[1:].any()


@QUICK
@given(positive_definite(), vectors(6), st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_shares_and_effort_do_not_depend_on_the_units(M, seed, metre, kilogram):
    """Feet for metres, pounds for kilograms: nu, tau and M change, the shares do not."""
    generator = np.random.default_rng(abs(int(1e6 * seed[0])))
    nu, tau = generator.normal(size=(2, 20, 6))
    weights = np.full(20, 1 / 20)
    turn = np.array([metre] * 3 + [1.0] * 3)
    scale = kilogram * np.outer(1 / turn, 1 / turn) * metre**2

    def shares(M, nu, tau):
        U, N = decompose(M)
        inverse = inverse_upper(U)
        xi, pi = nu @ inverse.T, tau @ U
        found = shares_of(xi - nu, pi - tau, N, xi, pi, weights)
        return found, effort_of(tau, np.linalg.inv(M), weights)

    first, effort = shares(M, nu, tau)
    other, changed = shares(scale * M, nu * turn, tau * (kilogram * metre**2 / turn))
    assert_allclose(other, first, rtol=1e-6, atol=1e-12)
    assert changed == pytest.approx(effort * kilogram * metre**2, rel=1e-6)
    coupled = np.abs(M - np.diag(np.diag(M))).max() > 1e-6
    assert (first.max() > 0) or not coupled


@QUICK
@given(vectors(40))
def test_the_smooth_peak_is_near_the_peak(values):
    signal = values[:, None]
    peak, found = np.abs(values).max(), smooth_peak(signal)[0]
    assert found <= peak * (1 + 1e-12)
    assert found >= peak * len(values) ** (-1 / 8) * (1 - 1e-9) or peak < 1e-30


def test_the_smooth_peak_of_nothing_is_zero():
    assert smooth_peak(np.zeros((5, 1)))[0] == 0.0


@pytest.mark.parametrize(
    ('change', 'better'),
    [
        ({'ratios': [0.5]}, True),
        ({'ratios': [1.5]}, False),
        ({'effort': 2.0}, False),
        ({'size': 1.0}, False),
        ({'at_rest': 0.1}, False),
        ({'shares': 2.0}, False),
        ({'definite': False}, False),
    ],
)
def test_what_the_score_asks_for(prediction, change, better):
    before = prediction[0].before
    same = Metrics(np.array([1.0]), before.shares, 1.0, 0.0, 0.0, True)
    values = {key: np.array(value) for key, value in change.items()}
    if 'shares' in change:
        values['shares'] = change['shares'] * before.shares
    objective = Objective(prediction[0], 10)
    found, usual = (float(objective.of(one)) for one in (same._replace(**values), same))
    assert (found < usual) == better
    assert found != usual


def test_the_score_by_hand():
    before = np.arange(1.0, 13.0) / 100
    made = SimpleNamespace(before=SimpleNamespace(shares=before))
    found = Metrics(np.array([0.5]), 2.0 * before[::-1], 2.5, 0.2, 0.7, True)
    squares = before @ before
    rest = 4.0 * (squares - before[8] ** 2) / (squares - before[3] ** 2 + 0.01 * squares)
    burden = 0.3 * 0.2 + 0.01 * 0.7
    for others in (0.1, 0.0):
        one = Objective(made, 3) if others else Objective(made, 3, others)
        assert one.of(found) == pytest.approx(0.25 + others * (rest + 2.5) + burden)
    assert Objective(made, 3).of(found._replace(definite=False)) == 1e6


def test_a_sample_stands_for_all_that_is_nearer_to_it():
    found = _weights(np.array([0, 3, 9]), 10)  # up to halves of the way: 1.5 and 6
    assert_allclose(found, [0.2, 0.45, 0.35])


@QUICK
@given(units)
def test_a_rounded_change_is_near_and_within_bounds(prediction, unit):
    space = prediction[0].space
    x = place(space, unit)
    lower, upper = space.bounds
    found = rounded(x, space)
    assert (found >= lower).all()
    assert (found <= upper).all()
    assert (np.abs(found - x) <= 1e-3 * (upper - lower)).all()
