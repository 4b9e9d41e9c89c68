"""Figures of a check: when messages came, twist against pose, answers against the model."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from auv_analysis.driver_check.motion import Motion, compared, motion_of
from auv_analysis.driver_check.outcome import Result
from auv_analysis.driver_check.time_checks import reference_ns
from auv_analysis.driver_check.trials import Answered
from auv_analysis.report import plotting
from auv_analysis.report.figure_files import FigureRecord, save_figures
from auv_analysis.report.plotting import COLOURS, GREY
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle import DOFS

MS = 1e3
BINS = 60
WIDER = 1.05
FEW = 3  # messages
Drawn = tuple[Figure, str, str]


def draw(result: Result, folder: Path) -> dict[str, FigureRecord]:
    """Draw what a check allows, as PNG and PDF: name -> figure."""
    drawn: dict[str, Callable[[], Drawn]] = {}
    if len(result.recording.arrived_ns) >= FEW:
        drawn['timing'] = partial(_timing, result)
    motion = motion_of(result.recording)
    if motion is not None:
        drawn['linear'] = partial(_motion, motion, 'm/s')
        drawn['angular'] = partial(_motion, motion, 'rad/s')
    if result.answers:
        drawn['answers'] = partial(_answers, result.answers)
    return save_figures(folder, drawn)


def _timing(result: Result) -> Drawn:
    heard = result.recording
    t = (heard.arrived_ns - heard.began_ns) / NANOSECONDS
    now, _ = reference_ns(heard, result.settings)
    ages = (now - heard.stamp_ns) / NANOSECONDS
    ages = ages - np.nanmin(ages) if np.isfinite(ages).any() else np.zeros_like(ages)
    figure = plotting.new_figure(2.4)
    left, right = figure.subplots(1, 2)
    apart = np.diff(np.sort(t)) * MS
    left.hist(apart, bins=BINS, range=(0.0, WIDER * float(np.max(apart))), color=COLOURS[0])
    left.set(xlabel='between two messages (ms)', ylabel='messages', yscale='log')
    right.plot(t, ages * MS, '.', markersize=2, color=COLOURS[0])
    right.set(xlabel='$t$ (s)', ylabel='older than the freshest (ms)')
    for i, axes in enumerate((left, right)):
        plotting.letter(axes, i)
    title = 'When messages came'
    caption = (
        f'{title}: (a) times between arrivals; (b) age of each stamp beyond the smallest one, '
        'which grows or falls steadily where the two clocks drift apart.'
    )
    return figure, title, caption


def _motion(motion: Motion, unit: str) -> Drawn:
    linear = unit == 'm/s'
    path = motion.travelled if linear else motion.turned
    first = 0 if linear else 3
    pair = compared(motion, path, motion.nu[:, first : first + 3])
    figure = plotting.new_figure(3.6)
    panels = figure.subplots(3, 1, sharex=True)
    for i, axes in enumerate(panels):
        axes.plot(motion.probes, pair.path[:, i], color=GREY, linewidth=2.4, label='by the pose')
        axes.plot(motion.probes, pair.velocity[:, i], color=COLOURS[first + i], label='twist')
        axes.set_ylabel(f'{DOFS[first + i]} ({unit})')
        plotting.letter(axes, i)
    panels[0].legend(loc='lower right', bbox_to_anchor=(1.0, 1.02), ncols=2)
    panels[-1].set_xlabel('$t$ (s)')
    word = 'Linear' if linear else 'Angular'
    title = f'{word} velocity by pose and twist'
    caption = (
        f'{title}: rates of the pose in body axes, and the twist, both through local polynomials '
        'of order 3; where they part, axes, sign or unit of the twist are not what they should be.'
    )
    return figure, title, caption


def _answers(answers: Sequence[Answered]) -> Drawn:
    across = 2 if len(answers) > 1 else 1
    down = -(-len(answers) // across)
    figure = plotting.new_figure(0.4 + 1.7 * down)
    panels = figure.subplots(down, across, squeeze=False).ravel()
    for i, (axes, answer) in enumerate(zip(panels, answers, strict=False)):
        heard, axis = answer.heard, answer.heard.trial.axis
        nu = heard.nu[:, axis]
        axes.plot(heard.t, nu - nu[0], color=COLOURS[axis], label='measured')
        late, added = answer.model.t + answer.response.delay, answer.model.added
        axes.plot(late, added[:, axis], color=GREY, linestyle='--', label='model')
        axes.set_ylabel(f'{heard.trial.dof} ({"m/s" if axis < 3 else "rad/s"})')
        axes.set_xlabel('$t$ (s)')
        plotting.letter(axes, i)
    for axes in panels[len(answers) :]:
        axes.set_axis_off()
    panels[0].legend(loc='lower right', bbox_to_anchor=(1.0, 1.02), ncols=2)
    title = 'Answers to small wrenches'
    caption = (
        f'{title}: velocity since the beginning of each trial, and what the wrench adds to it by '
        'the model, shifted by the delay that was found; drift beside it is taken off by the fit.'
    )
    return figure, title, caption
