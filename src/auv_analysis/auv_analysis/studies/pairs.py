"""Paired comparison: Wilcoxon's signed-rank test, effect size and ratio, Holm's correction."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

TIE = 1e-6  # relative difference of two that are the same: what a search leaves is no finding
NEVER = np.log(1e300)  # of the ratio of what does not exist to what does
KNOWN = NEVER / 4  # of a ratio: one above it is that of values that do not exist
CONFIDENCE = 0.95
HALVINGS = 60  # of the bisection
MOST = 20_000  # pairs; of more, as many quantiles stand for all in the ratio and its interval


@dataclass(frozen=True)
class Pairs:
    """Ratios of one sample to another, pair by pair.

    Attributes
    ----------
    smaller, larger : shares of the pairs in which the first is smaller, and larger
    effect : matched-pairs rank-biserial correlation, the signed-rank sum as a part of its largest
        value: -1 where the first is smaller in every pair, 1 where it is larger
    ratio : Hodges-Lehmann estimate of the ratio, the median of the geometric means of all two
        ratios: below 1 where `effect` is below 0; None where it is that of values which do not
        exist
    interval : 95 % interval of the ratio, those values that the test does not reject; None as well,
        and of fewer than five pairs, of which it rejects none
    p : two-sided Wilcoxon signed-rank test of the logarithms of the ratios

    """

    smaller: float
    larger: float
    effect: float
    ratio: float | None
    interval: tuple[float, float] | None
    p: float


def log_ratios(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n,) logarithms of the ratios x to y: 0 for a tie.

    What is not finite is larger than what is; where both are not, they are tied.
    """
    x, y = (np.nan_to_num(values, nan=np.inf, posinf=np.inf) for values in (x, y))
    with np.errstate(divide='ignore', invalid='ignore'):
        d = np.clip(np.nan_to_num(np.log(x) - np.log(y), nan=0.0), -NEVER, NEVER)
    return np.where(np.abs(d) < TIE, 0.0, d)


def paired(d: np.ndarray, *, test: bool = True) -> Pairs:
    """Compare two samples.

    Parameters
    ----------
    d : (n,) of `log_ratios`, one pair at least
    test : whether p is asked for, which takes longest; else it is NaN

    Returns
    -------
    pairs : Pairs; the verdict is the sign of `effect`, not the majority of the pairs

    """
    ordered, n = np.sort(d), len(d)
    bound = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2) * np.sqrt((2 * n + 1) / (1.5 * n * (n + 1)))
    few = ordered if n <= MOST else ordered[((np.arange(MOST) + 0.5) * (n / MOST)).astype(int)]
    low, high = _crossing(few, bound, np.greater), _crossing(few, -bound, np.greater_equal)
    middle = (_crossing(few, 0, np.greater) + _crossing(few, 0, np.greater_equal)) / 2
    known = abs(middle) < KNOWN
    ends = float(np.exp(low)), float(np.exp(high))
    return Pairs(
        smaller=float((d < 0).mean()),
        larger=float((d > 0).mean()),
        effect=_effect(ordered),
        ratio=float(np.exp(middle)) if known else None,
        interval=ends if known and bound < 1 and max(abs(low), abs(high)) < KNOWN else None,
        p=_p(d) if test else np.nan,
    )


def _effect(ordered: np.ndarray) -> float:
    """Signed-rank sum of sorted (n,), as a part of its largest value.

    It is the number of Walsh averages (d_i + d_j) / 2, i <= j, above 0 less that below it.
    """
    n = len(ordered)
    sides = [np.searchsorted(ordered, -ordered, side).sum() for side in ('left', 'right')]
    return (n * n - int(sum(sides)) + int(np.sign(ordered).sum())) / (n * (n + 1))


def _crossing(ordered: np.ndarray, level: float, above: np.ufunc) -> float:
    """Where `_effect` of `ordered` less a shift ceases to be above a level as the shift grows.

    By bisection. How many d_j are below 2 * shift - d_i is counted anew only for those d_i where
    it differs between the ends of the interval.
    """
    n, low, high = len(ordered), float(ordered[0]), float(ordered[-1])
    others, least, most = ordered, np.zeros(n, int), np.full(n, n)
    counted = 0  # twice the sum over all other i
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        left, right = (np.searchsorted(ordered, 2 * middle - others, s) for s in ('left', 'right'))
        alone = n - sum(int(np.searchsorted(ordered, middle, s)) for s in ('left', 'right'))
        signed = n * n - counted - int(left.sum() + right.sum()) + alone
        if above(signed / (n * (n + 1)), level):
            low, least = middle, left
        else:
            high, most = middle, right
        open_ = least < most
        counted += 2 * int(least[~open_].sum())
        others, least, most = others[open_], least[open_], most[open_]
    return high


def _p(d: np.ndarray) -> float:
    if np.all(d == 0):
        return 1.0
    from scipy.stats import wilcoxon

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
