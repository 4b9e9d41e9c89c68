"""`auv simulate`: a scenario in this process, by the same kernel."""

import argparse
from typing import Any

from auv_analysis.cli.arguments import add_hold, add_no_report, add_scenario


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Scenario, and how its law is evaluated."""
    add_scenario(command)
    add_no_report(command)
    add_hold(command)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Simulate, analyse and report."""
    from auv_analysis.cli.scenario_runs import (
        finish,
        open_scenario,
        scenario_folder,
        simulated,
        warn,
    )
    from auv_analysis.runs.samples import ENDING
    from auv_analysis.simulation.simulate import check_hold

    scenario, names = open_scenario(options)
    check_hold(scenario, options.hold)
    with scenario_folder(options, scenario, names, ENDING) as results:
        warn(scenario, names)
        runs, failure = simulated(scenario, names, results.folder, options.hold)
        return finish(results.folder, runs, failure, scenario, report=not options.no_report)
