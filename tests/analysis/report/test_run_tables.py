"""Tables and sentences of a report of runs, from summaries whose numbers are all different."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from helpers import artists
from helpers.made_runs import DOFS, SAMPLES, STEP, UPSILON, UPSILON_INV, VEHICLE, made

from auv_analysis import summarize
from auv_analysis.report import run_tables as tables
from auv_analysis.report.digest import digests
from auv_analysis.report.document import Gallery
from auv_analysis.report.panels import panel_sets
from auv_analysis.report.run_plots import draw_figures
from auv_analysis.report.run_report import (
    NO_CERTIFICATE,
    NO_F,
    SectionInputs,
    _apart,
    _is_noise,
    _listings,
    findings,
    namesakes,
)
from auv_analysis.report.scenario_text import set_up
from auv_analysis.report.wrench_plots import estimate_finding
from auv_analysis.runs.run import Run

pytestmark = pytest.mark.usefixtures('approved')

UNLIKE = {'k_D': [1.0, 2, 3, 4, 5, 6], 'k_I': 2.0, 'Lambda': 0.5, 'Gamma': 7.0}


@pytest.fixture(scope='module')
def runs() -> dict[str, Run]:
    one = made('one', 'cl', 1, faults=(), source='bag')
    two = made('two', 'gvc', 2, faults=(), gains=UNLIKE)
    return {'one': one, 'two': two}


@pytest.fixture(scope='module')
def summaries(runs):
    found = {name: summarize(run) for name, run in runs.items() if name == 'one'}
    found['two'] = summarize(replace(runs['two'], gains=runs['one'].gains))
    return found


def words(table, *columns: int) -> list[tuple[str, ...]]:
    return [tuple(row[i].text for i in columns) for row in table.rows]


def test_controllers_with_their_laws_gains_and_origins(runs) -> None:
    table = tables.controllers_table(runs)
    assert [head.label for head in table.columns] == [
        'controller', 'law', 'gains', 'length', 'step', 'samples', 'origin',
    ]  # fmt: skip
    assert words(table, 0, 1, 3, 4, 5, 6) == [
        ('one', 'cl', '12', '0.05', '241', 'recorded on the node graph'),
        ('two', 'gvc', '12', '0.05', '241', 'simulated in process'),
    ]
    one, two = (row[2].text for row in table.rows)
    assert one == 'k_D = 12 I, k_I = 1 I, Lambda = 0.8 I, Gamma = 60 I'
    assert two.startswith('k_D = diag(1, 2, 3, 4, 5, 6), k_I = 2 I, Lambda = 0.5 I, Gamma = 7 I')
    (untold,) = tables.controllers_table({'x': replace(runs['one'], law='pid', gains={})}).rows
    assert untold[2].text == '', 'neither gains nor defaults'


def test_couplings_say_symbol_rule_and_unit(summaries) -> None:
    table = tables.couplings_table(summaries, '')
    heads = [(head.label, head.unit) for head in table.columns]
    assert heads == [('', ''), ('', ''), ('rule', ''), ('one', ''), ('two', ''), ('unit', '')]
    units = ['m/s'] * 3 + ['rad/s'] * 3 + ['N'] * 3 + ['N m'] * 3
    symbols = [f'{kind}_{i}' for kind in ('Δξ', 'Δπ') for i in range(1, 7)]
    assert words(table, 0, 1, 5) == list(zip(symbols, DOFS * 2, units, strict=True))
    weights = [*(UPSILON_INV - np.eye(6)), *(UPSILON.T - np.eye(6))]
    names = [*'uvwpqr'], [f'τ_{axis}' for axis in 'XYZKMN']
    for k, (row, weight) in enumerate(zip(table.rows, weights, strict=True)):
        rule = row[2].text
        kind = 'delta_pi_max' if k > 5 else 'delta_xi_max'
        assert [c.value for c in row[3:5]] == [
            s['coupling'][kind][k % 6] for s in summaries.values()
        ]
        if k in (5, 6):
            assert rule == 'structural zero'
            continue
        terms = rule.replace('−', '- ').replace('  ', ' ').removeprefix('- ').split(' ')
        assert terms[-1] in names[k > 5]
        found = dict.fromkeys(names[k > 5], 0.0)
        sign = -1.0 if rule.startswith('−') else 1.0
        for term in range(0, len(terms), 3):
            found[terms[term + 1]] = sign * float(terms[term])
            if term + 2 < len(terms):
                sign = -1.0 if terms[term + 2] == '-' else 1.0
        assert list(found.values()) == pytest.approx(weight, rel=0.01, abs=1e-9)


def test_rounding_beside_a_large_entry_is_left_out_of_a_rule() -> None:
    assert tables._linear(np.array([-2e6, 1e-7, 0.5]), ['p', 'q', 'r']).endswith('p + 0.5 r')
    assert tables._linear(np.array([0.0, 1e-7, -0.5]), ['p', 'q', 'r']).endswith('q − 0.5 r')
    assert tables._linear(np.zeros(3), ['p', 'q', 'r']) == '0'


def test_whose_rule_a_coupling_follows_is_said_of_several_vehicles(summaries) -> None:
    captions = [tables.couplings_table(summaries, name).caption for name in ('', 'rov')]
    assert captions[0].endswith('the largest magnitude over the run.')
    assert captions[1].endswith('over the run; the rule is that of rov.')


def test_each_reason_for_no_certificate_is_said_once() -> None:
    told = {'a': None, 'b': 'x; y', 'c': 'y'}
    entries = {n: {'lyapunov': {'applicable': False, 'reason': why}} for n, why in told.items()}
    assert tables.reasons(entries | {'d': {'lyapunov': {'applicable': True}}}) == [
        'No certificate of a: not applicable.',
        'No certificate of b: x.',
        'No certificate of b and c: y.',
    ]


def test_pieces_of_the_couplings_are_those_of_the_run(runs, summaries) -> None:
    table = tables.terms_table('two', summaries['two'])
    run = runs['two']
    assert [(head.label, head.unit) for head in table.columns] == [
        ('', ''), ('of', ''), ('by', ''), ('coefficient', ''), ('times', ''), ('RMS', ''),
        ('max', ''), ('unit', ''), ('part', '%'),
    ]  # fmt: skip
    whole = {'Δξ': UPSILON_INV - np.eye(6), 'Δπ': UPSILON.T - np.eye(6)}
    for row in table.rows:
        kind, i = row[0].text.split('_')
        to, by = DOFS.index(row[1].text), DOFS.index(row[2].text)
        assert to == int(i) - 1
        signal = run.nu if kind == 'Δξ' else run.tau
        weight = whole[kind][to, by]
        piece = weight * signal[:, by]
        assert row[3].value == pytest.approx(weight)
        assert row[4].text == ('uvwpqr'[by] if kind == 'Δξ' else f'τ_{"XYZKMN"[by]}')
        assert row[5].value == pytest.approx(np.sqrt(np.mean(piece**2)))
        assert row[6].value == pytest.approx(np.abs(piece).max())
        assert row[7].text == (('m/s', 'rad/s') if kind == 'Δξ' else ('N', 'N m'))[to // 3]
        deformation = signal @ whole[kind][to]
        part = np.mean(piece * deformation) / np.mean(deformation**2)
        assert row[8].value == pytest.approx(100.0 * part)
    assert len(table.rows) == 30


def test_windows_of_energy(runs, summaries) -> None:
    table = tables.energy_table(summaries)
    assert words(table, 0, 1, 2) == [
        (name, *ends) for name in runs for ends in (('3', '13'), ('3', '15'), ('5', '15'))
    ]
    for row, entry in zip(
        table.rows,
        [w for s in summaries.values() for w in s['kinetic_energy_windows']],
        strict=True,
    ):
        assert [cell.value for cell in row[1:]] == [
            *entry['window'], entry['mean'], *entry['shares_percent'],
        ]  # fmt: skip


def test_gains_are_a_sentence_or_a_matrix(summaries) -> None:
    gains = copy.deepcopy(summaries)
    gains['one']['gains'] = {'K_D': (3.0 * np.eye(6)).tolist(), 'K_f': np.zeros((6, 6)).tolist()}
    said = tables.scalar_gains(gains)
    assert [(one['symbol'], one['controllers'], one['text']) for one in said] == [
        ('K_D', ['one'], '3 I'), ('K_f', ['one'], 'zero (no adaptive term)'),
    ]  # fmt: skip
    info = {name: made(name, 'cl', k) for k, name in enumerate(gains)}
    drawn = {table.name: table for table in tables.gains_tables(info, gains)}
    assert list(drawn) == ['Upsilon', 'N', 'gain_K_D_3', 'gain_K_f_4']
    assert drawn['Upsilon'].caption == f'Υ of {VEHICLE.name}, (4).'
    assert drawn['gain_K_D_3'].caption == 'Velocity gain K_D of two in the body frame.'
    assert drawn['gain_K_f_4'].caption == 'Adaptation gain K_f of two in the body frame.'
    for name, values in (
        ('Upsilon', summaries['one']['decomposition']['Upsilon']),
        ('gain_K_D_3', summaries['two']['gains']['K_D']),
        ('gain_K_f_4', summaries['two']['gains']['K_f']),
    ):
        assert words(drawn[name], 0) == [(dof,) for dof in DOFS]
        assert [[cell.value for cell in row[1:]] for row in drawn[name].rows] == values
    (row,) = drawn['N'].rows
    assert [cell.value for cell in row[1:]] == summaries['one']['decomposition']['N']


@pytest.mark.parametrize('kind', ['unexplained', 'required_wrench'])
def test_wrenches_that_were_estimated(kind: str) -> None:
    rng = np.random.default_rng(5)
    wrench, error = rng.normal(2.0, 9.0, (SAMPLES, 6)), rng.uniform(1.0, 2.0, (SAMPLES, 6))
    run = made(
        'told', 'gvc', 3, disturbance=None,
        acceleration={'filter': 'polynomials', 'window': [0.5] * 6, 'error_rms': [0.1, 0.2] * 3},
        **{kind: wrench, f'{kind}_error': error},
    )  # fmt: skip
    found = {'told': summarize(run), 'plain': summarize(made('plain', 'cl', 4))}
    other = {'unexplained': 'required_wrench', 'required_wrench': 'unexplained'}[kind]
    assert tables.estimate_table(found, other) is None
    table = tables.estimate_table(found, kind)
    group = 'F by (1)' if kind == 'unexplained' else 'required wrench'
    symbol = 'F' if kind == 'unexplained' else 'it'
    meanings = [head.meaning for head in table.columns if head.label in ('mean', 'RMS', 'max')]
    assert meanings == [
        f'mean of {symbol} over the samples', f'root mean square of {symbol}',
        f'largest magnitude of {symbol}',
    ]  # fmt: skip
    wanted = [
        ((group, 'mean', ''), wrench.mean(axis=0)),
        ((group, 'RMS', ''), np.sqrt((wrench**2).mean(axis=0))),
        ((group, 'max', ''), np.abs(wrench).max(axis=0)),
        ((group, 'error', ''), np.sqrt((error**2).mean(axis=0))),
        (('', 'RMS of τ', ''), np.sqrt((run.tau**2).mean(axis=0))),
        (('rates', 'window', 's'), np.full(6, 0.5)),
        (('rates', 'error', ''), np.array([0.1, 0.2] * 3)),
    ]
    wanted = [one for one in wanted if one[0][1] != 'RMS of τ' or kind == 'unexplained']
    heads = [(head.group, head.label, head.unit) for head in table.columns]
    assert heads == [
        ('', 'controller', ''),
        ('', '', ''),
        *(h for h, _ in wanted),
        ('', 'unit', ''),
    ]
    for i, row in enumerate(table.rows):
        assert [cell.text for cell in row[:2]] == ['told', DOFS[i]]
        assert [cell.value for cell in row[2:-1]] == pytest.approx([v[i] for _, v in wanted])
        assert row[-1].text == ('N', 'N m')[i // 3]
    assert 'Of told over the 100 % of its length' in table.note


def test_components_of_energy_where_the_total_is_not_known() -> None:
    run = made('told', 'gvc', 3, disturbance=None)
    run.nu[:, 0] = np.nan
    summaries = {'whole': summarize(made('w', 'gvc', 4)), 'told': summarize(run)}
    table = tables.components_table(summaries)
    values = summaries['told']['kinetic_energy']['mean_by_component']
    assert words(table, 0, 1) == [('told', dof) for dof in DOFS]
    assert [row[2].value for row in table.rows] == values
    assert table.columns[2].unit == 'J'
    assert tables.components_table({'whole': summaries['whole']}) is None


# sentences


def said(runs, summaries) -> dict[str, list[str]]:
    """Source -> sentences."""
    found: dict[str, list[str]] = {}
    for sentence in findings(digests(runs), summaries):
        found.setdefault(sentence.source, []).append(str(sentence.text))
    return found


def test_findings_of_one_run(runs, summaries) -> None:
    summary = copy.deepcopy(summaries['one'])
    summary['velocity_error'] |= {
        'settling_time': [1.0, 2.5, None, 4.25, 0.0, None],
        'max_after_2s': [0.1, 0.32, 0.2, 0.05, 0.06, 0.041],
    }
    summary['settling'] |= {'residual': [0.01, 0.02, 0.031, 0.04, 0.05, 0.062], 'dwell': 0.6}
    summary['effort']['max'] = [10.0, 900.0, 20.0, 33.3, 31.0, 32.0]
    summary['coupling'] |= {
        'delta_xi_max': [0.1, 0.2, 0.15, 0.011, 0.012, 0.0],
        'delta_pi_max': [0.0, 5.0, 7.0, 80.0, 70.0, 60.0],
    }
    windows = summary['kinetic_energy_windows']
    windows[0]['mean'], windows[1]['mean'], windows[2]['mean'] = 11.111, 22.222, 33.333
    found = said({'one': runs['one']}, {'one': summary})
    metrics = found['table-key_figures']
    assert metrics[:3] == [
        'Under one, heave and yaw do not settle within 12 s: in the last 0.6 s their errors reach '
        '0.031 m/s and 0.062 rad/s.',
        'After 2 s the errors reach at most 0.32 m/s (sway) and 0.060 rad/s (pitch) under one.',
        'The largest commands are 900 N (sway) and 33.3 N m (roll) under one.',
    ]
    assert found['table-energy'] == [
        'The mean kinetic energy of one is 11.11 J over 3–13 s and 22.22 J over 3–15 s.'
    ]
    windows[0]['mean'] = None
    (energy,) = said({'one': runs['one']}, {'one': summary})['table-energy']
    assert energy == 'The mean kinetic energy of one is 22.22 J over 3–15 s.'
    assert found['table-couplings'] == [
        'Inertial coupling deforms, under one, the velocity component of sway by up to 0.20 m/s, '
        'the velocity component of pitch by up to 0.012 rad/s, the input of heave by up to 7.0 N '
        'and the input of roll by up to 80 N m.'
    ]
    summary['velocity_error']['settling_time'] = [1.0, 2.5, 3.125, 2.0, 0.0, 1.0]
    assert said({'one': runs['one']}, {'one': summary})['table-key_figures'][0] == (
        'Under one every velocity error has settled after 3.12 s.'
    )
    summary['velocity_error']['settling_time'][4] = None
    assert (
        'Under one, pitch does not settle within 12 s: in the last 0.6 s its error reaches '
        in (said({'one': runs['one']}, {'one': summary})['table-key_figures'][0])
    )


def test_findings_say_what_is_not_known(runs, summaries) -> None:
    def metrics(**error) -> list[str]:
        summary = copy.deepcopy(summaries['one'])
        summary['settling']['residual'] = error.pop('residual', [0.1] * 6)
        summary['effort']['max'] = error.pop('peaks', [1.0, 3.0, 2.0, None, None, None])
        summary['velocity_error'] |= error
        return said({'one': runs['one']}, {'one': summary})['table-key_figures']

    half = [1.0, 2.0, 0.5, None, None, None]
    late = {'max_after_2s': [None] * 3 + [0.25, 0.5, 0.125]}
    assert metrics(settling_time=None, **late)[:3] == [
        'Of one no set-point is known, and so no error.',
        'After 2 s the errors reach at most 0.50 rad/s (pitch) under one.',
        'The largest commands are 3.00 N (sway) under one.',
    ]
    assert metrics(settling_time=[None] * 6, residual=[None] * 6, max_after_2s=None)[:2] == [
        'Of one no axis has both a set-point and a velocity, and so no error is known.',
        'The largest commands are 3.00 N (sway) under one.',
    ]
    (first, *rest) = metrics(
        settling_time=half, residual=half, max_after_2s=[None] * 6, peaks=[None] * 6
    )
    assert first == 'Under one every velocity error that is known has settled after 2.00 s.'
    assert not any('After 2 s' in text or 'commands' in text for text in rest)


def test_findings_of_energy_and_couplings_where_there_are_none(runs, summaries) -> None:
    one, summary = {'one': runs['one']}, copy.deepcopy(summaries['one'])
    windows, coupling = summary['kinetic_energy_windows'], summary['coupling']
    windows[0]['mean'], windows[1]['mean'] = 11.111, 22.222
    windows[1]['window'] = [windows[0]['window'][0] + 1.0, windows[1]['window'][1]]
    coupling |= {'delta_xi_max': [0.0] * 6, 'delta_pi_max': [None] * 6}
    found = said(one, {'one': summary})
    assert found['table-energy'] == ['The mean kinetic energy of one is 11.11 J over 3–13 s.']
    assert 'table-couplings' not in found
    for window in windows:
        window['mean'] = None
    coupling['structural_zeros'] = {'delta_xi': DOFS, 'delta_pi': DOFS[:5]}
    found = said(one, {'one': summary})
    assert found.keys().isdisjoint(('table-energy', 'table-couplings'))
    coupling['structural_zeros'] = {'delta_xi': DOFS, 'delta_pi': DOFS}
    assert said(one, {'one': summary})['table-couplings'] == [
        'M is diagonal: no degree of freedom is coupled to another by inertia.'
    ]
    lost = replace(runs['one'], nu=runs['one'].nu.copy())
    lost.nu[:, [1, 5]] = np.nan
    (text,) = said({'one': lost}, {'one': summarize(lost)})['table-energy']
    assert text == (
        'Of one no velocity in sway and yaw was recorded: what rests on it, the total kinetic '
        'energy before all, is not known.'
    )


def test_files_are_listed_once_for_the_runs_that_share_them(runs) -> None:
    for texts, listed in (
        ('a', [('File', 'a')]),
        ('', []),
        ({'one': 'a', 'two': 'a'}, [('File', 'a')]),
        ({'one': 'a', 'two': 'b'}, [('File of one', 'a'), ('File of two', 'b')]),
        ({'two': 'b'}, [('File of two', 'b')]),
    ):
        assert _listings(runs, 'File', texts) == listed


@pytest.mark.parametrize('largest', ['first', 'last'])
def test_findings_of_what_the_actuators_left(runs, summaries, largest: str) -> None:
    applied = {n: 0.01 * run.tau[:, :: -1 if largest == 'first' else 1] for n, run in runs.items()}
    acting = {n: replace(run, applied=applied[n]) for n, run in runs.items()}
    ((text,), *_) = [v for k, v in said(acting, summaries).items() if k == 'figure-compared_inputs']
    peaks = [np.abs(applied[n]).max(axis=0) for n in runs]
    expected = '; '.join(
        f'{p[:3].max():.1f} N and {p[3:].max():.1f} N m under {n}'
        for n, p in zip(runs, peaks, strict=True)
    )
    assert text == f'The actuators deliver at most {expected}.'


def test_an_error_within_its_noise_floor_is_said_to_be(runs, summaries) -> None:
    rng = np.random.default_rng(1)
    run = runs['one']
    noise = 0.004 * rng.choice([-1.0, 1.0], (SAMPLES, 6)) * np.linspace(1, 2, 6)
    noise -= noise[-SAMPLES // 3 :].mean(axis=0)
    summary = copy.deepcopy(summaries['one'])
    summary['velocity_error']['settling_time'] = [1.0, None, 1.0, 1.0, 1.0, 1.0]
    summary['settling'] |= {'residual': [0.1] * 6, 'dwell': 0.6}
    still = replace(run, nu=run.nu_d - noise)
    for measured, words_ in ((run.nu, 'the error is within its noise floor of 0.10 m/s in sway, '
                                      'wider than the settling band'),
                             (None, 'sway does not settle within 12 s')):  # fmt: skip
        (text, *_) = said({'one': replace(still, measured=measured)}, {'one': summary})[
            'table-key_figures'
        ]
        assert words_ in text
    drifting = replace(run, nu=run.nu_d - noise + 0.5, measured=run.nu)
    assert 'does not settle' in said({'one': drifting}, {'one': summary})['table-key_figures'][0]
    third = np.arange(SAMPLES - 160)  # the last samples
    for turns, about in ((10, {'measured': run.nu}), (9, {'measured': run.nu}),
                         (10, {'acceleration': {'filter': 'f', 'window': 1.0}})):  # fmt: skip
        waves = np.ones((SAMPLES, 6))
        waves[160:] = 2.0**-8 * (-1.0) ** (third * (turns + 1) // len(third))[:, None]
        (turning,) = digests({'one': replace(run, nu_d=0.0 * waves, nu=waves, **about)}).values()
        assert _is_noise(turning, 1) == (turns == 10)


def test_runs_of_one_name_and_other_set_points_are_told_of(runs) -> None:
    shown = digests(runs)
    assert namesakes([*shown.values()]) == [
        'Not all 2 runs of made have the same set-point: only the name is the same.'
    ]
    other = replace(runs['two'], scenario='other')
    assert namesakes([*digests({'one': runs['one'], 'two': other}).values()]) == []
    same = replace(runs['two'], nu_d=runs['one'].nu_d)
    assert namesakes([*digests({'one': runs['one'], 'two': same}).values()]) == []
    assert STEP == 0.05


def test_what_a_model_leaves_unexplained_in_words() -> None:
    found = {'rms': [1.0, 2.0, 9.0, 4.0, 6.0, 5.0], 'error_rms': [0.1, 0.2, 0.3, 0.4, 0.6, 0.5]}
    effort = {'rms': [10.0, 20.0, 30.0, 40.0, 60.0, 50.0]}
    summary = {'unexplained': found, 'required_wrench': None, 'effort': effort}
    assert estimate_finding('told', summary) == (
        'Of told the model leaves at most 9.00 ± 0.30 N (heave; the wrench has 30.0 N) and '
        '6.00 ± 0.60 N m (pitch; the wrench has 60.0 N m) unexplained, RMS.'
    )
    summary = {'unexplained': None, 'required_wrench': found, 'effort': effort}
    assert estimate_finding('lost', summary) == (
        'The motion of lost needed at most 9.00 ± 0.30 N (heave) and 6.00 ± 0.60 N m (pitch), RMS.'
    )
    assert estimate_finding('bare', {'unexplained': None, 'required_wrench': None}) == ''
    unknown = {'rms': [None] * 6, 'error_rms': [None] * 6}
    assert estimate_finding('bare', {'unexplained': None, 'required_wrench': unknown}) == ''
    half = {'rms': [*[None] * 5, 2.0], 'error_rms': [*[None] * 5, 0.2]}
    assert estimate_finding('half', summary | {'required_wrench': half}) == (
        'The motion of half needed at most 2.00 ± 0.20 N m (yaw), RMS.'
    )


def contents(runs, summaries, folder) -> dict[str, list[str]]:
    """Section -> names of its tables and figures, '' of text, those in a gallery in brackets."""
    shown = {name: replace(run, controller=name) for name, run in digests(runs).items()}
    figures = draw_figures(shown, folder, summaries)
    scenes = {tuple(shown): set_up(shown, summaries, '')}
    of = SectionInputs(shown, summaries, scenes, figures, panel_sets(shown))

    def name(block) -> str:
        if isinstance(block, Gallery):
            return f'[{" ".join(figure.name for figure in block.figures)}]'
        return getattr(block, 'name', '')

    return {section.name: [name(block) for block in section.blocks] for section in of.sections()}


@pytest.mark.usefixtures('unrendered')
def test_each_section_shows_its_own_tables_and_figures(runs, summaries, tmp_path) -> None:
    with artists.undrawn():
        found = contents(runs, summaries, tmp_path)
    assert found == {
        'experiment': ['', 'controllers', 'set_up', ''],
        'gains': ['', 'Upsilon', 'N', 'gain_K_D_3', 'gain_K_f_4'],
        'tracking': [
            'key_figures', 'settling', '[errors_one errors_two]',
            '[lumped_error_one lumped_error_two uncertainty_one uncertainty_two]',
            '[inputs_one inputs_two compared_inputs]',
            '', 'certificate', '', '[certificate_one certificate_two]',
        ],
        'energy': ['', 'energy', 'energy_shares', '[kinetic_energy]'],
        'couplings': ['', 'couplings', 'terms', '[delta_xi delta_pi]'],
        'basis': [''],
    }  # fmt: skip
    lost = {'one': replace(runs['one'], disturbance=None, nu=runs['one'].nu.copy())}
    lost['one'].nu[:, 0] = np.nan
    found = contents(lost, {'one': summarize(lost['one'])}, tmp_path)
    assert found['tracking'] == [
        'key_figures', 'settling', '[errors_one]', '', '[inputs_one]', '', '', '', '',
    ]  # fmt: skip
    assert found['energy'] == [
        '', 'energy', 'energy_components', 'kinetic_energy', 'energy_shares', '[]',
    ]  # fmt: skip


def test_what_cannot_be_shown_is_said(runs) -> None:
    for run, told in ((runs['one'], False), (replace(runs['one'], disturbance=None), True)):
        shown, summaries = digests({'one': run}), {'one': summarize(run)}
        scenes = {('one',): set_up(shown, summaries, '')}
        tracking = SectionInputs(shown, summaries, scenes, [], {}).sections()[2]
        assert tracking.name == 'tracking'
        assert (NO_F in tracking.blocks) is told
        assert NO_CERTIFICATE in tracking.blocks, 'no figure of one is at hand'


def test_how_far_apart_runs_end(runs) -> None:
    one, two = (run.eta.copy() for run in runs.values())
    two[0] = one[0]
    nu = runs['two'].nu.copy()
    nu[0] = runs['one'].nu[0]
    like = {'one': runs['one'], 'two': replace(runs['two'], eta=two, nu=nu, nu_d=runs['one'].nu_d)}
    like['same'] = like['one']
    apart = np.linalg.norm(one[-1, :3] - two[-1, :3])
    assert _apart(digests(like)) == pytest.approx(apart)
    assert _apart(digests({'one': like['one']})) is None
    moved = like | {'two': replace(like['two'], eta=two + 0.1)}
    assert _apart(digests(moved)) is None
    assert _apart(digests(like | {'two': replace(like['two'], nu_d=nu)})) is None
    shorter = replace(like['two'], **{k: a[:-5] for k, a in like['two'].arrays().items()})
    assert _apart(digests(like | {'two': shorter})) is None
