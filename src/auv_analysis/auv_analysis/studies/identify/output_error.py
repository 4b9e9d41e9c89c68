"""Output error: the model alone is simulated along segments, and its misfit made small.

Each segment has a start of its own, nine unknowns that only it depends on (multiple shooting), so
that the normal equations are built and its start eliminated segment by segment: memory does not
grow with the recording. Levenberg and Marquardt's method on them takes the place of
`scipy.optimize.least_squares`, which needs the whole Jacobian at once; both find the same minimum.
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
BEYOND = 1e9  # what stands for a state that is not finite
FARTHEST = 1e3  # deviations of the noise: a residual beyond it has diverged
BYTES = 1 << 27  # of states that are held at once
LARGEST = 1.5  # step of theta
BLOCKS = 24  # of all segments, at least, that the jackknife leaves out one by one
LEVEL = 0.95  # of intervals


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations of one segment, its start eliminated.

    Attributes
    ----------
    A, g : (n, n) and (n,) of theta
    full : (n + 9, n + 9) and (n + 9,) of theta and start
    blocks : A and g of parts of it, one after the other, which add up to those above

    """

    A: np.ndarray
    g: np.ndarray
    full: tuple[np.ndarray, np.ndarray]
    blocks: list[tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Fit:
    """A minimum.

    Attributes
    ----------
    unknowns : of theta, with the delay
    theta : (n,)
    starts : (S, 9) of the segments, in deviations of the noise
    cost : sum of squares, the prior's included
    parts : normal equations by segment
    rows : number of measurements

    """

    unknowns: Unknowns
    theta: np.ndarray
    starts: np.ndarray
    cost: float
    parts: list[Normal]
    rows: int

    @property
    def information(self) -> np.ndarray:
        """(n, n) Fisher information of theta by the data alone, for noise as assumed."""
        return np.sum([part.A for part in self.parts], axis=0)

    def covariance(self) -> np.ndarray:
        """(n, n) of theta by the jackknife over blocks of time (the sandwich, without its bias).

        A block, a segment or part of one, counts as one observation, whatever its residuals are
        correlated with inside. What the prior says is as uncertain as it says itself.
        """
        P, _ = self.unknowns.precision(self.theta)
        S = self.information + P
        moves = [np.linalg.solve(S - A, g) for part in self.parts for A, g in part.blocks]
        count = len(moves)
        B = (count - 1) / count * np.sum([np.outer(m, m) for m in moves], axis=0)
        inverse = np.linalg.inv(S)
        return B + inverse @ P @ inverse

    @property
    def quantile(self) -> float:
        """Deviations on either side of a 95 % interval."""
        return float(
            student.ppf((1 + LEVEL) / 2, max(sum(len(p.blocks) for p in self.parts) - 1, 1))
        )


@dataclass(eq=False)
class OutputError:
    """Residuals of segments of one length.

    Attributes
    ----------
    vehicle : whose lift, which is not free, counts
    segments : all of the same number of steps
    step : s
    noise : (9,) standard deviations of velocity and attitude measurements; NaN: not measured
    allocation : (6, m) wrench by command; None: the command is a wrench
    integrator : of the simulation

    """

    vehicle: Vehicle
    segments: Sequence[Segment]
    step: float
    noise: np.ndarray
    allocation: np.ndarray | None = None
    integrator: str = 'rk4'
    _deviation: np.ndarray = field(init=False)
    _certain: np.ndarray = field(init=False)
    _blocks: int = field(init=False)

    def __post_init__(self) -> None:
        self._deviation = np.where(np.isfinite(self.noise), self.noise, UNSEEN)
        self._blocks = -(-BLOCKS // max(len(self.segments), 1))
        self._certain = np.where(np.isfinite(self.noise), CERTAIN, 1.0)

    def simulate(
        self, unknowns: Unknowns, thetas: np.ndarray, starts: np.ndarray, which: slice
    ) -> np.ndarray:
        """States (V, S, n + 1, 10) of some segments for thetas (V, n), starts (V, S, 10)."""
        segments = self.segments[which]
        found = unknowns.coefficients(thetas)
        lag = np.maximum(found.lag, 1e-9)
        follow = np.repeat(-np.expm1(-self.step / lag)[:, None], 6, axis=1)
        base = np.eye(6) if self.allocation is None else self.allocation
        allocation = base * found.gain[:, None, :]
        delay = float(unknowns.prior.delay) / self.step
        late = [delayed(one, delay) for one in segments]
        past = np.stack([before for before, _ in late])  # (S, p, m)
        applied = _lagged(np.einsum('vim,spm->vspi', allocation, past), follow)
        x0 = np.zeros((*starts.shape[:2], 13))
        x0[..., 3:] = starts
        found_states = open_loop(
            found.model(self.vehicle.lift), np.stack([command for _, command in late]), x0,
            self.step, allocation=allocation, follow=follow, applied=applied, bias=found.bias,
            current=found.current, integrator=self.integrator,
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
        for i, segment in enumerate(self.segments[which]):
            bounded = np.nan_to_num(states[:, i], nan=BEYOND, posinf=BEYOND, neginf=-BEYOND)
            simulated = at_times(bounded, segment.at)
            e = np.empty((*simulated.shape[:2], 9))
            e[..., :6] = segment.nu - simulated[..., 4:]
            e[..., 6:] = small_rotation(simulated[..., :4], segment.q)
            e /= self._deviation
            known = np.isfinite(segment.nu)
            known = np.concatenate([known, np.repeat(np.isfinite(segment.q[:, :1]), 3, 1)], axis=1)
            e = np.clip(np.nan_to_num(e, nan=FARTHEST), -FARTHEST, FARTHEST)
            yield np.where(known, e, 0.0)

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

    def normal(self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray) -> list[Normal]:
        """Normal equations of every segment."""
        n = len(theta)
        thetas = np.concatenate([theta[None], theta + STEP * np.eye(n), np.tile(theta, (9, 1))])
        parts = []
        for which in self.slices(len(thetas)):
            here = z[which]
            starts = np.repeat(self.starts(here, which)[None], len(thetas), axis=0)
            for k in range(9):
                starts[1 + n + k] = self.starts(here + STEP * np.eye(9)[k], which)
            states = self.simulate(unknowns, thetas, starts, which)
            for e, own in zip(self.residuals(which, states), here, strict=True):
                flat = e.reshape(len(thetas), -1)
                r, J = flat[0], (flat[1:] - flat[0]) / STEP
                J = np.where(np.abs(J).max(axis=0) < FARTHEST / STEP, J, 0.0)
                A, g = J @ J.T, J @ r
                A[n:, n:] += np.diag(1.0 / self._certain**2)
                g[n:] += own / self._certain**2
                inner = np.linalg.solve(A[n:, n:], np.column_stack([A[n:, :n], g[n:]]))
                alone = J[:n] - inner[:, :n].T @ J[n:]  # what no start can imitate
                blocks = [
                    (alone[:, rows] @ alone[:, rows].T, alone[:, rows] @ r[rows])
                    for rows in np.array_split(np.arange(len(r)), self._blocks)
                ]
                parts.append(
                    Normal(A[:n, :n] - A[:n, n:] @ inner[:, :n], g[:n] - A[:n, n:] @ inner[:, n],
                           (A, g), blocks)
                )  # fmt: skip
        return parts

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
        parts = self.normal(unknowns, theta, z)
        for _iteration in range(most):
            for _ in range(14):
                move, moves = _step(unknowns, theta, parts, damping)
                new, new_z = theta + move, z + moves
                new_cost = self.cost(unknowns, new, new_z)
                if new_cost < cost:
                    break
                damping *= 6.0
            else:
                break
            gain = (cost - new_cost) / cost
            theta, z, cost, damping = new, new_z, new_cost, max(damping / 8.0, 1e-12)
            parts = self.normal(unknowns, theta, z)
            small = small + 1 if gain < tolerance else 0
            if small >= 2 or gain < tolerance / 100:
                break
        rows = sum(
            int(np.isfinite(s.nu).sum() + 3 * np.isfinite(s.q[:, 0]).sum()) for s in self.segments
        )
        return Fit(unknowns, theta, z, cost, parts, rows)

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
    unknowns: Unknowns, theta: np.ndarray, parts: Sequence[Normal], damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """Steps (n,) of theta and (S, 9) of the starts."""
    n = len(theta)
    P, p = unknowns.precision(theta)
    A, g, inner = P.copy(), p.copy(), []
    scale = damping * np.diag(P + np.sum([part.full[0][:n, :n] for part in parts], axis=0))
    for part in parts:
        full, right = part.full
        block = full[n:, n:] + damping * np.diag(np.diag(full)[n:])
        back = np.linalg.solve(block, np.column_stack([full[n:, :n], right[n:]]))
        A += full[:n, :n] - full[:n, n:] @ back[:, :n]
        g += right[:n] - full[:n, n:] @ back[:, n]
        inner.append(back)
    move = -np.linalg.solve(A + np.diag(scale), g)
    move *= min(1.0, LARGEST / max(np.abs(move).max(initial=0.0), 1e-300))
    return move, np.array([-back[:, n] - back[:, :n] @ move for back in inner])


def at_times(states: np.ndarray, at: np.ndarray) -> np.ndarray:
    """States (V, r, 10) at some times in steps, by straight lines through (V, n + 1, 10)."""
    first = np.minimum(at.astype(int), states.shape[1] - 2)
    share = (at - first)[:, None]
    return states[:, first] * (1.0 - share) + states[:, first + 1] * share


def delayed(segment: Segment, steps: float) -> tuple[np.ndarray, np.ndarray]:
    """Commands before (p, m) and along (n, m) a segment, later by a number of steps."""
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
