"""What the model leaves unexplained of a recorded wrench, with the error of the estimate."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from auv_analysis.output.text import number
from auv_analysis.report import plotting
from auv_analysis.report.plotting import COLOURS, GREY
from auv_analysis.report.sketch import Sketch
from auv_dynamics.vehicle import DOFS

BEYOND = 3.0  # times F: a wrench that is cut off, its extremes told above the panel
BAND = 0.3  # opacity
ROOM = 1.1  # of the axis beyond what it shows
TAU: dict[str, Any] = {'color': '#a9a9a9', 'linewidth': 0.8}


def unexplained_figure(run: Sketch) -> tuple[Figure, str, str]:
    """F of (1) as estimated, two standard errors about it, and the wrench; a panel per axis."""
    title = f'Unexplained wrench, {run.controller}'
    figure = plotting.new_figure(5.6)
    panels = figure.subplots(3, 2, sharex=True)
    acted = 'applied' if run.acting else 'tau'
    for i, dof in enumerate(DOFS):
        axes = panels[i % 3, i // 3]
        axes.plot(*run.drawn(acted, i), **TAU)
        t, low = run.drawn('least', i)
        axes.fill_between(t, low, _at(t, *run.drawn('most', i)), color=COLOURS[i], alpha=BAND, lw=0)
        axes.plot(*run.drawn('unexplained', i), color=COLOURS[i])
        axes.set_xlim(run.start, run.start + run.duration)
        plotting.shade(axes, run)
        _cut(axes, run, acted, i)
        axes.set_ylabel(f'{plotting.UNCERTAINTY.symbols[i]} ({plotting.UNCERTAINTY.unit(i)})')
        plotting.letter(axes, i, dof)
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
        f'where it is far larger.{plotting.shade_sentence(run)}'
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
    ends = f'{number(wrench.low[i])} to {number(wrench.high[i])} {plotting.WRENCH[i // 3]}'
    axes.set_title(f'τ {ends}', loc='right', fontsize=8.5)


def _at(t: np.ndarray, times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A line at the times of another one, NaN where that breaks or the line does."""
    known = ~np.isnan(values)
    return np.interp(t, times[known], values[known])
