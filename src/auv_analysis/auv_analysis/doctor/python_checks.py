"""Python, its packages, and the compiler of the kernels."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from auv_analysis.doctor.finding import Finding

OLDEST, NEWEST = (3, 11), (3, 13)
OURS = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')
MODULES = {  # of distributions that are imported under another name
    'pyyaml': 'yaml', 'pillow': 'PIL', 'jinja2': 'jinja2', 'salib': 'SALib',
    'mcap-ros2-support': 'mcap_ros2',
}  # fmt: skip
NODES = {
    'plant_node': 'auv_dynamics', 'controller_node': 'auv_gvc_controller',
    'setpoint_node': 'auv_gvc_controller', 'recorder_node': 'auv_analysis',
    'analysis_node': 'auv_analysis',
}  # fmt: skip
PATIENCE = 120.0  # s for all packages to be imported, from a cold disk
AGAIN = 'make setup'
TRIAL = """
import importlib, sys
for name in sys.argv[1:]:
    print('tries', name, flush=True)
    try:
        importlib.import_module(name)
    except BaseException as error:
        print('fails', name, f'{type(error).__name__}: {error}'.splitlines()[0], flush=True)
print('ended', flush=True)
"""


def python() -> Iterator[Finding]:
    """Its version, and whether it is that of an environment."""
    version = '.'.join(map(str, sys.version_info[:3]))
    good = OLDEST <= sys.version_info[:2] <= NEWEST
    words = f'{OLDEST[0]}.{OLDEST[1]} to {NEWEST[0]}.{NEWEST[1]}'
    advice = '' if good else f'make clean, then make setup PYTHON=... with Python {words}'
    yield Finding('Python', 'ok' if good else 'broken', f'{version}, {sys.executable}', advice)
    inside = sys.prefix != sys.base_prefix
    if not inside and not os.environ.get('ROS_DISTRO'):
        advice = 'make setup, then .venv/bin/auv; else other programs share these packages'
        yield Finding('environment', 'warning', 'no virtual environment', advice)
    active = os.environ.get('VIRTUAL_ENV')
    if active and inside and Path(active).resolve() != Path(sys.prefix).resolve():
        found = f'{active} is active, but this is {sys.prefix}'
        yield Finding('environment', 'warning', found, f'. {sys.prefix}/bin/activate')


def packages() -> Iterator[Finding]:
    """Whether every package that ours ask for is there, of a fitting version, and loads."""
    asked = {name: text for package in OURS for name, text in _asked(package)}
    missing = [text for name, text in asked.items() if _version(name) is None]
    wrong = [f'{name} {_version(name)}, not {text}' for name, text in asked.items()
             if name not in missing and not _fits(text)]  # fmt: skip
    modules = [MODULES.get(name, name.replace('-', '_')) for name in asked if _version(name)]
    failing = _failing([*modules, 'rclpy'])
    if missing:
        yield Finding('packages', 'broken', f'missing: {", ".join(missing)}', AGAIN)
    if wrong:
        yield Finding('packages', 'broken', f'wrong version: {"; ".join(wrong)}', AGAIN)
    for name, why in failing.items():
        advice = f'{AGAIN}; is there another {name} on PYTHONPATH or in the working folder?'
        yield Finding('packages', 'broken', f'{name} does not load: {why}', advice)
    if not (missing or wrong or failing):
        yield Finding('packages', 'ok', f'{len(asked)} and rclpy, of fitting versions')


def _asked(package: str) -> Iterator[tuple[str, str]]:
    """Names of what a distribution of ours requires, and the requirements themselves."""
    from packaging.requirements import Requirement

    for text in metadata.requires(package) or ():
        requirement = Requirement(text)
        if requirement.marker is None or requirement.marker.evaluate({'extra': ''}):
            yield requirement.name.lower(), text.partition(';')[0].strip()


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _fits(text: str) -> bool:
    from packaging.requirements import Requirement

    requirement = Requirement(text)
    version = _version(requirement.name)
    return version is None or requirement.specifier.contains(version, prereleases=True)


def _failing(modules: list[str]) -> dict[str, str]:
    """Modules that do not load, and why; in a process of its own, which they may bring down."""
    command = [sys.executable, '-c', TRIAL, *modules]
    tried = subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=PATIENCE, errors='replace'
    )
    lines = [line.split(' ', 2) for line in tried.stdout.splitlines()]
    failing = {words[1]: words[2] for words in lines if words[0] == 'fails' and len(words) == 3}
    if ['ended'] not in lines:
        last = next((words[1] for words in reversed(lines) if words[0] == 'tries'), 'Python')
        failing[last] = f'it ends the process with exit code {tried.returncode}'
    return failing


def compiler() -> Iterator[Finding]:
    """Whether kernels are compiled, and whether what was compiled is kept."""
    if _version('numba') is None:
        found = 'numba is not installed: kernels run as plain Python, a hundred times slower'
        yield Finding('numba', 'warning', found, AGAIN)
        return
    if os.environ.get('NUMBA_DISABLE_JIT', '0') not in ('', '0'):
        found = 'switched off by NUMBA_DISABLE_JIT: kernels run as plain Python, much slower'
        yield Finding('numba', 'warning', found, 'unset NUMBA_DISABLE_JIT')
        return
    yield Finding('numba', 'ok', str(_version('numba')))
    yield _kept()


def _kept() -> Finding:
    from contextlib import redirect_stderr
    from io import StringIO

    with redirect_stderr(StringIO()):  # it warns of what is said below
        from auv_dynamics.kernel.compile import cache_folder, is_private
    folder = cache_folder()
    try:
        if not is_private(folder):
            raise PermissionError('cannot be made, or others can write to it')
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        found = f'{folder}: {error.strerror or error}: kernels are compiled at every start'
        advice = 'set AUV_GVC_CACHE_DIR to a folder that you alone can write to'
        return Finding('kernel cache', 'warning', found, advice)
    empty = '' if any(folder.glob('**/*.nbi')) else ', empty: the first run compiles for a minute'
    return Finding('kernel cache', 'ok', f'{folder}{empty}')


def executables() -> Iterator[Finding]:
    """Whether the nodes are installed beside this `auv`, and `auv` on the path is this one."""
    import shutil

    from auv_analysis.graph.supervisor import NodeDiedError, executable

    missing = []
    for name, package in NODES.items():
        try:
            executable(package, name)
        except NodeDiedError:
            missing.append(name)
    if missing:
        yield Finding('nodes', 'broken', f'not installed: {", ".join(missing)}', AGAIN)
    else:
        yield Finding('nodes', 'ok', 'all installed')
    on_path = shutil.which('auv')
    here = Path(sys.executable).with_name('auv')
    if on_path and here.is_file() and not here.samefile(on_path):
        advice = f'call {here}, or put its folder first in PATH'
        yield Finding('nodes', 'warning', f'another auv is first in PATH: {on_path}', advice)
