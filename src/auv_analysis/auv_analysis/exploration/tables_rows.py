"""Tables of a sweep's indices, its best rollouts and its failures."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from auv_analysis.exploration.names import short_names
from auv_analysis.exploration.results import DOCUMENT, Results, Row
from auv_analysis.measures import BY_NAME
from auv_analysis.report.document import Cell, Column, Table, cell
from auv_analysis.report.quantities import Maths
from auv_analysis.report.tables.sources import count, pointer

MOST_FAILURES = 20
SHARES = ('diverged_percent', 'refused_percent')
WORDS = ('measure', 'controller', 'path', 'with', 'case')  # of an index


def indices(results: Results) -> Iterator[Table]:
    """Sensitivity indices, a table per method and one of interactions."""
    rows = list(enumerate(results.tables['indices']))
    sobol = {
        'S1': (Maths('S_1'), 'share of the variance by this path alone'),
        'S1_conf': ('±', Maths('half of the 95 % interval of S_1, by bootstrap')),
        'ST': (Maths('S_T'), 'share of the variance by this path with all its interactions'),
        'ST_conf': ('±', Maths('half of the 95 % interval of S_T')),
    }
    second = {'S2': (Maths('S_2'), 'share of the variance by both together alone'),
              'S2_conf': ('±', 'half of the 95 % interval')}  # fmt: skip
    morris = {
        'mu_star': ('μ*', 'mean size of the effect of going through the whole range'),
        'mu_star_conf': ('±', 'half of the 95 % interval of μ*'),
        'mu': ('μ', 'mean effect'),
        'sigma': ('σ', 'spread of the effects: curvature and interactions'),
    }
    for name, method, pairs, heads in (
        ('sobol', 'sobol', False, sobol),
        ('interactions', 'sobol', True, second),
        ('morris', 'morris', False, morris),
    ):
        mine = [(i, r) for i, r in rows if r['method'] == method and bool(r['with']) is pairs]
        if mine:
            yield _indices(results, name, mine, heads)


def _indices(
    results: Results,
    name: str,
    rows: Sequence[tuple[int, Row]],
    heads: Mapping[str, tuple[str, str]],
) -> Table:
    columns = [Column(head, numeric=False) for head in WORDS]
    columns += [Column('points', '', 'base points or trajectories that came to their end')]
    columns += [Column(label, '', meaning) for label, meaning in heads.values()]
    names = short_names(results.varied)
    body = []
    for i, row in rows:
        words = BY_NAME[row['figure']].label, row['controller'], names[row['path']]
        numbers = [count(row['points'], f'indices.parquet:points[{i}]')]
        numbers += [cell(row[key], f'indices.parquet:{key}[{i}]') for key in heads]
        other = names.get(row['with'] or '', '')
        body.append([*map(Cell, words), Cell(other), Cell(row['case']), *numbers])
    caption = {'sobol': 'Sensitivity indices of Sobol.', 'morris': 'Elementary effects of Morris.'}
    text = caption.get(name, 'Interactions of two paths, by Sobol’s indices.')
    return Table(name, text, columns, body, stub=3)


def best(results: Results) -> Table:
    """Rollouts with the smallest values of a measure."""
    chosen = BY_NAME[results.tables['best'][0]['by']]
    names = short_names(results.varied)
    columns = [Column('controller', numeric=False), Column('rank'), Column('rollout')]
    columns += [Column(names[v.path], v.unit, v.meaning, v.numbers is not None)
                for v in results.varied]  # fmt: skip
    columns += [Column(m.label, m.unit, m.meaning) for m in results.measures]
    keys = ['rank', 'rollout', *(v.path for v in results.varied)]
    keys += [m.name for m in results.measures]
    rows = []
    for i, row in enumerate(results.tables['best']):
        cells = [_any(row[key], f'best.parquet:{key}[{i}]') for key in keys]
        rows.append([Cell(row['controller']), *cells])
    caption = f'Rollouts with the smallest {chosen.label}, of each controller.'
    return Table('best', caption, columns, rows)


def _any(value: Any, source: str) -> Cell:
    if isinstance(value, int) and not isinstance(value, bool):
        return count(value, source)
    if isinstance(value, float):
        return cell(value, source, digits=4)
    return Cell('–' if value is None else str(value))


def failures(results: Results) -> Table:
    """Values at which the largest shares of rows diverged or were refused."""
    columns = [Column(head, numeric=False) for head in ('path', 'value', 'controller')]
    columns += [Column('rows'), Column('diverged', '%'), Column('refused', '%')]
    numbered = [
        (i, row)
        for i, row in enumerate(results.tables['failures'])
        if row['diverged'] + row['refused'] > 0
    ]
    numbered.sort(key=lambda e: -(e[1]['diverged'] + e[1]['refused']) / max(e[1]['rows'], 1))
    rows = []
    for i, row in numbered[:MOST_FAILURES]:
        numbers = [count(row['rows'], f'failures.parquet:rows[{i}]')]
        numbers += [cell(row[key], f'failures.parquet:{key}[{i}]') for key in SHARES]
        rows.append([Cell(row['path']), Cell(row['value']), Cell(row['controller']), *numbers])
    caption = 'Values at which most rows fail.'
    left = len(numbered) - MOST_FAILURES
    note = f'{left} others are in failures.parquet.' if left > 0 else ''
    return Table('failures', caption, columns, rows, stub=3, note=note)


def reasons(results: Results) -> Table:
    """The commonest reasons of failed rows."""
    columns = [Column('status', numeric=False), Column('reason', numeric=False), Column('rows')]
    rows = [
        [
            Cell(row['status']),
            Cell(row['reason']),
            count(row['rows'], pointer(DOCUMENT, 'reasons', i, 'rows')),
        ]
        for i, row in enumerate(results.reasons())
    ]
    return Table('reasons', 'The commonest reasons.', columns, rows, stub=2)
