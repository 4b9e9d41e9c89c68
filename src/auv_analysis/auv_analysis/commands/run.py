"""`auv run`: real nodes, in lock-step, recorded."""

import argparse
import os
import time
from functools import partial
from typing import Any

from rich.progress import Progress, TaskID

from auv_analysis.bag import open_bag
from auv_analysis.commands.conclude import Outcome, finish
from auv_analysis.commands.scenarios import open_scenario, prepare_out
from auv_analysis.console import say
from auv_analysis.domain import VARIABLE, chosen_domain
from auv_analysis.experiment import environment, run_controller
from auv_analysis.failure import FailedError
from auv_analysis.progress import Speed, bar, count, waiting
from auv_analysis.scenario import Scenario
from auv_analysis.supervisor import NodeDiedError, TroubleError
from auv_analysis.warm_up import warm_up
from auv_dynamics.files import InputError

DISCOVERY = 3.0  # s: discovery may take so long


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Real nodes, in lock-step, recorded."""
    scenario, names = open_scenario(options)
    return finish(*recorded(options, scenario, names), scenario, report=not options.no_report)


def recorded(options: argparse.Namespace, scenario: Scenario, names: list[str]) -> Outcome:
    """Runs of the node graph: the folder, the runs from their bags, what went wrong."""
    domain, picked = chosen_domain(options.domain_id)
    os.environ.update(environment(domain))
    # the middleware reads its environment when it is loaded
    from auv_dynamics.ros.watcher import Watcher

    graph = Watcher(domain)
    try:
        if not picked:
            _refuse_strangers(graph, domain)
        out = prepare_out(options, scenario, names)
        with waiting('loading or compiling the kernel'):
            warm_up(scenario, names)
        say(f'export {VARIABLE}={domain}')
        failure: FailedError | None = None
        done = []
        for name in names:
            with bar(count('steps'), Speed('steps'), keep=True) as shown:
                task = shown.add_task(f'{scenario.name} {name}', total=scenario.steps)
                show = partial(_show_step, shown, task)
                try:
                    run_controller(
                        scenario, name, out, domain, graph, show, composed=options.composed
                    )
                except NodeDiedError as error:
                    failure = error
                    break  # the graph is broken; what was recorded is still worth a report
                except TroubleError as error:
                    failure = failure or error  # the others may fare better
            done.append(name)
    finally:
        graph.close()
    if failure is not None and not out.is_dir():
        raise failure  # the results were removed under us: there is nothing to report
    return Outcome(out, {name: open_bag(out / name).run for name in done}, failure)


def _refuse_strangers(graph: Any, domain: int) -> None:
    until = time.monotonic() + DISCOVERY
    strangers: list[str] = []
    while not strangers and time.monotonic() < until:
        graph.spin(0.1)
        strangers = graph.endpoints()
    if strangers:
        graph.spin(0.5)  # the names of nodes arrive behind their endpoints
        strangers = graph.endpoints() or strangers
        expected = 'a domain without endpoints on wrench or odom'
        raise InputError(f'{VARIABLE}={domain}', '', expected, ', '.join(strangers))


def _show_step(shown: Progress, task: TaskID, step: int) -> None:
    shown.update(task, completed=step)
