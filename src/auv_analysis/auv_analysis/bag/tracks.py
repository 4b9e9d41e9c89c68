"""Signals over time with gaps, their values at any times, and a common time base."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.spatial.transform import Rotation, Slerp

from auv_analysis.bag.foreign_fields import COMPONENTS
from auv_analysis.metrics.local_polynomials import SMALLEST
from auv_analysis.metrics.pose_twist import turned
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import NANOSECONDS

BURST = 0.2  # of the mean interval: shorter ones are those of a burst
AVERAGED = 1.5  # intervals per step of the time base from which a signal is averaged over the step
JUMP = 0.02  # rad, m/s, rad/s between two samples: less is none
BEYOND, NEARBY = 4.0, 2.0  # times the largest other change within s: less is none
QUICK = 0.25  # s between samples that show a jump
ENOUGH = 12  # velocity samples of a stretch, fewer are left out: no rate could be estimated


def usual_interval(times: np.ndarray, limit: float = np.inf) -> float:
    """Median interval of rising times (n,), in bursts the mean one; inf of a single time.

    A gap counts as an interval of `limit`.
    """
    if len(times) < 2:
        return np.inf
    apart = np.diff(times)
    median, mean = float(np.median(apart)), float(np.minimum(apart, limit).mean())
    return mean if median < BURST * mean else median


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
    parts : signals of the topics that it is made of, NaN in columns that these do not have
    told : whether the limit was told rather than found
    resets : (r, 2) ns, between which the signal begins anew, which is a gap

    """

    role: str
    topic: str
    ns: np.ndarray
    rows: np.ndarray
    limit: float
    held: bool
    parts: tuple['Track', ...] = ()
    told: bool = False
    resets: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))

    @property
    def given(self) -> np.ndarray:
        """(k,) whether there are numbers in a column."""
        return ~np.isnan(self.rows).all(axis=0)

    @property
    def period(self) -> float:
        """Median interval, in bursts the mean one between gaps, ns; inf of a single sample."""
        return usual_interval(self.ns, self.limit)

    def gaps(self) -> np.ndarray:
        """Begin and end of each gap, of any of its topics, (g, 2) ns."""
        if self.parts:
            return np.concatenate([self.resets, *(part.gaps() for part in self.parts)])
        where = np.flatnonzero(np.diff(self.ns) > self.limit)
        return np.concatenate([self.resets, np.stack([self.ns[where], self.ns[where + 1]], axis=1)])

    def tolerant(self, pause: float) -> 'Track':
        """The same with no gap up to a pause, ns, in topics whose limit nobody told."""
        limit = self.limit if self.told else max(self.limit, pause)
        return replace(self, limit=limit, parts=tuple(one.tolerant(pause) for one in self.parts))

    def is_averaged(self, step: int) -> bool:
        """Whether several samples fall into one step, ns, so that single ones would alias."""
        return len(self.ns) > 1 and step > AVERAGED * float(np.median(np.diff(self.ns)))


def at_times(track: Track, ns: np.ndarray) -> np.ndarray:
    """Values (m, k) at times within a track, ns.

    Of a pose, position by straight lines and attitude by slerp; of what is held, the sample before;
    else straight lines.
    """
    seconds, at = ((times - track.ns[0]) / NANOSECONDS for times in (track.ns, ns))
    if track.held:
        return track.rows[np.clip(np.searchsorted(track.ns, ns, 'right') - 1, 0, None)]
    if track.role != 'pose' or not track.given[-1]:
        return _lines(seconds, track.rows, at)
    at = np.clip(at, seconds[0], seconds[-1])
    w, *xyz = track.rows[:, 3:].T
    slerp = Slerp(seconds, Rotation.from_quat(np.stack([*xyz, w], axis=1)))
    attitude = slerp(at).as_quat()[:, [3, 0, 1, 2]]
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


