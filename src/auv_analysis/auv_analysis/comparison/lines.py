"""The error still to come of many runs: lines in a panel per scenario, or rows of colours."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.comparison.entries import Entry
from auv_analysis.report import plotting
from auv_analysis.report.grids import MARGIN, ROW, TALLEST, name_rows
from auv_analysis.report.overview import RUNS
from auv_analysis.report.plotting import COLOURS, DASHES, GREY
from auv_analysis.report.sketch import Sketch
from auv_analysis.summary import BAND_TEXT, DWELL, band_of

MANY = (*RUNS, COLOURS[-1], '#8c8c8c')
MOST_LINES = len(MANY)  # that can be told apart in a panel
MOST_PANELS = 12
ACROSS = 4  # panels in a row
SMALLEST, LARGEST = 1e-3, 1e4  # of the axis, multiples of the band
TIMES = 240  # columns of the rows of colours
ENDS = f', unless that is in the last {DWELL} % of the time'
Drawn = tuple[Figure | None, str, str]


def still_to_come(run: Sketch) -> tuple[np.ndarray, np.ndarray]:
    """Largest error from each time on, as a multiple of the band in which it counts as settled.

    Returns
    -------
    t : (n,) s
    ratio : (n,) the largest of the six degrees of freedom; below 1 from where all have settled

    """
    lines = [run.line('error', i, 'log') for i in range(6)]
    band = band_of(run.part('nu_d').peak)
    t = np.unique(np.concatenate([times for times, _ in lines]))
    ratio = np.zeros(len(t))
    for (times, error), width in zip(lines, band, strict=True):
        rest = np.maximum.accumulate(np.abs(error)[::-1])[::-1] / width
        behind = np.searchsorted(times, t)  # the first sample at or after t has what is to come
        ratio = np.maximum(ratio, np.append(rest, 0.0)[behind])
    return t, ratio


def errors(entries: Sequence[Entry]) -> Drawn:
    """The error still to come of every run. Returns figure, title and caption."""
    groups = _groups(entries)
    labels = list(dict.fromkeys(label for group in groups.values() for label in group))
    title = 'Error still to come, in multiples of its band'
    caption = (
        f'{title}: the largest velocity error between t and the end of the run, of all six '
        'degrees of freedom, divided by the band in which it counts as settled '
        f'({BAND_TEXT}). '
    )
    if not groups:
        return None, title, f'{title}: without set-points there is none.'
    if len(groups) <= MOST_PANELS and len(labels) <= MOST_LINES:
        caption += f'A run has settled where its line falls below the dotted 1{ENDS}. '
        figure = _panels(groups, labels)
    else:
        caption += f'Each row is a run; it has settled where its colours end{ENDS}. '
        figure = _rows([e for e in entries if e.sketch and e.sketch.knows_setpoint])
    return figure, title, caption + 'Time is logarithmic.'


def _groups(entries: Sequence[Entry]) -> dict[str, dict[str, Sketch]]:
    """Scenario -> label in its panel -> run."""
    groups: dict[str, dict[str, Sketch]] = {}
    for entry in entries:
        if entry.sketch is not None and entry.sketch.knows_setpoint:
            label = entry.name.removeprefix(f'{entry.scenario}/')
            groups.setdefault(entry.scenario, {})[label] = entry.sketch
    return groups


def _panels(groups: Mapping[str, Mapping[str, Sketch]], labels: Sequence[str]) -> Figure:
    down = -(-len(groups) // ACROSS)
    across = -(-len(groups) // down)
    figure = plotting.new_figure(0.5 + 1.75 * down)
    panels = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True).ravel()
    looks = {label: look(i) for i, label in enumerate(labels)}
    for axes, (scenario, runs) in zip(panels, groups.items(), strict=False):
        for label, run in runs.items():
            t, ratio = still_to_come(run)
            axes.plot(t[ratio > 0], ratio[ratio > 0], **looks[label])
        axes.axhline(1.0, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
        axes.set_title(scenario, loc='left')
        plotting.logarithmic(axes, 'x', 'y')
    low, high = panels[0].get_ylim()
    panels[0].set_ylim(max(low, SMALLEST), min(high, LARGEST))
    for axes in panels[len(groups) :]:
        axes.set_axis_off()
    for axes in panels[max(len(groups) - across, 0) : len(groups)]:
        axes.tick_params(labelbottom=True)  # nothing is below it
    handles = [Line2D([], [], **looks[label]) for label in labels]
    figure.legend(handles, labels, loc='outside upper right', ncols=4, handlelength=2.6)
    figure.supxlabel('$t$ (s)', fontsize='medium')
    figure.supylabel('error still to come / band', fontsize='medium')
    return figure


def look(index: int) -> dict[str, Any]:
    """Colour and dashes of one of `MOST_LINES` lines."""
    return {'color': MANY[index % len(MANY)], 'linestyle': DASHES[index % len(DASHES)]}


def _rows(entries: Sequence[Entry]) -> Figure:
    lines = [still_to_come(entry.sketch) for entry in entries if entry.sketch]
    first = min(t[t > 0].min() for t, _ in lines)
    times = np.geomspace(first, max(t[-1] for t, _ in lines), TIMES)
    values = np.full((len(lines), TIMES), np.nan)
    for row, (t, ratio) in zip(values, lines, strict=True):
        inside = times <= t[-1]
        row[inside] = ratio[np.searchsorted(t, times[inside])]
    shown = np.ma.masked_where(~(values >= 1.0), values)
    figure = plotting.new_figure(min(MARGIN + ROW * len(lines), TALLEST))
    axes = figure.subplots()
    edges = np.geomspace(first, times[-1], TIMES + 1)
    mesh = axes.pcolormesh(
        edges, np.arange(len(lines) + 1) - 0.5, np.log10(shown), cmap='cividis_r', vmin=0.0
    )
    axes.set(xscale='log', ylim=(len(lines) - 0.5, -0.5), xlabel='$t$ (s)')
    axes.grid(False)
    name_rows(axes, [entry.name for entry in entries], len(entries))
    figure.colorbar(mesh, ax=axes, label='log10 of the error still to come / band', fraction=0.04)
    return figure
