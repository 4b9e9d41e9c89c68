"""kill -9 of any node at any time: the run ends and says so, nothing is left running or lost.

`make soak KILLS=200 SEED=0` makes so many, `make test` a hundredth of them; kill i of a seed is
always that of the same node at the same time.
"""

import os
import random
import time
from bisect import bisect_right
from pathlib import Path
from typing import NamedTuple

import psutil
import pytest
from helpers.fork_server import Process
from helpers.graph_runs import long_run, nodes
from helpers.node_processes import Peer, auv, fresh_domain, start_auv
from helpers.patience import patience

from auv_analysis.bag.load import load_run
from auv_analysis.graph.experiment import COMPOSED, PACKAGES
from auv_dynamics.ros import interface, topics

KILLS = int(os.environ.get('AUV_GVC_KILLS', '200'))
SEED = int(os.environ.get('AUV_GVC_SEED', '0'))
NAMES = (*PACKAGES, COMPOSED)
FLUSHED = patience(1.0)  # s of records that a kill may cost
STEPS = 1_000_000  # more than any of these runs sees


class Kill(NamedTuple):
    """What is killed when: s after it has appeared, or after the first steps were recorded."""

    name: str
    starting: bool
    after: float


def drawn(seed: int, i: int) -> Kill:
    """Kill i of a seed; each fourth one falls into the start of the run."""
    rng = random.Random(f'{seed} {i}')
    starting = rng.random() < 0.25
    return Kill(rng.choice(NAMES), starting, rng.uniform(0.0, 1.5 if starting else 4.0))


class Progress:
    """What the recorder has said that it has, and when."""

    def __init__(self, domain: int):
        self.peer = Peer(domain)
        self.times: list[float] = []
        self.steps: list[int] = []
        self.peer.node.create_subscription(
            topics.PROGRESS.type, topics.PROGRESS.name, self._hear, topics.one_at_a_time()
        )

    def _hear(self, message: object) -> None:
        self.times.append(time.monotonic())
        self.steps.append(interface.nanoseconds(message.stamp))

    def at(self, when: float) -> int:
        """Stamp of the last step that was complete by then, ns; -1 before the first."""
        i = bisect_right(self.times, when)
        return self.steps[i - 1] if i else -1


def killed(folder: Path, kill: Kill) -> tuple[float, Process, Progress]:
    """Start a run and kill one of its nodes: when that was."""
    domain, out = fresh_domain(), folder / 'out'
    progress = Progress(domain)
    options = ['--composed'] if kill.name == COMPOSED else []
    process = start_auv(
        'run', str(long_run(folder, STEPS)), '--out', str(out), *options, domain=domain
    )
    limit = time.monotonic() + patience(60)
    victim: psutil.Process | None = None
    while victim is None:
        assert time.monotonic() < limit, f'{kill.name} does not run'
        progress.peer.spin(0.02)
        if kill.starting or progress.steps:  # to look through all processes takes time
            victim = nodes(out).get(kill.name)
    progress.peer.spin(kill.after)
    when = time.monotonic()  # before it: the machine may stand still behind it
    victim.kill()
    return when, process, progress


def check_kill(folder: Path, kill: Kill, *options: str) -> str:
    """Kill, and see what was promised; what was left of the run. `options` of the analysis."""
    when, process, progress = killed(folder, kill)
    try:
        _, errors = process.communicate(timeout=patience(10))  # s, as promised
    finally:
        process.kill()
        progress.peer.close()
    assert process.returncode == 1, errors
    assert f'{kill.name} ended with exit code -9' in errors
    assert 'Traceback' not in errors
    assert not nodes(folder / 'out')
    before = progress.at(when - FLUSHED)
    bag = folder / 'out' / 'gvc'
    if before < 0 and not any(bag.glob('*.mcap')):
        return 'nothing was recorded'
    recovered = auv('recover', str(bag))
    if before < 0 and recovered.returncode == 1:
        return 'nothing to recover'
    assert recovered.returncode == 0, recovered.stderr
    try:
        run = load_run(bag)
    except ValueError:
        assert before < 0, 'steps were complete more than a second before'
        return 'no complete step'
    assert round(run.t[-1] * 1e9) >= before, f'{kill}: up to {before} ns it was complete'
    analysed = auv('analyze', str(bag), '--out', str(folder / 'analysis'), *options)
    assert len(run.t) < 3 or analysed.returncode == 0, analysed.stderr
    assert auv('recover', str(bag)).returncode == 0
    return 'recovered'


@pytest.mark.parametrize('i', [0, 1])
def test_a_killed_node_ends_the_run_and_costs_a_second_at_most(i: int, tmp_path: Path) -> None:
    kill = Kill(('recorder_node', 'controller_node')[i], starting=False, after=1.0)
    assert check_kill(tmp_path, kill, '--no-report') == 'recovered'


@pytest.mark.long
@pytest.mark.parametrize('i', range(KILLS))
def test_any_kill_at_any_time(i: int, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    kill = drawn(SEED, i)
    outcome = check_kill(tmp_path, kill)
    with capsys.disabled():
        when = 'in the start' if kill.starting else 'in the run'
        print(f'\nkill {i} of seed {SEED}: {kill.name}, {kill.after:.2f} s {when}: {outcome}')
