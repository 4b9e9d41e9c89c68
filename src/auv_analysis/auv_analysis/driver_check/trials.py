"""What was heard while a wrench was sent, beside what the model makes of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_analysis.driver_check.plan import REST, Trial
from auv_analysis.driver_check.prediction import Predicted, pieces, predicted
from auv_analysis.driver_check.procedure import Sent
from auv_analysis.driver_check.recording import Recording
from auv_analysis.driver_check.response import Response, response_of
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.vehicle import Vehicle

LEAST = 20  # messages of a trial


@dataclass(frozen=True, eq=False)
class Heard:
    """A trial: velocities against the time since it began.

    Attributes
    ----------
    trial : what was sent
    t, nu : (n,) s and (n, 6) m/s and rad/s, measured, by the times of arrival
    x : (13,) state at its beginning
    held : begin, end in s and wrench of each piece
    applied_t, applied : (m,) s and (m, 6) of wrench_applied
    silent_from : s, when the last wrench was sent

    """

    trial: Trial
    t: np.ndarray
    nu: np.ndarray
    x: np.ndarray
    held: list[tuple[float, float, tuple[float, ...]]]
    applied_t: np.ndarray
    applied: np.ndarray
    silent_from: float


@dataclass(frozen=True, eq=False)
class Answered:
    """A trial with the answer to it.

    Attributes
    ----------
    heard : the trial
    response : what the fit says
    model : velocities with and without the wrench

    """

    heard: Heard
    response: Response
    model: Predicted

    def document(self) -> Mapping[str, Any]:
        """Ready for JSON."""
        trial, found = self.heard.trial, self.response
        return {
            'dof': trial.dof,
            'size': trial.size,
            'unit': trial.unit,
            'gain': found.gain,
            'gain_error': found.error,
            'delay': found.delay,
            'peaks_measured': found.measured.tolist(),
            'peaks_predicted': found.predicted.tolist(),
        }


def heard_of(sent: Sent, recording: Recording) -> Heard | None:
    """What was heard of a trial; None where it was broken off or too little came."""
    if not sent.ended_ns:
        return None
    began = sent.steps[0][0]

    def seconds(ns: np.ndarray) -> np.ndarray:
        return (ns - began) / NANOSECONDS

    inside = (recording.arrived_ns >= began) & (recording.arrived_ns <= sent.ended_ns)
    inside &= recording.finite
    if int(inside.sum()) < LEAST:
        return None
    t, x = seconds(recording.arrived_ns[inside]), recording.x[inside]
    if not (np.diff(t) > 0).all():
        t, first = np.unique(t, return_index=True)
        x = x[first]
    before = x[t <= REST] if (t <= REST).any() else x[:1]
    start = before[0].copy()
    start[7:] = np.median(before[:, 7:], axis=0)
    steps = [((ns - began) / NANOSECONDS, tau) for ns, tau in sent.steps]
    end = (sent.ended_ns - began) / NANOSECONDS
    during = (recording.applied_arrived_ns >= began) & (
        recording.applied_arrived_ns <= sent.ended_ns
    )
    return Heard(
        sent.trial,
        t,
        x[:, 7:],
        start,
        pieces(steps, end),
        seconds(recording.applied_arrived_ns[during]),
        recording.applied[during],
        steps[-1][0],
    )


def answered(vehicle: Vehicle, heard: Heard) -> Answered:
    """Compare a trial with the model."""
    model = predicted(vehicle, heard.x, heard.held)
    return Answered(heard, response_of(heard.t, heard.nu, model, heard.trial.axis), model)
