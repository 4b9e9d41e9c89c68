"""Sensitivity to the gains: known laws of the figures, every form of a gain, honest failures."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pyarrow.parquet as parquet
import pytest
from helpers.closed_loops import PER_AXIS
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.simulation import batch
from auv_analysis.simulation.batch import kernels
from auv_analysis.simulation.reduction import COLUMNS
from auv_analysis.studies.study import sensitivity as module
from auv_analysis.studies.study.procedure import (
    left_out_table,
    sensitivity_sentences,
    sensitivity_table,
    write_sensitivities,
)
from auv_analysis.studies.study.sensitivity import (
    Kpi,
    _default_count,
    _reason,
    gain_factors,
    sensitivity,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS

SPREAD = math.log(2.0) / math.sqrt(3.0)  # of one log-uniform factor up to 2


@cache
def short(controller: str = 'gvc'):
    return changed_scenario(load_scenario('case1'), {'duration': 3.0})


def known(monkeypatch, limit: float = np.inf, **figures) -> None:
    """Put figures that are known functions of k_D and Gamma in the place of rollouts."""

    def made(scenario, controller, changes, **_):
        k_D, Gamma = (
            changes[f"controllers.'{controller}'.{name}"] / value
            for name, value in (('k_D', 12.0), ('Gamma', 60.0))
        )
        found = {name: np.zeros(len(k_D)) for name in COLUMNS}
        found |= {name: function(k_D, Gamma) for name, function in figures.items()}
        failed = np.maximum(k_D, Gamma) > limit
        found['status'] = np.where(failed, 'diverged', 'ok')
        found['reason'] = np.where(failed, 'not finite from t = 1 s', '')
        return found

    monkeypatch.setattr(module, 'rollouts', made)


NAMES = ('velocity_error.rms.surge', 'velocity_error.rms.sway', 'velocity_error.rms.heave')
LAWS = dict(zip(NAMES, [
    lambda k_D, Gamma: 3.0 / (k_D * Gamma),
    lambda k_D, Gamma: 5.0 * k_D**2 / Gamma,
    lambda k_D, Gamma: 1.0 + 0.0 * k_D,
], strict=True))  # fmt: skip


@pytest.mark.parametrize('method', ['sobol', 'morris'])
def test_powers_of_the_gains_are_found(monkeypatch, method, approved):
    known(monkeypatch, **LAWS)
    found = sensitivity(short(), 'gvc', method=method, count=256)
    of = found.of('velocity_error.rms')
    expected = {'surge': (-1.0, 0.0, 0.0, -1.0), 'sway': (2.0, 0.0, 0.0, -1.0)}
    for dof, exponents in expected.items():
        powers = np.array(exponents)
        assert_allclose(column(of[dof], 'elasticity'), powers, atol=1e-9)
        if method == 'sobol':
            spread = SPREAD * np.sqrt((powers**2).sum())
            assert_allclose(of[dof][0]['spread'], spread, rtol=0.02)
            shares = powers**2 / (powers**2).sum()
            assert_allclose(column(of[dof], 'ST'), shares, atol=0.02)
            assert all('mu_star' not in row for row in of[dof])
        else:
            whole = 2.0 * math.log(2.0) * np.abs(powers)
            assert_allclose(column(of[dof], 'mu_star'), whole, atol=1e-9)
            assert all('ST' not in row for row in of[dof])
    assert [kpi.dof for kpi in found.kpis] == ['sway', 'surge']
    assert [of[dof][0]['rank'] for dof in ('surge', 'sway')] == [2, 1]
    assert of['sway'][0]['gain'] == 'k_D'
    assert of['sway'][0]['doubled'] == pytest.approx(300.0)
    assert of['surge'][0]['value'] == pytest.approx(3.0)
    for row in (of['surge'][0], of['sway'][0]):
        assert row['smallest'] < row['value'] < row['largest']
    reasons = {kpi.column: reason for kpi, reason in found.excluded.items()}
    assert reasons['velocity_error.rms.heave'] == 'the same whatever the gains'
    assert reasons['velocity_error.rms.yaw'] == 'zero throughout'
    assert len(found.kpis) + len(found.excluded) == 61


def column(rows, name: str) -> list[float]:
    """Of each gain, in the order of the law."""
    of = {row['gain']: row[name] for row in rows}
    return [of[gain] for gain in ('k_D', 'k_I', 'Lambda', 'Gamma')]


def test_what_cannot_be_followed_is_named(monkeypatch, approved):
    figures = {
        'velocity_error.settling_time.surge': lambda k, G: np.where(k > 1.0, np.nan, k),
        'velocity_error.settling_time.sway': lambda k, G: np.where(k > 1.0, 0.0, k),
        'effort.rms.heave': lambda k, G: k,
        'effort.rms.surge': lambda k, G: 1e-15 * k,
        'lumped_error.rms.surge': lambda k, G: np.nan * k,
        'coupling.delta_xi_max.yaw': lambda k, G: 1e-17 * k,
    }
    known(monkeypatch, **figures)
    found = sensitivity(short(), 'gvc', count=16)
    reasons = {kpi.column: reason for kpi, reason in found.excluded.items()}
    approved.add(f'{column}: {reason}' for column, reason in reasons.items())
    assert 'does not settle in' in reasons['velocity_error.settling_time.surge']
    assert 'zero in' in reasons['velocity_error.settling_time.sway']
    assert 'rounding' in reasons['effort.rms.surge']
    assert 'does not exist in any' in reasons['lumped_error.rms.surge']
    assert 'structure of M' in reasons['coupling.delta_xi_max.yaw']
    assert [kpi.column for kpi in found.kpis] == ['effort.rms.heave']


def test_diverging_loops_narrow_the_span_and_are_counted(monkeypatch, tmp_path, approved):
    known(monkeypatch, limit=1.5, **LAWS)
    found = sensitivity(short(), 'gvc', count=32)
    assert found.span == pytest.approx(2.0**0.5)
    assert list(found.failed) == [2.0]
    assert 0 < found.failed[2.0] < 32 * 6
    surge = found.of('velocity_error.rms')['surge']
    assert surge[0]['spread'] == pytest.approx(0.5 * SPREAD * np.sqrt(2), rel=0.1)
    assert_allclose(column(surge, 'elasticity'), [-1, 0, 0, -1], atol=1e-9)
    text = ' '.join(s.text for s in sensitivity_sentences([found]))
    assert f'{found.failed[2.0]} rollouts failed' in text
    path = write_sensitivities(tmp_path, [replace(found, failed={2.0: 7, 1.4: 2}, seed=5)])
    rows = parquet.read_table(path).to_pylist()
    assert {
        tuple(row[key] for key in ('controller', 'law', 'method', 'count', 'rollouts',
                                   'span_asked', 'diverged', 'seed')) for row in rows
    } == {('gvc', 'gvc', 'sobol', 32, 32 * 6 + 1, 2.0, 9, 5)}  # fmt: skip
    assert {row['span'] for row in rows} == {found.span}
    (left_out,) = (row for row in rows if row['figure'] == NAMES[2].rpartition('.')[0]
                   and row['dof'] == 'heave')  # fmt: skip
    assert (left_out['gain'], left_out['ST'], left_out['unit']) == ('', None, 'm/s')
    assert found.six('velocity_error.rms').tolist() == [
        surge[0]['spread'], found.of('velocity_error.rms')['sway'][0]['spread'], 0, 0, 0, 0
    ]  # fmt: skip


def test_loops_that_always_diverge_are_a_refusal_with_its_reason(monkeypatch, tmp_path, approved):
    known(monkeypatch, limit=1.01, **LAWS)
    found = sensitivity(short(), 'gvc', count=32)
    assert len(found.failed) == 4
    assert 'not finite from t = 1 s' in found.refusal
    known(monkeypatch, limit=0.5, **LAWS)
    own = sensitivity(short(), 'gvc', count=32)
    approved.add([found.refusal, own.refusal])
    assert 'own gains' in own.refusal
    assert not own.rows
    assert (own.rollouts, found.rollouts) == (0, 0)
    assert (own.failed, own.span) == ({}, 2.0)
    assert found.span == pytest.approx(2.0**0.125)  # the last that was tried
    (table,) = left_out_table([own])
    assert own.refusal in [cell.text for row in table.rows for cell in row]
    path = write_sensitivities(tmp_path, [own, found])
    assert set(parquet.read_table(path)['reason'].to_pylist()) == {own.refusal, found.refusal}


def test_elasticity_is_the_derivative():
    """Against a central difference of two runs, within a span that is almost a point."""
    found = sensitivity(short(), 'gvc', count=16, span=1.02)
    errors = []
    for factor in (1 / 1.01, 1.01):
        run = simulate(changed_scenario(short(), {'controllers.gvc.Gamma': 60.0 * factor}), 'gvc')
        errors.append(summarize(run)['velocity_error']['rms'])
    slopes = np.log(np.divide(*errors)) / -np.log(1.01**2)
    of_Gamma = [column(rows, 'elasticity')[3] for rows in _six(found)]
    assert_allclose(of_Gamma, slopes, atol=0.01)
    assert min(of_Gamma) < -0.1
    value = summarize(simulate(short(), 'gvc'))['velocity_error']['rms']
    assert_allclose([rows[0]['value'] for rows in _six(found)], value, rtol=1e-9)


def _six(found):
    of = found.of('velocity_error.rms')
    return [of[dof] for dof in ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')]


def test_every_form_of_a_gain_is_multiplied():
    plain = sensitivity(short(), 'gvc', count=4)
    for value in ([12.0] * 6, (12.0 * np.eye(6)).tolist()):
        scenario = changed_scenario(short(), {'controllers.gvc.k_D': value})
        other = sensitivity(scenario, 'gvc', count=4)
        assert other.gains == plain.gains == ('k_D', 'k_I', 'Lambda', 'Gamma')
        assert_allclose(*(found.six('velocity_error.rms') for found in (other, plain)), rtol=1e-12)


WITH_DEFAULTS = {
    'a.pid': {'law': 'pid', 'k_P': 500.0, 'k_I': 50.0, 'k_D': 20.0},
    'smc': {'law': 'smc', 'k_D': PER_AXIS['k_D'], 'Lambda': 0.8, 'Gamma': 60.0},
}


def test_gains_left_to_their_defaults_are_factors_too():
    scenario = changed_scenario(short(), {'controllers': WITH_DEFAULTS})
    pid, smc = (gain_factors(scenario, name) for name in WITH_DEFAULTS)
    assert tuple(pid[1]) == ('k_P', 'k_I', 'k_D', 'omega_f', 'k_FF')
    assert tuple(smc[1]) == ('k_D', 'Lambda', 'Gamma', 'phi')
    assert list(smc[2]) == ['k_S']


@pytest.mark.long  # numba compiles the batch of this law for it alone
def test_figures_are_sensitive_to_gains_left_to_their_defaults():
    scenario = changed_scenario(short(), {'controllers': WITH_DEFAULTS})
    found = sensitivity(scenario, 'a.pid', method='morris', count=2)
    assert found.rollouts == 2 * 6 + 1
    names = {row['gain'] for row in found.rows}
    assert names == {'k_P', 'k_I', 'k_D', 'omega_f', 'k_FF'}


LAW = """
from typing import NamedTuple

