"""The pole map of linear models, and the Bode plots of their loops."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from auv_analysis.report import plots
from auv_analysis.report.plots import COLOURS, GREY, Drawn, FigureRecord, save_figures
from auv_analysis.studies.linearize.linearize import Linearization
from auv_analysis.studies.linearize.margins import LEAST_GAIN, LEAST_PHASE, ControlLoop
from auv_dynamics.vehicle import DOFS

MARKS = ('o', 'x', '+', 's', '^', 'v')
DAMPING = (0.2, 0.4, 0.6, 0.8)  # lines of constant damping ratio
SLOW = 1.5  # the second panel ends at so many times the median size of the poles


def draw(
    models: Mapping[str, Linearization], loops: Mapping[str, ControlLoop], folder: Path
) -> dict[str, FigureRecord]:
    """Draw the pole map and, of each loop, its Bode plot, as PNG and PDF: name -> figure.

    `folder` is made where it is not there.
    """
    drawn = {'poles': lambda: _pole_map(models)}
    for name, loop in loops.items():
        drawn[f'bode_{name}'] = partial(_bode, name, loop)
    return save_figures(folder, drawn)


BELOW, ABOVE = 1e-2, 1e2  # gains that are drawn


def _bode(name: str, setting: ControlLoop) -> Drawn:
    """Gain and phase of the loop opened at each axis in turn, with the borders of 6 dB, 45 deg."""
    loop = setting.loop()
    omega, S = setting.sensitivity(loop)
    gain = 1 / np.diagonal(S, axis1=1, axis2=2) - 1
    figure, (upper, lower) = plots.small_multiples(2, 1, height=2.0, sharex=True)
    for i, dof in enumerate(DOFS):
        size = np.abs(gain[:, i])
        seen = (size > BELOW) & (size < ABOVE)
        if not seen.any():
            continue
        phase = np.degrees(np.unwrap(np.angle(gain[:, i])))
        phase -= 360 * np.round((phase[seen][0] + 90) / 360)  # that of an integrator to begin with
        upper.loglog(omega[seen], size[seen], label=dof, **plots.look(i))
        lower.semilogx(omega[seen], phase[seen], **plots.look(i))
    upper.axhline(1.0, color='black', linewidth=0.7)
    upper.axhline(1 / LEAST_GAIN, color=GREY, linewidth=0.7)
    lower.axhline(-180.0, color='black', linewidth=0.7)
    lower.axhline(-180.0 + np.degrees(LEAST_PHASE), color=GREY, linewidth=0.7)
    upper.set_ylabel('loop gain')
    lower.set_ylabel('phase (deg)')
    lower.set_xlabel(r'$\omega$ (rad/s)')
    for index, axes in enumerate((upper, lower)):
        plots.letter(axes, index)
    plots.shared_legend(figure)
    title = f'Loop of {name}'
    caption = (
        f'{title}, opened at each axis with the others closed: held for '
        f'{setting.plant.period:g} s, {setting.delay:g} s late, actuator lag {setting.lag:g} s. '
        'Where the phase crosses the dark line, the gain is to be below the grey one; where the '
        'gain crosses the dark line, the phase is to be above the grey one: 6 dB and 45 deg.'
    )
    return figure, title, caption


def _pole_map(models: Mapping[str, Linearization]) -> Drawn:
    poles = {name: np.sort_complex(np.linalg.eigvals(model.A)) for name, model in models.items()}
    every = np.concatenate(list(poles.values()))
    sizes = np.abs(every)[np.abs(every) > 1e-9]
    near = SLOW * float(np.median(sizes)) if len(sizes) else 0.0
    figure = plots.new_figure(3.1)
    panels = figure.subplots(1, 2)
    for index, (axes, limit) in enumerate(zip(panels, (np.abs(every).max(), near), strict=True)):
        _panel(axes, poles, max(float(limit), 1e-9))
        plots.letter(axes, index, ('all poles', 'the slow ones')[index])
    panels[0].set_ylabel('imaginary part (rad/s)')
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='outside lower center', ncols=min(len(labels), 4))
    title = 'Poles'
    ratios = ', '.join(f'{ratio:g}' for ratio in DAMPING)
    caption = (
        f'{title} of {", ".join(models)}. Left of the dark line a motion decays. Grey rays: '
        f'damping ratios {ratios}, the steepest the least damped.'
    )
    return figure, title, caption


def _panel(axes: Axes, poles: Mapping[str, np.ndarray], limit: float) -> None:
    """Poles within +-limit, with the rays of constant damping; both axes of one scale."""
    reach = 1.1 * limit
    for ratio in DAMPING:
        height = reach * np.sqrt(1 - ratio**2) / ratio
        ray = ([-reach, 0, -reach], [height, 0, -height])
        axes.plot(*ray, color=GREY, linewidth=0.4, alpha=0.7)
    axes.axvline(0.0, color='black', linewidth=0.7)
    inside = {name: v[np.abs(v) <= limit * (1 + 1e-9)] for name, v in poles.items()}
    for index, (name, shown) in enumerate(inside.items()):
        colour, mark = COLOURS[index % len(COLOURS)], MARKS[index % len(MARKS)]
        face = colour if mark in 'x+' else 'none'
        style: dict[str, Any] = {'color': colour, 'facecolors': face, 's': 22, 'linewidths': 0.9}
        axes.scatter(shown.real, shown.imag, marker=mark, label=name, zorder=3, **style)
    every = np.concatenate([*inside.values()])
    top = max([0.3 * reach, *1.15 * every.imag])  # poles are conjugate
    axes.set_xlim(-reach, max([0.08 * reach, *1.1 * every.real]))
    axes.set_ylim(-top, top)
    axes.set_xlabel('real part (1/s)')
