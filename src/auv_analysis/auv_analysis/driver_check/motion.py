"""The motion in a recording: pose and twist over rising times, and how their rates compare."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from auv_analysis.bag.local_polynomials import SMALLEST, rates, residuals
from auv_analysis.driver_check.attitude import travelled, turned
from auv_analysis.driver_check.recording import Recording
from auv_dynamics.ros.interface import NANOSECONDS

WINDOW = 1.0  # s over which rates are fitted
PROBES = 400  # times at which they are, at most
UNIT = 0.1  # deviation of the norm of a quaternion that still tells an attitude


@dataclass(frozen=True, eq=False)
class Motion:
    """Pose and twist as they were sent.

    Attributes
    ----------
    t : (n,) s, rising
    p : (n, 3) position, m
    q : (n, 4) unit quaternion w, x, y, z
    nu : (n, 6) twist, m/s and rad/s
    by_arrival : times are those of arrival, since the stamps do not rise

    """

    t: np.ndarray
    p: np.ndarray
    q: np.ndarray
    nu: np.ndarray
    by_arrival: bool = False

    @cached_property
    def turned(self) -> np.ndarray:
        """Small turns added up (n, 3), rad, body axes."""
        return turned(self.q)

    @cached_property
    def travelled(self) -> np.ndarray:
        """Small ways added up (n, 3), m, body axes."""
        return travelled(self.p, self.q)

    @cached_property
    def count(self) -> int:
        """Samples of the window of a rate, an odd number."""
        period = float(np.median(np.diff(self.t)))
        return min(max(2 * round(WINDOW / period / 2) + 1, SMALLEST), len(self.t))

    @cached_property
    def probes(self) -> np.ndarray:
        """Times (m,) at which rates are compared."""
        return self.t[:: -(-len(self.t) // PROBES)]


def motion_of(recording: Recording) -> Motion | None:
    """Motion of the messages that tell one; None where they are too few."""
    norm = np.linalg.norm(recording.x[:, 3:7], axis=1)
    good = recording.finite & (np.abs(norm - 1.0) < UNIT)
    x, stamps, arrived = recording.x[good], recording.stamp_ns[good], recording.arrived_ns[good]
    by_arrival = not bool((np.diff(stamps) > 0).all())
    if by_arrival:
        newer = np.diff(np.maximum.accumulate(arrived), prepend=-1) > 0
        x, stamps = x[newer], arrived[newer]
    if len(x) < SMALLEST:
        return None
    t = (stamps - stamps[0]) / NANOSECONDS
    q = x[:, 3:7] / np.linalg.norm(x[:, 3:7], axis=1, keepdims=True)
    return Motion(t, x[:, :3], q, x[:, 7:], by_arrival)


class Compared(NamedTuple):
    """Rates of a path and a velocity that may be its rate, both seen through one filter.

    Attributes
    ----------
    path, velocity : (m, 3) at the probes, unit of the velocity
    path_noise, velocity_noise : (3,) variance of noise in them

    """

    path: np.ndarray
    velocity: np.ndarray
    path_noise: np.ndarray
    velocity_noise: np.ndarray

    def sizes(self) -> tuple[float, float, float]:
        """Root mean squares of path rate, velocity and their difference, less the noise."""
        pair = self.path_noise + self.velocity_noise
        parts = (self.path, self.path_noise), (self.velocity, self.velocity_noise)
        along, told = (_size(*part) for part in parts)
        return along, told, _size(self.path - self.velocity, pair)

    def noise(self) -> float:
        """Root mean square of the noise in their difference."""
        return float(np.sqrt((self.path_noise + self.velocity_noise).sum()))


def compared(motion: Motion, path: np.ndarray, velocity: np.ndarray) -> Compared:
    """Rate of a path against a velocity.

    The velocity is integrated and then treated like the path, so that both pass the same filter:
    what it takes away, it takes from both.

    Parameters
    ----------
    motion : whose times these are
    path, velocity : (n, 3), unit and unit per s

    """
    t, at, count = motion.t, motion.probes, motion.count
    whole = cumulative_trapezoid(velocity, t, axis=0, initial=0.0)
    by_path, by_velocity = (rates(t, signal, at, count) for signal in (path, whole))
    noise = [squares / max(freedom, 1.0) for squares, freedom in
             (residuals(t, path), residuals(t, velocity))]  # fmt: skip
    return Compared(
        by_path.rate,
        by_velocity.rate,
        noise[0] * float(by_path.gain.mean()),
        noise[1] * float(by_velocity.inner_gain.mean()),
    )


def _size(rows: np.ndarray, noise: np.ndarray) -> float:
    return float(np.sqrt(max((rows**2).sum(axis=1).mean() - noise.sum(), 0.0)))
