"""The figures of a run: keys, windows, settling, and None where nothing is known."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.metrics.energy import kinetic_energy
from auv_gvc_controller.laws.model import control_model

KEYS = {
    'scenario': None, 'law': None, 'source': None, 'duration': None, 'step': None, 'samples': None,
    'kinetic_energy': {'mean', 'mean_by_component', 'shares_percent', 'window'},
    'velocity_error': {'rms', 'max_after_2s', 'settling_time'},
    'lumped_error': {'rms', 'max_after_2s'},
    'coupling': {'delta_xi_max', 'delta_pi_max', 'structural_zeros'},
    'effort': {'rms', 'max'},
    'gains': {'K_D', 'K_f'},
    'decomposition': {'Upsilon', 'N'},
    'lyapunov': {'applicable', 'reason', 'identity_residual', 'share_of_time_increasing',
                 'sup_s', 'sup_z', 'sup_w',
                 'identity_residual_rms', 'identity_residual_after_2s', 'share_condition_27',
                 'share_bound_28', 'L_first',
                 'L_last', 'rho_max', 'sampled'},
}  # fmt: skip


@pytest.fixture(scope='module')
def run():
    scenario = load_scenario('case1')
    return simulate(replace(scenario, data=scenario.data | {'duration': 4.0}), 'gvc')


@pytest.fixture(scope='module')
def summary(run):
    return summarize(run)


def test_keys_of_the_contract(summary):
    assert set(KEYS) <= set(summary)
    for key, inner in KEYS.items():
        if inner:
            assert set(summary[key]) == inner, key


def test_basic_facts(summary):
    facts = {key: summary[key] for key in ('scenario', 'law', 'source', 'step', 'samples')}
    assert facts == {
        'scenario': 'case1', 'law': 'gvc', 'source': 'simulate', 'step': 0.01, 'samples': 401,
    }  # fmt: skip
    assert summary['duration'] == pytest.approx(4.0)


def test_json_without_nan(run):
    for one in (run, replace(run, disturbance=None), run.part(slice(0, 1)), run.part(slice(150))):
        text = json.dumps(summarize(one), allow_nan=False)
        assert json.loads(text) == summarize(one)


def test_errors_and_effort_by_hand(run, summary):
    error, after = run.nu_d - run.nu, run.t >= 2.0
    assert_allclose(summary['velocity_error']['rms'], np.sqrt((error**2).mean(axis=0)))
    assert_allclose(summary['velocity_error']['max_after_2s'], np.abs(error[after]).max(axis=0))
    assert_allclose(summary['effort']['rms'], np.sqrt((run.tau**2).mean(axis=0)))
    assert_allclose(summary['effort']['max'], np.abs(run.tau).max(axis=0))
    w = run.disturbance_estimate - run.disturbance
    assert_allclose(summary['lumped_error']['rms'], np.sqrt((w**2).mean(axis=0)))
    assert_allclose(summary['lumped_error']['max_after_2s'], np.abs(w[after]).max(axis=0))


def test_energy_by_hand(run, summary):
    model = control_model(run.vehicle)
    components = kinetic_energy(model.Upsilon_inv.reshape(6, 6), model.N, run.nu)
    energy = summary['kinetic_energy']
    assert energy['mean'] == pytest.approx(components.sum(axis=1).mean(), rel=1e-12)
    assert_allclose(energy['mean_by_component'], components.mean(axis=0), rtol=1e-12)
    expected = 100.0 * components.mean(axis=0) / components.sum(axis=1).mean()
    assert_allclose(energy['shares_percent'], expected, rtol=1e-12)
    assert sum(energy['shares_percent']) == pytest.approx(100.0)
    assert energy['window'] == [0.0, pytest.approx(4.0)]


def test_energy_over_a_window(run):
    found = summarize(run, (1.0, 2.0))['kinetic_energy']
    alone = summarize(run.part(slice(100, 201)))['kinetic_energy']
    assert found['mean'] == pytest.approx(alone['mean'], rel=1e-12)
    assert found['window'] == pytest.approx([1.0, 2.0])
    whole = summarize(run)
    assert found['mean'] != pytest.approx(whole['kinetic_energy']['mean'], rel=1e-3)
    windowed = summarize(run, (1.0, 2.0))
    assert windowed['velocity_error'] == whole['velocity_error']  # the window is the energy's


def test_a_window_without_samples_has_no_energy(run):
    found = summarize(run, (90.0, 91.0))['kinetic_energy']
    assert found == {
        'mean': None, 'mean_by_component': None, 'shares_percent': None, 'window': [90.0, 91.0],
    }  # fmt: skip


def test_an_unknown_disturbance_is_none(run):
    found = summarize(replace(run, disturbance=None))
    assert found['lumped_error'] == {'rms': None, 'max_after_2s': None}
    assert found['velocity_error'] == summarize(run)['velocity_error']


def test_a_run_shorter_than_the_transient_has_no_errors_after_it(run):
    found = summarize(run.part(slice(0, 200)))
    assert found['velocity_error']['max_after_2s'] is None
    assert found['lumped_error']['max_after_2s'] is None
    assert found['velocity_error']['rms'] is not None
    at_2_s = summarize(run.part(slice(0, 201)))
    assert_array_equal(
        at_2_s['velocity_error']['max_after_2s'], np.abs(run.nu_d[200] - run.nu[200])
    )


def test_gains_and_decomposition(run, summary):
    M = run.vehicle.M
    assert_allclose(summary['gains']['K_D'], 12.0 * M, atol=1e-9)
    assert_allclose(summary['gains']['K_f'], 60.0 * M, atol=1e-9)
    U = np.array(summary['decomposition']['Upsilon'])
    assert_allclose(U.T @ M @ U, np.diag(summary['decomposition']['N']), atol=1e-10)
    other = summarize(replace(run, law='cl'))
    assert_array_equal(other['gains']['K_D'], 12.0 * np.eye(6))


def test_couplings(run, summary):
    q, r, p = run.nu[:, 4], run.nu[:, 5], run.nu[:, 3]
    found = summary['coupling']
    expected = [0.025 * q, -0.015 * p + 0.075 * r, -0.075 * q]
    assert_allclose(found['delta_xi_max'][:3], [np.abs(x).max() for x in expected], rtol=1e-9)
    X, Z = run.tau[:, 0], run.tau[:, 2]
    assert found['delta_pi_max'][4] == pytest.approx(np.abs(-0.025 * X + 0.075 * Z).max())
    assert found['structural_zeros'] == {
        'delta_xi': ['pitch', 'yaw'], 'delta_pi': ['surge', 'sway', 'heave'],
    }  # fmt: skip
    assert found['delta_xi_max'][4:] == [0.0, 0.0]


def test_noise_that_happens_to_end_inside_has_not_settled(run):
    noise = np.random.default_rng(3).normal(scale=0.03, size=run.nu.shape)
    noise[-3:] = 0.0
    found = summarize(replace(run, nu=run.nu_d + noise))
    assert found['velocity_error']['settling_time'] == 6 * [None]
    settling = found['settling']
    assert settling['dwell'] == pytest.approx(0.2)
    assert_allclose(settling['residual'], np.abs(noise[-21:]).max(axis=0))
    assert_allclose(settling['band'], np.maximum(0.02 * np.abs(run.nu_d).max(axis=0), 0.005))
