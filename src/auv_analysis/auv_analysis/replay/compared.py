"""What a law would have commanded beside what was commanded: figures, and a picture."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.replay.open_loop import OpenLoop, RecordedLoop
from auv_dynamics.ros import interface
from auv_dynamics.ros.interface import NANOSECONDS

LOCKSTEP = 1e-9  # of the rms: rounding of another machine; on the same one nothing differs
REAL_TIME = 0.05  # the bag does not say when each message arrived
UNCHECKED = 'reproduction not checked'


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


def figures_of(both: Compared) -> dict[str, dict[str, list[float] | None]]:
    """Root mean square and largest absolute value of both wrenches and of their difference."""
    parts = {
        'recorded': both.recorded,
        'answered': both.answered,
        'difference': both.answered - both.recorded,
    }
    return {name: _figures(wrench) for name, wrench in parts.items()}


def _figures(wrench: np.ndarray) -> dict[str, list[float] | None]:
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

    """

    relative: float | None
    within: float | None
    limit: float

    @property
    def holds(self) -> bool | None:
        """Whether it does; None: there is nothing to compare."""
        if self.relative is None:
            return None if self.within is None else self.within == 0.0
        return self.relative <= self.limit

    def sentence(self) -> str:
        """What is said first of the results."""
        limit = f'(limit {100.0 * self.limit:g} %)'
        if self.within is None:
            return f'{UNCHECKED}: no recorded wrench answers a recorded odometry, but on a ramp'
        if self.relative is None:
            return f'{"" if self.holds else "NOT "}reproduced: the recorded wrench is zero'
        text = f'by {100.0 * self.relative:.3g} % rms {limit}'
        if self.holds:
            return f'reproduced: the recorded law differs from the recorded wrench {text}'
        return f'NOT reproduced: the recorded law differs from the recorded wrench {text}'


def reproduction(recorded: RecordedLoop, again: OpenLoop) -> Reproduction:
    """Compare the recorded wrench with what the recorded law says when it is asked again.

    In real time without the ramps after it has taken over: they follow the clock of the node.
    """
    limit = LOCKSTEP if recorded.controller.settings.lockstep else REAL_TIME
    if again.ramps is not None:
        free = ~again.ramps
        again = replace(again, ns=again.ns[free], tau=again.tau[free])
    both = compared(recorded, again)
    if not len(both.t):
        return Reproduction(None, None, limit)
    difference = both.answered - both.recorded
    within, most = float(np.abs(difference).max()), float(np.abs(both.recorded).max())
    if not most:
        return Reproduction(None, within, limit)
    parts = (np.sqrt(np.mean((wrench / most) ** 2)) for wrench in (difference, both.recorded))
    return Reproduction(float(np.divide(*parts)), within, limit)


def listed(gains: Mapping[str, Any]) -> dict[str, Any]:
    """Gains as numbers and lists, for a document."""
    return {name: np.asarray(value, float).tolist() for name, value in gains.items()}
