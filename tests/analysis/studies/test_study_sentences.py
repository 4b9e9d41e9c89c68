"""Sentences and small tables of the studies, by their numbers: who, by how much, which way."""

from dataclasses import fields
from types import SimpleNamespace as Made

import numpy as np
import pytest

from auv_analysis.report.results import Results
from auv_analysis.studies.atlas import report as atlas
from auv_analysis.studies.design import report as design
from auv_analysis.studies.design.results import (
    COUPLINGS,
    UNITS,
    nothing_statement,
    result_statement,
)
from auv_analysis.studies.identify import report as identify
from auv_analysis.studies.identify import vehicle_text
from auv_analysis.studies.identify.identified import _words
from auv_analysis.studies.identify.whiteness import SLOW, told
from auv_analysis.studies.sweep import report as sweep
from auv_analysis.studies.tune import report as tune
from auv_analysis.studies.tune.cost import Measures
from auv_analysis.studies.tune.perturbations import Spread

pytestmark = pytest.mark.usefixtures('approved')


def _predicted(predictor: str, horizon: float, low: float, ratio: float, high: float) -> dict:
    return {
        'predictor': predictor, 'horizon': horizon, 'ratio': ratio, 'ratio_low': low,
        'ratio_high': high,
    }  # fmt: skip


BETTER, WORSE, EVEN = (0.3, 0.4, 0.5), (1.1, 1.25, 1.5), (0.8, 1.0, 1.2)


@pytest.mark.parametrize(
    ('prior', 'rival', 'text'),
    [
        (BETTER, BETTER, 'The new model predicts what it has not seen better than the prior: '
                         '0.40 times its error at 5 s (0.30 to 0.50).'),
        (WORSE, BETTER, 'The new model is not better than the prior: '
                        '1.2 times its error at 5 s (1.1 to 1.5).'),
        (EVEN, BETTER, 'The new model cannot be told from the prior on what was held out: '
                       '1.0 times its error at 5 s (0.80 to 1.2).'),
        (BETTER, EVEN, 'The new model predicts what it has not seen better than the prior: '
                       '0.40 times its error at 5 s (0.30 to 0.50); not clearly better than '
                       'persistence and black box.'),
    ],
)  # fmt: skip
def test_the_verdict_on_a_model(prior, rival, text: str) -> None:
    rows = [_predicted('prior', 0.1, *WORSE), *(_predicted('prior', h, *prior) for h in (0.5, 5.0))]
    rows += [
        _predicted(name, h, *rival) for name in ('persistence', 'black box') for h in (0.5, 5.0)
    ]
    assert identify.verdict(rows, []) == text
    assert identify.verdict(rows, ['it floats', 'x']) == 'No vehicle file: it floats.'
    assert identify.verdict([], []).startswith('Nothing was held out')


@pytest.mark.parametrize(('horizon', 'told'), [(0.1, False), (0.5, True), (5.0, True)])
def test_a_rival_is_judged_where_more_than_noise_tells(horizon: float, told: bool) -> None:
    rows = [_predicted('prior', 5.0, *BETTER), _predicted('black box', horizon, *EVEN)]
    assert ('not clearly better than black box.' in identify.verdict(rows, [])) == told


def test_the_worst_horizon_decides() -> None:
    rows = [_predicted('prior', 0.5, *WORSE), _predicted('prior', 5.0, *BETTER)]
    assert identify.verdict(rows, []) == (
        'The new model is not better than the prior: 1.2 times its error at 0.5 s (1.1 to 1.5).'
    )


def test_the_verdict_on_a_vehicle_alone() -> None:
    rows = [_predicted('persistence', h, *BETTER) for h in (0.1, 0.5, 2.0)]
    rows += [_predicted('black box', 0.5, *WORSE), _predicted('black box', 2.0, *BETTER)]
    assert identify.verdict_alone('v', rows) == (
        'v predicts better than persistence and worse than black box at 0.5 s.'
    )
    rows[-2] = _predicted('black box', 0.5, *EVEN)
    assert identify.verdict_alone('v', rows).endswith('not clearly better than black box.')
    assert identify.verdict_alone('v', []) == 'Nothing was held out, or too little.'
    short = [_predicted('persistence', 0.1, *WORSE), _predicted('black box', 0.2, *EVEN)]
    assert identify.verdict_alone('v', short) == (
        'v predicts worse than persistence at 0.1 s and not clearly better than black box.'
    )
    assert identify.verdict([_predicted('prior', 0.2, *BETTER)], []) == (
        'The new model predicts what it has not seen better than the prior: '
        '0.40 times its error at 0.2 s (0.30 to 0.50).'
    )


