"""Compile what the tests call, once and before they start: workers would do it side by side.

Two processes share it, as there are two cores on a small machine.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import yaml

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.rollouts import rollouts
from auv_analysis.scenario import Scenario
from auv_analysis.warm_up import warm_up

SOURCES = {'case1': ('gvc', 'cl'), 'faults_bluerov2_heavy': ('pid', 'smc')}  # every law once
HOLDS = ('zoh', 'continuous')
STEPS = 20


def shortened(name: str, folder: Path) -> Scenario:
    """A shipped scenario of a few steps, without what acts on samples alone."""
    scenario = load_scenario(name)
    data = {**scenario.data, 'vehicle': str(scenario.vehicle_path)}
    for key in ('faults', 'actuators', 'sensors'):
        data.pop(key, None)
    path = folder / f'{name}.yaml'
    path.write_text(yaml.safe_dump({**data, 'duration': STEPS * scenario.step}))
    return load_scenario(path)


def compile_sampled(name: str) -> None:
    """What nodes, the sampled simulation and the figures of a run call, for the laws of `name`."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = shortened(name, Path(folder))
        warm_up(load_scenario(name), list(SOURCES[name]))
        for law in SOURCES[name]:
            summarize(simulate(scenario, law, 'zoh'))


def compile_all(name: str) -> None:
    """What everything else calls as well, for the laws of `name`."""
    compile_sampled(name)
    with tempfile.TemporaryDirectory() as folder:
        scenario = shortened(name, Path(folder))
        for law in SOURCES[name]:
            simulate(scenario, law, 'continuous')
            for hold in HOLDS:
                rollouts(scenario, law, {f'controllers.{law}.k_D': [10.0, 11.0]}, hold=hold)


def main() -> None:
    """Compile what a scenario is named for, or all, in processes of their own."""
    if sys.argv[1:]:
        compile_all(sys.argv[1])
        return
    started = [subprocess.Popen([sys.executable, __file__, name]) for name in SOURCES]
    sys.exit(max(process.wait() for process in started))


if __name__ == '__main__':
    main()
