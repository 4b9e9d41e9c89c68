"""Runs in the order of the measures that sum them up."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from scipy.stats import rankdata

from auv_analysis.measures import MEASURES, Measure

ERRORS = 'overall.velocity_error.rms.linear'


@dataclass(frozen=True, eq=False)
class Ranking:
    """Ranks of the runs that have figures, in the order of their mean rank.

    Attributes
    ----------
    runs : names (n,)
    measures : those that differ between the runs (m,)
    values : (n, m), NaN where a run has none
    ranks : (n, m), 1 for the smallest, equal values share one; NaN where there is no value, but
        what does not settle comes last
    ratios : (n, m) log2 of value / median of the positive ones; NaN where there is none or zero
    mean_rank : (n,)

    """

    runs: Sequence[str]
    measures: Sequence[Measure]
    values: np.ndarray
    ranks: np.ndarray
    ratios: np.ndarray
    mean_rank: np.ndarray


def rank(table: pa.Table) -> Ranking:
    """Ranking of the runs of `comparison_table`."""
    names = np.array(table['run'].to_pylist())
    there = np.array([failure is None for failure in table['failure'].to_pylist()])
    columns = [table[m.name].to_pylist() for m in MEASURES]
    values = np.array(
        [[np.nan if v is None else v for v in values] for values in columns], float
    ).T[there]
    differ = [
        j for j in range(len(MEASURES)) if len({v for v in values[:, j] if np.isfinite(v)}) > 1
    ]
    measures = [MEASURES[j] for j in differ]
    values = values[:, differ]
    errors = [v is not None for v in table[ERRORS].to_pylist()]
    tracks = np.array(errors)[there]  # whether there is a set-point, and so something to settle
    ranks = (
        np.stack([_ranks(values[:, j], m, tracks) for j, m in enumerate(measures)], axis=1)
        if measures
        else np.zeros((len(values), 0))
    )
    mean = np.nanmean(ranks, axis=1) if measures else np.arange(len(values), dtype=float)
    order = np.argsort(mean, kind='stable')
    return Ranking(
        names[there][order].tolist(),
        measures,
        values[order],
        ranks[order],
        _ratios(values)[order],
        mean[order],
    )


def _ranks(values: np.ndarray, measure: Measure, tracks: np.ndarray) -> np.ndarray:
    """Ranks (n,); a time that does not exist is later than every other."""
    known = np.isfinite(values)
    ranks = np.full(len(values), np.nan)
    if measure.unit == 's':
        ranks[tracks] = rankdata(np.where(known, values, np.inf)[tracks])
        return ranks
    ranks[known] = rankdata(values[known])
    return ranks


def _ratios(values: np.ndarray) -> np.ndarray:
    positive = np.where(values > 0, values, np.nan)
    return np.log2(positive / np.nanmedian(positive, axis=0)) if len(values) else values
