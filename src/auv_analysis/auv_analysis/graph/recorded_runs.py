"""Recorded runs of a scenario's controllers on a domain of their own, read back from their bags."""

import json
import os
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from rich.progress import Progress, TaskID

from auv_analysis.bag.load import open_bag
from auv_analysis.graph.domain import ANNOUNCED, VARIABLE
from auv_analysis.graph.experiment import MODULES, environment, run_controller
from auv_analysis.graph.fork_server import ForkServer
from auv_analysis.graph.supervisor import Begin, NodeDiedError, TroubleError
from auv_analysis.output.folder import ResultsFolder
from auv_analysis.output.new_files import write
from auv_analysis.output.progress import Speed, bar, count, say, waiting
from auv_analysis.runs.run import Run
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import warm_up
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.files.yaml_files import parse_yaml, yaml_text


class FreeGraph(NamedTuple):
    """A domain that nobody else drives a vehicle on, and what is seen of it."""

    domain: int
    watcher: Any
    begin: Begin


@contextmanager
def free_graph(
    domain: int, picked: bool, scenario: Scenario, names: list[str]
) -> Iterator[FreeGraph]:
    """Join a domain, all loaded that its nodes need.

    Parameters
    ----------
    domain, picked : as of `own_domain`
    scenario, names : what is to run, and which of its controllers

    Raises
    ------
    InputError : somebody's vehicle is on the domain

    """
    os.environ.update(environment(domain))
    with waiting('loading or compiling the kernel'):
        warm_up(scenario, names)
    with ForkServer(MODULES) as nodes:
        # the middleware reads its environment when it is loaded
        from auv_dynamics.ros.participant import Watcher

        with closing(Watcher(domain)) as graph:
            if not picked:
                _refuse_strangers(graph, domain)
            yield FreeGraph(domain, graph, nodes.begin)


def recorded(
    scenario: Scenario,
    names: list[str],
    results: ResultsFolder,
    graph: FreeGraph,
    *,
    composed: bool = False,
) -> tuple[dict[str, Run], FailedError | None]:
    """Run controllers on the node graph, one after the other.

    Parameters
    ----------
    scenario : resolved scenario
    names : of its controllers
    results : folder of the bags, one per controller
    graph : the domain
    composed : all nodes in one process, else one each

    Returns
    -------
    runs : name -> run that came to its end
    failure : what went wrong first

    """
    out = results.folder
    say(f'export {VARIABLE}={graph.domain}')
    failure: FailedError | None = None
    done = []
    for name in names:
        with bar(count('steps'), Speed('steps'), keep=True) as shown:
            task = shown.add_task(f'{scenario.name} {name}', total=scenario.steps)
            show = partial(_show_step, shown, task)
            try:
                run_controller(scenario, name, out, *graph, show, composed=composed)
            except NodeDiedError as error:
                failure = error
                break  # the graph is broken; what was recorded is still worth a report
            except TroubleError as error:
                failure = failure or error  # the others may fare better
        done.append(name)
    if failure is not None and not out.is_dir():
        raise failure  # the results were removed under us: there is nothing to report
    if failure is None:
        for name in names:
            _move_paths(out / name / 'params.yaml', results)
    return {name: open_bag(out / name).run for name in done}, failure


def _move_paths(parameters: Path, results: ResultsFolder) -> None:
    """Let a parameter file name the files of the run where they lie in the end."""
    comment, _, body = parameters.read_text(encoding='utf-8').partition('\n')
    before, then = (json.dumps(str(path.resolve()))[1:-1] for path in results)
    text = json.dumps(parse_yaml(body, parameters, 'parameter')).replace(before, then)
    write(parameters, f'{comment}\n{yaml_text(json.loads(text))}'.encode())


def _refuse_strangers(graph: Any, domain: int) -> None:
    from auv_dynamics.ros.endpoints import UNNAMED

    until = time.monotonic() + ANNOUNCED
    strangers: list[str] = []
    while not strangers and time.monotonic() < until:
        graph.spin(0.1)
        strangers = graph.endpoints()
    if strangers:
        named = time.monotonic() + ANNOUNCED  # the names of nodes arrive behind their endpoints
        while any(UNNAMED in one for one in strangers) and time.monotonic() < named:
            graph.spin(0.1)
            strangers = graph.endpoints() or strangers
        expected = 'a domain without endpoints on wrench or odom'
        raise InputError(f'{VARIABLE}={domain}', '', expected, ', '.join(strangers))


def _show_step(shown: Progress, task: TaskID, step: int) -> None:
    shown.update(task, completed=step)
