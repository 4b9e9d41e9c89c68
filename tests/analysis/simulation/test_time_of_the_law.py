"""What time a law is told: that of the stage within a step, that of the sample under a hold."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate

CLOCK = """
from typing import NamedTuple

import numpy as np


class Clock(NamedTuple):
    k: np.ndarray
    STATES = 2
    INTEGRALS = 0

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return (t, state[0], 0.0, 0.0, 0.0, 0.0), (0.0, t, 0.0, 0.0, 0.0, 0.0)

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return np.cos(5.0 * t), 1.0
"""


@pytest.fixture
def run_of(tmp_path, monkeypatch):
    (tmp_path / 'law_that_is_a_clock.py').write_text(CLOCK, encoding='utf-8')
    monkeypatch.syspath_prepend(tmp_path)
    base = load_scenario('case1')
    entry = {'law': 'law_that_is_a_clock:Clock', 'k': 1.0}
    data = base.data | {'duration': 0.2, 'controllers': {'clock': entry}}
    return lambda hold: simulate(replace(base, data=data), 'clock', hold)


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_a_sample_is_at_its_own_time(run_of, hold):
    run = run_of(hold)
    assert_allclose(run.tau[:, 0], run.t, rtol=1e-15)
    assert_allclose(run.disturbance_estimate[:, 1], run.t, rtol=1e-15)
    assert_allclose(run.tau[:, 1], run.law_state[:, 0], rtol=1e-15)
    assert_allclose(run.law_state[:, 1], run.t, atol=1e-14)


def test_between_the_samples_it_is_that_of_the_stage(run_of):
    run = run_of('continuous')
    assert_allclose(run.law_state[:, 0], np.sin(5.0 * run.t) / 5.0, atol=1e-12)


def test_under_a_hold_a_rate_is_that_of_the_sample_before(run_of):
    run = run_of('zoh')
    steps = 0.01 * np.cos(5.0 * run.t[:-1])
    assert_allclose(run.law_state[:, 0], np.concatenate([[0.0], np.cumsum(steps)]), atol=1e-15)
