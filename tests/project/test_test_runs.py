"""What a run of the tests promises: it hangs on nothing, passes over nothing in silence."""

import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from helpers import needs
from helpers.fork_server import OWNER
from helpers.node_processes import fork_server
from helpers.patience import patience

TESTS = Path(__file__).resolve().parents[1]
MADE = """
import time
import warnings

import pytest
from helpers.needs import need


def test_hangs():
    time.sleep(600)


def test_warns():
    warnings.warn('odd')


def test_of_a_browser():
    need('chromium', None)


def test_of_another_shell():
    need('fish', None)


def test_of_ros():
    need('ros2', None)


def test_for_no_reason():
    pytest.skip('not today')
"""


@pytest.fixture(scope='module')
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Outcomes of tests, and all that is said, as on a CI that could not install fish."""
    path = tmp_path_factory.mktemp('made') / 'test_made.py'
    path.write_text(MADE)
    command = [
        sys.executable,
        '-m',
        'pytest',
        '-p',
        'conftest',
        '-c',
        TESTS.parent / 'pyproject.toml',
    ]
    environ = {
        **os.environ, 'PYTHONPATH': str(TESTS), 'AUV_GVC_PATIENCE': '0.005', 'AUV_GVC_STRICT': '1',
        'AUV_GVC_ABSENT': 'fish', 'PYTEST_ADDOPTS': '',
    }  # fmt: skip
    done = subprocess.run(
        [*command, '-v', '-p', 'no:cacheprovider', path],
        env=environ, capture_output=True, text=True, check=False,
    )  # fmt: skip
    lines = [line.split() for line in done.stdout.splitlines() if '::' in line and '%]' in line]
    return {'': done.stdout} | {line[0].partition('::')[2]: line[1] for line in lines}


def test_a_test_that_hangs_ends_by_its_name(told: dict[str, str]) -> None:
    assert told['test_hangs'] == 'FAILED'
    assert 'Timeout (>3.0s)' in told['']


def test_a_warning_is_an_error(told: dict[str, str]) -> None:
    assert told['test_warns'] == 'FAILED'


def test_a_skip_fails_but_for_what_ci_cannot_have(told: dict[str, str]) -> None:
    found = {name: told[name] for name in told if name.startswith(('test_of', 'test_for'))}
    assert found == {
        'test_of_a_browser': 'FAILED', 'test_of_another_shell': 'SKIPPED',
        'test_of_ros': 'SKIPPED', 'test_for_no_reason': 'FAILED',
    }  # fmt: skip
    for name in ('chromium', 'fish', 'ros2'):
        assert needs.NEEDS[name].unproven in told['']
    assert 'not today' in told['']


KILLED = """
import os
from helpers.node_processes import fresh_domain, start_node

if __name__ == '__main__':
    node = start_node('setpoint_node', fresh_domain())
    assert 'begins' in node.stdout.readline()
    print(node.pid, flush=True)
    os.killpg(0, 9)
"""


def test_a_run_that_is_killed_leaves_none_of_its_programs(tmp_path: Path) -> None:
    script = tmp_path / 'killed_run.py'
    script.write_text(KILLED)
    run = fork_server().start([str(script)], {**os.environ, OWNER: ''})  # which starts another one
    said, _ = run.communicate(timeout=patience(60))
    assert run.returncode == -9, said
    left, limit = int(said), time.monotonic() + patience(10)
    while psutil.pid_exists(left):
        assert time.monotonic() < limit
        time.sleep(0.01)
