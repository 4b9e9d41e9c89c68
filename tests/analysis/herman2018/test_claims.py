"""The claims table on the paper's own cases, and that its verdicts follow the numbers."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.made_runs import N, made
from pyarrow import parquet

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.herman2018 import paper
from auv_analysis.herman2018.claims import ROWS, Row, claims_part, judge_runs, write_claims
from auv_analysis.herman2018.evidence import ErrorSensitivity, Evidence, Quotes, grade
from auv_analysis.output.text import MISSING
from auv_analysis.report.digest import FOREVER, RunDigest, digests
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle import DOFS

CASE2_ONLY = {17, 18, 19, 20}


@pytest.fixture(scope='module')
def case1() -> dict[str, Run]:
    return _runs('case1')


@pytest.fixture(scope='module')
def case2() -> dict[str, Run]:
    return _runs('case2')


@pytest.fixture(scope='module')
def table1(case1) -> dict:
    return _table(case1)


@pytest.fixture(scope='module')
def table2(case2) -> dict:
    return _table(case2)


def _runs(name: str) -> dict[str, Run]:
    scenario = load_scenario(name)
    return {controller: simulate(scenario, controller) for controller in scenario.controllers}


_summary = cache(summarize)  # most tests change one run of two


def _table(runs: dict[str, Run]) -> dict:
    claims = judge_runs(runs, {name: _summary(run) for name, run in runs.items()})
    return {claim.number: claim for claim in claims}


def _lines(table: dict) -> list[str]:
    return [f'{n} | {c.verdict} | {c.ours} | {c.window} | {c.remark}' for n, c in table.items()]


def _shortened(run: Run, seconds: float) -> Run:
    keep = run.t <= seconds + run.step / 2
    return run.part(keep)


def test_verdicts_of_case_1(table1):
    assert list(table1) == list(range(1, 22))
    verdicts = {number: claim.verdict for number, claim in table1.items()}
    expected = dict.fromkeys(range(1, 22), 'reproduced')
    expected |= {8: 'partly', 9: 'partly', 14: 'not reproduced', 15: 'not evaluated'}
    expected |= dict.fromkeys(CASE2_ONLY, 'other case')
    assert verdicts == expected
    assert all(claim.criterion for claim in table1.values())


def test_another_experiment_of_the_same_name_is_not_the_papers(case1):
    run = case1['gvc']
    heavier = run.vehicle.changed(M=1.1 * run.vehicle.M)
    for changes in (
        {'nu_d': 1.1 * run.nu_d}, {'disturbance': run.disturbance + 5.0}, {'vehicle': heavier},
        {'nu': run.nu + 0.01}, {'eta': run.eta + 0.01},
    ):  # fmt: skip
        assert _table({'gvc': replace(run, **changes), 'cl': case1['cl']}) == {}
    for far, same in ((0.9e-3, True), (1.1e-3, False)):  # of the peak
        assert bool(_table({'gvc': replace(run, nu_d=(1.0 + far) * run.nu_d)})) == same


def test_a_run_with_what_the_papers_have_not_is_none_of_the_papers(case1):
    gvc = case1['gvc']
    for changes in (
        {'applied': gvc.tau}, {'measured': gvc.nu}, {'kinds': gvc.kinds | {'current'}},
    ):  # fmt: skip
        other = replace(gvc, **changes)
        assert (_table({'gvc': other}), paper.paper_figures(other)) == ({}, [])
        table = _table({'gvc': other, 'cl': case1['cl']})
        assert (table[1].verdict, table[3].verdict) == ('not evaluated', 'reproduced')
    assert paper.paper_figures(replace(gvc, gains=gvc.gains | {'k_D': 13.0})) == []
    assert paper.paper_figures(gvc)[0].endswith('figure 1')


def test_figures_of_the_paper_are_named_by_case_and_law(case1, case2):
    numbers = [
        [words.rpartition(' figure ')[2] for words in paper.paper_figures(runs[law])]
        for runs in (case1, case2) for law in ('gvc', 'cl')
    ]  # fmt: skip
    assert numbers == [
        ['1', '3', '4', '5'], ['2'], ['1', '3', '7', '4', '5'], ['6(a,b)', '6(c,d)', '6(e,f)'],
    ]  # fmt: skip
    kinds = [words.partition(' is ')[0] for words in paper.paper_figures(case2['gvc'])]
    assert kinds == ['errors', 'lumped_error', 'inputs', 'delta_xi', 'delta_pi']


def test_verdicts_of_case_2(table2, approved):
    approved.add(_lines(table2))
    decided = CASE2_ONLY | {21}
    assert {number for number, claim in table2.items() if claim.verdict == 'reproduced'} == decided
    others = [claim for number, claim in table2.items() if number not in decided]
    assert {claim.verdict for claim in others} == {'other case'}
    assert {claim.ours for claim in others} == {MISSING}


def test_a_claim_without_numbers_has_a_row_that_says_so(table2, tmp_path):
    rows = parquet.read_table(write_claims(tmp_path, list(table2.values()))).to_pylist()
    assert {row['number'] for row in rows} == set(table2)
    empty = {'of': '', 'name': '', 'value': None, 'unit': ''}
    without = [row for row in rows if not row['of']]
    assert without
    assert all(row | empty == row for row in without)


@pytest.mark.parametrize(
    ('number', 'parts'),
    [
        (1, ['1.68 s', '0.0039']),
        (2, ['0.0704', '0.369']),
        (3, ['0.029', '0.081']),
        (5, ['−0.52', '−0.55']),
        (6, ['35.8', '113', '39.3']),
        (8, ['28.9', '18.9', '22.0', '7.3']),
        (9, ['528.18 J (0–10 s)', '402.45 J (0–30 s)']),
        (10, ['22.57', '77.34', '(0–10 s)', '(0–30 s)']),
        (11, ['0.0075 m/s']),
        (12, ['0.0514 rad/s']),
        (13, ['840 N m', '125 after 2 s']),
        (14, ['829', '373', '11\u202f479', '2\u202f115']),
        (21, ['39.98', '175.5', '141.114']),
    ],
)
def test_values_of_case_1(table1, number, parts):
    ours = table1[number].ours
    assert [part for part in parts if part not in ours] == []


@pytest.mark.parametrize(
    ('number', 'parts'),
    [(17, ['1.68 s against 4.28 s']), (19, ['−2.1']), (20, ['829', '326', '3\u202f986'])],
)
def test_values_of_case_2(table2, number, parts):
    ours = table2[number].ours
    assert [part for part in parts if part not in ours] == []


def test_a_slow_controller_does_not_reproduce_claim_1(case1, table1):
    gvc = case1['gvc']
    nu = np.where(gvc.t[:, None] > 0.0, gvc.nu_d + 0.01, gvc.nu)
    table = _table(case1 | {'gvc': replace(gvc, nu=nu)})
    assert table[1].verdict == 'not reproduced'
    assert 'not in 30 s' in table[1].ours
    assert ('length of the run, gvc', 30.0, 's') in table[1].values
    assert table[9].ours != table1[9].ours


def test_equal_inputs_reproduce_claim_14(case1):
    cl = replace(case1['cl'], tau=case1['gvc'].tau)
    assert _table(case1 | {'cl': cl})[14].verdict == 'reproduced'
    peak = case1['gvc'].tau.copy()
    peak[0, 2] *= 2.0
    assert _table(case1 | {'cl': replace(cl, tau=peak)})[14].verdict == 'partly'


def test_claim_7_wants_both_uncertain_axes_above_the_certain_one(case1, table1):
    gvc = case1['gvc']
    assert table1[7].verdict == 'reproduced'
    first = np.abs(gvc.disturbance_estimate - gvc.disturbance)[gvc.t < 2.0].max(axis=0)
    for certain, pair in ((1, (0, 2)), (3, (4, 5))):
        estimate = gvc.disturbance_estimate.copy()
        estimate[5, certain] = gvc.disturbance[5, certain] + first[[*pair]].mean()
        changed = replace(gvc, disturbance_estimate=estimate)
        assert _table(case1 | {'gvc': changed})[7].verdict == 'partly'


def test_kinetic_energy_far_from_the_paper_is_not_reproduced(case1):
    gvc = replace(case1['gvc'], nu=1.2 * case1['gvc'].nu)
    assert _table(case1 | {'gvc': gvc})[9].verdict == 'not reproduced'


def test_exchanged_laws_turn_case_2_around(case2, approved):
    gvc, cl = case2['gvc'], case2['cl']
    exchanged = {
        'gvc': replace(gvc, nu=cl.nu, tau=cl.tau),
        'cl': replace(cl, nu=gvc.nu, tau=gvc.tau),
    }
    table = _table(exchanged)
    approved.add(_lines(table))
    assert [table[number].verdict for number in (17, 18, 20)] == ['not reproduced'] * 3
    assert table[19].verdict == 'reproduced'


def test_errors_of_every_axis_have_their_unit(case2):
    shaken = {
        name: replace(run, nu=run.nu + np.sin(7.0 * run.t)[:, None]) for name, run in case2.items()
    }
    values = _table(shaken)[18].values
    assert [value.unit for value in values] == ['m/s'] * 6 + ['rad/s'] * 6


def test_an_effort_of_one_law_alone_is_unbounded(case2):
    assert list(case2) == ['gvc', 'cl']
    small = {name: replace(run, tau=1e-6 * run.tau) for name, run in case2.items()}
    gvc, cl = (replace(run, tau=run.tau * (np.arange(6) != 1)) for run in small.values())
    assert ' unbounded, ' in _table(small | {'gvc': gvc})[19].ours
    assert ' −100.0, ' in _table(small | {'cl': cl})[19].ours
    neither = _table({'gvc': gvc, 'cl': cl})[19].ours
    assert ' +0.0, ' in neither
    assert 'unbounded' not in neither


def test_runs_are_known_by_law_and_gains_not_by_name(case1, table1):
    renamed = {'fast': case1['gvc'], 'slow': case1['cl']}
    same = [(claim.ours, claim.verdict) for claim in table1.values()]
    assert [(claim.ours, claim.verdict) for claim in _table(renamed).values()] == same
    other_gains = replace(case1['cl'], gains=case1['cl'].gains | {'k_D': 13.0})
    row = _table(case1 | {'cl': other_gains})[2]
    assert (row.verdict, row.ours) == ('not evaluated', MISSING)
    assert 'law cl' in row.remark
    assert '(36), (37)' in row.remark


def test_one_run_leaves_the_comparisons_open(case1, approved):
    table = _table({'gvc': case1['gvc']})
    approved.add(_lines(table))
    assert {n for n, c in table.items() if c.verdict == 'not evaluated'} == {2, 3, 6, 14, 15}
    assert table[1].verdict == 'reproduced'


@pytest.mark.parametrize(
    ('case', 'law', 'gains'),
    [('case1', 'gvc', '(36), (37)'), ('case1', 'cl', '(36), (37)'),
     ('case2', 'gvc', '(36), (37)'), ('case2', 'cl', '(40)')],
)  # fmt: skip
def test_the_gains_of_a_run_that_is_missing_are_named(case, law, gains, request):
    runs = dict(request.getfixturevalue(case))
    del runs[law]
    remarks = {claim.remark for claim in _table(runs).values() if 'No run' in claim.remark}
    assert remarks == {f'No run of law {law} with gains {gains}.'}


def test_unknown_disturbance_leaves_the_claims_on_it_open(case1, approved):
    blind = {name: replace(run, disturbance=None) for name, run in case1.items()}
    table = _table(blind)
    approved.add(_lines(table))
    assert {table[number].verdict for number in (5, 6, 7, 8)} == {'not evaluated'}
    assert 'F is not known' in table[5].remark


def test_a_short_run_decides_only_what_it_can(case1, approved):
    table = _table({name: _shortened(run, 1.0) for name, run in case1.items()})
    approved.add(_lines(table))
    open_rows = {n for n, claim in table.items() if claim.verdict == 'not evaluated'}
    assert open_rows == {1, 2, 3, 5, 6, 7, 9, 10, 14, 15}
    assert 'at least 2.5 s' in table[1].remark
    assert '(0–1 s)' in table[9].ours


NEEDS = {  # s, by number
    **dict.fromkeys((1, 2, 5, 7, 14, 19), 2.5), **dict.fromkeys((3, 6, 17, 18), 6.0), 9: 10.0,
    10: 10.0, 15: np.inf,
}  # fmt: skip


@pytest.mark.parametrize('seconds', [0.05, 2.0, 2.49, 2.5, 5.99, 6.0, 9.99, 10.0])
def test_every_duration_gives_a_table(case1, case2, seconds):
    tables = [
        _table({name: _shortened(run, seconds) for name, run in runs.items()})
        for runs in (case1, case2)
    ]
    for number, *both in zip(range(1, 22), *(table.values() for table in tables), strict=True):
        verdicts = [claim.verdict for claim in both if claim.verdict != 'other case']
        unknown = 'not evaluated' in verdicts
        assert unknown == (seconds < NEEDS.get(number, 0.0)), number
    assert ('after 2 s' in tables[0][13].ours) == (seconds > 2.0)


def test_laws_that_settle_at_one_time_do_not_reproduce_claim_17(case2, table2):
    assert table2[17].verdict == 'reproduced'
    alike = replace(case2['cl'], nu=case2['gvc'].nu)
    assert _table(case2 | {'cl': alike})[17].verdict == 'not reproduced'


def test_other_scenarios_have_no_claims(case1, case2):
    other = {name: replace(run, scenario='other') for name, run in case1.items()}
    assert _table(other) == {}
    assert _table({'gvc': case1['gvc'], 'cl': case2['cl']}) == {}


def test_the_paper_is_read_beside_any_run_of_its_vehicle(case1, tmp_path):
    vehicle = load_vehicle('rexrov')
    other = dict.fromkeys(('a', 'b'), replace(case1['gvc'], vehicle=vehicle))
    for runs, read in ((case1 | other, True), (case1, True), (other, False)):
        sections, _ = claims_part(tmp_path, [], runs)
        assert [one.name for one in sections] == ['readings'] * read


def test_grade_counts_the_parts():
    assert grade([True, True]) == 'reproduced'
    assert grade(np.array([True, False])) == 'partly'
    assert grade([False]) == 'not reproduced'


FARTHEST = 300.0  # times
ALL = 6  # in place of an axis
ANSWERS = np.array([0.1, 0.2, 0.3, 0.4, 0.9, 0.5])
Asked = tuple[str, str, tuple[float, ...]]  # law, name of a signal, window


@dataclass(frozen=True, eq=False)
class Scaled:
    """A law's run, of which one signal is some times as large in one window."""

    run: RunDigest
    law: str
    which: Asked
    times: np.ndarray
    asked: dict[Asked, Any]  # and the answer

    def __getattr__(self, name: str) -> Any:
        return getattr(self.run, name)

    def part(self, name: str, first: float = 0.0, last: float = FOREVER) -> Any:
        key = self.law, name, (first, last)
        if key not in self.asked:
            found = self.run.part(name, first, last)
            kinds = ('peak', 'rms', 'mean', 'span', 'path', 'last')
            self.asked[key] = SimpleNamespace(**{kind: getattr(found, kind) for kind in kinds})
        if key != self.which:
            return self.asked[key]
        values = vars(self.asked[key]).items()
        return SimpleNamespace(**{kind: self.times * value for kind, value in values})


