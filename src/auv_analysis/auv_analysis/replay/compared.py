"""A law's wrench on recorded odometry against the recorded one: metrics, and a plot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from auv_analysis.bag.attachments import UNKNOWN
from auv_analysis.output.text import capital
from auv_analysis.replay.open_loop import OpenLoop, RecordedLoop
from auv_dynamics.ros import interface
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.law import is_unasked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOCKSTEP = 1e-9  # of the rms: rounding of another machine; on the same one nothing differs
REAL_TIME = 0.05  # the bag does not say when each message arrived
UNCHECKED = 'reproduction not checked'
UNNAMED = f'{UNCHECKED}: the bag does not name its law, or it is not imported'
NAME = 'open_loop_wrench'  # of the plot
Ask = Callable[[RecordedLoop, str, dict[str, Any]], OpenLoop]


class Compared(NamedTuple):
    """Wrenches at the stamps that both have.

    Attributes
    ----------
    t : (m,) s since the first odometry
    recorded, answered : (m, 6) N and N m, body frame

    """

    t: np.ndarray
    recorded: np.ndarray
    answered: np.ndarray


def compared(recorded: RecordedLoop, answers: OpenLoop) -> Compared:
    """The recorded wrench and that of a law, where there are both; of doubled stamps the first."""
    ns, tau = recorded.series[interface.WRENCH]
    _, ours, theirs = np.intersect1d(answers.ns, ns, return_indices=True)
    begin = int(recorded.series[interface.ODOM][0][0])
    t = (answers.ns[ours] - begin) / NANOSECONDS
    return Compared(t, tau[theirs], answers.tau[ours])


def metrics_of(both: Compared) -> dict[str, dict[str, list[float] | None]]:
    """Root mean square and largest absolute value of both wrenches and of their difference."""
    parts = {
        'recorded': both.recorded,
        'answered': both.answered,
        'difference': both.answered - both.recorded,
    }
    return {name: _metrics(wrench) for name, wrench in parts.items()}


def _metrics(wrench: np.ndarray) -> dict[str, list[float] | None]:
    if not len(wrench):
        return {'rms': None, 'max': None}
    most = np.abs(wrench).max(axis=0)
    rms = most * np.sqrt(np.mean((wrench / np.where(most, most, 1.0)) ** 2, axis=0))
    return {'rms': rms.tolist(), 'max': most.tolist()}


class Reproduction(NamedTuple):
    """Whether the recorded law, asked again, gives the recorded wrench.

    Attributes
    ----------
    relative : rms of the difference over rms of the recorded wrench, all six components alike;
        None: there is nothing to compare, or the recorded wrench is zero
    within : largest difference, N or N m; None: there is nothing to compare
    limit : of `relative`
    missing : recorded wrenches of lock-step whose odometry is there, and was not answered again

    """

    relative: float | None
    within: float | None
    limit: float
    missing: int = 0

    @property
    def holds(self) -> bool | None:
        """Whether it does; None: there is nothing to compare."""
        if self.missing:
            return False
        if self.relative is None:
            return None if self.within is None else self.within == 0.0
        return self.relative <= self.limit

    def sentence(self) -> str:
        """What is said first of the results."""
        if self.missing:
            return f'NOT reproduced: {self.missing} recorded wrenches are not answered again'
        if self.within is None:
            return f'{UNCHECKED}: no recorded wrench answers a recorded odometry, but on a ramp'
        verdict = 'reproduced' if self.holds else 'NOT reproduced'
        if self.relative is None:
            return f'{verdict}: the recorded wrench is zero'
        by = f'by {100.0 * self.relative:.3g} % rms (limit {100.0 * self.limit:g} %)'
        return f'{verdict}: the recorded law differs from the recorded wrench {by}'


def reproduction(recorded: RecordedLoop, again: OpenLoop) -> Reproduction:
    """Compare the recorded wrench with what the recorded law says when it is asked again.

    In real time without the ramps after it has taken over: they follow the clock of the node.
    """
    lockstep = recorded.controller.settings.lockstep
    limit = LOCKSTEP if lockstep else REAL_TIME
    if again.ramps is not None:
        free = ~again.ramps
        again = replace(again, ns=again.ns[free], tau=again.tau[free])
    both = compared(recorded, again)
    (heard, _), (said, _) = (recorded.series[r] for r in (interface.ODOM, interface.WRENCH))
    missing = len(np.intersect1d(heard, said)) - len(both.t) if lockstep else 0
    if not len(both.t):
        return Reproduction(None, None, limit, missing)
    difference = both.answered - both.recorded
    within, most = float(np.abs(difference).max()), float(np.abs(both.recorded).max())
    if not most:
        return Reproduction(None, within, limit, missing)
    parts = (np.sqrt(np.mean((wrench / most) ** 2)) for wrench in (difference, both.recorded))
    return Reproduction(float(np.divide(*parts)), within, limit, missing)


def ask_law(
    recorded: RecordedLoop, law: str, given: Mapping[str, Any], ask: Ask
) -> tuple[dict[str, Any], Compared]:
    """Ask a law, and the recorded one again, what they would have commanded.

    Parameters
    ----------
    recorded : what was recorded of a controller
    law : that is asked
    given : its gains by name; those that are not given are the recorded ones
    ask : as `open_loop`

    Returns
    -------
    document : metrics of both wrenches, and whether the recorded law gives the recorded one
    both : the wrenches

    """
    own = recorded.controller
    gains = own.gains_of(law, given)
    answers = ask(recorded, law, gains)
    known, verdict = own.law != UNKNOWN, None
    if known and not is_unasked(own.law):
        same = law == own.law and not given  # as recorded: asked once
        again = answers if same else ask(recorded, own.law, dict(own.gains))
        verdict = reproduction(recorded, again)
    both = compared(recorded, answers)
    refused = f'{answers.refused} messages without an answer of the law; first: {answers.trouble}'
    document = {
        'reproduced': verdict.holds if verdict else None,
        'reproduction': verdict.sentence() if verdict else UNNAMED,
        'reproduced_relative': verdict.relative if verdict else None,
        'reproduced_within': verdict.within if verdict else None,
        'scenario': recorded.scenario,
        'controller': recorded.name,
        'recorded': {'law': own.law if known else None, 'gains': _listed(own.gains)},
        'answered': {'law': law, 'gains': _listed(gains)},
        'samples': len(both.t),
        'wrench': metrics_of(both),
        'not_used': answers.refused,
        'notes': [*recorded.notes, *answers.notes, *[refused] * bool(answers.refused)],
    }
    return document, both


def _listed(gains: Mapping[str, Any]) -> dict[str, Any]:
    return {name: np.asarray(value, float).tolist() for name, value in gains.items()}


def draw(document: Mapping[str, Any], both: Compared, folder: Path) -> Path:
    """Draw both wrenches, a panel per degree of freedom, as PNG and PDF; the path of the PNG.

    Parameters
    ----------
    document, both : of `ask_law`
    folder : of the plots, made when it is not there

    """
    from auv_analysis.report.plots import save_figures  # with matplotlib, which loads slowly

    save_figures(folder, {NAME: partial(_figure, document, both)})
    return folder / f'{NAME}.png'


def _figure(document: Mapping[str, Any], both: Compared) -> tuple[Figure, str, str]:
    from auv_analysis.metrics.quantities import SIGNALS
    from auv_analysis.report.plots import COLOURS, DASHES, legend_above
    from auv_analysis.report.traces import FEW, thinned
    from auv_analysis.report.wrench_plots import six_panels

    law, verdict = document['answered']['law'], document['reproduction']
    names = f'recorded ({document["recorded"]["law"] or "unknown law"})', f'{law}, open loop'
    figure, panels = six_panels(5.2)
    for i, axes in enumerate(panels):
        pairs = zip(names, (both.recorded, both.answered), DASHES, strict=False)
        for k, (name, wrench, dash) in enumerate(pairs):
            t, tau = both.t, wrench[:, i]
            if len(t) > FEW:
                t, tau = thinned(t, tau)
            axes.plot(t, tau, color=COLOURS[k], linestyle=dash, label=name)
        axes.set_ylabel(f'{DOFS[i]}: {SIGNALS["tau"].axis([i])}')
    legend_above(panels[3], 2)
    said = capital(verdict)
    figure.suptitle(said, fontsize='small')
    title = f'What {names[1]} would have commanded'
    recorded = 'at the recorded velocity and set-point, beside the recorded wrench'
    return figure, title, f'{title} {recorded}. {said}.'
