"""Figures of a comparison, whatever the number of its runs."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.comparison.entries import Entry
from auv_analysis.comparison.lines import MOST_LINES, Drawn, errors, look
from auv_analysis.comparison.ranking import Ranking
from auv_analysis.measures import FAMILIES
from auv_analysis.report import plotting
from auv_analysis.report.figure_files import FigureRecord, save_figures
from auv_analysis.report.grids import ALWAYS, MARGIN, ROW, TALLEST, Grid, grid_figure, name_rows
from auv_analysis.report.overview import XI
from auv_analysis.report.plotting import COLOURS
from auv_dynamics.signals import DOFS

SIX = {  # name of the figure -> family, title
    'rms_errors': ('velocity_error.rms', 'Root mean square velocity errors'),
    'late_errors': ('velocity_error.max_after_2s', 'Largest velocity errors after 2 s'),
    'settling_times': ('velocity_error.settling_time', 'Settling times'),
    'delta_xi': ('coupling.delta_xi_max', 'What inertial coupling adds to velocities, Δξ'),
    'delta_pi': ('coupling.delta_pi_max', 'What inertial coupling adds to inputs, Δπ'),
    'rms_inputs': ('effort.rms', 'Root mean square inputs'),
    'peak_inputs': ('effort.max', 'Largest inputs'),
}
MARKS = 'pale 0: exactly zero; crossed out: there is none'


def draw(
    entries: Sequence[Entry], table: pa.Table, ranking: Ranking, folder: Path
) -> dict[str, FigureRecord]:
    """Draw the figures of a comparison as PNG and PDF: name -> figure.

    Parameters
    ----------
    entries : its runs, of which one at least did not diverge
    table : of `comparison_table`
    ranking : of `rank`
    folder : where the files go; made when it is not there

    """
    drawn: dict[str, Callable[[], Drawn]] = {
        'ranking': partial(_ranking, ranking),
        'errors': partial(errors, entries),
        'kinetic_energy': partial(_energy, table),
        **{name: partial(_six, name, table) for name in SIX},
    }
    return save_figures(folder, drawn)


def column(table: pa.Table, name: str) -> np.ndarray:
    """Column of numbers (n,), NaN where there is none."""
    values = table[name].to_pylist()
    return np.array([np.nan if value is None else value for value in values], float)


def six(table: pa.Table, family: str) -> np.ndarray:
    """Columns of a family (n, 6), NaN where there is none."""
    return np.stack([column(table, f'{family}.{dof}') for dof in DOFS], axis=1)


def _six(name: str, table: pa.Table) -> Drawn:
    family, title = SIX[name]
    values, entry = six(table, family), FAMILIES[family]
    halves = [slice(0, 6)] if entry.units[0] == entry.units[1] else [slice(0, 3), slice(3, 6)]
    zeros = structural(table, family)
    grids = [
        Grid(values[:, half], DOFS[half], f'{entry.label} ({unit})', structural=zeros[:, half])
        for half, unit in zip(halves, entry.units, strict=False)
    ]
    always = f', {ALWAYS}: for every motion by the structure of M' if zeros.any() else ''
    caption = f'{title}, a row per run ({entry.meaning}); {MARKS}{always}.'
    return grid_figure(table['run'].to_pylist(), grids), title, caption


def structural(table: pa.Table, family: str) -> np.ndarray:
    """(n, 6) whether a figure of a family is zero for every motion, by the structure of M."""
    kind = family.removeprefix('coupling.').removesuffix('_max')
    if kind not in ('delta_xi', 'delta_pi'):
        return np.zeros((len(table), 6), bool)
    words = table[f'coupling.structural_zeros.{kind}'].to_pylist()
    return np.array([[dof in (word or '').split('; ') for dof in DOFS] for word in words])


def _energy(table: pa.Table) -> Drawn:
    """Shares of the mean kinetic energy as bars, and the energy beside them."""
    names, shares = table['run'].to_pylist(), six(table, 'kinetic_energy.shares_percent')
    figure = plotting.new_figure(min(MARGIN + ROW * len(names), TALLEST))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2, 1))
    places = np.arange(len(names))
    known = np.nan_to_num(shares)
    starts = np.cumsum(known, axis=1) - known
    for i in range(6):
        left.barh(places, known[:, i], left=starts[:, i], color=COLOURS[i], height=0.78)
    handles = [Line2D([], [], color=COLOURS[i], linewidth=6) for i in range(6)]
    labels = [f'{XI[i]} {DOFS[i]}' for i in range(6)]
    figure.legend(handles, labels, loc='outside upper right', ncols=6, handlelength=0.9)
    name_rows(left, names, len(names))
    left.set(xlim=(0.0, 100.0), ylim=(len(names) - 0.5, -0.5), xlabel='share (%)')
    mean = column(table, 'kinetic_energy.mean')
    right.plot(mean, places, 'o', color='#1a1a1a', markersize=4)
    right.set_xlabel('mean kinetic energy (J)')
    plotting.logarithmic(right, 'x')
    right.margins(x=0.08)
    for axes in (left, right):
        axes.grid(axis='y', visible=False)
    title = 'Kinetic energy'
    caption = (
        f'{title}: shares of the components of the decomposition in its mean, equation (30), '
        'and the mean of the whole run.'
    )
    return figure, title, caption


def _ranking(ranking: Ranking) -> Drawn:
    title = 'Ranking'
    labels = [measure.label for measure in ranking.measures]
    caption = f'{title} by the measures that sum up a run, rank 1 is the smallest value. '
    if len(ranking.runs) <= MOST_LINES:
        return _parallel(ranking, labels), title, caption + 'Equal values share a rank.'
    widest = float(np.nanmax(np.abs(ranking.ratios), initial=1.0))
    end = min(np.ceil(widest), 4.0)
    grid = Grid(
        np.where(np.isfinite(ranking.ratios), ranking.ratios + 0.0, np.nan),
        labels,
        'log2 of value / median of the runs',
        'PuOr_r',
        Normalize(-end, end),
        decimals=1,
    )
    figure = grid_figure(ranking.runs, [grid])
    axes = figure.axes[0]
    axes.tick_params(axis='x', labelrotation=90, labelsize='small')
    text = (
        f'{title}: each measure as a multiple of its median over the runs where it is not zero, in '
        'powers of two: 1 is twice the median, −1 half of it; crossed out: none, or zero. '
        'Sorted by the mean rank.'
    )
    return figure, title, text


def _parallel(ranking: Ranking, labels: Sequence[str]) -> Figure:
    """Ranks of each run along the measures."""
    figure = plotting.new_figure(1.6 + 0.24 * len(ranking.runs))
    axes = figure.subplots()
    places = np.arange(len(labels))
    for i, run in enumerate(ranking.runs):
        style = look(i)
        axes.plot(places, ranking.ranks[i], marker='o', markersize=4, label=run, **style)
    axes.set(ylim=(len(ranking.runs) + 0.4, 0.6), xlim=(-0.3, len(labels) - 0.7), ylabel='rank')
    axes.set_xticks(places, labels, rotation=90, fontsize='small')
    axes.set_yticks(range(1, len(ranking.runs) + 1))
    figure.legend(loc='outside right upper', handlelength=2.6)
    return figure