@pytest.mark.parametrize('border', [(0.8, 0.9, 1.0), (1.0, 1.1, 1.2)])
def test_an_interval_that_ends_at_one_tells_nothing(border) -> None:
    rows = [_predicted(name, 5.0, *border) for name in ('prior', 'persistence', 'black box')]
    text = identify.verdict(rows, [])
    assert text.startswith('The new model cannot be told from the prior')
    assert text.endswith('; not clearly better than persistence and black box.')
    assert identify.verdict_alone('v', rows) == (
        'v predicts not clearly better than persistence and not clearly better than black box.'
    )


def test_sentences_of_an_identification() -> None:
    facts = {
        'verdict': 'V.', 'contradictions': ['first', 'second'], 'file': '',
        'identified': ['a', 'b', 'c'], 'not_identified': ['d'], 'hardly_moving': ['e', 'f'],
        'residuals': 'R', 'combinations': [{'words': f'w{k}'} for k in range(6)],
        'excitation': ['more of it'],
    }  # fmt: skip
    rows = [
        {'pair': 'roll, yaw', 'verdict': 'real', 'Upsilon': 0.1, 'M': 4.0, 'M_low': 3.0,
         'M_high': 6.0, 'unit': 'kg m²'},
        {'pair': 'surge, pitch', 'verdict': 'real', 'Upsilon': -0.5, 'M': -70.0, 'M_low': -80.0,
         'M_high': -60.0, 'unit': 'kg m'},
        {'pair': 'sway, roll', 'verdict': 'not known', 'Upsilon': 9.0, 'M': 1.0, 'M_low': 0.0,
         'M_high': 2.0, 'unit': 'kg m'},
    ]  # fmt: skip
    results = Results('identify', facts)
    results.add('inertia', 'x', rows, {})
    assert identify.sentences(results) == [
        'V.', 'Second.', '3 of 4 coefficients are identified.',
        'The coupling of surge with pitch is real: −70.0 ± 10 kg m.',
        'The coupling of roll with yaw is real: 4.00 ± 1.5 kg m².',
        'Not searched, as it hardly moves: e and f.', 'R.',
        'Open: w0.', 'Open: w1.', 'Open: w2.', 'Open: w3.', 'More of it.',
    ]  # fmt: skip
    facts['file'] = 'vehicle.yaml'
    assert identify.sentences(results)[1:3] == ['First.', 'Second.']


@pytest.mark.parametrize(
    ('name', 'indexed'),
    [('M.pitch.surge', 'M[4][0]'), ('D_linear.roll', 'D_linear[3][3]'), ('lag', 'lag'),
     ('D_quadratic.yaw.sway', 'D_quadratic[5][1]'), ('gain.surge', 'gain.surge')],
)  # fmt: skip
def test_coefficients_are_named_by_indices(name: str, indexed: str) -> None:
    assert identify._indexed(name) == indexed


