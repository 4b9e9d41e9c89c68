"""Commands as people type them: a sweep of ten thousand rollouts, and what starting `auv` costs."""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import c_reference
import yaml
from bench_rollouts import BATCH, DURATION
from loops import CONTROLLER, SPREAD, VARIED, case1, in_c, nominal, varied
from measure import Measured, cost, interleaved, seconds

AUV = str(Path(sys.executable).with_name('auv'))
SWEEP = 10_000
CORES = 2  # that C is granted


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


def run(command: Sequence[str]) -> None:
    """Run a command to its end; RuntimeError with its last line when it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.splitlines() or ['no message'])[-1]
        raise RuntimeError(f'{" ".join(command)}: exit code {done.returncode}: {last}')
