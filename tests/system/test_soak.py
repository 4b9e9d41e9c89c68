"""Random scenarios on the node graph, and a recorder that is stopped and slowed at random.

`make soak COUNT=10 SEED=0 STEPS=1000000`; a scenario of run i is drawn by (SEED, i) and named after
both. Nothing may be lost or doubled, which is checked by reading the bag; the run that cannot keep
this promise says so.
"""

import contextlib
import os
import re
import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import psutil
import pytest
import yaml
from helpers.graph_runs import (
    assert_same,
    both,
    long_run,
    node_of,
    nodes,
    raw_messages,
    record,
    start,
)
from helpers.node_processes import auv
from helpers.patience import patience

from auv_analysis import load_scenario
from auv_analysis.bag.reading import read_bag
from auv_dynamics.ros import interface
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.vehicle import DOFS

COUNT = int(os.environ.get('AUV_GVC_COUNT', '10'))
SEED = int(os.environ.get('AUV_GVC_SEED', '0'))
STEPS = int(os.environ.get('AUV_GVC_STEPS', '1000000'))
DAY = float(os.environ.get('AUV_GVC_DAY', '86400'))  # s of vehicle time
VEHICLES = ('herman2018', 'herman2018_neutral', 'rexrov', 'bluerov2_heavy', 'girona500')
PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}


def drawn(i: int) -> dict:
    """A scenario of this run: vehicle, set-point, disturbances, actuators, sensors."""
    g = np.random.default_rng([SEED, i])

    def waves(size: float) -> dict:
        return {
            dof: {
                'offset': float(g.uniform(-size, size)),
                'terms': [{'amplitude': float(size), 'omega': float(g.uniform(0.2, 1.0))}],
            }
            for dof in DOFS
            if g.random() < 0.5
        }

    scenario = {
        'name': f'soak_{SEED}_{i}',
        'vehicle': str(g.choice(VEHICLES)),
        'duration': 30.0,
        'step': 0.01,
        'seed': int(g.integers(1000)),
        'initial': {
            'eta': g.uniform(-0.5, 0.5, 6).tolist(),
            'nu': g.uniform(-0.2, 0.2, 6).tolist(),
        },
        'controllers': {'gvc': {'law': 'gvc', **PAPER}},
        'setpoint': waves(0.3),
        'disturbance': [{'kind': 'harmonic', **waves(3.0)}],
    }
    if g.random() < 0.5:
        scenario['disturbance'] += [
            {'kind': 'current', 'velocity': g.uniform(-0.3, 0.3, 3).tolist()}
        ]
    if g.random() < 0.5:
        scenario['actuators'] = {'limit': 5e3, 'lag': 0.05, 'delay': 0.02}
    if g.random() < 0.5:
        scenario['sensors'] = {'velocity_noise': 0.001, 'drop_out': 0.1}
    return scenario


@pytest.mark.long
@pytest.mark.parametrize('i', range(COUNT))
def test_a_random_run_loses_nothing_and_equals_its_simulation(i: int, tmp_path: Path) -> None:
    path = tmp_path / 'drawn.yaml'
    path.write_text(yaml.safe_dump(drawn(i)))
    ended = auv('run', str(path), '--out', str(tmp_path / 'out'))
    assert ended.returncode == 0, ended.stderr
    scenario = load_scenario(path)
    contents = read_bag(tmp_path / 'out' / 'gvc', decode=False)
    for topic in interface.STEP_TOPICS:
        assert contents.counts[f'/{topic}'] == scenario.steps + 1, topic
    assert contents.counts['/analysis/lumped_error'] == scenario.steps // 10 + 1
    assert_same(*both(tmp_path / 'out', path))


def ended_within(process: subprocess.Popen, seconds: float) -> bool:
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def hold_up(recorder: psutil.Process, process: subprocess.Popen, sizes: list[dict]) -> Counter:
    """Stop and slow the recorder at random until the run ends; how often each was done."""
    g = np.random.default_rng([SEED, 1])
    done: Counter = Counter()
    running = nodes(Path(recorder.cmdline()[-1]).parent)
    try:
        while not ended_within(process, g.uniform(0.1, 1.5)):
            sizes.append({name: node.memory_info().rss / 1e6 for name, node in running.items()})
            kind = ('stop', 'slow')[len(done)] if len(done) < 2 else str(g.choice([*done]))
            longest = 2.5 if g.random() < 0.9 else 10.0
            pauses = [g.uniform(0.1, longest)] if kind == 'stop' else g.uniform(0.01, 0.06, 15)
            for pause in pauses:
                recorder.suspend()
                try:
                    ended_within(process, pause)
                finally:
                    recorder.resume()
                if ended_within(process, 0.01):
                    break
            done[kind] += 1
    except psutil.NoSuchProcess:
        process.wait(timeout=patience(300))
    return done


