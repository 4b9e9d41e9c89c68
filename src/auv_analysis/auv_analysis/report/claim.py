"""A claim of the paper: before it is judged, and after."""

from collections.abc import Callable
from dataclasses import dataclass

from auv_analysis.output.text import MISSING
from auv_analysis.report.evidence import Evidence, Finding, Verdict
from auv_analysis.report.quotes import Value

BOTH = ('gvc', 'cl')


@dataclass(frozen=True)
class Row:
    """A claim before it is judged.

    Attributes
    ----------
    claim, paper, criterion, remark : as in `Claim`
    judge : the finding from the evidence
    laws : whose runs, with the paper's gains, it needs
    cases : scenarios that it belongs to
    seconds : shortest run that decides it
    knows_F : whether it needs the true lumped uncertainty
    responds : whether it needs to know what the errors follow
    printed : the numbers of `paper`

    """

    claim: str
    paper: str
    criterion: str
    judge: Callable[[Evidence], Finding]
    laws: tuple[str, ...] = ('gvc',)
    cases: tuple[str, ...] = ('case1',)
    seconds: float = 0.0
    knows_F: bool = False
    remark: str = ''
    responds: bool = False
    printed: tuple[Value, ...] = ()


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
    case : scenario that ours is of, or that the claim belongs to
    window : time that ours is of, in words; an en dash where nothing is
    values : every number of `ours`
    printed : every number of `paper`

    """

    number: int
    claim: str
    paper: str
    ours: str
    verdict: Verdict
    criterion: str
    remark: str = ''
    case: str = ''
    window: str = MISSING
    values: tuple[Value, ...] = ()
    printed: tuple[Value, ...] = ()
