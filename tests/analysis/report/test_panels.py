"""Panels of a report: every controller's lines on one time axis, and what they leave out."""

import base64
import json
import zlib
from dataclasses import replace
from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers.shown import panel_lines

from auv_analysis import load_scenario, simulate
from auv_analysis.report import panels as page
from auv_analysis.report.digest import RunDigest, digests
from auv_analysis.report.panels import (
    TimeCurve,
    TimePanel,
    different_disturbances,
    interactive,
    packed,
    panel_sets,
)
from auv_dynamics.vehicle import DOFS

pytestmark = pytest.mark.usefixtures('approved')


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


def test_every_section_has_panels_with_all_controllers(case1):
    sets = panel_sets(case1)
    assert list(sets) == ['errors', 'estimates', 'inputs', 'certificates', 'energy', 'couplings']
    panels = {panel.name: panel for members in sets.values() for panel in members.panels}
    assert {curve.run for curve in panels['error-linear'].curves} == {'gvc', 'cl'}
    assert {curve.run for curve in panels['F-linear'].curves} == {'gvc'}
    assert {panel.kind for panel in panels.values()} == {'line', 'log', 'stack'}
    names = [
        'errors_a',
        'settling',
        'lumped_error_a',
        'F_variance_a',
        'uncertainty_a',
        'inputs_a',
        'certificate_a',
        'kinetic_energy',
        'energy_shares',
        'delta_xi',
        'delta_pi',
    ]
    assert {part: [*filter(one.stands_for, names)] for part, one in sets.items()} == {
        'errors': ['errors_a'], 'estimates': ['lumped_error_a', 'uncertainty_a'],
        'inputs': ['inputs_a'], 'certificates': ['certificate_a'], 'energy': ['kinetic_energy'],
        'couplings': ['delta_xi', 'delta_pi'],
    }  # fmt: skip


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
    return json.dumps(page.document(panels, {'gvc': [], 'cl': []}, (), (0.0, 5.0))[0])


def test_many_lines_are_thinned_to_a_budget(case1, monkeypatch):
    whole = len(packed(shown(case1)))
    monkeypatch.setattr(page, 'POINTS', 1_000)
    monkeypatch.setattr(page, 'FEWEST', 50)
    assert len(packed(shown(case1))) < 0.8 * whole


def test_a_line_with_more_than_two_points_in_a_column_is_thinned(monkeypatch):
    monkeypatch.setattr(page, '_columns', lambda _: 100)
    curves = (
        TimeCurve('gvc', f'{n}', page.INK, np.arange(1.0, n + 1.0), np.arange(n) % 7.0)
        for n in (200, 201)
    )
    found = page.document([TimePanel('p', 'T', 'l', (*curves,))], {'gvc': []}, (), (1.0, 9.0))
    few, many = (line for line in panel_lines(found) if line.startswith('  Line'))
    assert '200 evenly 1 to 200' in few
    assert ': 201' not in many


@pytest.mark.parametrize(
    ('lengths', 'columns'),
    [((600, 400), 600), ((600, 401), 299), ((600, 500, 600), 176), ((600,) * 6, 100), ((), 100)],
)
def test_lines_are_as_fine_as_all_of_them_allow(monkeypatch, lengths, columns: int) -> None:
    monkeypatch.setattr(page, 'POINTS', 1_000)
    monkeypatch.setattr(page, 'FEWEST', 100)
    panels = [Made(curves=[Made(t=range(n))]) for n in lengths]
    assert page._columns(panels) == columns