def assert_every_step_once(bag: Path, steps: int, step_ns: int) -> None:
    """Each step topic carries the steps 0 ... n in order, analysis every tenth of them."""
    topics = {f'/{topic}': 1 for topic in interface.STEP_TOPICS}
    topics |= {f'/{topic}': 10 for topic in interface.ANALYSIS_TOPICS} | {interface.CLOCK: 1}
    count: Counter = Counter()
    for topic, log_time, data in raw_messages(bag):
        if topic in topics:
            expected = count[topic] * topics[topic] * step_ns
            assert first_stamp(data) == log_time == expected, (topic, count[topic])
            count[topic] += 1
    assert count == {topic: steps // every + 1 for topic, every in topics.items()}


def held_up_run(folder: Path, steps: int, begin: Callable = start) -> list[dict]:
    """Run so many lock-steps with the recorder held up, check the bag; the nodes' sizes in MB."""
    scenario, out = long_run(folder, steps), folder / 'out'
    process = begin(scenario, out)
    sizes: list[dict] = []
    done = hold_up(node_of(out, 'recorder_node'), process, sizes)
    assert process.returncode == 0, process.stderr.read()
    assert done['stop'], done
    assert done['slow'], done
    assert_every_step_once(out / 'gvc', steps, load_scenario(scenario).step_ns)
    return sizes


@pytest.mark.long
def test_a_recorder_stopped_and_slowed_at_random_loses_and_doubles_nothing(tmp_path: Path) -> None:
    held_up_run(tmp_path, 10_000, record)
    assert_same(*both(tmp_path / 'out', tmp_path / 'long.yaml'))


@pytest.mark.long
def test_a_million_steps_lose_and_double_nothing_in_bounded_memory(tmp_path: Path) -> None:
    assert_flat(held_up_run(tmp_path, STEPS, record))


@pytest.mark.long
def test_a_day_of_vehicle_time_keeps_its_memory(tmp_path: Path) -> None:
    """At 20 Hz, in lock-step: no node holds more than in the first third."""
    path, out = long_run(tmp_path, 0), tmp_path / 'out'
    data = yaml.safe_load(path.read_text()) | {'step': 0.05, 'duration': DAY}
    path.write_text(yaml.safe_dump(data))
    process = record(path, out)
    node_of(out, 'recorder_node')
    running, sizes = nodes(out), []
    with contextlib.suppress(psutil.NoSuchProcess):
        while not ended_within(process, 1.0):
            sizes.append({name: node.memory_info().rss / 1e6 for name, node in running.items()})
    _, errors = process.communicate(timeout=patience(120))
    assert process.returncode == 0, errors
    counts = read_bag(out / 'gvc', decode=False).counts
    assert all(counts[f'/{topic}'] == round(DAY / 0.05) + 1 for topic in interface.STEP_TOPICS)
    assert_flat(sizes)


def assert_flat(sizes: list[dict]) -> None:
    """No node grows by 20 MB from the first third of its samples to the last."""
    first, last = sizes[: len(sizes) // 3], sizes[-len(sizes) // 3 :]
    for node in sizes[0]:
        before, after = (max(sample[node] for sample in part) for part in (first, last))
        print(f'{node}: {before:.0f} MB in the first third, {after:.0f} MB in the last')
        assert after < before + 20.0, node


LOST = r'recorder_node ended with exit code 1\n.*expected (step|publication) .* lost'
SILENT = (
    r'plant_node ended with exit code 1\n.*'
    r'no answer on recorder/progress to step \d+ for 30 s; its publisher: recorder_node'
)


@pytest.mark.long
@pytest.mark.parametrize(('seconds', 'said'), [(27.0, f'{LOST}|{SILENT}'), (60.0, SILENT)])
def test_a_recorder_held_up_for_too_long_fails_loudly(
    tmp_path: Path, seconds: float, said: str
) -> None:
    """Longer than the middleware believes in it; longer than the plant waits."""
    out = tmp_path / 'out'
    process = start(long_run(tmp_path, 1_000_000), out)
    recorder = node_of(out, 'recorder_node')
    recorder.suspend()
    ended_within(process, seconds)
    if recorder.is_running() and process.poll() is None:
        recorder.resume()
    _, errors = process.communicate(timeout=patience(120))
    assert process.returncode == 1
    assert re.search(said, errors), errors
    assert not nodes(out)