def test_numbers_for_programs_stand_under_their_names() -> None:
    rows = [{'name': 'M.yaw', 'deviation': 1.0, 'status': 'identified', 'unit': 'kg', 'value': 2.0,
             'low': 3.0, 'high': 4.0, 'prior': 5.0}]  # fmt: skip
    predictions = [{'predictor': p, 'horizon': 0.5, 'error': e}
                   for p, e in (('new', 1.0), ('prior', 2.0), ('black box', 3.0))]  # fmt: skip
    parts = ('', '_prior', '_low', '_high')
    tables = {
        name: [who | {f'{symbol}{part}': f'{symbol}{part}' for symbol in symbols for part in parts}]
        for name, who, symbols in (
            ('deformation', {'dof': 'roll'}, ('delta_xi_max', 'delta_pi_max')),
            ('shares', {'dof': 'yaw'}, ('N', 'share')),
            ('inertia', {'pair': 'surge, pitch'}, ('Upsilon',)),
        )
    }
    found = identify._listed(rows, predictions, tables)
    assert found['parameters'] == [{
        'name': 'M[5][5]', 'std': 1.0, 'identifiable': True, 'unit': 'kg', 'value': 2.0,
        'low': 3.0, 'high': 4.0, 'prior': 5.0,
    }]  # fmt: skip
    assert found['prediction'] == [{'horizon': 0.5, 'model': 1.0, 'prior': 2.0, 'black_box': 3.0}]
    names = {
        'delta_xi_max.roll': 'delta_xi_max', 'delta_pi_max.roll': 'delta_pi_max', 'N.yaw': 'N',
        'share.yaw': 'share', 'Upsilon.surge.pitch': 'Upsilon',
    }  # fmt: skip
    assert found['couplings'] == [
        {'name': name, 'value': s, 'prior': f'{s}_prior', 'low': f'{s}_low', 'high': f'{s}_high'}
        for name, s in names.items()
    ]


def test_without_anything_held_out_or_with_a_contradiction_there_is_no_model() -> None:
    assert identify.verdict([], []) == (
        'Nothing was held out, or too little: how good the model is has not been tried.'
    )
    assert identify.verdict([], ['it is wrong', 'twice']) == 'No vehicle file: it is wrong.'
    assert identify.verdict_alone('rov', []) == 'Nothing was held out, or too little.'


def test_how_an_identification_was_asked_for() -> None:
    assert identify._asked(Made(problem=Made(observer=0.0), resampled=[])) == []
    gain, draws = identify._asked(Made(problem=Made(observer=0.25), resampled=[1, 2, 3]))
    assert gain.startswith('Along segments the simulated state follows the measurements by a gain '
                           'of 0.25 a step; residuals are')  # fmt: skip
    assert draws.startswith('The bootstrap has 3 draws of blocks of time, each refitted')


def test_what_residuals_say() -> None:
    def row(dof: str, verdict: str, largest: float, slow: float) -> dict:
        return {'dof': dof, 'verdict': verdict, 'largest': largest, 'slow': slow,
                'slow_if_white': 0.02}  # fmt: skip

    white, one = row('roll', 'white', 0.1, 0.9), row('surge', 'coloured', 0.2, 0.05)
    two, slow = row('yaw', 'coloured', -0.45, 0.04), row('sway', 'slow', 0.3, 0.5)
    assert told([]).startswith('Whether the residuals are white cannot be told: no even rate')
    assert told([white]) == 'The residuals are white: the model explains all but noise'
    assert told([white, one, two]) == (
        'The residuals are not white in surge and yaw: autocorrelation up to 0.45'
    )
    lacks = (
        'The residuals are not white in surge and sway: in sway 50 % of their power lies below '
        f'{SLOW:g} Hz, of white noise 2.0 %; something slow acts that the model lacks'
    )
    narrow = ': intervals may be too narrow'
    assert told([one, slow, white], current=True) == f'{lacks}{narrow}'
    assert told([one, slow, white]) == f'{lacks}, as a current would (--free current){narrow}'


@pytest.mark.parametrize(
    ('part', 'some', 'text'),
    [
        ([0.1, 0.9, 0.0], [1], 'nothing is known of b'),
        ([0.5, 0.5, 0.0], [0, 1], 'only the difference of a and b is known, not all of them '
                                  'together'),
        ([0.5, -0.5, 0.1], [0, 1], 'a may grow if b becomes less'),
        ([0.5, -0.5, 0.0, -0.4], [0, 1, 3], 'a may grow if b and c become less'),
        ([0.0, 0.0, 1.0], [2], 'the scale of the wrench cannot be told from that of all of M, D '
                               'and g together'),
    ],
)  # fmt: skip
def test_directions_that_the_data_leave_open(part: list[float], some: list[int], text: str) -> None:
    assert _words(['a', 'b', 'gain.surge', 'c'], np.array(part), some) == text


