"""A user's own law: plain Python in the same kernel, and no trace of it in the compiled code.

Each run is a process with a cache folder of its own: what one leaves there, the next would load.
"""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate

# CL by NumPy and a dictionary: what people write, and what numba does not compile
OWN = """
from typing import NamedTuple

import numpy as np

from auv_gvc_controller.laws.cl import CL

CALLS = {'wrench': 0}


class Mine(NamedTuple):
    k_D: np.ndarray
    k_I: np.ndarray
    Lambda: np.ndarray
    Gamma: np.ndarray

    STATES = 12

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        CALLS['wrench'] += 1
        CALLS.setdefault(f'at {t:.2f} s', []).append({'nu': nu})
        return CL.wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return CL.state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model)
"""
SCRIPT = """
import sys
from dataclasses import replace

import numpy as np

import own_law_of_mine
from auv_analysis import load_scenario, simulate

scenario = load_scenario('case1')
mine = scenario.data['controllers']['cl'] | {'law': 'own_law_of_mine:Mine'}
data = scenario.data | {'duration': 0.2, 'controllers': {'mine': mine}}
run = simulate(replace(scenario, data=data), 'mine', sys.argv[1])
assert run.law == 'own_law_of_mine:Mine'
assert own_law_of_mine.CALLS['wrench'] >= len(run.t)
np.savez(sys.argv[2], nu=run.nu, tau=run.tau, f=run.disturbance_estimate)
"""


@pytest.mark.parametrize('hold', ['zoh', pytest.param('continuous', marks=pytest.mark.long)])
def test_a_law_of_ones_own_is_plain_python(tmp_path, hold):
    (tmp_path / 'own_law_of_mine.py').write_text(OWN, encoding='utf-8')
    (tmp_path / 'script.py').write_text(SCRIPT, encoding='utf-8')
    cache = tmp_path / 'cache'
    done = subprocess.run(
        [sys.executable, str(tmp_path / 'script.py'), hold, str(tmp_path / 'run.npz')],
        env=os.environ | {'AUV_GVC_CACHE_DIR': str(cache)},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    kept = [path.name for path in cache.rglob('*.nb?') if b'own_law_of_mine' in path.read_bytes()]
    assert kept == []  # numba would import the law's module in every later process

    scenario = load_scenario('case1')
    scenario = replace(scenario, data=scenario.data | {'duration': 0.2})
    shipped, own = simulate(scenario, 'cl', hold), np.load(tmp_path / 'run.npz')
    assert_allclose(own['nu'], shipped.nu, rtol=0, atol=1e-12)
    for key, series in (('tau', shipped.tau), ('f', shipped.disturbance_estimate)):
        assert_allclose(own[key], series, rtol=0, atol=1e-11 * np.abs(series).max())
