"""The laws of a comparison, each with the gains that a search found for it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_analysis.output.text import join, number
from auv_analysis.runs.run import Hold
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import DivergedError
from auv_analysis.tuning.loops import measured
from auv_analysis.tuning.measures import Measures
from auv_analysis.tuning.search import Found, Goal, search
from auv_analysis.tuning.space import BEST, EDGE, Space, make_space
from auv_gvc_controller.control.gains import body_gains, sampled_rate
from auv_gvc_controller.laws.law import SHIPPED, make_gains
from auv_gvc_controller.laws.model import ControlModel, control_model

POINTS = 1024  # of a Sobol sequence


@dataclass(frozen=True)
class Request:
    """What is asked of a tuning.

    Attributes
    ----------
    scenario : of `load_scenario`
    reference : name of the controller whose effort, or error, is to be met
    laws : that are tuned, keys of `SHIPPED`
    equal, index, tolerance : see `Goal`
    structure : a key of `STRUCTURES`, or 'best'
    hold : 'continuous' or 'zoh'
    seed : of the search
    threads : how many to use

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


@dataclass(frozen=True, eq=False)
class Rival:
    """A law with the gains that were found for it.

    Attributes
    ----------
    law : its name
    best : search in the structure that came out best
    searches : of all structures

    """

    law: str
    best: Found
    searches: Sequence[Found]

    @property
    def entry(self) -> dict[str, Any]:
        """Law and gains as a scenario file gives them."""
        return self.best.space.entry(self.best.x)

    def remarks(self, duration: float) -> list[str]:
        """What a reader of the gains must know: bounds of the search, an adaptation without effect.

        An adaptation whose slowest and fastest rates, the eigenvalues of K_D^-1 K_f, are below the
        inverse of the run's length does not act in it.
        """
        space, x = self.best.space, self.best.x
        on = [f'{name} ({side})' for name, side in space.at_bound(x).items()]
        found = [f'at a bound of the search: {join(on)}'] if on else []
        if space.room(x[None])[0] < EDGE:
            found.append('its velocity loop is as fast as the control period allows')
        gains = {name: value for name, value in self.entry.items() if name != 'law'}
        K_D, K_f = body_gains(make_gains(self.law, gains), space.model)
        fastest = float(np.abs(np.linalg.eigvals(np.linalg.solve(K_D, K_f))).max())
        if 0 < fastest * duration < 1:
            found.append(
                'its adaptation is switched off: K_f / K_D is at most '
                f'{number(fastest, 2)} 1/s, slower than the run of {duration:g} s'
            )
        return found


def goal_of(request: Request) -> Goal:
    """Goal that a request's reference sets.

    Raises
    ------
    DivergedError : the reference's own loop diverges

    """
    scenario, name = request.scenario, request.reference
    found = measured(scenario, name, {}, request.hold, request.threads)
    if np.isnan(found.error[0]):
        raise DivergedError(f'{scenario.name}, {name}: the reference diverges: nothing to equal')
    return Goal(request.equal, request.index, found, request.tolerance)


def structures_of(structure: str) -> tuple[str, ...]:
    """Structures that are searched; six numbers begin at the best multiple of M's diagonal."""
    return {BEST: ('scalar', 'mass'), 'diagonal': ('mass', 'diagonal')}.get(structure, (structure,))


def tuned(
    request: Request, law: str, goal: Goal, progress: Callable[[], None] = lambda: None
) -> Rival:
    """Tune one law.

    Parameters
    ----------
    request : what is asked
    law : key of `SHIPPED`
    goal : of `goal_of`
    progress : called after each structure

    Returns
    -------
    rival : the best of its structures: of those that reach equality the one with the least of what
        is made small, else the one nearest to equality

    """
    scenario = request.scenario
    model, fastest = control_model(scenario.vehicle), _fastest(request)
    searches: list[Found] = []
    for structure in structures_of(request.structure):
        space = make_space(law, structure, model, scenario.step, fastest)
        starts = starts_of(space, scenario, request.reference, model)
        points = POINTS
        if structure == 'diagonal':
            starts.append(space.nearest(searches[0].space.entry(searches[0].x)))
            points = 0
        searches.append(
            search(
                space, evaluator(request, space), goal, points=points, seed=request.seed,
                starts=starts,
            )
        )  # fmt: skip
        progress()
    best = min(searches, key=lambda found: _rank(found, goal))
    return Rival(law, best, tuple(searches))


def evaluator(request: Request, space: Space) -> Callable[[Mapping[str, np.ndarray]], Measures]:
    """Function from gains (B, ...) of a space's law to measures (B,) in the request's scenario."""
    law, middle = space.law, (space.low + space.high) / 2
    alone = changed_scenario(request.scenario, {'controllers': {law: space.entry(middle)}})
    return lambda gains: measured(alone, law, gains, request.hold, request.threads)


def starts_of(
    space: Space, scenario: Scenario, reference: str, model: ControlModel
) -> list[np.ndarray]:
    """Two points, whatever the law: next to the reference's gains, and the middle of the space."""
    meant = scenario.gain_values(reference)
    if scenario.controller(reference)['law'] != space.law:
        K_D, K_f = (np.diagonal(K) for K in body_gains(scenario.gains(reference), model))
        inertia = np.diagonal(np.reshape(model.dynamics.M, (6, 6)))
        unit = inertia if space.law == 'gvc' else 1.0  # GVC multiplies its gains by M itself
        shared = {k: v for k, v in meant.items() if k in ('k_I', 'Lambda')}
        fast = 'k_P' if space.law == 'pid' else 'k_D'
        meant = {fast: (K_D / unit).tolist(), 'Gamma': (K_f / unit).tolist(), **shared}
    return [space.nearest(meant), (space.low + space.high) / 2]


def _fastest(request: Request) -> float:
    """Rate that a velocity loop may have: that of the samples, or the reference's where above."""
    scenario = request.scenario
    K_D, _ = body_gains(scenario.gains(request.reference), control_model(scenario.vehicle))
    return max(1 / scenario.step, sampled_rate(K_D, scenario.vehicle.M)[0])


def _rank(found: Found, goal: Goal) -> tuple[bool, float]:
    small, same = goal.logs(found.measures)
    return not found.reached, float(small[0] if found.reached else abs(same[0]))


def is_shipped(scenario: Scenario, name: str) -> bool:
    """Whether a controller's law is one that can be tuned."""
    return scenario.controller(name)['law'] in SHIPPED
