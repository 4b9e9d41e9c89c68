"""Step 4 of the paper's procedure: kinetic energy and its shares, by window."""

from typing import Any

from auv_analysis.output.text import MISSING, fixed, number
from auv_analysis.report import paper
from auv_analysis.report.document import Cell, Column, Table
from auv_analysis.report.quantities import Maths
from auv_analysis.report.tables.sources import Summaries, summary_source

SHARES = tuple(
    Column(Maths(f'ξ{i}'), '%', Maths(f'share of ½ N_{i} ξ{i}² in the kinetic energy, (30)'))
    for i in range(1, 7)
)
COLUMNS = (
    Column('controller', meaning='name of the run', numeric=False),
    Column('from', 's', 'begin of the window'),
    Column('to', 's', 'end of the window'),
    Column('energy', 'J', 'mean of ½ νᵀ M ν over the samples of the window'),
    *SHARES,
)


def energy_table(summaries: Summaries, *, original: bool) -> Table:
    """Mean kinetic energy and its shares by run and window.

    Parameters
    ----------
    summaries : name -> `summarize(run)`
    original : whether the paper's own numbers belong beside them

    """
    rows = [_printed()] if original else []
    for name, summary in summaries.items():
        for i, entry in enumerate(summary['kinetic_energy_windows']):
            rows.append(_row(name, i, entry))
    caption = 'Mean kinetic energy and the shares of its components, by window'
    caption += '; the paper’s is that of GVC and has no window.' if original else '.'
    return Table('energy', caption, COLUMNS, rows)


def _printed() -> list[Cell]:
    energy = Cell(fixed(paper.KINETIC_ENERGY, 2), paper.KINETIC_ENERGY, 'paper')
    shares = [Cell(f'{x:.2f}', x, 'paper') for x in paper.SHARES]
    return [Cell('paper', kind='paper'), Cell(MISSING), Cell(MISSING), energy, *shares]


def _row(name: str, i: int, entry: Any) -> list[Cell]:
    def where(*keys: object) -> str:
        return summary_source(name, 'kinetic_energy_windows', i, *keys)

    ends = [Cell(f'{t:g}', t, where('window', k)) for k, t in enumerate(entry['window'])]
    if entry['mean'] is None:
        return [Cell(name), *ends, *[Cell(MISSING)] * 7]
    shares = [
        Cell(_share(x), x, where('shares_percent', k))
        for k, x in enumerate(entry['shares_percent'])
    ]
    return [Cell(name), *ends, Cell(fixed(entry['mean'], 2), entry['mean'], where('mean')), *shares]


def _share(value: float) -> str:
    if value >= 0.095:
        return f'{value:.2f}'
    return f'{value:.3f}' if value >= 5e-4 else number(value, 1)
