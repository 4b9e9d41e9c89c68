"""Every field of the certificate sample by sample, written out with matrices; singular gains."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate
from auv_analysis.metrics.certificate import (
    FIGURES,
    Certificate,
    as_figures,
    certificate,
    derivative,
    integral_of,
    sampled_integral,
)
from auv_analysis.metrics.lyapunov import lyapunov
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

DRAWN = np.random.default_rng(12)
VEHICLE = load_vehicle('rexrov')
MODEL = control_model(VEHICLE)
T = np.cumsum(DRAWN.uniform(0.05, 0.1, 12))
NU, NU_D, Z, F, F_HAT = (DRAWN.normal(size=(12, 6)) for _ in range(5))
GAINS = {'k_D': DRAWN.normal(size=(6, 6)), 'k_I': DRAWN.normal(size=(6, 6)),
         'Lambda': DRAWN.normal(size=(6, 6)), 'Gamma': DRAWN.normal(size=(6, 6))}  # fmt: skip


def found(law, **changed):
    return certificate(T, NU, NU_D, Z, F, F_HAT, law, make_gains(law, GAINS | changed), MODEL)


@pytest.mark.parametrize('law', ['gvc', 'cl'])
def test_every_field(law):
    c = found(law)
    U, N = np.eye(6), VEHICLE.M
    B, G = GAINS['k_D'], GAINS['Gamma']
    if law == 'gvc':
        U, N = MODEL.Upsilon.reshape(6, 6), np.diag(MODEL.N)
        B, G = N @ GAINS['k_D'], GAINS['Gamma'] @ N
    G_inv = np.linalg.inv(G)
    F_dot = derivative(T, F)
    for k in range(len(T)):
        x = NU_D[k] - NU[k] + GAINS['Lambda'] @ Z[k]
        s, w, push = np.linalg.solve(U, x), U.T @ (F_HAT[k] - F[k]), U.T @ F_dot[k]
        L = 0.5 * (s @ N @ s + Z[k] @ GAINS['k_I'] @ Z[k] + w @ G_inv @ w)
        lost = x @ VEHICLE.D(NU[k]) @ x + s @ B @ s + Z[k] @ GAINS['Lambda'] @ GAINS['k_I'] @ Z[k]
        drift = push @ G_inv @ w
        rho = np.linalg.norm(G_inv, 2) * np.linalg.norm(push) * np.linalg.norm(w)
        expected = {'t': T[k], 's': s, 'z': Z[k], 'w': w, 'L': L, 'dissipation': lost,
                    'drift': drift, 'rho': rho, 'identity': -lost - drift,
                    'bound': -lost + rho}  # fmt: skip
        for name, value in expected.items():
            assert_allclose(getattr(c, name)[k], value, rtol=1e-9, atol=1e-9, err_msg=name)
    assert_allclose(c.L_dot, derivative(T, c.L), rtol=1e-12)


@pytest.mark.parametrize('law', ['gvc', 'cl'])
@pytest.mark.parametrize('smallest', [0.0, 1e-14])
def test_a_singular_gamma_leaves_what_does_not_need_its_inverse(law, smallest):
    c = found(law, Gamma=[1.0, 2.0, 3.0, smallest, 5.0, 4.0])
    for name in ('L', 'L_dot', 'drift', 'rho'):
        assert np.isnan(getattr(c, name)).all(), name
    for name in ('s', 'z', 'w', 'dissipation'):
        assert np.isfinite(getattr(c, name)).all(), name


def test_singular_is_relative_to_the_largest():
    assert np.isnan(found('cl', Gamma=[1.0, 2.0, 1e6, 1e-4, 3.0, 1.0]).rho).all()


def test_a_small_gamma_is_not_a_singular_one():
    c = found('cl', Gamma=1e-12)
    assert np.isfinite(c.rho).all()
    assert np.isfinite(found('cl', Gamma=[1.0, 2.0, 3.0, 1e-7, 5.0, 4.0]).rho).all()


def test_a_single_sample_has_no_rates():
    gains = make_gains('cl', GAINS)
    one = certificate(T[:1], NU[:1], NU_D[:1], Z[:1], F[:1], F_HAT[:1], 'cl', gains, MODEL)
    assert np.isnan([one.L_dot[0], one.drift[0], one.rho[0]]).all()
    assert np.isfinite([one.L[0], one.dissipation[0]]).all()


def test_the_bound_is_judged_by_the_largest_rate_of_the_whole_run():
    """One in a million of 4 W: of six samples, 2 and 8 in a million above (28), one is beyond."""
    nothing = np.zeros((2, 6))

    def block(power: float, excess: float) -> Certificate:
        lost = np.full(2, power)
        L_dot = np.array([0.0, excess]) - lost
        return Certificate(T[:2], *3 * [nothing], lost, L_dot, lost, 0.0 * lost, 0.0 * lost)

    blocks = [block(0.0, 0.0), block(1.0, 2e-6), block(4.0, 8e-6)]
    figures = as_figures(lambda: iter(blocks), 0.0)
    assert figures['share_bound_28'] == 5 / 6
    assert figures['share_condition_27'] == 1.0, 'also at rest'
    assert figures['identity_residual'] == pytest.approx(2e-6)


def test_sampled_integral():
    z = sampled_integral(T, NU)
    assert_allclose(z[0], np.zeros(6))
    for k in range(1, len(T)):
        assert_allclose(z[k], z[k - 1] + (T[k] - T[k - 1]) * NU[k - 1], rtol=1e-12, atol=1e-14)


def test_the_integral_is_the_laws_own_or_that_of_what_it_saw_or_unknown():
    scenario = load_scenario('case1')
    short = replace(scenario, data={**scenario.data, 'duration': 0.1})
    run = simulate(short, 'gvc', 'zoh')
    assert_allclose(integral_of(run), run.law_state[:, :6])
    recorded = replace(run, law_state=None)  # as a bag has it
    assert_allclose(integral_of(recorded), run.law_state[:, :6], atol=1e-15)
    assert integral_of(replace(recorded, applied=run.tau)) is None, (
        'anti-windup may have stopped it'
    )
    assert integral_of(replace(recorded, hold='continuous')) is None


def of_half_a_second() -> Run:
    """A run as a bag has it, without the state of its law."""
    case = load_scenario('case1')
    short = replace(case, data={**case.data, 'duration': 0.5})
    return replace(simulate(short, 'gvc', 'zoh'), law_state=None)


def test_a_run_that_begins_behind_its_law_has_no_certificate() -> None:
    whole = of_half_a_second()
    model = control_model(whole.vehicle)
    assert lyapunov(whole, model)['sup_z'] is not None
    found = lyapunov(whole.part(slice(10, None)), model)
    assert (found['applicable'], found['sup_z'], found['share_bound_28']) == (False, None, None)
    assert 'the law had begun before the first sample' in found['reason']
    anew = whole.disturbance_estimate * np.eye(6)[0]  # of one axis alone
    anew[30] = 0.0
    found = lyapunov(replace(whole, disturbance_estimate=anew), model)
    assert (found['applicable'], found['sup_z']) == (False, None)
    assert found['reason'] == 'the law began anew within the run: z is not known'


@pytest.mark.parametrize(('signal', 'words', 'sup_z'), [
    ('measured', 'the law does not see the true velocity', True),
    ('applied', 'the wrench applied is not that of the law', False),
])  # fmt: skip
def test_what_was_there_and_nobody_recorded_breaks_the_identity_as_well(
    signal, words, sup_z
) -> None:
    run = of_half_a_second()
    assert lyapunov(run, control_model(run.vehicle))['applicable']
    found = lyapunov(replace(run, unrecorded=frozenset({signal})), control_model(run.vehicle))
    assert (found['applicable'], found['reason'].startswith(words)) == (False, True)
    assert (found['share_bound_28'], found['sup_z'] is not None) == (None, sup_z)


LACKS = 'not all velocities, the wrench and the set-point were recorded'


@pytest.mark.parametrize(('signal', 'axes'), [('nu', [4]), ('nu_d', range(6)), ('tau', range(6))])
def test_without_a_velocity_the_set_point_or_the_wrench_there_are_no_figures(signal, axes) -> None:
    run = of_half_a_second()
    values = getattr(run, signal).copy()
    values[:, axes] = np.nan
    found = lyapunov(replace(run, **{signal: values}), control_model(run.vehicle))
    assert (found['applicable'], found['reason']) == (False, LACKS)
    assert {found[name] for name in FIGURES} == {None}


def test_across_a_gap_there_are_no_figures() -> None:
    run = of_half_a_second()
    found = lyapunov(replace(run, gaps=((0.1, 0.2),)), control_model(run.vehicle))
    assert found['reason'] == 'the run has gaps, across which nothing has a rate'
    assert {found[name] for name in FIGURES} == {None}
