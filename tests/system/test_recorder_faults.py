"""`auv run` when its recorder or its disk gives way: the cause is named, the rest is kept."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pytest
import yaml
from helpers.damaged_bags import seen_by_rosbags
from helpers.disks import small_disk
from helpers.graph_runs import node_of, nodes, start
from helpers.needs import need
from helpers.node_processes import auv
from helpers.patience import patience

from auv_analysis.bag.load import load_run
from auv_analysis.bag.reading import read_bag
from auv_analysis.graph.supervisor import NodeDiedError, Supervisor
from auv_dynamics.ros import interface

GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
SCENARIO = {
    'name': 'faults', 'vehicle': 'herman2018', 'duration': 600.0, 'step': 0.01,
    'controllers': {'gvc': {'law': 'gvc', **GAINS}},
    'setpoint': {'surge': {'offset': 0.5, 'terms': [{'amplitude': 0.1, 'omega': 0.5}]}},
    'disturbance': {'kind': 'herman2018'},
}  # fmt: skip
SOON = patience(10.0)  # s, within which a run ends that has lost its recorder


def write(path: Path, **changes: object) -> Path:
    path.write_text(yaml.safe_dump({**SCENARIO, **changes}, sort_keys=False))
    return path


def ended(process: subprocess.Popen, out: Path, *words: str, within: float = SOON) -> str:
    """Wait for the end of a run that has failed: exit code 1, these words, nobody stays."""
    _, errors = process.communicate(timeout=within)
    assert process.returncode == 1, errors
    assert 'recorder_node ended with exit code' in errors
    for word in words:
        assert word in errors
    assert 'Traceback' not in errors
    assert not nodes(out)
    return errors


def steps_of(bag: Path) -> int:
    """Number of steps from the first one without a gap, of every step topic."""
    counts = set()
    for topic, (stamps, _) in read_bag(bag).messages.items():
        assert np.array_equal(stamps, np.arange(len(stamps)) * 10_000_000), topic
        counts.add(len(stamps))
    return min(counts)


@pytest.mark.long  # test_kills has one of the recorder alone
@pytest.mark.parametrize('composed', [False, True])
def test_a_recorder_that_is_killed(tmp_path: Path, composed: bool) -> None:
    """The bag is repaired, and analysed as any other."""
    out = tmp_path / 'out'
    process = start(write(tmp_path / 's.yaml'), out, *['--composed'] * composed)
    name = 'composed_graph' if composed else 'recorder_node'
    node_of(out, name).kill()
    _, errors = process.communicate(timeout=SOON)
    assert process.returncode == 1
    assert f'{name} ended with exit code -9' in errors
    assert not nodes(out)
    bag = out / 'gvc'
    assert not (bag / 'metadata.yaml').exists()
    kept = steps_of(bag)
    assert 'was not finished' in ' '.join(load_run(bag).notes)
    repaired = auv('recover', str(bag), '--json')
    assert repaired.returncode == 0, repaired.stderr
    document = json.loads(repaired.stdout)
    assert document['files'][0]['state'] == 'repaired'
    assert (bag / 'gvc_0.mcap.damaged').is_file()
    for topic in interface.STEP_TOPICS:
        entry = document['topics'][f'/{topic}']
        assert entry['messages'] >= kept
        assert entry['spacing']['gaps'] == 0
    assert 'was not finished' not in ' '.join(load_run(bag).notes)
    assert sum(seen_by_rosbags(bag).values()) == document['messages']
    analysed = auv(
        'analyze', str(bag), '--out', str(tmp_path / 'analysed'), '--json', '--no-report'
    )
    assert analysed.returncode == 0, analysed.stderr
    (summary,) = json.loads(analysed.stdout).values()
    assert summary['samples'] == len(load_run(bag).t) > 10


@pytest.mark.long
def test_what_was_finished_before_is_still_reported(tmp_path: Path) -> None:
    """The recorder of the second controller is killed: the first has its summary and report."""
    controllers = {'one': {'law': 'gvc', **GAINS}, 'two': {'law': 'cl', **GAINS}}
    out = tmp_path / 'out'
    scenario = write(tmp_path / 's.yaml', duration=30.0, controllers=controllers)
    process = start(scenario, out)
    while not any((out / 'two').glob('*.mcap')):
        assert process.poll() is None
    found = [node for name, node in nodes(out / 'two').items() if name == 'recorder_node']
    found[0].send_signal(signal.SIGKILL)
    # the report of the first, whose kernels may have to be compiled, comes after the end of the run
    ended(process, out, 'recorder_node ended with exit code -9', within=patience(120.0))
    summary = json.loads((out / 'summary.json').read_text())
    assert summary.keys() == {'one'}
    assert 'another controller did not come to its end' in ' '.join(summary['one']['notes'])
    assert (out / 'report.html').is_file()


def remove_bag(out: Path) -> None:
    shutil.rmtree(out / 'gvc')


def remove_results(out: Path) -> None:
    shutil.rmtree(out)


@pytest.mark.long
@pytest.mark.parametrize('harm', [remove_bag, remove_results])
def test_a_bag_that_is_removed_under_the_recorder(
    tmp_path: Path, harm: Callable[[Path], None]
) -> None:
    out = tmp_path / 'out'
    process = start(write(tmp_path / 's.yaml'), out)
    node_of(out, 'plant_node')
    harm(out)
    cause = f'{out}/gvc/gvc_0.mcap: removed or renamed while it was being recorded'
    ended(process, out, 'recorder_node ended with exit code 1', cause)


@pytest.mark.long
def test_a_disk_that_fills_up(tmp_path: Path) -> None:
    """The guard ends the run while there is room for the summary of what was finished before."""
    controllers = {f'gvc{i}': {'law': 'gvc', **GAINS} for i in range(9)}
    with small_disk(tmp_path / 'disk', (32 << 10) + 1600) as disk:
        need('mounting', disk)
        out = disk / 'out'
        scenario = write(tmp_path / 's.yaml', duration=20.0, controllers=controllers)
        process = start(scenario, out)
        _, errors = process.communicate(timeout=patience(120))
        assert process.returncode == 1, errors
        assert 'recorder_node ended with exit code 1' in errors
        assert 'bytes free on its file system, storage.free_space asks for 33554432' in errors
        finished = json.loads((out / 'summary.json').read_text())
        assert 0 < len(finished) < 9
        last = out / f'gvc{len(finished)}'
        assert read_bag(last).notes == [], 'finished in good order'
        assert steps_of(last) > 0
        assert not nodes(out)


def test_a_node_that_cannot_even_say_so(tmp_path: Path) -> None:
    with small_disk(tmp_path / 'disk', 64) as disk:
        need('mounting', disk)
        with (disk / 'full').open('wb', buffering=0) as file, suppress(OSError):
            while True:
                file.write(bytes(4096))
        supervisor = Supervisor(disk / 'logs', dict(os.environ))
        supervisor.start('node', [sys.executable, '-c', 'print("why", flush=True)'])
        while not supervisor.ended():
            time.sleep(0.01)
        with pytest.raises(NodeDiedError, match=r'exit code 1\n.*: no space left'):
            supervisor.check('')
        supervisor.stop()


@pytest.mark.long
def test_a_quota_that_is_exceeded(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    process = start(write(tmp_path / 's.yaml'), out)
    recorder = node_of(out, 'recorder_node')
    size = next(out.glob('*/*.mcap')).stat().st_size + 60_000
    recorder.rlimit(psutil.RLIMIT_FSIZE, (size, size))
    ended(process, out, f'{out}/gvc/gvc_0.mcap: file too large')
    assert steps_of(out / 'gvc') > 10
    assert auv('recover', str(out / 'gvc')).returncode == 0
    assert 'was not finished' not in ' '.join(load_run(out / 'gvc').notes)
