"""Edges of the windows of a summary: which sample still counts."""

import json
from dataclasses import replace

import numpy as np
import pytest

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.metrics.summary import estimate_figures


@pytest.fixture(scope='module')
def run():
    scenario = load_scenario('case1')
    return simulate(replace(scenario, data=scenario.data | {'duration': 0.2}), 'gvc')


@pytest.mark.parametrize(
    ('window', 'samples'),
    [
        ((0.054, 0.146), (0.05, 0.15)),  # the nearest sample
        ((0.056, 0.144), (0.06, 0.14)),
        ((0.05, 0.06), (0.05, 0.06)),  # two are enough
        (None, (0.0, 0.2)),
    ],
)
def test_a_window_takes_the_samples_nearest_to_its_edges(run, window, samples):
    energy = summarize(run, window)['kinetic_energy']
    assert energy['window'] == pytest.approx(samples, abs=1e-12)
    assert energy['mean'] > 0.0


def test_one_sample_has_no_mean(run):
    assert summarize(run, (0.05, 0.05))['kinetic_energy']['mean'] is None


@pytest.mark.parametrize('start', [0.0, 5.0])
def test_the_transient_is_two_seconds_from_the_first_sample(run, start):
    late = replace(run, t=start + 100.0 * run.t)  # samples 1 s apart
    error = np.abs(run.nu_d - run.nu)
    found = summarize(late)['velocity_error']['max_after_2s']
    assert found == pytest.approx(error[2:].max(axis=0), rel=1e-12)
    assert summarize(replace(run, t=start + 99.9 * run.t))['velocity_error'][
        'max_after_2s'
    ] == pytest.approx(error[3:].max(axis=0), rel=1e-12)


def test_the_settling_time_of_a_part_counts_from_its_first_sample(run):
    nu = run.nu_d.copy()
    nu[:8] += 1.0
    part = replace(run, nu=nu, gaps=((run.t[1], run.t[2]), (run.t[11], run.t[12])))
    part = part.part(slice(5, None))
    found = summarize(part)
    assert found['velocity_error']['settling_time'] == [0.03] * 6
    assert part.gaps == ((run.t[11], run.t[12]),)


def test_a_run_without_gains_has_none(run):
    found = summarize(replace(run, gains={}))['gains']
    assert found == {'K_D': None, 'K_f': None}
    assert summarize(run)['gains']['K_D'] is not None


def test_without_set_points_or_a_disturbance_there_is_no_error_to_tell(run):
    blind = replace(run, disturbance=None, nu_d=np.full_like(run.nu_d, np.nan))
    summary = summarize(blind)
    assert set(summary['velocity_error'].values()) == {None}
    assert summary['velocity']['rms'] == summarize(run)['velocity']['rms']


def test_of_a_wrench_that_was_estimated_each_figure_is_its_own():
    six = np.arange(1.0, 7.0)
    wrench, error = np.array([2.0, -4.0])[:, None] * six, np.array([0.6, 0.8])[:, None] * six
    found = estimate_figures(wrench, error)
    factors = {'mean': -1.0, 'rms': np.sqrt(10.0), 'max': 4.0, 'error_rms': np.sqrt(0.5)}
    assert found == {name: pytest.approx(factor * six) for name, factor in factors.items()}
    assert estimate_figures(wrench, None) is estimate_figures(None, error) is None
    assert estimate_figures(np.full((2, 6), np.nan), error) is None
    known = np.where(np.arange(6) < 3, wrench, np.nan)
    assert estimate_figures(known, error)['max'][:3] == [4.0, 8.0, 12.0]


@pytest.mark.parametrize('source', ['simulate', 'bag'])
def test_what_overflows_is_null(run, source):
    found = summarize(replace(run, source=source, tau=np.full_like(run.tau, 1e200)))
    assert found['effort']['rms'] == [None] * 6
    json.dumps(found, allow_nan=False)
