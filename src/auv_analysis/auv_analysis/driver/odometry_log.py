"""Odometry as it was heard: a buffer that takes messages, a log of arrays that is judged."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from auv_dynamics.ros.interface import NANOSECONDS

NONE = np.zeros(0, np.int64)
NO_STAMP = -1  # ns: in place of what the controller takes for none
HUGE = 1e30  # no vehicle's, and powers and sums of it are finite
State = tuple[float, ...]


def _states(rows: Iterable[State]) -> np.ndarray:
    """States (n, 13) with finite numbers within HUGE."""
    x = np.array([*rows], float).reshape(-1, 13)
    return np.clip(x, -HUGE, HUGE, out=x, where=np.isfinite(x))


@dataclass(frozen=True, eq=False)
class OdometryLog:
    """Odometry of a window of time; n messages in the order of their arrival.

    Attributes
    ----------
    began_ns, ended_ns : the window, of this machine's clock
    arrived_ns, stamp_ns : (n,) time of arrival by that clock, and header.stamp, or NO_STAMP
    published_ns : (n,) when it was published, by the clock of its publisher
    x : (n, 13) position in m, quaternion w, x, y, z, velocity in m/s and rad/s, as they were sent,
        but finite numbers within HUGE
    frames : (header.frame_id, child_frame_id) -> in how many messages
    lost : messages that were numbered but did not arrive
    unreadable : topic -> how many messages were none of its type
    clock_arrived_ns, clock_ns : (c,) of /clock
    applied_arrived_ns, applied : (m,) and (m, 6) of wrench_applied, N and N m

    """

    began_ns: int
    ended_ns: int
    arrived_ns: np.ndarray
    stamp_ns: np.ndarray
    published_ns: np.ndarray
    x: np.ndarray
    frames: Mapping[tuple[str, str], int] = field(default_factory=dict)
    lost: int = 0
    clock_arrived_ns: np.ndarray = field(default_factory=NONE.copy)
    clock_ns: np.ndarray = field(default_factory=NONE.copy)
    applied_arrived_ns: np.ndarray = field(default_factory=NONE.copy)
    applied: np.ndarray = field(default_factory=lambda: np.zeros((0, 6)))
    unreadable: Mapping[str, int] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        """Length of the window, s."""
        return (self.ended_ns - self.began_ns) / NANOSECONDS

    @property
    def finite(self) -> np.ndarray:
        """Mask (n,) of the messages that have finite numbers only."""
        return np.isfinite(self.x).all(axis=1)


class OdometryBuffer:
    """Takes what arrives, message by message."""

    def __init__(self) -> None:
        self._odometry: list[tuple[int, int, int, State]] = []
        self._frames: Counter[tuple[str, str]] = Counter()
        self._clock: list[tuple[int, int]] = []
        self._applied: list[tuple[int, State]] = []
        self._number: int | None = None
        self._lost = 0
        self._unreadable: Counter[str] = Counter()

    def __len__(self) -> int:
        return len(self._odometry)

    @property
    def newest(self) -> tuple[int, int] | None:
        """Arrival and stamp of the last odometry, ns."""
        return self._odometry[-1][:2] if self._odometry else None

    def recent(self, count: int) -> np.ndarray:
        """States (up to count, 13) of the last messages."""
        return _states(row[-1] for row in self._odometry[-count:])

    def odometry(
        self,
        arrived: int,
        stamp: int,
        published: int,
        x: State,
        frames: tuple[str, str],
        number: int | None,
    ) -> None:
        """Take an odometry; `number` is the middleware's, of its publisher."""
        self._odometry.append((arrived, stamp, published, x))
        self._frames[frames] += 1
        self._follow(number)

    def unreadable(self, topic: str, number: int | None) -> None:
        """Take bytes that are no message; `number` as of an odometry."""
        self._unreadable[topic] += 1
        self._follow(number)

    def _follow(self, number: int | None) -> None:
        if number is not None:
            if self._number is not None and number > self._number:
                self._lost += number - self._number - 1
            self._number = number

    def clock(self, arrived: int, ns: int) -> None:
        """Take a simulated time."""
        self._clock.append((arrived, ns))

    def wrench_applied(self, arrived: int, tau: State) -> None:
        """Take a wrench that the actuators delivered."""
        self._applied.append((arrived, tau))

    def log(self, began_ns: int, ended_ns: int) -> OdometryLog:
        """All that was taken, as the log of a window."""
        *times, states = zip(*self._odometry, strict=True) if self else ((), (), (), ())
        arrived, stamps, published = np.array(times, np.int64)
        clock = np.array(self._clock, np.int64).reshape(-1, 2)
        return OdometryLog(
            began_ns,
            ended_ns,
            arrived,
            stamps,
            published,
            _states(states),
            dict(self._frames),
            self._lost,
            clock[:, 0],
            clock[:, 1],
            np.array([ns for ns, _ in self._applied], np.int64),
            np.array([tau for _, tau in self._applied], float).reshape(-1, 6),
            dict(self._unreadable),
        )
