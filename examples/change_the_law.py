"""Start the five nodes by hand, once per law, and compare the two bags.

    .venv/bin/python examples/change_the_law.py --scenario case1 --out runs/by_hand

The nodes are started by `ros2 run` where that command exists, else by the executables that it
would start. Between the two runs only the controller's parameter `law` changes.
"""

import argparse
import os
import shutil
import subprocess
from pathlib import Path

from auv_analysis import load_run
from auv_analysis.graph.experiment import PACKAGES, environment, write_inputs
from auv_analysis.graph.node_parameters import (
    CONTROLLER,
    RECORDER,
    node_parameters,
    parameter_file,
)
from auv_analysis.graph.supervisor import executable
from auv_analysis.metrics.summary import summarize
from auv_analysis.scenario.scenario import Scenario, load_scenario
from auv_dynamics.vehicle import DOFS

LAWS = ('gvc', 'cl')


def command(package: str, node: str) -> list[str]:
    """How a node is started here."""
    if shutil.which('ros2'):
        return ['ros2', 'run', package, node]
    return [str(executable(package, node))]


def record(scenario: Scenario, law: str, bag: Path, domain: int) -> None:
    """Run the graph with one law and wait for the recorder."""
    files = {name: path.resolve() for name, path in write_inputs(scenario, bag.parent).items()}
    path = bag.with_suffix('.yaml').resolve()
    parameters = node_parameters(
        scenario,
        next(iter(scenario.controllers)),
        bag=bag.resolve(),
        attachments={**files, 'params.yaml': path},
    )
    parameters[CONTROLLER]['law'] = law
    path.write_text(parameter_file(parameters, 'written by examples/change_the_law.py'))
    processes = {}
    for node, package in PACKAGES.items():
        arguments = ['--ros-args', '--params-file', str(path)]
        processes[node] = subprocess.Popen(
            [*command(package, node), *arguments], env=environment(domain), start_new_session=True
        )
    try:
        # the recorder leaves when it has every step; the others stay until they are told
        if processes[RECORDER].wait() != 0:
            raise SystemExit(f'{law}: the recorder failed')
    finally:
        for process in processes.values():
            if process.poll() is None:
                os.killpg(process.pid, 15)  # the group: `ros2 run` keeps the node as its child
        for process in processes.values():
            process.wait()


def main() -> None:
    """Record both laws and print where they differ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--scenario', default='case1')
    parser.add_argument('--out', type=Path, default=Path('runs/by_hand'))
    parser.add_argument('--domain-id', type=int, default=71)
    options = parser.parse_args()
    options.out.mkdir(parents=True)
    scenario = load_scenario(options.scenario)
    errors = {}
    for law in LAWS:
        record(scenario, law, options.out / law, options.domain_id)
        run = load_run(options.out / law)
        print(f'{law}: {len(run.t)} steps recorded, law {run.law}')
        errors[law] = summarize(run)['velocity_error']['rms']
    print(f'{"rms error":>10} {"gvc":>10} {"cl":>10}')
    for i, dof in enumerate(DOFS):
        print(f'{dof:>10} {errors["gvc"][i]:>10.5f} {errors["cl"][i]:>10.5f}')


if __name__ == '__main__':
    main()
