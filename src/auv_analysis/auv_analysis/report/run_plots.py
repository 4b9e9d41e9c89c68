"""Plots of runs: signals, errors still to come, energy, certificate, couplings."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.metrics.coupling import structural_zeros
from auv_analysis.metrics.energy import shares
from auv_analysis.metrics.lyapunov import OF_THE_MOTION
from auv_analysis.metrics.quantities import SIGNALS, VELOCITY, Quantity
from auv_analysis.metrics.settling import BAND_TEXT, DWELL, TRANSIENT, band_of
from auv_analysis.metrics.statistics import Part
from auv_analysis.output.text import join, number
from auv_analysis.report import plots
from auv_analysis.report.digest import ESTIMATES, FOREVER, RunDigest, alike, common_window, digests
from auv_analysis.report.panels import different_disturbances
from auv_analysis.report.plots import COLOURS, GREY, Drawn, FigureRecord, save_figures
from auv_analysis.report.wrench_plots import (
    applied_figure,
    certificate_figure,
    estimate_figure,
    is_drawn,
    leave_out,
)
from auv_analysis.runs.run import Run
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import control_model

SYMBOLS = {'delta_xi': 'Δξ', 'delta_pi': 'Δπ'}


def draw_figures(
    runs: Mapping[str, Run | RunDigest],
    folder: Path,
    summaries: Mapping[str, Mapping[str, Any]] | None = None,
    limits: Mapping[str, np.ndarray | None] | None = None,
) -> list[FigureRecord]:
    """Draw every figure that these runs allow, as PNG and PDF.

    Parameters
    ----------
    runs : name -> run, any number of any laws; the name is that of its controller
    folder : where the files go; made when it is not there
    summaries : name -> `summarize(run)`, for the certificate; none: it is not drawn
    limits : name -> (6,) axis limits of the actuators, N and N m; none: there are none

    Returns
    -------
    figures : in the order of the report; lumped errors only where F is known and estimated

    """
    drawn = digests(runs)
    made: dict[str, Callable[[], Drawn]] = {}
    for name, run in drawn.items():
        made[f'errors_{name}'] = partial(_errors, run)
    made['settling'] = partial(settling, drawn)
    for name, run in drawn.items():
        if run.knows_disturbance:
            made[f'lumped_error_{name}'] = partial(_lumped, run)
    for name, run in drawn.items():
        for kind in ESTIMATES:
            if kind in run.columns:
                made[f'{kind}_{name}'] = partial(estimate_figure, run, kind)
    for name, run in different_disturbances(drawn).items():
        made[f'uncertainty_{name}'] = partial(_uncertainty, run)
    for name, run in drawn.items():
        made[f'inputs_{name}'] = partial(_inputs, run, (limits or {}).get(name))
    if len(drawn) > 1:
        made['compared_inputs'] = partial(inputs, drawn)
    for name, run in drawn.items():
        if summaries is not None and is_drawn(summaries[name]):
            made[f'certificate_{name}'] = partial(certificate_figure, run, summaries[name])
    leading = reference(drawn)
    made['kinetic_energy'] = partial(energy, drawn, leading)
    made['energy_shares'] = partial(energy_shares, drawn)
    for kind in SYMBOLS:
        made[kind] = partial(_deformation, kind, leading)
    return list(save_figures(folder, made).values())


def reference(runs: Mapping[str, RunDigest]) -> RunDigest:
    """The run whose energy and couplings are drawn: the first under GVC, else the first."""
    return min(runs.values(), key=lambda run: run.law != 'gvc')


def six_signals(signal: str, run: RunDigest, zeros: Sequence[str] = ()) -> Drawn:
    """Linear and angular signals of a run, the first phase apart where it dwarfs the rest.

    Parameters
    ----------
    signal : of `RunDigest` and of `SIGNALS`
    run : whose signals they are
    zeros : degrees of freedom that vanish for every motion: named, not drawn

    Returns
    -------
    figure, title, caption : no figure where nothing moves

    """
    quantity = SIGNALS[signal]
    title = f'{quantity.label.capitalize()}, {run.controller}'
    if signal not in run.columns:
        return None, title, f'{title}: without a set-point there is none.'
    drawn = plots.moving(run.part(signal), zeros)
    structure = structure_sentence(signal, zeros)
    lacking = plots.unrecorded(run.part(signal), zeros)
    without = f'Not recorded, or resting on what was not: {join(lacking)}.' if lacking else ''
    if not drawn:
        nothing = 'not recorded, or resting on what was not' if lacking else 'zero throughout'
        return None, title, structure if len(zeros) == 6 else f'{title}: {nothing}.'
    split = (signal, 'early') in run.traces
    caption = [f'{title}.']
    if split:
        caption.append(f'Left the first {TRANSIENT:g} s, right the rest on a scale of its own.')
    caption += [_peaks(run.part(signal), quantity, drawn), structure]
    still = [d for i, d in enumerate(DOFS) if i not in drawn and d not in (*zeros, *lacking)]
    if still:
        caption.append(f'Zero throughout this run and not drawn: {join(still)}.')
    caption.append(without)
    caption.append(plots.shade_sentence(run).strip())
    figure = _panels(run, signal, quantity, drawn, split=split)
    return figure, title, ' '.join(filter(None, caption))


def structure_sentence(kind: str, zeros: Sequence[str]) -> str:
    """Terms that vanish by the structure of M, in words."""
    if not zeros:
        return ''
    if len(zeros) == 6:
        return f'{SYMBOLS[kind]} vanishes in all six degrees of freedom: M is diagonal.'
    return f'Zero for every motion by the structure of M and not drawn: {join(zeros)}.'


def _errors(run: RunDigest) -> Drawn:
    figure, title, caption = six_signals('error', run)
    if run.sensing:
        caption += ' The law saw measured velocities; these errors are those of the true ones.'
    return figure, title, caption


def _lumped(run: RunDigest) -> Drawn:
    if not run.estimates:
        title = f'Lumped estimation error, {run.controller}'
        text = 'the law estimates nothing; w is −F, no error of an estimate, and not drawn.'
        return None, title, f'{title}: {text}'
    return six_signals('lumped_error', run)


def _uncertainty(run: RunDigest) -> Drawn:
    figure, title, caption = six_signals('F', run)
    kinds = [kind.replace('_', ' ') for kind in OF_THE_MOTION if kind in (run.kinds or ())]
    if kinds:
        caption += f' F contains {join(kinds)} and so depends on the motion of this very run.'
    return figure, title, caption


def _inputs(run: RunDigest, limit: np.ndarray | None) -> Drawn:
    if run.acting and np.any(run.part('tau').peak):
        return applied_figure(run, limit)
    return six_signals('tau', run)


def _deformation(kind: str, run: RunDigest) -> Drawn:
    zeros = structural_zeros(control_model(run.vehicle).Upsilon.reshape(6, 6))[kind]
    figure, title, caption = six_signals(kind, run, zeros)
    if kind == 'delta_pi' and run.acting and figure is not None:
        caption += ' Of the commanded wrench.'
    return figure, title, caption


def _peaks(part: Part, quantity: Quantity, drawn: Sequence[int]) -> str:
    parts = []
    for columns in _groups(drawn):
        peak, i = max((part.peak[i], i) for i in columns)
        parts.append(f'{number(peak)} {quantity.unit_of(i)} in {DOFS[i]} at {part.at[i]:.2f} s')
    return f'Largest: {join(parts)}.'


def _groups(columns: Sequence[int]) -> list[list[int]]:
    """Those columns that are linear, then those that are angular; no group is empty."""
    split = ([i for i in columns if i in members] for members in plots.GROUPS)
    return [members for members in split if members]


def _panels(
    run: RunDigest, signal: str, quantity: Quantity, drawn: Sequence[int], *, split: bool
) -> Figure:
    """A row of linear and one of angular signals, whole or in the two phases of the time."""
    groups, parts = _groups(drawn), ('early', 'late') if split else ('whole',)
    height, ratios = (2.15, (1, 1.9)) if split else (2.0, (1,))
    figure = plots.new_figure(height * len(groups) + 0.25)
    shape = len(groups), len(parts)
    grid = figure.subplots(*shape, squeeze=False, sharex=not split, width_ratios=ratios)
    for row, columns in enumerate(groups):
        for column, part in enumerate(parts):
            draw_lines(grid[row, column], run, signal, part, columns)
            plots.letter(grid[row, column], len(parts) * row + column)
        grid[row, 0].set_ylabel(quantity.axis(columns))
        plots.key(grid[row, -1], quantity, columns)
    for axes in grid[-1]:
        axes.set_xlabel('$t$ (s)')
    return figure


NO_TOTAL = 'not all velocities were recorded, so neither the total nor its shares are known.'
GREY_LINE = ', and in grey that of a vehicle that moves exactly as the set-point{} asks'
HALF = 60  # characters of a legend above one of two panels
LONG_HANDLE = 8  # characters that a line takes in a legend, with what parts it from the next one
MARKERS = 'os^vPXD<>*ph'
SMALLEST_SHARE = 1e-6  # %, left end of the logarithmic axis
APART = 20.0  # ratio of peaks from which runs share no linear scale
XI = tuple(rf'$\xi_{i}$' for i in range(1, 7))


def settling(runs: Mapping[str, RunDigest]) -> tuple[Figure | None, str, str]:
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
        if all(np.isnan(run.part('error').peak[i]) for run in runs.values()):
            leave_out(axes)
            continue
        if (band := bands[i]) is not None:
            axes.axhline(band, color=GREY, linewidth=0.8, linestyle=(0, (1, 2)))
        plots.logarithmic(axes, 'x', 'y')
    for row, unit in zip((0, 3), VELOCITY, strict=True):
        panels[row].set_ylabel(rf'$\max_{{s\,\geq\,t}}|\Delta\nu(s)|$ ({unit})')
    caption = (
        f'{title}: the largest velocity error between t and the end of the run, '
        f'{_named_dashes(runs)}. An error has settled where its line falls below the dotted band '
        f'({BAND_TEXT}{left_out(bands)}), unless that is in the last {DWELL} % of the run. '
        'Both axes are logarithmic; at the end of the run little is to come and every line drops.'
    )
    return figure, title, caption


def common_bands(runs: Mapping[str, RunDigest]) -> list[float | None]:
    """Band of a settled error per degree of freedom; None where the runs do not share it."""
    bands = np.array([band_of(run.part('nu_d').peak) for run in runs.values()])
    return [
        float(band[0]) if np.allclose(band, band[0], rtol=1e-6, atol=0.0, equal_nan=True) else None
        for band in bands.T
    ]


def left_out(bands: Sequence[float | None]) -> str:
    """Words of a caption on bands that are not drawn."""
    return '; not drawn where the set-points of the runs differ' if None in bands else ''


def inputs(runs: Mapping[str, RunDigest]) -> tuple[Figure, str, str]:
    """Inputs of all controllers over logarithmic time. Returns figure, title and caption."""
    figure, panels = _six_panels(runs)
    apart = False
    for i, axes in enumerate(panels):
        path = [run.part('tau').path[i] for run in runs.values()]
        if np.isnan(path).all():
            leave_out(axes)
            continue
        above = 3.0 - np.argsort(np.argsort(path)) / len(runs)  # smooth lines over restless ones
        for look, run, order in zip(_looks(runs, COLOURS[i]), runs.values(), above, strict=True):
            axes.plot(*run.drawn('tau', i, 'log'), zorder=order, **look)
        plots.logarithmic(axes, 'x')
        apart = _symmetric(axes, [run.part('tau').peak[i] for run in runs.values()]) or apart
    for i in range(6):
        panels[i].set_ylabel(SIGNALS['tau'].axis([i]))
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


def fitting(names: Sequence[str], columns: int, room: int = 115) -> tuple[list[str], int]:
    """Names that fit into a legend, cut in their middle, and its columns.

    Parameters
    ----------
    names : of the lines
    columns : at most
    room : characters beside each other, handles included

    """
    most = room - LONG_HANDLE
    short = [n if len(n) <= most else f'{n[: most // 2]}…{n[-(most // 2) :]}' for n in names]
    longest = max(map(len, short), default=1) + LONG_HANDLE
    return short, max(min(columns, len(short), room // longest), 1)


def energy(runs: Mapping[str, RunDigest], leading: RunDigest) -> Drawn:
    """Kinetic energy over time and its shares. Returns figure, title and caption."""
    if leading.unknown:
        return None, 'Kinetic energy', f'Kinetic energy: {NO_TOTAL}'
    figure = plots.new_figure(2.7)
    left, right = figure.subplots(1, 2)
    handles, wanted = [], []
    whose = '' if alike([*runs.values()], 'nu_d') else f' of {leading.controller}'
    if leading.knows_setpoint:
        wanted = [f'set-point{whose}']
        handles = left.plot(*leading.drawn('wanted'), color='#b5b5b5', linewidth=3.2)
    for look, run in zip(_looks(runs), runs.values(), strict=True):
        handles += left.plot(*run.drawn('kinetic'), **look)
    names, columns = fitting([*wanted, *runs], 3, HALF)
    plots.legend_above(left, columns, handles, names)
    left.set_ylim(bottom=0.0)
    left.set_ylabel('kinetic energy (J)')
    _stack(right, leading)
    for axes in (left, right):
        plots.shade(axes, leading)
    for index, (axes, shown) in enumerate(((left, [*runs.values()]), (right, [leading]))):
        ends = [run.start + run.duration for run in shown]
        axes.set_xlim(min(run.start for run in shown), max(ends))
        axes.set_xlabel('$t$ (s)')
        plots.letter(axes, index)
    title = 'Kinetic energy'
    caption = (
        f'{title}: (a) of each controller{GREY_LINE.format(whose) if wanted else ""}; '
        f'(b) shares of the components of {leading.controller}, equation (30).'
        f'{plots.shade_sentence(leading)}'
    )
    return figure, title, caption


def energy_shares(runs: Mapping[str, RunDigest]) -> Drawn:
    """Shares of the mean kinetic energy on a logarithmic axis."""
    end = common_window(runs)
    runs = {name: run for name, run in runs.items() if not run.unknown}
    if not runs:
        return None, 'Shares of kinetic energy', f'Shares of kinetic energy: {NO_TOTAL}'
    figure = plots.new_figure(2.9)
    axes = figure.subplots()
    rows = len(runs)
    offsets = (np.arange(rows) - (rows - 1) / 2) * 0.62 / max(rows, 2)
    handles, smallest = [], 1.0
    for offset, marker, run in zip(offsets, MARKERS * rows, runs.values(), strict=False):
        early, whole = (shares(run.part('energy', 0.0, last).mean) for last in (end, FOREVER))
        place = {'y': np.arange(6) + offset, 'marker': marker, 'edgecolors': COLOURS, 's': 30}
        axes.scatter(whole, facecolors='white', linewidths=1.0, zorder=3, **place)
        axes.scatter(early, facecolors=COLOURS, linewidths=1.0, zorder=4, **place)
        both = np.append(early, whole)
        smallest = min([smallest, *both[both > 0]])
        handles.append(Line2D([], [], linestyle='', marker=marker, color='black', markersize=5))
    left = max(10.0 ** np.floor(np.log10(smallest) - 0.3), SMALLEST_SHARE)
    plots.logarithmic(axes, 'x')
    axes.set(xlim=(left, 160.0), ylim=(5.5, -0.5), yticks=range(6))
    axes.set_yticklabels([f'{XI[i]} {DOFS[i]}' for i in range(6)])
    axes.tick_params(axis='y', length=0)
    axes.set_xlabel('share of the mean kinetic energy (%)')
    names, columns = fitting([*runs], 4)
    plots.legend_above(axes, columns, handles, names)
    title = 'Shares of kinetic energy'
    caption = (
        f'{title}: mean of the samples of 0 to {end:g} s (filled) and of the whole run '
        '(open), logarithmic axis.'
    )
    return figure, title, caption


def _stack(axes: Axes, run: RunDigest) -> None:
    """Shares (30) over time, stacked; long runs as means over columns of samples."""
    t, part = run.shares()
    axes.stackplot(t, part.T, colors=COLOURS, linewidth=0)
    shown = [i for i in range(6) if part[:, i].max(initial=0.0) > 1.0]
    patches = [Line2D([], [], color=COLOURS[i], linewidth=6) for i in shown]
    plots.legend_above(axes, 6, patches, [XI[i] for i in shown])
    axes.set_ylim(0.0, 100.0)
    axes.set_ylabel('share (%)')
    axes.grid(False)


def _looks(runs: Mapping[str, RunDigest], colour: str = 'black') -> list[dict[str, Any]]:
    """Dashes per run; of three runs and more, or noisy ones, a colour per run for the given one."""
    many = len(runs) > 2 or any(run.sensing for run in runs.values())
    return [plots.look(i) | ({} if many else {'color': colour}) for i in range(len(runs))]


def _symmetric(axes: Axes, peaks: list[float]) -> bool:
    """Symmetric logarithmic axis where the peaks of the runs are far apart; whether it is one."""
    peaks = [peak for peak in peaks if peak > 0]
    if not peaks or max(peaks) < APART * min(peaks):
        return False
    plots.symmetric(axes, min(peaks))
    return True


def _named_dashes(runs: Mapping[str, RunDigest]) -> str:
    words = ('solid', 'dashed', 'dotted', 'dash-dotted', 'long-dashed', 'dash-dot-dotted')
    return join([f'{name} {words[i % len(words)]}' for i, name in enumerate(runs)])


def _six_panels(runs: Mapping[str, RunDigest]) -> tuple[Figure, list[Axes]]:
    figure = plots.new_figure(4.1)
    panels = list(figure.subplots(2, 3, sharex=True).ravel())
    for i, axes in enumerate(panels):
        plots.letter(axes, i, DOFS[i])
    handles = [Line2D([], [], **look) for look in _looks(runs)]
    names, columns = fitting([*runs], 4)
    figure.legend(handles, names, loc='outside upper right', ncols=columns, handlelength=2.6)
    for axes in panels[3:]:
        axes.set_xlabel('$t$ (s)')
    return figure, panels


def draw_lines(axes: Axes, run: RunDigest, signal: str, part: str, columns: Sequence[int]) -> None:
    """Lines of some columns of a signal over a part of the time, in their colours."""
    ends = []
    for i in columns:
        t, y = run.drawn(signal, i, part)
        axes.plot(t, y, color=COLOURS[i])
        ends = [t[0], t[-1]]
    axes.set_xlim(*ends)
    plots.shade(axes, run)
