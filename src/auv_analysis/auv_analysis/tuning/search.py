"""Gains of least error at a reference's effort, or of least effort at its error.

A Sobol sequence over the whole space, then sequential quadratic programming: a few steps from the
best of its points that lie apart, and on to the end from the best of what that gave. Effort and
error are smooth in the gains and the equality is a constraint of the solver, so that it is attained
to its digits and not within a band. Gradients are central differences, all of whose points are one
batch of closed loops.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from auv_analysis.tuning.measures import Measures
from auv_analysis.tuning.space import Space
from auv_analysis.tuning.tried import Tried

Evaluate = Callable[[dict[str, np.ndarray]], Measures]  # gains, (B, ...) each -> measures (B,)
INDICES = ('weighted_error', 'error')
DIVERGED = 50.0  # logarithm of the ratio of a loop that diverged
DIFFERENCE = 1e-4  # of a logarithm, for central differences
WEIGHT = 50.0  # of the distance from equality: above any price, so that inequality does not pay
START_WEIGHT = 5.0  # of the same for a start, which need not be near to it
APART = 0.1  # of the bounds' distance, between two starts
STARTS, SHORT = 10, 15  # how many, and the gradients that each is given
FINALISTS, LONG = 2, 60
SETTLED = 1e-7  # change of the objective at which the solver stops
ROUNDING = 1e-9  # by which a rate may exceed its limit


@dataclass(frozen=True)
class Goal:
    """What a search is after.

    Attributes
    ----------
    equal : 'effort' or 'error'
    index : which error is meant, one of `INDICES`
    reference : measures of the reference, (1,) each
    tolerance : relative distance from equality that counts as equal

    """

    equal: str
    index: str
    reference: Measures
    tolerance: float

    @property
    def names(self) -> tuple[str, str]:
        """Measures that are made small and made equal."""
        return (self.index, 'effort') if self.equal == 'effort' else ('effort', self.index)

    def logs(self, measures: Measures) -> tuple[np.ndarray, np.ndarray]:
        """Logarithms (B,) of what is made small and of what is made equal, to the reference's."""
        small, same = (_log(measures, self.reference, name) for name in self.names)
        return small, same

    def is_met(self, measures: Measures) -> np.ndarray:
        """(B,) whether equal within the tolerance."""
        return np.abs(np.expm1(self.logs(measures)[1])) <= self.tolerance


def _log(measures: Measures, reference: Measures, name: str) -> np.ndarray:
    value, base = getattr(measures, name), getattr(reference, name)
    with np.errstate(invalid='ignore', divide='ignore', over='ignore'):
        return np.clip(np.nan_to_num(np.log(value / base), nan=DIVERGED), -DIVERGED, DIVERGED)


@dataclass(frozen=True, eq=False)
class Found:
    """What a search came to.

    Attributes
    ----------
    space : that was searched
    x : (n,) the best point
    measures : of it, (1,) each
    reached : whether it is equal within the tolerance; where not, it is the one nearest to it
    price : change of the objective's logarithm per change of the equal measure's, at x; None where
        equality was not reached
    tried : every point

    """

    space: Space
    x: np.ndarray
    measures: Measures
    reached: bool
    price: float | None
    tried: Tried


class _EnoughError(Exception):
    """The solver has had its calls."""