def test_each_coefficient_of_a_vehicle_file_has_its_line() -> None:
    def row(name: str, status: str, low: float | None, high: float | None) -> dict:
        return {'name': name, 'status': status, 'low': low, 'high': high, 'value': 2.5,
                'prior': 1.5, 'unit': '' if name == 'gain' else 'kg'}  # fmt: skip

    assert vehicle_text._said([], 'mass') == []
    rows = [
        row('a', 'at zero', None, None), row('b', 'at zero', None, 3.0),
        row('c', 'identified', 2.0, 3.0), row('d', 'identified', -1.0, 6.0),
        row('gain', 'not identified', None, None), row('e', 'identified', 0.0, 5.0),
    ]  # fmt: skip
    assert vehicle_text._said(rows, 'mass') == [
        '# mass:',
        '#   a: held at 0, as it would feed energy beside what was identified',
        '#   b: at its bound 0 kg, at most 3.0000 kg',
        '#   c: identified 2.5000 kg, within 2.0000 to 3.0000 kg',
        '#   d: identified 2.5000 kg, within −1.0000 to 6.0000 kg; no more than its uncertainty',
        '#   gain: prior 1.5000, not identified by itself',
        '#   e: identified 2.5000 kg, within 0 to 5.0000 kg; no more than its uncertainty',
    ]


# atlas


def _chart(name: str, strength: float, pairs, failure: str = '') -> Made:
    zeros = {'delta_xi': ['yaw'], 'delta_pi': ['surge', 'sway'] if pairs else list('abcdef')}
    return Made(
        name=name, is_diagonal=not pairs, strength=strength, largest=strength / 2, pairs=pairs,
        zeros=zeros, damped=[('sway', 'yaw')] if pairs else [], reached={'failure': failure},
    )  # fmt: skip


def test_findings_of_an_atlas() -> None:
    charts = [_chart('a', 0.5, [('sway', 'roll')]), _chart('b', 0.2, [('surge', 'pitch')], 'x'),
              _chart('c', 0.0, [])]  # fmt: skip
    assert [(s.text, s.source) for s in atlas.findings(charts)] == [
        ('Inertia couples a the most: cross terms reach 50.0 % of the energy without them, of sway '
         'and roll alone 25.0 %.', 'table-ranking'),
        ('c has a diagonal M: Upsilon = I, nothing is coupled by inertia.', 'table-ranking'),
        ('Case 1 diverges on b, which therefore have no peaks.', 'case1'),
    ]  # fmt: skip
    table = atlas.ranking(Results('atlas', {'vehicles': {}}), charts)
    heads = [head.label for head in table.columns]
    assert heads[3:4] + heads[5:] == [
        'between', 'Δξ always zero', 'Δπ always zero', 'damping couples',
    ]  # fmt: skip
    assert [[row[i].text for i in (0, 3, 5, 6, 7)] for row in table.rows] == [
        ['a', 'sway–roll', 'yaw', 'surge, sway', 'sway–yaw'],
        ['b', 'surge–pitch', 'yaw', 'surge, sway', 'sway–yaw'],
        ['c', 'none', 'yaw', 'all six', 'none'],
    ]


def test_the_unit_of_an_entry_is_that_of_its_velocities() -> None:
    chart = _chart('a', 0.5, [('sway', 'roll'), ('roll', 'yaw'), ('surge', 'heave')])
    table = atlas.pairs(Results('atlas', {'vehicles': {}}), [chart])
    assert [[row[i].text for i in (1, 2, 5)] for row in table.rows] == [
        ['sway', 'roll', 'm/s per rad/s'], ['roll', 'yaw', 'rad/s per rad/s'],
        ['surge', 'heave', 'm/s per m/s'],
    ]  # fmt: skip


