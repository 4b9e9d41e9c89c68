"""Controllers compared draw by draw: paired differences, their interval, and a paired test."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import bootstrap, wilcoxon

from auv_analysis.tuning.measures import Measures

COMPARED = ('weighted_error', 'error', 'effort', 'late_error', 'settling')
TIE = 1e-9  # relative difference below which two numbers are the same: rounding is no finding
DIVERGED = np.log(1e12)  # of the ratio of a loop that diverged to one that did not
RESAMPLES = 4999
CONFIDENCE = 0.95
LEVEL = 0.05  # of Holm's p below which a difference is called one


@dataclass(frozen=True)
class Comparison:
    """A controller against another one in one measure, over the same draws.

    Attributes
    ----------
    controller, against : their names
    measure : one of `COMPARED`
    draws : number of pairs
    median : of the ratios, controller to against; None where a loop of one of the two diverged or
        does not settle in half of the draws or more
    interval : 95 % bootstrap interval of that median; None with it
    smaller, larger : shares of draws in which the controller's is smaller, and larger
    p : two-sided Wilcoxon signed-rank test of the logarithms of the ratios
    p_holm : the same after Holm's correction for all comparisons of the document

    """

    controller: str
    against: str
    measure: str
    draws: int
    median: float | None
    interval: tuple[float, float] | None
    smaller: float
    larger: float
    p: float
    p_holm: float = 1.0

    @property
    def verdict(self) -> int:
        """-1 smaller, 1 larger, 0 no difference that the test tells from chance."""
        if self.p_holm >= LEVEL:
            return 0
        return -1 if self.smaller > self.larger else 1


def compare(
    found: Mapping[str, Measures], pairs: Iterable[tuple[str, str]], seed: int
) -> list[Comparison]:
    """Compare pairs of controllers in every measure that exists, of a loop in a draw at least.

    Parameters
    ----------
    found : controller -> Measures of (n,), row i of all of the same draw
    pairs : (controller, against)
    seed : of the bootstrap

    Returns
    -------
    comparisons : corrected for their number

    """
    known = [
        measure
        for measure in COMPARED
        if any(np.isfinite(getattr(measures, measure)).any() for measures in found.values())
    ]
    rows = [
        _compared(a, b, measure, log_ratios(found[a], found[b], measure), seed)
        for a, b in pairs
        for measure in known
    ]
    adjusted = holm([row.p for row in rows])
    return [replace(row, p_holm=p) for row, p in zip(rows, adjusted, strict=True)]


def log_ratios(a: Measures, b: Measures, measure: str) -> np.ndarray:
    """(n,) logarithms of the ratios of a measure, a to b: 0 for a tie.

    What diverged, or did not settle, is larger than what did; where both did not, they are tied.
    """
    x, y = (np.nan_to_num(getattr(m, measure), nan=np.inf, posinf=np.inf) for m in (a, b))
    with np.errstate(divide='ignore', invalid='ignore'):
        d = np.clip(np.nan_to_num(np.log(x) - np.log(y), nan=0.0), -DIVERGED, DIVERGED)
    return np.where(np.abs(d) < TIE, 0.0, d)


def _compared(
    controller: str, against: str, measure: str, d: np.ndarray, seed: int
) -> Comparison:  # fmt: skip
    median, interval = _median(d, seed)
    smaller, larger = float((d < 0).mean()), float((d > 0).mean())
    p = _wilcoxon(d)
    return Comparison(controller, against, measure, len(d), median, interval, smaller, larger, p)


def _median(
    d: np.ndarray, seed: int
) -> tuple[float | None, tuple[float, float] | None]:  # fmt: skip
    """Median ratio and its interval, None where it is that of loops that diverged."""
    median = float(np.median(d))
    if abs(median) >= DIVERGED:
        return None, None
    if np.all(d == d[0]):
        return float(np.exp(median)), (float(np.exp(median)),) * 2
    interval = bootstrap(
        (d,), np.median, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method='percentile',
        batch=500, rng=seed,
    ).confidence_interval  # fmt: skip
    return float(np.exp(median)), (float(np.exp(interval.low)), float(np.exp(interval.high)))


def _wilcoxon(d: np.ndarray) -> float:
    if np.all(d == 0):
        return 1.0
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # of few draws
        return float(wilcoxon(d, zero_method='zsplit').pvalue)


def holm(p: Sequence[float]) -> list[float]:
    """Holm's step-down correction: the k-th smallest of m times m - k + 1, never decreasing."""
    order = np.argsort(p, kind='stable')
    scaled = np.asarray(p)[order] * np.arange(len(p), 0, -1)
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return adjusted.tolist()
