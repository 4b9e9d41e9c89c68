"""The report on uncertain plants, devices, laws without an estimate, and the certificate."""

import re
from dataclasses import replace
from html import unescape
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from helpers.certificates import certificate_of
from helpers.made_runs import made

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.herman2018.claims import judge_runs
from auv_analysis.herman2018.paper import paper_figures
from auv_analysis.report import plots, run_plots
from auv_analysis.report.digest import digest, digests
from auv_analysis.report.run_report import write_report
from auv_analysis.report.run_tables import certificate_table, reasons
from auv_analysis.report.scenario_text import _of_the_runs, _signal, gain_text, harmonics, set_up
from auv_analysis.report.wrench_plots import _rates, certificate_figure
from auv_analysis.runs.run import FOREIGN, Run
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import control_model

DATA = {
    'name': 'rough',
    'vehicle': 'rexrov',
    'duration': 5.0,
    'step': 0.01,
    'seed': 3,
    'controllers': {
        'gvc': {'law': 'gvc', 'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0},
        'wound': {
            'law': 'gvc', 'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0,
            'anti_windup': False,
        },
        'pid': {'law': 'pid', 'k_P': 5000.0, 'k_I': 100.0, 'k_D': 10.0},
    },
    'setpoint': {
        'surge': {'offset': 0.2, 'terms': [{'amplitude': -1.0, 'omega': 0.157, 'phase': 0.5}]},
        'yaw': {'terms': [{'amplitude': 0.1, 'omega': 0.2}]},
    },
    'disturbance': [
        {'kind': 'herman2018', 'exponent_sign': -1, 'scale': 2},
        {'kind': 'model_error', 'mass': 0.05, 'added_mass': -0.2, 'damping': 0.3},
        {'kind': 'current', 'velocity': [0.3, 0.1, 0.0]},
    ],
    'actuators': {
        'limit': [3000, 3000, 4000, 800, 800, 500], 'rate': 20000, 'lag': 0.05, 'delay': 0.02,
    },
    'sensors': {'velocity_noise': 0.002, 'attitude_noise': 0.001, 'drop_out': 0.1},
}  # fmt: skip


def _study(folder: Path, hold='zoh', **changes) -> tuple[dict[str, Run], dict, str]:
    """Runs, summaries and text of the scenario above with some entries replaced; None: absent."""
    data = {key: value for key, value in (DATA | changes).items() if value is not None}
    text = yaml.safe_dump(data, sort_keys=False)
    path = folder / 'rough.yaml'
    path.write_text(text, encoding='utf-8')
    scenario = load_scenario(path)
    runs = {name: simulate(scenario, name, hold) for name in scenario.controllers}
    return runs, {name: summarize(run) for name, run in runs.items()}, text


@pytest.fixture(scope='module')
def rough(tmp_path_factory) -> tuple[dict[str, Run], dict, str]:
    return _study(tmp_path_factory.mktemp('rough'))


@pytest.fixture(scope='module')
def case1() -> tuple[dict[str, Run], dict]:
    scenario = load_scenario('case1')
    runs = {name: simulate(scenario, name) for name in scenario.controllers}
    return runs, {name: summarize(run) for name, run in runs.items()}


@pytest.fixture(scope='module')
def page(rough, tmp_path_factory, composing) -> Path:
    """Its report."""
    with composing():
        return write_report(tmp_path_factory.mktemp('page'), *rough, '')


def test_all_that_it_shows(page, approved):
    approved.folder(page.parent)


def _report(out: Path, runs, summaries, text) -> str:
    return write_report(out, runs, summaries, text, '').read_text(encoding='utf-8')


def _text(report: str) -> str:
    body = report[report.index('<body>') : report.index('<script>')]
    plain = unescape(re.sub(r'\s+', ' ', re.sub(r'<[^>]+>', '', body)))
    return plain.replace('\u00a0', ' ').replace('\u202f', '')


def _words(runs, summaries, text) -> dict[str, list[str]]:
    rows = set_up(runs, summaries, text).rows
    return {name: [line.replace('\u202f', '') for line in lines] for name, lines in rows}


def test_set_up_says_every_number_of_the_scenario(rough):
    words = _words(*rough)
    assert words['set-point'] == ['surge 0.2 − 1 sin(0.157 t + 0.5) m/s; yaw 0.1 sin(0.2 t) rad/s']
    assert words['disturbances'] == [
        'kind: herman2018, exponent_sign: -1, scale: 2',
        'kind: model_error, mass: 0.05, added_mass: -0.2, damping: 0.3',
        'kind: current, velocity: [0.3, 0.1, 0.0]',
    ]
    assert words['actuators'] == [
        'limit: [3000, 3000, 4000, 800, 800, 500], rate: 20000, lag: 0.05, delay: 0.02'
    ]
    assert words['anti-windup'] == ['on for gvc and pid; off for wound']
    renamed = [{f'x_{name}': entry for name, entry in one.items()} for one in rough[:2]]
    told = _words(*renamed, rough[2])['anti-windup']
    assert told == ['on for x_gvc and x_pid; off for x_wound'], 'as runs of two folders are'
    assert words['sensors'] == ['velocity_noise: 0.002, attitude_noise: 0.001, drop_out: 0.1']
    assert words['seed'] == ['3']
    assert any('symmetrised' in line for line in words['warnings'])
    assert not any('/' in line.partition(': ')[0] for line in words['warnings']), 'no folders'
    assert list(set_up(*rough).limit) == DATA['actuators']['limit']


def test_gains_are_short_where_they_can_be() -> None:
    assert gain_text(2.5) == '2.5 I'
    assert gain_text([1, 2, 3, 4, 5, 6]) == 'diag(1, 2, 3, 4, 5, 6)'
    assert gain_text((np.eye(6) + np.eye(6, k=1)).tolist()) == 'full matrix, in the listing'


SCENARIOS: dict[str, dict] = {
    'ideal': {'actuators': None, 'sensors': None, 'disturbance': [], 'integrator': 'rk4'},
    'from a start': {'initial': {'nu': [0.1, 0, 0, 0, 0, 0]}, 'seed': None},
    'open loop': {'excitation': {'surge': {'terms': [{'amplitude': 9, 'omega': 2, 'phase': -1}]}}},
    'read': {'setpoint': {'file': 'x.csv'}, 'excitation': {'yaw': {'offset': 0.0}}},
    'thrusters': {'actuators': {'thrusters': True}, 'setpoint': {'heave': {'offset': 0.0}}},
    'slow': {'actuators': {'lag': 0.1}, 'disturbance': {'kind': 'current', 'velocity': [1, 0, 0]}},
    'faulty': {'faults': [
        {'kind': 'sensor_delay', 'delay': 0.1, 'from': 1.0, 'to': 2.0},
        {'kind': 'wrench_loss', 'from': 3.0},
    ]},
    'one limit': {
        'actuators': {'limit': 500},
        'disturbance': {'kind': 'harmonic', **{dof: {'offset': 10.5} for dof in DOFS}},
    },
    'delayed': {'faults': [{'kind': 'sensor_delay', 'delay': 0.1, 'from': 1.0, 'to': 2.0}]},
}  # fmt: skip


def test_what_is_said_of_each_scenario(rough, approved):
    runs, summaries, _ = rough
    others = runs | {
        'gvc': replace(runs['gvc'], hold='continuous'),
        'pid': replace(runs['pid'], source=FOREIGN),
    }
    for name, changes in SCENARIOS.items():
        data = {key: value for key, value in (DATA | changes).items() if value is not None}
        text = yaml.safe_dump(data, sort_keys=False)
        found = set_up(others if name == 'slow' else runs, summaries, text)
        approved.add([f'{name}: {found.name}, {found.limit}'])
        approved.add([f'  {what}: {line}' for what, lines in found.rows for line in lines])


def test_set_up_of_ideal_devices(tmp_path):
    words = _words(
        *_study(
            tmp_path,
            duration=0.1,
            controllers={'gvc': DATA['controllers']['gvc']},
            actuators=None,
            sensors=None,
            disturbance=[{'kind': 'harmonic', 'sway': {'offset': -4.0}}],
        )
    )
    assert words['disturbances'] == ['kind: harmonic, sway: {offset: -4.0}']
    assert words['actuators'] == ['ideal: the commanded wrench is the applied one']
    assert words['sensors'] == ['perfect: the law sees the true state']
    assert 'anti-windup' not in words


def test_gains_too_fast_for_the_step_are_warned_of_in_sampled_runs_only(rough):
    runs, summaries, text = rough
    fast = {name: run for name, run in runs.items() if name == 'pid'}
    fast['pid'] = replace(fast['pid'], step=0.5)
    for told in ('pid: lambda_max', "pid: the law's own states"):
        assert any(told in line for line in _words(fast, summaries, text)['warnings']), told
    inside = {'pid': replace(fast['pid'], hold='continuous')}
    words = _words(inside, summaries, text)
    assert not [line for line in words.get('warnings', []) if 'lambda_max' in line]


@pytest.mark.parametrize('text', ['', 'a: 1', '- 1', 'name: [', 'other'])
def test_set_up_without_the_scenario_file_says_what_the_runs_say(rough, text):
    runs, summaries, original = rough
    text = original.replace('name: rough', 'name: other') if text == 'other' else text
    scene = set_up(runs, summaries, text)
    assert scene.name == ''
    assert scene.limit is None
    words = _words(runs, summaries, text)
    assert words['gvc'] == [
        'disturbances current, herman2018 and model_error; the actuators are not ideal; '
        'the law sees measurements'
    ]


def test_report_of_a_rough_scenario(page):
    text = _text(page.read_text(encoding='utf-8'))
    for sentence in (
        'Set-up of rough',
        'commanded τ (thin, grey)',
        'Dotted: axis limits',
        'The law saw measured velocities; these errors are those of the true ones.',
        'The actuators deliver at most',
        'commanded input τ',
        'Of the commanded wrench.',
        'Kf of pid is zero (no adaptive term)',
        'Velocity gain K_D of gvc and wound',
        'omega_f = 20 I (default)',
        'F contains model error and current and so depends on the motion of this very run.',
        'no certificate of the law pid is known',
        '(26) is the derivative of L in none of these runs, so nothing is drawn.',
    ):
        assert sentence in text, sentence
    assert not list((page.parent / 'figures').glob('certificate_*'))
    assert 'None' not in text
    assert not re.search(r'\bnan\b', text)


def test_a_law_that_estimates_nothing_has_no_estimation_error(page):
    drawn = {path.stem for path in (page.parent / 'figures').glob('*.png')}
    assert {'lumped_error_gvc', 'uncertainty_pid'} <= drawn
    assert 'lumped_error_pid' not in drawn
    text = _text(page.read_text(encoding='utf-8'))
    assert 'estimation error, pid: the law estimates nothing; w is −F, no error of an' in text
    assert 'Under pid nothing is estimated' in text


def test_a_plant_with_devices_is_not_the_papers(case1):
    runs, summaries = case1
    assert len(judge_runs(runs, summaries)) == 21
    for change in (
        {'applied': runs['gvc'].tau},
        {'measured': runs['gvc'].nu},
        {'kinds': frozenset({'herman2018', 'current'})},
    ):
        changed = {name: replace(run, **change) for name, run in runs.items()}
        assert judge_runs(changed, summaries) == []
        assert paper_figures(changed['gvc']) == []


def test_every_reason_against_a_certificate_is_given_once(rough):
    found = reasons(rough[1])
    assert len(found) == len(set(found)) == 4
    assert sum('of gvc, wound and pid' in text for text in found) == 3
    assert sum('of pid:' in text for text in found) == 1
    table = certificate_table(rough[1])
    assert table.rows[0][3].text == '–'


def test_certificate_arrays_are_those_of_the_summary(case1):
    for name, run in case1[0].items():
        found = certificate_of(run, control_model(run.vehicle))
        figures = case1[1][name]['lyapunov']
        assert found.L[-1] == figures['L_last']
        assert np.linalg.norm(found.w, axis=1).max() == figures['sup_w']
    run = case1[0]['gvc']
    for change in ({'law': 'smc'}, {'gains': {}}, {'disturbance': None}):
        assert certificate_of(replace(run, **change), control_model(run.vehicle)) is None


def test_a_certificate_is_drawn_of_what_it_is_about(case1):
    run = case1[0]['gvc'].part(slice(0, 50))
    unknown = np.full_like(run.nu, np.nan)
    for change, there in (
        ({}, True), ({'law': 'pid'}, False), ({'gains': {}}, False), ({'disturbance': None}, False),
        ({'measured': run.nu}, False), ({'applied': run.tau}, False), ({'tau': unknown}, False),
        ({'nu': unknown}, False),
    ):  # fmt: skip
        traces = {name for name, _ in digest(replace(run, **change)).traces}
        assert traces & {'L', 'bound'} == ({'L', 'bound'} if there else set()), change


def test_a_line_of_L_begins_where_it_is_not_zero():
    run = made('gvc', 'gvc', 1)
    run.nu[0], run.law_state[0], run.disturbance_estimate[0] = run.nu_d[0], 0.0, run.disturbance[0]
    t, L = digest(run).line('L')
    assert t.tolist() == run.t[1:].tolist()
    assert L.min() > 0.0


def test_certificate_figure_says_what_it_rests_on(case1, approved):
    run, summary = case1[0]['gvc'], case1[1]['gvc']
    with plots.style():
        figure, _, caption = certificate_figure(digest(run), summary)
        sampled = certificate_figure(digest(replace(run, hold='zoh')), summary)[2]
        short = certificate_figure(digest(run.part(run.t <= 3.0)), summary)[2]
    approved.add([caption, sampled, short])
    assert [axes.get_yscale() for axes in figure.axes] == ['log', 'symlog', 'symlog']
    assert 'linear between them and logarithmic beyond' in caption
    assert 'Grey: where (26) is positive' in caption
    assert 'The certificate does not apply' not in caption
    assert [('held between samples' in text) for text in (caption, sampled)] == [False, True]


def test_certificate_is_drawn_where_26_holds_along_solutions_and_says_so(tmp_path, unrendered):
    changes = {
        'duration': 1.0,
        'controllers': {name: DATA['controllers'][name] for name in ('wound', 'pid')},
        'disturbance': [{'kind': 'herman2018'}, {'kind': 'model_error', 'mass': 0.1}],
        'actuators': None,
        'sensors': None,
    }
    runs, summaries, text = _study(tmp_path, hold='continuous', **changes)
    words = _text(_report(tmp_path / 'report', runs, summaries, text))
    drawn = {path.stem for path in (tmp_path / 'report/figures').glob('certificate_*.png')}
    assert drawn == {'certificate_wound'}
    assert 'The certificate does not apply here: F contains model_error' in words
    assert 'an identity and no proof that L decreases' in words
    assert 'first order in the step' not in words


def test_certificate_figure_of_next_to_nothing(case1):
    run, summary = case1[0]['gvc'], case1[1]['gvc']
    two = run.part(run.t <= 0.015)
    title = 'Certificate, gvc'
    found = certificate_figure(digest(two), summary)
    assert found == (None, title, f'{title}: too little to draw.')
    assert certificate_figure(digest(run.part(run.t <= 0.025)), summary)[0], 'three samples'


@pytest.mark.parametrize(
    ('part', 'first', 'bound', 'linear'),
    [
        ('early', 9.0, 50.0, None), ('early', 9.0, 51.0, 10.0), ('early', 1e7, 0.0, 100.0),
        ('late', 400.0, 1e4, 1000.0), ('late', 5.0, 1e7, 100.0),
    ],
)  # fmt: skip
def test_rates_have_a_linear_part_for_what_is_left_of_a_peak(part, first, bound, linear) -> None:
    """5 W in the last quarter of the first phase; of the rest all but the bound, 1e-5 at least."""
    t, signals = np.arange(9.0), dict.fromkeys(('L_dot', 'increasing'), np.zeros(9))
    signals['identity'] = np.array([first, 0.0, 0.0, 0.0, 0.0, 0.0, -5.0, 1.0, 1.0])
    signals['bound'] = np.array([-bound, *[0.0] * 8])
    axes = plots.new_figure(2.0).subplots()
    run = SimpleNamespace(line=lambda name, column, part: (t, signals[name]))
    assert _rates(axes, run, part) is (linear is not None)
    assert getattr(axes.yaxis.get_transform(), 'linthresh', None) == linear


def test_axes_that_are_called_logarithmic_are(case1):
    runs = case1[0]
    with plots.style():
        shares, _, caption = run_plots.energy_shares(digests(runs))
        assert 'logarithmic axis' in caption
        assert shares.axes[0].get_xscale() == 'log'
        slight = replace(runs['gvc'], nu=runs['gvc'].nu * [1.0, 1.0, 1.0, 1.0, 1.0, 1e-6])
        shares, _, _ = run_plots.energy_shares(digests({'gvc': slight}))
        assert shares.axes[0].get_xlim()[0] == 1e-6, 'no further'
        pushed = replace(runs['gvc'], tau=-np.abs(runs['gvc'].tau))
        inputs, _, _ = run_plots.inputs(digests({'gvc': pushed}))
        assert {axes.get_xscale() for axes in inputs.axes} == {'log'}


def test_runs_that_are_far_apart_share_a_scale_on_which_both_show(case1):
    gvc, cl = case1[0]['gvc'], case1[0]['cl']
    with plots.style():
        near, _, told = run_plots.inputs(digests({'gvc': gvc, 'cl': gvc}))
        apart = digests({'gvc': gvc, 'cl': replace(cl, tau=1000.0 * cl.tau)})
        far, _, told_far = run_plots.inputs(apart)
    assert {axes.get_yscale() for axes in near.axes} == {'linear'}
    assert far.axes[2].get_yscale() == 'symlog'
    assert 'dotted lines' not in told
    assert 'dotted lines' in told_far


def test_report_follows_the_readers_colour_scheme(page):
    style = re.search(r'<style>(.*?)</style>', page.read_text(encoding='utf-8'), re.DOTALL)[1]
    assert style.count('prefers-color-scheme: dark') == 1
    assert '[data-theme="dark"]' in style
    assert 'background: var(--paper)' in style


def test_report_of_laws_without_a_certificate_has_reasons_and_no_empty_table(
    rough, page, tmp_path, undrawn
):
    runs, summaries, text = rough
    only = {'pid': runs['pid']}
    html = _report(tmp_path, only, {'pid': summaries['pid']}, text)
    assert 'id="table-certificate"' not in html
    assert 'no certificate of the law pid is known' in _text(html)
    assert 'id="table-certificate"' in page.read_text(encoding='utf-8')


def test_restless_lines_lie_below_smooth_ones(case1):
    run = case1[0]['gvc']
    noise = np.random.default_rng(1).normal(size=run.tau.shape) * 100.0
    runs = {'smooth': run, 'noisy': replace(run, tau=run.tau + noise, measured=run.nu)}
    with plots.style():
        figure, _, _ = run_plots.inputs(digests(runs))
    for axes in figure.axes:
        smooth, noisy = axes.lines[:2]
        assert 2 < noisy.get_zorder() < smooth.get_zorder() <= 3, 'above the grid, below words'
        assert smooth.get_color() != noisy.get_color()


def test_how_a_law_is_run_is_said_of_those_that_differ() -> None:
    about = {'gains': {'K_D': None}}
    runs = {name: made(name, 'gvc', 1) for name in ('one', 'two')}
    held = {name: replace(run, hold='zoh') for name, run in runs.items()}
    through = {name: replace(run, hold='continuous') for name, run in runs.items()}
    mixed = {'one': held['one'], 'two': through['two']}
    said = [
        dict(set_up(some, dict.fromkeys(some, about), '').rows)['integration']
        for some in (held, through, mixed)
    ]
    assert said[2] == [f'{text} ({name})' for (text,), name in zip(said, runs, strict=False)]
    assert [('sampled' in text, 'every stage' in text) for text in said[2]] == [
        (True, False), (False, True),
    ]  # fmt: skip


def test_a_wave_without_amplitude_has_no_minus() -> None:
    term = {'amplitude': 0.0, 'omega': 2.0}
    assert _signal({'terms': [term, term]}) == '0 sin(2 t) + 0 sin(2 t)'


def test_each_axis_has_its_unit() -> None:
    spec = {dof: {'offset': i + 1.0} for i, dof in enumerate(DOFS)}
    assert harmonics(spec, DOFS, ('N', 'N m')) == (
        'surge 1 N; sway 2 N; heave 3 N; roll 4 N m; pitch 5 N m; yaw 6 N m'
    )


@pytest.mark.parametrize(
    ('kinds', 'acting', 'sensing', 'text'),
    [
        (None, False, False, 'disturbances not known'),
        ((), True, False, 'disturbances none; the actuators are not ideal'),
        (('waves', 'current'), False, True,
         'disturbances current and waves; the law sees measurements'),
    ],
)  # fmt: skip
def test_what_runs_say_themselves(kinds, acting, sensing, text) -> None:
    run = SimpleNamespace(kinds=kinds, acting=acting, sensing=sensing)
    assert _of_the_runs({'gvc': run}) == [('gvc', [text])]