def test_what_case_1_reaches_is_told_of_vehicles_that_come_to_its_end() -> None:
    charts = [_chart('a', 0.5, [('sway', 'roll')]), _chart('b', 0.2, [('surge', 'pitch')], 'x')]
    peaks = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5]
    case1 = {'delta_xi_max': peaks, 'delta_pi_max': peaks,
             'delta_xi_energy_percent': [0.0, 7.0, 3.0, 0.0, 0.0, 0.0]}  # fmt: skip
    charts[0].reached |= case1
    results = Results('atlas', {'vehicles': {'a': {'case1': case1}}})
    xi, pi = (atlas.reached(results, charts, kind) for kind in ('delta_xi', 'delta_pi'))
    assert [[c.value for c in row] for row in xi.rows] == [[None, *peaks[:5], None, 7.0]]
    assert [[c.value for c in row] for row in pi.rows] == [[None, None, None, *peaks[2:]]]
    assert [head.unit for head in xi.columns] == ['', *['m/s'] * 3, *['rad/s'] * 3, '%']
    assert [head.unit for head in pi.columns] == ['', *['N'] * 3, *['N m'] * 3]


# sweep


@pytest.mark.parametrize(
    ('count', 'note'),
    [(20, ''), (21, 'Another one is in failures.parquet.'),
     (22, '2 others are in failures.parquet.')],
)  # fmt: skip
def test_failures_that_are_left_out_are_counted(count: int, note: str) -> None:
    row = {'path': 'p', 'value': '1', 'controller': 'c', 'rows': 8, 'diverged': 1, 'refused': 1,
           'diverged_percent': 12.5, 'refused_percent': 12.5}  # fmt: skip
    (table,) = sweep._failures(Made(tables={'failures': [row] * count}, reasons=list))
    assert (len(table.rows), table.note) == (20, note)


# tune


class Tuned:
    """A tuning whose ratios are given."""

    def __init__(self, *, reached: bool = True):
        sizes = {'weighted_error': 2.0, 'effort': 50.0}
        reference = Measures(
            **{name: np.array([sizes.get(name, 9.0)]) for name in Measures._fields}
        )
        self.request = Made(reference='gvc')
        self.goal = Made(names=('weighted_error', 'effort'), reference=reference, tolerance=0.01)
        self.scenario = Made(controllers=['gvc', 'gvc_tuned', 'cl_tuned'])
        self.laws = {'gvc_tuned': Made(law='gvc', best=Made(reached=True)),
                     'cl_tuned': Made(law='cl', best=Made(reached=reached))}  # fmt: skip
        self.retuned = 'gvc_tuned'
        self.draws = {'gvc': Made(error=np.zeros(40))}
        self.comparisons = [
            Made(measure=measure, against=against, controller=name, ratio=ratio, verdict=verdict)
            for measure, against, name, ratio, verdict in (
                ('weighted_error', 'gvc', 'gvc_tuned', 0.5, -1),
                ('weighted_error', 'gvc', 'cl_tuned', 1.5, 1),
                ('effort', 'gvc', 'cl_tuned', 9.0, 1),
                ('weighted_error', 'gvc_tuned', 'cl_tuned', None, 0),
            )
        ]

    def ratio(self, name: str, measure: str) -> float:
        return {'gvc_tuned': (0.25, 1.001), 'cl_tuned': (0.5, 0.998)}[name][measure == 'effort']

    def remarks(self, name: str) -> list[str]:
        return ['at its bound'] if name == 'cl_tuned' else []


def test_findings_of_a_tuning() -> None:
    assert [s.text for s in tune.findings(Tuned())] == [
        'At the effort of gvc (50.00 J/s², met within 0.20 %), the least time-weighted error that '
        'the search found is 0.250 for gvc and 0.500 for cl, as parts of gvc’s 2.00 J.',
        'gvc’s own law, searched in the same way, comes to 0.250: that is the gains’ part. What is '
        'left to the law is a factor of 2.00 for cl.',
        'Over 40 draws of model error and disturbance, the same for all, in time-weighted error: '
        'gvc_tuned (0.500 times) is ahead of gvc; cl_tuned (1.50 times) is behind gvc (ratios '
        'after Hodges and Lehmann; Wilcoxon signed-rank test, Holm’s correction, level 0.05).',
        'Over 40 draws of model error and disturbance, the same for all, in time-weighted error: '
        'cl_tuned (no ratio) is not told apart from gvc_tuned (ratios after Hodges and Lehmann; '
        'Wilcoxon signed-rank test, Holm’s correction, level 0.05).',
        'cl_tuned: at its bound.',
    ]
    lost = [s.text for s in tune.findings(Tuned(reached=False))]
    assert lost[1] == (
        'No gains of cl that were tried have the effort of gvc within 1.0 %; the nearest are '
        '−0.20 % away, and cl_tuned is no fair comparison.'
    )
    assert 'gvc_tuned (0.500 times) is ahead of gvc (ratios' in lost[2]
    for others, begin in (
        (False, ['No gains of gvc that were', 'No gains of cl that were ']),
        (True, ['At the effort of gvc (50.', 'No gains of gvc that were']),
    ):
        none = Tuned(reached=others)
        none.laws['gvc_tuned'].best.reached = False
        assert [s.text[:25] for s in tune.findings(none)][:2] == begin


