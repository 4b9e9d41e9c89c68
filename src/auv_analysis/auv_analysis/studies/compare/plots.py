"""Plots of a comparison, whatever the number of its runs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.metrics.settling import BAND_TEXT, DWELL, band_of
from auv_analysis.output.arrow import pa
from auv_analysis.report import plots
from auv_analysis.report.digest import RunDigest
from auv_analysis.report.plots import COLOURS, GREY, MOST_LINES, Drawn, FigureRecord, HeatMap, look
from auv_analysis.report.run_plots import XI
from auv_analysis.studies.compare.ranking import Entry, Ranking
from auv_dynamics.vehicle import DOFS

MOST_PANELS = 12
ACROSS = 4  # panels in a row
SMALLEST, LARGEST = 1e-3, 1e4  # of the axis, multiples of the band
TIMES = 240  # columns of the rows of colours
ENDS = f', unless that is in the last {DWELL} % of the time'


def draw(
    entries: Sequence[Entry], table: pa.Table, ranking: Ranking, folder: Path
) -> dict[str, FigureRecord]:
    """Draw the plots of runs, one of which did not diverge, as PNG and PDF: name -> plot."""
    drawn: dict[str, Callable[[], Drawn]] = {
        'ranking': partial(_ranking, ranking),
        'errors': partial(errors, entries),
        'kinetic_energy': partial(_energy, table),
    }
    return plots.save_figures(folder, drawn)


def column(table: pa.Table, name: str) -> np.ndarray:
    """Column of numbers (n,), NaN where there is none."""
    return np.array(table[name].to_pylist(), float)


def _energy(table: pa.Table) -> Drawn:
    """Shares of the mean kinetic energy as bars, and the energy beside them."""
    names = table['run'].to_pylist()
    columns = [column(table, f'kinetic_energy.shares_percent.{dof}') for dof in DOFS]
    figure = plots.new_figure(min(plots.MARGIN + plots.ROW * len(names), plots.TALLEST))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2, 1))
    places = np.arange(len(names))
    known = np.nan_to_num(np.stack(columns, axis=1))
    starts = np.cumsum(known, axis=1) - known
    for i in range(6):
        left.barh(places, known[:, i], left=starts[:, i], color=COLOURS[i], height=0.78)
    handles = [Line2D([], [], color=COLOURS[i], linewidth=6) for i in range(6)]
    labels = [f'{XI[i]} {DOFS[i]}' for i in range(6)]
    figure.legend(handles, labels, loc='outside upper right', ncols=6, handlelength=0.9)
    plots.name_rows(left, names, len(names))
    left.set(xlim=(0.0, 100.0), ylim=(len(names) - 0.5, -0.5), xlabel='share (%)')
    mean = column(table, 'kinetic_energy.mean')
    right.plot(mean, places, 'o', color='#1a1a1a', markersize=4)
    right.set_xlabel('mean kinetic energy (J)')
    plots.logarithmic(right, 'x')
    right.margins(x=0.08)
    left.grid(axis='y', visible=False)
    right.grid(axis='y', visible=False)
    title = 'Kinetic energy'
    caption = (
        f'{title}: shares of the components of the decomposition in its mean, equation (30), '
        'and the mean of the whole run.'
    )
    return figure, title, caption


def _ranking(ranking: Ranking) -> Drawn:
    title = 'Ranking'
    if not ranking.measures:
        return None, title, f'{title}: no measure differs between the runs.'
    labels = [measure.label for measure in ranking.measures]
    widest = float(np.nanmax(np.abs(ranking.ratios), initial=1.0))
    end = min(np.ceil(widest), 4.0)
    grid = HeatMap(
        ranking.ratios,
        labels,
        'log2 of value / median of the runs',
        'PuOr_r',
        Normalize(-end, end),
        decimals=1,
    )
    figure = plots.heat_map(ranking.runs, [grid])
    axes = figure.axes[0]
    axes.tick_params(axis='x', labelrotation=90, labelsize='small')
    caption = (
        f'{title}: each measure as a multiple of its median over the runs where it is not zero, in '
        'powers of two: 1 is twice the median, −1 half of it; crossed out: none, or zero. '
        'Sorted by the mean rank.'
    )
    return figure, title, caption


def still_to_come(run: RunDigest) -> tuple[np.ndarray, np.ndarray]:
    """Largest error from each time on, as a multiple of the band in which it counts as settled.

    Returns
    -------
    t : (n,) s
    ratio : (n,) the largest of the degrees of freedom that are known; below 1 from where all of
        them have settled

    """
    lines = [run.line('error', i, 'log') for i in range(6)]
    band = band_of(run.part('nu_d').peak)
    t = np.unique(np.concatenate([times for times, _ in lines]))
    ratio = np.zeros(len(t))
    for (times, error), width in zip(lines, band, strict=True):
        rest = np.maximum.accumulate(np.abs(error)[::-1])[::-1] / width
        behind = np.searchsorted(times, t)  # the first sample at or after t has what is to come
        ratio = np.fmax(ratio, np.append(rest, 0.0)[behind])
    return t, ratio


def errors(entries: Sequence[Entry]) -> Drawn:
    """The error still to come of every run. Returns figure, title and caption."""
    groups = _groups(entries)
    labels = list(dict.fromkeys(label for group in groups.values() for label in group))
    title = 'Error still to come, in multiples of its band'
    caption = (
        f'{title}: the largest velocity error between t and the end of the run, of all degrees of '
        'freedom in which it is known, divided by the band in which it counts as settled '
        f'({BAND_TEXT}). '
    )
    if not groups:
        return None, title, f'{title}: without set-points there is none.'
    if len(groups) <= MOST_PANELS and len(labels) <= MOST_LINES:
        caption += f'A run has settled where its line falls below the dotted 1{ENDS}. '
        figure = _panels(groups, labels)
    else:
        caption += f'Each row is a run; it has settled where its colours end{ENDS}. '
        figure = _rows([e for e in entries if e.digest and e.digest.knows_setpoint])
    return figure, title, caption + 'Time is logarithmic.'


def _groups(entries: Sequence[Entry]) -> dict[str, dict[str, RunDigest]]:
    """Scenario -> label in its panel -> run."""
    groups: dict[str, dict[str, RunDigest]] = {}
    for entry in entries:
        if entry.digest is not None and entry.digest.knows_setpoint:
            label = entry.name.removeprefix(f'{entry.scenario}/')
            groups.setdefault(entry.scenario, {})[label] = entry.digest
    return groups


def _panels(groups: Mapping[str, Mapping[str, RunDigest]], labels: Sequence[str]) -> Figure:
    across = -(-len(groups) // -(-len(groups) // ACROSS))
    figure, panels = plots.small_multiples(
        len(groups), across, height=1.75, sharex=True, sharey=True
    )
    for axes, (scenario, runs) in zip(panels, groups.items(), strict=True):
        for label, run in runs.items():
            t, ratio = still_to_come(run)
            line = look(labels.index(label)) | {'label': label}
            axes.plot(t[ratio > 0], ratio[ratio > 0], **line)
        axes.axhline(1.0, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
        axes.set_title(scenario, loc='left')
        plots.logarithmic(axes, 'x', 'y')
    low, high = axes.get_ylim()  # that all share
    axes.set_ylim(max(low, SMALLEST), min(high, LARGEST))
    plots.shared_legend(figure)
    figure.supxlabel('$t$ (s)', fontsize='medium')
    figure.supylabel('error still to come / band', fontsize='medium')
    return figure


def _rows(entries: Sequence[Entry]) -> Figure:
    lines = [still_to_come(entry.digest) for entry in entries if entry.digest]
    first = min(t[0] for t, _ in lines)
    times = np.geomspace(first, max(t[-1] for t, _ in lines), TIMES)
    values = np.full((len(lines), TIMES), np.nan)
    for row, (t, ratio) in zip(values, lines, strict=True):
        inside = times <= t[-1]
        row[inside] = ratio[np.searchsorted(t, times[inside])]
    shown = np.ma.masked_where(~(values >= 1.0), values)
    figure = plots.new_figure(min(plots.MARGIN + plots.ROW * len(lines), plots.TALLEST))
    axes = figure.subplots()
    edges = np.geomspace(first, times[-1], TIMES + 1)
    mesh = axes.pcolormesh(
        edges, np.arange(len(lines) + 1) - 0.5, np.log10(shown), cmap='cividis_r', vmin=0.0
    )
    axes.set(xscale='log', ylim=(len(lines) - 0.5, -0.5), xlabel='$t$ (s)')
    axes.grid(False)
    plots.name_rows(axes, [entry.name for entry in entries], len(entries))
    figure.colorbar(mesh, ax=axes, label='log10 of the error still to come / band', fraction=0.04)
    return figure
