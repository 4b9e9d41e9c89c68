"""Panels of a report: every controller's lines on one time axis, and what they leave out."""

import base64
import gzip
import json
import zlib
from dataclasses import replace

import numpy as np
import pytest

from auv_analysis import load_scenario, simulate
from auv_analysis.report import panels as page
from auv_analysis.report.digest import RunDigest, digests
from auv_analysis.report.panels import (
    different_disturbances,
    document,
    interactive,
    packed,
    panel_sets,
)
from auv_dynamics.vehicle import DOFS


@pytest.fixture(scope='module')
def case1() -> dict[str, RunDigest]:
    scenario = load_scenario('case1')
    runs = {name: simulate(scenario, name) for name in scenario.controllers}
    return digests({name: run.part(run.t <= 5.0) for name, run in runs.items()})


def test_all_figures_of_a_page_share_one_time_axis_and_cursor(case1):
    content, roots = json.loads(zlib.decompress(base64.b64decode(interactive(case1).data)))
    text = json.dumps(content)
    assert len(roots) == sum(len(one.panels) for one in panel_sets(case1).values())
    ranges = {json.dumps(root['attributes']['x_range']) for root in content['roots'][1:]}
    assert len(ranges) == 1
    assert text.count('"name": "CrosshairTool"') == 1
    assert text.count('"name": "HoverTool"') > 10


def test_lines_of_a_panel_are_those_of_the_sketches(case1):
    (panel, _) = panel_sets(case1)['inputs'].panels
    assert [(curve.run, curve.dof) for curve in panel.curves] == [
        (name, dof) for name in case1 for dof in DOFS[:3]
    ]
    run, curve = case1['cl'], panel.curves[5]
    ends = [run.line('tau', 2, part) for part in ('early', 'late')]
    wanted = [np.concatenate(parts) for parts in zip(*ends, strict=True)]
    assert np.array_equal([curve.t, curve.y], wanted)


def test_every_section_has_panels_with_all_controllers(case1):
    sets = panel_sets(case1)
    assert list(sets) == ['errors', 'estimates', 'inputs', 'certificates', 'energy', 'couplings']
    panels = {panel.name: panel for members in sets.values() for panel in members.panels}
    assert {curve.run for curve in panels['error-linear'].curves} == {'gvc', 'cl'}
    assert {curve.run for curve in panels['F-linear'].curves} == {'gvc'}
    assert {panel.kind for panel in panels.values()} == {'line', 'log', 'stack'}
    assert sets['errors'].stands_for('errors_gvc')
    assert not sets['errors'].stands_for('settling')
    assert sets['inputs'].stands_for('inputs_compared')


def test_energies_of_xi_add_up_to_the_kinetic_energy(case1):
    panels = {panel.name: panel for panel in panel_sets(case1)['energy'].panels}
    lines = [
        curve.y
        for name in ('energy-linear', 'energy-angular')
        for curve in panels[name].curves
        if curve.run == 'gvc'
    ]
    assert np.sum(lines, axis=0) == pytest.approx(case1['gvc'].line('kinetic')[1], rel=1e-12)


def test_structural_zeros_and_unknown_disturbances_have_no_panel(case1):
    panels = panel_sets(case1)['couplings'].panels
    assert [panel.name for panel in panels] == [
        'delta_xi-linear', 'delta_xi-angular', 'delta_pi-angular',
    ]  # fmt: skip
    assert {curve.dof for curve in panels[1].curves} == {DOFS[3]}
    bare = {
        name: replace(
            run, F_digest=b'', columns={k: v for k, v in run.columns.items() if k != 'lumped_error'}
        )
        for name, run in case1.items()
    }
    assert not any(
        panel.name.startswith('lumped') for panel in panel_sets(bare)['estimates'].panels
    )


def test_a_controller_that_estimates_nothing_has_no_lumped_error(case1):
    runs = {'gvc': case1['gvc'], 'cl': replace(case1['cl'], estimates=False)}
    panel = panel_sets(runs)['estimates'].panels[0]
    assert {curve.run for curve in panel.curves} == {'gvc'}
    assert list(different_disturbances(runs)) == ['gvc']


def shown(runs: dict[str, RunDigest]) -> str:
    """Bokeh's JSON of the panels of errors."""
    panels = panel_sets(runs)['errors'].panels
    return json.dumps(document(panels, {'gvc': [], 'cl': []}, (), (0.0, 5.0))[0])


def test_many_lines_are_thinned_to_a_budget(case1, monkeypatch):
    whole = len(packed(shown(case1)))
    monkeypatch.setattr(page, 'POINTS', 1_000)
    monkeypatch.setattr(page, 'FEWEST', 50)
    assert len(packed(shown(case1))) < 0.8 * whole


def test_lines_break_where_there_are_no_samples(case1):
    gap = {name: replace(run, gaps=((1.0, 2.0),)) for name, run in case1.items()}
    content = json.loads(shown(gap))
    arrays = []

    def visit(value):
        if isinstance(value, dict):
            if value.get('type') == 'ndarray':
                data = base64.b64decode(value['array']['data'])
                arrays.append(np.frombuffer(gzip.decompress(data), value['dtype']))
            for entry in value.values():
                visit(entry)
        elif isinstance(value, list):
            for entry in value:
                visit(entry)

    visit(content)
    assert any(np.isnan(array).any() for array in arrays)