def test_what_was_searched_without_reaching_equality_has_no_least() -> None:
    about = {'low': 0.5, 'high': 40.0, 'times_inertia': True}
    search = {
        'searched': {'k_D': about, 'Lambda': about | {'times_inertia': False}},
        'structure': 'mass',
        'evaluations': 9,
        'measures': {'effort': 3.0, 'error': 2.0},
    }
    controllers = {'gvc': {}, 'cl': {'searches': [search | {'reached': x} for x in (True, False)]}}
    facts = {'controllers': controllers, 'index': 'error', 'equal': 'effort'}
    table = tune._searched(Results('tune', facts))
    assert [row[-1].value for row in table.rows] == [2.0, 2.0, None, None]
    stands = {row[5].text for row in table.rows}
    assert stands == {'times M_ii of each axis', 'itself'}


def test_all_that_a_tuning_draws_is_explained() -> None:
    assert list(tune.SPREADS) == [one.name for one in fields(Spread)]


# design


def test_changes_of_a_design_are_marked() -> None:
    document = {
        'reduce': 'delta_xi.sway', 'controller': 'gvc',
        'side_effects': [{'name': 'effort.max.yaw'}],
        'measures': [
            {'name': 'delta_xi_max.sway', 'before': 0.2, 'after': 0.05, 'unit': 'm/s'},
            {'name': 'effort.max.yaw', 'before': 2.0, 'after': 3.0, 'unit': 'N m'},
            {'name': 'effort.max.surge', 'before': 4.0, 'after': 4.0, 'unit': 'N'},
        ],
        'controllers': {
            name: {'measures': [
                {'name': 'delta_xi_max.sway', 'before': 1.0, 'after': 2.0, 'unit': 'm/s'},
                {'name': 'velocity_error.rms.sway', 'before': 1.0, 'after': 2.0, 'unit': 'm/s'},
            ]} for name in ('gvc', 'cl')
        },
    }  # fmt: skip
    results = Results('design', document)
    table = design.measures_table(results)
    assert [[cell.text for cell in row] for row in table.rows] == [
        ['delta_xi_max.sway', '0.200', '0.0500', '−75.0 %', 'm/s'],
        ['effort.max.yaw', '2.00', '3.00', '+50.0 %', 'N m'],
        ['effort.max.surge', '4.00', '4.00', '=', 'N'],
    ]
    assert [row[0].kind for row in table.rows] == ['good', 'bad', '']
    alone = design.controllers_table(Results('design', document | {'controllers': {'gvc': {}}}))
    assert alone is None
    others = design.controllers_table(results)
    assert [[cell.text for cell in row] for row in others.rows] == [
        ['cl', 'delta_xi_max.sway', '1.00', '2.00', '+100.0 %', 'm/s']
    ]