def _lines(seconds: np.ndarray, rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(at, seconds, column) for column in rows.T], axis=1)


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
    """A period, ns, rounded to two digits."""
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
    for first, last in between_gaps(begin, min(ends), tracks):
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


def between_gaps(begin: int, end: int, tracks: Sequence[Track]) -> list[tuple[int, int]]:
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


def jumps(track: Track) -> np.ndarray:
    """Stamps (r, 2), ns, between which an attitude, or another column, changes as never nearby.

    What the motion around it tells is taken off. Noise, kinks and quanta recur within seconds, and
    what one sample is off by the next one takes back. Where a column repeats its values, only its
    changes are looked at. Over a long interval a vehicle itself may do what looks like a jump.
    """
    found = [np.zeros((0, 2), np.int64)]
    for column in (turned(track.rows[:, 3:]) if track.role == 'pose' else track.rows).T:
        there = np.isfinite(column)
        change, times = np.diff(column[there]), track.ns[there]
        moved = np.flatnonzero(change)
        apart = np.stack([times[moved], times[moved + 1]], axis=1)
        change, period = change[moved], usual_interval(apart[:, 1] / NANOSECONDS)
        if period > QUICK:
            continue
        length = np.maximum(np.ptp(apart, axis=1) / NANOSECONDS, period)
        quantum = np.quantile(np.abs(change), 0.1) if len(moved) < there.sum() - 1 else 0.0
        change = np.abs(change - median_filter(change / length, SMALLEST) * length)
        half = int(np.clip(NEARBY / 2 / period, SMALLEST // 2, len(change)))  # on either side
        largest = maximum_filter1d(np.pad(change, half + 1), 2 * half + 1)
        near = np.maximum(np.maximum(largest[: len(change)], largest[2 * half + 2 :]), quantum)
        allowed = np.maximum(BEYOND * near * length / period, JUMP)
        found.append(apart[(change > allowed) & (length < QUICK)])
    return np.concatenate(found)


def assembled(parts: Sequence[Track], bag: Path) -> Track:
    """One signal of a role out of several topics, each of which has some of its columns.

    Commands have the stamps of all of them; measurements those of the topic with the longest
    period (a pose those of its attitude), over which the others are averaged.

    Parameters
    ----------
    parts : in our axes; a single one is returned as it is
    bag : for refusals

    Raises
    ------
    InputError : two topics with the same column

    """
    first = parts[0]
    if len(parts) == 1:
        return first
    for i, part in enumerate(parts):
        for other in parts[:i]:
            both = np.flatnonzero(part.given & other.given)
            if len(both):
                name = COMPONENTS[part.role][both[0]]
                found = f'{name} in {other.topic} and in {part.topic}'
                raise InputError(bag, part.role, 'each component from one topic', found)
    topics = ' and '.join(dict.fromkeys(part.topic for part in parts))
    with_attitude = [part for part in parts if part.role == 'pose' and part.given[-1]]
    base = max(with_attitude or parts, key=lambda part: part.period)
    ns = np.unique(np.concatenate([part.ns for part in parts])) if first.held else base.ns
    step = 0 if first.held else round(base.period)
    begin = max(int(part.ns[0]) + (step // 2) * part.is_averaged(step) for part in parts)
    ends = [
        int(part.ns[-1]) - (step // 2) * part.is_averaged(step)
        for part in parts if np.isfinite(part.limit)
    ]  # fmt: skip
    ns = ns[(ns >= begin) & (ns <= min(ends, default=ns[-1]))]
    if not len(ns):
        expected = f'a time with {topics}'
        raise InputError(bag, first.role, expected, 'none')
    rows = np.full((len(ns), first.rows.shape[1]), np.nan)
    for part in parts:
        if part.is_averaged(step) and part is not base:
            values = means_over(part, ns - step // 2, ns + step // 2)
        else:
            values = at_times(part, ns)
        rows[:, part.given] = values[:, part.given]
    return Track(first.role, topics, ns, rows, base.limit, first.held, tuple(parts))
