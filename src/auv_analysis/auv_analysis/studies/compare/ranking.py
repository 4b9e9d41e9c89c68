"""Runs of a comparison as a table with a row each, and their ranks by every measure."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pyarrow import csv, parquet
from scipy.stats import rankdata

from auv_analysis.metrics.measures import MEASURES, Measure, flat
from auv_analysis.output.arrow import pa
from auv_analysis.report.digest import RunDigest
from auv_analysis.report.results import array_of

ERRORS = 'overall.velocity_error.rms.linear'


@dataclass(frozen=True, eq=False)
class Ranking:
    """Ranks of the runs that have figures, in the order of their mean rank.

    Attributes
    ----------
    runs : names (n,)
    measures : those that differ between the runs (m,)
    ranks : (n, m), 1 for the smallest, equal values share one; NaN where there is no value, but
        what does not settle comes last
    ratios : (n, m) log2 of value / median of the positive ones; NaN where there is none or zero

    """

    runs: Sequence[str]
    measures: Sequence[Measure]
    ranks: np.ndarray
    ratios: np.ndarray


def rank(table: pa.Table) -> Ranking:
    """Ranking of the runs of `comparison_table`."""
    names = np.array(table['run'].to_pylist())
    there = np.array([failure is None for failure in table['failure'].to_pylist()])
    values = np.array([table[m.name].to_pylist() for m in MEASURES], float).T[there]
    differ = [
        j for j in range(len(MEASURES)) if len({v for v in values[:, j] if np.isfinite(v)}) > 1
    ]
    measures = [MEASURES[j] for j in differ]
    values = values[:, differ]
    errors = [v is not None for v in table[ERRORS].to_pylist()]
    tracks = np.array(errors)[there]  # whether there is a set-point, and so something to settle
    ranks = np.zeros(values.shape)
    for j, measure in enumerate(measures):
        ranks[:, j] = _ranks(values[:, j], measure, tracks)
    mean = np.nanmean(ranks, axis=1) if measures else np.arange(len(values))
    order = np.argsort(mean, kind='stable')
    return Ranking(names[there][order].tolist(), measures, ranks[order], _ratios(values)[order])


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
    return np.log2(positive / np.nanmedian(positive, axis=0))


TABLE, CSV = 'comparison.parquet', 'comparison.csv'
NAMES = ('scenario', 'vehicle', 'controller', 'law', 'origin')
WORDS = (*NAMES, 'hold', 'failure')


@dataclass(frozen=True, eq=False)
class Entry:
    """One run of a comparison.

    Attributes
    ----------
    name : tells it from the others
    scenario, vehicle, controller, law : names
    origin : where it was read from, or that it was simulated for the comparison
    summary : of `summarize`; empty where the run diverged
    digest : of the run, None where it diverged
    failure : why there are no figures, '' where there are some

    """

    name: str
    scenario: str
    vehicle: str
    controller: str
    law: str
    origin: str
    summary: dict[str, Any]
    digest: RunDigest | None
    failure: str = ''

    @property
    def row(self) -> dict[str, Any]:
        """Columns of the table: names, then the figures."""
        found = {'run': self.name} | {name: getattr(self, name) for name in NAMES}
        found['hold'] = self.digest.hold if self.digest else None
        found['failure'] = self.failure or None
        return found | {k: v for k, v in flat(self.summary).items() if k not in found}


def comparison_table(entries: Sequence[Entry]) -> pa.Table:
    """Table with a row per run; a figure that a run does not have is null."""
    rows = [entry.row for entry in entries]
    columns = dict.fromkeys(name for row in rows for name in row)
    last = [measure.name for measure in MEASURES if measure.rule != 'only']
    order = [name for name in columns if name not in last] + last
    values = {name: [row.get(name) for row in rows] for name in order}
    return pa.table({
        name: pa.array(column, pa.string()) if name in WORDS else array_of(column)
        for name, column in values.items()
    })  # fmt: skip


def write_table(table: pa.Table, ranking: Ranking, out: Path) -> None:
    """Write the table with the rank of each run by each measure, as Parquet and as CSV."""
    place = {run: i for i, run in enumerate(ranking.runs)}
    rows = [place.get(run) for run in table['run'].to_pylist()]
    for j, measure in enumerate(ranking.measures):
        ranks = [None if i is None else float(ranking.ranks[i, j]) for i in rows]
        table = table.append_column(f'rank.{measure.name}', array_of(ranks))
    parquet.write_table(table, out / TABLE)
    csv.write_csv(table, out / CSV)
