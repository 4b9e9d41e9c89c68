"""Plots of runs: signals, errors still to come, energy, certificate, couplings."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from auv_analysis.metrics.coupling import structural_zeros
from auv_analysis.metrics.energy import shares
from auv_analysis.metrics.lyapunov import OF_THE_MOTION
from auv_analysis.metrics.quantities import SIGNALS, VELOCITY, WRENCH, Quantity, mathtext
from auv_analysis.metrics.summary import BAND_TEXT, DWELL, TRANSIENT, band_of
from auv_analysis.output.text import join, number
from auv_analysis.report import plots
from auv_analysis.report.digest import FOREVER, Sketch, alike, common_window, sketches
from auv_analysis.report.panels import different_disturbances
from auv_analysis.report.plots import COLOURS, DASHES, GREY, RUNS, Drawn, FigureRecord, save_figures
from auv_analysis.report.statistics import Part
from auv_analysis.runs.run import AnyRun
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import control_model

DRAWN = {  # kind of figure -> signal of `Sketch`
    'errors': 'error',
    'lumped_error': 'lumped_error',
    'uncertainty': 'F',
    'inputs': 'tau',
    'delta_xi': 'delta_xi',
    'delta_pi': 'delta_pi',
}
SYMBOLS = {'delta_xi': 'Δξ', 'delta_pi': 'Δπ'}


def draw_figures(
    runs: Mapping[str, AnyRun | Sketch],
    folder: Path,
    summaries: Mapping[str, Mapping[str, Any]] | None = None,
    limits: Mapping[str, np.ndarray | None] | None = None,
) -> list[FigureRecord]:
    """Draw every figure that these runs allow, as PNG and PDF.

    Parameters
    ----------
    runs : name -> run, any number of any laws; the name goes into titles and file names
    folder : where the files go; made when it is not there
    summaries : name -> `summarize(run)`, for the certificate; none: it is not drawn
    limits : name -> (6,) axis limits of the actuators, N and N m; none: there are none

    Returns
    -------
    figures : in the order of the report; lumped errors only where F is known and estimated

    """
    drawn = {name: replace(run, controller=name) for name, run in sketches(runs).items()}
    made: dict[str, Callable[[], Drawn]] = {}
    for run in drawn.values():
        made[f'errors_{run.controller}'] = partial(_errors, run)
    made['settling'] = partial(settling, drawn)
    for run in drawn.values():
        if run.knows_disturbance:
            made[f'lumped_error_{run.controller}'] = partial(_lumped, run)
    for name, run in drawn.items():
        if 'unexplained' in run.columns:
            made[f'unexplained_{name}'] = partial(unexplained_figure, run)
    for run in different_disturbances(drawn).values():
        made[f'uncertainty_{run.controller}'] = partial(_uncertainty, run)
    for name, run in drawn.items():
        made[f'inputs_{name}'] = partial(_inputs, run, (limits or {}).get(name))
    if len(drawn) > 1:
        made['inputs_compared'] = partial(inputs, drawn)
    for name, run in drawn.items():
        if summaries is not None and is_drawn(summaries[name]):
            made[f'certificate_{name}'] = partial(certificate_figure, run, summaries[name])
    leading = reference(drawn)
    made['kinetic_energy'] = partial(energy, drawn, leading)
    made['energy_shares'] = partial(energy_shares, drawn)
    for kind in SYMBOLS:
        made[kind] = partial(_deformation, kind, leading)
    return list(save_figures(folder, made).values())


def reference(runs: Mapping[str, Sketch]) -> Sketch:
    """The run whose energy and couplings are drawn: the first under GVC, else the first."""
    return min(runs.values(), key=lambda run: run.law != 'gvc')


def six_signals(kind: str, run: Sketch, quantity: Quantity, zeros: Sequence[str] = ()) -> Drawn:
    """Linear and angular signals of a run, the first phase apart where it dwarfs the rest.

    Parameters
    ----------
    kind : of `DRAWN`
    run : whose signals they are
    quantity : what they are
    zeros : degrees of freedom that vanish for every motion: named, not drawn

    Returns
    -------
    figure, title, caption : no figure where nothing moves

    """
    title = f'{quantity.label.capitalize()}, {run.controller}'
    signal = DRAWN[kind]
    if signal not in run.columns:
        return None, title, f'{title}: without a set-point there is none.'
    drawn = plots.moving(run.part(signal), zeros)
    structure = structure_sentence(kind, zeros)
    if not drawn:
        return None, title, structure if len(zeros) == 6 else f'{title}: zero throughout.'
    split = (signal, 'early') in run.traces
    caption = [f'{title}.']
    if split:
        caption.append(f'Left the first {TRANSIENT:g} s, right the rest on a scale of its own.')
    caption += [_peaks(run.part(signal), quantity, drawn), structure]
    still = [dof for i, dof in enumerate(DOFS) if i not in drawn and dof not in zeros]
    if still:
        caption.append(f'Zero throughout this run and not drawn: {join(still)}.')
    caption.append(plots.shade_sentence(run).strip())
    figure = (_split_panels if split else _whole_panels)(run, signal, quantity, drawn)
    return figure, title, ' '.join(filter(None, caption))


def structure_sentence(kind: str, zeros: Sequence[str]) -> str:
    """What the structure of M makes vanish, in words."""
    if not zeros:
        return ''
    if len(zeros) == 6:
        return f'{SYMBOLS[kind]} vanishes in all six degrees of freedom: M is diagonal.'
    return f'Zero for every motion by the structure of M and not drawn: {join(zeros)}.'


def _errors(run: Sketch) -> Drawn:
    figure, title, caption = six_signals('errors', run, SIGNALS['error'])
    if run.sensing:
        caption += ' The law saw measured velocities; these errors are those of the true ones.'
    return figure, title, caption


def _lumped(run: Sketch) -> Drawn:
    if not run.estimates:
        title = f'Lumped estimation error, {run.controller}'
        text = 'the law estimates nothing; w is −F, no error of an estimate, and not drawn.'
        return None, title, f'{title}: {text}'
    return six_signals('lumped_error', run, SIGNALS['lumped_error'])


def _uncertainty(run: Sketch) -> Drawn:
    figure, title, caption = six_signals('uncertainty', run, SIGNALS['F'])
    kinds = [kind.replace('_', ' ') for kind in OF_THE_MOTION if kind in (run.kinds or ())]
    if kinds:
        caption += f' F contains {join(kinds)} and so depends on the motion of this very run.'
    return figure, title, caption


def _inputs(run: Sketch, limit: np.ndarray | None) -> Drawn:
    if run.acting and np.any(run.part('tau').peak):
        return applied_figure(run, limit)
    return six_signals('inputs', run, SIGNALS['tau'])


def _deformation(kind: str, run: Sketch) -> Drawn:
    model = control_model(run.vehicle)
    Upsilon, Upsilon_inv = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    zeros = structural_zeros(Upsilon, Upsilon_inv)[kind]
    if kind == 'delta_xi':
        return six_signals(kind, run, SIGNALS['delta_xi'], zeros)
    drawn = six_signals(kind, run, SIGNALS['delta_pi'], zeros)
    note = ' Of the commanded wrench.' if run.acting and drawn[0] is not None else ''
    return drawn[0], drawn[1], drawn[2] + note


def _peaks(part: Part, quantity: Quantity, drawn: Sequence[int]) -> str:
    parts = []
    for columns in plots.groups(drawn):
        peak, i = max((part.peak[i], i) for i in columns)
        parts.append(f'{number(peak)} {quantity.unit_of(i)} in {DOFS[i]} at {part.at[i]:.2f} s')
    return f'Largest: {join(parts)}.'


def _split_panels(run: Sketch, signal: str, quantity: Quantity, drawn: Sequence[int]) -> Figure:
    groups = plots.groups(drawn)
    figure = plots.new_figure(2.15 * len(groups) + 0.25)
    grid = figure.subplots(len(groups), 2, squeeze=False, width_ratios=(1, 1.9))
    for row, columns in enumerate(groups):
        for column, part in enumerate(('early', 'late')):
            axes = grid[row, column]
            plots.draw_lines(axes, run, signal, part, columns)
            plots.letter(axes, 2 * row + column)
        grid[row, 0].set_ylabel(quantity.axis(columns))
        plots.key(grid[row, 1], quantity, columns)
    for axes in grid[-1]:
        axes.set_xlabel('$t$ (s)')
    return figure


def _whole_panels(run: Sketch, signal: str, quantity: Quantity, drawn: Sequence[int]) -> Figure:
    groups = plots.groups(drawn)
    figure = plots.new_figure(2.0 * len(groups) + 0.25)
    grid = figure.subplots(len(groups), 1, squeeze=False, sharex=True)[:, 0]
    for row, columns in enumerate(groups):
        plots.draw_lines(grid[row], run, signal, 'whole', columns)
        grid[row].set_ylabel(quantity.axis(columns))
        plots.letter(grid[row], row)
        plots.key(grid[row], quantity, columns)
    grid[-1].set_xlabel('$t$ (s)')
    return figure


GREY_LINE = ', and in grey that of a vehicle that moves exactly as the set-point{} asks'
MARKERS = 'os^vPX'
SMALLEST_SHARE = 1e-6  # %, left end of the logarithmic axis
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


def energy(runs: Mapping[str, Sketch], leading: Sketch) -> tuple[Figure, str, str]:
    """Kinetic energy over time and its shares. Returns figure, title and caption."""
    figure = plots.new_figure(2.7)
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
        plots.shade(axes, leading)
    for index, axes in enumerate((left, right)):
        axes.set_xlim(leading.start, leading.start + leading.duration)
        axes.set_xlabel('$t$ (s)')
        plots.letter(axes, index)
    title = 'Kinetic energy'
    caption = (
        f'{title}: (a) of each controller{GREY_LINE.format(whose) if wanted else ""}; '
        f'(b) shares of the components of {leading.controller}, equation (30).'
        f'{plots.shade_sentence(leading)}'
    )
    return figure, title, caption


def energy_shares(runs: Mapping[str, Sketch]) -> tuple[Figure, str, str]:
    """Shares of the mean kinetic energy on a logarithmic axis."""
    figure = plots.new_figure(2.9)
    axes = figure.subplots()
    end = common_window(runs)
    rows = len(runs)
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
    plots.logarithmic(axes, 'x')
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
    return figure, title, caption


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
    plots.symmetric(axes, min(peaks))
    return True


def _named_dashes(runs: Mapping[str, Sketch]) -> str:
    words = ('solid', 'dashed', 'dotted', 'dash-dotted', 'long-dashed', 'dash-dot-dotted')
    return join([f'{name} {words[i % len(words)]}' for i, name in enumerate(runs)])


def _six_panels(runs: Mapping[str, Sketch]) -> tuple[Figure, list[Axes]]:
    figure = plots.new_figure(4.1)
    panels = list(figure.subplots(2, 3, sharex=True).ravel())
    for i, axes in enumerate(panels):
        plots.letter(axes, i, DOFS[i])
    handles = [Line2D([], [], **look) for look in _looks(runs)]
    figure.legend(
        handles, list(runs), loc='outside upper right', ncols=min(len(runs), 4), handlelength=2.6
    )
    for axes in panels[3:]:
        axes.set_xlabel('$t$ (s)')
    return figure, panels


BEYOND = 3.0  # times what else is to be seen: a command that is cut off and told in the panel
ROOM = 1.25  # of the axis above what it shows
COMMAND: dict[str, Any] = {'color': '#8a8a8a', 'linewidth': 0.8, 'linestyle': '-'}
LIMIT: dict[str, Any] = {'color': 'black', 'linewidth': 0.9, 'linestyle': (0, (1, 1.6))}


def applied_figure(run: Sketch, limit: np.ndarray | None) -> tuple[Figure, str, str]:
    """Commanded and applied wrench, a panel per degree of freedom.

    Parameters
    ----------
    run : with a wrench that was applied
    limit : (6,) axis limits, N and N m, drawn where they are in the panel; None: there are none

    Returns
    -------
    figure, title, caption

    """
    title = f'Input, {run.controller}'
    figure = plots.new_figure(5.6)
    panels = figure.subplots(3, 2, sharex=True)
    cut, missed = [], []
    for i, dof in enumerate(DOFS):
        axes = panels[i % 3, i // 3]
        bound = None if limit is None else float(limit[i])
        if _panel(axes, run, i, bound):
            cut.append(dof)
        if run.missed[i]:
            missed.append(dof)
        axes.set_ylabel(f'{mathtext(SIGNALS["tau"].components[i])} ({SIGNALS["tau"].unit_of(i)})')
        plots.letter(axes, i, dof)
    for axes in panels[-1]:
        axes.set_xlabel('$t$ (s)')
    figure.legend(*_applied_key(limit), loc='outside upper right', ncols=3, handlelength=2.4)
    return figure, title, _applied_caption(title, run, limit, cut, missed)


def _panel(axes: Axes, run: Sketch, i: int, bound: float | None) -> bool:
    """Draw one degree of freedom; whether its command was cut off by the axis."""
    command = run.part('tau')
    axes.plot(*run.drawn('tau', i), **COMMAND)
    axes.plot(*run.drawn('applied', i), color=COLOURS[i], linewidth=1.4)
    axes.set_xlim(run.start, run.start + run.duration)
    plots.shade(axes, run)
    seen = run.part('applied').peak[i]
    if bound is not None and bound <= BEYOND * max(seen, command.peak[i]):
        seen = max(seen, bound)
        for level in (-bound, bound):
            axes.axhline(level, **LIMIT)
    if not seen or command.peak[i] <= BEYOND * seen:
        return False
    axes.set_ylim(-ROOM * seen, ROOM * seen)
    peak = command.low[i] if command.low[i] == -command.peak[i] else command.high[i]
    reached = f'{number(peak)} {SIGNALS["tau"].unit_of(i)} at {command.at[i]:.2f} s'
    axes.set_title(f'command to {reached}', loc='right', fontsize=7.5)
    return True


def _applied_key(limit: np.ndarray | None) -> tuple[list[Line2D], list[str]]:
    looks: dict[str, dict[str, Any]] = {
        'commanded': COMMAND,
        'applied': {'color': 'black', 'lw': 1.4},
    }
    if limit is not None:
        looks['axis limit'] = LIMIT
    return [Line2D([], [], **look) for look in looks.values()], list(looks)


def _applied_caption(
    title: str, run: Sketch, limit: np.ndarray | None, cut: list[str], missed: list[str]
) -> str:
    parts = [
        f'{title}: commanded τ (thin, grey) and the wrench that the actuators applied (thick, in '
        'colour).'
    ]
    if limit is not None:
        parts.append('Dotted: axis limits, left out where everything stays far below them.')
    if cut:
        parts.append(f'The commands in {join(cut)} leave the panel: their peak is written above.')
    peak = run.part('applied').peak
    force, moment = peak[:3].max(), peak[3:].max()
    parts.append(f'Largest applied: {number(force)} N and {number(moment)} N m.')
    if not missed:
        parts.append('The two never differ in this run.')
    return ' '.join(parts) + plots.shade_sentence(run)


IDENTITY, BOUND, MEASURED = '#56B4E9', '#D55E00', '#1a1a1a'
RATES_APART = (
    10.0  # ratio of a largest value to what else is to be seen, from which it is logarithmic
)
DECADES = 5  # of a symmetric logarithmic axis, from its linear part to its end


def is_drawn(summary: Mapping[str, Any]) -> bool:
    """Whether (26) is the derivative of L in a run, so that the two can be held together."""
    return summary['lyapunov'].get('share_of_time_increasing') is not None


def certificate_figure(run: Sketch, summary: Mapping[str, Any]) -> tuple[Figure | None, str, str]:
    """L, and its measured derivative against (26) and (28). Returns figure, title and caption."""
    title = f'Certificate, {run.controller}'
    if run.samples < 3 or ('L', 'whole') not in run.traces or not len(run.line('L')[0]):
        return None, title, f'{title}: too little to draw.'
    split = ('identity', 'early') in run.traces
    figure = plots.new_figure(4.6)
    mosaic: list[list[Any]] = [['L', 'L'], ['early', 'late']] if split else [['L'], ['whole']]
    ratios = (1, 1.9) if split else (1,)
    panels = figure.subplot_mosaic(mosaic, height_ratios=(1, 1.25), width_ratios=ratios)
    _energy(panels.pop('L'), run, panels)
    partly = False
    for index, (part, axes) in enumerate(panels.items(), start=1):
        partly |= _rates(axes, run, part)
        plots.letter(axes, index)
        axes.set_xlabel('$t$ (s)')
    rates = list(panels.values())
    rates[0].set_ylabel(r'$\dot{L}$ (W)')
    _rates_key(rates[-1])
    return (
        figure,
        title,
        _certificate_caption(run, summary['lyapunov'], title, split=split, partly=partly),
    )


def _certificate_caption(
    run: Sketch, lyapunov: Mapping[str, Any], title: str, *, split: bool, partly: bool
) -> str:
    parts = [f'{title}: (a) L of (23) on a logarithmic axis; (b) its derivative, measured from L']
    parts[0] += ', against the identity (26) and the bound (28)'
    parts[0] += f', the first {TRANSIENT:g} s' if split else ''
    parts[0] += '; (c) the rest on a scale of its own.' if split else '.'
    if partly:
        parts += ['An axis with two dotted lines is linear between them and logarithmic beyond.']
    parts += ['Grey: where (26) is positive, so that L increases.']
    if run.hold == 'zoh':
        parts += ['The wrench is held between samples; (26) is that of the continuous law.']
    if not lyapunov['applicable']:
        parts += [f'The certificate does not apply here: {lyapunov["reason"]}.']
    return ' '.join(parts)


def _energy(axes: Axes, run: Sketch, parts: Iterable[str]) -> None:
    t, L = run.line('L')
    axes.plot(t, L, color=MEASURED)
    for part in parts:
        _increasing(axes, run, part)
    plots.logarithmic(axes, 'y')
    ends = np.log10([L.min(), L.max()])
    axes.set_ylim(10.0 ** np.floor(ends[0]), 10.0 ** np.ceil(ends[1]))
    axes.set_xlim(run.start, run.start + run.duration)
    axes.set_ylabel('$L$ (J)')
    plots.letter(axes, 0)


def _rates(axes: Axes, run: Sketch, part: str) -> bool:
    """Lines of (28), (26), the measured derivative; whether the axis is partly logarithmic."""
    axes.axhline(0.0, color=plots.GREY, linewidth=0.6)
    for name, look in zip(('bound', 'identity', 'L_dot'), _rate_looks(), strict=True):
        axes.plot(*run.line(name, 0, part), **look)
    _increasing(axes, run, part)
    (t, identity), (_, bound) = (run.line(name, 0, part) for name in ('identity', 'bound'))
    axes.set_xlim(t[0], t[-1])
    largest = np.abs(identity).max()
    beyond = max(largest, np.abs(bound).max())
    if part != 'late':  # to its last quarter, where it has died away
        last = np.abs(identity[t >= t[-1] - 0.25 * (t[-1] - t[0])]).max()
        linear = max(last, beyond * 10.0**-DECADES)
    else:  # the bound alone is large: what it bounds keeps the linear part
        linear = max(largest, beyond * 10.0**-DECADES)
    if beyond > 0 and beyond > RATES_APART * linear:
        plots.symmetric(axes, linear)
        return True
    return False


def _increasing(axes: Axes, run: Sketch, part: str) -> None:
    """Grey bands where (26) is positive, each sample as wide as it is from its neighbours."""
    t, increasing = run.line('increasing', 0, part)
    axes.fill_between(
        t, 0.0, increasing, step='mid',
        transform=axes.get_xaxis_transform(), color='#ececec', linewidth=0, zorder=0.2,
    )  # fmt: skip


def _rate_looks() -> tuple[dict[str, Any], ...]:
    return (
        {'color': BOUND, 'linestyle': (0, (4, 1.4)), 'linewidth': 1.1},
        {'color': IDENTITY, 'linestyle': '-', 'linewidth': 3.0},
        {'color': MEASURED, 'linestyle': '-', 'linewidth': 0.9},
    )


def _rates_key(axes: Axes) -> None:
    handles = [Line2D([], [], **look) for look in reversed(_rate_looks())]
    axes.legend(
        handles,
        ['measured', 'identity (26)', 'bound (28)'],
        loc='lower right',
        bbox_to_anchor=(1.0, 1.02),
        ncols=3,
        handlelength=2.4,
    )


BAND = 0.3  # opacity
TAU: dict[str, Any] = {'color': '#a9a9a9', 'linewidth': 0.8}


def unexplained_figure(run: Sketch) -> tuple[Figure, str, str]:
    """F of (1) as estimated, two standard errors about it, and the wrench; a panel per axis."""
    title = f'Unexplained wrench, {run.controller}'
    figure = plots.new_figure(5.6)
    panels = figure.subplots(3, 2, sharex=True)
    acted = 'applied' if run.acting else 'tau'
    for i, dof in enumerate(DOFS):
        axes = panels[i % 3, i // 3]
        axes.plot(*run.drawn(acted, i), **TAU)
        t, low = run.drawn('least', i)
        axes.fill_between(t, low, _at(t, *run.drawn('most', i)), color=COLOURS[i], alpha=BAND, lw=0)
        axes.plot(*run.drawn('unexplained', i), color=COLOURS[i])
        axes.set_xlim(run.start, run.start + run.duration)
        plots.shade(axes, run)
        _cut(axes, run, acted, i)
        axes.set_ylabel(f'{mathtext(SIGNALS["F"].components[i])} ({SIGNALS["F"].unit_of(i)})')
        plots.letter(axes, i, dof)
    for axes in panels[-1]:
        axes.set_xlabel('$t$ (s)')
    handles = [Line2D([], [], color='black'), Patch(color=GREY, alpha=BAND), Line2D([], [], **TAU)]
    labels = [
        'F, estimated',
        'two standard errors',
        f'{"applied" if run.acting else "commanded"} τ',
    ]
    figure.legend(handles, labels, loc='outside upper right', ncols=3)
    caption = (
        f'{title}: F of (1) by inverse dynamics (thick, in colour) with two standard errors of the '
        'estimate about it, beside the wrench (thin, grey). It is what the vehicle file does not '
        'explain of the recorded motion: errors of the model, disturbances, and a wrench that was '
        'not the one recorded. Positive F opposes τ, which is cut off and told above the panel '
        f'where it is far larger.{plots.shade_sentence(run)}'
    )
    return figure, title, caption


def unexplained_finding(name: str, summary: Mapping[str, Any]) -> str:
    """How much of the wrench the model leaves unexplained, in a sentence; '' where not known."""
    found = summary['unexplained']
    if found is None:
        return ''
    parts = []
    for members, unit in ((range(3), 'N'), (range(3, 6), 'N m')):
        i = max(members, key=found['rms'].__getitem__)
        parts.append(
            f'{number(found["rms"][i])} ± {number(found["error_rms"][i], 2)} {unit} ({DOFS[i]}; '
            f'the wrench has {number(summary["effort"]["rms"][i])} {unit})'
        )
    return f'Of {name} the model leaves at most {" and ".join(parts)} unexplained, RMS.'


def _cut(axes: Axes, run: Sketch, acted: str, i: int) -> None:
    """Give the axis to F where the wrench is far larger, and write down how large that is."""
    seen = max(run.part(name).peak[i] for name in ('least', 'most'))
    wrench = run.part(acted)
    if wrench.peak[i] <= BEYOND * seen:
        return
    axes.set_ylim(-ROOM * seen, ROOM * seen)
    ends = f'{number(wrench.low[i])} to {number(wrench.high[i])} {WRENCH[i // 3]}'
    axes.set_title(f'τ {ends}', loc='right', fontsize=8.5)


def _at(t: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A line at the times of another one, NaN where that breaks or the line does."""
    known = ~np.isnan(values)
    return np.interp(t, times[known], values[known])
