"""A user's own law: plain Python in the same kernel, and no trace of it in the compiled code.

Each run is a process with a cache folder of its own: what one leaves there, the next would load.
"""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from helpers.patience import patience
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate
from auv_analysis.studies.compare.sources import open_source, sources_of
from auv_dynamics import InputError
from auv_dynamics.kernel.compile import cache_folder

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
from auv_dynamics import InputError

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
    cache = cache_folder().parent / 'own_law'  # apart from what else the tests compile
    done = subprocess.run(
        [sys.executable, str(tmp_path / 'script.py'), hold, str(tmp_path / 'run.npz')],
        env=os.environ | {'AUV_GVC_CACHE_DIR': str(cache)},
        capture_output=True,
        text=True,
        check=False,
        timeout=patience(300),
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


WRONG = {  # what a user's law has wrong -> what the one line says
    'STATES = 6.0': 'STATES a whole number',
    'STATES = -1': 'STATES a whole number',
    'STATES = True': 'STATES a whole number',
    'INTEGRALS = 30': 'INTEGRALS a multiple of 6',
    'INTEGRALS = 3': 'INTEGRALS a multiple of 6',
    'INTEGRALS = -6': 'INTEGRALS a multiple of 6',
    'body_gains = staticmethod(lambda gains, model: (np.eye(3), np.eye(3)))': 'two finite 6x6',
    'body_gains = staticmethod(lambda *a: np.full((2, 6, 6), np.nan))': 'two finite 6x6',
    'own_rate = staticmethod(lambda gains: "fast")': 'own_rate',
    'own_rate = staticmethod(lambda gains: np.inf)': 'a finite rate',
    'check = staticmethod(lambda gains: {}["k"])': 'KeyError',
    'wrench = staticmethod(lambda *a: (np.zeros(5), np.zeros(6)))': '6 numbers each',
    'wrench = staticmethod(lambda *a: (np.zeros(6), np.zeros(5)))': '6 numbers each',
    'wrench = staticmethod(lambda *a: 1 / 0)': 'ZeroDivisionError',
    'state_rate = staticmethod(lambda *a: np.zeros(3))': '6 numbers',
}


@pytest.mark.parametrize('line', WRONG)
def test_a_wrong_law_is_refused_in_one_line_before_it_runs(line, tmp_path, monkeypatch):
    module = f'wrong_law_{list(WRONG).index(line)}'
    (tmp_path / f'{module}.py').write_text(
        'from typing import NamedTuple\nimport numpy as np\n\n\n'
        'class Mine(NamedTuple):\n    k_P: np.ndarray\n    STATES = 6\n'
        '    wrench = staticmethod(lambda *a: (np.zeros(6), np.zeros(6)))\n'
        f'    state_rate = staticmethod(lambda *a: np.zeros(6))\n    {line}\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / 'case.yaml'
    path.write_text(
        'name: case\nvehicle: rexrov\nduration: 0.1\nstep: 0.01\nsetpoint: {}\n'
        f'controllers: {{mine: {{law: "{module}:Mine", k_P: 1}}}}\n'
    )
    with pytest.raises(InputError, match=r'controllers\.mine\.law: expected ') as caught:
        load_scenario(path)
    assert WRONG[line] in str(caught.value)
    assert '\n' not in str(caught.value)


def test_a_law_that_fails_under_way_is_named(tmp_path, monkeypatch, capsys):
    (tmp_path / 'late_law.py').write_text(
        'from typing import NamedTuple\nimport numpy as np\n\n\n'
        'class Late(NamedTuple):\n    k_P: np.ndarray\n    STATES = 6\n'
        '    wrench = staticmethod(lambda t, *a: ({}[t] if t > 0.05 else [0.0] * 6, [0.0] * 6))\n'
        '    state_rate = staticmethod(lambda *a: np.zeros(6))\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / 'case.yaml'
    path.write_text(
        'name: case\nvehicle: rexrov\nduration: 0.1\nstep: 0.01\nsetpoint: {}\n'
        'controllers: {mine: {law: "late_law:Late", k_P: 1}}\n'
    )
    with pytest.raises(ArithmeticError, match='the law Late failed: KeyError'):
        simulate(load_scenario(path), 'mine', 'zoh')
    (source,) = sources_of([str(path)])
    with pytest.raises(ArithmeticError, match='the law Late failed: KeyError'):
        open_source(source, None)
    assert 'runs as plain Python' in capsys.readouterr().err, 'which takes long'
