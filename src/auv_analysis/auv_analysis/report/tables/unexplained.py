"""What the model leaves unexplained of recorded wrenches, with the error of the estimate."""

from collections.abc import Iterator, Mapping
from typing import Any

from auv_analysis.output.text import number
from auv_analysis.report.document import Cell, Column, Table, cell
from auv_analysis.report.tables.sources import WRENCH, Summaries, summary_source
from auv_dynamics.vehicle import DOFS

COLUMNS = (
    Column('', meaning='degree of freedom', numeric=False),
    Column('mean', '', 'mean of F over the samples; N, N m', group='F by (1)'),
    Column('RMS', '', 'root mean square of F; N, N m', group='F by (1)'),
    Column('max', '', 'largest magnitude of F; N, N m', group='F by (1)'),
    Column('error', '', 'root mean square of the standard error of F; N, N m', group='F by (1)'),
    Column('RMS of τ', '', 'root mean square of the recorded command; N, N m'),
    Column('window', 's', 'of the filter that estimates the rate of momentum', group='rates'),
    Column('error', '', 'root mean square of the standard error of ν̇; m/s², rad/s²', group='rates'),
    Column('unit', numeric=False),
)


def unexplained_tables(summaries: Summaries) -> Iterator[Table]:
    """A table for every run whose F was estimated: a row per degree of freedom."""
    for name, summary in summaries.items():
        if summary['unexplained'] is not None:
            rows = [_row(name, summary, i) for i in range(len(DOFS))]
            share = 100.0 * summary['gaps']['valid_share']
            caption = (
                f'Unexplained wrench of {name}: F of (1) from measured motion and wrench, over the '
                f'{number(share)} % of its length that have samples.'
            )
            note = (
                f'Rates by {summary["acceleration"]["filter"]}. The law’s own estimate f is not '
                'recorded, so that there is no w.'
            )
            yield Table(f'unexplained_{name}', caption, COLUMNS, rows, note=note)


def _row(name: str, summary: Mapping[str, Any], i: int) -> list[Cell]:
    def found(*keys: str) -> Cell:
        group, key = keys
        return cell(summary[group][key][i], summary_source(name, group, key, i))

    return [
        Cell(DOFS[i]),
        *(found('unexplained', key) for key in ('mean', 'rms', 'max', 'error_rms')),
        found('effort', 'rms'),
        found('acceleration', 'window'),
        found('acceleration', 'error_rms'),
        Cell(WRENCH[i // 3]),
    ]
