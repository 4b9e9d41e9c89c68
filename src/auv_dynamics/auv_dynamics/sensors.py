"""From the true state to the measured one: seeded noise and lost samples."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_dynamics.jit import compiled, helper

WIDTH = 10  # columns of a row: noise of velocity (6), of attitude (3), whether the sample is lost


class SensorNoise:
    """Random numbers of a run, row by row, the same however many rows are asked for at once.

    Parameters
    ----------
    spec : `velocity_noise` (1 or 6 standard deviations, m/s and rad/s), `attitude_noise` (1 or 3,
        rad, about the body axes), `drop_out` (probability that a sample is lost)
    seed : of the scenario; `SeedSequence(seed).spawn(2)` gives the streams of noise and of losses

    """

    def __init__(self, spec: Mapping[str, Any], seed: int):
        self._noise, self._loss = (
            np.random.Generator(np.random.PCG64(child))
            for child in np.random.SeedSequence(seed).spawn(2)
        )
        velocity = np.broadcast_to(np.asarray(spec.get('velocity_noise', 0.0), float), 6)
        attitude = np.broadcast_to(np.asarray(spec.get('attitude_noise', 0.0), float), 3)
        self._deviation = np.concatenate([velocity, attitude])
        self._drop_out = float(spec.get('drop_out', 0.0))

    def rows(self, count: int) -> np.ndarray:
        """The next `count` rows (count, 10): noise in m/s, rad/s and rad, then 1 where lost."""
        noise = self._noise.standard_normal((count, 9)) * self._deviation
        lost = self._loss.random(count) < self._drop_out
        return np.column_stack([noise, lost])


@helper
def fill_measured(noise, k, x, measured):
    """Write what is measured of the state x (13,) at sample k; a lost sample changes nothing.

    nu + noise; q * exp(noise / 2), a small rotation about the body axes; the position is true.
    """
    if noise[9] != 0.0 and k > 0:
        return
    a, b, c = 0.5 * noise[6], 0.5 * noise[7], 0.5 * noise[8]
    angle = np.sqrt(a * a + b * b + c * c)
    scale = np.sin(angle) / angle if angle > 0.0 else 1.0
    e0, e1, e2, e3 = np.cos(angle), a * scale, b * scale, c * scale
    w, i, j, l = x[3], x[4], x[5], x[6]
    measured[0], measured[1], measured[2] = x[0], x[1], x[2]
    measured[3] = w * e0 - i * e1 - j * e2 - l * e3
    measured[4] = w * e1 + i * e0 + j * e3 - l * e2
    measured[5] = w * e2 - i * e3 + j * e0 + l * e1
    measured[6] = w * e3 + i * e2 - j * e1 + l * e0
    for n in range(6):
        measured[7 + n] = x[7 + n] + noise[n]


@compiled
def fill_measurement(noise, k, x, measured):
    """`fill_measured` to be called from Python."""
    fill_measured(noise, k, x, measured)
