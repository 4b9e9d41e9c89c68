"""All that is computed of a sweep: rows of its tables, and the results that hold them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auv_analysis.metrics.measures import BY_NAME, MEASURES, Measure
from auv_analysis.output.progress import each
from auv_analysis.output.text import join
from auv_analysis.report.results import Results
from auv_analysis.studies.sweep import statistics
from auv_analysis.studies.sweep.dataset import STATUSES, Sweep
from auv_analysis.studies.sweep.factors import Factor, factors_of
from auv_analysis.studies.sweep.indices import designed, failing, indices, omitted
from auv_analysis.studies.sweep.variation import kind_of

TABLES = ('quantiles', 'influence', 'dependence', 'together', 'failures', 'paired', 'indices',
          'best')  # fmt: skip
BEST_BY = 'overall.velocity_error.rms.linear'
MOST_REASONS = 5
SAMPLE = 600  # rows of a controller that are drawn as points
Row = dict[str, Any]


@dataclass(eq=False)
class Analysis:
    """What was found in a sweep.

    Attributes
    ----------
    sweep : its rows
    factors : its paths
    tables : of `TABLES` -> rows
    measures : those that differ between rows
    fixed : those that do not, with their value, None where there is none
    values : measure -> (n,) of all rows
    pair : the two paths that matter most; none where there are fewer
    notes : what is worth saying, one line each

    """

    sweep: Sweep
    factors: list[Factor]
    tables: dict[str, list[Row]]
    measures: list[Measure] = field(default_factory=list)
    fixed: dict[str, float | None] = field(default_factory=dict)
    values: dict[str, np.ndarray] = field(default_factory=dict)
    pair: list[Factor] = field(default_factory=list)
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

    def most_influential(self) -> list[Factor]:
        """Paths that differ, by the share of the order of the figures that they explain."""
        shares: dict[str, list[float]] = {}
        for row in self.tables['influence']:
            shares.setdefault(row['path'], []).append(row['explained_percent'])
        differing = [v for v in self.factors if v.differs]
        return sorted(differing, key=lambda v: -float(np.mean(shares.get(v.path, 0.0))))


def analysed(sweep: Sweep, by: str = BEST_BY) -> Analysis:
    """Everything that is reported of a sweep.

    Parameters
    ----------
    sweep : of `open_sweep`
    by : measure that sorts the best rows

    """
    analysis = Analysis(sweep, factors_of(sweep), {name: [] for name in TABLES})
    groups, notes = designed(sweep)
    analysis.notes = [
        *notes,
        *_tied(sweep),
        *(n for group in groups for n in failing(sweep, group)),
    ]
    for measure in each(MEASURES, len(MEASURES)):
        _one_measure(analysis, measure, groups)
    analysis.pair = analysis.most_influential()[:2]
    _pairs(analysis)
    _failures(analysis)
    analysis.tables['best'] = statistics.best(sweep, analysis.values, BY_NAME[by])
    analysis.tables['quantiles'] = list(statistics.figures_spread(sweep))
    return analysis


def _tied(sweep: Sweep) -> Iterator[str]:
    """What cannot be told apart because the campaign varies it side by side."""
    for spec in sweep.campaign['vary']:
        if kind_of(spec) == 'zip' and len(spec['zip']) > 1:
            names = join(list(spec['zip']))
            yield f'{names} vary side by side: what one explains may be the work of another'


def _one_measure(analysis: Analysis, measure: Measure, groups: Sequence[Any]) -> None:
    sweep, tables = analysis.sweep, analysis.tables
    values = analysis.values[measure.name] = sweep.measure(measure)
    ok = [analysis.rows_of(name) for name in sweep.controllers]
    if not statistics.varying([values[rows] for rows in ok], measure.unit):
        known = values[np.isfinite(values) & (sweep.status == 0)]
        analysis.fixed[measure.name] = float(known[0]) if len(known) else None
        return
    analysis.measures.append(measure)
    tables['paired'] += statistics.pairs(sweep, values, measure)
    for controller, rows in zip(sweep.controllers, ok, strict=True):
        ranks, there = statistics.ranks_of(values[rows], measure)
        names = {'controller': controller, 'figure': measure.name}
        for factor in analysis.factors:
            if not (factor.differs and factor.concerns(controller)):
                continue
            for row in statistics.along(values, rows, factor, measure):
                tables['dependence'].append({'controller': controller} | row)
            if found := statistics.influence(ranks, factor, rows[there]):
                tables['influence'].append(names | {'path': factor.path} | found)
    for group in groups:
        tables['indices'] += indices(sweep, group, values, measure)
        analysis.notes += omitted(sweep, group, values, measure)


def _pairs(analysis: Analysis) -> None:
    if len(analysis.pair) < 2:
        return
    for measure in analysis.measures:
        for controller in analysis.sweep.controllers:
            if all(factor.concerns(controller) for factor in analysis.pair):
                rows = analysis.rows_of(controller)
                values = analysis.values[measure.name]
                for row in statistics.together(values, rows, analysis.pair, measure):
                    analysis.tables['together'].append({'controller': controller} | row)


def _failures(analysis: Analysis) -> None:
    sweep = analysis.sweep
    if not (sweep.status != 0).any():
        return
    for i, controller in enumerate(sweep.controllers):
        rows = np.flatnonzero(sweep.controller == i)
        for factor in analysis.factors:
            if factor.differs and factor.concerns(controller):
                for row in statistics.failures(factor, sweep.status, rows):
                    analysis.tables['failures'].append({'controller': controller} | row)


def results_of(analysis: Analysis) -> Results:
    """`analysis.json` and a Parquet file of each table that has rows."""
    sweep = analysis.sweep
    facts = {
        'campaign': sweep.name,
        'folder': str(sweep.folder),
        'rows': sweep.rows,
        'planned_rows': sweep.planned,
        'controllers': analysis.counts(),
        'reasons': analysis.reasons(),
        'paths': [
            {'path': f.path, 'unit': f.unit, 'meaning': f.meaning, 'groups': len(f.labels)}
            for f in analysis.factors
        ],
        'fixed': analysis.fixed,
        'notes': analysis.notes,
        **analysis.tables,
    }
    results = Results('analysis', facts)
    for name, rows in analysis.tables.items():
        if rows:
            results.add(name, name, rows, {})
    return results
