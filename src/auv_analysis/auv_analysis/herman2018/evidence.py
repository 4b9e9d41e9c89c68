"""Evidence for a claim: runs with the gains of the paper, numbers kept beside their text."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Literal, NamedTuple

import numpy as np

from auv_analysis.output.text import MISSING, fixed, number
from auv_analysis.report.digest import FOREVER, RunDigest

Text = Callable[[float], str]
UNBOUNDED = 'unbounded'


class Value(NamedTuple):
    """A number that a sentence shows.

    Attributes
    ----------
    name : what it is, unique within its sentence
    value : None where it does not exist
    unit : empty for a ratio

    """

    name: str
    value: float | None
    unit: str


class Quotes:
    """Makes numbers into text and keeps what it made into text."""

    def __init__(self) -> None:
        self._values: dict[str, Value] = {}

    @property
    def values(self) -> tuple[Value, ...]:
        """All numbers so far, in their order."""
        return tuple(self._values.values())

    def __call__(self, name: str, value: float, unit: str = '', text: Text | int = 3) -> str:
        """Text of a number.

        Parameters
        ----------
        name, value, unit : as of `Value`
        text : makes the text; a number of significant digits for `number`

        """
        value = float(value)
        entry = Value(name, value if isfinite(value) else None, unit)
        if (known := self._values.setdefault(name, entry)) != entry:  # shown twice, it stands once
            raise ValueError(f'expected one value of {name}, found {known} and {entry}')
        if not isfinite(value):
            return UNBOUNDED
        return number(value, text) if isinstance(text, int) else text(value)

    def listed(
        self, names: Sequence[str], values: Iterable[float], unit: str, text: Text | int = 3
    ) -> str:
        """Texts of several numbers, separated by commas."""
        return ', '.join(self(*pair, unit, text) for pair in zip(names, values, strict=True))


def decimals(count: int) -> Text:
    """Text with that many decimals."""
    return lambda value: fixed(value, count)


def short(value: float) -> str:
    """Text of a time that is round: 10, 0.5."""
    return f'{value:g}'


def percent(value: float) -> str:
    """Text of a change in % with its sign."""
    return f'{value:+z.1f}'.replace('-', '−')


Verdict = Literal['reproduced', 'partly', 'not reproduced', 'other case', 'not evaluated']
DECIDED: tuple[Verdict, ...] = ('reproduced', 'partly', 'not reproduced')


class Judgement(NamedTuple):
    """Verdict of a judge.

    Attributes
    ----------
    ours : our value as text
    verdict : by the criterion
    window : time that the numbers are of, in words

    """

    ours: str
    verdict: Verdict
    window: str = MISSING


@dataclass(frozen=True, eq=False)
class ErrorSensitivity:
    """Response of the RMS velocity errors under one law to changes.

    Attributes
    ----------
    gains : (6,) standard deviation of ln(error) when every gain varies on its own
    others : (6,) relative change of the error per relative change of the set-points of the other
        degrees of freedom, root of the sum of squares

    """

    gains: np.ndarray
    others: np.ndarray


@dataclass(frozen=True)
class Evidence:
    """The runs with the paper's gains; a judge is only asked when those that it needs exist.

    Attributes
    ----------
    runs : law -> its run
    N : (6,) of the decomposition, kg and kg m2
    responses : law -> what its errors follow; empty where nobody has looked

    """

    runs: Mapping[str, RunDigest]
    N: tuple[float, ...]
    responses: Mapping[str, ErrorSensitivity] = field(default_factory=dict)

    @property
    def gvc(self) -> RunDigest:
        """The GVC run."""
        return self.runs['gvc']

    @property
    def cl(self) -> RunDigest:
        """The CL run."""
        return self.runs['cl']

    @property
    def both(self) -> tuple[RunDigest, RunDigest]:
        """GVC, then CL."""
        return self.gvc, self.cl


def grade(parts: Iterable[bool]) -> Verdict:
    """All parts of a claim, some of them, none."""
    parts = [bool(part) for part in parts]
    return 'reproduced' if all(parts) else 'partly' if any(parts) else 'not reproduced'


def spell(*ends: tuple[float, float]) -> str:
    """Windows (from, to) in s as words: '0–10 s; 0–30 s'."""
    return '; '.join(f'{first:g}–{last:g} s' for first, last in dict.fromkeys(ends))


def settled(quote: Quotes, law: str, run: RunDigest, word: str = '') -> str:
    """'1.68 s' with a word before it, or that it did not happen in the run."""
    if run.settled < FOREVER:
        return f'{word}{quote(f"settled, {law}", run.settled, "s", decimals(2))} s'
    return f'not in {quote(f"length of the run, {law}", run.duration, "s", short)} s'


BOTH = ('gvc', 'cl')


@dataclass(frozen=True)
class Row:
    """A claim before it is judged.

    Attributes
    ----------
    claim, paper, criterion, remark : as in `Claim`
    judge : the finding from the evidence; what makes its numbers into text keeps them
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
    judge: Callable[[Evidence, Quotes], Judgement]
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
