"""Sensitivity indices of designed campaigns against those that are known in closed form."""

from pathlib import Path

import numpy as np
import pytest
from helpers.made_sweeps import make_sweep

from auv_analysis.metrics.measures import BY_NAME
from auv_analysis.studies.sweep.analysis import analysed
from auv_analysis.studies.sweep.dataset import numbers_of, open_sweep
from auv_analysis.studies.sweep.indices import designed, omitted
from auv_analysis.studies.sweep.indices import indices as indices_of
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle import DOFS

ENERGY = 'kinetic_energy.mean'
A, B, C = 'controllers.*.k_D', 'controllers.*.k_I', 'setpoint.surge.offset'
UNIFORM = '\n'.join(f'      {path}: {{uniform: {{from: 1.0, to: 2.0}}}}' for path in (A, B, C))
SALTELLI = f"""
name: salt
scenario: case1
controllers: [gvc]
block: 2048
vary:
  - grid: {{integrator: [ode5, rk4]}}
  - saltelli:
{UNIFORM}
    count: 256
    second_order: true
"""
MORRIS = f"""
name: morr
scenario: case1
controllers: [gvc]
vary:
  - morris:
{UNIFORM}
    count: 12
"""


def linear(controller, values, index):
    return {ENERGY: 10.0 + 3.0 * values[A] - 1.0 * values[B]}


def indices(out: Path) -> list[dict]:
    sweep, measure = open_sweep(out), BY_NAME[ENERGY]
    (found,), notes = designed(sweep)
    assert notes == []
    values = numbers_of(sweep.table([ENERGY]), ENERGY)
    return [*indices_of(sweep, found, values, measure)]


def test_sobol_of_a_linear_figure(tmp_path: Path) -> None:
    found = indices(make_sweep(tmp_path, SALTELLI, linear))
    assert {row['case'] for row in found} == {'integrator = ode5', 'integrator = rk4'}
    for row in found:
        if row['with'] is None:
            expected = {A: 0.9, B: 0.1, C: 0.0}[row['path']]
            assert row['S1'] == pytest.approx(expected, abs=0.05)
            assert row['ST'] == pytest.approx(expected, abs=0.05)
        else:
            assert row['S2'] == pytest.approx(0.0, abs=0.1)
        assert (row['points'], row['of']) == (256, 256)


def test_indices_are_the_same_where_the_design_is_not_the_last_group(tmp_path: Path) -> None:
    """One group outside of it and one inside: cases of two integrators and two durations."""
    inside = '  - grid: {duration: [1.0, 2.0]}\n'
    out = make_sweep(tmp_path, SALTELLI.replace('256', '64') + inside, linear)
    found = [row for row in indices(out) if row['with'] is None]
    cases = {f'integrator = {i}, duration = {d}' for i in ('ode5', 'rk4') for d in (1.0, 2.0)}
    assert {row['case'] for row in found} == cases
    assert {row['points'] for row in found} == {64}
    for row in found:
        assert row['ST'] == pytest.approx({A: 0.9, B: 0.1, C: 0.0}[row['path']], abs=0.06)


