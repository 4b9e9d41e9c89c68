"""Steps 2 and 3 of the paper's procedure in figures: errors, estimates and inputs."""

from typing import Any

from auv_analysis.metrics.summary import SETTLED, TRANSIENT
from auv_analysis.output.text import MISSING, fixed, join
from auv_analysis.report.document import Cell, Column, Table, cell
from auv_analysis.report.quantities import Maths
from auv_analysis.report.tables.sources import Summaries, summary_source
from auv_dynamics.vehicle import DOFS

ERROR, ESTIMATE, INPUT = 'velocity error', 'estimation error w', 'input τ'
LATE = f'max after {TRANSIENT:g} s'
COLUMNS = (
    Column('controller', meaning='name of the run', numeric=False),
    Column('', meaning='degree of freedom', numeric=False),
    Column('RMS', '', Maths('root mean square of ν_d − ν over the run; m/s, rad/s'), group=ERROR),
    Column(LATE, '', Maths('largest |ν_d − ν| behind the transient; m/s, rad/s'), group=ERROR),
    Column('settled', 's', f'time from which the error stays within {SETTLED}', group=ERROR),
    Column('RMS', '', 'root mean square of w = f − F over the run; N, N m', group=ESTIMATE),
    Column(LATE, '', 'largest |w| behind the transient; N, N m', group=ESTIMATE),
    Column('RMS', '', 'root mean square of the command over the run; N, N m', group=INPUT),
    Column('max', '', 'largest magnitude of the command; N, N m', group=INPUT),
)


def key_figures_table(summaries: Summaries, without_estimate: list[str]) -> Table:
    """Errors, estimates and inputs of every run and degree of freedom.

    Parameters
    ----------
    summaries : name -> `summarize(run)`
    without_estimate : names of runs whose law has no adaptive term

    """
    words = (
        'Key figures: velocity error ν_d − ν, lumped estimation error w = f − F, '
        'commanded input τ. Linear rows in m/s and N, angular rows in rad/s and N m; an en dash '
        '(–) stands for what is missing: not known, or not settled within the run.'
    )
    if without_estimate:
        words += ' Under {} nothing is estimated: there w is −F.'
    caption = Maths(words, *([join(without_estimate)] if without_estimate else []))
    rows = [_row(name, summary, i) for name, summary in summaries.items() for i in range(len(DOFS))]
    return Table('key_figures', caption, COLUMNS, rows, stub=2)


def _row(name: str, summary: Any, i: int) -> list[Cell]:
    def found(group: str, figure: str) -> Cell:
        values = summary[group][figure]
        return cell(values and values[i], summary_source(name, group, figure, i))

    times = summary['velocity_error']['settling_time']
    time = times and times[i]
    where = summary_source(name, 'velocity_error', 'settling_time', i)
    return [
        Cell(name),
        Cell(DOFS[i]),
        found('velocity_error', 'rms'),
        found('velocity_error', 'max_after_2s'),
        Cell(MISSING) if time is None else Cell(fixed(time, 2), time, where),
        found('lumped_error', 'rms'),
        found('lumped_error', 'max_after_2s'),
        found('effort', 'rms'),
        found('effort', 'max'),
    ]
