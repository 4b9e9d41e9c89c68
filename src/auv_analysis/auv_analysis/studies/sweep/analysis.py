"""All that is computed of a sweep, and the files that hold it."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from auv_analysis.metrics.measures import BY_NAME, MEASURES, Measure
from auv_analysis.output.progress import each
from auv_analysis.output.text import join
from auv_analysis.studies.sweep import statistics
from auv_analysis.studies.sweep.dataset import STATUSES, Sweep
from auv_analysis.studies.sweep.factors import Varied, varied_paths
from auv_analysis.studies.sweep.indices import designed, failing, indices, omitted
from auv_analysis.studies.sweep.statistics import (
    distribution,
    figures_spread,
    influence,
    pairs,
    ranks_of,
    varying,
)
from auv_analysis.studies.sweep.variation import kind_of

DOCUMENT = 'analysis.json'
TABLES = ('quantiles', 'influence', 'dependence', 'together', 'failures', 'paired', 'indices',
          'best')  # fmt: skip
BEST_BY = 'overall.velocity_error.rms.linear'
MOST_REASONS = 5
SAMPLE = 600  # rows of a controller that are drawn as points
Row = dict[str, Any]
Line = tuple[np.ndarray, np.ndarray]


@dataclass(eq=False)
class Results:
    """What was found in a sweep.

    Attributes
    ----------
    sweep : its rows
    varied : its paths
    tables : of `TABLES` -> rows
    measures : those that differ between rows
    fixed : those that do not, with their value, None where there is none
    values : measure -> (n,) of all rows
    lines : measure, controller -> distribution function
    pair : the two paths that matter most; none where there are fewer
    notes : what is worth saying, one line each

    """

    sweep: Sweep
    varied: list[Varied]
    tables: dict[str, list[Row]]
    measures: list[Measure] = field(default_factory=list)
    fixed: dict[str, float | None] = field(default_factory=dict)
    values: dict[str, np.ndarray] = field(default_factory=dict)
    lines: dict[tuple[str, str], Line] = field(default_factory=dict)
    pair: list[Varied] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def rows_of(self, controller: str) -> np.ndarray:
        """Indices of the rows of a controller that have figures."""
        place = self.sweep.controllers.index(controller)
        return np.flatnonzero((self.sweep.controller == place) & (self.sweep.status == 0))

    def counts(self) -> list[Row]:
        """Rows of each controller by status, and the commonest reasons."""
        return [self._count(i, name) for i, name in enumerate(self.sweep.controllers)]

    def _count(self, place: int, name: str) -> Row:
        mine = self.sweep.controller == place
        row: Row = {'controller': name, 'rows': int(mine.sum())}
        row |= {s: int((self.sweep.status[mine] == i).sum()) for i, s in enumerate(STATUSES)}
        return row

    def reasons(self) -> list[Row]:
        """The commonest reasons of what was refused or diverged."""
        failed = np.flatnonzero(self.sweep.status != 0)
        if len(failed) == 0:
            return []
        table = self.sweep.table(['status', 'reason']).take(failed)
        counts = table.group_by(['status', 'reason']).aggregate([([], 'count_all')])
        rows = counts.sort_by([('count_all', 'descending')]).slice(0, MOST_REASONS).to_pylist()
        return [{'status': r['status'], 'reason': r['reason'], 'rows': r['count_all']}
                for r in rows]  # fmt: skip

    def most_influential(self) -> list[Varied]:
        """Paths that differ, by the share of the order of the figures that they explain."""
        shares: dict[str, list[float]] = {}
        for row in self.tables['influence']:
            shares.setdefault(row['path'], []).append(row['explained_percent'])
        differing = [v for v in self.varied if v.differs]
        return sorted(differing, key=lambda v: -float(np.mean(shares.get(v.path, 0.0))))


def analysed(sweep: Sweep, by: str = BEST_BY) -> Results:
    """Everything that is reported of a sweep.

    Parameters
    ----------
    sweep : of `open_sweep`
    by : measure that sorts the best rows

    """
    results = Results(sweep, varied_paths(sweep), {name: [] for name in TABLES})
    groups, notes = designed(sweep)
    results.notes = [*notes, *_tied(sweep), *(n for group in groups for n in failing(sweep, group))]
    for measure in each(MEASURES, len(MEASURES)):
        _one_measure(results, measure, groups)
    results.pair = results.most_influential()[:2]
    _pairs(results)
    _failures(results)
    chosen = BY_NAME[by]
    found = statistics.smallest(sweep, results.values[by], chosen)
    results.tables['best'] = statistics.with_values(sweep, found, results.values)
    results.tables['quantiles'] = list(figures_spread(sweep))
    return results


def _tied(sweep: Sweep) -> Iterator[str]:
    """What cannot be told apart because the campaign varies it side by side."""
    for spec in sweep.campaign['vary']:
        if kind_of(spec) == 'zip' and len(spec['zip']) > 1:
            names = join(list(spec['zip']))
            yield f'{names} vary side by side: what one explains may be the work of another'


def _one_measure(results: Results, measure: Measure, groups: Sequence[Any]) -> None:
    sweep, tables = results.sweep, results.tables
    values = results.values[measure.name] = sweep.measure(measure)
    ok = [results.rows_of(name) for name in sweep.controllers]
    if not varying([values[rows] for rows in ok], measure.unit):
        known = values[np.isfinite(values) & (sweep.status == 0)]
        results.fixed[measure.name] = float(known[0]) if len(known) else None
        return
    results.measures.append(measure)
    tables['paired'] += pairs(sweep, values, measure)
    for controller, rows in zip(sweep.controllers, ok, strict=True):
        results.lines[measure.name, controller] = distribution(values[rows], measure)
        ranks, there = ranks_of(values[rows], measure)
        names = {'controller': controller, 'figure': measure.name}
        for varied in results.varied:
            if not (varied.differs and varied.concerns(controller)):
                continue
            for row in statistics.along(values, rows, varied, measure):
                tables['dependence'].append({'controller': controller} | row)
            if found := influence(ranks, varied, rows[there]):
                tables['influence'].append(names | {'path': varied.path} | found)
    for group in groups:
        tables['indices'] += indices(sweep, group, values, measure)
        results.notes += omitted(sweep, group, values, measure)


def _pairs(results: Results) -> None:
    if len(results.pair) < 2:
        return
    for measure in results.measures:
        for controller in results.sweep.controllers:
            if all(varied.concerns(controller) for varied in results.pair):
                rows = results.rows_of(controller)
                values = results.values[measure.name]
                for row in statistics.together(values, rows, results.pair, measure):
                    results.tables['together'].append({'controller': controller} | row)


def _failures(results: Results) -> None:
    sweep = results.sweep
    if not (sweep.status != 0).any():
        return
    for i, controller in enumerate(sweep.controllers):
        rows = np.flatnonzero(sweep.controller == i)
        for varied in results.varied:
            if varied.differs and varied.concerns(controller):
                for row in statistics.failures(varied, sweep.status, rows):
                    results.tables['failures'].append({'controller': controller} | row)


def document(results: Results) -> dict[str, Any]:
    """All of it, ready for JSON."""
    sweep = results.sweep
    return {
        'campaign': sweep.name,
        'folder': str(sweep.folder),
        'rows': sweep.rows,
        'planned_rows': sweep.planned,
        'controllers': results.counts(),
        'reasons': results.reasons(),
        'paths': [{'path': v.path, 'unit': v.unit, 'meaning': v.meaning, 'groups': len(v.labels)}
                  for v in results.varied],
        'fixed': results.fixed,
        'notes': results.notes,
        **results.tables,
    }  # fmt: skip


def write_results(results: Results, out: Path) -> dict[str, Any]:
    """Write analysis.json and a Parquet file per table that has rows; returns the former."""
    found = document(results)
    text = json.dumps(found, allow_nan=False)
    (out / DOCUMENT).write_text(text + '\n', encoding='utf-8')
    for name, rows in results.tables.items():
        if rows:
            parquet.write_table(pa.Table.from_pylist(_filled(rows)), out / f'{name}.parquet')
    return found


def _filled(rows: Sequence[Row]) -> list[Row]:
    """Rows that have all columns, in the order in which they first appear."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    return [{name: row.get(name) for name in names} for row in rows]
