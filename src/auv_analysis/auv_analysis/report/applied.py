"""The commanded wrench beside what the actuators delivered."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from auv_analysis.output.text import join, number
from auv_analysis.report import plotting
from auv_analysis.report.plotting import COLOURS
from auv_analysis.report.sketch import Sketch
from auv_dynamics.vehicle import DOFS

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
    figure = plotting.new_figure(5.6)
    panels = figure.subplots(3, 2, sharex=True)
    cut, missed = [], []
    for i, dof in enumerate(DOFS):
        axes = panels[i % 3, i // 3]
        bound = None if limit is None else float(limit[i])
        if _panel(axes, run, i, bound):
            cut.append(dof)
        if run.missed[i]:
            missed.append(dof)
        axes.set_ylabel(f'{plotting.INPUT.symbols[i]} ({plotting.INPUT.unit(i)})')
        plotting.letter(axes, i, dof)
    for axes in panels[-1]:
        axes.set_xlabel('$t$ (s)')
    figure.legend(*_key(limit), loc='outside upper right', ncols=3, handlelength=2.4)
    return figure, title, _caption(title, run, limit, cut, missed)


def _panel(axes: Axes, run: Sketch, i: int, bound: float | None) -> bool:
    """Draw one degree of freedom; whether its command was cut off by the axis."""
    command = run.part('tau')
    axes.plot(*run.drawn('tau', i), **COMMAND)
    axes.plot(*run.drawn('applied', i), color=COLOURS[i], linewidth=1.4)
    axes.set_xlim(run.start, run.start + run.duration)
    plotting.shade(axes, run)
    seen = run.part('applied').peak[i]
    if bound is not None and bound <= BEYOND * max(seen, command.peak[i]):
        seen = max(seen, bound)
        for level in (-bound, bound):
            axes.axhline(level, **LIMIT)
    if not seen or command.peak[i] <= BEYOND * seen:
        return False
    axes.set_ylim(-ROOM * seen, ROOM * seen)
    peak = command.low[i] if command.low[i] == -command.peak[i] else command.high[i]
    reached = f'{number(peak)} {plotting.INPUT.unit(i)} at {command.at[i]:.2f} s'
    axes.set_title(f'command to {reached}', loc='right', fontsize=7.5)
    return True


def _key(limit: np.ndarray | None) -> tuple[list[Line2D], list[str]]:
    looks: dict[str, dict[str, Any]] = {
        'commanded': COMMAND,
        'applied': {'color': 'black', 'lw': 1.4},
    }
    if limit is not None:
        looks['axis limit'] = LIMIT
    return [Line2D([], [], **look) for look in looks.values()], list(looks)


def _caption(
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
    return ' '.join(parts) + plotting.shade_sentence(run)
