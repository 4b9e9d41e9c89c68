"""Velocity errors of all controllers over the faults of their scenario."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.output.text import join
from auv_analysis.report import plotting
from auv_analysis.report.figure_files import Drawn, FigureRecord, save_figures
from auv_analysis.report.overview import RUNS, common_bands, left_out
from auv_analysis.report.plotting import DASHES, GREY
from auv_analysis.report.sketch import Sketch
from auv_dynamics.vehicle import DOFS

ROOM = 1.3  # of the axis above what it shows, for the numbers of the faults


def fault_figure(runs: Mapping[str, Sketch], folder: Path) -> FigureRecord:
    """Draw and save `faults.png` and `.pdf`.

    Parameters
    ----------
    runs : of one scenario with faults, each with a set-point
    folder : of the figures

    """
    return save_figures(folder, {'faults': lambda: _drawn(runs)})['faults']


def _drawn(runs: Mapping[str, Sketch]) -> Drawn:
    figure: Figure = plotting.new_figure(7.2)
    panels = figure.subplots(6, 1, sharex=True)
    first = next(iter(runs.values()))
    bands = common_bands(runs)
    for i, axes in enumerate(panels):
        _panel(axes, runs, i, bands[i])
        axes.set_ylabel(f'{plotting.ERROR.symbols[i]} ({plotting.ERROR.unit(i)})')
        plotting.letter(axes, i, DOFS[i])
    panels[-1].set_xlabel('$t$ (s)')
    handles = [Line2D([], [], **_look(n)) for n in range(len(runs))]
    figure.legend(handles, list(runs), loc='outside upper right', ncols=4, handlelength=2.6)
    named = [f'{mark.number}  {mark.label}, {mark.times}' for mark in first.faults]
    patches = [Patch(color=plotting.FAULT) for _ in named]
    figure.legend(patches, named, loc='outside lower left', ncols=2)
    title = 'Velocity errors under faults'
    caption = (
        f'{title}, of {join(list(runs))}. Dotted: settling band{left_out(bands)}. '
        f'The axes are those of the errors after {TRANSIENT:g} s.{plotting.shade_sentence(first)}'
    )
    return figure, title, caption


def _panel(axes: Axes, runs: Mapping[str, Sketch], i: int, band: float | None) -> None:
    low, high = 0.0, 0.0
    for n, run in enumerate(runs.values()):
        split = ('error', 'early') in run.traces
        for part in ('early', 'late') if split else ('whole',):
            t, error = run.drawn('error', i, part)
            axes.plot(t, error, **_look(n))
            if part != 'early':
                low, high = min(low, np.nanmin(error)), max(high, np.nanmax(error))
        axes.set_xlim(run.start, run.start + run.duration)
    for level in () if band is None else (-band, band):
        axes.axhline(level, color=GREY, linewidth=0.7, linestyle=(0, (1, 2)), zorder=1.5)
        low, high = min(low, 1.2 * level), max(high, 1.2 * level)
    axes.set_ylim(1.1 * low, ROOM * high)
    plotting.shade(axes, next(iter(runs.values())))


def _look(n: int) -> dict[str, Any]:
    return {
        'linestyle': DASHES[n % len(DASHES)],
        'color': RUNS[n % len(RUNS)],
        'linewidth': 0.9,
    }
