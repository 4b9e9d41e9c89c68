"""What a search makes small, and its gradient by the complex step."""

from dataclasses import dataclass

import numpy as np

from auv_analysis.design.couplings import Sizes
from auv_analysis.design.prediction import Figures, Prediction

OTHERS = 0.1  # weight of the other couplings and of the effort beside the one to be reduced
UNREST = 0.3  # weight of what gets worse at rest
SIZE = 0.01  # weight of the size of the change
PART = 0.02  # cost of every part that is changed: shift, ballast, disc
LEAST = 0.01  # of all couplings before: the least by which the others are judged
IMPOSSIBLE = 1e6  # score of a change whose M is not positive definite
STEP = 1e-20  # of the complex step: there is no cancellation that would ask for a larger one


def score(found: Figures, before: Sizes, target: int, others: float = OTHERS) -> np.ndarray:
    """r^2 + 0.1 (o^2 + e^2) + 0.3 unrest + 0.01 size.

    r is the largest magnitude of the coupling, o the root sum square of the shares of all others,
    e the root of the effort: each after by before.

    Parameters
    ----------
    found : (...,), with the ratio of the target alone
    before : of the unchanged vehicle
    target : place in `COUPLINGS` of what is to be reduced
    others : weight 0.1 of o^2 and e^2

    """
    rest = _without(found.shares, target) / (
        _without(before.shares, target) + LEAST * (before.shares @ before.shares)
    )
    burden = UNREST * found.unrest + SIZE * found.size
    value = found.ratios[..., 0] ** 2 + others * (rest + found.effort) + burden
    return np.where(found.definite, value, IMPOSSIBLE)


def _without(shares: np.ndarray, target: int) -> np.ndarray:
    """Sum of squares (...) of the shares (..., 12) of all couplings but one."""
    squares = shares**2
    return squares.sum(axis=-1) - squares[..., target]


@dataclass(frozen=True, eq=False)
class Objective:
    """Score of changes by which one coupling is to be reduced.

    Attributes
    ----------
    prediction : of the figures
    target : place in `COUPLINGS`
    others : weight of the other couplings and of the effort

    """

    prediction: Prediction
    target: int
    others: float = OTHERS

    def value(self, x: np.ndarray) -> np.ndarray:
        """Score (...) of changes (..., 13), real or complex."""
        return self.of(self.prediction.figures(x, (self.target,)))

    def of(self, found: Figures) -> np.ndarray:
        """Score (...) of figures, with the ratio of the target alone."""
        return score(found, self.prediction.before, self.target, self.others)

    def value_and_gradient(self, x: np.ndarray, free: list[int]) -> tuple[float, np.ndarray]:
        """Score of one change (13,) and its derivatives by the parameters in `free`."""
        steps = np.zeros((len(free), len(x)), complex)
        steps[range(len(free)), free] = 1j * STEP
        values = self.value(x + steps)
        return float(values[0].real), values.imag / STEP
