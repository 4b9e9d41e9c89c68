"""`auv run`: a scenario on real nodes, in lock-step, recorded; one run per controller."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from auv_analysis.bag.metadata import METADATA, ROOT, counts_in
from auv_analysis.graph.node_parameters import (
    ANALYSIS,
    CONTROLLER,
    PLANT,
    RECORDER,
    SETPOINT,
    WRENCH_TIMEOUT,
    node_parameters,
    parameter_file,
)
from auv_analysis.graph.supervisor import (
    Begin,
    NodeDiedError,
    Supervisor,
    TroubleError,
    executable,
)
from auv_analysis.scenario.scenario import Scenario, write_inputs
from auv_dynamics.files.yaml_files import read_yaml
from auv_dynamics.ros.interface import WRENCH
from auv_dynamics.ros.security import enclave, loopback

if TYPE_CHECKING:
    from auv_dynamics.ros.participant import Watcher

PACKAGES = {
    RECORDER: 'auv_analysis',
    PLANT: 'auv_dynamics',
    SETPOINT: 'auv_gvc_controller',
    CONTROLLER: 'auv_gvc_controller',
    ANALYSIS: 'auv_analysis',
}
OBSERVERS = (RECORDER, SETPOINT, ANALYSIS)  # nobody waits for an answer of theirs
COMPOSED = 'composed_graph'  # the executable that holds them all
MODULES = {
    name: f'{package}.nodes.{name}'
    for name, package in (*PACKAGES.items(), (COMPOSED, PACKAGES[RECORDER]))
}
START_TIMEOUT = 60.0  # s until the start barrier must be down
END_TIMEOUT = 30.0  # s for the recorder to close after the last step
SPIN = 0.1  # s between two looks at a run
SILENCE = 2 * WRENCH_TIMEOUT  # s: the plant names others first; it may be what has fallen silent


def environment(domain: int) -> dict[str, str]:
    """Environment of the nodes: loopback only, the domain."""
    return {
        **os.environ,
        **loopback(),
        'ROS_DOMAIN_ID': str(domain),
        'RCUTILS_COLORIZED_OUTPUT': '0',
        'PYTHONUNBUFFERED': '1',
    }


def run_controller(
    scenario: Scenario,
    controller: str,
    out: Path,
    domain: int,
    graph: 'Watcher',
    begin: Begin,
    progress: Callable[[int], None],
    *,
    composed: bool = False,
) -> Path:
    """Run one controller on the node graph and wait for its bag.

    Parameters
    ----------
    scenario : resolved scenario
    controller : name of one of its controllers
    out : folder of the results; the bag goes to out/<controller>
    domain : ROS domain id
    graph : the graph as seen from here, a `Watcher` of the same domain
    begin : what starts a process, as `psutil.Popen` does
    progress : told the last complete step whenever it changes
    composed : all nodes in one process, else one each

    Returns
    -------
    bag : folder of the closed bag

    Raises
    ------
    NodeDiedError : a node ended, did not start or fell silent; nothing is left running
    TroubleError : the run came to its end, its bag is whole, but the controller met an error

    """
    bag = out / controller
    bag.mkdir(parents=True)
    path = bag / 'params.yaml'
    inputs = {**write_inputs(scenario, out), 'params.yaml': path}
    parameters = node_parameters(
        scenario, controller, bag=bag.resolve(), vehicle=str(inputs['vehicle.yaml'].resolve()),
        attachments={name: file.resolve() for name, file in inputs.items()},
    )  # fmt: skip
    parameters[PLANT]['start_paused'] = True
    text = parameter_file(parameters, f'{scenario.name}, controller {controller}: auv run')
    path.write_text(text, encoding='utf-8')
    graph.complete_ns, graph.running = -1, False
    supervisor = Supervisor(out / 'logs' / controller, environment(domain), begin)
    last = COMPOSED if composed else RECORDER
    try:
        for name, package in ({COMPOSED: PACKAGES[RECORDER]} if composed else PACKAGES).items():
            arguments = [*enclave(name), '--params-file', str(path)]
            command = [str(executable(package, name)), *arguments]
            supervisor.start(name, command, observes=name in OBSERVERS)
        _start(supervisor, last, graph)
        _follow(supervisor, last, graph, scenario, progress)
        progress(step := _last_step(bag))
        if step < scenario.steps:  # a signal from elsewhere ends a node with exit code 0 as well
            lines = supervisor.last_lines(last)
            raise NodeDiedError(f'{last} ended at step {step} of {scenario.steps}{lines}')
        said = supervisor.complaints(COMPOSED if composed else CONTROLLER, CONTROLLER)
    finally:
        supervisor.stop(last)
    if said:
        raise TroubleError(
            f'{controller}: {CONTROLLER}: {said[0]}; see {out / "logs" / controller}'
        )
    return bag


def _start(supervisor: Supervisor, last: str, graph: 'Watcher') -> None:
    until = time.monotonic() + START_TIMEOUT
    while not graph.ask_to_run():
        graph.spin(0.05)
        if supervisor.check(may_end=last):  # a short run is over before its answer has come
            return
        if time.monotonic() > until:
            raise NodeDiedError(
                f'no start within {START_TIMEOUT:g} s: waiting for {graph.waits_for}'
            )


def _follow(
    supervisor: Supervisor,
    last: str,
    graph: 'Watcher',
    scenario: Scenario,
    progress: Callable[[int], None],
) -> None:
    """Show the progress until the process that ends last has ended well.

    A run that stands still goes on as long as all of its nodes publish their health: it is paused.
    """
    step, done_since, looks = -1, None, 0
    while not supervisor.check(may_end=last):
        graph.spin(SPIN)
        looks += 1  # and no clock, which goes on where all of this is stopped
        complete = graph.complete_ns // scenario.step_ns
        if complete > step:
            step, looks = complete, 0
            progress(step)
        elif looks > SILENCE / SPIN:
            if silent := PACKAGES.keys() - graph.alive:
                text = f'no step after {step} for {SILENCE:g} s, and no sign of life'
                raise NodeDiedError(f'{text} of {", ".join(sorted(silent))}')
            looks = 0
        if looks < SILENCE / SPIN / 2:
            graph.alive.clear()
        if step >= scenario.steps:
            done_since = done_since or time.monotonic()
            if time.monotonic() - done_since > END_TIMEOUT:
                raise NodeDiedError(f'{last} does not close the bag{supervisor.last_lines(last)}')


def _last_step(bag: Path) -> int:
    """Number of the last step whose wrench is in a closed bag; -1: of none."""
    return counts_in(read_yaml(bag / METADATA, 'metadata')[ROOT]).get(f'/{WRENCH}', 0) - 1
