"""Output error: the model alone is simulated along segments, and its misfit made small.

Each segment has a start of its own, nine unknowns that only it depends on (multiple shooting).
Segments are simulated in batches and added up to normal equations of theta; of each one there
remain only those of its start, four kilobytes: memory hardly grows with the recording. Levenberg
and Marquardt's method on them takes the place of `scipy.optimize.least_squares`, which needs the
whole Jacobian at once; both find the same minimum.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import t as student

from auv_analysis.simulation.open_loop import open_loop
from auv_analysis.studies.identify.record import Segment, rotated, small_rotation
from auv_analysis.studies.identify.unknowns import Unknowns
from auv_dynamics.vehicle.vehicle import Vehicle

STEP = 3e-7  # of theta, for derivatives: as much truncated as rounded
CERTAIN, UNSEEN = 10.0, 0.3  # of starts: deviations of the noise; m/s, rad/s where not measured
ON_STEP = 1e-6  # steps, by which a measurement may miss one
FARTHEST = 1e3  # deviations of the noise: a residual beyond it has diverged
BYTES = 1 << 24  # of states that are held at once
LARGEST = 1.5  # step of theta
BLOCKS, MOST_BLOCKS = 24, 400  # of time, of which the jackknife leaves out one after the other
LEVEL = 0.95  # of intervals


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations of all segments: J^T J and J^T r of theta, and of each segment's start.

    Attributes
    ----------
    A, g : (n, n) and (n,) of theta, summed over segments
    cross : (S, 9, n) of starts and theta
    inner, right : (S, 9, 9) and (S, 9) of starts

    """

    A: np.ndarray
    g: np.ndarray
    cross: np.ndarray
    inner: np.ndarray
    right: np.ndarray

    def eliminated(self, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A (n, n) and g (n,) without the starts, and (S, 9, n + 1) what they answer to theta."""
        damped = self.inner * (1.0 + damping * np.eye(9))
        back = np.linalg.solve(damped, np.concatenate([self.cross, self.right[..., None]], axis=2))
        taken = np.tensordot(self.cross, back, ([0, 1], [0, 1]))
        return self.A - taken[:, :-1], self.g - taken[:, -1], back


@dataclass(frozen=True, eq=False)
class Blocks:
    """Normal equations by blocks of time, starts eliminated: A (B, n, n) and g (B, n) of theta.

    A block is a segment, a part of one where they are few, or several where they are many.
    """

    A: np.ndarray
    g: np.ndarray

    def covariance(self, P: np.ndarray) -> np.ndarray:
        """(n, n) of theta by the jackknife (the sandwich, without its bias), for a prior P.

        A block counts as one observation, whatever its residuals are correlated with inside. What
        the prior says is as uncertain as it says itself.
        """
        S, count = self.A.sum(axis=0) + P, len(self.g)
        moves = np.linalg.solve(S - self.A, self.g[..., None])[..., 0]
        inverse = np.linalg.inv(S)
        return (count - 1) / count * moves.T @ moves + inverse @ P @ inverse


@dataclass(frozen=True, eq=False)
class Fit:
    """A minimum.

    Attributes
    ----------
    unknowns : of theta, with the delay
    theta : (n,)
    starts : (S, 9) of the segments, in deviations of the noise
    cost : sum of squares, the prior's included
    information : (n, n) Fisher information of theta by the data alone, for noise as assumed
    rows : number of measurements
    blocks : of time, on which intervals rest

    """

    unknowns: Unknowns
    theta: np.ndarray
    starts: np.ndarray
    cost: float
    information: np.ndarray
    rows: int
    blocks: int

    @property
    def quantile(self) -> float:
        """Deviations on either side of a 95 % interval."""
        return float(student.ppf((1 + LEVEL) / 2, max(self.blocks - 1, 1)))


@dataclass(eq=False)
class OutputError:
    """Residuals of segments of one length.

    Attributes
    ----------
    vehicle : whose lift, which is not free, counts
    segments : all of the same number of steps
    step : s
    noise : (9,) standard deviations of velocity and attitude measurements; NaN: not measured
    observer : gain by which the state follows the measurements; 0: it does not. What is measured
        less simulated is the error of its prediction then

    """

    vehicle: Vehicle
    segments: Sequence[Segment]
    step: float
    noise: np.ndarray
    observer: float = 0.0
    _deviation: np.ndarray = field(init=False)
    _certain: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self._deviation = np.where(np.isfinite(self.noise), self.noise, UNSEEN)
        self._certain = np.where(np.isfinite(self.noise), CERTAIN, 1.0)

    def simulate(
        self, unknowns: Unknowns, thetas: np.ndarray, starts: np.ndarray, which: slice
    ) -> np.ndarray:
        """States (V, S, n + 1, 10) of some segments for thetas (V, n), starts (V, S, 10)."""
        segments = self.segments[which]
        found = unknowns.coefficients(thetas)
        lag = np.maximum(found.lag, 1e-9)
        follow = np.repeat(-np.expm1(-self.step / lag)[:, None], 6, axis=1)
        allocation = np.eye(6) * found.gain[:, None, :]
        delay = float(unknowns.prior.delay) / self.step
        late = [delayed(one, delay) for one in segments]
        past = np.stack([before for before, _ in late])  # (S, p, 6)
        applied = _lagged(np.einsum('vim,spm->vspi', allocation, past), follow)
        x0 = np.zeros((*starts.shape[:2], 13))
        x0[..., 3:] = starts
        seen = np.stack([on_steps(one) for one in segments]) if self.observer else None
        found_states = open_loop(
            found.model(self.vehicle.lift), np.stack([command for _, command in late]), x0,
            self.step, allocation=allocation, follow=follow, applied=applied, bias=found.bias,
            current=found.current, measured=seen,
            observer=np.full(10, self.observer) if self.observer else None,
        )  # fmt: skip
        return np.concatenate([starts[:, :, None], found_states[..., 3:]], axis=2)

    def starts(self, z: np.ndarray, which: slice = slice(None)) -> np.ndarray:
        """Attitude and velocity (S, 10) of the starts z (S, 9) in deviations: nu, then rotation."""
        first = np.stack([segment.start for segment in self.segments[which]])
        moved = z * self._deviation
        q = rotated(first[:, :4], moved[:, 6:])
        return np.concatenate([q, first[:, 4:] + moved[:, :6]], axis=1)

    def residuals(self, which: slice, states: np.ndarray) -> Iterator[np.ndarray]:
        """Of each segment (V, r, 9): measured less simulated in deviations; 0: not measured."""
        scale = self._deviation * (1.0 - self.observer)  # states are those behind a correction
        for i, segment in enumerate(self.segments[which]):
            simulated = at_times(states[:, i], segment.at)
            e = np.empty((*simulated.shape[:2], 9))
            with np.errstate(all='ignore'):  # states may be what is left of a divergence
                np.subtract(segment.nu, simulated[..., 4:], out=e[..., :6])
                e[..., 6:] = small_rotation(simulated[..., :4], segment.q)
                e /= scale
            np.fmin(np.fmax(e, -FARTHEST, out=e), FARTHEST, out=e)  # no number: farthest
            known = np.isfinite(segment.nu)
            known = np.concatenate([known, np.repeat(np.isfinite(segment.q[:, :1]), 3, 1)], axis=1)
            if not known.all():
                e[:, ~known] = 0.0
            yield e

    def slices(self, variants: int) -> Iterator[slice]:
        """Segments that are simulated together, so that so many variants of them fit."""
        n = len(self.segments[0].command)
        most = max(int(BYTES / (variants * n * 13 * 8)), 1)
        for first in range(0, len(self.segments), most):
            yield slice(first, min(first + most, len(self.segments)))

    def cost(self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray) -> float:
        """Sum of squares of residuals, starts and prior."""
        total = unknowns.prior_cost(theta) + float(((z / self._certain) ** 2).sum())
        for which in self.slices(1):
            states = self.simulate(unknowns, theta[None], self.starts(z[which], which)[None], which)
            total += sum(float((e**2).sum()) for e in self.residuals(which, states))
        return total

    def _jacobians(
        self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Of each segment its residuals (r,) and their derivatives (n + 9, r)."""
        n = len(theta)
        thetas = np.concatenate([theta[None], theta + STEP * np.eye(n), np.tile(theta, (9, 1))])
        for which in self.slices(len(thetas)):
            starts = np.repeat(self.starts(z[which], which)[None], len(thetas), axis=0)
            for k in range(9):
                starts[1 + n + k] = self.starts(z[which] + STEP * np.eye(9)[k], which)
            states = self.simulate(unknowns, thetas, starts, which)
            for e in self.residuals(which, states):
                flat = e.reshape(len(thetas), -1)
                J = (flat[1:] - flat[0]) / STEP
                J[:, np.abs(J).max(axis=0) >= FARTHEST / STEP] = 0.0
                yield flat[0], J

    def normal(self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray) -> Normal:
        """Normal equations."""
        n, S = len(theta), len(self.segments)
        A, g = np.zeros((n, n)), np.zeros(n)
        cross, inner, right = np.empty((S, 9, n)), np.empty((S, 9, 9)), np.empty((S, 9))
        for s, (r, J) in enumerate(self._jacobians(unknowns, theta, z)):
            full, of_full = J @ J.T, J @ r
            A += full[:n, :n]
            g += of_full[:n]
            cross[s], inner[s], right[s] = full[n:, :n], full[n:, n:], of_full[n:]
        own = 1.0 / self._certain**2
        return Normal(A, g, cross, inner + np.diag(own), right + z * own)

    def blocks(self, fit: Fit) -> Blocks:
        """Normal equations by blocks of time."""
        n, S = len(fit.theta), len(self.segments)
        parts, together = -(-BLOCKS // S), -(-S // MOST_BLOCKS)
        A, g = np.zeros((fit.blocks, n, n)), np.zeros((fit.blocks, n))
        for s, (r, J) in enumerate(self._jacobians(fit.unknowns, fit.theta, fit.starts)):
            inner = J[n:] @ J[n:].T + np.diag(1.0 / self._certain**2)
            alone = J[:n] - np.linalg.solve(inner, J[n:] @ J[:n].T).T @ J[n:]  # by no start
            for k, rows in enumerate(np.array_split(np.arange(len(r)), parts)):
                b = (s * parts + k) // together
                A[b] += alone[:, rows] @ alone[:, rows].T
                g[b] += alone[:, rows] @ r[rows]
        return Blocks(A, g)

    def covariance(self, fit: Fit) -> np.ndarray:
        """(n, n) of theta, by blocks of time."""
        return self.blocks(fit).covariance(fit.unknowns.precision(fit.theta)[0])

    def fit(
        self,
        unknowns: Unknowns,
        theta: np.ndarray,
        z: np.ndarray | None = None,
        *,
        most: int = 40,
        tolerance: float = 1e-7,
    ) -> Fit:
        """Minimum from a start by Levenberg and Marquardt's method.

        Parameters
        ----------
        unknowns : of theta
        theta : (n,) start
        z : (S, 9) of the segments' starts; None: as measured
        most : iterations
        tolerance : relative change of the cost that ends it

        """
        z = np.zeros((len(self.segments), 9)) if z is None else z
        cost, small, damping = self.cost(unknowns, theta, z), 0, 1e-3
        normal = self.normal(unknowns, theta, z)
        for _iteration in range(most):
            for _ in range(14):
                move, moves = _step(unknowns, theta, normal, damping)
                new, new_z = theta + move, z + moves
                new_cost = self.cost(unknowns, new, new_z)
                if new_cost < cost:
                    break
                damping *= 6.0
            else:
                break
            gain = (cost - new_cost) / cost
            theta, z, cost, damping = new, new_z, new_cost, max(damping / 8.0, 1e-12)
            normal = self.normal(unknowns, theta, z)
            small = small + 1 if gain < tolerance else 0
            if small >= 2 or gain < tolerance / 100:
                break
        rows = sum(
            int(np.isfinite(s.nu).sum() + 3 * np.isfinite(s.q[:, 0]).sum()) for s in self.segments
        )
        S = len(self.segments)
        blocks = -(-S // -(-S // MOST_BLOCKS)) * -(-BLOCKS // S)
        return Fit(unknowns, theta, z, cost, normal.eliminated()[0], rows, blocks)

    def misfit(self, fit: Fit) -> Iterator[tuple[Segment, np.ndarray]]:
        """Segments with their residuals (r, 9), in deviations of the noise; 0: not measured."""
        for which in self.slices(1):
            starts = self.starts(fit.starts[which], which)[None]
            states = self.simulate(fit.unknowns, fit.theta[None], starts, which)
            pairs = zip(self.segments[which], self.residuals(which, states), strict=True)
            yield from ((segment, e[0]) for segment, e in pairs)

    def growth(self, unknowns: Unknowns, theta: np.ndarray) -> np.ndarray:
        """(n + 1,) by how much a small change of a start has grown since its first second."""
        found = []
        for which in self.slices(10):
            z = np.zeros((len(self.segments[which]), 9))
            starts = [self.starts(z, which)]
            starts += [self.starts(z + STEP * np.eye(9)[k], which) for k in range(9)]
            states = self.simulate(unknowns, np.tile(theta, (10, 1)), np.stack(starts), which)
            states = np.clip(np.nan_to_num(states, nan=FARTHEST), -FARTHEST, FARTHEST)
            change = (states[1:] - states[:1])[..., 4:] / (STEP * self._deviation[:6])
            size = np.linalg.norm(change, axis=(0, 3))
            first = size[:, : max(round(1.0 / self.step), 1) + 1].max(axis=1, keepdims=True)
            found.append(size / first)
        return np.median(np.concatenate(found), axis=0)


def _step(
    unknowns: Unknowns, theta: np.ndarray, normal: Normal, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """Steps (n,) of theta and (S, 9) of the starts."""
    P, p = unknowns.precision(theta)
    A, g, back = normal.eliminated(damping)
    move = -np.linalg.solve(A + P + damping * np.diag(np.diag(P + normal.A)), g + p)
    move *= min(1.0, LARGEST / max(np.abs(move).max(initial=0.0), 1e-300))
    return move, -back[..., -1] - back[..., :-1] @ move


def at_times(states: np.ndarray, at: np.ndarray) -> np.ndarray:
    """States (V, r, 10) at some times in steps, by straight lines through (V, n + 1, 10)."""
    nearest = np.rint(at).astype(int)
    if np.abs(at - nearest).max() < ON_STEP:
        return states[:, nearest]
    first = np.minimum(at.astype(int), states.shape[1] - 2)
    share = (at - first)[:, None]
    return states[:, first] * (1.0 - share) + states[:, first + 1] * share


def on_steps(segment: Segment) -> np.ndarray:
    """Measured attitude and velocity (n, 10) after the steps next to them; NaN: none."""
    found = np.full((len(segment.command), 10), np.nan)
    after = np.clip(np.rint(segment.at).astype(int) - 1, 0, len(found) - 1)
    rows = np.concatenate([segment.q, segment.nu], axis=1)
    row, column = np.nonzero(np.isfinite(rows))  # in the order of time: the last one stays
    found[after[row], column] = rows[row, column]
    return found


def delayed(segment: Segment, steps: float) -> tuple[np.ndarray, np.ndarray]:
    """Commands before (p, 6) and along (n, 6) a segment, later by a number of steps."""
    whole = int(np.floor(steps))
    share = steps - whole
    every = np.concatenate([segment.before, segment.command])
    k = np.arange(len(every))
    late = (1.0 - share) * every[np.maximum(k - whole, 0)]
    late = late + share * every[np.maximum(k - whole - 1, 0)]
    return late[: len(segment.before)], late[len(segment.before) :]


def _lagged(past: np.ndarray, follow: np.ndarray) -> np.ndarray:
    """What a lag (V, 6) has made of wrenches (V, S, p, 6) before a segment: (V, S, 6)."""
    count = past.shape[2]
    left = (1.0 - follow)[:, None, :] ** np.arange(count)[::-1, None]  # (V, p, 6)
    share = follow[:, None, :] * left
    share[:, 0] += (1.0 - follow) ** count
    return np.einsum('vpi,vspi->vsi', share, past)
