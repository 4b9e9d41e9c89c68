"""Initial estimate by weighted linear least squares: (1) is linear in M, D and g.

Velocities, their rates and the command are local polynomials over the same windows; a pure delay of
the command, which stands for lag and delay, is scanned. Noise in the regressors and the lag bias
the result: it is a start and nothing else.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from auv_analysis.bag.tracks import usual_interval
from auv_analysis.metrics.local_polynomials import SMALLEST, rates
from auv_analysis.studies.identify.record import Record, continuous, down_of, smoothed
from auv_analysis.studies.identify.unknowns import LOWER, Unknowns
from auv_dynamics.kernel.compile import plain
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.model import coriolis

DELAYS = np.arange(0.0, 0.43, 0.03)  # s
WINDOW, WIDEST = 0.5, 2.0  # s, and at most, of few samples
FITTED = ('M', 'D_linear', 'D_quadratic', 'hydrostatics')
PLACES: list[tuple[str, tuple[int, ...]]] = [  # of the 37 regressors
    *(('M', ij) for ij in LOWER),
    *((group, (i, i)) for group in ('D_linear', 'D_quadratic') for i in range(6)),
    *(('hydrostatics', (i,)) for i in range(4)),
]
MOST = 8000  # samples that are used
REWEIGHTED = 4
REVERSED = 0.3  # of the prior's inertia: what comes out more negative is no noise
INERTIAL = 0.1  # of the command, by the prior: where inertia takes less, its sign is no finding
FLOOR = 0.02  # of the largest eigenvalue of the scaled M: below it, a direction is not believed


def least_squares_start(
    records: Sequence[Record], unknowns: Unknowns, lift: np.ndarray | None = None
) -> tuple[np.ndarray, float, list[str]]:
    """Theta (n,), the sum of lag and delay in s, degrees of freedom whose command is reversed.

    Where a velocity is never measured, or the recording is too short for windows, the prior is the
    start. What is not free keeps the prior, as do lift (6, 6) and couplings of damping.
    """
    every = [_regressors(record) for record in records if record.known.all()]
    rows = [row for row in every if row is not None]
    theta, prior = np.zeros(len(unknowns.entries)), unknowns.prior
    if not rows:
        return theta, float(prior.lag + prior.delay), []
    normal = _Normal(rows, unknowns, lift)
    fits = [normal.solve(delay) for delay in DELAYS]
    best = int(np.argmin([cost for cost, _ in fits]))
    late, found = float(DELAYS[best]), fits[best][1]
    reversed_ = _reversed(found, prior.M) if normal.free[: len(LOWER)].all() else []
    if not unknowns.is_delay_free:
        late = float(prior.lag + prior.delay)
        found = normal.solve(late)[1]
    wanted = replace(prior, **{k: found[k] for k in FITTED})
    theta = np.clip(unknowns.theta(wanted), -6.0, 6.0)
    return theta, late, reversed_


def _reversed(found: dict[str, np.ndarray], M: np.ndarray) -> list[str]:
    """Degrees of freedom in which the command pushes against the acceleration that it makes."""
    prior = np.diag(M)
    wrong = (np.diag(found['raw']) < -REVERSED * prior) & (found['explained'] > 0.5)
    wrong &= prior * found['accelerated'] > INERTIAL * found['commanded']
    return [DOFS[i] for i in np.flatnonzero(wrong)]


def _regressors(record: Record) -> tuple[Record, np.ndarray, np.ndarray, np.ndarray] | None:
    """Times (k,), Y (k, 6, 21 + 6 + 6 + 4) and velocity (k, 6).

    tau = Y [M, D_linear, D_quadratic, hydrostatics], of damping the diagonals.
    """
    there = np.isfinite(record.velocity).all(axis=1)
    t, nu = record.velocity_t[there], record.velocity[there]
    period = usual_interval(t)
    inside = (t > record.start + WINDOW + DELAYS[-1]) & (t < record.end - WINDOW)
    at = t[inside][:: max(int(inside.sum() / MOST), 1)]
    if SMALLEST * period > WIDEST or len(at) < 60:
        return None
    count = max(round(WINDOW / period), SMALLEST)
    smooth, rate = smoothed(t, nu, at), rates(t, nu, at, count).rate
    q = smoothed(record.attitude_t, continuous(record.attitude), at)
    Y = _linear(smooth, rate, down_of(q / np.linalg.norm(q, axis=1)[:, None]))
    return record, at, Y, smooth


def _linear(nu: np.ndarray, rate: np.ndarray, d: np.ndarray) -> np.ndarray:
    Y = np.zeros((len(nu), 6, 37))
    columns = tuple(nu.T)
    for k, (i, j) in enumerate(LOWER):
        E = np.zeros((6, 6))
        E[i, j] = E[j, i] = 1.0
        terms = plain(coriolis)(E.ravel(), columns, columns)
        Y[:, :, k] = rate @ E + np.stack(terms, axis=1)
    for i in range(6):
        Y[:, i, 21 + i], Y[:, i, 27 + i] = nu[:, i], nu[:, i] * np.abs(nu[:, i])
    Y[:, :3, 33] = -d
    for k in range(3):  # g holds -(W r_G - B r_B) x down
        Y[:, 3:, 34 + k] = -np.cross(np.eye(3)[k], d)
    return Y


class _Normal:
    """Sums over all samples, by degree of freedom, for any weights and any delay."""

    def __init__(
        self,
        rows: Sequence[tuple[Record, np.ndarray, np.ndarray, np.ndarray]],
        unknowns: Unknowns,
        lift: np.ndarray | None,
    ):
        prior, there = unknowns.prior, {(entry.group, entry.index) for entry in unknowns.entries}
        free = np.array([place in there for place in PLACES])
        self.known = np.concatenate(
            [prior.M[tuple(zip(*LOWER, strict=True))], np.diag(prior.D_linear),
             np.diag(prior.D_quadratic), prior.hydrostatics]
        )  # fmt: skip
        Y = np.concatenate([row[2] for row in rows])
        self.prior, self.free = prior, free
        self.rows = [row[:2] for row in rows]
        self.accelerated = np.array([Y[:, i, LOWER.index((i, i))].std() for i in range(6)])
        self.fixed = Y[:, :, ~free] @ self.known[~free]
        nu = np.concatenate([row[3] for row in rows])
        for A, x in ((prior.D_linear, nu), (prior.D_quadratic, nu * np.abs(nu))):
            self.fixed += x @ (A - np.diag(np.diag(A))).T
        if lift is not None:
            self.fixed += np.abs(nu[:, :1]) * nu @ lift.T
        self.Y = np.ascontiguousarray(Y[:, :, free].swapaxes(0, 1))  # (6, k, n)
        self.gram = self.Y.swapaxes(1, 2) @ self.Y
        scale = np.maximum(np.abs(self.known[free]), 1e-3 * np.abs(self.known).max())
        self.ridge = 1e-6 * len(Y) * np.diag(1.0 / scale**2)  # to the prior where nothing is seen

    def solve(self, delay: float) -> tuple[float, dict[str, np.ndarray]]:
        """Logarithm of the residuals, and coefficients, for one delay of the command."""
        U = np.concatenate([smoothed(r.middles, r.command, at - delay) for r, at in self.rows])
        rest = (U - self.fixed).T
        right = np.einsum('ikn,ik->in', self.Y, rest, optimize=True)
        known, w = self.known.copy(), np.ones(6)
        for _ in range(REWEIGHTED):
            A, b = np.tensordot(w**2, self.gram, 1) + self.ridge, w**2 @ right
            found = np.linalg.solve(A, b + self.ridge @ self.known[self.free])
            deviation = (rest - self.Y @ found).std(axis=1)
            w = 1.0 / np.maximum(deviation, 1e-9 * deviation.max() + 1e-300)
        known[self.free] = found
        M = np.zeros((6, 6))
        for value, (i, j) in zip(known[:21], LOWER, strict=True):
            M[i, j] = M[j, i] = value
        return float(np.log(deviation).sum()), {
            'raw': M,
            'accelerated': self.accelerated,
            'commanded': U.std(axis=0),
            'explained': 1.0 - deviation**2 / np.maximum(rest.var(axis=1), 1e-300),
            'M': _definite(M, self.prior.M),
            'D_linear': _with_diagonal(self.prior.D_linear, known[21:27]),
            'D_quadratic': _with_diagonal(self.prior.D_quadratic, known[27:33]),
            'hydrostatics': known[33:],
        }


def _definite(M: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """The nearest positive definite matrix in the metric of its diagonal."""
    s = np.sqrt(np.maximum(np.diag(M), 0.05 * np.diag(prior)))
    R = M / np.outer(s, s)
    R[np.diag_indices(6)] = 1.0
    values, vectors = np.linalg.eigh(R)
    return np.outer(s, s) * ((vectors * np.maximum(values, FLOOR)) @ vectors.T)


def _with_diagonal(A: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
    result = A.copy()
    result[np.diag_indices(6)] = np.maximum(diagonal, 0.0)
    return result
