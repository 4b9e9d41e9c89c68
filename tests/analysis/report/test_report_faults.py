"""Faults in a report: words in the set-up, spans and numbers in figures and panels, a section."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace as Made

import numpy as np
import pyarrow.parquet as parquet
import pytest
import yaml
from helpers.report_pages import Page, check_numbers

from auv_analysis import simulate, summarize
from auv_analysis.cli import main
from auv_analysis.report import plots
from auv_analysis.report.digest import digests
from auv_analysis.report.document import NUMBERS
from auv_analysis.report.faults import _panel, _rise, fault_overview, fault_part
from auv_analysis.report.panels import interactive
from auv_analysis.report.scenario_text import set_up
from auv_analysis.runs.run import Run
from auv_analysis.scenario.fault_words import Mark
from auv_analysis.scenario.scenario import load_scenario

FAULTS = [
    {'kind': 'thruster', 'thruster': 2, 'efficiency': 0.5, 'from': 1.0, 'to': 2.0},
    {'kind': 'sensor_drop_out', 'probability': 0.25, 'from': 1.5, 'to': 1.8},
    {'kind': 'wrench_loss', 'from': 2.5},
]
DATA = {
    'name': 'failing',
    'vehicle': 'bluerov2_heavy',
    'duration': 4.0,
    'step': 0.01,
    'controllers': {
        'gvc': {'law': 'gvc', 'k_D': 5.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 5.0},
        'slow': {'law': 'gvc', 'k_D': 2.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 5.0},
    },
    'setpoint': {'surge': {'offset': 0.3}, 'yaw': {'offset': 0.1}},
    'actuators': {'thrusters': True},
    'faults': FAULTS,
}
TEXT = yaml.safe_dump(DATA, sort_keys=False)


@pytest.fixture(scope='module')
def runs(tmp_path_factory) -> dict[str, Run]:
    path = tmp_path_factory.mktemp('failing') / 'failing.yaml'
    path.write_text(TEXT, encoding='utf-8')
    scenario = load_scenario(path)
    return {name: simulate(scenario, name, 'zoh') for name in scenario.controllers}


@pytest.fixture(scope='module')
def folder(tmp_path_factory, composing) -> Path:
    root = tmp_path_factory.mktemp('report')
    (root / 'failing.yaml').write_text(TEXT, encoding='utf-8')
    arguments = ['simulate', str(root / 'failing.yaml'), '--hold', 'zoh', '--out']
    with composing(panels=True):
        main.main([*arguments, str(root / 'out')])
    return root / 'out'


def test_all_that_it_shows(folder, approved):
    approved.folder(folder, panels=True)


def test_the_set_up_says_every_fault(runs):
    summaries = {name: summarize(run) for name, run in runs.items()}
    bare = replace(runs['gvc'].vehicle, thrusters=None)
    others = {'other': replace(runs['gvc'], scenario='another', vehicle=bare), **runs}
    rows = dict(set_up(others, summaries | {'other': summaries['gvc']}, TEXT).rows)
    assert rows['faults'] == [
        'thruster T3 at 50 %, 1–2 s',
        '25 % of the measurements lost, 1.5–1.8 s',
        'wrenches lost, from 2.5 s on',
    ]
    assert rows['sensors'] == ['perfect: the law sees the true state; but for the faults']
    assert rows['actuators'][-1].endswith('; but for the faults')
    assert rows['seed'] == ['0']


def test_spans_and_numbers_of_a_figure(runs):
    digest = digests(runs)['gvc']
    with plots.style():
        axes = plots.new_figure(2.0).subplots()
        axes.set_xlim(0.0, 2.2)
        plots.shade(axes, digest)
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]
    assert spans == [(1.0, 2.0), pytest.approx((1.5, 1.8))]
    assert [(text.get_text(), text.get_position()[0]) for text in axes.texts] == [
        ('1', 1.5), ('2', pytest.approx(1.65))
    ]  # fmt: skip
    assert all(text.get_transform() == axes.get_xaxis_transform() for text in axes.texts)
    high = [text.get_position()[1] for text in axes.texts]
    assert high[1] < high[0], 'two at one time stand below each other'
    assert axes.get_xlim() == (0.0, 2.2)
    for limits, seen in (((2.2, 2.6), ['3']), ((2.0, 2.5), [])):
        axes.clear()
        axes.set_xlim(limits)
        plots.shade(axes, digest)
        assert [text.get_text() for text in axes.texts] == seen, 'not those before and behind'
    sentence = plots.shade_sentence(digest)
    assert sentence.startswith(' Shaded: 1 thruster T3 at 50 %, 1–2 s; 2 25 % of the meas')


def test_a_gap_beyond_what_is_shown_does_not_widen_the_axis(runs):
    with plots.style():
        axes = plots.new_figure(2.0).subplots()
        axes.plot([0.0, 1.0], [0.0, 1.0])
        limits = axes.get_xlim()
        plots.shade(axes, replace(digests(runs)['gvc'], gaps=((3.0, 3.5),)))
    assert axes.get_xlim() == limits


def test_a_band_around_errors_that_keep_inside_is_in_sight(runs):
    with plots.style():
        axes = plots.new_figure(2.0).subplots()
        _panel(axes, digests(runs), 0, 5.0)
    assert axes.get_ylim() == pytest.approx((1.1 * -6.0, 1.3 * 6.0))


def test_panels_are_shaded_where_all_runs_have_the_same_faults(runs, folder, unrendered):
    page = (folder / 'report.html').read_text(encoding='utf-8').replace('\u00a0', ' ')
    assert re.search(r'<p class="faults">Shaded: 1 .*; 3 wrenches lost, from 2.5 s on\.</p>', page)
    shown = digests(runs)
    other = replace(shown['slow'], faults=())
    assert interactive({'gvc': shown['gvc'], 'slow': other}).faults == ''


def test_every_number_of_the_section_is_in_the_file(folder):
    rows = parquet.read_table(folder / NUMBERS).to_pylist()
    shown = [row for row in rows if row['table'].startswith('faults_')]
    assert {row['table'] for row in shown} == {'faults_1', 'faults_2', 'faults_3'}
    assert check_numbers(folder) > len(shown) > 100


def _response(number: int, dof: str, before: float | None, during: float | None, **about) -> Made:
    mark = Mark(number, 'x', f'fault {number}', 1.0 * number, 2.0 * number)
    usual = {'band': 0.1, 'recovery': 0.5, 'until': 9.0, 'peak': (1.0, 20.0 + number, 3.0)}
    return Made(mark=mark, dof=dof, rms=(before, during, None), **usual | about)


@pytest.mark.parametrize(
    ('before', 'during', 'bands'), [(0.1, 0.5, 4.0), (None, 0.5, 5.0), (0.1, None, -1.0)]
)
def test_how_much_a_fault_adds_to_an_error(before, during, bands):
    assert _rise(_response(1, 'surge', before, during)) == pytest.approx(bands)


def test_the_fault_that_disturbs_most_is_told():
    found = {
        'gvc': [
            _response(1, 'surge', 0.1, 0.5), _response(1, 'yaw', 0.2, 0.9),
            _response(2, 'sway', 1.0, 1.2, recovery=None), _response(2, 'roll', 0.0, 0.3),
            _response(3, 'roll', 0.0, None, until=None),
        ],
        'cl': [_response(1, 'surge', None, 0.3, until=None, peak=(0, 7.0, 0))],
        'idle': [_response(1, 'surge', None, None)],
    }  # fmt: skip
    assert [sentence.text for sentence in fault_overview(found)] == [
        'The fault that disturbs gvc most is number 1 (fault 1, 1–2 s): up to 21 rad/s in yaw; '
        'after 1 of the 2 that end every error comes back into its settling band before anything '
        'else changes.',
        'The fault that disturbs cl most is number 1 (fault 1, 1–2 s): up to 7.0 m/s in surge.',
    ]
    calm = [_response(1, 'yaw', 0.2, 0.9, band=10.0), _response(1, 'surge', 0.1, 0.5)]
    assert 'in surge' in next(fault_overview({'gvc': calm})).text, 'in bands, not in rad/s'


def test_the_section_and_its_sentences_are_on_the_page(folder):
    text = (folder / 'report.html').read_text(encoding='utf-8')
    page = Page(text)
    assert 'faults' in page.ids
    assert len(page.tables['faults_1']) == 12
    for words in ('Fault 1: thruster T3 at 50 %', 'The fault that disturbs gvc most', 'Shaded: '):
        assert words in text.replace('\u00a0', ' '), words
    assert (folder / 'figures' / 'faults.pdf').is_file()


def test_runs_with_other_faults_share_no_section(runs, tmp_path):
    other = replace(runs['slow'], faults=())
    assert fault_part(tmp_path, {'gvc': runs['gvc'], 'slow': other}) is None
    assert fault_part(tmp_path, {'slow': other}) is None, 'without any'
    assert not list(tmp_path.iterdir())


def test_runs_of_which_one_has_no_set_point_have_no_responses_to_compare(runs, tmp_path):
    aimless = replace(runs['slow'], nu_d=np.full_like(runs['slow'].nu_d, np.nan))
    section, sentences = fault_part(tmp_path, {'gvc': runs['gvc'], 'slow': aimless})
    assert (len(section.blocks), sentences) == (1, [])
