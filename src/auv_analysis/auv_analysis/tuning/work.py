"""A tuning from request to outcome: search, check against `simulate`, draw, compare."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario, load_scenario, write_inputs
from auv_analysis.simulation.simulate import DivergedError, simulate
from auv_analysis.tuning.comparison import Comparison, compare
from auv_analysis.tuning.draws import Spread
from auv_analysis.tuning.measures import Measures, measures_of_run
from auv_analysis.tuning.monte_carlo import monte_carlo, of_each
from auv_analysis.tuning.outcome import Outcome
from auv_analysis.tuning.rivals import Request, Rival, goal_of, structures_of, tuned
from auv_dynamics.files.errors import FailedError

SAME = 1e-6  # relative: a batch and a single run differ by rounding alone
LONGEST = 100  # characters of a scenario's name
Progress = Callable[[str, int], Callable[[], None]]  # what is done, in how many parts -> a part is


@dataclass(frozen=True)
class Draws:
    """Draws that are asked for: how many, how far they go, and their seed."""

    samples: int
    spread: Spread
    seed: int


def work(request: Request, draws: Draws, out: Path, progress: Progress) -> Outcome:
    """Tune, check, draw and compare; `scenario.yaml` with its files is written before the draws.

    Raises
    ------
    DivergedError : the reference's own loop
    FailedError : single runs of the written scenario do not give what the search saw

    """
    goal = goal_of(request)
    rivals: dict[str, Rival] = {}
    for law in request.laws:
        advance = progress(f'tuning {law}', len(structures_of(request.structure)))
        rivals[_free(f'{law}_tuned', request.scenario)] = tuned(request, law, goal, advance)
    written = write_inputs(_with(request.scenario, rivals), out)
    scenario = load_scenario(written['scenario.yaml'])
    nominal = of_each(scenario, request.hold)
    deviation, largest = _checked(scenario, request, nominal, progress)
    found, compared = {}, []
    if draws.samples:
        advance = progress(f'{draws.samples} draws of model error and disturbance', draws.samples)
        found = monte_carlo(
            scenario, draws.spread, draws.samples, draws.seed, request.hold, request.threads,
            advance,
        )  # fmt: skip
        compared = _compared(request, scenario, rivals, found)
    return Outcome(
        request, goal, scenario, rivals, nominal, deviation, largest, draws.spread, found, compared
    )


def _free(name: str, scenario: Scenario) -> str:
    """The name, longer where the scenario has a controller of that name."""
    while name in scenario.controllers:
        name += '_again'
    return name


def _with(scenario: Scenario, rivals: Mapping[str, Rival]) -> Scenario:
    """The scenario with the tuned laws as further controllers, under a name of its own."""
    entries: dict[str, Any] = {name: rival.entry for name, rival in rivals.items()}
    name = f'{scenario.name[: LONGEST - len("_tuned")]}_tuned'
    values = {'name': name, 'controllers': {**scenario.controllers, **entries}}
    changed = changed_scenario(scenario, values)
    return replace(changed, attachments={**scenario.attachments, **changed.attachments})


def _checked(
    scenario: Scenario, request: Request, nominal: Mapping[str, Measures], progress: Progress
) -> tuple[float, dict[str, np.ndarray]]:
    """Largest relative deviation of single runs from the batch, and their largest commands (6,)."""
    advance = progress('checking against single runs', len(nominal))
    largest, commands = 0.0, {}
    for name, expected in nominal.items():
        try:
            run = simulate(scenario, name, request.hold)
        except DivergedError:
            found = Measures(*(np.full(1, np.nan) for _ in Measures._fields))
        else:
            found, commands[name] = measures_of_run(run), np.abs(run.tau).max(axis=0)
        deviations = [_deviation(a[0], b[0]) for a, b in zip(found, expected, strict=True)]
        largest = max(largest, *deviations)
        if largest > SAME:
            worst = Measures._fields[int(np.argmax(deviations))]
            text = f'expected what the batch gave, found {worst} apart by {largest:.2g}'
            raise FailedError(f'{scenario.name}, {name}: {text} (relative)')
        advance()
    return largest, commands


def _deviation(a: float, b: float) -> float:
    if a == b or (np.isnan(a) and np.isnan(b)):
        return 0.0
    return float(abs(a - b) / max(abs(a), abs(b))) if np.isfinite(a) and np.isfinite(b) else np.inf


def _compared(
    request: Request, scenario: Scenario, rivals: Mapping[str, Rival],
    found: Mapping[str, Measures],
) -> list[Comparison]:  # fmt: skip
    """Each controller against the reference, each tuned law against the reference's own, tuned."""
    reference = request.reference
    law = scenario.controller(reference)['law']
    own = next((name for name, rival in rivals.items() if rival.law == law), None)
    pairs = [(name, reference) for name in scenario.controllers if name != reference]
    if own is not None:
        pairs += [(name, own) for name in rivals if name != own]
    return compare(found, pairs)
