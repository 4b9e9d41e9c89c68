"""Step 6 in sentences: each follows from the numbers, and there is none that they do not carry."""

from functools import cache
from types import SimpleNamespace as Made

import numpy as np
import pyarrow.parquet as parquet
import pytest
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.studies.study.procedure import discussion, write_samples
from auv_dynamics.vehicle import DOFS

pytestmark = pytest.mark.usefixtures('approved')


@cache
def run_of(name):
    return simulate(load_scenario(name), 'gvc')


def summary(name='case1'):
    return summarize(run_of(name))


def said(found) -> str:
    return ' '.join(sentence.text for sentence in discussion('gvc', found))


def test_case1_as_the_paper_discusses_it():
    text = said(summary())
    for part in (
        'ξ3 (heave) has 76.61 % and ξ1 (surge) has 23.29 %',
        'velocity component of roll is deformed by up to 0.0514 rad/s',
        'the motion of yaw causes 100.0 % of it',
        'input of pitch is deformed by up to 840 N m',
    ):
        assert part in text, part


def test_every_sentence_names_a_table():
    for name in ('case1', 'case1_rexrov'):
        sources = [sentence.source for sentence in discussion('gvc', summary(name))]
        assert sources == ['table-energy', 'table-terms', 'table-terms']


def test_nothing_deforms_a_diagonal_vehicle():
    text = said(summary('case1_bluerov2_heavy'))
    assert 'deformed' not in text


def test_a_vehicle_at_rest_has_nothing_to_be_said_of_its_energy():
    found = summary()
    found['kinetic_energy']['shares_percent'] = [0.0] * 6
    assert 'kinetic energy' not in said(found)


@pytest.mark.parametrize(('largest', 'named'), [(94.9, True), (95.1, False)])
def test_components_are_named_until_they_have_95_percent(largest, named):
    found = summary()
    found['kinetic_energy']['shares_percent'] = [largest, 99.0 - largest, 1.0, 0.0, 0.0, 0.0]
    assert ('ξ2 (sway) has' in said(found)) == named


def test_what_never_moves_by_itself_is_not_the_most_deformed():
    found = summary()
    found['velocity']['max'][3], found['effort']['max'][4] = 1e-12, 0.0  # rounding
    text = said(found)
    assert 'component of roll' not in text
    assert 'input of pitch' not in text


def test_samples_carry_energy_over_time(tmp_path):
    run = run_of('case1')
    parts = Made(vehicle=run.vehicle, blocks=lambda: run.blocks(1000))
    table = parquet.read_table(write_samples(parts, tmp_path / 'gvc.parquet')).to_pydict()
    energy = np.column_stack([table[f'kinetic_energy.{dof}'] for dof in DOFS])
    total = 0.5 * np.einsum('ki,ij,kj->k', run.nu, run.vehicle.M, run.nu)
    assert_allclose(energy.sum(axis=1), total, rtol=1e-12)
    assert_allclose(energy.mean(axis=0), summary()['kinetic_energy']['mean_by_component'])
    assert_allclose(table['t'], run.t)
    for name, values in {'nu': run.nu, 'tau': run.tau, 'F': run.disturbance}.items():
        assert_allclose(np.column_stack([table[f'{name}.{dof}'] for dof in DOFS]), values)
    xi = np.column_stack([table[f'xi.{dof}'] for dof in DOFS])
    delta = np.column_stack([table[f'delta_xi.{dof}'] for dof in DOFS])
    assert_allclose(xi - delta, run.nu, atol=1e-12)
