"""Which of several unknowns decides an outcome: the best single question, a tree of one level."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Split:
    """The question that parts the outcomes best.

    Attributes
    ----------
    unknown : its name
    threshold : the two sides are values below and above it
    below, above : share of the outcome of interest on either side, %
    explained : share of the impurity (Gini) that the question takes away, 0 to 1

    """

    unknown: str
    threshold: float
    below: float
    above: float
    explained: float


def best_split(
    unknowns: Mapping[str, np.ndarray], outcomes: np.ndarray, interest: str
) -> Split | None:
    """Question about one unknown that parts outcomes best; None where they are all the same.

    Parameters
    ----------
    unknowns : name -> (n,) numbers
    outcomes : (n,) words
    interest : the outcome whose shares are given

    """
    names, codes = np.unique(outcomes.astype(str), return_inverse=True)
    if len(names) < 2:
        return None
    marks = np.eye(len(names))[codes]
    whole = _impurity(marks.sum(axis=0)[None])[0]
    wanted = marks @ (names == interest)
    splits = []
    for name, values in unknowns.items():
        for threshold, left in _cuts(values, marks):
            low = values < threshold
            below, above = (float(100 * wanted[side].mean()) for side in (low, ~low))
            splits.append(Split(name, threshold, below, above, float(1 - left / whole)))
    return max(splits, key=lambda split: split.explained) if splits else None


def _cuts(values: np.ndarray, marks: np.ndarray) -> list[tuple[float, float]]:
    """Thresholds between different values, and the impurity that each of them leaves."""
    order = np.argsort(values, kind='stable')
    ranked, counts = values[order], np.cumsum(marks[order], axis=0)
    at = np.flatnonzero(np.diff(ranked) > 0)
    below, above = counts[at], counts[-1] - counts[at]
    left = _impurity(below) * below.sum(axis=1) + _impurity(above) * above.sum(axis=1)
    middle = 0.5 * (ranked[at] + ranked[at + 1])
    return list(zip(middle.tolist(), (left / len(values)).tolist(), strict=True))


def _impurity(counts: np.ndarray) -> np.ndarray:
    """Gini impurities (k,) of counts (k, classes)."""
    shares = counts / counts.sum(axis=1, keepdims=True)
    return 1.0 - (shares**2).sum(axis=1)
