"""What Herman 2018 reports, held against the runs at hand: the claims table."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_analysis.output.text import MISSING
from auv_analysis.report.claim import BOTH, Claim, Row
from auv_analysis.report.claims_rows import ROWS
from auv_analysis.report.evidence import Evidence, Signals, Verdict
from auv_analysis.report.paper import CASES, is_plain, paper_run
from auv_analysis.report.sketch import TINY, Sketch
from auv_analysis.report.sketching import sketches
from auv_analysis.runs.run import AnyRun
from auv_analysis.scenario.scenario import load_scenario
from auv_dynamics.plant.disturbance import make_disturbance

SAME = 1e-3  # of the peak: set-points and disturbances that are nearer are the paper's
GAINS = {
    ('case1', 'gvc'): '(36), (37)',
    ('case1', 'cl'): '(36), (37)',
    ('case2', 'gvc'): '(36), (37)',
    ('case2', 'cl'): '(40)',
}


def claims_table(
    runs: Mapping[str, AnyRun | Sketch], summaries: Mapping[str, Mapping[str, Any]]
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
        inertia, set-point or disturbance than the scenario whose name it bears

    """
    scenarios = {run.scenario for run in runs.values()}
    ours = len(scenarios) == 1 and scenarios <= set(CASES)
    if not ours or not any(is_plain(run) for run in runs.values()):
        return []
    (scenario,) = scenarios
    found = {law: paper_run(runs, law) for law in BOTH}
    known = sketches({law: run for law, run in found.items() if run is not None})
    if not all(_is_case(run) for run in known.values()):
        return []
    signals = {law: Signals(run) for law, run in known.items()}
    N = next(iter(summaries.values()))['decomposition']['N']
    return judged({scenario: Evidence(signals, tuple(N))})


def _is_case(run: Sketch) -> bool:
    """Whether a run has the inertia, the set-point and the disturbance of the case it is named."""
    case, t = load_scenario(run.scenario), run.course['t']
    wanted = {'nu_d': case.setpoint.value(t)}
    if run.knows_disturbance:
        wanted['F'] = make_disturbance(case.data['disturbance'])(t)
    return np.allclose(run.vehicle.M, case.vehicle.M) and all(
        name in run.course
        and bool(
            np.all(np.abs(run.course[name] - values) <= SAME * np.abs(values).max(axis=0) + TINY)
        )
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
    case = next((name for name in cases if name in row.cases), row.cases[0])
    verdict, reason = _obstacle(row, case, cases.get(case))
    texts = index, row.claim, row.paper
    if verdict:
        return Claim(*texts, MISSING, verdict, row.criterion, reason, case, printed=row.printed)
    found = row.judge(cases[case])
    return Claim(
        *texts, found.ours, found.verdict, row.criterion, row.remark, case, found.window,
        found.values, row.printed,
    )  # fmt: skip


def _obstacle(row: Row, case: str, evidence: Evidence | None) -> tuple[Verdict | None, str]:
    """Why a row cannot be judged: its verdict and the reason; None and nothing when it can."""
    if evidence is None:
        return 'other case', f'Belongs to Case {case[-1]}.'
    for law in row.laws:
        signals = evidence.signals.get(law)
        if signals is None:
            return 'not evaluated', f'No run of law {law} with gains {GAINS[case, law]}.'
        if signals.run.duration < row.seconds:
            return 'not evaluated', f'Needs a run of at least {row.seconds:g} s.'
        if row.knows_F and not signals.run.knows_disturbance:
            return 'not evaluated', 'F is not known for this run.'
        if row.responds and law not in evidence.responses:
            return 'not evaluated', 'Needs a study of the gains: two laws are none.'
    return None, ''
