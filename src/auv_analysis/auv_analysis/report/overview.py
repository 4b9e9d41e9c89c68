"""Figures that put the controllers of a scenario side by side: errors, inputs, energy."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.metrics.energy import shares
from auv_analysis.metrics.summary import BAND_TEXT, DWELL, band_of
from auv_analysis.output.text import join
from auv_analysis.report import paper, plotting
from auv_analysis.report.plotting import COLOURS, DASHES, GREY
from auv_analysis.report.sketch import FOREVER, Sketch, alike
from auv_analysis.report.sketching import common_window
from auv_dynamics.vehicle import DOFS

GREY_LINE = ', and in grey that of a vehicle that moves exactly as the set-point{} asks'
MARKERS = 'os^vPX'
SMALLEST_SHARE = 1e-6  # %, left end of the logarithmic axis
RUNS = ('#1a1a1a', '#D55E00', '#0072B2', '#009E73', '#CC79A7', '#E69F00')  # of three runs and more
APART = 20.0  # ratio of peaks from which runs share no linear scale
XI = tuple(rf'$\xi_{i}$' for i in range(1, 7))


def settling(runs: Mapping[str, Sketch]) -> tuple[Figure | None, str, str]:
    """The largest error still to come, per degree of freedom and controller.

    The envelope max of abs(nu_err) over [t, end] falls monotonically: where it crosses the band
    the error has settled. Returns figure, title and caption; no figure where no run
    has a set-point.

    """
    runs = {name: run for name, run in runs.items() if run.knows_setpoint}
    title = 'Error still to come'
    if not runs:
        return None, title, f'{title}: without a set-point there is none.'
    figure, panels = _six_panels(runs)
    bands = common_bands(runs)
    for i, axes in enumerate(panels):
        for look, run in zip(_looks(runs, COLOURS[i]), runs.values(), strict=True):
            t, error = run.line('error', i, 'log')
            rest = np.maximum.accumulate(error[::-1])[::-1]
            axes.plot(t[rest > 0], rest[rest > 0], **look)
        if (band := bands[i]) is not None:
            axes.axhline(band, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
        plotting.logarithmic(axes, 'x', 'y')
    for row, unit in zip((0, 3), plotting.VELOCITY, strict=True):
        panels[row].set_ylabel(rf'$\max_{{s\,\geq\,t}}|\Delta\nu(s)|$ ({unit})')
    caption = (
        f'{title}: the largest velocity error between t and the end of the run, '
        f'{_named_dashes(runs)}. An error has settled where its line falls below the dotted band '
        f'({BAND_TEXT}{left_out(bands)}), unless that is in the last {DWELL} % of the run. '
        'Both axes are logarithmic; at the end of the run little is to come and every line drops.'
    )
    return figure, title, caption


def common_bands(runs: Mapping[str, Sketch]) -> list[float | None]:
    """Band of a settled error per degree of freedom; None where the runs do not share it."""
    bands = np.array([band_of(run.part('nu_d').peak) for run in runs.values()])
    return [
        float(band[0]) if np.allclose(band, band[0], rtol=1e-6, atol=0.0) else None
        for band in bands.T
    ]


def left_out(bands: Sequence[float | None]) -> str:
    """What a caption says of bands that are not drawn."""
    return '; not drawn where the set-points of the runs differ' if None in bands else ''


def inputs(runs: Mapping[str, Sketch]) -> tuple[Figure, str, str]:
    """Inputs of all controllers over logarithmic time. Returns figure, title and caption."""
    figure, panels = _six_panels(runs)
    apart = False
    for i, axes in enumerate(panels):
        path = [run.part('tau').path[i] for run in runs.values()]
        above = 3.0 - np.argsort(np.argsort(path)) / len(runs)  # smooth lines over restless ones
        for look, run, order in zip(_looks(runs, COLOURS[i]), runs.values(), above, strict=True):
            axes.plot(*run.drawn('tau', i, 'log'), zorder=order, **look)
        plotting.logarithmic(axes, 'x')
        apart = _symmetric(axes, [run.part('tau').peak[i] for run in runs.values()]) or apart
    for i, unit in enumerate(3 * plotting.WRENCH[:1] + 3 * plotting.WRENCH[1:]):
        panels[i].set_ylabel(f'{plotting.INPUT.symbols[i]} ({unit})')
    title = 'Inputs compared'
    if any(run.acting for run in runs.values()):
        title += ', as commanded'
    caption = (
        f'{title}: {_named_dashes(runs)}. Time is logarithmic, so that the first instants, '
        'where the laws differ most, and the steady part both show; '
        'the sample at t = 0 stands at the left edge.'
    )
    if apart:
        caption += (
            f' Where one run’s peak is more than {APART:g} times another’s, the scale is linear '
            'between the two dotted lines and logarithmic beyond.'
        )
    return figure, title, caption


def energy(runs: Mapping[str, Sketch], leading: Sketch) -> tuple[Figure, str, str]:
    """Kinetic energy over time and its shares. Returns figure, title and caption."""
    figure = plotting.new_figure(2.7)
    left, right = figure.subplots(1, 2)
    handles, wanted = [], []
    whose = '' if alike([*runs.values()], 'nu_d') else f' of {leading.controller}'
    if leading.knows_setpoint:
        wanted = [f'set-point{whose}']
        handles = left.plot(*leading.drawn('wanted'), color='#b5b5b5', linewidth=3.2)
    for look, run in zip(_looks(runs), runs.values(), strict=True):
        handles += left.plot(*run.drawn('kinetic'), **look)
    left.legend(
        handles,
        [*wanted, *runs],
        loc='lower right',
        bbox_to_anchor=(1.0, 1.02),
        ncols=3,
    )
    left.set_ylim(bottom=0.0)
    left.set_ylabel('kinetic energy (J)')
    _stack(right, leading)
    for axes in (left, right):
        plotting.shade(axes, leading)
    for index, axes in enumerate((left, right)):
        axes.set_xlim(leading.start, leading.start + leading.duration)
        axes.set_xlabel('$t$ (s)')
        plotting.letter(axes, index)
    title = 'Kinetic energy'
    caption = (
        f'{title}: (a) of each controller{GREY_LINE.format(whose) if wanted else ""}; '
        f'(b) shares of the components of {leading.controller}, equation (30).'
        f'{plotting.shade_sentence(leading)}'
    )
    return figure, title, caption


def energy_shares(runs: Mapping[str, Sketch]) -> tuple[Figure, str, str]:
    """Shares of the mean kinetic energy on a logarithmic axis, the paper's beside case1's."""
    figure = plotting.new_figure(2.9)
    axes = figure.subplots()
    end = common_window(runs)
    printed = paper.SHARES if _is_case1(runs) else None
    rows = len(runs) + (printed is not None)
    offsets = (np.arange(rows) - (rows - 1) / 2) * 0.62 / max(rows, 2)
    handles, smallest = [], 1.0
    for offset, marker, run in zip(offsets, MARKERS * rows, runs.values(), strict=False):
        early, whole = (shares(run.part('energy', 0.0, last).mean) for last in (end, FOREVER))
        for i in range(6):
            place = {'y': i + offset, 'marker': marker, 'edgecolors': COLOURS[i], 's': 30}
            axes.scatter(whole[i], facecolors='white', linewidths=1.0, zorder=3, **place)
            axes.scatter(early[i], facecolors=COLOURS[i], linewidths=1.0, zorder=4, **place)
        smallest = min([smallest, *early[early > 0], *whole[whole > 0]])
        handles.append(_mark(marker, run.controller))
    left = max(10.0 ** np.floor(np.log10(smallest) - 0.3), SMALLEST_SHARE)
    if printed:
        _printed_shares(axes, printed, offsets[-1], left)
        handles.append(_mark('D', 'paper', GREY))
    plotting.logarithmic(axes, 'x')
    axes.set(xlim=(left, 160.0), ylim=(5.5, -0.5), yticks=range(6))
    axes.set_yticklabels([f'{XI[i]} {DOFS[i]}' for i in range(6)])
    axes.tick_params(axis='y', length=0)
    axes.set_xlabel('share of the mean kinetic energy (%)')
    axes.legend(handles=handles, loc='lower right', bbox_to_anchor=(1.0, 1.02), ncols=rows)
    title = 'Shares of kinetic energy'
    caption = (
        f'{title}: mean of the samples of 0 to {end:g} s (filled) and of the whole run '
        '(open), logarithmic axis.'
    )
    if printed:
        caption += (
            ' The paper prints two decimals and no window; a grey bar stands for its 0.00 %, '
            'anything below 0.005 %.'
        )
    return figure, title, caption


def _printed_shares(axes: Axes, printed: tuple[float, ...], offset: float, left: float) -> None:
    for i, share in enumerate(printed):
        if share > 0:
            axes.scatter(share, i + offset, marker='D', color=GREY, s=24, zorder=3)
        else:
            bounds = [left, paper.SHARES_DIGIT]
            axes.plot(bounds, 2 * [i + offset], color=GREY, linewidth=2.5, solid_capstyle='butt')


def _is_case1(runs: Mapping[str, Sketch]) -> bool:
    run = paper.paper_run(runs, 'gvc')
    return run is not None and run.scenario == 'case1'


def _mark(marker: str, label: str, colour: str = 'black') -> Line2D:
    return Line2D([], [], linestyle='', marker=marker, color=colour, markersize=5, label=label)


def _stack(axes: Axes, run: Sketch) -> None:
    """Shares (30) over time, stacked; long runs as means over columns of samples."""
    t, part = run.shares()
    axes.stackplot(t, part.T, colors=COLOURS, linewidth=0)
    shown = [i for i in range(6) if part[:, i].max(initial=0.0) > 1.0]
    patches = [Line2D([], [], color=COLOURS[i], linewidth=6) for i in shown]
    axes.legend(
        patches, [XI[i] for i in shown], loc='lower right', bbox_to_anchor=(1.0, 1.02), ncols=6
    )
    axes.set_ylim(0.0, 100.0)
    axes.set_ylabel('share (%)')
    axes.grid(False)


def _looks(runs: Mapping[str, Sketch], colour: str = 'black') -> list[dict[str, Any]]:
    """Dashes per run; of three runs and more, or noisy ones, a colour per run for the given one."""
    many = len(runs) > 2 or any(run.sensing for run in runs.values())
    return [
        {'linestyle': DASHES[i % len(DASHES)], 'color': RUNS[i % len(RUNS)] if many else colour}
        for i in range(len(runs))
    ]


def _symmetric(axes: Axes, peaks: list[float]) -> bool:
    """Symmetric logarithmic axis where the peaks of the runs are far apart; whether it is one."""
    peaks = [peak for peak in peaks if peak > 0]
    if not peaks or max(peaks) < APART * min(peaks):
        return False
    plotting.symmetric(axes, min(peaks))
    return True


def _named_dashes(runs: Mapping[str, Sketch]) -> str:
    words = ('solid', 'dashed', 'dotted', 'dash-dotted', 'long-dashed', 'dash-dot-dotted')
    return join([f'{name} {words[i % len(words)]}' for i, name in enumerate(runs)])


def _six_panels(runs: Mapping[str, Sketch]) -> tuple[Figure, list[Axes]]:
    figure = plotting.new_figure(4.1)
    panels = list(figure.subplots(2, 3, sharex=True).ravel())
    for i, axes in enumerate(panels):
        plotting.letter(axes, i, DOFS[i])
    handles = [Line2D([], [], **look) for look in _looks(runs)]
    figure.legend(
        handles, list(runs), loc='outside upper right', ncols=min(len(runs), 4), handlelength=2.6
    )
    for axes in panels[3:]:
        axes.set_xlabel('$t$ (s)')
    return figure, panels
