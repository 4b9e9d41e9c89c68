"""Odometry of an ArduSub vehicle: its boot clock, and ATTITUDE with LOCAL_POSITION_NED.

Pose in NED, twist in FSD. ATTITUDE is of the primary estimator in every version, while
ATTITUDE_QUATERNION is missing in some and of the secondary one in others.
"""

from collections import deque
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.vehicle.kinematics import attitude_rate, quaternion, rotation

MILLISECOND = 1_000_000  # ns
ENOUGH = 5  # exchanges that agree before times are believed
KEPT = 32  # exchanges; at 1 Hz the two crystals part by less than a millisecond
JUMP = 50 * MILLISECOND  # by which an offset must differ to be another
APART = 100  # ms that the attitude may be older or newer than the position
RESTART = 1000  # ms that the boot time must fall back to mean a new boot


class RestartedError(RuntimeError):
    """The vehicle has been started anew."""


class Exchange(NamedTuple):
    """Request sent, answered at the vehicle, answer received; ns of the three moments' clocks."""

    sent: int
    remote: int
    received: int

    @property
    def round_trip(self) -> int:
        """Time on the way, ns."""
        return self.received - self.sent

    @property
    def offset(self) -> int:
        """Local time less boot time, ns; wrong by at most half the round trip."""
        return (self.sent + self.received) // 2 - self.remote

    def agrees(self, other: 'Exchange') -> bool:
        """Whether both may be of the same offset."""
        return abs(self.offset - other.offset) <= JUMP + (self.round_trip + other.round_trip) // 2


class BootClock:
    """Offset of the vehicle's boot clock, from the quickest of the last TIMESYNC exchanges.

    A single exchange of another offset changes nothing: a loaded computer gives such ones. Several
    that agree do: the vehicle has been started anew if its boot time is shorter than the time
    since it was last heard, and its clock has only stood still if it is longer.
    """

    def __init__(self) -> None:
        self._exchanges: deque[Exchange] = deque(maxlen=KEPT)
        self._others: list[Exchange] = []  # in a row, of another offset

    def reset(self) -> None:
        """Forget everything, as after a restart of the vehicle."""
        self._exchanges.clear()
        self._others = []

    def add(self, exchange: Exchange) -> None:
        """Take an exchange.

        Raises
        ------
        RestartedError : enough of them show that the vehicle has been started anew

        """
        best = self._best()
        if best is None or exchange.agrees(best):
            self._others.clear()
            self._exchanges.append(exchange)
            return
        self._others = [one for one in self._others if one.agrees(exchange)] + [exchange]
        if len(self._others) < ENOUGH:
            return
        last, others = self._exchanges[-1], self._others
        self.reset()
        if exchange.remote < exchange.received - last.received:
            raise RestartedError(f'boot time is {exchange.remote / 1e9:.1f} s')
        self._exchanges.extend(others)

    def local(self, boot_ns: int) -> int | None:
        """Steady local time in ns of a boot time, None until enough is known."""
        best = self._best()
        if best is None or len(self._exchanges) < ENOUGH:
            return None
        return boot_ns + best.offset

    @property
    def settled(self) -> bool:
        """Whether the offset is known and the last exchange agreed with it."""
        return len(self._exchanges) >= ENOUGH and not self._others

    @property
    def uncertainty(self) -> float | None:
        """Half the quickest round trip, s; None before the first exchange."""
        best = self._best()
        return None if best is None else best.round_trip / 2e9

    def _best(self) -> Exchange | None:
        return min(self._exchanges, key=lambda one: one.round_trip, default=None)


class Sample(NamedTuple):
    """Steady local time in ns, and position, quaternion w x y z, nu (13,)."""

    ns: int
    x: np.ndarray


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
        self._newest = {'ATTITUDE': -1, 'LOCAL_POSITION_NED': -1}

    def attitude(self, message: Any) -> None:
        """Take an ATTITUDE; ValueError: not finite."""
        angles = _finite(message, 'roll', 'pitch', 'yaw')
        rates = _finite(message, 'rollspeed', 'pitchspeed', 'yawspeed')
        if self._is_newer(message):
            self._attitude = message.time_boot_ms, quaternion(angles), rates

    def position(self, message: Any) -> Sample | None:
        """Sample of a LOCAL_POSITION_NED, None while attitude or time are not known.

        Raises
        ------
        ValueError : a number that is not finite
        RestartedError : the boot time went back

        """
        p, v = _finite(message, 'x', 'y', 'z'), _finite(message, 'vx', 'vy', 'vz')
        if not self._is_newer(message) or self._attitude is None:
            return None
        ms, (at, q, rates) = message.time_boot_ms, self._attitude
        local = self._clock.local(ms * MILLISECOND)
        if local is None or abs(ms - at) > APART:
            return None
        q = turned(q, rates, (ms - at) / 1000.0)
        return Sample(local, np.concatenate([p, q, rotation(q).T @ v, rates]))

    def _is_newer(self, message: Any) -> bool:
        what, ms = message.get_type(), message.time_boot_ms
        newest = self._newest[what]
        if ms + RESTART < newest:
            raise RestartedError(f'boot time fell back from {newest} ms to {ms} ms')
        if ms <= newest:  # a datagram that came twice, or late
            return False
        self._newest[what] = ms
        return True


def _finite(message: Any, *names: str) -> np.ndarray:
    values = np.array([getattr(message, name) for name in names])
    if not np.isfinite(values).all():
        found = dict(zip(names, values.tolist(), strict=True))
        raise ValueError(f'{message.get_type()}: expected finite numbers, found {found}')
    return values


def turned(q: np.ndarray, rates: np.ndarray, seconds: float) -> np.ndarray:
    """Attitude (4,) after a short time at body rates (3,) in rad/s."""
    angle = float(np.linalg.norm(rates)) * seconds / 2.0
    nu = np.concatenate([np.zeros(3), rates])
    slope = np.array(attitude_rate(q, nu)) * seconds
    return np.cos(angle) * q + np.sinc(angle / np.pi) * slope
