"""`auv run`: real nodes, in lock-step, recorded."""

import argparse
from typing import Any

from auv_analysis.cli.arguments import add_graph, add_no_report, add_scenario


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Scenario, and how its nodes are started."""
    add_scenario(command)
    add_no_report(command)
    add_graph(command)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run the nodes, record, analyse and report."""
    from auv_analysis.cli.scenario_runs import finish, open_scenario, scenario_folder, warn
    from auv_analysis.graph.domain import own_domain
    from auv_analysis.graph.recorded_runs import free_graph, recorded

    scenario, names = open_scenario(options)
    with (
        own_domain(options.domain_id) as domain,
        scenario_folder(options, scenario, names, '/*') as results,
        free_graph(*domain, scenario, names) as graph,
    ):
        warn(scenario, names)
        runs, failure = recorded(scenario, names, results, graph, composed=options.composed)
        return finish(results.folder, runs, failure, scenario, report=not options.no_report)
