"""A run of `auv` from outside: its processes while it lasts, what its bag holds afterwards."""

import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import psutil
import yaml
from helpers.fork_server import NODES, Process
from helpers.node_processes import (
    environment,
    fork_server,
    fresh_domain,
    start_auv,
    start_installed_auv,
)
from helpers.patience import patience
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from auv_analysis import load_scenario, simulate
from auv_analysis.bag.load import load_run
from auv_analysis.runs.run import Run

ENOUGH = 150_000  # bytes of a bag in which there are steps
SIGNALS = ('eta', 'nu', 'nu_d', 'nu_d_dot', 'tau', 'disturbance', 'disturbance_estimate',
           'nu_measured', 'tau_applied')  # fmt: skip


def start(scenario: Path, out: Path, *options: str) -> Process:
    """Start `auv run`."""
    return start_auv('run', str(scenario), '--out', str(out), *options)


def start_installed(scenario: Path, out: Path, *options: str) -> subprocess.Popen:
    """Start the `auv run` of a user, whose nodes are its children."""
    return start_installed_auv('run', str(scenario), '--out', str(out), *options)


def record(scenario: Path, out: Path, *controllers: str, domain: int | None = None) -> Process:
    """Start the nodes of `auv run` and record, without the analysis and the report behind it."""
    environ = environment(fresh_domain() if domain is None else domain)
    return fork_server().start(['record', str(scenario), str(out), *controllers], environ)


def recorded(scenario: Path, out: Path, *controllers: str) -> Path:
    """Record to the end, all controllers or these; the folder."""
    process = record(scenario, out, *controllers)
    _, errors = process.communicate(timeout=patience(120))
    assert process.returncode == 0, errors
    return out


def long_run(folder: Path, steps: int) -> Path:
    """Case 1 of another length, GVC alone."""
    case1 = load_scenario('case1')
    controllers = {'gvc': case1.data['controllers']['gvc']}
    data = {**case1.data, 'vehicle': 'herman2018', 'controllers': controllers}
    path = folder / 'long.yaml'
    path.write_text(yaml.safe_dump({**data, 'name': 'long', 'duration': steps * case1.step}))
    return path


def nodes(folder: Path) -> dict[str, psutil.Process]:
    """Processes of the nodes of a run in this folder; its parameter file is in their commands."""
    found = {}
    for process in psutil.process_iter(['cmdline']):
        command = process.info['cmdline'] or []
        if any(str(folder) in part for part in command):
            names = [name for name in NODES for part in command if part.endswith(name)]
            found.update(dict.fromkeys(names, process))
    return found


def node_of(out: Path, name: str) -> psutil.Process:
    """A node of this run, once steps are being recorded."""
    limit = time.monotonic() + patience(60)
    while time.monotonic() < limit:
        bags = list(out.glob('*/*.mcap'))
        if bags and bags[0].stat().st_size > ENOUGH and name in (running := nodes(out)):
            return running[name]
        time.sleep(0.05)
    raise AssertionError(f'{name} does not run')


def both(out: Path, scenario: Path, controller: str = 'gvc') -> tuple[Run, Run]:
    """What was recorded of a controller, and what the simulation has of it."""
    return load_run(out / controller), simulate(load_scenario(scenario), controller, 'zoh')


def assert_same(recorded: Run, simulated: Run) -> None:
    """Nothing is missing, and every signal is the simulated one."""
    assert recorded.notes == ()
    for name in SIGNALS:
        a, b = getattr(recorded, name), getattr(simulated, name)
        assert a.shape == b.shape, name
        assert np.all(np.abs(a - b) <= 1e-9 * np.maximum(1, np.abs(b))), name


def raw_messages(bag: Path) -> Iterator[tuple[str, int, bytes]]:
    """Topic, log time and serialized message of everything in a bag, in the order of the file."""
    with next(bag.glob('*.mcap')).open('rb') as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            yield channel.topic, message.log_time, message.data


def every_message(bag: Path, *besides: str) -> dict[str, list]:
    """Everything in a bag but some topics: per topic log times and messages, as plain numbers."""
    found: dict[str, list] = defaultdict(list)
    with next(bag.glob('*.mcap')).open('rb') as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            if channel.topic not in besides:
                found[channel.topic].append((message.log_time, plain(decoded)))
    return found


def plain(value: object) -> object:
    """A decoded message as tuples, which can be compared."""
    if hasattr(value, '__slots__'):
        return tuple(plain(getattr(value, name)) for name in value.__slots__)
    return tuple(map(plain, value)) if isinstance(value, list | tuple) else value


def main() -> None:
    """Record controllers of a scenario, all where none is named."""
    from auv_analysis.graph.experiment import MODULES, run_controller
    from auv_analysis.graph.fork_server import ForkServer
    from auv_analysis.simulation.simulate import warm_up
    from auv_dynamics.ros.participant import Watcher

    path, out, *controllers = sys.argv[1:]
    scenario, domain = load_scenario(path), int(os.environ['ROS_DOMAIN_ID'])
    Path(out).mkdir()
    names = controllers or list(scenario.controllers)
    warm_up(scenario, names)
    with ForkServer(MODULES) as nodes, closing(Watcher(domain)) as graph:
        for name in names:
            run_controller(scenario, name, Path(out), domain, graph, nodes.begin, lambda _: None)
