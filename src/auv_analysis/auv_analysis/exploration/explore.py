"""`auv analyze` of the folder of a sweep."""

import argparse
from pathlib import Path
from typing import Any

from rich.table import Table

from auv_analysis.console import say
from auv_analysis.exploration.files import write_results
from auv_analysis.exploration.opening import open_sweep
from auv_analysis.exploration.results import BEST_BY, Results, analysed
from auv_analysis.failure import FailedError
from auv_analysis.folder import SWEEP, results_folder
from auv_analysis.measures import BY_NAME
from auv_analysis.progress import console, waiting
from auv_analysis.report.text import number
from auv_dynamics.files import InputError
from auv_dynamics.nearest import one_of

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
        from auv_analysis.exploration.figures import draw  # with matplotlib, which loads slowly
        from auv_analysis.exploration.report import write_report

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
    table = Table(box=None, header_style='bold')
    for column in ('controller', 'measure', '5 %', 'median', '95 %', 'unit', 'exists in'):
        table.add_column(column)
    for row in results.tables['quantiles']:
        if row['figure'] in SHOWN:
            share = f'{row["known"]} of {row["rows"]}'
            values = (number(row[key]) for key in ('low', 'median', 'high'))
            table.add_row(row['controller'], row['label'], *values, row['unit'], share)
    console.print(table)
