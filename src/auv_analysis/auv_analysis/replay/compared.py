"""What a law would have commanded beside what was commanded: figures, and a picture."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.replay.open_loop import OpenLoop, RecordedLoop
from auv_dynamics import interface
from auv_dynamics.interface import NANOSECONDS


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
    rms = np.sqrt(np.mean(wrench**2, axis=0))
    return {'rms': rms.tolist(), 'max': np.abs(wrench).max(axis=0).tolist()}


def listed(gains: Mapping[str, Any]) -> dict[str, Any]:
    """Gains as numbers and lists, for a document."""
    return {name: np.asarray(value, float).tolist() for name, value in gains.items()}