def test_a_base_point_with_a_failed_row_is_left_out_whole(tmp_path: Path, approved) -> None:
    def failing(controller, values, index):
        columns = linear(controller, values, index)
        status = np.where(index % 80 == 5, 'diverged', 'ok').astype(object)
        columns[ENERGY] = np.where(status == 'ok', columns[ENERGY], np.nan)
        return columns | {'status': status}

    results = analysed(open_sweep(make_sweep(tmp_path, SALTELLI, failing)))
    found = [row for row in results.tables['indices'] if row['figure'] == ENERGY
             and row['with'] is None and row['case'] == 'integrator = ode5']  # fmt: skip
    lost = len({index // 8 for index in range(5, 4096, 80)})
    assert f'the {512 - lost} of 512 base points' in ' '.join(results.notes)
    approved.add(results.notes)
    lost = len({index // 8 for index in range(5, 2048, 80)})
    assert {row['points'] for row in found} == {256 - lost}
    for row in found:
        assert row['S1'] == pytest.approx({A: 0.9, B: 0.1, C: 0.0}[row['path']], abs=0.06)


def test_rows_that_settle_are_no_sample_of_the_design(tmp_path: Path, approved) -> None:
    """Their indices would be those of rows that were chosen by the figure itself."""

    def settling(controller, values, index):
        heave = np.where(values[A] > 1.2, 3.0 - values[A], np.nan)
        return linear(controller, values, index) | {
            f'velocity_error.settling_time.{dof}': heave for dof in DOFS
        }

    few = SALTELLI.replace('256', '64')
    results = analysed(open_sweep(make_sweep(tmp_path, few, settling)))
    assert {row['figure'] for row in results.tables['indices']} == {ENERGY}
    assert len([note for note in results.notes if 'no indices of settled under gvc' in note]) == 1
    approved.add(results.notes)


def test_what_two_designs_lack_is_said_once(tmp_path: Path) -> None:
    designs = 'vary:\n  - saltelli: {varied}\n    count: 2\n  - morris: {other}\n    count: 3\n'
    for word, path in (('{varied}', A), ('{other}', B)):
        designs = designs.replace(word, f'{{{path}: {{uniform: {{from: 1.0, to: 2.0}}}}}}')
    text = f'{SALTELLI.partition("vary")[0]}{designs}'

    def settling(controller, values, index):
        column = 'velocity_error.settling_time'
        return {f'{column}.{dof}': np.where(index < 9, 3.0 - values[A], np.nan) for dof in DOFS}

    notes = analysed(open_sweep(make_sweep(tmp_path, text, settling))).notes
    assert len([note for note in notes if 'no indices of settled' in note]) == 1


def test_an_unfinished_design_uses_its_whole_base_points(tmp_path: Path) -> None:
    text = SALTELLI.replace('block: 2048', 'block: 256')
    out = make_sweep(tmp_path, text, linear, range(5))  # 5 * 256 of 2 * 2048 rollouts
    found = [row for row in indices(out) if row['with'] is None]
    assert {(row['case'], row['points']) for row in found} == {('integrator = ode5', 160)}


@pytest.mark.parametrize('levels', [4, 6])
def test_morris_of_a_linear_figure(tmp_path: Path, levels: int) -> None:
    text = MORRIS.replace('count: 12', f'count: 12\n    levels: {levels}')
    found = {row['path']: row for row in indices(make_sweep(tmp_path, text, linear))}
    for path, slope in ((A, 3.0), (B, -1.0), (C, 0.0)):
        assert found[path]['mu'] == pytest.approx(slope)
        assert found[path]['mu_star'] == pytest.approx(abs(slope))
        assert found[path]['sigma'] == pytest.approx(0.0, abs=1e-9)


def test_morris_leaves_out_the_trajectory_of_a_failed_row(tmp_path: Path) -> None:
    def failing(controller, values, index):
        energy = linear(controller, values, index)[ENERGY]
        status = np.where(index == 1, 'diverged', 'ok').astype(object)
        return {ENERGY: np.where(index == 1, np.nan, energy), 'status': status}

    found = {row['path']: row for row in indices(make_sweep(tmp_path, MORRIS, failing))}
    for path, slope in ((A, 3.0), (B, -1.0), (C, 0.0)):
        assert found[path]['points'] == 11
        assert found[path]['mu'] == pytest.approx(slope)
        assert found[path]['sigma'] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize('figure', [0.0, -3.0])
def test_a_figure_that_is_the_same_everywhere_has_no_indices(tmp_path: Path, figure: float) -> None:
    sweep = open_sweep(make_sweep(tmp_path, MORRIS, linear))
    ((found,), _), measure = designed(sweep), BY_NAME[ENERGY]
    values = np.full(sweep.rows, figure)
    assert list(indices_of(sweep, found, values, measure)) == []
    values[5] += 1.0
    assert len(list(indices_of(sweep, found, values, measure))) == 3


def test_a_figure_that_some_rows_of_one_case_lack_is_said_to_have_no_indices(tmp_path) -> None:
    text = MORRIS.replace('vary:', 'vary:\n  - grid: {integrator: [ode5, rk4]}')
    sweep = open_sweep(make_sweep(tmp_path, text, linear))
    ((found,), _), values = designed(sweep), np.zeros(sweep.rows)
    assert list(omitted(sweep, found, values, BY_NAME[ENERGY])) == []
    values[np.flatnonzero(found.others == 0)[:3]] = np.nan
    (note,) = omitted(sweep, found, values, BY_NAME[ENERGY])
    assert f': 3 of {sweep.rows} rows have none' in note


@pytest.mark.parametrize('count', [7, 8])
def test_of_fewer_than_eight_trajectories_there_are_no_indices(tmp_path: Path, count: int) -> None:
    text = MORRIS.replace('count: 12', f'count: {count}')
    results = analysed(open_sweep(make_sweep(tmp_path, text, linear)))
    found = [row for row in results.tables['indices'] if row['figure'] == ENERGY]
    assert [(row['path'], row['points'], row['of']) for row in found] == (
        [(path, 8, 8) for path in (A, B, C)] if count == 8 else []
    )
    assert ('no indices' in ' '.join(results.notes)) is (count == 7)
    assert ' cases' not in ' '.join(results.notes), 'there is one'


def test_of_indices_that_do_not_exist_it_is_said_that_there_are_none(
    tmp_path: Path, approved
) -> None:
    """9 rows fail, each in a trajectory of its own of 12 and in the first case alone."""

    def failing(controller, values, index):
        failed = np.isin(index, range(0, 36, 4))
        status = np.where(failed, 'refused', 'ok').astype(object)
        energy = linear(controller, values, index)[ENERGY]
        return {ENERGY: np.where(failed, np.nan, energy), 'status': status}

    vary = 'vary:\n  - grid: {integrator: [ode5, rk4]}'
    text = MORRIS.replace('vary:', vary)
    results = analysed(open_sweep(make_sweep(tmp_path, text, failing)))
    found = {row['case'] for row in results.tables['indices']}
    assert found == {'integrator = rk4'}
    assert 'in 1 of 2 cases' in ' '.join(results.notes)
    approved.add(results.notes)


@pytest.mark.parametrize(
    ('scenario', 'varied', 'noisy'),
    [
        ('sensors: {velocity_noise: [0, 0, 0, 0, 0, 0.01]}', '', True),
        ('sensors: {velocity_noise: 0.0, drop_out: 0.0}', '', False),
        ('sensors: {drop_out: 0.0}', 'sensors.drop_out: {uniform: {from: 0.0, to: 0.5}}', True),
        ('faults: [{kind: wrench_loss, from: 0.1, probability: 0.5}]', '', True),
        ('faults: [{kind: wrench_loss, from: 0.1, to: 0.2}]', '', False),
    ],
)
def test_noise_in_the_indices_is_said(
    tmp_path: Path, approved, scenario: str, varied: str, noisy: bool
) -> None:
    """Every rollout has a seed of its own, so that its noise counts as an effect of each path."""
    case1 = shipped('scenarios', 'case1').read_text()
    (tmp_path / 'noisy.yaml').write_text(f'{case1}\n{scenario}\n')
    text = MORRIS.replace('scenario: case1', 'scenario: noisy.yaml\nhold: zoh')
    text = text.replace('    count: 12', f'      {varied}\n    count: 12')
    notes = analysed(open_sweep(make_sweep(tmp_path, text, linear))).notes
    assert bool(notes) is noisy
    approved.add(notes)


def test_values_of_another_design_are_not_taken_for_it(tmp_path: Path, approved) -> None:
    few = SALTELLI.replace('256', '16')
    out = make_sweep(tmp_path, few.replace('name: salt', 'name: salt\nseed: 3'), linear)
    manifest = (out / 'sweep.json').read_text()
    (out / 'sweep.json').write_text(manifest.replace('"seed": 3', '"seed": 4'))
    found, notes = designed(open_sweep(out))
    assert found == []
    assert 'another' in notes[0]
    approved.add(notes)


def test_a_design_of_words_and_whole_numbers_is_known_again(tmp_path: Path) -> None:
    words = '      integrator: {choice: [ode5, rk4]}\n      setpoint.heave.offset: {integers: '
    text = MORRIS.replace('    count: 12', f'{words}{{from: 1, to: 3}}}}\n    count: 12')
    out = make_sweep(tmp_path, text, linear)
    (found,), notes = designed(open_sweep(out))
    assert (found.paths[3:], notes) == (['integrator', 'setpoint.heave.offset'], [])
    assert (found.step, len(found.positions)) == (6, 72)
    manifest = (out / 'sweep.json').read_text()
    (out / 'sweep.json').write_text(manifest.replace('"ode5",\n', '"other",\n'))
    found, (note,) = designed(open_sweep(out))
    assert (found, 'is another' in note) == ([], True)


def test_many_other_combinations_are_said(tmp_path: Path, approved) -> None:
    many = "grid: {'initial.nu[0]': [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]}"
    text = SALTELLI.replace('grid: {integrator: [ode5, rk4]}', many)
    text = text.replace('count: 256', 'count: 8')
    found, notes = designed(open_sweep(make_sweep(tmp_path, text, linear)))
    assert found == []
    assert '9 combinations' in notes[0]
    approved.add(notes)
    (tmp_path / 'fewer').mkdir()
    text = text.replace(', 0.8]', ']')
    (found,), notes = designed(open_sweep(make_sweep(tmp_path / 'fewer', text, linear)))
    assert found.cases == [f'initial.nu[0] = {k / 10}' for k in range(8)]
    assert notes == []
