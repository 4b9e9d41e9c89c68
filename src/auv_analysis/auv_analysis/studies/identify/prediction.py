"""The honest test of a model: open-loop prediction of what it has not seen.

From many moments of a recording the model is simulated ahead under the recorded command, and its
velocity compared with the measured one after some times. Beside it stand persistence (the velocity
stays as it is) and a linear black box (no structure, only the recording that the model had too).
An error is measured by kinetic energy, sqrt(e^T M e / m) with M of the prior and m its surge
inertia, m/s: one number for metres and radians.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_analysis.studies.identify.output_error import OutputError
from auv_analysis.studies.identify.record import Record, Segment, down_of
from auv_analysis.studies.identify.residuals import ON_STEP
from auv_analysis.studies.identify.unknowns import Unknowns
from auv_dynamics.vehicle.vehicle import Vehicle

HORIZONS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)  # s
APART = 0.25  # s, between starts at least
MOST = 400  # starts
DIVERGED = 1e3  # m/s, rad/s: what an error is at most
DRAWS = 1000  # of the bootstrap
BLOCK, FEWEST = 5.0, 8  # s, of a block of starts that are drawn together; least number of them
LAGS = (0.0, 0.1, 0.2)  # s, of the command in the black box
BOX_STEP = 0.1  # s
RIDGE = 1e-3
SEED = 0


@dataclass(frozen=True, eq=False)
class Held:
    """Moments of recordings from which predictions start.

    Attributes
    ----------
    record, segments : of each stretch: the segments begin at its moments
    horizons : (h,) s
    measured : (starts, horizons, 6) velocities then, by local polynomials; NaN: unknown
    blocks : (starts,) number of the block of each moment

    """

    record: Sequence[Record]
    segments: Sequence[list[Segment]]
    horizons: np.ndarray
    measured: np.ndarray
    blocks: np.ndarray

    @property
    def count(self) -> int:
        """Number of moments."""
        return len(self.blocks)


def held_of(records: Sequence[Record], history: float) -> Held:
    """Moments of recordings, and horizons.

    A horizon longer than a fifth of all that is held out is left out, and one of which moments in
    less than a fifth of it are followed by as much of their recording.
    """
    lengths = np.array([record.end - record.start for record in records])
    total = float(lengths.sum())
    horizons = np.array(
        [h for h in HORIZONS
         if h <= total / 5 <= np.maximum(lengths - history - h, 0.0).sum()] or HORIZONS[:1]
    )  # fmt: skip
    reach = float(horizons[-1])
    spacing = max(APART, total / MOST)
    found, measured, blocks = [], [np.zeros((0, len(horizons), 6))], [np.zeros(0, int)]
    offset = 0
    for record in records:
        before = int(np.ceil(history / record.step))
        n = int(np.ceil(reach / record.step - ON_STEP))
        firsts = np.arange(before, len(record.command) - n, max(round(spacing / record.step), 1))
        begins = record.start + record.step * firsts
        some = []
        for first, begin, state in zip(firsts.tolist(), begins, record.states(begins), strict=True):
            command = record.command[first : first + n]
            times = horizons / record.step
            nan = np.full((len(horizons), 6), np.nan)
            some.append(
                Segment(record.command[first - before : first], command, times, nan,
                        np.full((len(horizons), 4), np.nan), np.where(np.isfinite(state), state, 0),
                        float(begin))
            )  # fmt: skip
        found.append(some)
        nu = record.states((begins[:, None] + horizons).ravel())[:, 4:]
        measured.append(nu.reshape(len(some), len(horizons), 6))
        number = ((begins - record.start) / min(BLOCK, total / FEWEST)).astype(int) + offset
        blocks.append(number)
        offset = int(number.max(initial=offset)) + 1
    return Held(records, found, horizons, np.concatenate(measured), np.concatenate(blocks))


def predict(held: Held, vehicle: Vehicle, unknowns: Unknowns, theta: np.ndarray) -> np.ndarray:
    """Errors of a model (starts, horizons, 6): predicted less measured; NaN: unknown."""
    found = []
    for record, segments in zip(held.record, held.segments, strict=True):
        if segments:
            model = OutputError(vehicle, segments, record.step, np.full(9, np.nan))
            z = np.zeros((len(segments), 9))
            states = [some[0] for _, _, some in model.runs(unknowns, theta, z)]
            nu = np.nan_to_num(np.concatenate(states)[..., 7:], nan=DIVERGED)
            found.append(_after(nu, held.horizons / record.step))
    return np.concatenate(found) - held.measured


def _after(rows: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Rows (S, h, 6) after numbers of steps from 1, by straight lines through those (S, n, 6)."""
    nearest = np.rint(steps)
    steps = np.where(np.abs(steps - nearest) < ON_STEP, nearest, steps)
    first = steps.astype(int) - 1
    share = (steps - 1 - first)[:, None]
    return rows[:, first] * (1.0 - share) + rows[:, np.ceil(steps).astype(int) - 1] * share


def persistence(held: Held) -> np.ndarray:
    """Errors, as of `predict`, of a velocity that stays as it is."""
    starts = np.concatenate([[one.start[4:] for one in some] for some in held.segments if some])
    return np.asarray(starts[:, None] - held.measured)


