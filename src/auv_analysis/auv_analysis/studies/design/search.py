"""Search for the change that removes a coupling: in the motion of a run, then simulated."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from auv_analysis.runs.run import Run
from auv_analysis.studies.design.change import (
    ALL,
    NAMES,
    PARTS,
    SWITCHES,
    indices_of,
    parts_of,
    rounded,
)
from auv_analysis.studies.design.prediction import (
    COUPLINGS,
    REST,
    Metrics,
    Objective,
    Prediction,
    RecordedMotion,
    Sizes,
    coupling_named,
    present,
)
from auv_analysis.studies.design.setting import Setting
from auv_analysis.studies.optimise import Search, sobol_points
from auv_dynamics.files.errors import InputError, first_line

POINTS = 256  # changes of a part that are looked at for a start
SEED = 0
STARTS = 4  # of a search for the proposal
FEW = 1  # of one for the table of what helps against the other couplings
ITERATIONS = 60
PART = 0.02  # cost of every part that is changed: shift, ballast, disc
IDLE = 0.0005  # a coordinate or angle that lowers the objective by less is put to zero
HALF = 0.5
AGREES = 0.02  # of the magnitude before: a prediction that is as near is not made again
ROUNDS = 2
SMALLEST = 0.01  # of the largest share: smaller couplings are not searched for a remedy
MOST = 6  # couplings that are
PLACED = [i for i, name in enumerate(NAMES) if name not in SWITCHES]


@dataclass(frozen=True, eq=False)
class Survey:
    """Changes of one part, spread evenly within the bounds, with their metrics.

    Attributes
    ----------
    part : of `PARTS` or 'all'
    free : places in `NAMES` of what may be changed
    points : (m, 13) the changes
    metrics : of these, with the ratios of all twelve couplings

    """

    part: str
    free: list[int]
    points: np.ndarray
    metrics: Metrics

    @classmethod
    def of(cls, prediction: Prediction, part: str) -> 'Survey':
        """Changes of a part, the same every time."""
        lower, upper = prediction.space.bounds
        free = [i for i in indices_of(part) if upper[i] > lower[i]]
        points = np.repeat(prediction.space.unchanged[None], POINTS if free else 1, axis=0)
        if free:
            points[:, free] = sobol_points(lower[free], upper[free], POINTS, SEED)
        return cls(part, free, points, prediction.metrics(points))

    def best(self, objective: Objective, count: int) -> list[np.ndarray]:
        """The changes with the lowest scores."""
        ratios = self.metrics.ratios[:, [objective.target]]
        values = objective.of(self.metrics._replace(ratios=ratios))
        return [self.points[i] for i in np.argsort(values, kind='stable')[:count]]


def search(objective: Objective, survey: Survey, starts: Sequence[np.ndarray]) -> np.ndarray:
    """Change (13,) with the lowest score found, rounded as one would write it down.

    Parameters
    ----------
    objective : of a coupling
    survey : of the part that may be changed
    starts : changes (13,) from which it goes on, one at least

    """
    space, free = objective.prediction.space, survey.free
    if not free:
        return space.unchanged
    lower, upper = (bound[free] for bound in space.bounds)

    def change(units: np.ndarray) -> np.ndarray:
        """Changes (B, 13) at places (B, n) in units of the bounds' distance."""
        x = np.repeat(space.unchanged[None], len(units), axis=0)
        x[:, free] = lower + units * (upper - lower)
        return x

    units = (np.stack(starts)[:, free] - lower) / (upper - lower)
    zeros = np.zeros(len(free))
    solver = Search(lambda at: objective.value(change(at))[None], zeros, zeros + 1.0)
    best = solver.run(units, ((len(units), ITERATIONS),))
    return _lean(objective, rounded(change(best[None])[0], space), survey.part)


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
    score : of `Objective`, of its own run, and the cost of its parts
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
        halves = self.ratio <= HALF
        return not halves, self.score if halves else self.ratio


