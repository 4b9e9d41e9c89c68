"""Figures of an excitation."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.report import plots
from auv_analysis.report.plots import (
    COLOURS,
    GREY,
    Curve,
    Drawn,
    FigureRecord,
    Panel,
    save_figures,
    small_multiples,
    time_panels,
)
from auv_analysis.studies.excite.excite import Excited
from auv_analysis.studies.identify.identified import KNOWN
from auv_dynamics.vehicle import DOFS

PLANES = ((1, 0, 'east (m)', 'north (m)'), (0, 2, 'north (m)', 'down (m)'))
MOST = 20  # paths of drawn vehicles


def draw(
    found: Excited, rows: Sequence[Mapping[str, Any]], folder: Path
) -> dict[str, FigureRecord]:
    """Draw the figures as PNG and PDF: name -> figure."""
    return save_figures(
        folder,
        {
            'intervals': lambda: _intervals(rows),
            'wrench': lambda: _wrench(found),
            'tank': lambda: _tank(found),
        },
    )


def _intervals(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """Posterior over prior deviation, coefficient by coefficient."""
    some = [row for row in rows if row['left'] is not None]
    figure = plots.new_figure(0.6 + 0.15 * len(some))
    axes, y = figure.subplots(), np.arange(len(some))
    looks: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ('left_case1', 'case 1', {'marker': 'o', 'mfc': 'none', 'color': GREY}),
        ('left', 'this excitation', {'marker': 'D', 'color': COLOURS[0]}),
    )
    for key, label, look in looks:
        values = 100.0 * np.array([row[key] for row in some], float)
        axes.plot(values, y, linestyle='none', markersize=4, label=label, **look)
    axes.axvline(100.0 * KNOWN, color='black', linewidth=0.6)
    axes.set_yticks(y, [row['name'] for row in some])
    axes.invert_yaxis()
    plots.logarithmic(axes, 'x')
    axes.set_xlabel('left of the uncertainty of the prior (%)')
    axes.legend()
    caption = (
        'What a recording would leave of the uncertainty of the prior; right of the line a '
        'coefficient counts as not identified.'
    )
    return figure, 'Predicted intervals', caption


def _wrench(found: Excited) -> Drawn:
    """Wrench and velocity over time."""
    panels = []
    signals = {'tau': found.motion.commands[0, 0], 'nu': found.motion.states[0, 0, :, 7:]}
    for i, dof in enumerate(DOFS):
        for (name, rows), colour in zip(signals.items(), COLOURS, strict=False):
            t = found.request.step * np.arange(len(rows))
            curve = Curve(t, rows[:, i], '', {'color': colour, 'linewidth': 0.9})
            panels.append(Panel([curve], SIGNALS[name].unit_of(i), dof))
    figure = time_panels(panels, across=2, height=1.2)
    caption = 'Wrench (left) and velocity (right) of the vehicle of the file.'
    return figure, 'Wrench and velocity', caption


def _tank(found: Excited) -> Drawn:
    """Paths of the prior and of vehicles around it, within the room that there is."""
    figure, panels = small_multiples(len(PLANES), 2, height=3.0)
    room = found.request.bounds.room / 2.0
    for axes, (across, up, x_label, y_label) in zip(panels, PLANES, strict=True):
        for k, states in enumerate(found.motion.states[MOST:0:-1, 0]):
            axes.plot(states[:, across], states[:, up], color=GREY, linewidth=0.5, alpha=0.6,
                      label='_' if k else 'drawn around it')  # fmt: skip
        own = found.motion.states[0, 0]
        axes.plot(own[:, across], own[:, up], color=COLOURS[0], linewidth=1.2, label='the prior')
        for k, line in ((across, axes.axvline), (up, axes.axhline)):
            if np.isfinite(room[k]):
                for side in (-room[k], room[k]):
                    line(side, color='black', linewidth=0.8)
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
    panels[1].invert_yaxis()
    plots.shared_legend(figure)
    caption = 'Paths from the middle of the room, whose walls are the black lines where it has any.'
    return figure, 'Paths', caption