class Push(NamedTuple):
    k_A: object
    k_B: object = 2.0
    STATES = 0

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return (gains.k_A[0] / gains.k_B[0] ** 2, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0,) * 6

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        return ()
"""


def test_a_users_own_law_is_studied_as_it_runs(monkeypatch, tmp_path):
    """As plain Python, by few trajectories; its input is a known power of its gains."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / 'own_push.py').write_text(LAW)
    values = {
        'duration': 0.02,
        'controllers': {'own': {'law': 'own_push:Push', 'k_A': 3.0}},
    }
    scenario = changed_scenario(load_scenario('case1'), values)
    monkeypatch.setattr(batch, 'kernels', lambda law, hold: kernels(law, hold)[-1:])
    found = sensitivity(scenario, 'own')
    assert (found.method, found.count, found.rollouts) == ('morris', 4, 4 * 3 + 1)
    assert sensitivity(scenario, 'own', method='morris').count == 4
    assert sensitivity(scenario, 'own', count=2).method == 'morris'
    push = found.of('effort.max')['surge']
    assert [row['gain'] for row in push] == ['k_B', 'k_A']
    assert [row['elasticity'] for row in push] == pytest.approx([-2.0, 1.0])
    assert push[0]['value'] == pytest.approx(0.75)


def test_wrong_input_is_refused():
    with pytest.raises(ValueError, match='above 1'):
        sensitivity(short(), 'gvc', span=1.0)
    with pytest.raises(InputError, match='nobody'):
        sensitivity(short(), 'nobody')
    with pytest.raises(ValueError, match=r'expected sobol or morris, found .fast'):
        sensitivity(short(), 'gvc', method='fast')