class _Problem:
    """A space with its goal, every evaluation of which is kept."""

    def __init__(self, space: Space, evaluate: Evaluate, goal: Goal):
        self.space, self.goal, self.tried = space, goal, Tried()
        self._evaluate = evaluate
        self._last: tuple[bytes, list[tuple[float, np.ndarray]]] = (b'', [])
        self._calls = 0

    def allow(self, calls: int) -> None:
        """Forget the last point, and evaluate so many more."""
        self._calls, self._last = calls, (b'', [])

    def logs(
        self, x: np.ndarray, stages: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Logarithms (B,) of objective and equality at points (B, n), and room for the rate."""
        measures, room = self._evaluate(self.space.gains(x)), self.space.room(x)
        self.tried.add(x, measures, room, np.array(stages))
        return *self.goal.logs(measures), room

    def best_since(self, batch: int) -> np.ndarray:
        """(n,) point of least merit among those tried from a batch on."""
        x, measures, room, stages = self.tried.since(batch)
        rank = merit(*self.goal.logs(measures), room, WEIGHT)
        return x[int(np.argmin(np.where(stages == 'gradient', np.inf, rank)))]

    def with_gradients(self, x: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Objective, equality and room at a point (n,), each with its gradient."""
        if self._last[0] != x.tobytes():
            if self._calls == 0:
                raise _EnoughError
            self._calls -= 1
            shifts = DIFFERENCE * np.eye(len(x))
            points = np.concatenate([x[None], x + shifts, x - shifts])
            found = self.logs(points, ['refine', *['gradient'] * (len(points) - 1)])
            ahead, behind = (
                np.stack(found)[:, at] for at in np.split(np.arange(1, len(points)), 2)
            )
            slopes = (ahead - behind) / (2 * DIFFERENCE)
            self._last = x.tobytes(), [(float(v[0]), g) for v, g in zip(found, slopes, strict=True)]
        return self._last[1]


def merit(small: np.ndarray, same: np.ndarray, room: np.ndarray, weight: float) -> np.ndarray:
    """(B,) what is made small, with the distances from equality and from room charged."""
    return small + weight * (np.abs(same) + np.maximum(-room, 0.0))


def search(
    space: Space, evaluate: Evaluate, goal: Goal, *, points: int, seed: int,
    starts: Sequence[np.ndarray] = (),
) -> Found:  # fmt: skip
    """Search a space.

    Parameters
    ----------
    space : of the gains
    evaluate : measures of closed loops with gains
    goal : what is made equal, to what, and how nearly
    points : of the Sobol sequence, a power of two; 0: only the starts
    seed : of its scrambling
    starts : (n,) each, further points that are looked at first

    Returns
    -------
    found : Found, the same for the same seed

    """
    problem = _Problem(space, evaluate, goal)
    first = [np.asarray(start)[None] for start in starts]
    if points:
        unit = qmc.Sobol(len(space.names), rng=seed).random(points)
        first.append(space.low + unit * (space.high - space.low))
    x = np.concatenate(first)
    rank = merit(*problem.logs(x, ['global'] * len(x)), START_WEIGHT)
    x = np.stack([_refine(problem, x[i], SHORT) for i in _apart(x, rank, space, STARTS)])
    rank = merit(*problem.logs(x, ['refine'] * len(x)), WEIGHT)
    for i in _apart(x, rank, space, FINALISTS):
        _refine(problem, x[i], LONG)
    return _conclude(problem)


def _apart(x: np.ndarray, rank: np.ndarray, space: Space, count: int) -> list[int]:
    """Indices of the best few points that are not next to each other."""
    chosen: list[int] = []
    for i in np.argsort(rank, kind='stable'):
        near = np.abs(x[chosen] - x[i]) < APART * (space.high - space.low)
        if not near.all(axis=1).any():
            chosen.append(int(i))
        if len(chosen) == count:
            break
    return chosen


def _refine(problem: _Problem, start: np.ndarray, calls: int) -> np.ndarray:
    """Take a point towards a local optimum, with so many gradients; the best point on the way."""

    def value(which: int) -> Callable[[np.ndarray], float]:
        return lambda x: problem.with_gradients(x)[which][0]

    def slope(which: int) -> Callable[[np.ndarray], np.ndarray]:
        return lambda x: problem.with_gradients(x)[which][1].copy()  # the solver writes into it

    first = len(problem.tried.batches)
    problem.allow(calls)
    with suppress(_EnoughError):
        minimize(
            value(0),
            start,
            jac=slope(0),
            method='SLSQP',
            bounds=list(zip(problem.space.low, problem.space.high, strict=True)),
            constraints=[
                {'type': 'eq', 'fun': value(1), 'jac': slope(1)},
                {'type': 'ineq', 'fun': value(2), 'jac': slope(2)},
            ],
            options={'maxiter': calls, 'ftol': SETTLED},
        )
    return problem.best_since(first)


def _conclude(problem: _Problem) -> Found:
    """The best point that is equal, else the one nearest to equality."""
    goal = problem.goal
    x, measures, room, stages = problem.tried.since()
    small, same = goal.logs(measures)
    allowed = (room >= -ROUNDING) & (stages != 'gradient')  # differences step across the bounds
    met = goal.is_met(measures) & allowed
    reached = bool(met.any())
    rank = merit(small, same, room, WEIGHT) if reached else np.abs(same)
    best = int(np.argmin(np.where(met if reached else allowed, rank, np.inf)))
    of_best = measures.part(slice(best, best + 1))
    price = _price(problem, x[best]) if reached else None
    return Found(problem.space, x[best], of_best, reached, price, problem.tried)


def _price(problem: _Problem, x: np.ndarray) -> float | None:
    """Multiplier of the equality: along its gradient, within the bounds that x does not touch."""
    problem.allow(1)
    (_, a), (_, b), _ = problem.with_gradients(x)
    space = problem.space
    free = (x > space.low + DIFFERENCE) & (x < space.high - DIFFERENCE)
    across = float(b[free] @ b[free])
    return float(a[free] @ b[free]) / across if across > 0 else None
