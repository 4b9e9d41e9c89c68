"""The Lyapunov certificate in the report: a figure of each run that has one."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.report import plotting
from auv_analysis.report.sketch import Sketch

IDENTITY, BOUND, MEASURED = '#56B4E9', '#D55E00', '#1a1a1a'
APART = 10.0  # ratio of a largest value to what else is to be seen, from which it is logarithmic
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
    figure = plotting.new_figure(4.6)
    mosaic: list[list[Any]] = [['L', 'L'], ['early', 'late']] if split else [['L'], ['whole']]
    ratios = (1, 1.9) if split else (1,)
    panels = figure.subplot_mosaic(mosaic, height_ratios=(1, 1.25), width_ratios=ratios)
    _energy(panels.pop('L'), run, panels)
    partly = False
    for index, (part, axes) in enumerate(panels.items(), start=1):
        partly |= _rates(axes, run, part)
        plotting.letter(axes, index)
        axes.set_xlabel('$t$ (s)')
    rates = list(panels.values())
    rates[0].set_ylabel(r'$\dot{L}$ (W)')
    _key(rates[-1])
    return figure, title, _caption(run, summary['lyapunov'], title, split=split, partly=partly)


def _caption(
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
    plotting.logarithmic(axes, 'y')
    ends = np.log10([L.min(), L.max()])
    axes.set_ylim(10.0 ** np.floor(ends[0]), 10.0 ** np.ceil(ends[1]))
    axes.set_xlim(run.start, run.start + run.duration)
    axes.set_ylabel('$L$ (J)')
    plotting.letter(axes, 0)


def _rates(axes: Axes, run: Sketch, part: str) -> bool:
    """Lines of (28), (26), the measured derivative; whether the axis is partly logarithmic."""
    axes.axhline(0.0, color=plotting.GREY, linewidth=0.6)
    for name, look in zip(('bound', 'identity', 'L_dot'), _looks(), strict=True):
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
    if beyond > 0 and beyond > APART * linear:
        plotting.symmetric(axes, linear)
        return True
    return False


def _increasing(axes: Axes, run: Sketch, part: str) -> None:
    """Grey bands where (26) is positive, each sample as wide as it is from its neighbours."""
    t, increasing = run.line('increasing', 0, part)
    axes.fill_between(
        t, 0.0, increasing, step='mid',
        transform=axes.get_xaxis_transform(), color='#ececec', linewidth=0, zorder=0.2,
    )  # fmt: skip


def _looks() -> tuple[dict[str, Any], ...]:
    return (
        {'color': BOUND, 'linestyle': (0, (4, 1.4)), 'linewidth': 1.1},
        {'color': IDENTITY, 'linestyle': '-', 'linewidth': 3.0},
        {'color': MEASURED, 'linestyle': '-', 'linewidth': 0.9},
    )


def _key(axes: Axes) -> None:
    handles = [Line2D([], [], **look) for look in reversed(_looks())]
    axes.legend(
        handles,
        ['measured', 'identity (26)', 'bound (28)'],
        loc='lower right',
        bbox_to_anchor=(1.0, 1.02),
        ncols=3,
        handlelength=2.4,
    )
