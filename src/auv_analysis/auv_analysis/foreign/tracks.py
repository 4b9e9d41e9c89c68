"""Signals over a common clock: their gaps, and their values between the samples."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from auv_dynamics.ros.interface import NANOSECONDS

GAP_PERIODS = 5.0  # median periods, at least, that make a pause a gap
GAP_USUAL = 3.0  # times the interval that nine of ten keep: some topics come in bursts
USUAL = 90.0  # percentile
AVERAGED = 1.5  # periods per step of the time base from which a signal is averaged over the step


@dataclass(frozen=True, eq=False)
class Track:
    """A signal in our axes, with rising stamps.

    Attributes
    ----------
    role, topic : what it holds, where it comes from
    ns : (n,) stamps, ns
    rows : (n, k) numbers
    limit : ns, longest pause that is no gap; inf: there are none
    held : whether a sample holds until the next; else a straight line leads there

    """

    role: str
    topic: str
    ns: np.ndarray
    rows: np.ndarray
    limit: float
    held: bool

    @property
    def period(self) -> float:
        """Median period, ns; inf of a single sample."""
        return float(np.median(np.diff(self.ns))) if len(self.ns) > 1 else np.inf

    def gaps(self) -> np.ndarray:
        """Begin and end of each gap, (g, 2) ns."""
        where = np.flatnonzero(np.diff(self.ns) > self.limit)
        return np.stack([self.ns[where], self.ns[where + 1]], axis=1)

    def is_averaged(self, step: int) -> bool:
        """Whether several samples fall into one step, ns, so that single ones would alias."""
        return step > AVERAGED * self.period


def usual_limit(ns: np.ndarray) -> float:
    """Longest pause that is no gap, by the intervals of rising stamps (n,), ns."""
    if len(ns) < 2:
        return np.inf
    apart = np.diff(ns)
    return float(max(GAP_PERIODS * np.median(apart), GAP_USUAL * np.percentile(apart, USUAL)))


def at_times(track: Track, ns: np.ndarray) -> np.ndarray:
    """Values (m, k) at times within a track, ns.

    Of a pose, position by straight lines and attitude by slerp; of what is held, the sample before;
    else straight lines.
    """
    seconds, at = (_seconds(times, track.ns[0]) for times in (track.ns, ns))
    if track.held:
        return track.rows[np.clip(np.searchsorted(track.ns, ns, 'right') - 1, 0, None)]
    if track.role != 'pose':
        return _lines(seconds, track.rows, at)
    at = np.clip(at, seconds[0], seconds[-1])
    w, *xyz = track.rows[:, 3:].T
    turned = Slerp(seconds, Rotation.from_quat(np.stack([*xyz, w], axis=1)))(at).as_quat()
    attitude = turned[:, [3, 0, 1, 2]]
    return np.concatenate([_lines(seconds, track.rows[:, :3], at), attitude], axis=1)


def means_over(track: Track, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Means (m, k) over spans of time [begin, end] within a track, ns, of what is between samples.

    Of a pose the value in the middle: attitudes have no mean of this kind.
    """
    if track.role == 'pose':
        return at_times(track, (begin + end) // 2)
    area = integral(track, np.concatenate([begin, end]))
    length = (end - begin)[:, None] / NANOSECONDS
    return (area[len(begin) :] - area[: len(begin)]) / length


def integral(track: Track, ns: np.ndarray) -> np.ndarray:
    """Integral over time (m, k) of a signal from its first sample to some times, unit times s."""
    knots = np.unique(np.concatenate([track.ns, ns]))
    values = at_times(track, knots)
    dt = np.diff(knots)[:, None] / NANOSECONDS
    parts = values[:-1] * dt if track.held else 0.5 * (values[:-1] + values[1:]) * dt
    area = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(parts, axis=0)])
    return area[np.searchsorted(knots, ns)] - area[np.searchsorted(knots, track.ns[0])]


def _seconds(ns: np.ndarray, origin: int) -> np.ndarray:
    return (ns - origin) / NANOSECONDS


def _lines(seconds: np.ndarray, rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(at, seconds, column) for column in rows.T], axis=1)
