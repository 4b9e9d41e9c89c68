"""Odometry from ATTITUDE_QUATERNION and LOCAL_POSITION_NED: pose in NED, twist in FSD."""

import math
from typing import Any, NamedTuple

import numpy as np
from boot_clock import BootClock

from auv_dynamics.vehicle.kinematics import attitude_rate, rotation

MILLISECOND = 1_000_000  # ns
APART = 100  # ms that the attitude may be older or newer than the position
RESTART = 1000  # ms that the boot time must fall back to mean a new boot
NORM = 1e-3  # by which a quaternion's norm may differ from 1


class Sample(NamedTuple):
    """Steady local time in ns, and position, quaternion w x y z, nu (13,)."""

    ns: int
    x: np.ndarray


class RestartedError(RuntimeError):
    """The vehicle's boot time went back: it has been started anew."""


class Navigation:
    """Pairs attitude and position by their boot times; each gives a sample at most once.

    Parameters
    ----------
    clock : from boot time to local time

    """

    def __init__(self, clock: BootClock):
        self._clock = clock
        self.reset()

    def reset(self) -> None:
        """Forget what the vehicle has said; local time goes on."""
        self._attitude: tuple[int, np.ndarray, np.ndarray] | None = None
        self._newest = {'attitude': -1, 'position': -1}

    def attitude(self, message: Any) -> None:
        """Take an ATTITUDE_QUATERNION; ValueError: not finite, or no unit quaternion."""
        q = np.array([message.q1, message.q2, message.q3, message.q4])
        rates = np.array([message.rollspeed, message.pitchspeed, message.yawspeed])
        norm = float(np.linalg.norm(q))
        if not (np.isfinite(rates).all() and abs(norm - 1.0) <= NORM):
            raise ValueError(
                f'ATTITUDE_QUATERNION: expected a unit quaternion and finite rates, found norm '
                f'{norm:g} and {rates.tolist()}'
            )
        if self._is_newer('attitude', message.time_boot_ms):
            self._attitude = message.time_boot_ms, q / norm, rates

    def position(self, message: Any) -> Sample | None:
        """Sample of a LOCAL_POSITION_NED, None while attitude or time are not known.

        Raises
        ------
        ValueError : a number that is not finite
        RestartedError : the boot time went back

        """
        p = np.array([message.x, message.y, message.z])
        v = np.array([message.vx, message.vy, message.vz])
        if not (np.isfinite(p).all() and np.isfinite(v).all()):
            found = [*p.tolist(), *v.tolist()]
            raise ValueError(f'LOCAL_POSITION_NED: expected finite numbers, found {found}')
        ms = message.time_boot_ms
        if not self._is_newer('position', ms) or self._attitude is None:
            return None
        at, q, rates = self._attitude
        local = self._clock.local(ms * MILLISECOND)
        if local is None or abs(ms - at) > APART:
            return None
        q = turned(q, rates, (ms - at) / 1000.0)
        return Sample(local, np.concatenate([p, q, rotation(q).T @ v, rates]))

    def _is_newer(self, what: str, ms: int) -> bool:
        newest = self._newest[what]
        if ms + RESTART < newest:
            raise RestartedError(f'boot time fell back from {newest} ms to {ms} ms')
        if ms <= newest:  # a datagram that came twice, or late
            return False
        self._newest[what] = ms
        return True


def turned(q: np.ndarray, rates: np.ndarray, seconds: float) -> np.ndarray:
    """Attitude (4,) after a short time at body rates (3,) in rad/s."""
    angle = float(np.linalg.norm(rates)) * seconds / 2.0
    nu = np.concatenate([np.zeros(3), rates])
    slope = np.array(attitude_rate(q, nu)) * seconds
    size = math.sin(angle) / angle if angle else 1.0
    return math.cos(angle) * q + size * slope
