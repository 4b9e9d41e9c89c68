"""The best change of some parts of a vehicle, within bounds: several starts, one local method."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from auv_analysis.design.objective import PART, Objective
from auv_analysis.design.parameters import ALL, NAMES, PARTS, SWITCHES, indices_of, rounded
from auv_analysis.design.prediction import Figures, Prediction

POINTS = 8  # two to this power: changes that are looked at for a start
SEED = 0
ITERATIONS = 60
IDLE = 0.0005  # a coordinate or angle that lowers the score by less is put to zero
PLACED = [i for i, name in enumerate(NAMES) if name not in SWITCHES]


@dataclass(frozen=True, eq=False)
class Spread:
    """Changes of one part, spread evenly within the bounds, with their figures.

    Attributes
    ----------
    part : of `PARTS` or 'all'
    free : places in `NAMES` of what may be changed
    points : (m, 13) the changes
    figures : of these, with the ratios of all twelve couplings

    """

    part: str
    free: list[int]
    points: np.ndarray
    figures: Figures

    @classmethod
    def of(cls, prediction: Prediction, part: str) -> 'Spread':
        """Changes of a part, the same every time."""
        lower, upper = prediction.space.bounds
        free = [i for i in indices_of(part) if upper[i] > lower[i]]
        points = prediction.space.unchanged[None]
        if free:
            unit = qmc.Sobol(len(free), rng=SEED).random_base2(POINTS)
            points = np.repeat(points, len(unit), axis=0)
            points[:, free] = lower[free] + unit * (upper[free] - lower[free])
        return cls(part, free, points, prediction.figures(points))

    def best(self, objective: Objective, count: int) -> list[np.ndarray]:
        """The changes with the lowest scores."""
        ratios = self.figures.ratios[:, [objective.target]]
        values = objective.of(self.figures._replace(ratios=ratios))
        return [self.points[i] for i in np.argsort(values, kind='stable')[:count]]


def search(objective: Objective, spread: Spread, starts: Sequence[np.ndarray]) -> np.ndarray:
    """Change (13,) with the lowest score found, rounded as one would write it down.

    Parameters
    ----------
    objective : of a coupling
    spread : of the part that may be changed
    starts : changes (13,) from which it goes on, one at least

    """
    space = objective.prediction.space
    if not spread.free:
        return space.unchanged
    ends = [_descended(objective, start, spread.free) for start in starts]
    best = ends[int(np.argmin([float(objective.value(x)) for x in ends]))]
    return _lean(objective, rounded(best, space.parameters), spread.part)


def _descended(objective: Objective, start: np.ndarray, free: list[int]) -> np.ndarray:
    """SLSQP from a start, in units of the bounds: few steps, and little work in each."""
    lower, upper = (bound[free] for bound in objective.prediction.space.bounds)
    width = upper - lower

    def placed(unit: np.ndarray) -> np.ndarray:
        x = start.copy()
        x[free] = np.clip(lower + unit * width, lower, upper)
        return x

    def function(unit: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = objective.value_and_gradient(placed(unit), free)
        return value, gradient * width

    found = minimize(
        function, (start[free] - lower) / width, jac=True, method='SLSQP',
        bounds=[(0.0, 1.0)] * len(free), options={'maxiter': ITERATIONS, 'ftol': 1e-6},
    )  # fmt: skip
    return placed(found.x)


def _lean(objective: Objective, x: np.ndarray, part: str) -> np.ndarray:
    """The change without the parts, then without the numbers, that hardly do anything for it."""
    space = objective.prediction.space
    lower, upper = space.bounds
    parts = PARTS if part == ALL else (part,)
    allowed = [i for i in PLACED if lower[i] <= 0 <= upper[i]]
    trials = [(indices_of(one), PART) for one in parts]
    trials += [([i], IDLE) for one in parts for i in indices_of(one) if i in allowed]
    for places, gain in trials:
        without = x.copy()
        without[places] = space.unchanged[places]
        if float(objective.value(without)) < float(objective.value(x)) + gain:
            x = without
    return x


def parts_of(x: np.ndarray) -> list[str]:
    """Parts of a vehicle that a change (13,) changes; a ballast has a mass, a disc a radius."""
    there = {'shift': x[0:3].any(), 'ballast': x[3] > 0, 'disc': x[7] > 0}
    return [part for part in PARTS if there[part]]
