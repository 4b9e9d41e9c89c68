"""Measured motion and command of a vehicle, each at its own times, and segments of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.bag.tracks import Track, between_gaps, integral, jumps, usual_interval
from auv_analysis.metrics.local_polynomials import ORDER, SMALLEST, variance, weights, windows
from auv_dynamics.kernel.compile import plain
from auv_dynamics.ros.interface import NANOSECONDS, WRENCH
from auv_dynamics.vehicle.kinematics import attitude_rate
from auv_dynamics.vehicle.model import down

LONGEST_STEP, SHORTEST_STEP = 0.05, 0.002  # s, of the grid on which commands are held
SMOOTHING = 0.4  # s, window of the local polynomials from which states are read off
PAUSE = 0.5  # s without a measurement of something that end no stretch where no gap was told
SHORTEST = 1.0  # s of a record
ROUNDED = 1e-12  # m/s, rad/s, rad
FEW = 3  # jumps whose times are named
EVEN = 0.5  # of the mean interval: where all lie within, clocks jitter but no sample lacks


@dataclass(frozen=True, eq=False)
class Record:
    """Measured motion and commands, without gaps longer than `PAUSE`.

    Attributes
    ----------
    name : for people
    attitude_t, attitude : (a,) s, rising, and (a, 4) quaternions w, x, y, z from FSD to NED
    velocity_t, velocity : (v,) s and (v, 6) body velocity, m/s and rad/s; NaN: not measured
    step : s between commands
    command : (n, 6) wrench, N and N m, body frame, held from start + k step to start + (k + 1) step
    start : s, of the first command

    """

    name: str
    attitude_t: np.ndarray
    attitude: np.ndarray
    velocity_t: np.ndarray
    velocity: np.ndarray
    step: float
    command: np.ndarray
    start: float

    @property
    def end(self) -> float:
        """When the last command ends, s."""
        return self.start + self.step * len(self.command)

    @property
    def middles(self) -> np.ndarray:
        """(n,) s, in the middle of each command."""
        return self.start + self.step * (np.arange(len(self.command)) + 0.5)

    @property
    def known(self) -> np.ndarray:
        """(6,) whether a velocity is ever measured."""
        return np.isfinite(self.velocity).any(axis=0)

    def part(self, begin: float, end: float) -> 'Record':
        """The part from one time to another, s; commands keep their grid."""
        steps = (round((t - self.start) / self.step) for t in (begin, end))
        first, last = (min(max(step, 0), len(self.command)) for step in steps)
        keep = [(t >= begin) & (t <= end) for t in (self.attitude_t, self.velocity_t)]
        return Record(
            self.name, self.attitude_t[keep[0]], self.attitude[keep[0]],
            self.velocity_t[keep[1]], self.velocity[keep[1]], self.step,
            self.command[first:last], self.start + first * self.step,
        )  # fmt: skip

    def states(self, t: np.ndarray) -> np.ndarray:
        """Attitude and velocity (k, 10) at some times by local polynomials; NaN: not measured."""
        q = smoothed(self.attitude_t, continuous(self.attitude), t)
        nu = np.full((len(t), 6), np.nan)
        for i in np.flatnonzero(self.known):
            there = np.isfinite(self.velocity[:, i])
            nu[:, i] = smoothed(self.velocity_t[there], self.velocity[there, i : i + 1], t)[:, 0]
        return np.concatenate([q / np.linalg.norm(q, axis=1, keepdims=True), nu], axis=1)

    def evenly(self) -> np.ndarray:
        """Velocity (k, 6) at even times; NaN: not measured."""
        return self.states(np.arange(self.start, self.end, 0.1))[:, 4:]

    def noise(self) -> np.ndarray:
        """(9,) standard deviation of white noise: velocity, then attitude in rad; NaN: unknown."""
        found = np.full(9, np.nan)
        for i in np.flatnonzero(self.known):
            there = np.isfinite(self.velocity[:, i])
            if there.sum() > SMALLEST:
                rows = self.velocity_t[there], self.velocity[there, i : i + 1]
                found[i] = np.sqrt(variance([rows])[0])
        turned = small_rotation(self.states(self.attitude_t)[:, :4], self.attitude)
        found[6:] = np.sqrt(variance([(self.attitude_t, turned)]))
        return np.where(found > ROUNDED, found, np.nan)  # what stands still tells no noise


def of_tracks(name: str, tracks: Mapping[str, Track], role: str = WRENCH) -> list[Record]:
    """Records of the stretches of a bag that have attitude, velocity and command.

    Parameters
    ----------
    name : of the bag
    tracks : role -> signal in NED and FSD, as of `tracks_of`
    role : of the wrench, which was commanded or acted

    """
    pose, twist, command = tracks['pose'], tracks['twist'], tracks[role]
    origin = _origin(tracks, role)
    period = min(command.period, twist.period) / NANOSECONDS
    step = float(f'{np.clip(period, SHORTEST_STEP, LONGEST_STEP):.2g}')
    signals = [track.tolerant(PAUSE * NANOSECONDS) for track in (pose, twist, command)]
    seconds = [(track.ns - origin) / NANOSECONDS for track in signals]
    span = (max(int(track.ns[0]) for track in signals), min(int(track.ns[-1]) for track in signals))
    found = []
    for first, last in between_gaps(*span, signals):
        begin, end = ((ns - origin) / NANOSECONDS for ns in (first, last))
        ns = origin + np.round(np.arange(begin, end + step / 2, step) * NANOSECONDS).astype(
            np.int64
        )
        mean = np.diff(integral(command, ns), axis=0) / step
        inside = [(t >= begin) & (t <= end) for t in seconds[:2]]
        found.append(
            Record(
                name, seconds[0][inside[0]], pose.rows[inside[0], 3:], seconds[1][inside[1]],
                twist.rows[inside[1]], step, mean, begin,
            )
        )  # fmt: skip
    return long_enough(found)


def cut_at_jumps(
    tracks: Mapping[str, Track], role: str = WRENCH
) -> tuple[dict[str, Track], list[str]]:
    """Tracks whose attitude and velocity have a gap where either jumps, and a note on each.

    Parameters
    ----------
    tracks : role -> signal in NED and FSD, as of `tracks_of`
    role : of the wrench

    """
    found = {'attitude': jumps(tracks['pose']), 'velocity': jumps(tracks['twist'])}
    resets, notes = np.concatenate(list(found.values())), []
    for name, where in found.items():
        at = (np.unique(where[:, 1]) - _origin(tracks, role)) / NANOSECONDS
        times = ', '.join(f'{t:.4g}' for t in at[:FEW])
        later = ' and later' * (len(at) > FEW)
        if times:
            notes.append(f'the {name} jumps at {times} s{later}, as by a reset: cut there')
    cut = {name: replace(tracks[name], resets=resets) for name in ('pose', 'twist')}
    return {**tracks, **cut}, notes


def _origin(tracks: Mapping[str, Track], role: str) -> int:
    """When times of records begin, ns."""
    return int(min(tracks[name].ns[0] for name in ('pose', 'twist', role)))


def long_enough(records: Sequence[Record]) -> list[Record]:
    """Those of a second and more, with samples enough for local polynomials."""
    return [
        record for record in records
        if record.step * (len(record.command) + 0.5) > SHORTEST
        and min(len(record.attitude_t), len(record.velocity_t)) >= SMALLEST
    ]  # fmt: skip


def continuous(q: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) of the same attitudes whose signs do not jump."""
    flips = np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def smoothed(t: np.ndarray, rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (m, k) of local polynomials through (n, k) at rising times, at other times."""
    if len(t) < SMALLEST:
        return np.stack([np.interp(at, t, column) for column in rows.T], axis=1)
    count = int(np.clip(SMOOTHING / usual_interval(t), SMALLEST, len(t)))
    found = np.empty((len(at), rows.shape[1]))
    for here, near in windows(t, at, count):
        (w,) = weights(t, at[here], near, ORDER, rate=False)
        found[here] = np.einsum('mc,mck->mk', w, rows[near])
    return found


def small_rotation(q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Rotation (..., 3) in rad that leads from attitudes q (..., 4) to nearby p, body axes."""
    # component by component, each in one piece: half the time of strided ones
    w, x, y, z = np.ascontiguousarray(np.moveaxis(q, -1, 0))
    a, b, c, d = np.ascontiguousarray(np.moveaxis(p, -1, 0))
    sign = 2.0 * np.sign(w * a + x * b + y * c + z * d)
    turned = (
        w * b - x * a - y * d + z * c,
        w * c - y * a - z * b + x * d,
        w * d - z * a - x * c + y * b,
    )
    return np.stack([sign * part for part in turned], axis=-1)


def rotated(q: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Attitudes (..., 4) turned by small rotations (..., 3) in rad, body axes."""
    nu = (0.0, 0.0, 0.0, *np.moveaxis(by, -1, 0))  # for a second
    turned = q + np.stack(plain(attitude_rate)(tuple(np.moveaxis(q, -1, 0)), nu), axis=-1)
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def down_of(q: np.ndarray) -> np.ndarray:
    """Direction of gravity (..., 3) in the body frame."""
    return np.stack(plain(down)(tuple(np.moveaxis(q, -1, 0))), axis=-1)


@dataclass(frozen=True, eq=False)
class Segment:
    """A stretch that is simulated from a start of its own.

    Attributes
    ----------
    before : (p, 6) commands before it, for lag and delay
    command : (n, 6) commands, each held over a step
    at : (r,) times of the measurements in steps from the start
    nu, q : (r, 6) and (r, 4) measured; NaN: not measured then
    start : (10,) first guess of attitude and velocity there
    begin : s, of the record

    """

    before: np.ndarray
    command: np.ndarray
    at: np.ndarray
    nu: np.ndarray
    q: np.ndarray
    start: np.ndarray
    begin: float


def segments_of(record: Record, length: float, history: float) -> list[Segment]:
    """Segments of equal length, one after the other; what is left at the end joins none.

    Parameters
    ----------
    record : of a stretch
    length : s, of each
    history : s of commands before the first one

    """
    n = max(round(length / record.step), 2)
    before = int(np.ceil(history / record.step))
    firsts = np.arange(before, len(record.command) - n + 1, n)
    if not len(firsts):
        return []
    starts = record.states(record.start + record.step * firsts)
    starts = np.where(np.isfinite(starts), starts, 0.0)
    found = []
    for first, state in zip(firsts.tolist(), starts, strict=True):
        begin = record.start + first * record.step
        at, nu, q = _measured(record, begin, begin + n * record.step)
        if len(at):
            command = record.command[first : first + n]
            found.append(
                Segment(record.command[first - before : first], command,
                        (at - begin) / record.step, nu, q, state, begin)
            )  # fmt: skip
    return found


def _measured(record: Record, begin: float, end: float) -> tuple[np.ndarray, ...]:
    """Times, velocities and attitudes in (begin, end]; NaN where only the other one is there."""
    edges = [begin, end + 1e-9]
    keep = [slice(*np.searchsorted(t, edges, side='right').tolist())
            for t in (record.velocity_t, record.attitude_t)]  # fmt: skip
    t = np.union1d(record.velocity_t[keep[0]], record.attitude_t[keep[1]])
    nu, q = np.full((len(t), 6), np.nan), np.full((len(t), 4), np.nan)
    nu[np.searchsorted(t, record.velocity_t[keep[0]])] = record.velocity[keep[0]]
    q[np.searchsorted(t, record.attitude_t[keep[1]])] = record.attitude[keep[1]]
    return t, nu, q


def even_period(at: np.ndarray) -> float | None:
    """Mean interval of rising times (r,), their unit; None where one lacks or there is no other."""
    apart = np.diff(at)
    return float(apart.mean()) if len(apart) and np.ptp(apart) < EVEN * apart.mean() else None


def described(record: Record) -> dict[str, Any]:
    """Length, rates and size of what was measured, for `identify.json`."""
    nu = record.velocity
    known = record.known
    return {
        'name': record.name,
        'duration': record.end - record.start,
        'velocity_rate': (len(record.velocity_t) - 1) / float(np.ptp(record.velocity_t)),
        'attitude_rate': (len(record.attitude_t) - 1) / float(np.ptp(record.attitude_t)),
        'velocity_rms': [
            float(np.sqrt(np.nanmean(nu[:, i] ** 2))) if known[i] else None for i in range(6)
        ],
        'wrench_rms': np.sqrt((record.command**2).mean(axis=0)).tolist(),
    }
