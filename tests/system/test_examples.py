"""The examples run as a user would run them."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from helpers.needs import needing
from helpers.node_processes import auv, fresh_domain
from helpers.patience import patience

from auv_analysis.bag.load import load_run

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples'
GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}


def run(name: str, *arguments: str, cwd: Path) -> tuple[str, str]:
    """What an example says, and its errors."""
    ended = subprocess.run(
        [sys.executable, str(EXAMPLES / name), *arguments, '--domain-id', str(fresh_domain())],
        cwd=cwd, capture_output=True, text=True, timeout=patience(180), check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return ended.stdout, ended.stderr


@pytest.mark.long
def test_change_the_law(tmp_path: Path) -> None:
    scenario = {
        'name': 'short', 'vehicle': 'herman2018', 'duration': 3.0, 'step': 0.01,
        'controllers': {'gvc': {'law': 'gvc', **GAINS}}, 'setpoint': {'heave': {'offset': 0.5}},
    }  # fmt: skip
    path = tmp_path / 'short.yaml'
    path.write_text(yaml.safe_dump(scenario))
    output, _ = run('change_the_law.py', '--scenario', str(path), '--out', 'out', cwd=tmp_path)
    assert 'gvc: 301 steps recorded, law gvc' in output
    assert 'cl: 301 steps recorded, law cl' in output
    heave = next(line.split() for line in output.splitlines() if 'heave' in line)
    assert float(heave[2]) > float(heave[1]), 'the same gains are weaker without the inertia'
    assert load_run(tmp_path / 'out' / 'cl').law == 'cl'


def test_stub_driver_is_controlled(tmp_path: Path) -> None:
    for _ in range(3):
        output, errors = run('stub_driver.py', '--seconds', '3', cwd=tmp_path)
        if 'disengages: no ' not in errors:  # a watchdog: the machine stood still
            break
    reached = float(re.search(r'surge ([\d.]+)', output)[1])
    assert reached == pytest.approx(0.4, abs=0.05)


def test_the_law_of_the_readme_is_short() -> None:
    assert len((EXAMPLES / 'own_law.py').read_text().splitlines()) < 40


def test_own_law_runs_in_process_and_on_the_nodes(tmp_path: Path) -> None:
    for name in ('own_law.py', 'own_law.yaml'):
        text = (EXAMPLES / name).read_text()
        (tmp_path / name).write_text(text.replace('duration: 10.0', 'duration: 4.0'))
    reached = {}
    for how in (['simulate', '--hold', 'zoh'], ['run', '--composed']):
        options = (*how[1:], '--controller', 'mine', '--json', '--no-report', '--out', how[0])
        ended = auv(how[0], 'own_law.yaml', *options, cwd=tmp_path)
        assert ended.returncode == 0, ended.stderr
        assert 'ComputedTorque runs as plain Python' in ended.stderr
        reached[how[0]] = json.loads(ended.stdout)['mine']['velocity_error']
    assert reached['run']['rms'] == pytest.approx(reached['simulate']['rms'], rel=1e-9, abs=1e-12)
    assert 0 < reached['run']['rms'][0] < 0.2
    assert max(reached['run']['max_after_2s']) < 0.2


def test_a_law_that_fails_on_the_nodes_is_told_and_is_no_success(tmp_path: Path) -> None:
    text = (EXAMPLES / 'own_law.py').read_text()
    ahead, behind = text.split('    def wrench(', 1)
    body = behind.index('"""', behind.index('"""') + 3) + 3
    failing = f'{behind[:body]}\n        if t > 0.5:\n            raise RuntimeError("boom")\n'
    (tmp_path / 'own_law.py').write_text(f'{ahead}    def wrench({failing}{behind[body:]}')
    scenario = (EXAMPLES / 'own_law.yaml').read_text().replace('duration: 10.0', 'duration: 1.0')
    (tmp_path / 'own_law.yaml').write_text(scenario)
    options = '--composed', '--no-report', '--out', 'out'
    ended = auv('run', 'own_law.yaml', *options, cwd=tmp_path)
    assert ended.returncode == 1
    assert (
        'mine: controller_node: the law ComputedTorque failed: RuntimeError: boom' in ended.stderr
    )
    summaries = json.loads((tmp_path / 'out/summary.json').read_text())
    assert len(summaries) == 2, 'both runs are whole and summed up'
    assert 'boom' in summaries['mine']['notes'][0]


@needing('ros2', shutil.which('ros2'))
def test_ros2_run_finds_the_nodes() -> None:
    ended = subprocess.run(
        ['ros2', 'pkg', 'executables', 'auv_dynamics'], capture_output=True, text=True, check=True
    )
    assert 'plant_node' in ended.stdout
