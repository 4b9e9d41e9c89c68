"""Tuned laws: gains of least error at a reference's effort, or of least effort at its error.

A Sobol sequence over the whole space, then sequential quadratic programming: a few steps from the
best of its points that lie apart, and on to the end from the best of what that gave. Effort and
error are smooth in the gains and the equality is a constraint of the solver, so that it is attained
to its digits and not within a band.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auv_analysis.output.text import join, number
from auv_analysis.runs.run import Hold
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import DivergedError
from auv_analysis.studies.optimise import DIFFERENCE, GRADIENT, WEIGHT, Search, sobol_points
from auv_analysis.studies.tune.cost import Measures, joined, measured
from auv_analysis.studies.tune.gain_space import BEST, EDGE, GainSpace, make_space, starts_of
from auv_analysis.studies.tune.perturbations import Spread
from auv_dynamics.files.errors import InputError
from auv_gvc_controller.control.gains import body_gains, sampled_rate
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

Evaluate = Callable[[dict[str, np.ndarray]], Measures]  # gains, (B, ...) each -> measures (B,)
POINTS = 1024  # of a Sobol sequence
DIVERGED = 50.0  # logarithm of the ratio of a loop that diverged
APART = 0.1  # of the bounds' distance, between two starts
STARTS, SHORT = 10, 15  # how many, and the gradients that each is given
FINALISTS, LONG = 2, 60
TOLERANCE = 1e-7  # change of the objective at which the solver stops
ROUNDING = 1e-9  # by which a rate may exceed its limit


@dataclass(frozen=True)
class Request:
    """Settings of a tuning.

    Attributes
    ----------
    scenario : of `load_scenario`
    reference : name of the controller whose effort, or error, is to be met
    laws : that are tuned, keys of `SHIPPED`
    equal, index, tolerance : see `Goal`
    structure : a key of `STRUCTURES`, or 'best'
    hold : 'continuous' or 'zoh'
    seed : of search and draws
    threads : how many to use
    samples, spread : draws of perturbed plants by which laws are compared, and how far they go

    """

    scenario: Scenario
    reference: str
    laws: tuple[str, ...]
    equal: str
    index: str
    tolerance: float
    structure: str
    hold: Hold
    seed: int
    threads: int
    samples: int = 0
    spread: Spread = field(default_factory=Spread)


@dataclass(frozen=True)
class Goal:
    """Objective function and equality constraint of a search.

    Attributes
    ----------
    equal : 'effort' or 'error'
    index : which error is meant: 'weighted_error' or 'error'
    reference : measures of the reference, (1,) each
    tolerance : relative distance from equality that counts as equal

    """

    equal: str
    index: str
    reference: Measures
    tolerance: float

    @classmethod
    def of(cls, request: Request) -> 'Goal':
        """Goal that a request's reference sets.

        Raises
        ------
        DivergedError : the reference's own loop diverges
        InputError : it has no effort or no error

        """
        scenario, name = request.scenario, request.reference
        reference = measured(scenario, name, {}, request.hold, request.threads)
        if np.isnan(reference.error[0]):
            text = f'{scenario.name}, {name}: the reference diverges: nothing to equal'
            raise DivergedError(text)
        if not (reference.effort[0] > 0 and reference.error[0] > 0):
            expected = 'a reference with effort and error'
            found = f'effort {reference.effort[0]:g}, error {reference.error[0]:g}'
            raise InputError(scenario.path, f'controllers.{name}', expected, found)
        return cls(request.equal, request.index, reference, request.tolerance)

    @property
    def names(self) -> tuple[str, str]:
        """The measure that is minimised and the one that is made equal."""
        return (self.index, 'effort') if self.equal == 'effort' else ('effort', self.index)

    def logs(self, measures: Measures) -> np.ndarray:
        """Logarithms (2, B) of the minimised and the equal measure, to the reference's."""
        pairs = [[getattr(m, name) for m in (measures, self.reference)] for name in self.names]
        with np.errstate(invalid='ignore', divide='ignore', over='ignore'):
            logs = np.nan_to_num([np.log(value / base) for value, base in pairs], nan=DIVERGED)
        return np.clip(logs, -DIVERGED, DIVERGED)


@dataclass(frozen=True, eq=False)
class Optimum:
    """Result of one search.

    Attributes
    ----------
    space : that was searched
    x : (n,) the best point
    measures : of it, (1,) each
    reached : whether it is equal within the tolerance; where not, it is the one nearest to it
    price : Lagrange multiplier: change of the objective's logarithm per change of the equal
        measure's, at x; None where equality was not reached
    points : (B, n) every point that was evaluated
    evaluations : measures (B,) of them
    margins : (B,) of `GainSpace.rate_margin`
    stages : (B,) 'global', 'refine' or 'gradient'

    """

    space: GainSpace
    x: np.ndarray
    measures: Measures
    reached: bool
    price: float | None
    points: np.ndarray
    evaluations: Measures
    margins: np.ndarray
    stages: np.ndarray

    @property
    def allowed(self) -> np.ndarray:
        """(B,) whether the velocity loop of a point is slow enough for the control period."""
        return self.margins >= -ROUNDING


