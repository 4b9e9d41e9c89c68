"""Multi-start search in a box: ranked starts, then SLSQP with central differences."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

DIFFERENCE = 1e-4  # step of the central differences, in the units of the coordinates
START_WEIGHT = 5.0  # penalty weight of a start, which need not be feasible
WEIGHT = 50.0  # penalty weight of all others, larger than the Lagrange multipliers
GLOBAL, REFINE, GRADIENT = 'global', 'refine', 'gradient'  # a start, an iterate, a difference


class _EnoughError(Exception):
    """The solver has used up its gradients."""


@dataclass(eq=False)
class Search:
    """A search of which every evaluation is kept.

    Attributes
    ----------
    function : points (B, n) to (m, B): the objective, then the constraints
    low, high : (n,) bounds of the points
    kinds : of the m - 1 constraints: 'eq', zero where it is met, or 'ineq', not negative there
    tolerance : change of the objective at which the solver stops
    apart : of the bounds' distance, between two points from which the solver starts
    batches : points (B, n), values (m, B) and stages (B,) in the order of their evaluation

    """

    function: Callable[[np.ndarray], np.ndarray]
    low: np.ndarray
    high: np.ndarray
    kinds: Sequence[str] = ()
    tolerance: float = 1e-6
    apart: float = 0.0
    batches: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=list)

    def run(self, starts: np.ndarray, rounds: Sequence[tuple[int, int]]) -> np.ndarray:
        """Best point (n,), after rounds of descents.

        Parameters
        ----------
        starts : (S, n)
        rounds : how many points each goes on from, and the gradients that each descent is given

        """
        x, weight, stage = starts, START_WEIGHT, GLOBAL
        for count, gradients in rounds:
            rank = self.merit(self.evaluate(x, [stage] * len(x)), weight)
            x = np.stack([self._descend(x[i], gradients) for i in self._chosen(x, rank, count)])
            weight, stage = WEIGHT, REFINE
        return self._best_since(0)

    def evaluate(self, x: np.ndarray, stages: Sequence[str]) -> np.ndarray:
        """Values (m, B) of points (B, n)."""
        values = self.function(x)
        self.batches.append((x, values, np.array(stages)))
        return values

    def evaluations(self, first: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (B, n), values (m, B) and stages (B,) of all batches from one on."""
        x, values, stages = zip(*self.batches[first:], strict=True)
        return np.concatenate(x), np.concatenate(values, axis=1), np.concatenate(stages)

    def merit(self, values: np.ndarray, weight: float) -> np.ndarray:
        """Objective (B,) with a penalty for the constraints that are violated."""
        violations = [
            np.abs(constraint) if kind == 'eq' else np.maximum(-constraint, 0.0)
            for kind, constraint in zip(self.kinds, values[1:], strict=True)
        ]
        return values[0] + weight * sum(violations, np.zeros(len(values[0])))

    def gradients(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (m,) at a point (n,) and their gradients (m, n), all points in one batch."""
        n = len(x)
        shifts = DIFFERENCE * np.eye(n)
        points = np.concatenate([x[None], x + shifts, x - shifts])
        values = self.evaluate(points, [REFINE, *[GRADIENT] * (2 * n)])
        slopes = (values[:, 1 : n + 1] - values[:, n + 1 :]) / (2 * DIFFERENCE)
        return values[:, 0], slopes

    def _chosen(self, x: np.ndarray, rank: np.ndarray, count: int) -> list[int]:
        """Indices of the best few points that are not next to each other."""
        chosen: list[int] = []
        for i in np.argsort(rank, kind='stable'):
            near = np.abs(x[chosen] - x[i]) < self.apart * (self.high - self.low)
            if not near.all(axis=1).any():
                chosen.append(int(i))
            if len(chosen) == count:
                break
        return chosen

    def _descend(self, start: np.ndarray, gradients: int) -> np.ndarray:
        """Best point (n,) on the way from a start to a local optimum."""
        first, left = len(self.batches), gradients
        known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

        def at(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            nonlocal left
            if x.tobytes() not in known:
                if left == 0:
                    raise _EnoughError
                left -= 1
                known.clear()
                known[x.tobytes()] = self.gradients(x)
            return known[x.tobytes()]

        def value(which: int) -> Callable[[np.ndarray], float]:
            return lambda x: float(at(x)[0][which])

        def slope(which: int) -> Callable[[np.ndarray], np.ndarray]:
            return lambda x: at(x)[1][which].copy()  # the solver writes into it

        with suppress(_EnoughError):
            minimize(
                value(0),
                start,
                jac=slope(0),
                method='SLSQP',
                bounds=list(zip(self.low, self.high, strict=True)),
                constraints=[
                    {'type': kind, 'fun': value(i), 'jac': slope(i)}
                    for i, kind in enumerate(self.kinds, start=1)
                ],
                options={'maxiter': gradients, 'ftol': self.tolerance},
            )
        return self._best_since(first)

    def _best_since(self, batch: int) -> np.ndarray:
        x, values, stages = self.evaluations(batch)
        rank = np.where(stages == GRADIENT, np.inf, self.merit(values, WEIGHT))
        return x[int(np.argmin(rank))]


def sobol_points(low: np.ndarray, high: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Points (count, n) of a scrambled Sobol sequence in a box; `count` is a power of two."""
    return low + qmc.Sobol(len(low), rng=seed).random(count) * (high - low)
