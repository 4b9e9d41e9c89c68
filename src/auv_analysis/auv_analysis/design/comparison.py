"""Which change removes which coupling: searched for in the motion of a run, then simulated."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from auv_analysis.design.couplings import Sizes
from auv_analysis.design.motion import Motion
from auv_analysis.design.objective import PART, Objective, score
from auv_analysis.design.parameters import ALL, PARTS
from auv_analysis.design.prediction import Figures, Prediction
from auv_analysis.design.search import Spread, parts_of, search
from auv_analysis.design.setting import Setting
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError, first_line

HALF = 0.5
AGREES = 0.02  # of the magnitude before: a prediction that is as near is not made again
ROUNDS = 2
TRIED = 0.01  # of the largest share: smaller couplings are not searched for a remedy
MOST = 6  # couplings that are


@dataclass(frozen=True, eq=False)
class Candidate:
    """A change that was simulated.

    Attributes
    ----------
    target : place in `COUPLINGS` of what it is to reduce
    part : of `PARTS` or 'all': what was allowed to change
    x : (13,) the change
    predicted : largest magnitude of the coupling after by before, in the motion of an earlier run
    ratio : the same of the changed vehicle's own run; None: it cannot be run, `failure` says why
    score : of `score`, of its own run, and the cost of its parts
    run, sizes : its own run
    failure : one line

    """

    target: int
    part: str
    x: np.ndarray
    predicted: float
    ratio: float | None = None
    score: float = np.inf
    run: Run | None = None
    sizes: Sizes | None = None
    failure: str = ''

    @property
    def rank(self) -> tuple[bool, float]:
        """The lowest is the best: of those that halve the coupling by score, else by ratio."""
        if self.ratio is None:
            return True, np.inf
        return self.ratio > HALF, self.score if self.ratio <= HALF else self.ratio


class Comparison:
    """Changes of a vehicle in one setting.

    Parameters
    ----------
    setting : the experiment
    run : of the unchanged vehicle
    before : sizes of its couplings

    """

    def __init__(self, setting: Setting, run: Run, before: Sizes):
        self.setting, self.before = setting, before
        self._row = setting.space.difference(setting.space.unchanged).row
        self.prediction = Prediction(setting.space, Motion.of(run, self._row), before)
        self._spreads = {part: Spread.of(self.prediction, part) for part in (*PARTS, ALL)}

    def targets(self) -> list[int]:
        """Couplings worth a remedy, the largest share first."""
        shares = self.before.shares
        order = np.argsort(-shares, kind='stable')
        return [int(k) for k in order[:MOST] if shares[k] > TRIED * shares.max()]

    def candidates(self, target: int, starts: int) -> Iterator[Candidate]:
        """The best change of each part and of all together, each simulated.

        Parameters
        ----------
        target : place in `COUPLINGS`
        starts : of each search

        """
        objective = Objective(self.prediction, target)
        singles = []
        for part in PARTS:
            spread = self._spreads[part]
            x = search(objective, spread, spread.best(objective, starts))
            singles.append(x)
            yield self._simulated(objective, part, x, self.prediction)
        best = min(singles, key=lambda x: float(objective.value(x)))
        spread = self._spreads[ALL]
        x = search(
            objective, spread, [best, np.sum(singles, axis=0), *spread.best(objective, starts)]
        )
        yield self._simulated(objective, ALL, x, self.prediction)

    def at_any_cost(self, target: int, starts: int) -> Candidate:
        """The change of all parts that reduces a coupling most, whatever the others do."""
        objective = Objective(self.prediction, target, others=0.0)
        spread = self._spreads[ALL]
        x = search(objective, spread, spread.best(objective, starts))
        return self._simulated(objective, ALL, x, self.prediction)

    def refined(self, best: Candidate) -> Candidate:
        """A better one, searched for from its own run, where that was not as predicted."""
        for _ in range(ROUNDS):
            if best.ratio is None or best.run is None:
                break
            if abs(best.ratio - best.predicted) <= AGREES:
                break
            motion = Motion.of(best.run, self.setting.space.difference(best.x).row)
            objective = Objective(replace(self.prediction, motion=motion), best.target)
            x = search(objective, self._spreads[best.part], [best.x])
            found = self._simulated(objective, best.part, x, objective.prediction)
            if found.rank >= best.rank:
                break
            best = found
        return best

    def _simulated(
        self, objective: Objective, part: str, x: np.ndarray, prediction: Prediction
    ) -> Candidate:
        target, space = objective.target, self.setting.space
        predicted = float(prediction.ratios(x)[target])
        found = Candidate(target, part, x, predicted)
        try:
            run, sizes = self.setting.simulated(x)
        except (ArithmeticError, InputError) as error:
            return replace(found, failure=first_line(error))
        ratio = float(sizes.peaks[target] / self.before.peaks[target])
        figures = Figures(
            ratios=np.array([ratio]),
            shares=sizes.shares,
            effort=sizes.effort / self.before.by_effort,
            unrest=space.unrest(x),
            size=space.size(x),
            definite=True,
        )
        value = float(score(figures, self.before, target)) + PART * len(parts_of(x))
        return replace(found, ratio=ratio, score=value, run=run, sizes=sizes)
