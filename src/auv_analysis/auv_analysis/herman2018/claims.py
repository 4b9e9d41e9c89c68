"""The 21 claims of Herman 2018 as rows, and what runs say of them: table, file, sentences."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.herman2018 import criteria, paper
from auv_analysis.herman2018.evidence import (
    BOTH,
    DECIDED,
    Claim,
    Evidence,
    Judgement,
    Quotes,
    Row,
    Value,
    Verdict,
)
from auv_analysis.herman2018.paper import CASES, is_plain, paper_run
from auv_analysis.output.new_files import write_table
from auv_analysis.output.text import MISSING, fixed, join
from auv_analysis.report.digest import TINY, RunDigest, digests
from auv_analysis.report.document import Block, Section, Sentence, prose
from auv_analysis.report.results import Column, Shown, described, make_table
from auv_analysis.runs.run import Run, RunInfo
from auv_analysis.scenario.scenario import Scenario, load_scenario
from auv_dynamics.plant.disturbance import make_disturbance


def _listed(name: str, values: tuple[float, ...], unit: str) -> tuple[Value, ...]:
    return tuple(Value(f'{name}{i}', value, unit) for i, value in enumerate(values, start=1))


ROWS = (
    Row(
        'GVC errors near zero after about 2 s',
        'yes',
        'every error within 0.005 m/s or rad/s from 2 s on',
        criteria.errors_vanish,
        seconds=2.5,
    ),
    Row(
        'CL with the same gains: Δu, Δw converge slowly',
        'yes',
        'after 2 s both exceed 0.005 m/s and ten times those of GVC',
        criteria.linear_slow,
        laws=BOTH,
        seconds=2.5,
    ),
    Row(
        'CL with the same gains: Δq converges very slowly',
        'yes',
        'exceeds 0.005 rad/s after 2 s and still in the last third of the run',
        criteria.pitch_slow,
        laws=('cl',),
        seconds=6.0,
    ),
    Row(
        'GVC: Δu, Δw largest; Δq largest of the angular errors, Δp not zero',
        'yes',
        'peaks of Δu, Δw above ten times Δv; Δq above Δp, Δr; Δp at least 1 % of Δq',
        criteria.largest_errors,
    ),
    Row(
        'GVC: w goes to near zero fast and does not end at zero',
        'yes',
        'after 2 s every w below 10 % of its peak; w_X or w_Z ends above 1 % of the peak of F',
        criteria.lumped_fast,
        seconds=2.5,
        knows_F=True,
    ),
    Row(
        'CL: w_X, w_Z, w_M not reduced so fast, reach no small constant',
        'yes',
        'each above ten times GVC’s after 2 s; ranges in the last third above half those of F',
        criteria.lumped_slow,
        laws=BOTH,
        seconds=6.0,
        knows_F=True,
    ),
    Row(
        'GVC: w_X, w_Z, w_M, w_N great in the first phase',
        'yes',
        'peaks before 2 s above ten times those after, and above w_Y and w_K',
        criteria.lumped_first_phase,
        seconds=2.5,
        knows_F=True,
        remark='w(0) = −F(0) under either law, since f starts at zero.',
    ),
    Row(
        'F_Z and F_M big, F_N smaller',
        'yes',
        'F_Z the largest force, F_M the largest moment, F_N below F_M',
        criteria.disturbance_sizes,
        knows_F=True,
        remark='F is an input: it tests our reading of (39).',
    ),
    Row(
        'total kinetic energy',
        f'{fixed(paper.KINETIC_ENERGY, 2)} J',
        'mean within 2 % over 0–10 s; at best partly, since the paper prints no window',
        criteria.kinetic_energy_mean,
        printed=(Value('kinetic energy', paper.KINETIC_ENERGY, 'J'),),
    ),
    Row(
        'shares of kinetic energy',
        f'{", ".join(fixed(share, 2) for share in paper.SHARES)} %',
        'each within 1 percentage point in both windows',
        criteria.kinetic_energy_shares,
        printed=_listed('share of ξ', paper.SHARES, '%'),
    ),
    Row(
        'Δξ: sway deformed, about 0.01 m/s',
        f'{fixed(paper.SWAY_DEFORMATION, 2)} m/s',
        'largest linear Δξ, and 0.01 when rounded to two decimals',
        criteria.sway_deformed,
        remark='Scales with the mass, which is reconstructed.',
        printed=(Value('Δξ2', paper.SWAY_DEFORMATION, 'm/s'),),
    ),
    Row(
        'Δξ: roll deformed',
        'yes',
        'largest angular Δξ, and above the roll rate itself',
        criteria.roll_deformed,
        remark='M46 was reconstructed with this in view: no independent confirmation.',
    ),
    Row(
        'Δπ: only pitch significant',
        'yes',
        'its peak above ten times that of every other axis',
        criteria.pitch_input,
    ),
    Row(
        'inputs of GVC and CL differ only slightly in Case 1',
        'yes',
        'peak and RMS after 2 s within 10 % on every axis; partly if only the RMS is',
        criteria.inputs_similar,
        laws=BOTH,
        seconds=2.5,
    ),
    Row(
        'q strongly coupled with the others, and sensitive',
        'yes',
        'Δπ of pitch above ten times that of every other axis; under each law the RMS of Δq is the '
        'one of the six that follows the set-points of the others most, and the gains most',
        criteria.pitch_sensitive,
        laws=BOTH,
        remark='The paper’s sentence names changes of other velocities and disturbances; its step '
        '3 asks for a change of gains.',
        responds=True,
    ),
    Row(
        'energy mainly in ξ3 and ξ1',
        'yes',
        'the largest shares in this order, together above 99 %',
        criteria.energy_in_two,
    ),
    Row(
        'GVC reaches the final errors earlier',
        'yes',
        'all errors within 0.005 for good at an earlier time than CL’s',
        criteria.earlier,
        laws=BOTH,
        cases=('case2',),
        seconds=6.0,
    ),
    Row(
        'CL oscillates more',
        'yes',
        'larger total variation of every error that exceeds 0.005 under either law',
        criteria.oscillates,
        laws=BOTH,
        cases=('case2',),
        seconds=6.0,
    ),
    Row(
        'efforts comparable',
        'yes',
        'RMS after 2 s within 5 % on every axis; partly if on four',
        criteria.efforts_comparable,
        laws=BOTH,
        cases=('case2',),
        seconds=2.5,
    ),
    Row(
        'τ_X, τ_Z at the start larger for GVC',
        'yes',
        'largest magnitude of the first 2 s above that of CL on both axes',
        criteria.larger_start,
        laws=BOTH,
        cases=('case2',),
    ),
    Row(
        'N',
        ', '.join(fixed(entry, 1) for entry in paper.N),
        'equal when rounded to the printed decimal',
        criteria.decomposition,
        laws=(),
        cases=paper.CASES,
        remark='M was reconstructed from this N: it tests the decomposition.',
        printed=_listed('N', paper.N, 'kg, kg m2'),
    ),
)


HERE = Path(__file__).parent
Part = tuple[list[Section], list[Sentence]]  # of a report

SAME = 1e-3  # of the peak: set-points and disturbances that are nearer are the paper's


def judge_runs(
    runs: Mapping[str, Run | RunDigest], summaries: Mapping[str, Mapping[str, Any]]
) -> list[Claim]:
    """The paper's claims, each with what these runs say of it.

    Parameters
    ----------
    runs : name -> run; the paper's are known by their law and gains
    summaries : name -> `summarize(run)`, for the decomposition

    Returns
    -------
    claims : 21 rows where all runs are of case1 or all of case2, else none; none either where
        all of them have what the paper's have not, such as limits of actuators, or one has another
        inertia, start, set-point or disturbance than the scenario whose name it bears

    """
    scenarios = {run.scenario for run in runs.values()}
    ours = len(scenarios) == 1 and scenarios.issubset(CASES)
    if not ours or not any(is_plain(run) for run in runs.values()):
        return []
    (scenario,) = scenarios
    found = {law: paper_run(runs, law) for law in BOTH}
    known = digests({law: run for law, run in found.items() if run is not None})
    case = load_scenario(scenario)
    if not all(_is_case(run, case) for run in known.values()):
        return []
    N = next(iter(summaries.values()))['decomposition']['N']
    return judged({scenario: Evidence(known, tuple(N))})


def _is_case(run: RunDigest, case: Scenario) -> bool:
    """Whether a run has the inertia, start, set-point and disturbance of the case it is named."""
    t = run.course['t']
    wanted = {'nu_d': case.setpoint.value(t)}
    if run.knows_disturbance:
        wanted['F'] = make_disturbance(case.data['disturbance'])(t)
    begun = np.allclose(run.begin, np.concatenate(case.initial), 0.0, TINY)
    same = begun and np.allclose(run.vehicle.M, case.vehicle.M)
    return same and all(
        name in run.course
        and np.allclose(run.course[name], values, 0.0, SAME * np.abs(values).max(axis=0) + TINY)
        for name, values in wanted.items()
    )


def judged(cases: Mapping[str, Evidence]) -> list[Claim]:
    """The 21 claims, judged by what is known of the paper's cases.

    Parameters
    ----------
    cases : 'case1', 'case2' or both -> evidence; a claim on either goes by the first

    """
    return [_claim(i, row, cases) for i, row in enumerate(ROWS, start=1)]


def _claim(index: int, row: Row, cases: Mapping[str, Evidence]) -> Claim:
    case = next(name for name in (*cases, *row.cases) if name in row.cases)
    verdict, reason = _obstacle(row, case, cases.get(case))
    quote = Quotes()
    found = Judgement(MISSING, verdict) if verdict else row.judge(cases[case], quote)
    return Claim(
        index, row.claim, row.paper, found.ours, found.verdict, row.criterion,
        reason or row.remark, case, found.window, quote.values, row.printed,
    )  # fmt: skip


def _obstacle(row: Row, case: str, evidence: Evidence | None) -> tuple[Verdict | None, str]:
    """Why a row cannot be judged: its verdict and the reason; None and nothing when it can."""
    if evidence is None:
        return 'other case', f'Belongs to Case {case[-1]}.'
    for law in row.laws:
        run = evidence.runs.get(law)
        if run is None:
            gains = '(40)' if (case, law) == ('case2', 'cl') else '(36), (37)'
            return 'not evaluated', f'No run of law {law} with gains {gains}.'
        if run.duration < row.seconds:
            return 'not evaluated', f'Needs a run of at least {row.seconds:g} s.'
        if row.knows_F and not run.knows_disturbance:
            return 'not evaluated', 'F is not known for this run.'
        if row.responds and law not in evidence.responses:
            return 'not evaluated', 'Needs a study of the gains: two laws are none.'
    return None, ''


FILE = 'claims.parquet'  # every number of the table: a row each, and one at least of every claim
FACTS = ('number', 'case', 'claim', 'paper', 'ours', 'verdict', 'criterion', 'remark', 'window')
WORDS = Column('', look='below')
COLUMNS: dict[str, Shown] = {
    'number': 'no.',
    'verdict': described('verdict', 'by the criterion', look='badge'),
    'claim': described('claim and criterion', 'what decides it', look='maths'),
    'criterion': WORDS,
    'paper': described('paper', 'as printed; yes: in words', look='maths'),
    'ours': described('ours', 'computed from the runs', look='maths'),
    'remark': WORDS,
    'window': described('window', 'time that ours is of, and the case'),
    'case': WORDS,
}
CAPTION = (
    'All claims of the paper. Each verdict follows from the numbers beside it by the criterion in '
    'its row; an en dash (–) stands for what is missing.'
)
TITLE = 'What the paper reports, and what these runs give'


def claims_part(out: Path, claims: Sequence[Claim], runs: Mapping[str, RunInfo]) -> Part:
    """Section and sentences on the claims; writes `claims.parquet` where there are any."""
    sections = []
    if claims:
        write_claims(out, claims)
        blocks: list[Block] = [prose('claims', folder=HERE)]
        rows = [{name: getattr(claim, name) for name in FACTS} for claim in claims]
        if deviating := [row for row in rows if row['verdict'] in DECIDED[1:]]:
            caption = 'Claims that are not wholly reproduced.'
            blocks.append(make_table('deviations', caption, deviating, COLUMNS))
        blocks.append(make_table('claims', CAPTION, rows, COLUMNS, anchor='claim', folded=True))
        drawn = {name: paper.paper_figures(run) for name, run in runs.items()}
        blocks += [f'{name}: {join(parts)}.' for name, parts in drawn.items() if parts]
        sections.append(Section('claims', TITLE, blocks))
    if any(run.vehicle.name.startswith('herman2018') for run in runs.values()):
        title = 'What the paper gives, and what is reconstructed'
        sections.append(Section('readings', title, [prose('readings', folder=HERE)]))
    return sections, [Sentence(text, 'table-claims') for text in _counts(claims)]


def _counts(claims: Sequence[Claim]) -> Iterator[str]:
    """Number of claims by verdict."""
    if not claims:
        return
    counts = {word: [c for c in claims if c.verdict == word] for word in DECIDED}
    counts = {word: rows for word, rows in counts.items() if rows}
    parts = []
    for word, rows in counts.items():
        numbers = f' (no. {join([str(row.number) for row in rows])})'
        parts.append(f'{len(rows)} {word}{"" if word == "reproduced" else numbers}')
    decided = sum(map(len, counts.values()))
    yield f'Of the paper’s {len(claims)} claims these runs decide {decided}: {join(parts)}.'


def write_claims(folder: Path, claims: Sequence[Claim]) -> Path:
    """Write `claims.parquet`, long: `of` says whether a number is 'ours' or the 'paper''s."""
    return write_table(folder / FILE, [row for claim in claims for row in _numbers(claim)])


def _numbers(claim: Claim) -> Iterator[dict[str, Any]]:
    facts = {name: str(getattr(claim, name)) for name in FACTS} | {'number': claim.number}
    for of, values in (('ours', claim.values), ('paper', claim.printed)):
        for entry in values:
            yield facts | {'of': of} | entry._asdict()
    if not (claim.values or claim.printed):
        yield facts | {'of': '', 'name': '', 'value': None, 'unit': ''}
