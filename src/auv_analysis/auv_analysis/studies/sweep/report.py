"""The report of a sweep: variations, distributions of the measures, and their dependence."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from auv_analysis.metrics.measures import BY_NAME
from auv_analysis.metrics.quantities import Quantity
from auv_analysis.output.folder import SWEEP, results_folder
from auv_analysis.output.progress import console, say, waiting
from auv_analysis.output.text import capital, join, number
from auv_analysis.report.document import Block, Section, Sentence, write_document
from auv_analysis.report.plots import FigureRecord
from auv_analysis.report.results import Column, Table, described, make_table, terminal, view_of_file
from auv_analysis.studies.sweep.analysis import BEST_BY, Analysis, analysed, results_of
from auv_analysis.studies.sweep.dataset import STATUSES, open_sweep, short_names
from auv_analysis.studies.sweep.quantiles import Row
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.nearest import one_of

LISTING = 'campaign.yaml'
MOST_FAILURES = 20
SETTLED = 'overall.velocity_error.settling_time'
SHOWN = (
    SETTLED,
    'overall.velocity_error.rms.linear',
    'overall.effort.rms.linear',
)  # and those that a terminal shows
Shown = dict[str, Column | Quantity | str]


QUANTILES: Shown = {
    'smallest': described('smallest'),
    'low': described('5 %', 'a twentieth of the rows is at or below'),
    'quarter': described('25 %'),
    'median': described(
        'median', 'half of the rows are at or below; of a time that may not exist, of all'
    ),
    'three_quarters': described('75 %'),
    'high': described('95 %'),
    'largest': described('largest', 'of those that exist'),
}
COUNTS: Shown = {
    'controller': 'controller',
    'rows': 'rows',
    'ok': described('ok', 'came to its end'),
    'diverged': described('diverged', 'left the finite numbers: a result'),
    'refused': described('refused', 'its values make no scenario'),
}
PATHS: Shown = {
    'path': described('path', 'where the value stands: scenario, or vehicle file'),
    'unit': 'unit',
    'meaning': 'meaning',
    'group': described('group', 'how the campaign chooses its values'),
    'values': 'values',
    'groups': described('different', 'values or, of many numbers, bins that are told apart'),
}
SPREADS: Shown = {
    'label': 'measure',
    'controller': 'controller',
    'unit': 'unit',
    'known': described('exists in', 'rows with such a value'),
    **QUANTILES,
}
PAIRED: Shown = {
    'label': 'measure',
    'controller': described('of', 'controller'),
    'other': described('against', 'another one in the same rollouts'),
    'rollouts': described('rollouts', 'that both came to the end of'),
    'smaller_percent': described(
        'smaller in', 'rollouts where the first one’s value is smaller', '%'
    ),
    'equal_percent': described('equal in', 'rollouts where both are equal', '%'),
    'effect': described(
        'effect', 'rank-biserial correlation: below 0 where the first one’s is smaller'
    ),
    'ratio': described('ratio', 'of the first to the second, after Hodges and Lehmann'),
    'ratio_low': described('from', '95 % interval of that ratio, by the signed-rank test'),
    'ratio_high': 'to',
}
INFLUENCE: Shown = {
    'figure': 'measure',
    'controller': 'controller',
    'path': 'path',
    'explained_percent': described(
        'explained', 'variance of the ranks between the groups of the path', '%'
    ),
    'spearman': described('Spearman', 'rank correlation with the path: its sign is the direction'),
}
INDEX: Shown = {
    'figure': 'measure',
    'controller': 'controller',
    'path': 'path',
    'with': 'with',
    'case': 'case',
}
POINTS: Shown = {
    'points': described('points', 'base points or trajectories that came to their end'),
}
HALF = 'half of the 95 % interval'
SOBOL: Shown = {
    'S1': described('S_1', 'share of the variance by this path alone'),
    'S1_conf': described('±', f'{HALF} of S_1, by bootstrap'),
    'ST': described('S_T', 'share of the variance by this path with all its interactions'),
    'ST_conf': described('±', f'{HALF} of S_T'),
}
INTERACTIONS: Shown = {
    'S2': described('S_2', 'share of the variance by both together alone'),
    'S2_conf': described('±', HALF),
}
MORRIS: Shown = {
    'mu_star': described('μ*', 'mean size of the effect of going through the whole range'),
    'mu_star_conf': described('±', f'{HALF} of μ*'),
    'mu': described('μ', 'mean effect'),
    'sigma': described('σ', 'standard deviation of the effects: curvature and interactions'),
}
FAILURES: Shown = {
    'path': 'path',
    'value': 'value',
    'controller': 'controller',
    'rows': 'rows',
    'diverged_percent': described('diverged', '', '%'),
    'refused_percent': described('refused', '', '%'),
}


def explore(
    folder: Path, *, out: Path | None = None, by: str | None = None, overwrite: bool = False
) -> dict[str, Any]:
    """Analyse the rows of a sweep, finished or not; returns the JSON document.

    Parameters
    ----------
    folder : of `auv sweep`
    out : folder of the results; none: runs/analyze_<campaign>
    by : measure that sorts the best rows
    overwrite : replace the results in `out`

    Raises
    ------
    InputError : a file of the sweep cannot be read; no such measure to sort by
    FailedError : no row has figures

    """
    by = by or BEST_BY
    if by not in BY_NAME:
        raise InputError('--by', '', one_of(by, BY_NAME), by)
    sweep = open_sweep(folder)
    out = out or Path('runs') / f'analyze_{sweep.name}'
    inputs = [folder / SWEEP, *sweep.parts]
    with results_folder(out, overwrite=overwrite, inputs=inputs) as place:
        if not (sweep.status == 0).any():
            raise FailedError(f'{folder}: none of {sweep.rows} rows has figures')
        with waiting(f'{sweep.rows} rows'):
            analysis = analysed(sweep, by)
        results = results_of(analysis)
        results.write(place.folder)
        from auv_analysis.studies.sweep.plots import draw  # with matplotlib, which loads slowly

        with waiting('drawing figures, writing the report'):
            write_report(place.folder, analysis, draw(analysis, place.folder / 'figures'))
        _show(analysis)
    return results.to_json()


def _show(analysis: Analysis) -> None:
    sweep = analysis.sweep
    if sweep.rows < sweep.planned:
        say(f'note: not finished, {sweep.rows} of {sweep.planned} rows are there')
    for note in analysis.notes:
        say(f'note: {note}')
    shown = {key: SPREADS[key] for key in ('controller', 'label', 'low', 'median', 'high', 'unit')}
    rows = [row for row in analysis.tables['quantiles'] if row['figure'] in SHOWN]
    shown |= {'known': 'exists in', 'rows': 'of'}
    console.print(terminal(make_table('quantiles', '', rows, shown)))


def write_report(out: Path, analysis: Analysis, figures: Mapping[str, FigureRecord]) -> Path:
    """Write report.html of a sweep beside what `results_of` has written; returns its path."""
    sweep, tables = analysis.sweep, analysis.tables
    depends = [figure for name, figure in figures.items() if name.startswith('dependence_')]

    def shown(*names: str) -> list[Block]:
        return [figures[name] for name in names if name in figures]

    sections = [
        Section('campaign', 'What was swept', [
            _paths(analysis),
            _of_document('counts', 'controllers', 'Rows of each controller.', analysis.counts(),
                         shown=COUNTS),
            *analysis.notes]),
        Section('distributions', 'Distributions', [
            *shown('distributions'), *([_spreads(analysis)] if analysis.measures else [])]),
        Section('controllers', 'Controllers against each other',
                [view_of_file('paired', 'Controllers against each other in the same rollouts.',
                              enumerate(tables['paired']), PAIRED, stub=3)]
                if tables['paired'] else []),
        Section('influence', 'What matters', [
            *shown('influence'), *([_influences(analysis)] if tables['influence'] else []),
            *shown('total_indices', 'elementary_effects'), *_indices(analysis)]),
        Section('dependence', 'What it depends on', [*depends, *shown('together')]),
        Section('best', 'Best rollouts', [_best(analysis)] if tables['best'] else []),
        Section('failures', 'Where it fails', [*shown('failures'), *_failures(analysis)]),
    ]  # fmt: skip
    about = (
        f'{sweep.rows} of {sweep.planned} rows of the campaign {sweep.name}, of the scenario '
        f'{sweep.campaign["scenario"]}. All numbers: analysis.json and the Parquet files beside it.'
    )
    title = f'Sweep {sweep.name}'
    return write_document(out, title, about, findings(analysis), sections, _listings(sweep.folder))


def _listings(folder: Path) -> list[tuple[str, str]]:
    try:
        return [(LISTING, (folder / LISTING).read_text(encoding='utf-8'))]
    except (OSError, ValueError):
        return []


# tables: views of the rows that are stored


def _of_document(name: str, key: str, caption: str, rows: Sequence[Row], **about: Any) -> Table:
    """Rows of a list in the JSON document."""
    pointer = lambda row, column: f'analysis.json:/{key}/{row}/{column}'  # noqa: E731
    return make_table(name, caption, rows, pointer=pointer, **about)


def _named(analysis: Analysis, row: Row) -> Row:
    """A row with the names of its measure and its paths as they are shown."""
    names = short_names(analysis.factors)
    found = {**row, 'figure': BY_NAME[row['figure']].label, 'path': names[row['path']]}
    return found | ({'with': names.get(row['with'] or '', '')} if 'with' in row else {})


def _paths(analysis: Analysis) -> Table:
    rows = []
    for f in analysis.factors:
        kind, spec = analysis.sweep.spread_of(f.path)
        row = {'path': f.path, 'unit': f.unit, 'meaning': f.meaning, 'group': kind}
        rows.append(row | {'values': _said(spec), 'groups': len(f.labels)})
    return _of_document('paths', 'paths', 'What varies.', rows, shown=PATHS)


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


def _spreads(analysis: Analysis) -> Table:
    measures = {measure.name for measure in analysis.measures}
    numbered = enumerate(analysis.tables['quantiles'])
    rows = [(i, row) for i, row in numbered if row['figure'] in measures]
    caption = 'Distribution of the measures over the rollouts. Every column: quantiles.parquet.'
    note = 'An en dash: more rows than that have no such value, such as a time to settle.'
    return view_of_file('quantiles', caption, rows, SPREADS, stub=2, note=note)


def _influences(analysis: Analysis) -> Table:
    order = {measure.name: i for i, measure in enumerate(analysis.measures)}
    numbered = sorted(
        enumerate(analysis.tables['influence']),
        key=lambda e: (order[e[1]['figure']], e[1]['controller'], -e[1]['explained_percent']),
    )
    rows = [(i, _named(analysis, row)) for i, row in numbered]
    return view_of_file('influence', 'What matters for which measure.', rows, INFLUENCE, stub=3)


def _indices(analysis: Analysis) -> Iterator[Table]:
    """Sensitivity indices, a table per method and one of interactions."""
    for name, method, pairs, heads, caption in (
        ('sobol', 'sobol', False, SOBOL, 'Sensitivity indices of Sobol’.'),
        ('interactions', 'sobol', True, INTERACTIONS,
         'Interactions of two paths, by Sobol’ indices.'),
        ('morris', 'morris', False, MORRIS, 'Elementary effects of Morris.'),
    ):  # fmt: skip
        rows = [
            (i, _named(analysis, row))
            for i, row in enumerate(analysis.tables['indices'])
            if row['method'] == method and bool(row['with']) is pairs
        ]
        if rows:
            told = {key: head for key, head in INDEX.items() if any(row[key] for _, row in rows)}
            shown = told | POINTS | heads
            yield view_of_file(name, caption, rows, shown, 'indices.parquet', stub=len(told))


def _best(analysis: Analysis) -> Table:
    """Rollouts with the smallest values of a measure."""
    rows = analysis.tables['best']
    names = short_names(analysis.factors)
    shown: Shown = {key: key for key in ('controller', 'rank', 'rollout')}
    shown |= {f.path: described(names[f.path], f.meaning, f.unit, digits=4)
              for f in analysis.factors}  # fmt: skip
    shown |= {m.name: described(m.label, m.meaning, m.unit, digits=4)
              for m in analysis.measures}  # fmt: skip
    (by,) = {row['by'] for row in rows}
    caption = f'Rollouts with the smallest {BY_NAME[by].label}, of each controller.'
    return view_of_file('best', caption, enumerate(rows), shown)


def _failures(analysis: Analysis) -> Iterator[Table]:
    """Values at which the largest shares of rows failed, and the commonest reasons."""

    def count(row: Row) -> int:
        return row['diverged'] + row['refused']

    rows = [(i, row) for i, row in enumerate(analysis.tables['failures']) if count(row)]
    rows.sort(key=lambda entry: -count(entry[1]) / entry[1]['rows'])
    left = len(rows) - MOST_FAILURES
    others = f'{left} others are' if left > 1 else 'Another one is'
    note = f'{others} in failures.parquet.' if left > 0 else ''
    if rows:
        caption = 'Values at which most rows fail.'
        yield view_of_file('failures', caption, rows[:MOST_FAILURES], FAILURES, stub=3, note=note)
    if reasons := analysis.reasons():
        heads: Shown = {key: key for key in ('status', 'reason', 'rows')}
        caption = 'The commonest reasons.'
        yield _of_document('reasons', 'reasons', caption, reasons, shown=heads, stub=2)


# sentences


def findings(analysis: Analysis) -> list[Sentence]:
    """Sentences of the summary: what is missing, who settles, failures."""
    parts = (_unfinished, _settled, _failed)
    found = [sentence for part in parts for sentence in part(analysis)]
    notes = (Sentence(f'{capital(note)}.', 'campaign') for note in analysis.notes)
    return [*found, *notes]


def _unfinished(analysis: Analysis) -> Iterator[Sentence]:
    sweep = analysis.sweep
    if sweep.rows < sweep.planned:
        text = f'The sweep is not finished: {sweep.rows} of {sweep.planned} rows are there.'
        yield Sentence(text, 'table-counts')


def _settled(analysis: Analysis) -> Iterator[Sentence]:
    for row in analysis.tables['quantiles']:
        if row['figure'] == SETTLED and row['rows']:
            share = 100 * row['known'] / row['rows']
            text = f'Under {row["controller"]} all errors settle in {number(share)} % of the '
            text += f'{row["rows"]} rows that came to their end'
            if row['median'] is not None:
                text += f', in half of them within {number(row["median"])} s'
            yield Sentence(f'{text}.', 'table-quantiles')


def _failed(analysis: Analysis) -> Iterator[Sentence]:
    for row in analysis.counts():
        failed = [f'{row[word]} {word}' for word in STATUSES[1:] if row[word]]
        if failed:
            text = f'Of {row["rows"]} rows of {row["controller"]}, {join(failed)}.'
            yield Sentence(text, 'failures')