class Experiment:
    """A row of the table, judged on runs of which one number is changed."""

    def __init__(self, row: Row, runs: dict[str, Any]):
        self._row, self._runs = row, runs
        self.asked: dict[Asked, Any] = {}
        self.usual = self.verdict(('', '', ()), 0, 1.0)
        self.asked |= {(law, name, ()): None for law in runs for name in ('gains', 'others')}
        self.asked |= {('', 'N', ()): None}

    def verdict(self, which: Asked, axis: int, factor: float) -> str:
        times = np.where((np.arange(6) == axis) | (axis == ALL), factor, 1.0)
        runs = {law: Scaled(run, law, which, times, self.asked) for law, run in self._runs.items()}
        answers = {
            law: ErrorSensitivity(*(
                ANSWERS * (times if which[:2] == (law, name) else 1.0)
                for name in ('gains', 'others')
            ))
            for law in runs
        }  # fmt: skip
        N = np.array(paper.N) * (times if which[1] == 'N' else 1.0)
        return self._row.judge(Evidence(runs, tuple(N), answers), Quotes()).verdict

    def flips(self, which: Asked, axis: int) -> Iterator[str]:
        """Factors from which on the verdict is another one."""
        for end in (-np.log(FARTHEST), np.log(FARTHEST)):
            here, there, changed = 0.0, end, self.verdict(which, axis, np.exp(end))
            while changed != self.usual and abs(there - here) > 1e-4:
                middle = (here + there) / 2
                same = self.verdict(which, axis, np.exp(middle)) == changed
                here, there = (here, middle) if same else (middle, there)
            if changed != self.usual:
                yield f'{changed} {"above" if end > 0 else "below"} {np.exp(there):.3f} times'


