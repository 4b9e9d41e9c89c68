"""Output-error method: the model is simulated along segments, its misfit minimised.

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
from auv_analysis.studies.identify.record import Segment, rotated
from auv_analysis.studies.identify.residuals import FARTHEST, fill_residuals
from auv_analysis.studies.identify.unknowns import Unknowns
from auv_dynamics.vehicle.vehicle import Vehicle

STEP = 3e-7  # of theta, for derivatives: as much truncated as rounded
CERTAIN, UNSEEN = 10.0, 0.3  # of starts: deviations of the noise; m/s, rad/s where not measured
BYTES = 1 << 24  # of states that are held at once
LARGEST = 1.5  # step of theta
APART = 1e-12  # of a start's square: what tells starts apart that move a diverging model alike
BLOCKS, MOST_BLOCKS = 24, 400  # of time, of which the jackknife leaves out one after the other
LEVEL = 0.95  # of intervals


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations of all segments: J^T J and J^T r of theta, and of each segment's start.

    Attributes
    ----------
    cost : sum of squares of residuals, starts and prior
    A, g : (n, n) and (n,) of theta, summed over segments
    cross : (S, 9, n) of starts and theta
    inner, right : (S, 9, 9) and (S, 9) of starts

    """

    cost: float
    A: np.ndarray
    g: np.ndarray
    cross: np.ndarray
    inner: np.ndarray
    right: np.ndarray

    def eliminated(self, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A (n, n) and g (n,) without the starts, and (S, 9, n + 1) what they answer to theta."""
        damped = self.inner * (1.0 + (damping + APART) * np.eye(9))
        back = np.linalg.solve(damped, np.concatenate([self.cross, self.right[..., None]], axis=2))
        taken = np.tensordot(self.cross, back, ([0, 1], [0, 1]))
        return self.A - taken[:, :-1], self.g - taken[:, -1], back


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
    _first: np.ndarray = field(init=False)
    _commands: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self._first = np.stack([one.start for one in self.segments])
        self._commands = np.stack([np.concatenate([s.before, s.command]) for s in self.segments])
        self._deviation = np.where(np.isfinite(self.noise), self.noise, UNSEEN)
        self._certain = np.where(np.isfinite(self.noise), CERTAIN, 1.0)

    def simulate(
        self, unknowns: Unknowns, thetas: np.ndarray, starts: np.ndarray, which: slice
    ) -> np.ndarray:
        """States (V, S, n, 13) after each step of segments for thetas (V, n), starts (V, S, 10)."""
        found = unknowns.coefficients(thetas)
        lag = np.maximum(found.lag, 1e-9)
        follow = np.repeat(-np.expm1(-self.step / lag)[:, None], 6, axis=1)
        late = delayed(self._commands[which], float(unknowns.prior.delay) / self.step)
        past, commands = np.split(late, [len(self.segments[0].before)], axis=1)
        x0 = np.zeros((*starts.shape[:2], 13))
        x0[..., 3:] = starts
        seen = np.stack([on_steps(one) for one in self.segments[which]]) if self.observer else None
        return open_loop(
            found.model(self.vehicle.lift), commands, x0, self.step,
            allocation=np.eye(6) * found.gain[:, None, :], follow=follow,
            applied=found.gain[:, None, :] * _lagged(past, follow), bias=found.bias,
            current=found.current, measured=seen,
            observer=np.full(10, self.observer) if self.observer else None,
        )  # fmt: skip

    def runs(
        self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray, moves: np.ndarray | None = None
    ) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        """Segments that are simulated together, their starts (V, S, 10) and states (V, S, n, 13).

        Variants are moves (V, n + 9) of theta (n,) and of all starts z (S, 9): nu, then rotation;
        None: one, unmoved.
        """
        n = len(theta)
        moves = np.zeros((1, n + 9)) if moves is None else moves
        most = max(int(BYTES / (len(moves) * len(self.segments[0].command) * 13 * 8)), 1)
        for begin in range(0, len(self.segments), most):
            which = slice(begin, begin + most)
            first, moved = self._first[which], (z[which] + moves[:, None, n:]) * self._deviation
            q = rotated(first[:, :4], moved[..., 6:])
            starts = np.concatenate([q, first[:, 4:] + moved[..., :6]], axis=-1)
            yield which, starts, self.simulate(unknowns, theta + moves[:, :n], starts, which)

    def residuals(
        self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray, moves: np.ndarray | None = None
    ) -> Iterator[np.ndarray]:
        """Of each segment (V, r, 9): measured less simulated in deviations; 0: not measured.

        Parameters are those of `runs`.
        """
        scale = self._deviation * (1.0 - self.observer)  # states are those behind a correction
        for which, starts, states in self.runs(unknowns, theta, z, moves):
            for s, segment in enumerate(self.segments[which]):
                e = np.empty((len(states), len(segment.at), 9))
                at, nu, q = (
                    np.require(part, float, ('C', 'A', 'W'))  # another kind would be compiled for
                    for part in (segment.at, segment.nu, segment.q)
                )
                with np.errstate(all='ignore'):  # states may be what is left of a divergence
                    fill_residuals(starts, states, s, at, nu, q, scale, e)
                yield e

    def cost(self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray) -> float:
        """Sum of squares of residuals, starts and prior."""
        own = unknowns.prior_cost(theta) + float(((z / self._certain) ** 2).sum())
        return own + sum(float((e**2).sum()) for e in self.residuals(unknowns, theta, z))

    def _derivatives(
        self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray
    ) -> Iterator[np.ndarray]:
        """Of each segment its residuals and their derivatives (1 + n + 9, r)."""
        moves = STEP * np.eye(len(theta) + 10, len(theta) + 9, -1)
        for e in self.residuals(unknowns, theta, z, moves):
            rows = e.reshape(len(moves), -1)
            rows[1:] -= rows[0]
            if max(rows[1:].max(), -rows[1:].min()) >= FARTHEST:  # one has diverged
                rows[1:, np.abs(rows[1:]).max(axis=0) >= FARTHEST] = 0.0
            rows[1:] /= STEP
            yield rows

    def normal(self, unknowns: Unknowns, theta: np.ndarray, z: np.ndarray) -> Normal:
        """Normal equations."""
        n, S = 1 + len(theta), len(self.segments)
        total = np.zeros((n, n))  # of residuals and theta
        of_starts = np.empty((S, 9, n + 9))
        for s, rows in enumerate(self._derivatives(unknowns, theta, z)):
            products = rows @ rows.T
            total += products[:n, :n]
            of_starts[s] = products[n:]
        own = 1.0 / self._certain**2
        cost = unknowns.prior_cost(theta) + float((own * z**2).sum() + total[0, 0])
        inner, right = of_starts[..., n:] + np.diag(own), of_starts[..., 0] + z * own
        return Normal(cost, total[1:, 1:], total[0, 1:], of_starts[..., 1:n], inner, right)

    def blocks(self, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        """Normal equations by blocks of time, starts eliminated: (B, n, n) and (B, n) of theta.

        A block is a segment, a part of one where they are few, or several where they are many.
        """
        n, S = len(fit.theta), len(self.segments)
        parts, together = -(-BLOCKS // S), -(-S // MOST_BLOCKS)
        A, g = np.zeros((fit.blocks, n, n)), np.zeros((fit.blocks, n))
        for s, rows in enumerate(self._derivatives(fit.unknowns, fit.theta, fit.starts)):
            r, J = rows[0], rows[1:]
            inner = J[n:] @ J[n:].T + np.diag(1.0 / self._certain**2)
            alone = J[:n] - np.linalg.solve(inner, J[n:] @ J[:n].T).T @ J[n:]  # by no start
            for k, part in enumerate(np.array_split(np.arange(len(r)), parts)):
                b = (s * parts + k) // together
                A[b] += alone[:, part] @ alone[:, part].T
                g[b] += alone[:, part] @ r[part]
        return A, g

    def covariance(self, fit: Fit) -> np.ndarray:
        """(n, n) of theta by the jackknife over blocks (the sandwich, without its bias).

        A block counts as one observation, whatever its residuals are correlated with inside. What
        the prior says is as uncertain as it says itself.
        """
        (A, g), (P, _) = self.blocks(fit), fit.unknowns.precision(fit.theta)
        S = A.sum(axis=0) + P
        moves = np.linalg.solve(S - A, g[..., None])[..., 0]
        inverse = np.linalg.inv(S)
        return (len(g) - 1) / len(g) * moves.T @ moves + inverse @ P @ inverse

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
        normal, damping, small, rejected = self.normal(unknowns, theta, z), 1e-3, 0, 0
        cost = normal.cost
        for _iteration in range(most):
            move, moves, less = _step(unknowns, theta, normal, 0.0)
            if less < tolerance * cost:  # all that is left to be had
                new_cost = self.cost(unknowns, theta + move, z + moves)
                if new_cost < cost:
                    theta, z, cost = theta + move, z + moves, new_cost
                break
            easy, after = rejected == 0, None
            for rejected in range(14):
                move, moves, _ = _step(unknowns, theta, normal, damping)
                new, new_z = theta + move, z + moves
                if easy and rejected == 0:  # a step that is taken needs derivatives in any case
                    after = self.normal(unknowns, new, new_z)
                new_cost = after.cost if after else self.cost(unknowns, new, new_z)
                if new_cost < cost:
                    break
                damping, after = 6.0 * damping, None
            else:
                break
            gain = (cost - new_cost) / cost
            theta, z, cost = new, new_z, new_cost
            normal = after or self.normal(unknowns, theta, z)
            damping = max(damping / 8.0, 1e-12)
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
        residuals = self.residuals(fit.unknowns, fit.theta, fit.starts)
        return zip(self.segments, (e[0] for e in residuals), strict=True)

    def growth(self, unknowns: Unknowns, theta: np.ndarray) -> np.ndarray:
        """(n + 1,) by how much a small change of a start has grown since its first second."""
        n, z, found = len(theta), np.zeros((len(self.segments), 9)), []
        moves = STEP * np.eye(n + 10, n + 9, -1)[[0, *range(n + 1, n + 10)]]
        for _, starts, states in self.runs(unknowns, theta, z, moves):
            nu = np.concatenate([starts[:, :, None, 4:], states[..., 7:]], axis=2)
            nu = np.clip(np.nan_to_num(nu, nan=FARTHEST), -FARTHEST, FARTHEST)
            change = (nu[1:] - nu[:1]) / (STEP * self._deviation[:6])
            size = np.linalg.norm(change, axis=(0, 3))
            first = size[:, : max(round(1.0 / self.step), 1) + 1].max(axis=1, keepdims=True)
            found.append(size / first)
        return np.median(np.concatenate(found), axis=0)


def _step(
    unknowns: Unknowns, theta: np.ndarray, normal: Normal, damping: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Steps (n,) of theta and (S, 9) of the starts, and by how much a parabola then falls."""
    P, p = unknowns.precision(theta)
    A, g, back = normal.eliminated(damping)
    move = -np.linalg.solve(A + P + damping * np.diag(np.diag(P + normal.A)), g + p)
    less = float((normal.right * back[..., -1]).sum() - (g + p) @ move)
    move *= min(1.0, LARGEST / max(np.abs(move).max(initial=0.0), 1e-300))
    return move, -back[..., -1] - back[..., :-1] @ move, less


def on_steps(segment: Segment) -> np.ndarray:
    """Measured attitude and velocity (n, 10) after the steps next to them; NaN: none."""
    found = np.full((len(segment.command), 10), np.nan)
    after = np.clip(np.rint(segment.at).astype(int) - 1, 0, len(found) - 1)
    rows = np.concatenate([segment.q, segment.nu], axis=1)
    row, column = np.nonzero(np.isfinite(rows))  # in the order of time: the last one stays
    found[after[row], column] = rows[row, column]
    return found


def delayed(commands: np.ndarray, steps: float) -> np.ndarray:
    """Commands (S, n, 6) later by a number of steps; the first one was there before."""
    whole = int(np.floor(steps))
    share = steps - whole
    k = np.arange(commands.shape[1])
    late = (1.0 - share) * commands[:, np.maximum(k - whole, 0)]
    return late + share * commands[:, np.maximum(k - whole - 1, 0)] if share else late


def _lagged(past: np.ndarray, follow: np.ndarray) -> np.ndarray:
    """What lags (V, 6) have made of wrenches (S, p, 6) before a segment: (V, S, 6)."""
    count = past.shape[1]
    left = (1.0 - follow)[:, None, :] ** np.arange(count)[::-1, None]  # (V, p, 6)
    share = follow[:, None, :] * left
    share[:, 0] += (1.0 - follow) ** count
    return np.einsum('vpi,spi->vsi', share, past, optimize=True)
