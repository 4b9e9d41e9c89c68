"""Pose against twist: the conventions under which the velocity is the rate of the pose.

A reading gives a path and the velocity that would be its rate. The right one is named `CHILD`: the
pose from body to earth, the twist in body axes. The others are the usual mistakes. Path and
velocity pass the same filter, and the noise that is seen in them is taken off their difference.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from auv_analysis.metrics.local_polynomials import SMALLEST, rates, residuals
from auv_dynamics.vehicle.frames import swap_position
from auv_dynamics.vehicle.kinematics import euler, rotation

WINDOW = 1.0  # s over which rates are fitted
PROBES = 400  # times at which they are, at most
STILL = 0.02  # m/s, rad/s: motion below this says nothing about axes
FITS = 0.3  # of the speed: a reading that is off by more is not the right one
BEATS = 4.0  # times: a reading that fits so much better is right, and the other is not
CLOSE = 0.1  # of the speed: readings that fit so well are not beaten
CHILD = 'child'
FLIP = np.array([1.0, -1.0, -1.0])  # FLU to FSD, or back
UP = np.array([1.0, 1.0, -1.0])
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class PoseTwist:
    """Pose and twist over time, as they were sent.

    Attributes
    ----------
    t : (n,) s, rising, n at least `SMALLEST`
    p : (n, 3) position, m
    q : (n, 4) unit quaternion w, x, y, z
    nu : (n, 6) twist, m/s and rad/s
    by_publication : times are those of publication, since the stamps do not rise

    """

    t: np.ndarray
    p: np.ndarray
    q: np.ndarray
    nu: np.ndarray
    by_publication: bool = False

    @cached_property
    def turned(self) -> np.ndarray:
        """Rotation from sample to sample, added up (n, 3), rad, body axes."""
        return turned(self.q)

    @cached_property
    def travelled(self) -> np.ndarray:
        """Displacement from sample to sample, added up (n, 3), m, body axes."""
        R = rotation(self.q)
        steps = np.einsum('nji,nj->ni', (R[:-1] + R[1:]) / 2.0, np.diff(self.p, axis=0))
        return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def turned(q: np.ndarray) -> np.ndarray:
    """Rotation from sample to sample of quaternions (n, 4), added up (n, 3), rad, in body axes.

    Its rate is the angular velocity; noise of the attitude is not added up in it but is, but for
    the second order, noise of the result.
    """
    attitude = Rotation.from_quat(q[:, [1, 2, 3, 0]])
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def w_first(q: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) reordered where w was written first, into x."""
    return np.roll(q, -1, axis=1)


Reading = Callable[[PoseTwist], tuple[np.ndarray, np.ndarray]]