def test_table_sentences_and_file_say_the_same(monkeypatch, tmp_path, approved):
    known(monkeypatch, **LAWS)
    found = sensitivity(short(), 'gvc', count=64)
    sway = found.of('velocity_error.rms')['sway'][0]
    table = sensitivity_table([found], found)
    assert [row[0].text for row in table.rows] == ['RMS error, sway', 'RMS error, surge']
    assert table.rows[0][3].value == sway['spread']
    rows = parquet.read_table(write_sensitivities(tmp_path, [found])).to_pylist()
    first = rows[0]
    assert (first['figure'], first['dof'], first['gain']) == ('velocity_error.rms', 'sway', 'k_D')
    assert (first['spread'], first['ST']) == (sway['spread'], sway['ST'])
    assert first['mu_star'] is None
    assert sum(row['figure'] == 'velocity_error.rms' for row in rows) == 2 * 4 + 4
    (text,) = (s.text for s in sensitivity_sentences([found]) if 'follows' in s.text)
    assert 'RMS error that follows the gains most is that of sway' in text
    assert 'k_D makes' in text
    assert '+300 %' in text
    turned = {NAMES[1]: lambda k, G: 5.0 / k**2}
    known(monkeypatch, **turned)
    (text,) = (s.text for s in sensitivity_sentences([sensitivity(short(), 'gvc', count=64)])
               if 'follows' in s.text)  # fmt: skip
    assert '−75 %' in text


