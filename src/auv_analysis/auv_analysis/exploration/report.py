"""The report of a sweep: what varies, how figures are distributed, what they depend on."""

from collections.abc import Mapping
from pathlib import Path

from auv_analysis.exploration import tables, tables_rows
from auv_analysis.exploration.findings import findings
from auv_analysis.exploration.results import DOCUMENT, Results
from auv_analysis.report.document import Block, Section
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.rendering import write_document

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
    best: list[Block] = [tables_rows.best(results)] if results.tables['best'] else []
    indices: list[Block] = list(tables_rows.indices(results))
    sections = [
        Section('campaign', 'What was swept', [tables.paths(results), tables.counts(results),
                                               *results.notes]),
        Section('distributions', 'Distributions', [*shown('distributions'),
                                                   tables.spreads(results)]),
        Section('controllers', 'Controllers against each other',
                [tables.against(results)] if many else []),
        Section('influence', 'What matters', [
            *shown('influence'), *([tables.influences(results)] if results.tables['influence']
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
    rows = [tables_rows.failures(results)] if results.tables['failures'] else []
    return [*drawn, *rows, tables_rows.reasons(results)]


def _listings(folder: Path) -> list[tuple[str, str]]:
    try:
        return [(LISTING, (folder / LISTING).read_text(encoding='utf-8'))]
    except (OSError, ValueError):
        return []
