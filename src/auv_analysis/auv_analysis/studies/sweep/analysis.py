"""Analysis of a sweep: quantiles, sensitivities, pairs, the best rows, as results."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from itertools import product

import numpy as np

from auv_analysis.metrics.measures import BY_NAME, FAMILIES, MEASURES, Measure
from auv_analysis.metrics.quantities import quantity
from auv_analysis.output.folder import ROLLOUTS, changed_in
from auv_analysis.output.new_files import known
from auv_analysis.output.progress import each
from auv_analysis.output.text import join
from auv_analysis.report.results import Results
from auv_analysis.studies.pairs import log_ratios, paired
from auv_analysis.studies.sweep.dataset import (
    STATUSES,
    THREADS,
    Factor,
    Sweep,
    by_group,
    factors_of,
    numbers_of,
)  # fmt: skip
from auv_analysis.studies.sweep.indices import Designed, designed, indices, omitted, reached
from auv_analysis.studies.sweep.quantiles import (
    Ordered,
    Row,
    ordered,
    quantiles,
    spread,
    spread_of_sorted,
    varying,
)  # fmt: skip
from auv_analysis.studies.sweep.variation import kind_of
from auv_dynamics.vehicle import DOFS

FEWEST = 8  # rows that a correlation is worth computing of
MOST_CELLS = 10  # bins of a path that a table of two has room for
MOST_CHOICES = 20  # words or lists of one: of hundreds it has a hundred thousand cells
COUNT = 10  # best rows of each controller


def _spreads(analysis: 'Analysis', columns: Mapping[str, np.ndarray]) -> None:
    """Rows of `quantiles.parquet`: controller, figure, its unit and meaning, its quantiles."""
    for name, values in columns.items():
        what = BY_NAME.get(name) or quantity(name)
        said = {'figure': name, 'label': what.label, 'unit': what.unit, 'meaning': what.meaning}
        analysis.spreads[name] = [
            {'controller': controller} | said | spread(values[rows], what.unit)
            for controller, rows in analysis.sweep.finished.items()
        ]


def _family(analysis: 'Analysis', family: str) -> None:
    names = [f'{family}.{dof}' for dof in DOFS]
    if names[0] not in analysis.spreads:
        _spreads(analysis, _columns(analysis.sweep, names))


def _columns(sweep: Sweep, names: Sequence[str]) -> dict[str, np.ndarray]:
    table = sweep.table([*names])
    return {name: numbers_of(table, name) for name in names}


def influence(ranks: np.ndarray, codes: np.ndarray, others: np.ndarray | None) -> Row | None:
    """Share of a figure's rank order that a path explains.

    Parameters
    ----------
    ranks : (m,) of the figure
    codes : (m,) group of the path in these rows
    others : (m,) ranks of its numbers; None of words and lists

    Returns
    -------
    row : None where there is nothing to compare
        spearman : rank correlation, None of words and lists
        explained_percent : share of the variance of the ranks that lies between the groups of the
            path (bins of numbers, or its values), corrected for their number; it also sees what
            rises and falls again

    """
    groups = np.count_nonzero(np.bincount(codes))
    if len(ranks) < FEWEST or groups < 2 or np.ptp(ranks) == 0 or len(ranks) <= groups:
        return None
    spearman = None
    if others is not None:
        a, b = ranks - ranks.mean(), others - others.mean()
        spearman = float(a @ b / np.sqrt((a @ a) * (b @ b)))
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


def along(
    controller: str, figure: Ordered, codes: np.ndarray, factor: Factor, measure: Measure
) -> Iterator[Row]:
    """Quantiles of a figure in each group of a path, by the group (m,) of each row."""
    count = len(factor.labels)
    groups, rows = figure.groups(codes, count), np.bincount(codes, minlength=count)
    for i, (label, group) in enumerate(zip(factor.labels, groups, strict=True)):
        row: Row = {'controller': controller, 'path': factor.path, 'figure': measure.name}
        row |= {'unit': measure.unit, 'group': i, 'value': label, 'middle': factor.middles[i]}
        ends = (None, None) if factor.edges is None else map(float, factor.edges[i])
        row |= dict(zip(('from', 'to'), ends, strict=True))
        yield row | spread_of_sorted(group, int(rows[i]))


def together(analysis: 'Analysis') -> Iterator[Row]:
    """Median of each measure for each combination of the groups of the two paths of `pair`."""
    pair, sweep = analysis.pair, analysis.sweep
    if len(pair) < 2:
        return
    (codes, labels), (others, beside) = map(merged, pair)
    for measure, controller in product(analysis.measures, sweep.controllers):
        if not all(factor.concerns(controller) for factor in pair):
            continue
        rows, values = sweep.finished[controller], analysis.values[measure.name]
        cells = codes[rows] * np.int32(len(beside)) + others[rows]
        groups = by_group(values[rows], cells, len(labels) * len(beside))
        for (label, other), group in zip(product(labels, beside), groups, strict=True):
            yield {
                'controller': controller,
                'figure': measure.name,
                'unit': measure.unit,
                'path': pair[0].path,
                'value': label,
                'other_path': pair[1].path,
                'other_value': other,
                'rows': len(group),
                'known': int(np.isfinite(group).sum()),
                'median': known(quantiles(ordered(group, measure.unit), [0.5])[0]),
            }


def merged(factor: Factor) -> tuple[np.ndarray, list[str]]:
    """Codes and labels of a path with neighbouring bins joined until they are few."""
    labels = list(factor.labels)
    if not factor.binned or len(labels) <= MOST_CELLS:
        return factor.codes, labels
    step = -(-len(labels) // MOST_CELLS)
    starts = [label.split('–')[0] for label in labels[::step]]
    ends = [labels[min(i + step, len(labels)) - 1] for i in range(0, len(labels), step)]
    joined = [f'{a}–{b.split("–")[-1]}' for a, b in zip(starts, ends, strict=True)]
    return factor.codes // step, joined


def failures(analysis: 'Analysis') -> Iterator[Row]:
    """Shares of diverged and refused rows of each controller in each group of each path."""
    sweep = analysis.sweep
    if not (sweep.status != 0).any():
        return
    for i, controller in enumerate(sweep.controllers):
        rows = np.flatnonzero(sweep.controller == i)
        for factor in analysis.varied(controller):
            groups = by_group(sweep.status[rows], factor.codes[rows], len(factor.labels))
            for label, group in zip(factor.labels, groups, strict=True):
                row: Row = {'controller': controller, 'path': factor.path, 'value': label}
                row['rows'] = len(group)
                for place, word in enumerate(STATUSES[1:], start=1):
                    count = int((group == place).sum())
                    share = 100.0 * count / len(group) if len(group) else None
                    row |= {word: count, f'{word}_percent': share}
                yield row


def pairs(sweep: Sweep, values: np.ndarray, measure: Measure) -> Iterator[Row]:
    """For each two controllers, the ratio of their figures in the same rollouts, as `Pairs`.

    Only rollouts that both finished count; a time that does not exist is later than any other.

    Parameters
    ----------
    sweep : whose rows they are
    values : (n,) of the measure in all rows
    measure : what is compared

    """
    at = ordered(values, measure.unit)
    usable = (sweep.status == 0) & ~np.isnan(at)
    for first, second, mine, other in sweep.pairs:
        both = usable[mine] & usable[other]
        d = log_ratios(at[mine[both]], at[other[both]])
        if len(d) == 0:
            continue
        found = paired(d, test=False)
        low, high = found.interval or (None, None)
        yield {
            'figure': measure.name,
            'label': measure.label,
            'controller': sweep.controllers[first],
            'other': sweep.controllers[second],
            'rollouts': len(d),
            'smaller_percent': 100 * found.smaller,
            'equal_percent': float(100 * np.mean(d == 0)),
            'larger_percent': 100 * found.larger,
            'effect': found.effect,
            'ratio': found.ratio,
            'ratio_low': low,
            'ratio_high': high,
        }


def best(analysis: 'Analysis', by: Measure) -> list[Row]:
    """Rows of each controller with the smallest values of a measure, with all that they have."""
    sweep, values, found = analysis.sweep, analysis.values[by.name], []
    given_rows = sweep.table(['index', 'seed', *sweep.paths])
    for controller, finished in sweep.finished.items():
        rows = finished[np.isfinite(values[finished])]
        places = rows[np.argsort(values[rows], kind='stable')[:COUNT]]
        table = given_rows.take(places).to_pylist()
        for rank, (place, given) in enumerate(zip(places, table, strict=True), start=1):
            row = {'by': by.name, 'controller': controller, 'rank': rank}
            row |= {'rollout': given.pop('index'), **given}
            found.append(row | {m.name: analysis.values[m.name][place] for m in MEASURES})
    return found


TABLES = ('quantiles', 'influence', 'dependence', 'together', 'failures', 'paired', 'indices',
          'best')  # fmt: skip
BEST_BY = 'overall.velocity_error.rms.linear'
MOST_REASONS = 5
SAMPLE = 600  # rows of a controller that are drawn as points


@dataclass(eq=False)
class Analysis:
    """Findings of a sweep.

    Attributes
    ----------
    sweep : its rows
    factors : its paths
    tables : of `TABLES` -> rows
    measures : those that differ between rows
    fixed : those that do not, with their value, None where there is none
    values : measure -> (n,) of all rows
    pair : of the paths that a table of two has room for, the two that matter most
    notes : what is worth saying, one line each
    spreads : figure -> its rows of the table `quantiles`
    ranks : path, controller -> ranks of its numbers in the finished rows; None of words and lists

    """

    sweep: Sweep
    factors: list[Factor]
    tables: dict[str, list[Row]]
    measures: list[Measure] = field(default_factory=list)
    fixed: dict[str, float | None] = field(default_factory=dict)
    values: dict[str, np.ndarray] = field(default_factory=dict)
    pair: list[Factor] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    spreads: dict[str, list[Row]] = field(default_factory=dict)
    ranks: dict[tuple[str, str], np.ndarray | None] = field(default_factory=dict)

    def varied(self, controller: str) -> list[Factor]:
        """Paths that differ and affect a controller."""
        return [v for v in self.factors if v.differs and v.concerns(controller)]

    def counts(self) -> list[Row]:
        """Rows of each controller by status."""
        found: list[Row] = []
        for i, name in enumerate(self.sweep.controllers):
            status = self.sweep.status[self.sweep.controller == i]
            counts = np.bincount(status, minlength=len(STATUSES)).tolist()
            of_each = dict(zip(STATUSES, counts, strict=True))
            found.append({'controller': name, 'rows': len(status)} | of_each)
        return found

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
    """Everything that is reported of a sweep; `by` is the measure that sorts the best rows."""
    analysis = Analysis(sweep, factors_of(sweep), {name: [] for name in TABLES})
    groups, notes = designed(sweep)
    analysis.notes = [
        *(
            f'{sweep.folder / name}: not as it was written: its figures may be others'
            for name in changed_in(sweep.folder, [f'{ROLLOUTS}/{p.name}' for p in sweep.parts])
        ),
        *notes,
        *_tied(sweep),
        *(n for group in groups for n in reached(sweep, group)),
    ]
    with ThreadPoolExecutor(THREADS) as pool:
        asked = [(factor, name) for name in sweep.controllers for factor in analysis.varied(name)]
        ranks = pool.map(partial(_ranks_of, sweep), asked)
        analysis.ranks = {
            (factor.path, name): found for (factor, name), found in zip(asked, ranks, strict=True)
        }
        found = pool.map(partial(_rows_of, analysis), MEASURES)
        for measure, rows in zip(MEASURES, each(found, len(MEASURES)), strict=True):
            _add(analysis, measure, rows, groups)
        list(pool.map(partial(_family, analysis), FAMILIES))
    figures = [m.name for m in MEASURES] + [
        f'{family}.{dof}' for family in FAMILIES for dof in DOFS
    ]
    analysis.tables['quantiles'] = [row for name in figures for row in analysis.spreads[name]]
    few = (f for f in analysis.most_influential() if f.binned or len(f.labels) <= MOST_CHOICES)
    analysis.pair = [*few][:2]
    analysis.tables['together'] = [*together(analysis)]
    analysis.tables['failures'] = [*failures(analysis)]
    analysis.tables['best'] = best(analysis, BY_NAME[by])
    return analysis


def _tied(sweep: Sweep) -> Iterator[str]:
    """What cannot be told apart because the campaign varies it side by side."""
    for spec in sweep.campaign['vary']:
        if kind_of(spec) == 'zip' and len(spec['zip']) > 1:
            names = join(list(spec['zip']))
            yield f'{names} vary side by side: what one explains may be the work of another'


def _ranks_of(sweep: Sweep, asked: tuple[Factor, str]) -> np.ndarray | None:
    factor, controller = asked
    if factor.numbers is None:
        return None
    return Ordered.of(factor.numbers[sweep.finished[controller]]).ranks


def _rows_of(analysis: Analysis, measure: Measure) -> list[tuple[str, Row]] | None:
    """Rows of a measure with the tables that they are of; None where it does not vary."""
    sweep = analysis.sweep
    columns = _columns(sweep, measure.columns)
    values = analysis.values[measure.name] = measure.of(columns.__getitem__)
    _spreads(analysis, columns | {measure.name: values})  # while they are at hand
    finished = sweep.finished
    if not varying([values[rows] for rows in finished.values()], measure.unit):
        return None
    found = [('paired', row) for row in pairs(sweep, values, measure)]
    for controller, rows in finished.items():
        figure = Ordered.of(values[rows], measure.unit)
        there = ~np.isnan(figure.ranks)
        for factor in analysis.varied(controller):
            codes, others = factor.codes[rows], analysis.ranks[factor.path, controller]
            rising = along(controller, figure, codes, factor, measure)
            found += [('dependence', row) for row in rising]
            if others is not None and not there.all():
                others = Ordered.of(others[there]).ranks
            if shares := influence(figure.ranks[there], codes[there], others):
                names = {'controller': controller, 'figure': measure.name, 'path': factor.path}
                found.append(('influence', names | shares))
    return found


def _add(
    analysis: Analysis,
    measure: Measure,
    rows: list[tuple[str, Row]] | None,
    groups: Sequence[Designed],
) -> None:
    sweep, values = analysis.sweep, analysis.values[measure.name]
    if rows is None:
        finite = values[np.isfinite(values) & (sweep.status == 0)]
        analysis.fixed[measure.name] = float(finite[0]) if len(finite) else None
        return
    analysis.measures.append(measure)
    for name, row in rows:
        analysis.tables[name].append(row)
    for group in groups:
        analysis.tables['indices'] += indices(sweep, group, values, measure)
        lacking = omitted(sweep, group, values, measure)
        analysis.notes += [note for note in lacking if note not in analysis.notes]


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
