"""Commands as people type them: a sweep of ten thousand rollouts, and what starting `auv` costs."""

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import c_reference
import psutil
import yaml
from bench_rollouts import BATCH, DURATION
from loops import CONTROLLER, SPREAD, VARIED, case1, in_c, nominal, varied
from measure import Measured, cost, interleaved, seconds

from auv_analysis.graph.domain import VARIABLE
from auv_analysis.graph.experiment import environment
from auv_analysis.graph.node_parameters import CONTROLLER as CONTROLLER_NODE

AUV = str(Path(sys.executable).with_name('auv'))
SWEEP = 10_000
CORES = 2  # that C is granted
PARAMETERS = str(Path(__file__).parents[1] / 'config' / 'params' / 'case1_gvc.yaml')
DOMAIN = 97  # of nodes that are started alone
BEGINS = 'begins: '  # what a node says when it is ready


def sweep() -> dict[str, Measured]:
    """`auv sweep` from its start to the last row, against C's time for as many on two cores."""
    loops, library = in_c(case1(DURATION), varied(BATCH)), c_reference.library()
    c = cost(lambda: c_reference.rollouts(library, loops), BATCH * CORES / SWEEP)
    with tempfile.TemporaryDirectory() as folder:
        campaign = _campaign(Path(folder))
        out = str(Path(folder) / 'out')
        command = [AUV, 'sweep', str(campaign), '--out', out, '--overwrite', '--json']
        return interleaved({'sweep_10k_vs_c': lambda: seconds(lambda: run(command))}, c, 's')


def _campaign(folder: Path) -> Path:
    """Write a campaign whose rollouts are like those of `varied`."""
    scenario = case1(DURATION)
    data = {**scenario.data, 'vehicle': str(scenario.vehicle_path)}
    case = folder / 'case1_brief.yaml'
    case.write_text(yaml.safe_dump(data, sort_keys=False), encoding='utf-8')
    around = {path: nominal(scenario, path) for path in VARIED}
    ranges = {
        path: {'uniform': {'from': value * (1 - SPREAD), 'to': value * (1 + SPREAD)}}
        for path, value in around.items()
    }
    campaign = {
        'name': 'sweep', 'scenario': str(case), 'controllers': [CONTROLLER],
        'vary': [{'random': ranges, 'count': SWEEP}],
    }  # fmt: skip
    path = folder / 'campaign.yaml'
    path.write_text(yaml.safe_dump(campaign, sort_keys=False), encoding='utf-8')
    return path


def command_line() -> dict[str, Measured]:
    """`auv --help` against an interpreter that does nothing."""
    runs = 21  # each takes some 50 ms, most of it the operating system's
    return interleaved(
        {'help_vs_python': cost(lambda: run([AUV, '--help']))},
        cost(lambda: run([sys.executable, '-c', 'pass'])),
        's',
        runs,
    )


def again() -> dict[str, Measured]:
    """Commands from their start to their end, s, with compiled kernels: each once unmeasured."""
    commands = {
        'case1_again_s': (['run', 'case1'], 3),
        'study_s': (['study', 'case1'], 3),
        'simulate_s': (['simulate', 'case1', '--no-report'], 5),
    }
    found: dict[str, Measured] = {}
    with tempfile.TemporaryDirectory() as folder:
        for key, (words, count) in commands.items():
            command = [AUV, *words, '--out', str(Path(folder) / key), '--overwrite']
            run(command)
            found[key] = _alone([seconds(partial(run, command)) for _ in range(count)])
    return found


def node_ready() -> dict[str, Measured]:
    """CPU time of a controller from its start until it tracks: of all nodes it needs most."""
    return {'node_ready_cpu_s': _alone([_ready_cpu() for _ in range(5)])}


def _ready_cpu() -> float:
    node = [str(Path(AUV).with_name(CONTROLLER_NODE)), '--ros-args', '--params-file', PARAMETERS]
    with psutil.Popen(
        node, env=environment(DOMAIN), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        try:
            began = any(BEGINS in line for line in process.stdout)
            spent = process.cpu_times()
        finally:
            process.kill()
    if not began:
        raise RuntimeError(f'{CONTROLLER_NODE} does not begin')
    return float(spent.user + spent.system)


def _alone(times: Sequence[float]) -> Measured:
    """Times in s that are compared with nothing."""
    spread = min(times), max(times)
    return Measured(statistics.median(times), 's', None, None, len(times), spread)


def run(command: Sequence[str]) -> None:
    """Run a command to its end as in a new terminal; RuntimeError with its last line when it fails.

    Where a domain is set, `auv run` first looks for 3 s whether somebody's vehicle is on it.
    """
    fresh = {name: value for name, value in os.environ.items() if name != VARIABLE}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=fresh)
    if done.returncode:
        last = (done.stderr.splitlines() or ['no message'])[-1]
        raise RuntimeError(f'{" ".join(command)}: exit code {done.returncode}: {last}')
