"""The three packages as wheels of their sdists, installed where there is no checkout."""

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.long  # installs an environment and compiles the kernels in it

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')


def run(*command: object, cwd: Path) -> str:
    """What a command prints; nothing of the checkout or of this environment leads it astray."""
    kept = {k: v for k, v in os.environ.items() if k not in ('PYTHONPATH', 'VIRTUAL_ENV')}
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, env=kept, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope='module')
def dist(tmp_path_factory) -> Path:
    """Folder of sdists, and of wheels that were built from them."""
    out = tmp_path_factory.mktemp('dist')
    for package in PACKAGES:
        build = (sys.executable, '-m', 'build', '--no-isolation', '--outdir', out)
        run(*build, ROOT / 'src' / package, cwd=out)
    return out


@pytest.fixture(scope='module')
def home(dist, tmp_path_factory) -> Path:
    """An environment with the wheels and what they need at run time."""
    folder = tmp_path_factory.mktemp('home')
    run(sys.executable, '-m', 'venv', folder / 'env', cwd=folder)
    pip = (folder / 'env/bin/python', '-m', 'pip', 'install', '--quiet', '--no-compile')
    run(*pip, '-r', ROOT / 'requirements.txt', *dist.glob('*.whl'), cwd=folder)
    return folder


@pytest.mark.parametrize('package', PACKAGES)
def test_sdist_has_files_in_the_place_of_links(dist: Path, package: str) -> None:
    (path,) = dist.glob(f'{package}-*.tar.gz')
    with tarfile.open(path) as archive:
        members = [member for member in archive.getmembers() if not member.isdir()]
        assert members
        assert not [member.name for member in members if not member.isreg()]
        assert not [member.name for member in members if member.size == 0 and '.y' in member.name]


@pytest.mark.parametrize('package', PACKAGES)
def test_wheel_has_configuration_types_and_licence(dist: Path, package: str) -> None:
    (path,) = dist.glob(f'{package}-*.whl')
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    assert f'{package}/py.typed' in names
    assert [name for name in names if name.endswith('LICENSE')]
    for folder in (ROOT / 'src' / package).glob('config/*'):
        for file in (path for path in folder.rglob('*') if path.is_file()):
            shipped = f'share/{package}/config/{folder.name}/{file.relative_to(folder)}'
            assert [name for name in names if name.endswith(shipped)], shipped


def test_simulation_runs_without_the_checkout_with_the_same_figures(home: Path) -> None:
    auv = home / 'env/bin/auv'
    where = run(
        home / 'env/bin/python', '-c', 'print(__import__("auv_analysis").__file__)', cwd=home
    )
    assert where.startswith(str(home))
    run(auv, 'simulate', 'case1', '--no-report', cwd=home)
    ours = Path(sys.executable).parent / 'auv'
    run(ours, 'simulate', 'case1', '--no-report', '--out', home / 'ours', cwd=home)
    installed, checkout = (
        json.loads((home / folder / 'summary.json').read_text())
        for folder in ('runs/case1', 'ours')
    )
    assert installed == checkout