def turn(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """R(q) v, the vectors (n, 3) turned by the quaternions (n, 4), w, x, y, z."""
    return np.einsum('nij,nj->ni', rotation(q), v)


def _linear(
    earth: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> Reading:
    """Reading of twist.linear by what makes (q, v) a velocity in the axes of the position."""
    return lambda m: (m.p, earth(m.q, m.nu[:, :3]))


def _body_rates(m: PoseTwist) -> np.ndarray:
    """Angular velocity (n, 3) in body axes, if twist.angular were rates of roll, pitch, yaw."""
    phi, theta, _ = euler(m.q).T
    phi_dot, theta_dot, psi_dot = m.nu[:, 3:].T
    p = phi_dot - psi_dot * np.sin(theta)
    q = theta_dot * np.cos(phi) + psi_dot * np.sin(phi) * np.cos(theta)
    r = psi_dot * np.cos(phi) * np.cos(theta) - theta_dot * np.sin(phi)
    return np.stack([p, q, r], axis=1)


LINEAR: Mapping[str, Reading] = {
    CHILD: _linear(turn),
    'world': _linear(lambda q, v: v),
    'flu': _linear(lambda q, v: turn(q, v * FLIP)),
    'world_enu': _linear(lambda q, v: swap_position(v)),
    'position_enu': _linear(lambda q, v: swap_position(turn(q, v))),
    'attitude_enu': _linear(lambda q, v: swap_position(turn(q, v * FLIP))),
    'z_up': _linear(lambda q, v: turn(q, v) * UP),
    'w_first': _linear(lambda q, v: turn(w_first(q), v)),
    'inverse': _linear(lambda q, v: turn(q * CONJUGATE, v)),
}
ANGULAR: Mapping[str, Reading] = {
    CHILD: lambda m: (m.turned, m.nu[:, 3:]),
    'degrees': lambda m: (m.turned, np.radians(m.nu[:, 3:])),
    'flu': lambda m: (m.turned, m.nu[:, 3:] * FLIP),
    'world': lambda m: (m.turned, turn(m.q * CONJUGATE, m.nu[:, 3:])),
    'euler_rates': lambda m: (m.turned, _body_rates(m)),
    'w_first': lambda m: (turned(w_first(m.q)), m.nu[:, 3:]),
    'inverse': lambda m: (turned(m.q * CONJUGATE), m.nu[:, 3:]),
}


class RatePair(NamedTuple):
    """Rates of paths beside velocities that may be them, all through one filter.

    Attributes
    ----------
    t : (m,) s
    path, velocity : (m, k), unit of the velocity
    path_noise, velocity_noise : (k,) variance of noise in them

    """

    t: np.ndarray
    path: np.ndarray
    velocity: np.ndarray
    path_noise: np.ndarray
    velocity_noise: np.ndarray

    @property
    def sizes(self) -> tuple[float, float, float]:
        """Root mean squares of path rate, velocity and their difference, less the noise."""
        return (
            _size(self.path, self.path_noise),
            _size(self.velocity, self.velocity_noise),
            _size(self.path - self.velocity, self.path_noise + self.velocity_noise),
        )

    @property
    def noise(self) -> float:
        """Root mean square of the noise in their difference."""
        return float(np.sqrt((self.path_noise + self.velocity_noise).sum()))

    def part(self, columns: slice) -> 'RatePair':
        """Some of the columns."""
        return RatePair(self.t, *(values[..., columns] for values in self[1:]))


def _size(rows: np.ndarray, noise: np.ndarray) -> float:
    return float(np.sqrt(max((rows**2).sum(axis=1).mean() - noise.sum(), 0.0)))


def compare_rates(t: np.ndarray, path: np.ndarray, velocity: np.ndarray) -> RatePair:
    """Rate of a path against a velocity.

    The velocity is integrated and then treated like the path, so that both pass the same filter:
    what it takes away, it takes from both.

    Parameters
    ----------
    t : (n,) s, rising, n at least `SMALLEST`
    path, velocity : (n, k), unit and unit per s

    """
    count = 2 * round(WINDOW / float(np.median(np.diff(t))) / 2) + 1
    count = min(max(count, SMALLEST), len(t))
    probes = t[:: -(-len(t) // PROBES)]
    whole = cumulative_trapezoid(velocity, t, axis=0, initial=0.0)
    k = path.shape[1]
    found = rates(t, np.concatenate([path, whole], axis=1), probes, count, bias=False)
    squares, freedom = residuals(t, np.concatenate([path, velocity], axis=1))
    noise = squares / max(freedom, 1.0)
    return RatePair(
        probes,
        found.rate[:, :k],
        found.rate[:, k:],
        noise[:k] * float(found.gain.mean()),
        noise[k:] * float(found.inner_gain.mean()),
    )


@dataclass(frozen=True)
class TwistFit:
    """Misfit of each reading of one half of the twist.

    Attributes
    ----------
    by_path, by_twist : speed by the pose and by the twist, root mean square, noise taken off
    noise : of the difference of both
    off : reading -> root mean square of path rate less velocity, of the larger speed
    constant : (3,) velocity that remains between them if the right reading is taken
    rest : what is off then, of the larger speed
    factor : by which the twist had to be multiplied, and
    scaled : what is off then, of the larger speed

    """

    by_path: float
    by_twist: float
    noise: float
    off: Mapping[str, float]
    constant: tuple[float, ...]
    rest: float
    factor: float
    scaled: float

    @property
    def speed(self) -> float:
        """The larger one."""
        return max(self.by_path, self.by_twist)

    @property
    def told(self) -> bool:
        """Whether there is motion enough to tell readings apart."""
        return self.speed > STILL and self.speed > self.noise

    @property
    def best(self) -> str:
        """The reading that fits best."""
        return min(self.off, key=self.off.__getitem__)

    def possible(self, name: str) -> bool:
        """Whether a reading fits, and none fits far better."""
        return self.off[name] <= FITS and self.off[name] <= max(BEATS * self.off[self.best], CLOSE)

    @property
    def right(self) -> bool:
        """Whether the right reading is possible."""
        return self.possible(CHILD)

    @property
    def others(self) -> list[str]:
        """Readings beside the right one that are possible as well, so far."""
        return [name for name in self.off if name != CHILD and self.possible(name)]


def fit_readings(motion: PoseTwist, readings: Mapping[str, Reading]) -> TwistFit:
    """Compare every reading, such as those of `LINEAR`, with the motion."""
    paths, velocities = zip(*(read(motion) for read in readings.values()), strict=True)
    all_of_them = compare_rates(motion.t, np.hstack(paths), np.hstack(velocities))
    pairs = {name: all_of_them.part(slice(3 * i, 3 * i + 3)) for i, name in enumerate(readings)}
    off = {}
    for name, pair in pairs.items():
        by_path, by_twist, apart = pair.sizes
        off[name] = apart / max(by_path, by_twist, TINY)
    right = pairs[CHILD]
    by_path, by_twist, _ = right.sizes
    speed = max(by_path, by_twist, TINY)
    constant = (right.path - right.velocity).mean(axis=0)
    squares = max(float((right.velocity**2).sum()), TINY)
    factor = float((right.path * right.velocity).sum()) / squares
    return TwistFit(
        by_path,
        by_twist,
        right.noise,
        off,
        tuple(constant.tolist()),
        right._replace(path=right.path - constant).sizes[2] / speed,
        factor,
        right._replace(velocity=factor * right.velocity).sizes[2] / speed,
    )
