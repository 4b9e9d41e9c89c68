"""Plots of a run beside the paper's: applied wrench, Lyapunov certificate, unexplained wrench."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from auv_analysis.metrics.quantities import SIGNALS, WRENCH
from auv_analysis.metrics.settling import TRANSIENT
from auv_analysis.output.text import join, largest, number
from auv_analysis.report import plots
from auv_analysis.report.digest import RunDigest
from auv_analysis.report.plots import COLOURS, GREY, Drawn
from auv_dynamics.vehicle import DOFS

BEYOND = 3.0  # times what else is to be seen: a command that is cut off and told in the panel
ROOM = 1.25  # of the axis above what it shows
COMMAND: dict[str, Any] = {'color': '#8a8a8a', 'linewidth': 0.8, 'linestyle': '-'}
LIMIT: dict[str, Any] = {'color': 'black', 'linewidth': 0.9, 'linestyle': (0, (1, 1.6))}


def six_panels(height: float) -> tuple[Figure, list[Axes]]:
    """Figure of a height in inches, a panel over time per degree of freedom, linear ones left."""
    figure = plots.new_figure(height)
    panels = figure.subplots(3, 2, sharex=True)
    for axes in panels[-1]:
        axes.set_xlabel('$t$ (s)')
    return figure, list(panels.T.flat)


def leave_out(axes: Axes) -> None:
    """Say in a panel that what it would show was not recorded."""
    axes.text(0.5, 0.5, 'not recorded', transform=axes.transAxes, ha='center', color=GREY)
    axes.set_yticks([])


def applied_figure(run: RunDigest, limit: np.ndarray | None) -> tuple[Figure, str, str]:
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
    figure, panels = six_panels(5.6)
    cut, missed = [], []
    for i, (axes, dof) in enumerate(zip(panels, DOFS, strict=True)):
        bound = None if limit is None else float(limit[i])
        if _panel(axes, run, i, bound):
            cut.append(dof)
        if run.missed[i]:
            missed.append(dof)
        axes.set_ylabel(SIGNALS['tau'].axis([i]))
        plots.letter(axes, i, dof)
    figure.legend(*_applied_key(limit), loc='outside upper right', ncols=3, handlelength=2.4)
    return figure, title, _applied_caption(title, run, limit, cut, missed)


def _panel(axes: Axes, run: RunDigest, i: int, bound: float | None) -> bool:
    """Draw one degree of freedom; whether its command was cut off by the axis."""
    command = run.part('tau')
    axes.plot(*run.drawn('tau', i), **COMMAND)
    axes.plot(*run.drawn('applied', i), color=COLOURS[i], linewidth=1.4)
    axes.set_xlim(run.start, run.start + run.duration)
    plots.shade(axes, run)
    seen = run.part('applied').peak[i]
    if np.isnan([seen, command.peak[i]]).all():
        leave_out(axes)
    if bound is not None and bound <= BEYOND * max(seen, command.peak[i]):
        seen = max(seen, bound)
        for level in (-bound, bound):
            axes.axhline(level, **LIMIT)
    if not command.peak[i] > BEYOND * seen > 0.0:  # or one of them is not known
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
    title: str, run: RunDigest, limit: np.ndarray | None, cut: list[str], missed: list[str]
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
RATES: dict[str, dict[str, Any]] = {
    'bound': {'color': BOUND, 'linestyle': (0, (4, 1.4)), 'linewidth': 1.1},
    'identity': {'color': IDENTITY, 'linestyle': '-', 'linewidth': 3.0},
    'L_dot': {'color': MEASURED, 'linestyle': '-', 'linewidth': 0.9},
}
RATES_APART = 10.0  # ratio of a largest value to what else is to be seen: logarithmic from there on
DECADES = 5  # of a symmetric logarithmic axis, from its linear part to its end


def is_drawn(summary: Mapping[str, Any]) -> bool:
    """Whether (26) is the derivative of L in a run, so that the two can be held together."""
    return summary['lyapunov'].get('share_of_time_increasing') is not None


def certificate_figure(
    run: RunDigest, summary: Mapping[str, Any]
) -> tuple[Figure | None, str, str]:
    """L, and its measured derivative against (26) and (28). Returns figure, title and caption."""
    title = f'Certificate, {run.controller}'
    if run.samples < 3 or ('L', 'whole') not in run.traces:
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
    run: RunDigest, lyapunov: Mapping[str, Any], title: str, *, split: bool, partly: bool
) -> str:
    parts = [f'{title}: (a) L of (23) on a logarithmic axis; (b) its derivative, measured from L']
    parts[0] += ', against the identity (26) and the bound (28)'
    rest = f', the first {TRANSIENT:g} s; (c) the rest on a scale of its own'
    parts[0] += f'{rest if split else ""}.'
    if partly:
        parts += ['An axis with two dotted lines is linear between them and logarithmic beyond.']
    parts += ['Grey: where (26) is positive, so that L increases.']
    if run.hold == 'zoh':
        parts += ['The wrench is held between samples; (26) is that of the continuous law.']
    if not lyapunov['applicable']:
        parts += [f'The certificate does not apply here: {lyapunov["reason"]}.']
    return ' '.join(parts)


def _energy(axes: Axes, run: RunDigest, parts: Iterable[str]) -> None:
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


def _rates(axes: Axes, run: RunDigest, part: str) -> bool:
    """Lines of (28), (26), the measured derivative; whether the axis is partly logarithmic."""
    axes.axhline(0.0, color=plots.GREY, linewidth=0.6)
    for name, look in RATES.items():
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
    if beyond > RATES_APART * linear:
        plots.symmetric(axes, linear)
        return True
    return False


def _increasing(axes: Axes, run: RunDigest, part: str) -> None:
    """Grey bands where (26) is positive, each sample as wide as it is from its neighbours."""
    t, increasing = run.line('increasing', 0, part)
    edges = np.concatenate([t[:1], (t[1:] + t[:-1]) / 2, t[-1:]])
    turns = np.flatnonzero(np.diff(increasing, prepend=0.0, append=0.0))
    begin, end = edges[turns].reshape(-1, 2).T
    axes.broken_barh(  # a shape each: one of thousands of corners takes 34 MB to draw
        list(zip(begin, end - begin, strict=True)), (0.0, 1.0),
        transform=axes.get_xaxis_transform(), color='#ececec', linewidth=0, zorder=0.2, snap=False,
    )  # fmt: skip


def _rates_key(axes: Axes) -> None:
    handles = [Line2D([], [], **look) for look in reversed(RATES.values())]
    names = ['measured', 'identity (26)', 'bound (28)']
    plots.legend_above(axes, 3, handles, names, handlelength=2.4)


BAND = 0.3  # opacity
TAU: dict[str, Any] = {'color': '#a9a9a9', 'linewidth': 0.8}


def estimate_figure(run: RunDigest, kind: str) -> Drawn:
    """F of (1) or the required wrench as estimated, with two standard errors; a panel per axis.

    Parameters
    ----------
    run : with `least` and `most`
    kind : 'unexplained', beside the wrench that acted, or 'required_wrench'

    """
    quantity = SIGNALS['F' if kind == 'unexplained' else 'tau']
    title = f'{SIGNALS[kind].label.capitalize()}, {run.controller}'
    if len(plots.unrecorded(run.part(kind))) == 6:
        return None, title, f'{title}: every row of (1) needs what was not recorded.'
    figure, panels = six_panels(5.6)
    acted = '' if kind == 'required_wrench' else 'applied' if run.acting else 'tau'
    for i, (axes, dof) in enumerate(zip(panels, DOFS, strict=True)):
        plots.letter(axes, i, dof)
        if dof in plots.unrecorded(run.part(kind)):
            leave_out(axes)
            continue
        if acted:
            axes.plot(*run.drawn(acted, i), **TAU)
        t, low = run.drawn('least', i)
        axes.fill_between(t, low, _at(t, *run.drawn('most', i)), color=COLOURS[i], alpha=BAND, lw=0)
        axes.plot(*run.drawn(kind, i), color=COLOURS[i])
        axes.set_xlim(run.start, run.start + run.duration)
        plots.shade(axes, run)
        if acted:
            _cut(axes, run, acted, i)
        axes.set_ylabel(quantity.axis([i]))
    handles = {
        f'{quantity.symbol}, estimated': Line2D([], [], color='black'),
        'two standard errors': Patch(color=GREY, alpha=BAND),
    }
    if acted:
        handles[f'{"applied" if run.acting else "commanded"} τ'] = Line2D([], [], **TAU)
    figure.legend([*handles.values()], [*handles], loc='outside upper right', ncols=3)
    return figure, title, f'{title}: {ABOUT[kind]}{plots.shade_sentence(run)}'


ABOUT = {
    'unexplained': (
        'F of (1) by inverse dynamics (thick, in colour) with two standard errors of the '
        'estimate about it, beside the wrench (thin, grey). It is what the vehicle file does not '
        'explain of the recorded motion: errors of the model, disturbances, and a wrench that was '
        'not the one recorded. Positive F opposes τ, which is cut off and told above the panel '
        'where it is far larger.'
    ),
    'required_wrench': (
        'M ν̇ + C ν + D ν + g of the recorded motion by the model of the vehicle file (thick, in '
        'colour) with two standard errors of the estimate about it. No wrench was recorded: this '
        'is τ − F, what actuators and disturbances must have exerted together.'
    ),
}


def estimate_finding(name: str, summary: Mapping[str, Any]) -> str:
    """Sentence on the size of the unexplained or required wrench; '' where not known."""
    kind = 'unexplained' if summary['unexplained'] else 'required_wrench'
    found = summary[kind]
    if found is None:
        return ''
    parts = []
    for members, unit in ((range(3), 'N'), (range(3, 6), 'N m')):
        i = largest(found['rms'], members)
        if i is not None:
            beside = f'; the wrench has {number(summary["effort"]["rms"][i])} {unit}'
            parts.append(
                f'{number(found["rms"][i])} ± {number(found["error_rms"][i], 2)} {unit} '
                f'({DOFS[i]}{beside if kind == "unexplained" else ""})'
            )
    if not parts:
        return ''
    if kind == 'required_wrench':
        return f'The motion of {name} needed at most {" and ".join(parts)}, RMS.'
    return f'Of {name} the model leaves at most {" and ".join(parts)} unexplained, RMS.'


def _cut(axes: Axes, run: RunDigest, acted: str, i: int) -> None:
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