def test_gains_may_be_called_as_columns_of_the_table(monkeypatch):
    known(monkeypatch, **LAWS)
    found = sensitivity(short(), 'gvc', count=4)
    called = dict(zip(found.gains, ('gain', 'value', 'rank', 'kpi'), strict=True))
    rows = tuple(row | {'gain': called[row['gain']]} for row in found.rows)
    own = replace(found, gains=(*called.values(),), rows=rows)
    tables = [sensitivity_table([one], one) for one in (found, own)]
    cells = [[[(c.value, c.source) for c in row] for row in table.rows] for table in tables]
    assert cells[0] == cells[1]


def test_what_is_small_throughout_its_kind_is_no_rounding():
    values = 1e-12 * np.linspace(1.0, 2.0, 9)
    found = {f'effort.max.{dof}': values for dof in DOFS}
    assert _reason(Kpi('effort.max', 'surge'), found) == ''
    found['effort.max.heave'] = np.full(9, np.nan)  # does not exist, and is none of the largest
    assert _reason(Kpi('effort.max', 'surge'), found) == ''
    found['effort.max.sway'] = np.ones(9)
    assert _reason(Kpi('effort.max', 'surge'), found).startswith('rounding')
    assert _reason(Kpi('effort.max', 'yaw'), found) == '', 'of the other half'
    found['effort.max.surge'] = np.geomspace(1e-12, 0.5, 9)
    assert _reason(Kpi('effort.max', 'surge'), found) == '', 'not throughout'


def test_how_many_points_are_taken_where_nobody_says():
    of = [
        _default_count(law, method, slow=False)
        for law in ('gvc', 'own:Law') for method in ('sobol', 'morris')
    ]  # fmt: skip
    assert of == [256, 32, 64, 16]
    assert [_default_count('gvc', m, slow=True) for m in ('sobol', 'morris')] == [256, 4]


def test_a_law_without_gains_and_one_that_fails_are_told_of(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / 'no_gains.py').write_text(LAW)
    values = {'controllers': {'own': {'law': 'no_gains:Push', 'k_A': 0.0, 'k_B': 0.0}}}
    found = sensitivity(changed_scenario(load_scenario('case1'), values), 'own')
    assert found.refusal == 'the law has no gain that is not zero'
    values = {'controllers': {'still': {'law': 'multisine'}}, 'excitation': {'yaw': {'offset': 1}}}
    driven = changed_scenario(load_scenario('case1'), values)
    assert sensitivity(driven, 'still').refusal == found.refusal
    assert [s.text for s in sensitivity_sentences([found])] == [
        'How own follows its gains is not known: the law has no gain that is not zero.'
    ]


def test_where_the_scenarios_own_gains_fail_nothing_is_followed(monkeypatch):
    known(monkeypatch, **LAWS)
    usual = module.rollouts

    def first_fails(*args, **about):
        found = usual(*args, **about)
        found['status'][0] = 'diverged'
        return found | {'reason': np.full(len(found['status']), 'it falls over')}

    monkeypatch.setattr(module, 'rollouts', first_fails)
    found = sensitivity(short(), 'gvc', count=4)
    assert found.refusal == 'with the scenario’s own gains: it falls over'
