"""`auv simulate`: a scenario in this process, by the same kernel."""

import argparse
from typing import Any

from auv_analysis.cli.conclude import Outcome, finish
from auv_analysis.cli.scenarios import open_scenario, scenario_folder
from auv_analysis.output.folder import Results
from auv_analysis.output.progress import waiting
from auv_analysis.runs.run import AnyRun
from auv_analysis.runs.samples import ENDING, write_samples
from auv_analysis.scenario.scenario import Scenario, write_inputs
from auv_analysis.simulation.simulate import check_hold
from auv_analysis.simulation.simulate import simulate as simulate_run
from auv_analysis.simulation.warm_up import announce


def simulate(options: argparse.Namespace) -> dict[str, Any]:
    """In this process, by the same kernel."""
    scenario, names = open_scenario(options)
    check_hold(scenario, options.hold)
    with scenario_folder(options, scenario, names, ENDING) as results:
        outcome = simulated(options, scenario, names, results)
        return finish(results.folder, *outcome, scenario, report=not options.no_report)


def simulated(
    options: argparse.Namespace, scenario: Scenario, names: list[str], results: Results
) -> Outcome:
    """Runs of this process, and the first failure."""
    out = results.folder
    write_inputs(scenario, out)
    announce(scenario, names)
    runs: dict[str, AnyRun] = {}
    failure = None
    for name in names:
        try:
            with waiting(f'{scenario.name} {name}: simulating'):
                run = simulate_run(scenario, name, options.hold)
        except ArithmeticError as error:  # it diverges, or a user's own law fails
            failure = failure or error
            continue
        runs[name] = run
        write_samples(run, out / f'{name}{ENDING}')
    return Outcome(runs, failure)
