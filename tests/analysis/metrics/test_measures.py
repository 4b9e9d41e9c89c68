"""Figures of a run as columns, and what sums them up."""

import numpy as np
import pytest
from helpers.strategies import QUICK, vectors
from hypothesis import given

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.metrics.measures import (
    BY_NAME,
    FAMILIES,
    MEASURES,
    flat,
)
from auv_analysis.metrics.quantities import quantity
from auv_analysis.simulation.reduction import COLUMNS
from auv_dynamics.vehicle import DOFS


@pytest.fixture(scope='module')
def summary():
    return summarize(simulate(load_scenario('case1'), 'gvc'))


def test_columns_are_named_like_those_of_a_sweep(summary) -> None:
    columns = flat(summary)
    assert {name for name in COLUMNS if name != 'diverged_at'} <= set(columns)
    assert columns['velocity_error.rms.yaw'] == summary['velocity_error']['rms'][5]
    assert columns['decomposition.Upsilon.sway.yaw'] == summary['decomposition']['Upsilon'][1][5]
    assert columns['kinetic_energy.mean'] == summary['kinetic_energy']['mean']
    found = quantity('kinetic_energy.mean')
    total = BY_NAME['kinetic_energy.mean']
    assert (total.label, total.unit, total.meaning) == (found.label, found.unit, found.meaning)
    assert columns['kinetic_energy.window.to'] == summary['kinetic_energy']['window'][1]
    assert columns['coupling.structural_zeros.delta_xi'] == 'pitch; yaw'
    term = summary['coupling_terms']['delta_xi'][0]
    assert columns[f'coupling_terms.delta_xi.{term["to"]}.{term["from"]}.max'] == term['max']
    window = summary['kinetic_energy_windows'][0]
    assert columns['kinetic_energy_windows.0to10.mean'] == window['mean']
    listed = [name for name in columns if name.startswith(('coupling_terms', 'kinetic_energy_w'))]
    assert not [one for one in listed if {'to', 'from', 'window'} & {*one.split('.')}], 'twice'


def leaves(value):
    if isinstance(value, dict):
        value = list(value.values())
    return [x for entry in value for x in leaves(entry)] if isinstance(value, list) else [value]


def test_no_number_of_a_summary_is_left_out(summary) -> None:
    columns = list(flat(summary).values())
    windows = [{**w, 'window': []} for w in summary['kinetic_energy_windows']]  # in their names
    given = summary | {'kinetic_energy_windows': windows}
    numbers = [x for x in leaves(given) if isinstance(x, float) and not isinstance(x, bool)]
    assert len(numbers) > 100
    assert all(x in columns for x in numbers)


def test_what_does_not_exist_is_none(summary) -> None:
    late = summary | {'lumped_error': {'rms': None, 'max_after_2s': None}}
    late |= {'gains': {'K_D': None, 'K_f': None}}
    late['velocity_error'] = late['velocity_error'] | {'settling_time': [0.1, None, *[0.2] * 4]}
    columns = flat(late)
    assert columns['lumped_error.rms.heave'] is None
    assert columns['overall.lumped_error.rms.linear'] is None
    assert columns['overall.velocity_error.settling_time'] is None
    assert not any(name.startswith('gains.') for name in columns)


@QUICK
@given(vectors())
def test_measures_sum_up_their_columns(values) -> None:
    of = dict(zip(DOFS, np.abs(values)[:, None], strict=True))

    def value(name):
        return BY_NAME[name].of(lambda column: of[column.rpartition('.')[2]])[0]

    halves = {'linear': values[:3], 'angular': values[3:]}
    for name, half in ((name, name.rpartition('.')[2]) for name in BY_NAME):
        if half in halves:
            order = 2 if '.rms.' in name else np.inf
            assert value(name) == pytest.approx(np.linalg.norm(halves[half], order)), name
            assert ('of the vector of the three' in BY_NAME[name].meaning) == (order == 2)
    assert value('overall.velocity_error.settling_time') == np.abs(values).max()


def test_every_column_says_its_unit() -> None:
    for name in (*BY_NAME, *(f'{family}.{dof}' for family in FAMILIES for dof in DOFS)):
        what = BY_NAME.get(name) or quantity(name)
        assert all((what.label, what.unit, what.meaning)), name
    assert len({measure.label for measure in MEASURES}) == len(MEASURES)
