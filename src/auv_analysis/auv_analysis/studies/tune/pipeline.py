"""Tuning pipeline: search, check against `simulate`, Monte Carlo, paired comparison."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario, load_scenario, write_inputs
from auv_analysis.simulation.simulate import DivergedError, simulate
from auv_analysis.studies.tune.cost import Measures, measures_of_run, of_each
from auv_analysis.studies.tune.perturbations import Perturbations, monte_carlo
from auv_analysis.studies.tune.results import Tuning
from auv_analysis.studies.tune.search import Goal, Request, TunedLaw, structures_of, tuned
from auv_dynamics.files.errors import FailedError

SAME = 1e-6  # relative: a batch and a single run differ by rounding alone
LONGEST = 100  # characters of a scenario's name
Progress = Callable[[str, int], Callable[[], None]]  # what is done, in how many parts -> a part is


def tune(request: Request, asked: Perturbations, out: Path, progress: Progress) -> Tuning:
    """Tune, check, perturb and compare; `scenario.yaml` with its files is written to `out` first.

    Raises
    ------
    DivergedError : the reference's own loop
    FailedError : single runs of the written scenario do not give what the search saw

    """
    goal = Goal.of(request)
    laws: dict[str, TunedLaw] = {}
    for law in request.laws:
        advance = progress(f'tuning {law}', len(structures_of(request.structure)))
        laws[_free(f'{law}_tuned', request.scenario)] = tuned(request, law, goal, advance)
    written = write_inputs(_with(request.scenario, laws), out)
    scenario = load_scenario(written['scenario.yaml'])
    nominal = of_each(scenario, request.hold)
    deviation, commands = _checked(scenario, request, nominal, progress)
    draws: dict[str, Measures] = {}
    if asked.samples:
        advance = progress(f'{asked.samples} draws of model error and disturbance', asked.samples)
        draws = monte_carlo(scenario, asked, request.hold, request.threads, advance)
    return Tuning(request, goal, scenario, laws, nominal, deviation, commands, asked.spread, draws)


def _free(name: str, scenario: Scenario) -> str:
    """The name, longer where the scenario has a controller of that name."""
    while name in scenario.controllers:
        name += '_again'
    return name


def _with(scenario: Scenario, laws: Mapping[str, TunedLaw]) -> Scenario:
    """The scenario with the tuned laws as further controllers, under a name of its own."""
    entries: dict[str, Any] = {name: law.entry for name, law in laws.items()}
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
