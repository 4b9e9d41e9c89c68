"""The figures of a study: what the paper draws, and what makes the comparison readable."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from auv_analysis.metrics.coupling import structural_zeros
from auv_analysis.metrics.lyapunov import OF_THE_MOTION
from auv_analysis.metrics.summary import TRANSIENT
from auv_analysis.output.text import join, number
from auv_analysis.report import overview, plotting
from auv_analysis.report.applied import applied_figure
from auv_analysis.report.certificates import certificate_figure, is_drawn
from auv_analysis.report.figure_files import Drawn, FigureRecord, save_figures
from auv_analysis.report.panels import different_disturbances
from auv_analysis.report.paper import paper_figure
from auv_analysis.report.plotting import Quantity
from auv_analysis.report.sketch import Sketch
from auv_analysis.report.sketching import sketches
from auv_analysis.report.statistics import Part
from auv_analysis.report.unexplained import unexplained_figure
from auv_analysis.runs.run import AnyRun
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import control_model

SIGNALS = {  # kind of figure -> signal of `Sketch`
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
    made['settling'] = partial(overview.settling, drawn)
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
        made['inputs_compared'] = partial(overview.inputs, drawn)
    for name, run in drawn.items():
        if summaries is not None and is_drawn(summaries[name]):
            made[f'certificate_{name}'] = partial(certificate_figure, run, summaries[name])
    leading = reference(drawn)
    made['kinetic_energy'] = partial(overview.energy, drawn, leading)
    made['energy_shares'] = partial(overview.energy_shares, drawn)
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
    kind : of `SIGNALS`
    run : whose signals they are
    quantity : what they are
    zeros : degrees of freedom that vanish for every motion: named, not drawn

    Returns
    -------
    figure, title, caption : no figure where nothing moves

    """
    title = f'{quantity.name.capitalize()}, {run.controller}'
    signal = SIGNALS[kind]
    if signal not in run.columns:
        return None, title, f'{title}: without a set-point there is none.'
    drawn = plotting.moving(run.part(signal), zeros)
    structure = structure_sentence(kind, zeros)
    if not drawn:
        return None, title, structure if len(zeros) == 6 else f'{title}: zero throughout.'
    split = (signal, 'early') in run.traces
    original = paper_figure(run, kind)
    caption = [f'{title}{f"; the paper’s figure {original}" if original else ""}.']
    if split:
        caption.append(f'Left the first {TRANSIENT:g} s, right the rest on a scale of its own.')
    caption += [_peaks(run.part(signal), quantity, drawn), structure]
    still = [dof for i, dof in enumerate(DOFS) if i not in drawn and dof not in zeros]
    if still:
        caption.append(f'Zero throughout this run and not drawn: {join(still)}.')
    caption.append(plotting.shade_sentence(run).strip())
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
    figure, title, caption = six_signals('errors', run, plotting.ERROR)
    if run.sensing:
        caption += ' The law saw measured velocities; these errors are those of the true ones.'
    return figure, title, caption


def _lumped(run: Sketch) -> Drawn:
    if not run.estimates:
        title = f'Lumped estimation error, {run.controller}'
        text = 'the law estimates nothing; w is −F, no error of an estimate, and not drawn.'
        return None, title, f'{title}: {text}'
    return six_signals('lumped_error', run, plotting.LUMPED)


def _uncertainty(run: Sketch) -> Drawn:
    figure, title, caption = six_signals('uncertainty', run, plotting.UNCERTAINTY)
    kinds = [kind.replace('_', ' ') for kind in OF_THE_MOTION if kind in (run.kinds or ())]
    if kinds:
        caption += f' F contains {join(kinds)} and so depends on the motion of this very run.'
    return figure, title, caption


def _inputs(run: Sketch, limit: np.ndarray | None) -> Drawn:
    if run.acting and np.any(run.part('tau').peak):
        return applied_figure(run, limit)
    return six_signals('inputs', run, plotting.INPUT)


def _deformation(kind: str, run: Sketch) -> Drawn:
    model = control_model(run.vehicle)
    Upsilon, Upsilon_inv = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    zeros = structural_zeros(Upsilon, Upsilon_inv)[kind]
    if kind == 'delta_xi':
        return six_signals(kind, run, plotting.DELTA_XI, zeros)
    drawn = six_signals(kind, run, plotting.DELTA_PI, zeros)
    note = ' Of the commanded wrench.' if run.acting and drawn[0] is not None else ''
    return drawn[0], drawn[1], drawn[2] + note


def _peaks(part: Part, quantity: Quantity, drawn: Sequence[int]) -> str:
    parts = []
    for columns in plotting.groups(drawn):
        peak, i = max((part.peak[i], i) for i in columns)
        parts.append(f'{number(peak)} {quantity.unit(i)} in {DOFS[i]} at {part.at[i]:.2f} s')
    return f'Largest: {join(parts)}.'


def _split_panels(run: Sketch, signal: str, quantity: Quantity, drawn: Sequence[int]) -> Figure:
    groups = plotting.groups(drawn)
    figure = plotting.new_figure(2.15 * len(groups) + 0.25)
    grid = figure.subplots(len(groups), 2, squeeze=False, width_ratios=(1, 1.9))
    for row, columns in enumerate(groups):
        for column, part in enumerate(('early', 'late')):
            axes = grid[row, column]
            plotting.draw_lines(axes, run, signal, part, columns)
            plotting.letter(axes, 2 * row + column)
        grid[row, 0].set_ylabel(quantity.label(columns))
        plotting.key(grid[row, 1], quantity, columns)
    for axes in grid[-1]:
        axes.set_xlabel('$t$ (s)')
    return figure


def _whole_panels(run: Sketch, signal: str, quantity: Quantity, drawn: Sequence[int]) -> Figure:
    groups = plotting.groups(drawn)
    figure = plotting.new_figure(2.0 * len(groups) + 0.25)
    grid = figure.subplots(len(groups), 1, squeeze=False, sharex=True)[:, 0]
    for row, columns in enumerate(groups):
        plotting.draw_lines(grid[row], run, signal, 'whole', columns)
        grid[row].set_ylabel(quantity.label(columns))
        plotting.letter(grid[row], row)
        plotting.key(grid[row], quantity, columns)
    grid[-1].set_xlabel('$t$ (s)')
    return figure
