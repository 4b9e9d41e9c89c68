"""What the claims are judged by: the signals of a run and a few questions to them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from auv_analysis.report.sketch import FOREVER, Sketch, last_third
from auv_analysis.report.statistics import Part
from auv_analysis.report.text import number
from auv_analysis.summary import TRANSIENT

Verdict = Literal['reproduced', 'partly', 'not reproduced', 'other case', 'not evaluated']


class Finding(NamedTuple):
    """Our value as text, and the verdict."""

    ours: str
    verdict: Verdict


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


@dataclass(frozen=True)
class Evidence:
    """The runs with the paper's gains; a judge is only asked when those that it needs exist.

    Attributes
    ----------
    signals : law -> signals of its run
    N : (6,) of the decomposition, kg and kg m2

    """

    signals: Mapping[str, Signals]
    N: tuple[float, ...]

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


def listed(values: Iterable[float], digits: int = 3) -> str:
    """Numbers separated by commas."""
    return ', '.join(number(value, digits) for value in values)


def seconds(time: float, duration: float, word: str = '') -> str:
    """'1.68 s' with a word before it, or that it did not happen in the run."""
    return f'{word}{time:.2f} s' if time < FOREVER else f'not in {duration:g} s'