class Remedies:
    """Changes against the couplings of a vehicle in one setting.

    Parameters
    ----------
    setting : the experiment
    run : of the unchanged vehicle
    before : sizes of its couplings

    """

    def __init__(self, setting: Setting, run: Run, before: Sizes):
        self.setting, self.before = setting, before
        motion = RecordedMotion.of(run, setting.space.effect(setting.space.unchanged).row)
        self.prediction = Prediction(setting.space, motion, before)
        self._surveys = {part: Survey.of(self.prediction, part) for part in (*PARTS, ALL)}

    def targets(self) -> list[int]:
        """Couplings worth a remedy, the largest share first."""
        shares = self.before.shares
        order = np.argsort(-shares, kind='stable')
        return [int(k) for k in order[:MOST] if shares[k] > SMALLEST * shares.max()]

    def candidates(self, target: int, starts: int) -> Iterator[Candidate]:
        """The best change of each part and of all for a place in `COUPLINGS`, each simulated."""
        objective = Objective(self.prediction, target)
        singles = []
        for part in PARTS:
            survey = self._surveys[part]
            singles.append(search(objective, survey, survey.best(objective, starts)))
            yield self._simulated(objective, part, singles[-1])
        best = min(singles, key=lambda x: float(objective.value(x)))
        survey = self._surveys[ALL]
        together = [best, np.sum(singles, axis=0), *survey.best(objective, starts)]
        yield self._simulated(objective, ALL, search(objective, survey, together))

    def at_any_cost(self, target: int, starts: int) -> Candidate:
        """The change of all parts that reduces a coupling most, whatever the others do."""
        objective, survey = Objective(self.prediction, target, others=0.0), self._surveys[ALL]
        x = search(objective, survey, survey.best(objective, starts))
        return self._simulated(objective, ALL, x)

    def refined(self, best: Candidate) -> Candidate:
        """A better one, searched for from its own run, where that was not as predicted."""
        for _ in range(ROUNDS):
            if best.ratio is None or best.run is None:
                break
            if abs(best.ratio - best.predicted) <= AGREES:
                break
            space = self.setting.space
            motion = RecordedMotion.of(best.run, space.effect(best.x).row)
            prediction = Prediction(space, motion, self.before, self.prediction.smooth)
            objective = Objective(prediction, best.target)
            x = search(objective, self._surveys[best.part], [best.x])
            found = self._simulated(objective, best.part, x)
            if found.rank >= best.rank:
                break
            best = found
        return best

    def _simulated(self, objective: Objective, part: str, x: np.ndarray) -> Candidate:
        target, space = objective.target, self.setting.space
        made = Candidate(target, part, x, float(objective.prediction.ratios(x)[target]))
        try:
            run, sizes = self.setting.simulated(x)
        except (ArithmeticError, InputError) as error:
            return replace(made, failure=first_line(error))
        ratio = float(sizes.peaks[target] / self.before.peaks[target])
        metrics = Metrics(
            ratios=np.array([ratio]),
            shares=sizes.shares,
            effort=sizes.effort / self.before.by_effort,
            at_rest=space.hydrostatic_penalty(x),
            size=space.size(x),
            definite=True,
        )
        value = float(Objective(self.prediction, target).of(metrics)) + PART * len(parts_of(x))
        return replace(made, ratio=ratio, score=value, run=run, sizes=sizes)


@dataclass(frozen=True, eq=False)
class Proposal:
    """Findings on a vehicle in a setting.

    Attributes
    ----------
    setting : the experiment
    there : couplings that the structure of M allows
    asked : name of the coupling that was asked for, or None
    run, before : of the unchanged vehicle; None where nothing is coupled
    target : place in `COUPLINGS` of the coupling to reduce; None: there is nothing to reduce
    candidates : changes that were simulated, those for the target first
    best : the proposal, None where no change lowers the coupling

    """

    setting: Setting
    there: list[str]
    asked: str | None
    run: Run | None = None
    before: Sizes | None = None
    target: int | None = None
    candidates: tuple[Candidate, ...] = ()
    best: Candidate | None = None


def propose(
    setting: Setting,
    reduce: str | None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Proposal:
    """Find the change of a vehicle that removes a coupling, and what removes the others.

    Parameters
    ----------
    setting : the experiment
    reduce : name of a coupling; none: the one with the largest share, see `shares_of`
    progress : told how many couplings are done, and of how many

    Raises
    ------
    InputError : no coupling of that name
    DivergedError : the unchanged vehicle cannot be run

    """
    there = present(setting.space.vehicle)
    asked = None if reduce is None else coupling_named(reduce, there)
    if not there or (asked is not None and asked not in there):
        return Proposal(setting, there, asked)
    run, before = setting.simulated(setting.space.unchanged)
    target = int(np.argmax(before.shares)) if asked is None else COUPLINGS.index(asked)
    if before.shares[target] < REST:
        return Proposal(setting, there, asked, run, before)
    remedies = Remedies(setting, run, before)
    others = [k for k in remedies.targets() if k != target] if setting.is_quick else []
    progress(0, 1 + len(others))
    found = list(remedies.candidates(target, STARTS))
    if all(one.ratio is None or one.ratio > HALF for one in found):
        found.append(remedies.at_any_cost(target, STARTS))
    best = remedies.refined(min(found, key=lambda one: one.rank))
    if best not in found:
        found.append(best)
    for i, k in enumerate(others, start=1):
        progress(i, 1 + len(others))
        found += remedies.candidates(k, FEW)
    progress(1 + len(others), 1 + len(others))
    helps = best.ratio is not None and best.ratio < 1 and parts_of(best.x)
    return Proposal(
        setting, there, asked, run, before, target, tuple(found), best if helps else None
    )
