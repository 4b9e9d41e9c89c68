"""What the gains of a controller do to its figures: the result of a study of gains."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from auv_analysis.study.figures import Excluded, Figure
from auv_analysis.study.indices import Method
from auv_dynamics.signals import DOFS


@dataclass(frozen=True)
class Index:
    """What one gain does to one figure; None is what the method does not give.

    Attributes
    ----------
    gain : its name
    S1, ST : share of the variance of ln(figure) that it makes alone, and with all other gains
    mu_star : of Morris: mean change of ln(figure) over its whole range, whatever the sign
    sigma : of Morris: standard deviation of that change
    S1_conf, ST_conf, mu_star_conf : half of the 95 % interval
    elasticity : relative change of the figure per relative change of the gain, by least squares

    """

    gain: str
    elasticity: float
    S1: float | None = None
    S1_conf: float | None = None
    ST: float | None = None
    ST_conf: float | None = None
    mu_star: float | None = None
    mu_star_conf: float | None = None
    sigma: float | None = None

    @property
    def weight(self) -> float:
        """What gains are ordered by: ST, or mu_star."""
        return float(self.mu_star if self.ST is None else self.ST)  # type: ignore[arg-type]  # one of both

    @property
    def doubled(self) -> float:
        """Change of the figure in % when the gain is doubled, by the elasticity."""
        return 100.0 * (2.0**self.elasticity - 1.0)


@dataclass(frozen=True)
class Variable:
    """One figure and how it follows the gains.

    Attributes
    ----------
    figure : which it is
    value : with the scenario's own gains
    smallest, largest : over all rollouts
    spread : standard deviation of ln(figure), about its relative change; with a 95 % interval
    rank : place by spread among the degrees of freedom of this figure, 1 the largest; with a
        95 % interval
    indices : one of each gain

    """

    figure: Figure
    value: float
    smallest: float
    largest: float
    spread: float
    spread_low: float
    spread_high: float
    rank: int
    rank_low: int
    rank_high: int
    indices: tuple[Index, ...]

    @property
    def spread_conf(self) -> float:
        """Half of the 95 % interval of the spread."""
        return 0.5 * (self.spread_high - self.spread_low)

    @property
    def main(self) -> Index:
        """The gain that does most of it."""
        return max(self.indices, key=lambda index: index.weight)


@dataclass(frozen=True)
class Sensitivity:
    """How the figures of one controller follow its gains.

    Attributes
    ----------
    controller, law : whose gains
    method, count, seed : of the design
    rollouts : closed loops that the indices come from; 0 where there are none
    span : every gain is multiplied by a number from 1/span to span, log-uniform
    asked : the span that was asked for; wider than `span` where loops diverged there
    failed : span -> how many rollouts diverged or were refused there
    gains : names of the factors
    left_out : gain -> why it is none
    variables : by falling spread
    excluded : figures that have no spread, and why
    refusal : why there are no variables; empty where there are

    """

    controller: str
    law: str
    method: Method
    count: int
    seed: int
    rollouts: int
    span: float
    asked: float
    failed: Mapping[float, int]
    gains: tuple[str, ...]
    left_out: Mapping[str, str]
    variables: tuple[Variable, ...] = ()
    excluded: tuple[Excluded, ...] = ()
    refusal: str = ''

    def of(self, name: str) -> dict[str, Variable]:
        """Degree of freedom -> variable of a figure such as 'velocity_error.rms'."""
        return {v.figure.dof: v for v in self.variables if v.figure.name == name}

    @property
    def alike(self) -> dict[str, int]:
        """Figure -> number of its degrees of freedom that are ranked."""
        names = [variable.figure.name for variable in self.variables]
        return {name: names.count(name) for name in names}

    def six(self, name: str) -> np.ndarray:
        """Spreads (6,) of a figure; 0 where it has none."""
        found = self.of(name)
        return np.array([found[dof].spread if dof in found else 0.0 for dof in DOFS])
