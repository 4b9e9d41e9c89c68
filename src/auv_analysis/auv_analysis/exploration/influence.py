"""Which of the varied paths matter for which figure: by ranks, whatever the kind of the values."""

from typing import Any

import numpy as np
from scipy.stats import rankdata

from auv_analysis.exploration.quantiles import ordered
from auv_analysis.exploration.varied import Varied
from auv_analysis.measures import Measure

Row = dict[str, Any]
FEWEST = 8  # rows that a correlation is worth computing of


def influence(ranks: np.ndarray, varied: Varied, rows: np.ndarray) -> Row | None:
    """How much of the order of a figure a path explains.

    Parameters
    ----------
    ranks : (m,) of the figure
    varied : the path
    rows : (m,) indices of these rows

    Returns
    -------
    row : None where there is nothing to compare
        spearman : rank correlation, None of words and lists
        explained_percent : share of the variance of the ranks that lies between the groups of the
            path (bins of numbers, or its values), corrected for their number; it also sees what
            rises and falls again

    """
    codes = varied.codes[rows]
    groups = len(np.unique(codes))
    if len(ranks) < FEWEST or groups < 2 or np.ptp(ranks) == 0 or len(ranks) <= groups:
        return None
    spearman = None
    if varied.numbers is not None:
        others = rankdata(varied.numbers[rows])
        spearman = float(np.corrcoef(ranks, others)[0, 1])
    return {'spearman': spearman, 'explained_percent': 100 * explained(ranks, codes)}


def explained(ranks: np.ndarray, codes: np.ndarray) -> float:
    """Share of the variance between groups, less what chance alone would put there; not below 0."""
    counts = np.bincount(codes)
    sums = np.bincount(codes, ranks)
    used = counts > 0
    total = np.sum((ranks - ranks.mean()) ** 2)
    between = np.sum(sums[used] ** 2 / counts[used]) - len(ranks) * ranks.mean() ** 2
    n, k = len(ranks), int(used.sum())
    within = (total - between) / (n - k) * (n - 1) / total
    return float(np.clip(1.0 - within, 0.0, 1.0))


def ranks_of(values: np.ndarray, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
    """Ranks of the values that exist, and which rows these are; a time that does not is late."""
    at = ordered(values, measure.unit)
    there = np.flatnonzero(~np.isnan(at))
    return rankdata(at[there]), there
