"""The report of a sweep: what varies, how figures are distributed, what they depend on."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from auv_analysis.metrics.measures import BY_NAME
from auv_analysis.output.folder import SWEEP, results_folder
from auv_analysis.output.progress import console, say, waiting
from auv_analysis.output.text import Maths, join, number
from auv_analysis.report.document import (
    Block,
    Cell,
    Column,
    Section,
    Sentence,
    Table,
    cell,
    write_document,
)
from auv_analysis.report.plots import FigureRecord
from auv_analysis.report.tables.sources import count, pointer
from auv_analysis.studies.sweep.analysis import (
    BEST_BY,
    DOCUMENT,
    Results,
    Row,
    analysed,
    write_results,
)
from auv_analysis.studies.sweep.dataset import STATUSES, open_sweep
from auv_analysis.studies.sweep.factors import short_names
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.nearest import one_of

LISTING = 'campaign.yaml'


def write_report(out: Path, results: Results, figures: Mapping[str, FigureRecord]) -> Path:
    """Write report.html of a sweep; returns its path.

    Parameters
    ----------
    out : folder, existing
    results : of `analysed`
    figures : of `draw`

    """
    sweep = results.sweep
    depends = [figure for name, figure in figures.items() if name.startswith('dependence_')]

    def shown(*names: str) -> list[Block]:
        return [figures[name] for name in names if name in figures]

    many = len(sweep.controllers) > 1 and results.tables['paired']
    best: list[Block] = [best_table(results)] if results.tables['best'] else []
    indices: list[Block] = list(index_tables(results))
    sections = [
        Section('campaign', 'What was swept', [paths(results), counts(results),
                                               *results.notes]),
        Section('distributions', 'Distributions', [*shown('distributions'),
                                                   spreads(results)]),
        Section('controllers', 'Controllers against each other',
                [against(results)] if many else []),
        Section('influence', 'What matters', [
            *shown('influence'), *([influences(results)] if results.tables['influence']
                                   else []),
            *shown('total_indices', 'elementary_effects'), *indices]),
        Section('dependence', 'What it depends on', [*depends, *shown('together')]),
        Section('best', 'Best rollouts', best),
        Section('failures', 'Where it fails', _failures(results, shown('failures'))),
    ]  # fmt: skip
    about = (
        f'{sweep.rows} of {sweep.planned} rows of the campaign {sweep.name}, of the scenario '
        f'{sweep.campaign["scenario"]}. All numbers: {DOCUMENT} and the Parquet files beside it.'
    )
    title = f'Sweep {sweep.name}'
    return write_document(out, title, about, findings(results), sections, _listings(sweep.folder))


def _failures(results: Results, drawn: list[Block]) -> list[Block]:
    if not results.reasons():
        return []
    rows = [failures(results)] if results.tables['failures'] else []
    return [*drawn, *rows, reasons(results)]


def _listings(folder: Path) -> list[tuple[str, str]]:
    try:
        return [(LISTING, (folder / LISTING).read_text(encoding='utf-8'))]
    except (OSError, ValueError):
        return []


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


MOST_FAILURES = 20
SHARES = ('diverged_percent', 'refused_percent')
WORDS = ('measure', 'controller', 'path', 'with', 'case')  # of an index


def index_tables(results: Results) -> Iterator[Table]:
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


def best_table(results: Results) -> Table:
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


SETTLED = 'overall.velocity_error.settling_time'
SAID = (SETTLED, 'overall.velocity_error.rms.linear', 'overall.effort.rms.linear')
MATTERS = 5.0  # %: less is not said


def findings(results: Results) -> list[Sentence]:
    """Sentences of the summary: how much is there, who wins, who settles, what matters, failures.

    Parameters
    ----------
    results : of `analysed`

    """
    found = [
        *_unfinished(results),
        *_settled(results),
        *_against(results),
        *_matters(results),
        *_failed(results),
    ]
    return [
        *found,
        *(Sentence(f'{note[0].upper()}{note[1:]}.', 'campaign') for note in results.notes),
    ]


def _unfinished(results: Results) -> Iterator[Sentence]:
    sweep = results.sweep
    if sweep.rows < sweep.planned:
        text = f'The sweep is not finished: {sweep.rows} of {sweep.planned} rows are there.'
        yield Sentence(text, 'table-counts')


def _settled(results: Results) -> Iterator[Sentence]:
    for row in results.tables['quantiles']:
        if row['figure'] == SETTLED and row['rows']:
            share = 100 * row['known'] / row['rows']
            text = f'Under {row["controller"]} all errors settle in {number(share)} % of the '
            text += f'{row["rows"]} rows that came to their end'
            if row['median'] is not None:
                text += f', in half of them within {number(row["median"])} s'
            yield Sentence(f'{text}.', 'table-quantiles')


def _against(results: Results) -> Iterator[Sentence]:
    for row in results.tables['paired']:
        if row['figure'] in SAID:
            label = BY_NAME[row['figure']].label
            what = 'time to settle' if row['figure'] == SETTLED else label
            text = (
                f'The {what} of {row["controller"]} is smaller than that of {row["other"]} in '
                f'{number(row["smaller_percent"])} % of {row["rollouts"]} rollouts'
            )
            if row['equal_percent']:
                text += f', and in {number(row["equal_percent"])} % there is no difference'
            yield Sentence(f'{text}.', 'table-paired')


def _matters(results: Results) -> Iterator[Sentence]:
    names = short_names(results.varied)
    for name in SAID:
        parts = []
        for controller in results.sweep.controllers:
            rows = [r for r in results.tables['influence']
                    if (r['figure'], r['controller']) == (name, controller)]  # fmt: skip
            if rows:
                row = max(rows, key=lambda r: r['explained_percent'])
                if row['explained_percent'] >= MATTERS:
                    share = number(row['explained_percent'])
                    parts.append(f'{names[row["path"]]} under {controller} ({share} %)')
        if parts:
            text = f'The largest part of the order of {BY_NAME[name].label} is explained by '
            text += f'{join(parts)}.'
            yield Sentence(text, 'table-influence')


def _failed(results: Results) -> Iterator[Sentence]:
    for row in results.counts():
        failed = [f'{row[word]} {word}' for word in STATUSES[1:] if row[word]]
        if failed:
            text = f'Of {row["rows"]} rows of {row["controller"]}, {join(failed)}.'
            worst = [r for r in results.tables['failures'] if r['controller'] == row['controller']]
            text += _worst(worst)
            yield Sentence(text, 'failures')


def _worst(rows: list[dict[str, Any]]) -> str:
    """Where the largest share fails, if it is more than everywhere."""
    rows = [row for row in rows if row['rows']]
    shares = [(row['diverged'] + row['refused']) / row['rows'] for row in rows]
    if not shares or max(shares) == min(shares):
        return ''
    row = rows[shares.index(max(shares))]
    return f' The largest share, {number(100 * max(shares))} %, at {row["path"]} = {row["value"]}.'


SHOWN = ('overall.velocity_error.settling_time', 'overall.velocity_error.rms.linear',
         'overall.effort.rms.linear')  # fmt: skip


def explore(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Analyse the rows of a sweep, finished or not.

    Parameters
    ----------
    folder : of `auv sweep`
    options : out, overwrite and by of the command line

    Raises
    ------
    InputError : a file of the sweep cannot be read; no such measure to sort by
    FailedError : no row has figures

    """
    by = options.by or BEST_BY
    if by not in BY_NAME:
        raise InputError('--by', '', one_of(by, BY_NAME), by)
    sweep = open_sweep(folder)
    out = options.out or Path('runs') / f'analyze_{sweep.name}'
    inputs = [folder / SWEEP, *sweep.parts]
    with results_folder(out, overwrite=options.overwrite, inputs=inputs) as place:
        if not (sweep.status == 0).any():
            raise FailedError(f'{folder}: none of {sweep.rows} rows has figures')
        with waiting(f'{sweep.rows} rows'):
            results = analysed(sweep, by)
        document = write_results(results, place.folder)
        from auv_analysis.studies.sweep.plots import draw  # with matplotlib, which loads slowly

        with waiting('drawing figures, writing the report'):
            write_report(place.folder, results, draw(results, place.folder / 'figures'))
        _show(results)
    return document


def _show(results: Results) -> None:
    sweep = results.sweep
    if sweep.rows < sweep.planned:
        say(f'note: not finished, {sweep.rows} of {sweep.planned} rows are there')
    for note in results.notes:
        say(f'note: {note}')
    from rich.table import Table as Printed

    table = Printed(box=None, header_style='bold')
    for column in ('controller', 'measure', '5 %', 'median', '95 %', 'unit', 'exists in'):
        table.add_column(column)
    for row in results.tables['quantiles']:
        if row['figure'] in SHOWN:
            share = f'{row["known"]} of {row["rows"]}'
            values = (number(row[key]) for key in ('low', 'median', 'high'))
            table.add_row(row['controller'], row['label'], *values, row['unit'], share)
    console.print(table)
