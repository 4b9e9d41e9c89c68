"""A run of a comparison, and all of them as a table with a row each."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import csv, parquet

from auv_analysis.comparison.ranking import Ranking
from auv_analysis.measures import MEASURES, flat
from auv_analysis.report.sketch import Sketch

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
    sketch : of the run, None where it diverged
    failure : why there are no figures, '' where there are some

    """

    name: str
    scenario: str
    vehicle: str
    controller: str
    law: str
    origin: str
    summary: dict[str, Any]
    sketch: Sketch | None
    failure: str = ''

    @property
    def row(self) -> dict[str, Any]:
        """Columns of the table: names, then the figures."""
        found = {'run': self.name} | {name: getattr(self, name) for name in NAMES}
        found['hold'] = self.sketch.hold if self.sketch else None
        found['failure'] = self.failure or None
        return found | {k: v for k, v in flat(self.summary).items() if k not in found}


def comparison_table(entries: Sequence[Entry]) -> pa.Table:
    """Table with a row per run; a figure that a run does not have is null."""
    rows = [entry.row for entry in entries]
    columns = dict.fromkeys(name for row in rows for name in row)
    last = [measure.name for measure in MEASURES if measure.rule != 'only']
    order = [name for name in columns if name not in last] + last
    return pa.table({name: _column(name, [row.get(name) for row in rows]) for name in order})


def _column(name: str, values: list[Any]) -> pa.Array:
    """Array of numbers, words or truths; whole numbers among others become floats."""
    kinds = {type(value) for value in values if value is not None}
    if not kinds:
        return pa.nulls(len(values), pa.string() if name in WORDS else pa.float64())
    if kinds <= {int, float} and kinds != {int}:
        return pa.array(values, pa.float64())
    return pa.array(values)


def write_table(table: pa.Table, ranking: Ranking, out: Path) -> None:
    """Write the table with the rank of each run by each measure, as Parquet and as CSV."""
    place = {run: i for i, run in enumerate(ranking.runs)}
    rows = [place.get(run) for run in table['run'].to_pylist()]
    for j, measure in enumerate(ranking.measures):
        ranks = [None if i is None else float(ranking.ranks[i, j]) for i in rows]
        known = [None if rank is None or np.isnan(rank) else rank for rank in ranks]
        table = table.append_column(f'rank.{measure.name}', pa.array(known, pa.float64()))
    parquet.write_table(table, out / TABLE)
    csv.write_csv(table, out / CSV)
