"""A user's own law in rollouts: compiled as far as numba takes it, with the same figures."""

import numpy as np
import pytest
from helpers.needs import needing
from numpy.testing import assert_array_equal

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.cli import main
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.simulation import batch
from auv_analysis.simulation.batch import Kernel, kernels
from auv_analysis.simulation.rollouts import rollouts
from auv_analysis.simulation.variants import in_columns
from auv_dynamics.kernel.compile import JITTED

# all have the same name, which numba alone would not tell apart; types change nothing
LAW = """
from typing import NamedTuple
import numpy as np
from auv_dynamics.kernel.six import add, matvec, sub, vector

class PI(NamedTuple):
    k_P: np.ndarray
    k_I: np.ndarray
    STATES = 6

    @staticmethod
    def wrench(t: float, nu: tuple, attitude, nu_d, nu_d_dot, state, gains: 'PI', model) -> tuple:
        {before}
        error = sub(nu_d, nu)
        return add(matvec(gains.k_P, error), matvec(gains.k_I, vector(state, 0))), (0.0,) * 6

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return sub(nu_d, nu)
"""
BRANCHES = """if nu[0] > 0.05:
            nu_d = nu"""
NOT_FOR_NUMBA = "assert isinstance({'a': 1, 2: 'b'}, dict)"
FAILS = """if t > 0.1 and gains.k_P[0] > 500.0:
            raise KeyError('lost')"""
FAILS_AHEAD = """if t > 0.02 and nu_d[0] > 2.0:
            raise KeyError('lost')"""
GAINS = np.geomspace(50.0, 400.0, 9)


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)

    def with_law(name, before):
        (tmp_path / f'{name}.py').write_text(LAW.format(before=before or 'pass'))
        values = {
            'duration': 0.3,
            'controllers': {'own': {'law': f'{name}:PI', 'k_P': 300.0, 'k_I': 20.0}},
        }
        return changed_scenario(load_scenario('case1'), values)

    return with_law


@pytest.mark.parametrize(
    ('name', 'before', 'how'),
    [
        pytest.param('own_plain_arithmetic', '', 'in vector registers', marks=pytest.mark.long),
        pytest.param('own_branch', BRANCHES, 'compiled', marks=pytest.mark.long),
        pytest.param('own_python', NOT_FOR_NUMBA, 'as plain Python', marks=pytest.mark.long),
    ],
)
def test_a_law_runs_as_compiled_as_can_be(scenario, name, before, how):
    base = scenario(name, before)
    changes = {'controllers.own.k_P': GAINS}
    columns = rollouts(base, 'own', changes, threads=2)
    chosen = {law.__module__: k.how for (law, _), k in batch._CHOSEN.items()}
    assert chosen[name] == (how if JITTED else 'as plain Python')
    assert set(columns['status']) == {'ok'}
    for i in (0, 8):
        single = changed_scenario(base, {'controllers.own.k_P': float(GAINS[i])})
        expected = summarize(simulate(single, 'own'))
        for j, dof in enumerate(('surge', 'sway')):
            rms = expected['velocity_error']['rms'][j]
            assert columns[f'velocity_error.rms.{dof}'][i] == pytest.approx(rms, rel=1e-10)
    alone = rollouts(base, 'own', {'controllers.own.k_P': GAINS[3:4]})
    assert_array_equal(alone['effort.rms.yaw'], columns['effort.rms.yaw'][3:4])


@pytest.mark.long
def test_a_law_that_fails_is_named_in_its_row(scenario):
    base = scenario('own_failing', FAILS)
    columns = rollouts(base, 'own', {'controllers.own.k_P': [300.0, 900.0, 400.0]})
    assert columns['status'].tolist() == ['ok', 'refused', 'ok']
    assert columns['reason'][1] == "the law PI failed: KeyError: 'lost'"
    alone = rollouts(base, 'own', {'controllers.own.k_P': [400.0]})
    assert alone['effort.rms.surge'] == columns['effort.rms.surge'][2:]


def test_a_law_that_fails_takes_none_of_its_batch_along(scenario, monkeypatch):
    monkeypatch.setattr(batch, 'kernels', lambda *given: kernels(*given)[-1:])  # plain Python
    monkeypatch.setattr(batch, '_CHOSEN', {})
    base = changed_scenario(scenario('own_ahead', FAILS_AHEAD), {'duration': 0.05})
    columns = rollouts(base, 'own', {'setpoint.surge.offset': [0.1, 3.0, 0.2]})
    assert columns['status'].tolist() == ['ok', 'refused', 'ok']
    assert columns['reason'].tolist() == ['', "the law PI failed: KeyError: 'lost'", '']
    assert np.isnan(columns['effort.rms.surge']).tolist() == [False, True, False]
    alone = rollouts(base, 'own', {'setpoint.surge.offset': [0.2]})
    assert alone['effort.rms.surge'] == columns['effort.rms.surge'][2:]


@pytest.mark.parametrize('error', [AssertionError('register'), KeyError('x'), RuntimeError('a\nb')])
def test_law_that_numba_fails_on_in_any_way_runs_as_plain_python(
    scenario, error, monkeypatch, capsys
):
    def fails(*_):
        raise error

    tried = [Kernel(fails, 4, 'in vector registers'), Kernel(fails, None, 'compiled')]
    monkeypatch.setattr(batch, 'kernels', lambda *given: [*tried, kernels(*given)[-1]])
    monkeypatch.setattr(batch, '_CHOSEN', {})
    base = scenario(f'own_{type(error).__name__}', '')
    columns = rollouts(base, 'own', {'controllers.own.k_P': GAINS}, threads=2)
    assert set(columns['status']) == {'ok'}
    assert not in_columns(base, 'own', 'controllers.own.k_P', GAINS), 'each is tried at rest'
    (line,) = capsys.readouterr().err.splitlines()  # once, whatever the number of threads
    assert 'the law PI runs as plain Python' in line
    assert type(error).__name__ in line


@pytest.mark.parametrize(
    ('lines', 'why'),
    [
        (['TypingError: first', 'other', 'UnsupportedError: dict of ints', 'File "law.py", line 7:',
          'def wrench'], 'UnsupportedError: dict of ints, File "law.py", line 7'),
        (['TypingError: first', '  LoweringError: Failed in step', '  no such type', 'later'],
         'no such type'),
        (['ValueError: ' + 200 * 'x'], 'ValueError: ' + 148 * 'x'),
    ],
)  # fmt: skip
def test_why_numba_failed_is_what_its_innermost_error_says(lines, why):
    kind, _, first = lines[0].partition(': ')
    error = type(kind, (Exception,), {})('\n'.join([first, *lines[1:]]))
    assert batch._why(error) == why


@pytest.mark.long
@needing('numba', JITTED)
def test_the_template_of_a_law_is_compiled(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main.main(['new', 'law', 'template_of_a_law'])
    base = load_scenario('template_of_a_law.yaml')
    columns = rollouts(base, 'mine', {'controllers.mine.k_P': [3.0, 4.0]})
    assert set(columns['status']) == {'ok'}
    chosen = {law.__module__: k.how for (law, _), k in batch._CHOSEN.items()}
    assert chosen['template_of_a_law'] == 'compiled'
    assert 'plain Python' not in capsys.readouterr().err
