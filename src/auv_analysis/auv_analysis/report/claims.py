"""What Herman 2018 reports, held against the runs at hand: the claims table."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from auv_analysis.report.claims_rows import BOTH, ROWS, Row
from auv_analysis.report.evidence import Evidence, Signals, Verdict
from auv_analysis.report.paper import CASES, is_plain, paper_run
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.sketching import sketches
from auv_analysis.report.text import MISSING
from auv_analysis.run import AnyRun

GAINS = {
    ('case1', 'gvc'): '(36), (37)',
    ('case1', 'cl'): '(36), (37)',
    ('case2', 'gvc'): '(36), (37)',
    ('case2', 'cl'): '(40)',
}


@dataclass(frozen=True)
class Claim:
    """One row of the table.

    Attributes
    ----------
    number : of the row
    claim, paper : what the paper says, and its value where it prints one
    ours : computed from the runs; an en dash where nothing is
    verdict : by the criterion
    criterion : when the claim counts as reproduced, or why it is not evaluated
    remark : what a reader must know to weigh the verdict

    """

    number: int
    claim: str
    paper: str
    ours: str
    verdict: Verdict
    criterion: str
    remark: str = ''


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
        all of them have what the paper's have not, such as limits of actuators

    """
    scenarios = {run.scenario for run in runs.values()}
    ours = len(scenarios) == 1 and scenarios <= set(CASES)
    if not ours or not any(is_plain(run) for run in runs.values()):
        return []
    (scenario,) = scenarios
    found = {law: paper_run(runs, law) for law in BOTH}
    known = sketches({law: run for law, run in found.items() if run is not None})
    signals = {law: Signals(run) for law, run in known.items()}
    N = next(iter(summaries.values()))['decomposition']['N']
    evidence = Evidence(signals, tuple(N))
    return [_claim(i, row, scenario, evidence) for i, row in enumerate(ROWS, start=1)]


def _claim(index: int, row: Row, scenario: str, evidence: Evidence) -> Claim:
    verdict, reason = _obstacle(row, scenario, evidence)
    if verdict:
        return Claim(index, row.claim, row.paper, MISSING, verdict, row.criterion, reason)
    finding = row.judge(evidence)
    return Claim(index, row.claim, row.paper, *finding, row.criterion, row.remark)


def _obstacle(row: Row, scenario: str, evidence: Evidence) -> tuple[Verdict | None, str]:
    """Why a row cannot be judged: its verdict and the reason; None and nothing when it can."""
    if scenario not in row.cases:
        return 'other case', f'Belongs to Case {row.cases[0][-1]}.'
    for law in row.laws:
        signals = evidence.signals.get(law)
        if signals is None:
            return 'not evaluated', f'No run of law {law} with gains {GAINS[scenario, law]}.'
        if signals.run.duration < row.seconds:
            return 'not evaluated', f'Needs a run of at least {row.seconds:g} s.'
        if row.knows_F and not signals.run.knows_disturbance:
            return 'not evaluated', 'F is not known for this run.'
    return None, ''