class BlackBox:
    """x(t + h) = A x(t) + B u: velocity and direction of gravity, the command now and before."""

    def __init__(self, records: Sequence[Record]):
        pairs = [self._pairs(record) for record in records]
        X = np.concatenate([pair[0] for pair in pairs])
        Y = np.concatenate([pair[1] for pair in pairs])
        self.scale = np.maximum(X.std(axis=0), 1e-9)
        self.scale[-1] = 1.0
        Z = X / self.scale
        ridge = RIDGE * len(Z) * np.eye(Z.shape[1])
        self.A = np.linalg.solve(Z.T @ Z + ridge, Z.T @ (Y - X[:, :9]))

    def _pairs(self, record: Record) -> tuple[np.ndarray, np.ndarray]:
        t = np.arange(record.start + LAGS[-1], record.end - BOX_STEP, BOX_STEP)
        state = self._state(record, np.append(t, t[-1] + BOX_STEP))
        return self._row(state[:-1], record, t), state[1:]

    def _state(self, record: Record, t: np.ndarray) -> np.ndarray:
        states = record.states(t)
        return np.concatenate([np.nan_to_num(states[:, 4:]), down_of(states[:, :4])], axis=1)

    def _row(self, state: np.ndarray, record: Record, t: np.ndarray) -> np.ndarray:
        inputs = [smoothed_command(record.middles, record.command, t - lag) for lag in LAGS]
        return np.concatenate([state, *inputs, np.ones((len(t), 1))], axis=1)

    def predict(self, held: Held) -> np.ndarray:
        """Its errors, as of `predict`."""
        found = []
        for record, segments in zip(held.record, held.segments, strict=True):
            t = np.array([one.begin for one in segments])
            x, path = self._state(record, t), []
            for k in range(round(float(held.horizons[-1]) / BOX_STEP)):
                x = x + self._row(x, record, t + k * BOX_STEP) / self.scale @ self.A
                x = np.clip(x, -1e6, 1e6)
                path.append(x[:, :6])
            found.append(_after(np.stack(path, axis=1), held.horizons / BOX_STEP))
        return np.asarray(np.concatenate(found) - held.measured)


def smoothed_command(t: np.ndarray, rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Commands (k, 6) at some times, the mean over a step of the black box."""
    area = np.concatenate([np.zeros((1, 6)), np.cumsum(rows, axis=0)]) * (t[1] - t[0])
    edges = np.append(t - (t[1] - t[0]) / 2, t[-1] + (t[1] - t[0]) / 2)
    ahead, behind = (
        np.stack([np.interp(at + shift, edges, column) for column in area.T], axis=1)
        for shift in (BOX_STEP, 0.0)
    )
    return (ahead - behind) / BOX_STEP


def sizes(errors: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Squared error (starts, horizons) by kinetic energy, (m/s)2; unknown velocities count not."""
    e = np.nan_to_num(np.clip(errors, -DIVERGED, DIVERGED), nan=0.0)
    return np.einsum('shi,ij,shj->sh', e, M, e) / M[0, 0]


def compare(errors: Mapping[str, np.ndarray], held: Held, M: np.ndarray) -> list[dict[str, Any]]:
    """Root mean square errors by horizon, and how the first differs from each of the others.

    Parameters
    ----------
    errors : name of a predictor -> its errors, as of `predict`
    held : what is predicted
    M : (6, 6) that weighs them

    Returns
    -------
    rows : `predictor`, `horizon` in s, `error` in m/s, `linear` in m/s and `angular` in rad/s,
        and of the others than the first `ratio`, the first's error by theirs, with `ratio_low` and
        `ratio_high`, its 95 % interval by a bootstrap over blocks of time

    """
    rng = np.random.default_rng(SEED)
    numbers, index = np.unique(held.blocks, return_inverse=True)
    picks = rng.integers(len(numbers), size=(DRAWS, len(numbers)))
    counts = np.stack([np.bincount(pick, minlength=len(numbers)) for pick in picks])
    sums = {
        name: np.stack([np.bincount(index, column) for column in sizes(e, M).T]).T
        for name, e in errors.items()
    }
    first, rows = next(iter(sums.values())), []
    for (name, e), own in zip(errors.items(), sums.values(), strict=True):
        with np.errstate(all='ignore'):
            drawn = counts @ first / np.maximum(counts @ own, 1e-300)
        for h, horizon in enumerate(held.horizons):
            low, high = np.sqrt(np.quantile(drawn[:, h], [0.025, 0.975]))
            ratio = np.sqrt(first[:, h].sum() / max(own[:, h].sum(), 1e-300))
            ratios = {'ratio': ratio, 'ratio_low': low, 'ratio_high': high}
            rows.append({
                'predictor': name,
                'horizon': float(horizon),
                'error': float(np.sqrt(own[:, h].sum() / held.count)),
                'linear': _rms(e[:, h, :3]),
                'angular': _rms(e[:, h, 3:]),
                **{k: None if own is first else float(v) for k, v in ratios.items()},
            })  # fmt: skip
    return rows


def _rms(e: np.ndarray) -> float | None:
    known = np.clip(e[np.isfinite(e)], -DIVERGED, DIVERGED)
    return float(np.sqrt((known**2).mean() * 3)) if len(known) else None


def by_name(rows: Sequence[Mapping[str, Any]], predictor: str) -> list[Mapping[str, Any]]:
    """Rows of one predictor, by rising horizon."""
    return [row for row in rows if row['predictor'] == predictor]
