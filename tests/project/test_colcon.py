"""The workspace as colcon installs it: the same run as from the checkout, on its own nodes."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.graph_runs import SIGNALS
from helpers.node_processes import fresh_domain, installed_auv

from auv_analysis.bag.load import load_run

pytestmark = pytest.mark.long  # builds the workspace and compiles the kernels in it

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(sys.executable).parent


def run(script: str, folder: Path, **extra: str) -> str:
    """What a script of bash prints, with the tools of this environment."""
    environ = {**os.environ, 'PATH': f'{BIN}:{os.environ["PATH"]}', **extra}
    done = subprocess.run(
        ['bash', '-ec', script], cwd=folder, env=environ, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope='module')
def install(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The install tree of a build that copies, as for users."""
    folder = tmp_path_factory.mktemp('colcon')
    bases = '--build-base build --install-base install'
    build = f'{sys.executable} -m colcon --log-base log build --base-paths {ROOT}/src {bases}'
    run(build, folder, AMENT_PREFIX_PATH=str(BIN.parent))
    return folder / 'install'


def sourced(install: Path, command: str, **extra: str) -> str:
    return run(f'. {install}/local_setup.bash; {command}', install.parent, **extra)


def test_it_runs_from_there_alone(install: Path) -> None:
    for package in ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis'):
        found = sourced(install, f'python -c "import {package}; print({package}.__file__)"')
        assert found.startswith(str(install)), found


def test_colcon_test_finds_the_tests_of_every_package(install: Path) -> None:
    bases = f'--base-paths {ROOT}/src --build-base build --install-base install'
    options = f'{bases} --return-code-on-test-failure --pytest-args --collect-only -q'
    sourced(install, f'{sys.executable} -m colcon --log-base log test {options}')


def test_case1_is_that_of_the_checkout_to_the_last_bit(install: Path, tmp_path: Path) -> None:
    executable = install / 'auv_analysis/lib/auv_analysis/auv'
    options = 'run case1 --no-report --out'
    extra = {'ROS_DOMAIN_ID': str(fresh_domain())}
    sourced(install, f'{executable} {options} {tmp_path}/installed', **extra)
    ended = installed_auv(*options.split(), str(tmp_path / 'checkout'))
    assert ended.returncode == 0, ended.stderr
    for name in ('gvc', 'cl'):
        theirs, ours = (load_run(tmp_path / place / name) for place in ('installed', 'checkout'))
        assert theirs.notes == ours.notes == ()
        for signal in SIGNALS:
            a, b = getattr(theirs, signal), getattr(ours, signal)
            assert (a is None) == (b is None)
            assert a is None or np.array_equal(a, b), signal