def test_the_best_change_of_each_part_is_in_the_matrix() -> None:
    def one(coupling: str, part: str, ratio, **about) -> dict:
        return {'coupling': coupling, 'part': part, 'ratio': ratio, 'predicted': 0.7, 'score': 9.0,
                'values': {'x': 1.25}, 'failure': None, 'proposed': False} | about  # fmt: skip

    alternatives = [
        one('delta_xi.sway', 'shift', 0.9), one('delta_xi.sway', 'shift', 0.4, proposed=True),
        one('delta_xi.sway', 'disc', None, failure='it diverges', values={}),
        one('delta_pi.yaw', 'disc', 0.75), one('delta_pi.yaw', 'disc', 0.9),
    ]  # fmt: skip
    half = Results('design', {'alternatives': [one('delta_xi.sway', 'shift', 0.5)]})
    assert design.matrix_table(half).rows[0][1].kind == 'good'
    results = Results('design', {'alternatives': alternatives, 'reduce': 'delta_xi.sway'})
    table = design.matrix_table(results)
    assert [head.unit for head in table.columns] == ['', '%', '%']
    assert [[cell.text for cell in row] for row in table.rows] == [
        ['delta_xi.sway', '40.0', '–'], ['delta_pi.yaw', '–', '75.0'],
    ]  # fmt: skip
    assert [row[1].kind for row in table.rows] == ['good', '']
    mine = design.alternatives_table(results)
    assert [[cell.text for cell in row][1:] for row in mine.rows] == [
        ['0.700', '0.900', '9.00', 'x 1.25', ''], ['0.700', '0.400', '9.00', 'x 1.25', 'proposed'],
        ['0.700', '–', '9.00', 'none', 'it diverges'],
    ]  # fmt: skip


def test_a_design_says_what_it_does_or_why_there_is_nothing_to_do() -> None:
    assert nothing_statement('rov', None, []).startswith('rov: M is diagonal, so Upsilon')
    assert nothing_statement('rov', 'delta_xi.sway', ['delta_xi.roll', 'delta_pi.yaw']) == (
        'rov: delta_xi.sway is zero in every motion by the structure of M: there is nothing to '
        'remove. Not zero: delta_xi.roll and delta_pi.yaw.'
    )
    for target, what in ((None, 'every coupling'), ('delta_xi.roll', 'delta_xi.roll')):
        assert nothing_statement('rov', target, ['delta_xi.roll']) == (
            f'rov: {what} is zero throughout this scenario: there is nothing to remove.'
        )
    name, unit = COUPLINGS[1], UNITS[COUPLINGS[1]]
    for best in (None, Made(ratio=None)):
        assert result_statement(1, 0.5, best, [], 'by cl') == (
            f'No change within the bounds lowers {name}, which is 0.500 {unit}, by cl.'
        )
    words = ['move it', 'add foam']
    half = f'Move it; add foam: {name} falls from 0.500 to 0.250 {unit}, by 50.0 %, by cl.'
    assert result_statement(1, 0.5, Made(ratio=0.5), words, 'by cl') == half
    assert result_statement(1, 0.5, Made(ratio=0.8), words, 'by cl') == (
        f'Move it; add foam: {name} falls from 0.500 to 0.400 {unit}, by 20.0 %, by cl. The '
        'bounds do not allow half: 20.0 % is the most that was found.'
    )


# sweep


def test_findings_of_a_sweep() -> None:
    settled = 'overall.velocity_error.settling_time'
    counts = [
        {'controller': 'gvc', 'rows': 20, 'ok': 20, 'diverged': 0, 'refused': 0},
        {'controller': 'cl', 'rows': 30, 'ok': 20, 'diverged': 4, 'refused': 6},
    ]
    quantiles = [
        {'figure': 'other', 'controller': 'cl', 'rows': 9, 'known': 9, 'median': 1.0},
        {'figure': settled, 'controller': 'gvc', 'rows': 20, 'known': 5, 'median': None},
        {'figure': settled, 'controller': 'cl', 'rows': 8, 'known': 6, 'median': 2.5},
        {'figure': settled, 'controller': 'none', 'rows': 0, 'known': 0, 'median': None},
        {'figure': settled, 'controller': 'never', 'rows': 7, 'known': 0, 'median': None},
    ]
    analysis = Made(
        sweep=Made(rows=50, planned=60), tables={'quantiles': quantiles}, counts=lambda: counts,
        notes=['what is odd'],
    )  # fmt: skip
    assert [(s.text, s.source) for s in sweep.findings(analysis)] == [
        ('The sweep is not finished: 50 of 60 rows are there.', 'table-counts'),
        ('Under gvc all errors settle in 25.0 % of the 20 rows that came to their end.',
         'table-quantiles'),
        ('Under cl all errors settle in 75.0 % of the 8 rows that came to their end, in half of '
         'them within 2.50 s.', 'table-quantiles'),
        ('Under never all errors settle in 0 % of the 7 rows that came to their end.',
         'table-quantiles'),
        ('Of 30 rows of cl, 4 diverged and 6 refused.', 'failures'),
        ('What is odd.', 'campaign'),
    ]  # fmt: skip
    analysis.sweep.planned = 50
    assert sweep.findings(analysis)[0].text.startswith('Under gvc')