def test_where_each_verdict_changes(case1, case2, approved):
    known = {'case1': digests(case1), 'case2': digests(case2)}
    lines = []
    for number, row in enumerate(ROWS, start=1):
        runs = known[row.cases[0]]
        runs = dict.fromkeys(runs, runs['gvc']) if number == 14 else runs  # else they differ by far
        tried = Experiment(row, runs)
        for (law, name, window), axis in itertools.product([*tried.asked], range(ALL + 1)):
            if found := ', '.join(tried.flips((law, name, window), axis)):
                begin = ' to '.join(f'{time:g}' for time in window)
                where = (*DOFS, 'all axes')[axis]
                lines.append(f'{number} {law} {name} {begin} {where}: {found}')
    approved.add(lines)
    assert {line.split()[0] for line in lines} == {str(n) for n in range(1, 22)} - {'17'}


def test_what_each_row_says_of_runs_whose_every_column_is_like_no_others(approved):
    gvc, cl = made('gvc', 'gvc', 1), made('cl', 'cl', 2)
    runs = digests({'gvc': gvc, 'cl': cl.part(cl.t < cl.start + 11.02)})
    answers = {
        law: ErrorSensitivity(np.roll(ANSWERS, k), np.roll(ANSWERS, k + 2))
        for k, law in enumerate(runs)
    }
    evidence = Evidence(runs, tuple(N), answers)
    for number, row in enumerate(ROWS, start=1):
        quote = Quotes()
        found = row.judge(evidence, quote)
        approved.add([f'{number} | {found.verdict} | {found.ours} | {found.window}'])
        approved.add(f'  {value.name} | {value.value:#.4g} {value.unit}' for value in quote.values)


