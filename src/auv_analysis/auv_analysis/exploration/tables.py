"""Tables of the report of a sweep; each number is that of a Parquet file beside it."""

from collections.abc import Mapping, Sequence
from typing import Any

from auv_analysis.exploration.names import short_names
from auv_analysis.exploration.opening import STATUSES
from auv_analysis.exploration.results import DOCUMENT, Results
from auv_analysis.measures import BY_NAME
from auv_analysis.report.document import Cell, Column, Table, cell
from auv_analysis.report.tables.sources import count, pointer

QUANTILES = {
    'smallest': ('smallest', ''),
    'low': ('5 %', 'a twentieth of the rows is at or below'),
    'quarter': ('25 %', ''),
    'median': ('median', 'half of the rows are at or below; of a time that may not exist, of all'),
    'three_quarters': ('75 %', ''),
    'high': ('95 %', ''),
    'largest': ('largest', 'of those that exist'),
}


def counts(results: Results) -> Table:
    """Rows of each controller by status."""
    columns = [Column('controller', numeric=False), Column('rows')]
    meanings = {
        'ok': 'came to its end',
        'diverged': 'left the finite numbers: a result',
        'refused': 'its values make no scenario',
    }
    columns += [Column(status, '', meanings[status]) for status in STATUSES]
    rows = [
        [Cell(row['controller']),
         *(count(row[key], pointer(DOCUMENT, 'controllers', i, key))
           for key in ('rows', *STATUSES))]
        for i, row in enumerate(results.counts())
    ]  # fmt: skip
    return Table('counts', 'Rows of each controller.', columns, rows)


def paths(results: Results) -> Table:
    """What was varied, and how."""
    columns = [
        Column('path', '', 'where the value stands: scenario, or vehicle file', numeric=False),
        Column('unit', numeric=False),
        Column('meaning', numeric=False),
        Column('group', '', 'how the campaign chooses its values', numeric=False),
        Column('values', numeric=False),
        Column('different', '', 'values or, of many numbers, bins that are told apart'),
    ]
    rows = []
    for i, varied in enumerate(results.varied):
        kind, spec = results.sweep.spread_of(varied.path)
        groups = count(len(varied.labels), pointer(DOCUMENT, 'paths', i, 'groups'))
        words = (varied.unit, varied.meaning, kind, _said(spec))
        rows.append([Cell(varied.path), *map(Cell, words), groups])
    return Table('paths', 'What varies.', columns, rows)


def _said(spec: Any) -> str:
    """Values or distribution of a campaign in words."""
    if isinstance(spec, Mapping):
        if len(spec) == 1:
            name, inner = next(iter(spec.items()))
            return f'{name}: {_said(inner)}'
        return ', '.join(f'{key} {value:g}' if isinstance(value, int | float) else f'{key} {value}'
                         for key, value in spec.items())  # fmt: skip
    text = ', '.join(map(str, spec)) if isinstance(spec, Sequence) else str(spec)
    return text if len(text) <= 80 else f'{text[:78]}…'


def spreads(results: Results) -> Table:
    """Quantiles of every measure, of each controller."""
    columns = [Column('measure', numeric=False), Column('controller', numeric=False)]
    columns += [Column('unit', numeric=False), Column('exists in', '', 'rows with such a value')]
    columns += [Column(label, '', meaning) for label, meaning in QUANTILES.values()]
    rows = []
    for i, row in enumerate(results.tables['quantiles']):
        if row['figure'] not in {measure.name for measure in results.measures}:
            continue
        head = [Cell(row['label']), Cell(row['controller']), Cell(row['unit'])]
        head.append(count(row['known'], f'quantiles.parquet:known[{i}]'))
        rows.append([*head, *(cell(row[k], f'quantiles.parquet:{k}[{i}]') for k in QUANTILES)])
    caption = 'Distribution of the measures over the rollouts. Every figure: quantiles.parquet.'
    note = 'An en dash: more rows than that have no such value, such as a time to settle.'
    return Table('quantiles', caption, columns, rows, stub=2, note=note)


def against(results: Results) -> Table:
    """Controllers in the same rollouts."""
    columns = [
        Column('measure', numeric=False),
        Column('of', '', 'controller', numeric=False),
        Column('against', '', 'another one in the same rollouts', numeric=False),
        Column('rollouts', '', 'that both came to the end of'),
        Column('smaller in', '%', 'rollouts where the first one’s value is smaller'),
        Column('equal in', '%', 'rollouts where both are equal'),
        Column('effect', '', 'rank-biserial correlation: below 0 where the first one’s is smaller'),
        Column('ratio', '', 'of the first to the second, after Hodges and Lehmann'),
        Column('from', '', '95 % interval of that ratio, by the signed-rank test'),
        Column('to'),
    ]
    keys = ('smaller_percent', 'equal_percent', 'effect', 'ratio', 'ratio_low', 'ratio_high')
    rows = [
        [Cell(row['label']), Cell(row['controller']), Cell(row['other']),
         count(row['rollouts'], f'paired.parquet:rollouts[{i}]'),
         *(cell(row[key], f'paired.parquet:{key}[{i}]') for key in keys)]
        for i, row in enumerate(results.tables['paired'])
    ]  # fmt: skip
    caption = 'Controllers against each other in the same rollouts.'
    return Table('paired', caption, columns, rows, stub=3)


def influences(results: Results) -> Table:
    """Paths by how much of the order of the measures they explain."""
    columns = [
        Column('measure', numeric=False),
        Column('controller', numeric=False),
        Column('path', numeric=False),
        Column('explained', '%', 'variance of the ranks between the groups of the path'),
        Column('Spearman', '', 'rank correlation with the path: its sign is the direction'),
    ]
    names = short_names(results.varied)
    numbered = list(enumerate(results.tables['influence']))
    order = {measure.name: i for i, measure in enumerate(results.measures)}
    numbered.sort(key=lambda e: (order[e[1]['figure']], e[1]['controller'],
                                 -e[1]['explained_percent']))  # fmt: skip
    rows = []
    for i, row in numbered:
        head = BY_NAME[row['figure']].label, row['controller'], names[row['path']]
        values = (
            cell(row[key], f'influence.parquet:{key}[{i}]')
            for key in ('explained_percent', 'spearman')
        )
        rows.append([*map(Cell, head), *values])
    return Table('influence', 'What matters for which measure.', columns, rows, stub=3)