def test_values_of_a_campaign_in_words() -> None:
    assert sweep._said([1, 2.5, 'a']) == '1, 2.5, a'
    assert sweep._said({'uniform': {'from': 1.0, 'to': 3.0}}) == 'uniform: from 1, to 3'
    assert sweep._said(list(range(60))).endswith('…')
    assert len(sweep._said(list(range(60)))) == 79
    assert sweep._said(['a' * 80]) == 'a' * 80
    assert sweep._said(['a' * 81]) == f'{"a" * 78}…'


def test_the_values_at_which_most_rows_fail_come_first() -> None:
    rows = [
        {'path': 'p', 'value': str(k), 'controller': 'gvc', 'rows': 10, 'diverged': d, 'refused': r,
         'diverged_percent': 10.0 * d, 'refused_percent': 10.0 * r}
        for k, (d, r) in enumerate([(1, 0), (0, 0), (2, 3), (0, 4)])
    ]  # fmt: skip
    table, *_ = sweep._failures(Made(tables={'failures': rows}, reasons=list))
    assert [[cell.text for cell in row] for row in table.rows] == [
        ['p', '2', 'gvc', '10', '20.0', '30.0'], ['p', '3', 'gvc', '10', '0', '40.0'],
        ['p', '0', 'gvc', '10', '10.0', '0'],
    ]  # fmt: skip
    assert table.source(0, 'rows') == 'failures.parquet:rows[2]'


def test_what_matters_most_stands_first_for_each_measure() -> None:
    names = ('overall.effort.rms.linear', 'kinetic_energy.mean')
    rows = [
        {'figure': figure, 'controller': controller, 'path': path, 'explained_percent': share,
         'spearman': None}
        for figure in reversed(names) for controller in ('gvc', 'cl')
        for path, share in (('scenario.a', 10.0), ('scenario.b', 70.0), ('scenario.c', 20.0))
    ]  # fmt: skip
    factors = [Made(path=f'scenario.{x}') for x in 'abc']
    measures = [Made(name=name) for name in names]
    analysis = Made(measures=measures, factors=factors, tables={'influence': rows})
    table = sweep._influences(analysis)
    found = [[cell.text for cell in row[:4]] for row in table.rows]
    assert [row[2][-1] for row in found] == ['b', 'c', 'a'] * 4
    assert [row[1] for row in found] == ['cl'] * 3 + ['gvc'] * 3 + ['cl'] * 3 + ['gvc'] * 3
    assert [row[0] for row in found] == ['RMS input, linear'] * 6 + ['kinetic energy'] * 6
    assert [row[3] for row in found[:3]] == ['70.0', '20.0', '10.0']


def test_the_largest_share_of_energy_in_case_1_is_shown() -> None:
    shares = [0.1, 0.7, 0.2, 0.6, 0.3, 0.0]
    chart = _chart('a', 0.5, [('sway', 'roll')])
    chart.reached['delta_xi_energy_percent'] = shares
    case1 = {'delta_xi_max': [1.0, 2, 3, 4, 5, 6], 'delta_xi_energy_percent': shares}
    results = Results('atlas', {'vehicles': {'a': {'case1': case1}}})
    ((*cells,),) = atlas.reached(results, [_chart('b', 0.1, [], 'x'), chart], 'delta_xi').rows
    assert [cell.value for cell in cells[1:]] == [1.0, 2.0, 3.0, 4.0, 5.0, None, 0.7]
