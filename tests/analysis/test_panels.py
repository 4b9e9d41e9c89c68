"""Panels of a report: every controller's lines in few bytes, and what they leave out."""

import base64
import json
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from auv_analysis import load_scenario, simulate
from auv_analysis.report import interactive as page
from auv_analysis.report.interactive import interactive
from auv_analysis.report.packing import Packer, packed
from auv_analysis.report.panels import different_disturbances, panel_sets
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.sketching import sketches
from auv_dynamics.vehicle import DOFS


@pytest.fixture(scope='module')
def case1() -> dict[str, Sketch]:
    scenario = load_scenario('case1')
    runs = {name: simulate(scenario, name) for name in scenario.controllers}
    return sketches({name: run.part(run.t <= 5.0) for name, run in runs.items()})


def _inflated(text: str) -> bytes:
    return zlib.decompress(base64.b64decode(text))


def _times(content: bytes, axis: dict) -> np.ndarray:
    planes = np.frombuffer(content, np.uint8, 4 * axis['count'], axis['at']).reshape(4, -1)
    ticks = np.cumsum(planes.astype(np.int64).T @ 256 ** np.arange(4))
    return axis['start'] + ticks * axis['tick']


def _values(content: bytes, at: int, count: int) -> np.ndarray:
    planes = np.frombuffer(content, np.uint8, 3 * count, at).reshape(3, -1)
    words = planes.astype(np.uint32).T @ (256 ** np.arange(1, 4, dtype=np.uint32))
    return words.astype('<u4').view('<f4').astype(float)


FLOATS = st.floats(-(2.0**100), 2.0**100, width=32, allow_subnormal=False)


@given(arrays.arrays(float, st.integers(1, 50), elements=FLOATS))
def test_packed_values_keep_four_digits(y):
    packer = Packer()
    packer.add_values(np.ones(3))
    at = packer.add_values(y)
    found = _values(_inflated(packer.packed()), at, len(y))
    assert np.all(np.abs(found - y) <= 2.0**-16 * np.abs(y))


def test_packed_times_are_exact_where_they_are_steps_apart():
    packer, step = Packer(), 0.01
    t = 3.0 + step * np.array([0, 1, 5, 70_000, 90_000_000])
    uneven = np.array([0.0, 0.1234567, 1.0, 3600.0])
    axes = [packer.add_axis(times, step) for times in (t, uneven, t.copy())]
    assert axes == [0, 1, 0]
    content = _inflated(packer.packed())
    assert _times(content, packer.axes[0]) == pytest.approx(t, abs=1e-9)
    assert _times(content, packer.axes[1]) == pytest.approx(uneven, abs=4e-6)


def test_one_line_of_one_time_has_an_axis():
    packer = Packer()
    packer.add_axis(np.array([2.0]), 0.01)
    assert _times(_inflated(packer.packed()), packer.axes[0]).tolist() == [2.0]


def test_lines_of_a_page_are_those_of_the_sketches(case1):
    found = interactive(case1)
    index, content = json.loads(_inflated(found.index)), _inflated(found.data)
    panel = index['panels']['tau-linear']
    assert [(line['run'], line['key']) for line in panel['lines']] == [
        (name, i) for name in case1 for i in range(3)
    ]
    axis = index['axes'][panel['lines'][5]['axis']]
    run, t = case1['cl'], _times(content, axis)
    ends = [run.line('tau', 2, part) for part in ('early', 'late')]
    wanted_t, wanted = (np.concatenate(parts) for parts in zip(*ends, strict=True))
    assert t == pytest.approx(wanted_t, abs=1e-9)
    values = _values(content, panel['lines'][5]['at'], axis['count'])
    assert values == pytest.approx(wanted, rel=2.0**-16)


def test_every_section_has_panels_with_all_controllers(case1):
    sets = panel_sets(case1)
    assert list(sets) == ['errors', 'estimates', 'inputs', 'certificates', 'energy', 'couplings']
    panels = {panel.name: panel for members in sets.values() for panel in members.panels}
    assert list(panels['error-linear'].rows) == ['gvc', 'cl']
    assert list(panels['F-linear'].rows) == ['gvc']
    assert {panel.kind for panel in panels.values()} == {'line', 'log', 'both', 'stack'}
    assert sets['errors'].stands_for('errors_gvc')
    assert not sets['errors'].stands_for('settling')
    assert not sets['inputs'].stands_for('inputs_compared')


def test_energies_of_xi_add_up_to_the_kinetic_energy(case1):
    panels = {panel.name: panel for panel in panel_sets(case1)['energy'].panels}
    rows = [panels[name].rows['gvc'] for name in ('energy-linear', 'energy-angular')]
    lines = [
        panels[name].lines[number].line[1]
        for name, numbers in zip(('energy-linear', 'energy-angular'), rows, strict=True)
        for number in numbers
    ]
    assert np.sum(lines, axis=0) == pytest.approx(case1['gvc'].line('kinetic')[1], rel=1e-12)


def test_structural_zeros_and_unknown_disturbances_have_no_panel(case1):
    names = [panel.name for panel in panel_sets(case1)['couplings'].panels]
    assert names == ['delta_xi-linear', 'delta_xi-angular', 'delta_pi-angular']
    keys = [key.label for key in panel_sets(case1)['couplings'].panels[1].keys]
    assert keys == [DOFS[3]]
    bare = {
        name: replace(run, columns=_without(run.columns), F_digest=b'')
        for name, run in case1.items()
    }
    assert not any(
        panel.name.startswith('lumped') for panel in panel_sets(bare)['estimates'].panels
    )


def _without(columns: dict[str, slice]) -> dict[str, slice]:
    return {name: place for name, place in columns.items() if name != 'lumped_error'}


def test_a_controller_that_estimates_nothing_has_no_lumped_error(case1):
    runs = {'gvc': case1['gvc'], 'cl': replace(case1['cl'], estimates=False)}
    panel = panel_sets(runs)['estimates'].panels[0]
    assert list(panel.rows) == ['gvc']
    assert list(different_disturbances(runs)) == ['gvc']


def test_many_lines_are_thinned_to_a_budget_and_keep_their_extremes(case1, monkeypatch):
    monkeypatch.setattr(page, 'POINTS', 1_000)
    found = interactive(case1)
    index, content = json.loads(_inflated(found.index)), _inflated(found.data)
    line = index['panels']['tau-linear']['lines'][2]
    axis = index['axes'][line['axis']]
    assert axis['count'] <= 2 * page.FEWEST
    values = _values(content, line['at'], axis['count'])
    assert np.abs(values).max() == pytest.approx(case1['gvc'].part('tau').peak[2], rel=2.0**-16)
    assert len(found.data) < len(_data(case1, monkeypatch))


def _data(runs: dict[str, Sketch], monkeypatch) -> str:
    monkeypatch.undo()
    return interactive(runs).data


def test_packed_content_comes_back():
    assert _inflated(packed(b'abc' * 100)) == b'abc' * 100
