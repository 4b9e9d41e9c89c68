"""What the claims are judged by: the signals of a run and a few questions to them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.output.text import MISSING
from auv_analysis.report.quotes import Quotes, Value, decimals, short
from auv_analysis.report.sketch import FOREVER, Sketch, last_third
from auv_analysis.report.statistics import Part

Verdict = Literal['reproduced', 'partly', 'not reproduced', 'other case', 'not evaluated']
DECIDED: tuple[Verdict, ...] = ('reproduced', 'partly', 'not reproduced')


class Finding(NamedTuple):
    """What a judge says.

    Attributes
    ----------
    ours : our value as text
    verdict : by the criterion
    values : every number of the text
    window : time that the numbers are of, in words

    """

    ours: str
    verdict: Verdict
    values: tuple[Value, ...] = ()
    window: str = MISSING


@dataclass(frozen=True, eq=False)
class Signals:
    """A run and what the judges ask of its signals, which are named as in `Sketch`."""

    run: Sketch

    def part(self, name: str, first: float = 0.0, last: float = FOREVER) -> Part:
        """Statistics of a signal in [first, last], s from the start."""
        return self.run.part(name, first, last)

    def peak(self, name: str, first: float = 0.0, last: float = FOREVER) -> np.ndarray:
        """Largest magnitudes (6,) of a signal in [first, last]."""
        return self.part(name, first, last).peak

    def late_peak(self, name: str) -> np.ndarray:
        """Largest magnitudes (6,) after the transient."""
        return self.peak(name, TRANSIENT)

    def late_rms(self, name: str) -> np.ndarray:
        """Root mean squares (6,) after the transient."""
        return self.part(name, TRANSIENT).rms

    def last_third(self, name: str) -> Part:
        """Statistics of a signal in the last third of the run."""
        return self.part(name, last_third(self.run))


@dataclass(frozen=True, eq=False)
class Response:
    """How the RMS velocity errors under one law answer to what is changed.

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
    signals : law -> signals of its run
    N : (6,) of the decomposition, kg and kg m2
    responses : law -> what its errors follow; empty where nobody has looked

    """

    signals: Mapping[str, Signals]
    N: tuple[float, ...]
    responses: Mapping[str, Response] = field(default_factory=dict)

    @property
    def gvc(self) -> Signals:
        """Signals of the GVC run."""
        return self.signals['gvc']

    @property
    def cl(self) -> Signals:
        """Signals of the CL run."""
        return self.signals['cl']

    @property
    def both(self) -> tuple[Signals, Signals]:
        """GVC, then CL."""
        return self.gvc, self.cl


def grade(parts: Iterable[bool]) -> Verdict:
    """All parts of a claim, some of them, none."""
    parts = [bool(part) for part in parts]
    return 'reproduced' if all(parts) else 'partly' if any(parts) else 'not reproduced'


def spell(*ends: tuple[float, float]) -> str:
    """Windows (from, to) in s as words: '0–10 s; 0–30 s'."""
    return '; '.join(f'{first:g}–{last:g} s' for first, last in dict.fromkeys(ends))


def settled(quote: Quotes, law: str, run: Sketch, word: str = '') -> str:
    """'1.68 s' with a word before it, or that it did not happen in the run."""
    if run.settled < FOREVER:
        return f'{word}{quote(f"settled, {law}", run.settled, "s", decimals(2))} s'
    return f'not in {quote(f"length of the run, {law}", run.duration, "s", short)} s'
