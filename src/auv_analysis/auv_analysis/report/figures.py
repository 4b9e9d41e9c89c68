"""The figures of a study: what the paper draws, and what makes the comparison readable."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from auv_analysis.coupling import delta_pi, delta_xi, structural_zeros
from auv_analysis.lyapunov import OF_THE_MOTION
from auv_analysis.report import overview, plotting
from auv_analysis.report.applied import applied_figure
from auv_analysis.report.certificates import certificate_figure, is_drawn
from auv_analysis.report.paper import paper_figure
from auv_analysis.report.plotting import Quantity
from auv_analysis.report.text import join, number
from auv_analysis.run import Run
from auv_analysis.summary import TRANSIENT, lumped_error
from auv_dynamics.signals import DOFS
from auv_gvc_controller.model import control_model

SPLIT = ('errors', 'lumped_error', 'inputs', 'delta_pi')  # begin with a peak that dwarfs the rest
Drawn = tuple[Figure | None, str, str]  # with title and caption
SYMBOLS = {'delta_xi': 'Δξ', 'delta_pi': 'Δπ'}


@dataclass(frozen=True)
class FigureRecord:
    """One figure of the report.

    Attributes
    ----------
    name : of its files, without ending
    title, caption : plain text
    png, pdf : its files; None where there is nothing to draw and the caption says why

    """

    name: str
    title: str
    caption: str
    png: Path | None
    pdf: Path | None


def draw_figures(
    runs: Mapping[str, Run],
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
    folder.mkdir(parents=True, exist_ok=True)
    runs = {name: replace(run, controller=name) for name, run in runs.items()}
    figures: list[FigureRecord] = []

    def add(name: str, figure: Figure | None, title: str, caption: str) -> None:
        files = (None, None) if figure is None else plotting.save(figure, folder, name)
        figures.append(FigureRecord(name, title, caption, *files))

    with plotting.style():
        for run in runs.values():
            add(f'errors_{run.controller}', *_errors(run))
        add('settling', *overview.settling(runs))
        for run in runs.values():
            if run.disturbance is not None:
                add(f'lumped_error_{run.controller}', *_lumped(run))
        for run, F in _different_disturbances(runs):
            name = f'uncertainty_{run.controller}'
            add(name, *_uncertainty(run, F))
        for name, run in runs.items():
            add(f'inputs_{name}', *_inputs(run, (limits or {}).get(name)))
        if len(runs) > 1:
            add('inputs_compared', *overview.inputs(runs))
        for name, run in runs.items():
            if summaries is not None and is_drawn(summaries[name]):
                add(f'certificate_{name}', *certificate_figure(run, summaries[name]))
        leading = reference(runs)
        add('kinetic_energy', *overview.energy(runs, leading))
        add('energy_shares', *overview.energy_shares(runs))
        add('delta_xi', *_deformation('delta_xi', leading))
        add('delta_pi', *_deformation('delta_pi', leading))
    return figures


def reference(runs: Mapping[str, Run]) -> Run:
    """The run whose energy and couplings are drawn: the first under GVC, else the first."""
    return min(runs.values(), key=lambda run: run.law != 'gvc')


def six_signals(
    kind: str, run: Run, quantity: Quantity, values: np.ndarray, zeros: Sequence[str] = ()
) -> Drawn:
    """Linear and angular signals of a run, the first phase apart where it dwarfs the rest.

    Parameters
    ----------
    kind : 'errors', 'lumped_error', 'uncertainty', 'inputs', 'delta_xi' or 'delta_pi'
    run : whose signals they are
    quantity : what they are
    values : (n + 1, 6)
    zeros : degrees of freedom that vanish for every motion: named, not drawn

    Returns
    -------
    figure, title, caption : no figure where nothing moves

    """
    title = f'{quantity.name.capitalize()}, {run.controller}'
    drawn = plotting.moving(values, zeros)
    structure = structure_sentence(kind, zeros)
    if not drawn:
        return None, title, structure if len(zeros) == 6 else f'{title}: zero throughout.'
    split = kind in SPLIT and run.duration > 2.0 * TRANSIENT
    original = paper_figure(run, kind)
    caption = [f'{title}{f"; the paper’s figure {original}" if original else ""}.']
    if split:
        caption.append(f'Left the first {TRANSIENT:g} s, right the rest on a scale of its own.')
    caption += [_peaks(run, quantity, values, drawn), structure]
    still = [dof for i, dof in enumerate(DOFS) if i not in drawn and dof not in zeros]
    if still:
        caption.append(f'Zero throughout this run and not drawn: {join(still)}.')
    figure = (_split_panels if split else _whole_panels)(run.t, values, quantity, drawn)
    return figure, title, ' '.join(filter(None, caption))


def structure_sentence(kind: str, zeros: Sequence[str]) -> str:
    """What the structure of M makes vanish, in words."""
    if not zeros:
        return ''
    if len(zeros) == 6:
        return f'{SYMBOLS[kind]} vanishes in all six degrees of freedom: M is diagonal.'
    return f'Zero for every motion by the structure of M and not drawn: {join(zeros)}.'


def estimates(run: Run) -> bool:
    """Whether the law of a run has an adaptive term, or at least one that is not zero."""
    return bool(np.any(run.disturbance_estimate != 0.0))


def _errors(run: Run) -> Drawn:
    figure, title, caption = six_signals('errors', run, plotting.ERROR, run.nu_d - run.nu)
    if run.measured is not None:
        caption += ' The law saw measured velocities; these errors are those of the true ones.'
    return figure, title, caption


def _lumped(run: Run) -> Drawn:
    w = lumped_error(run)
    if w is None or not estimates(run):
        title = f'Lumped estimation error, {run.controller}'
        text = 'the law estimates nothing; w is −F, no error of an estimate, and not drawn.'
        return None, title, f'{title}: {text}'
    return six_signals('lumped_error', run, plotting.LUMPED, w)


def _uncertainty(run: Run, F: np.ndarray) -> Drawn:
    figure, title, caption = six_signals('uncertainty', run, plotting.UNCERTAINTY, F)
    kinds = [kind.replace('_', ' ') for kind in OF_THE_MOTION if kind in (run.kinds or ())]
    if kinds:
        caption += f' F contains {join(kinds)} and so depends on the motion of this very run.'
    return figure, title, caption


def _inputs(run: Run, limit: np.ndarray | None) -> Drawn:
    if run.applied is not None and np.any(run.tau):
        return applied_figure(run, limit)
    return six_signals('inputs', run, plotting.INPUT, run.tau)


def _deformation(kind: str, run: Run) -> Drawn:
    model = control_model(run.vehicle)
    Upsilon, Upsilon_inv = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    zeros = structural_zeros(Upsilon, Upsilon_inv)[kind]
    if kind == 'delta_xi':
        values = delta_xi(Upsilon_inv, run.nu)
        return six_signals(kind, run, plotting.DELTA_XI, values, zeros)
    drawn = six_signals(kind, run, plotting.DELTA_PI, delta_pi(Upsilon, run.tau), zeros)
    note = ' Of the commanded wrench.' if run.applied is not None and drawn[0] is not None else ''
    return drawn[0], drawn[1], drawn[2] + note


def _different_disturbances(runs: Mapping[str, Run]) -> list[tuple[Run, np.ndarray]]:
    """Runs with a known F that no run before them has."""
    kept: list[tuple[Run, np.ndarray]] = []
    for run in runs.values():
        F = run.disturbance
        if F is not None and not any(np.array_equal(F, other) for _, other in kept):
            kept.append((run, F))
    return kept


def _peaks(run: Run, quantity: Quantity, values: np.ndarray, drawn: Sequence[int]) -> str:
    parts = []
    for columns in plotting.groups(drawn):
        peak, i = max((np.abs(values[:, i]).max(), i) for i in columns)
        at = run.t[np.argmax(np.abs(values[:, i]))]
        parts.append(f'{number(peak)} {quantity.unit(i)} in {DOFS[i]} at {at:.2f} s')
    return f'Largest: {join(parts)}.'


def _split_panels(
    t: np.ndarray, values: np.ndarray, quantity: Quantity, drawn: Sequence[int]
) -> Figure:
    groups = plotting.groups(drawn)
    figure = plotting.new_figure(2.15 * len(groups) + 0.25)
    grid = figure.subplots(len(groups), 2, squeeze=False, width_ratios=(1, 1.9))
    early = t <= t[0] + TRANSIENT
    for row, columns in enumerate(groups):
        for column, inside in enumerate((early, ~early)):
            axes = grid[row, column]
            plotting.draw_lines(axes, t[inside], values[inside], columns)
            plotting.letter(axes, 2 * row + column)
        grid[row, 0].set_ylabel(quantity.label(columns))
        plotting.key(grid[row, 1], quantity, columns)
    for axes in grid[-1]:
        axes.set_xlabel('$t$ (s)')
    return figure


def _whole_panels(
    t: np.ndarray, values: np.ndarray, quantity: Quantity, drawn: Sequence[int]
) -> Figure:
    groups = plotting.groups(drawn)
    figure = plotting.new_figure(2.0 * len(groups) + 0.25)
    grid = figure.subplots(len(groups), 1, squeeze=False, sharex=True)[:, 0]
    for row, columns in enumerate(groups):
        plotting.draw_lines(grid[row], t, values, columns)
        grid[row].set_ylabel(quantity.label(columns))
        plotting.letter(grid[row], row)
        plotting.key(grid[row], quantity, columns)
    grid[-1].set_xlabel('$t$ (s)')
    return figure