@dataclass(frozen=True, eq=False)
class TunedLaw:
    """A law with the gains that were found for it.

    Attributes
    ----------
    law : its name
    best : search in the structure that came out best
    searches : of all structures

    """

    law: str
    best: Optimum
    searches: Sequence[Optimum]

    @property
    def entry(self) -> dict[str, Any]:
        """Law and gains as a scenario file gives them."""
        return self.best.space.entry(self.best.x)

    def remarks(self, duration: float) -> list[str]:
        """Warnings on the gains: bounds of the search, an adaptation without effect.

        An adaptation whose slowest and fastest rates, the eigenvalues of K_D^-1 K_f, are below the
        inverse of the run's length does not act in it.
        """
        space, x = self.best.space, self.best.x
        on = [f'{name} ({side})' for name, side in space.at_bound(x).items()]
        remarks = [f'at a bound of the search: {join(on)}'] if on else []
        if space.rate_margin(x[None])[0] < EDGE:
            remarks.append('its velocity loop is as fast as the control period allows')
        gains = {name: value for name, value in self.entry.items() if name != 'law'}
        K_D, K_f = body_gains(make_gains(self.law, gains), space.model)
        fastest = float(np.abs(np.linalg.eigvals(np.linalg.solve(K_D, K_f))).max())
        if 0 < fastest * duration < 1:
            remarks.append(
                'its adaptation is switched off: K_f / K_D is at most '
                f'{number(fastest, 2)} 1/s, slower than the run of {duration:g} s'
            )
        return remarks


def structures_of(structure: str) -> tuple[str, ...]:
    """Structures that are searched; six numbers begin at the best multiple of M's diagonal."""
    return {BEST: ('scalar', 'mass'), 'diagonal': ('mass', 'diagonal')}.get(structure, (structure,))


def tuned(
    request: Request, law: str, goal: Goal, progress: Callable[[], None] = lambda: None
) -> TunedLaw:
    """Tune one law; the goal is that of the request.

    The best of its structures is, of those that reach equality, the one with the least objective,
    else the one nearest to equality. `progress` is called after each structure.
    """
    scenario = request.scenario
    model = control_model(scenario.vehicle)
    K_D, _ = body_gains(scenario.gains(request.reference), model)
    fastest = max(1 / scenario.step, sampled_rate(K_D, scenario.vehicle.M)[0])
    searches: list[Optimum] = []
    for structure in structures_of(request.structure):
        space = make_space(law, structure, model, scenario.step, fastest)
        starts, points = starts_of(space, scenario, request.reference), POINTS
        if structure == 'diagonal':
            starts.append(space.nearest(searches[0].space.entry(searches[0].x)))
            points = 0
        searches.append(
            search(space, _evaluator(request, space), goal, points, request.seed, starts)
        )
        progress()
    return TunedLaw(law, min(searches, key=lambda one: _rank(one, goal)), tuple(searches))


def _evaluator(request: Request, space: GainSpace) -> Evaluate:
    """Function from gains (B, ...) of a space's law to measures (B,) in the request's scenario."""
    law, middle = space.law, (space.low + space.high) / 2
    scenario = changed_scenario(request.scenario, {f'controllers.{law}': space.entry(middle)})

    def evaluate(gains: Mapping[str, np.ndarray]) -> Measures:
        return measured(scenario, law, gains, request.hold, request.threads)

    return evaluate


def _rank(optimum: Optimum, goal: Goal) -> tuple[bool, float]:
    objective, equality = goal.logs(optimum.measures)[:, 0]
    return not optimum.reached, float(objective if optimum.reached else abs(equality))


def search(
    space: GainSpace, evaluate: Evaluate, goal: Goal, points: int, seed: int,
    starts: Sequence[np.ndarray] = (),
) -> Optimum:  # fmt: skip
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
    optimum : the same for the same seed

    """
    batches: list[Measures] = []

    def values(x: np.ndarray) -> np.ndarray:
        """Logarithms (3, B) of objective, equality and margin of the rate."""
        batches.append(evaluate(space.gains(x)))
        return np.stack([*goal.logs(batches[-1]), space.rate_margin(x)])

    solver = Search(values, space.low, space.high, ('eq', 'ineq'), TOLERANCE, APART)
    first = [np.asarray(start)[None] for start in starts]
    if points:
        first.append(sobol_points(space.low, space.high, points, seed))
    solver.run(np.concatenate(first), ((STARTS, SHORT), (FINALISTS, LONG)))
    return _best(space, goal, solver, batches)


def _best(space: GainSpace, goal: Goal, solver: Search, batches: list[Measures]) -> Optimum:
    """The best point that is equal, else the one nearest to equality."""
    x, logs, stages = solver.evaluations()
    _, equality, margins = logs
    measures = joined(batches)
    allowed = (margins >= -ROUNDING) & (stages != GRADIENT)  # differences step across the bounds
    met = (np.abs(np.expm1(equality)) <= goal.tolerance) & allowed
    reached = bool(met.any())
    rank = solver.merit(logs, WEIGHT) if reached else np.abs(equality)
    best = int(np.argmin(np.where(met if reached else allowed, rank, np.inf)))
    price = _price(solver, x[best]) if reached else None
    x, logs, stages = solver.evaluations()
    return Optimum(
        space, x[best], measures.part(slice(best, best + 1)), reached, price,
        x, joined(batches), logs[2], stages,
    )  # fmt: skip


def _price(solver: Search, x: np.ndarray) -> float | None:
    """Multiplier of the equality: along its gradient, within the bounds that x does not touch."""
    objective, equality, _ = solver.gradients(x)[1]
    free = (x > solver.low + DIFFERENCE) & (x < solver.high - DIFFERENCE)
    across = float(equality[free] @ equality[free])
    return float(objective[free] @ equality[free]) / across if across > 0 else None
