"""Contradictions within a recording: axes, rates, delays, a wrench that is not there."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyfit
from scipy.integrate import cumulative_trapezoid

from auv_analysis.bag.foreign_topics import FROM_ATTITUDE, MOVING, TopicMap
from auv_analysis.bag.foreign_tracks import unknown_angles
from auv_analysis.bag.tracks import Track, at_times, between_gaps, integral
from auv_analysis.metrics.local_polynomials import SMALLEST, rates
from auv_analysis.metrics.pose_twist import (
    ANGULAR,
    CHILD,
    FITS,
    LINEAR,
    STILL,
    PoseTwist,
    RatePair,
    compare_rates,
    turn,
    turned,
)
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import rotation

WORSE = 2.0  # times: from here on the other reading fits clearly better
SMOOTH = 0.3  # s over which rates are fitted that are held against each other in time
SMOOTHER = 0.6, 1.0  # s, the same of a wrench: noise that the controller answers brings it forward
TOLD = 0.9  # of the acceleration that nothing else explains: what a wrench must explain of it
LEFT = 1e-4  # of the variance of the acceleration: less unexplained is the error of the filter
SEEN = 0.5  # of the variance of a rate: what a velocity must explain of it; noise explains none
FARTHEST, FINE = 1.0, 0.01  # s: delays that are tried, and between them
COARSE = 5  # times as far apart at first: what is compared is smooth over many times that
WIDE = 6  # times that: half of the parabola of a velocity; in a narrow one noise seems sharp
MOST = 8000  # samples that are looked at
PARTS = 20  # of the samples, by whose scatter the error of a delay is known
CLEAR = 3.0  # standard errors: a delay that is no chance
TINY = 1e-300
SHARP = 0.05  # s: standard error above which nothing is said


def contradictions(tracks: Mapping[str, Track], otherwise: Track, mapping: TopicMap) -> list[str]:
    """All notes on what a recording contradicts itself in, or what was told of it.

    Parameters
    ----------
    tracks : role -> signal in NED and FSD
    otherwise : the velocity if its twist_frame were the other one
    mapping : what was told

    """
    pose, twist = tracks['pose'], tracks['twist']
    linear = next((one.topic for one in (*twist.parts, twist) if one.given[:3].any()), '')
    frames = {one.topic: one.twist_frame for one in mapping.sources.values() if one.role in MOVING}
    frame = frames.get(linear, 'child')
    notes = doubts_of_wrench(tracks)
    if not unknown_angles(pose, mapping):
        if mapping.rates != FROM_ATTITUDE:
            notes = doubts_of_rates(pose, twist) + notes
        notes = [
            *doubts_of_motion(pose, twist, otherwise, frame),
            *notes,
            *delays(tracks, frame),
        ]
    return notes


def doubts_of_motion(pose: Track, twist: Track, other: Track, frame: str) -> list[str]:
    """Notes where the motion contradicts what was told of it.

    Parameters
    ----------
    pose, twist : in NED and FSD, as told
    other : the velocity if its twist_frame were the other one
    frame : the twist_frame as told

    """
    notes = []
    if np.all(pose.rows[:, 2] < 0):
        low, high = -pose.rows[:, 2].max(), -pose.rows[:, 2].min()
        notes.append(
            f'{pose.topic}: the position is {low:.3g} to {high:.3g} m above its origin throughout; '
            'if the vehicle was below it, the earth axes are not those that were told'
        )
    speed, told, otherwise = _misfits(pose, twist, other)
    if speed > STILL and told > WORSE * otherwise:
        right = 'world' if frame == 'child' else 'child'
        notes.append(
            f'{twist.topic}: with twist_frame {frame} the velocity differs from the rate of the '
            f'position by {told:.2g} m/s (RMS), with twist_frame {right} by {otherwise:.2g}: '
            f'{right} fits better'
        )
    return notes


def _misfits(pose: Track, *velocities: Track) -> tuple[float, ...]:
    """Speed by the position, and its difference from each velocity: RMS in m/s, noise taken off.

    Over the longest stretch without a gap; zeros where that is too short.
    """
    ns = _together(pose, velocities[0])
    if len(ns) < SMALLEST:
        return (0.0,) * (1 + len(velocities))
    at, t = at_times(pose, ns), (ns - ns[0]) / NANOSECONDS
    moved = [turn(at[:, 3:], at_times(velocity, ns)[:, :3]) for velocity in velocities]
    known = _measured(at[:, :3], *moved)
    pairs = [compare_rates(t, at[:, :3][:, known], velocity[:, known]) for velocity in moved]
    return pairs[0].sizes[0], *(pair.sizes[2] for pair in pairs)


def doubts_of_rates(pose: Track, twist: Track) -> list[str]:
    """A note where the angular velocity is not the rate of the attitude; per axis."""
    ns = _together(pose, twist)
    if len(ns) < SMALLEST:
        return []
    t, at = (ns - ns[0]) / NANOSECONDS, at_times(pose, ns)
    said = misread_rates(t, at[:, 3:], at_times(twist, ns)[:, 3:])
    if not said:
        return []
    return [
        f'{twist.topic}: the angular velocity is not the rate of the attitude of {pose.topic}, '
        f'RMS: {"; ".join(said)}; rates: from attitude in the map takes it from there'
    ]


def misread_rates(
    t: np.ndarray, attitude: np.ndarray, rates: np.ndarray, fits: float = FITS
) -> list[str]:
    """Axes in which an angular velocity is not the rate of the attitude, with both RMS.

    Parameters
    ----------
    t : (n,) s, rising, n at least `SMALLEST`
    attitude : (n, 4) quaternions w, x, y, z, FSD to NED
    rates : (n, 3) rad/s, body axes; NaN throughout in an axis: not measured
    fits : of the larger RMS: by how much the two may differ

    """
    pair = compare_rates(t, turned(attitude), rates)
    axes = np.flatnonzero(_measured(rates)).tolist()
    return [f'{DOFS[3 + i]} {text}' for i in axes if (text := _misread(pair, i, fits))]


def _measured(*rows: np.ndarray) -> np.ndarray:
    """Columns (k,) of signals (n, k) that none of them lacks."""
    return ~np.any([np.isnan(values).any(axis=0) for values in rows], axis=0)


def _misread(pair: RatePair, i: int, fits: float) -> str:
    """Statement on an axis where the two differ; '' where they do not."""
    one = pair.part(slice(i, i + 1))
    by_path, by_twist, apart = one.sizes
    size = max(by_path, by_twist)
    if size <= max(STILL, one.noise) or apart <= fits * size:
        return ''
    if not one.velocity.any():
        return f'0 throughout in place of {by_path:.2g} rad/s'
    flipped = one._replace(velocity=-one.velocity).sizes[2] <= fits * size
    how = 'with the other sign' if flipped else f'{apart:.2g} apart'
    return f'{by_twist:.2g} in place of {by_path:.2g} rad/s, {how}'


class Delay(NamedTuple):
    """Time, s, by which one signal is behind another, and its standard error."""

    value: float
    error: float

    def __str__(self) -> str:
        """As a note shows it."""
        return f'{self.value:.2f} ± {self.error:.2f} s'


def delays(tracks: Mapping[str, Track], frame: str) -> list[str]:
    """Notes on signals that are late, as far as the recording itself tells.

    Velocity against position, angular velocity against attitude; the wrench against the
    acceleration, by a regression that knows nothing of the vehicle.

    Parameters
    ----------
    tracks : 'pose' and 'twist', and 'wrench' and 'wrench_applied' where they are
    frame : the twist_frame as told

    """
    pose, twist = tracks['pose'], tracks['twist']
    notes = []
    ns = _together(pose, twist)[:MOST]
    if len(ns) >= SMALLEST:
        t, at, nu = (ns - ns[0]) / NANOSECONDS, at_times(pose, ns), at_times(twist, ns)
        motion = PoseTwist(t, at[:, :3], at[:, 3:], nu)
        # in the axes in which it was sent: to turn it takes the attitude of another time
        linear = LINEAR[CHILD](motion) if frame == 'world' else (motion.travelled, nu[:, :3])
        signals = {
            ('velocity', 'position'): linear,
            ('angular velocity', 'attitude'): ANGULAR[CHILD](motion),
        }
        for (late, early), (path, velocity) in signals.items():
            known = _measured(path, velocity)
            found = behind(t, path[:, known], velocity[:, known])
            if found:
                notes.append(
                    f'{twist.topic}: the {late} is {found} behind the {early} of {pose.topic}; '
                    'delay: in the map takes it off'
                )
    for role in ('wrench_applied', 'wrench'):
        if role in tracks:
            found = acts_behind(pose, twist, tracks[role])
            if found:
                notes.append(
                    f'{tracks[role].topic}: the wrench acts {found} behind its stamps, delay and '
                    'lag together; delay: in the map takes it off'
                )
            break
    return notes


def behind(t: np.ndarray, path: np.ndarray, velocity: np.ndarray) -> Delay | None:
    """Delay of a velocity (n, 3) behind the rate of its path (n, 3); None where it cannot be told.

    Both pass one filter; the delay is the one that leaves least of their difference.
    """
    if np.sqrt((velocity**2).sum(axis=1).mean()) < STILL:  # or nothing measured
        return None
    whole = cumulative_trapezoid(velocity, t, axis=0, initial=0.0)
    early, late = _rates(t, SMOOTH, path, whole)
    inside = (t > t[0] + FARTHEST) & (t < t[-1] - FARTHEST)
    if inside.sum() < PARTS or np.ptp(t[inside]) < PARTS * SMOOTH:  # within a filter all is one
        return None

    def left(delay: float) -> np.ndarray:
        moved = np.stack([np.interp(t[inside] + delay, t, column) for column in late.T], axis=1)
        return _sums(((early[inside] - moved) ** 2).sum(axis=1))

    found, least = _least(-FARTHEST, left, WIDE)
    varied = float(early[inside].var(axis=0).sum() * inside.sum())
    return None if least > (1.0 - SEEN) * varied else _clear(found)


def acts_behind(pose: Track, twist: Track, wrench: Track) -> Delay | None:
    """Delay of a wrench behind its stamps; None where it cannot be told.

    The acceleration is regressed on the wrench of an earlier time and on all that (1) has beside
    it: velocities, their products and squares with sign, and the direction of gravity, all
    through one filter. No number of the vehicle is needed. The error holds what another filter
    changes: a controller that answers noise brings the wrench forward, a shorter one more so.
    """
    ns = _together(twist, wrench)[:MOST]
    if len(ns) < 10 * PARTS:
        return None
    t, nu = (ns - ns[0]) / NANOSECONDS, at_times(twist, ns)
    nu = nu[:, _measured(nu)]
    tau, force = integral(wrench, ns), at_times(wrench, ns)
    tau = tau[:, force.std(axis=0) > 0]
    if not (tau.size and nu.size):
        return None
    down = rotation(at_times(pose, ns)[:, 3:])[:, 2]
    i, j = np.triu_indices(nu.shape[1])
    beside = np.concatenate([nu, nu * np.abs(nu), nu[:, i] * nu[:, j], down], axis=1)
    whole = cumulative_trapezoid(beside, t, axis=0, initial=0.0)
    first, second = (_acts_behind(t, nu, tau, whole, seconds) for seconds in SMOOTHER)
    if first is None or second is None:
        return None
    return _clear(Delay(first.value, float(np.hypot(first.error, second.value - first.value))))


def _acts_behind(
    t: np.ndarray, nu: np.ndarray, tau: np.ndarray, whole: np.ndarray, seconds: float
) -> Delay | None:
    """By one filter, in s: velocities (n, k), integrals of the wrench and of what is beside it."""
    nu_dot, tau, beside = _rates(t, seconds, nu, tau, whole)
    inside = (t > t[0] + FARTHEST) & (t < t[-1] - FARTHEST)
    if inside.sum() < 10 * PARTS:
        return None
    scale = nu_dot[inside].std(axis=0)
    known = np.column_stack([beside[inside], np.ones(inside.sum())])
    Q = np.linalg.svd(known / np.maximum(np.abs(known).max(axis=0), TINY), full_matrices=False)[0]

    def rest(values: np.ndarray) -> np.ndarray:
        return values - Q @ (Q.T @ values)

    y = rest(nu_dot[inside] / np.where(scale > 0, scale, 1.0))
    if (y**2).mean() < LEFT:
        return None

    def left(delay: float) -> np.ndarray:
        X = rest(np.stack([np.interp(t[inside] - delay, t, column) for column in tau.T], axis=1))
        X = X / np.maximum(np.abs(X).max(axis=0), TINY)
        return _sums(((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2).sum(axis=1))

    found, least = _least(-FARTHEST / 2, left, 1)
    return None if least > (1.0 - TOLD) * (y**2).sum() else found


def _rates(t: np.ndarray, seconds: float, *signals: np.ndarray) -> list[np.ndarray]:
    """Rates of signals (n, k) by one filter, in s, whose weights are found once."""
    count = max(2 * round(seconds / float(np.median(np.diff(t))) / 2) + 1, SMALLEST)
    found = rates(t, np.concatenate(signals, axis=1), t, count, bias=False).rate
    return np.split(found, np.cumsum([one.shape[1] for one in signals])[:-1], axis=1)


def _sums(squares: np.ndarray) -> np.ndarray:
    """Sums (PARTS,) of squares (n,) over parts of the time."""
    return np.array([part.sum() for part in np.array_split(squares, PARTS)])


def _least(
    first: float, left: Callable[[float], np.ndarray], wide: int
) -> tuple[Delay | None, float]:
    """The delay that leaves least, and how much; None at the edge of those that are tried.

    It is that of a parabola through what is left around it. Its error is that of an M-estimate, by
    the scatter of the parts' derivatives.

    Parameters
    ----------
    first : the earliest delay, s; `FARTHEST` is the latest
    left : what a delay leaves (PARTS,) in each part of the time
    wide : half of the parabola, in `COARSE`

    """

    @cache
    def at(k: int) -> np.ndarray:
        return left(first + k * FINE)

    def total(k: int) -> float:
        return float(at(k).sum())

    last = round((FARTHEST - first) / FINE)
    near = min(range(0, last + 1, COARSE), key=total)
    k = min(range(max(near - COARSE, 0), min(near + COARSE, last) + 1), key=total)
    half = min(wide, k // COARSE, (last - k) // COARSE)
    if not half:
        return None, total(k)
    around = COARSE * np.arange(-half, half + 1)
    _, slope, curve = polyfit(FINE * around, [at(k + j) for j in around.tolist()], 2)
    curvature = 2.0 * float(curve.sum())
    if curvature <= 0.0:
        return None, total(k)
    beside = -float(slope.sum()) / curvature
    slopes = slope + 2.0 * beside * curve
    error = float(np.sqrt((slopes**2).sum())) / curvature
    return Delay(first + k * FINE + beside, error), total(k)


def _clear(delay: Delay | None) -> Delay | None:
    """A delay that is no chance and sharp enough to be told."""
    if delay is None:
        return None
    told = abs(delay.value) > max(CLEAR * delay.error, 2.0 * FINE) and delay.error < SHARP
    return delay if told else None


def doubts_of_wrench(tracks: Mapping[str, Track]) -> list[str]:
    """A note on every wrench that is zero throughout."""
    return [
        f'{track.topic}: every {role.replace("_", " ")} is zero, so that all of the motion is left '
        'unexplained'
        for role, track in tracks.items()
        if role in ('wrench', 'wrench_applied') and not track.rows.any()
    ]


def _together(one: Track, other: Track) -> np.ndarray:
    """Stamps (n,) of one signal in the longest time without a gap of either, ns."""
    span = max(one.ns[0], other.ns[0]), min(one.ns[-1], other.ns[-1])
    begin, end = max(between_gaps(*span, (one, other)), key=np.ptp, default=span)
    return one.ns[(one.ns >= begin) & (one.ns <= end)]
