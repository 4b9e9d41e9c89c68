"""Which claims hold whatever the paper leaves open, and what decides those that do not."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from auv_analysis.report.claims_rows import ROWS
from auv_analysis.report.evidence import DECIDED
from auv_analysis.report.paper import KINETIC_ENERGY
from auv_analysis.study.attribution import Split, best_split
from auv_analysis.study.unknowns import NAMES
from auv_analysis.study.unknowns_run import Unknowns

HOLDS = 'holds over all'
FAILS = 'fails over all'
PARTLY = 'partly in all'
VARIES = 'varies'
OPEN = 'not evaluated'
PART = ', of those evaluated'  # behind an outcome where some are not


@dataclass(frozen=True)
class Held:
    """Verdicts on one claim over several variants and windows.

    Attributes
    ----------
    percent : verdict -> share, %
    outcome : 'holds over all': reproduced in all; 'fails over all': not reproduced in any; 'partly
        in all'; 'not evaluated' in any; else 'varies'; what is only true of those that could be
        evaluated says so
    split : what decides it, with the shares of the best verdict that occurs; None where the verdict
        never changes

    """

    percent: Mapping[str, float]
    outcome: str
    split: Split | None


@dataclass(frozen=True)
class Robustness:
    """One claim over all that the paper leaves open.

    Attributes
    ----------
    number, claim : of the row
    shipped : verdicts with the shipped values, one per window
    every : over all variants and windows
    as_read : over those with the sign of (39)'s exponents as it is read, -1

    """

    number: int
    claim: str
    shipped: tuple[str, ...]
    every: Held
    as_read: Held


def robustness(found: Unknowns) -> list[Robustness]:
    """The 21 claims over all variants that came to their end and over all windows."""
    unknowns = columns_of(found)
    read = unknowns['exponent_sign'] < 0
    of_read = {name: values[read] for name, values in unknowns.items()}
    shipped = next((i for i, v in enumerate(found.variants) if v.kind == 'shipped'), None)
    rows = []
    for i, row in enumerate(ROWS):
        every = found.verdicts[:, :, i].ravel()
        first = () if shipped is None else tuple(found.verdicts[shipped, :, i])
        helds = held(unknowns, every), held(of_read, every[read])
        rows.append(Robustness(i + 1, row.claim, first, *helds))
    return rows


def held(unknowns: Mapping[str, np.ndarray], verdicts: np.ndarray) -> Held:
    """Shares, outcome and deciding unknown of verdicts (n,)."""
    total = max(len(verdicts), 1)
    percent = {str(v): 100.0 * int(np.sum(verdicts == v)) / total for v in DECIDED}
    best = next((verdict for verdict, part in percent.items() if part > 0), DECIDED[0])
    known = np.isin(verdicts.astype(str), DECIDED)
    whole = dict(zip(map(str, DECIDED), (HOLDS, PARTLY, FAILS), strict=True))
    outcome = OPEN
    if known.any():
        outcome = whole[best] if np.all(verdicts[known] == best) else VARIES
        outcome += '' if known.all() else PART
    of_known = {name: values[known] for name, values in unknowns.items()}
    return Held(percent, outcome, best_split(of_known, verdicts[known], best))


def columns_of(found: Unknowns) -> dict[str, np.ndarray]:
    """Name of an unknown -> its value for each variant and window, (V W,)."""
    count = len(found.windows)
    columns = {
        name: np.repeat([float(getattr(variant, name)) for variant in found.variants], count)
        for name in NAMES
    }
    return columns | {'window': np.tile(found.windows, len(found.variants))}


@dataclass(frozen=True)
class EnergyRange:
    """Mean kinetic energy over a window, over all variants, J.

    Attributes
    ----------
    window : its end, s
    shipped, low, high : with the shipped values, smallest and largest

    """

    window: float
    shipped: float
    low: float
    high: float

    @property
    def away(self) -> float:
        """Largest distance from the paper's value, % of it."""
        ends = np.array([self.low, self.high])
        return float(100.0 * np.abs(ends / KINETIC_ENERGY - 1.0).max())


def energy_ranges(found: Unknowns) -> list[EnergyRange]:
    """Ranges over the windows that the claims are judged over."""
    total = found.energy.sum(axis=2)
    places = [int(np.argmin(np.abs(found.ends - window))) for window in found.windows]
    return [
        EnergyRange(float(found.ends[i]), *map(float, (total[0, i], *_ends(total[:, i]))))
        for i in places
    ]


def met(found: Unknowns) -> tuple[float, float, float] | None:
    """Ends T in s of the window that would give the paper's energy: shipped, first and last.

    None where there is no such T, or several, for a variant.
    """
    every = [list(crossings(found.ends, line, KINETIC_ENERGY)) for line in found.energy.sum(axis=2)]
    if any(len(times) != 1 for times in every):
        return None
    times = np.array(every)[:, 0]
    return float(times[0]), float(times.min()), float(times.max())


def crossings(ends: np.ndarray, energy: np.ndarray, level: float) -> Iterator[float]:
    """Times at which a line (K,) over `ends` (K,) meets a level, linear between its points."""
    above = energy - level
    for i in np.flatnonzero(np.sign(above[:-1]) * np.sign(above[1:]) < 0).tolist():
        part = above[i] / (above[i] - above[i + 1])
        yield float(ends[i] + part * (ends[i + 1] - ends[i]))


def _ends(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())
