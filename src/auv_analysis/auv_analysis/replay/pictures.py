"""The picture of two wrenches: what was commanded, and what a law would have commanded."""

from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.replay.compared import Compared
from auv_analysis.report import plots
from auv_analysis.report.plots import COLOURS, DASHES, save_figures
from auv_analysis.report.traces import FEW, thinned
from auv_dynamics.vehicle import DOFS

NAME, INPUT = 'open_loop_wrench', SIGNALS['tau']
ORDER = (0, 3, 1, 4, 2, 5)  # forces left, moments right


def draw(both: Compared, names: tuple[str, str], verdict: str, folder: Path) -> Path:
    """Draw both wrenches, a panel per degree of freedom, as PNG and PDF; the path of the PNG.

    Parameters
    ----------
    both : wrenches
    names : of the recorded law and of the other one
    verdict : whether the recorded law reproduces the recorded wrench
    folder : of the figures, made when it is not there

    """
    save_figures(folder, {NAME: partial(_figure, both, names, verdict)})
    return folder / f'{NAME}.png'


def _figure(both: Compared, names: tuple[str, str], verdict: str) -> tuple[Figure, str, str]:
    figure = plots.new_figure(5.2)
    panels = figure.subplots(3, 2, sharex=True)
    for axes, i in zip(panels.flat, ORDER, strict=True):
        pairs = zip(names, (both.recorded, both.answered), DASHES, strict=False)
        for k, (name, wrench, dash) in enumerate(pairs):
            t, tau = both.t, wrench[:, i]
            if len(t) > FEW:
                t, tau = thinned(t, tau, t[0], t[-1])
            axes.plot(t, tau, color=COLOURS[k], linestyle=dash, label=name)
        axes.set_ylabel(f'{DOFS[i]}: {INPUT.axis([i])}')
    for axes in panels[-1]:
        axes.set_xlabel('$t$ (s)')
    panels[0, 1].legend(loc='lower right', bbox_to_anchor=(1.0, 1.02), ncols=2)
    said = f'{verdict[0].upper()}{verdict[1:]}'
    figure.suptitle(said, fontsize='small')
    title = f'What {names[1]} would have commanded'
    recorded = 'at the recorded velocity and set-point, beside the recorded wrench'
    caption = f'{title} {recorded}. {said}.'
    return figure, title, caption
