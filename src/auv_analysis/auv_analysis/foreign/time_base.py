"""The common time base: equal steps where every signal is known, nothing in between."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from auv_analysis.foreign.tracks import Track
from auv_dynamics.ros.interface import NANOSECONDS

ENOUGH = 12  # velocity samples of a stretch, fewer are left out: no rate could be estimated


@dataclass(frozen=True, eq=False)
class TimeBase:
    """Where a run has samples.

    Attributes
    ----------
    ns : (n,) times of the samples; multiples of the step apart
    step : ns
    stretches : (begin, end) in ns of each part of the recording without a gap
    owner : (n,) number of the stretch of each sample
    left_out : number of stretches too short to be of use

    """

    ns: np.ndarray
    step: int
    stretches: list[tuple[int, int]]
    owner: np.ndarray
    left_out: int

    @property
    def t(self) -> np.ndarray:
        """(n,) times from the first sample, s."""
        return (self.ns - self.ns[0]) / NANOSECONDS

    def spans(self) -> tuple[tuple[float, float], ...]:
        """Gaps between the samples: last time before and first behind each, s from the start."""
        t = self.t
        where = np.flatnonzero(np.diff(self.ns) > self.step).tolist()
        return tuple((float(t[i]), float(t[i + 1])) for i in where)


def sensible_step(period: float) -> int:
    """A median period, ns, rounded to two digits."""
    return max(round(float(f'{period:.2g}')), 1)


def time_base(tracks: Sequence[Track], velocity: Track, step: int) -> TimeBase:
    """Time base of signals that must all be known.

    Parameters
    ----------
    tracks : the signals, the velocity included
    velocity : that of which every stretch needs samples
    step : ns

    Returns
    -------
    base : without samples where there is no stretch

    """
    begin = max(int(track.ns[0]) for track in tracks)
    ends = [int(track.ns[-1]) for track in tracks if np.isfinite(track.limit)]
    stretches, left_out = [], 0
    for first, last in _between_gaps(begin, min(ends), tracks):
        inside = np.searchsorted(velocity.ns, [first, last + 1])
        if inside[1] - inside[0] >= ENOUGH:
            stretches.append((first, last))
        else:
            left_out += 1
    half = step // 2 if any(track.is_averaged(step) for track in tracks) else 0
    origin = stretches[0][0] + half if stretches else 0
    parts, kept = [], []
    for first, last in stretches:
        k = np.arange(-(-(first + half - origin) // step), (last - half - origin) // step + 1)
        if len(k) > 1:
            parts.append(origin + step * k.astype(np.int64))
            kept.append((first, last))
        else:
            left_out += 1
    owner = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    ns = np.concatenate([np.zeros(0, np.int64), *parts])
    return TimeBase(ns, step, kept, owner, left_out)


def _between_gaps(begin: int, end: int, tracks: Sequence[Track]) -> list[tuple[int, int]]:
    """Parts of a span, ns, that no gap of any signal overlaps."""
    gaps = np.concatenate([track.gaps() for track in tracks])
    gaps = gaps[np.argsort(gaps[:, 0])]
    found, place = [], begin
    for first, last in gaps.tolist():
        if min(first, end) > place:
            found.append((place, min(first, end)))
        place = max(place, last)
    if end > place:
        found.append((place, end))
    return found