@dataclass(frozen=True, eq=False)
class Exact:
    """A run of which some numbers are given, 'signal kind begin' -> one or six; others are zero."""

    given: dict[str, Any]
    duration = 30.0
    settled = 1.0

    def part(self, name: str, first: float = 0.0, *_: float) -> Any:
        kinds = ('peak', 'rms', 'mean', 'span', 'path', 'last')
        values = {kind: self.given.get(f'{name} {kind} {first:g}', 0.0) for kind in kinds}
        return SimpleNamespace(**{kind: np.full(6, value) for kind, value in values.items()})


FAR, ONE = {'lumped_error peak 2': 0.25}, {'lumped_error peak 2': 2.5}  # ten times as large
PATHS = {'error peak 0': [1.0, 0.005, 0, 0, 0, 0], 'error path 0': [1.0, 2.0, 2.0, 0, 0, 0]}
OTHER = {'error peak 0': [1.0, 0.005, 0, 0, 0, 0], 'error path 0': [2.0, 1.0, 2.0, 0, 0, 0]}


@pytest.mark.parametrize(
    ('number', 'gvc', 'cl', 'verdict'),
    [
        (1, {'error peak 2': 0.005}, {}, 'reproduced'),
        (2, {}, {'error peak 2': 0.005}, 'not reproduced'),
        (2, {'error peak 2': 0.25}, {'error peak 2': 2.5}, 'not reproduced'),
        (3, {}, {'error peak 2': 0.005, 'error peak 20': 0.005}, 'not reproduced'),
        (4, {'error peak 0': [2.5, 0.25, 2.5, 1.0, 100.0, 100.0]}, {}, 'not reproduced'),
        (5, {**ONE, 'lumped_error peak 0': 25.0, 'lumped_error last 0': -1.0, 'F peak 0': 100.0},
         {}, 'not reproduced'),
        (6, FAR, {**ONE, 'lumped_error span 20': 1.0, 'F span 20': 2.0}, 'not reproduced'),
        (7, {**FAR, 'lumped_error peak 0': 2.5}, {}, 'not reproduced'),
        (8, {'F peak 0': 1.0}, {}, 'partly'),
        (10, {'energy mean 0': [22.75, 1.0, 76.25, 0, 0, 0]}, {}, 'reproduced'),
        (12, {'delta_xi peak 0': 1.0, 'nu peak 0': 1.0}, {}, 'not reproduced'),
        (13, {'delta_pi peak 0': [0.25, 0.25, 0.25, 0.25, 2.5, 0.25]}, {}, 'not reproduced'),
        (14, {'tau peak 0': 10.0, 'tau rms 2': 10.0}, {'tau peak 0': 11.0, 'tau rms 2': 11.0},
         'reproduced'),
        (16, {'energy mean 0': [49.0, 1.0, 50.0, 0, 0, 0]}, {}, 'partly'),
        (18, PATHS, OTHER, 'reproduced'),
        (18, PATHS, {**OTHER, 'error peak 0': [1.0, 0, 1.0, 0, 0, 0]}, 'partly'),
        (19, {'tau rms 2': 20.0}, {'tau rms 2': [21.0] * 4 + [40.0] * 2}, 'partly'),
        (19, {'tau rms 2': 20.0}, {'tau rms 2': [21.0] * 3 + [40.0] * 3}, 'not reproduced'),
        (20, {'tau peak 0': 1.0}, {'tau peak 0': 1.0}, 'not reproduced'),
    ],
)  # fmt: skip
def test_a_number_on_the_border_counts_as_the_criterion_says(number, gvc, cl, verdict):
    """'within' and 'at most' are with the border, 'above', 'below' and 'exceeds' without it."""
    runs = {'gvc': Exact(gvc), 'cl': Exact(cl)}
    assert ROWS[number - 1].judge(Evidence(runs, paper.N), Quotes()).verdict == verdict
