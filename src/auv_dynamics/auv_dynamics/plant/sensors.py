"""From the true state to the measured one: seeded noise and lost samples."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_dynamics.kernel.compile import compiled
from auv_dynamics.kernel.lanes import select
from auv_dynamics.plant.fault_rows import MeasurementFaults
from auv_dynamics.plant.faults import NONE, Faults

WIDTH = 11  # columns of a row: velocity noise (6), rotation quaternion (4), whether it is lost
LOST = WIDTH - 1


class SensorNoise:
    """Random numbers of a run, row by row, the same however many rows are asked for at once.

    Parameters
    ----------
    spec : `velocity_noise` (1 or 6 standard deviations, m/s and rad/s), `attitude_noise` (1 or 3,
        rad, about the body axes), `drop_out` (probability that a sample is lost)
    seed : of the scenario; `SeedSequence(seed).spawn(2)` gives the streams of noise and of losses
    faults : whose biases and drop-outs come on top

    """

    def __init__(self, spec: Mapping[str, Any], seed: int, faults: Faults = NONE):
        self._noise, self._loss = (
            np.random.Generator(np.random.PCG64(child))
            for child in np.random.SeedSequence(seed).spawn(2)
        )
        velocity = np.broadcast_to(np.asarray(spec.get('velocity_noise', 0.0), float), 6)
        attitude = np.broadcast_to(np.asarray(spec.get('attitude_noise', 0.0), float), 3)
        self._deviation = np.concatenate([velocity, attitude])
        self._drop_out = float(spec.get('drop_out', 0.0))
        self._faults = MeasurementFaults(faults, seed) if faults.sensing else None
        self._begun = False

    def rows(self, count: int) -> np.ndarray:
        """The next `count` rows (count, 11).

        Noise of nu in m/s and rad/s; exp(noise / 2) of the attitude as a quaternion w, x, y, z; 1
        where the sample is lost, which the first of a run never is. Noise includes biases.
        """
        noise = self._noise.standard_normal((count, 9)) * self._deviation
        lost = self._loss.random(count) < self._drop_out
        if self._faults is not None:
            bias, dropped = self._faults.rows(count)
            noise, lost = noise + bias, lost | dropped
        half = 0.5 * noise[:, 6:]
        angle = np.sqrt((half**2).sum(axis=1))
        scale = np.divide(np.sin(angle), angle, out=np.ones(count), where=angle > 0)
        if not self._begun:
            lost[:1], self._begun = False, True
        return np.column_stack([noise[:, :6], np.cos(angle), half * scale[:, None], lost])


@compiled
def fill_measured(noise: np.ndarray, x: np.ndarray, measured: np.ndarray) -> None:
    """Write what is measured of the state x (13,); a lost sample changes nothing.

    nu + noise; q * exp(noise / 2), a small rotation about the body axes; the position is true.
    """
    lost = noise[10] != 0.0
    e0, e1, e2, e3 = noise[6], noise[7], noise[8], noise[9]
    w, i, j, l = x[3], x[4], x[5], x[6]
    for n in range(3):
        measured[n] = select(lost, measured[n], x[n])
    measured[3] = select(lost, measured[3], w * e0 - i * e1 - j * e2 - l * e3)
    measured[4] = select(lost, measured[4], w * e1 + i * e0 + j * e3 - l * e2)
    measured[5] = select(lost, measured[5], w * e2 - i * e3 + j * e0 + l * e1)
    measured[6] = select(lost, measured[6], w * e3 + i * e2 - j * e1 + l * e0)
    for n in range(6):
        measured[7 + n] = select(lost, measured[7 + n], x[7 + n] + noise[n])
