"""Checks of the set-up: Python and its packages, what the environment says to ROS, the machine.

A check is a function that yields findings. Nothing outside the standard library is imported before
a check runs: the others must go on where a package is broken.
"""

import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import redirect_stderr, suppress
from importlib import metadata
from io import StringIO
from pathlib import Path
from typing import Any, Literal, NamedTuple

OLDEST, NEWEST = (3, 11), (3, 13)
OURS = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')
MODULES = {  # of distributions that are imported under another name
    'pyyaml': 'yaml', 'pillow': 'PIL', 'salib': 'SALib',
    'mcap-ros2-support': 'mcap_ros2',
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
DISTRO = 'jazzy'
RMW = 'rmw_fastrtps_cpp'
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
RANGES = ('LOCALHOST', 'SUBNET', 'SYSTEM_DEFAULT', 'OFF')
PATHS = ('AMENT_PREFIX_PATH', 'PYTHONPATH', 'LD_LIBRARY_PATH')
OF_ROS = re.compile(r'(?:^|/)opt/ros/([a-z]+)(?:/|$)')
OF_PYTHON = re.compile(r'/python(3\.\d+)/')
GIGA, MEGA = 1 << 30, 1 << 20
LEAST_DISK, LITTLE_DISK = 200 * MEGA, 2 * GIGA
LEAST_SHARED, LITTLE_SHARED = 8 * MEGA, 64 * MEGA
LEAST_FILES, FEW_FILES = 128, 1024
MANY_SEGMENTS = 50  # left over; each takes about half a megabyte
SHARED = Path('/dev/shm')
OF_FAST_DDS = ('fastrtps_', 'fastdds_')  # and sem. before them
BROWSERS = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
Verdict = Literal['ok', 'note', 'warning', 'broken']


class Finding(NamedTuple):
    """One thing that was looked at.

    Attributes
    ----------
    check : a word for what was looked at
    verdict : 'broken' where commands will fail, 'warning' where they may, 'note' where something
        is absent that few need
    found : what is there
    advice : what to do; empty where all is well

    """

    check: str
    verdict: Verdict
    found: str
    advice: str = ''

    def line(self) -> str:
        """For people: verdict, check, what was found, what to do."""
        advice = f'\n{"":10}-> {self.advice}' if self.advice else ''
        return f'{self.verdict:<8}  {self.check}: {self.found}{advice}'


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
    asked = {one.name.lower(): one for package in OURS for one in _asked(package)}
    there = {name: _version(name) for name in asked}
    missing = [str(one) for name, one in asked.items() if there[name] is None]
    wrong = [
        f'{name} {version}, not {asked[name]}'
        for name, version in there.items()
        if version and not asked[name].specifier.contains(version, prereleases=True)
    ]
    modules = [MODULES.get(name, name.replace('-', '_')) for name in asked if there[name]]
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


def _asked(package: str) -> Iterator[Any]:
    """Requirements of a distribution of ours, as far as they hold here."""
    from packaging.requirements import Requirement

    for text in metadata.requires(package) or ():
        requirement = Requirement(text)
        if requirement.marker is None or requirement.marker.evaluate({'extra': ''}):
            requirement.marker = None  # which its text would tell
            yield requirement


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


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
    from auv_analysis.graph.supervisor import NodeDiedError, executable

    missing = []
    for package in OURS:
        for entry in metadata.distribution(package).entry_points.select(group='console_scripts'):
            try:
                executable(package, entry.name)
            except NodeDiedError:
                missing.append(entry.name)
    if missing:
        yield Finding('nodes', 'broken', f'not installed: {", ".join(missing)}', AGAIN)
    else:
        yield Finding('nodes', 'ok', 'all installed')
    on_path = shutil.which('auv')
    here = Path(sys.executable).with_name('auv')
    if on_path and here.is_file() and not here.samefile(on_path):
        advice = f'call {here}, or put its folder first in PATH'
        yield Finding('nodes', 'warning', f'another auv is first in PATH: {on_path}', advice)


def distro() -> Iterator[Finding]:
    """Whether another ROS than Jazzy, or packages for another Python, are in the environment."""
    others = {}
    if (os.environ.get('ROS_DISTRO') or DISTRO) != DISTRO:
        others['ROS_DISTRO'] = os.environ['ROS_DISTRO']
    ours = f'{sys.version_info[0]}.{sys.version_info[1]}'
    for name in PATHS:
        for entry in os.environ.get(name, '').split(os.pathsep):
            found = OF_ROS.search(entry)
            python = OF_PYTHON.search(f'{entry}/')
            if (found and found[1] != DISTRO) or (python and python[1] != ours):
                others.setdefault(name, entry)
    for name, value in others.items():
        advice = 'open a new terminal and source nothing, or the setup file of Jazzy alone'
        found_text = f'{name} names {value}: ROS 2 {DISTRO.title()} and Python {ours} are needed'
        yield Finding('ROS', 'broken', found_text, advice)
    if not others:
        sourced = os.environ.get('ROS_DISTRO')
        yield Finding('ROS', 'ok', f'{DISTRO}, {"sourced" if sourced else "from wheels"}')


def middleware() -> Iterator[Finding]:
    """Whether the middleware is the one that the nodes are tuned and tested for."""
    chosen = os.environ.get('RMW_IMPLEMENTATION') or RMW
    if chosen == RMW:
        yield Finding('middleware', 'ok', chosen)
    else:
        found = f'RMW_IMPLEMENTATION={chosen}: nodes are tested with {RMW} alone'
        yield Finding('middleware', 'warning', found, 'unset RMW_IMPLEMENTATION')


def discovery_range() -> Iterator[Finding]:
    """Discovery range of nodes."""
    value = os.environ.get(RANGE)
    if os.environ.get('ROS_LOCALHOST_ONLY', '0') not in ('', '0'):
        found = 'ROS_LOCALHOST_ONLY is set: it is deprecated and overrides the range'
        yield Finding('reach', 'warning', found, f'unset it; {RANGE}=LOCALHOST says the same')
    if not value or value == 'LOCALHOST':
        yield Finding('reach', 'ok', f'this machine only ({RANGE}={value or "LOCALHOST, by auv"})')
    elif value == 'OFF':
        found = f'{RANGE}=OFF: no node finds another'
        yield Finding('reach', 'broken', found, f'unset {RANGE}')
    elif value in RANGES:
        found = f'{RANGE}={value}: everybody on the network hears the nodes and may command them'
        yield Finding('reach', 'warning', found, f'unset {RANGE} where no other machine takes part')
    else:
        from auv_dynamics.files.nearest import one_of

        found = f'{RANGE}={value}: expected {one_of(value, RANGES)}'
        yield Finding('reach', 'broken', found, f'unset {RANGE}')


def domain() -> Iterator[Finding]:
    """Whether ROS_DOMAIN_ID is one."""
    from auv_analysis.graph.domain import VARIABLE, joined_domain
    from auv_dynamics.files.errors import InputError

    try:
        number = joined_domain(None)
    except InputError as error:
        yield Finding('domain', 'broken', str(error), f'unset {VARIABLE}')
        return
    if os.environ.get(VARIABLE):
        yield Finding('domain', 'ok', f'{VARIABLE}={number}')
    else:
        yield Finding('domain', 'ok', f'{VARIABLE} is not set: auv run takes a free one')


def disk() -> Iterator[Finding]:
    """Room for results where one works."""
    free = shutil.disk_usage(Path.cwd()).free
    found = f'{free / GIGA:.1f} GB free here'
    advice = '' if free > LITTLE_DISK else 'make room, or name another disk with --out'
    yield Finding('disk', _judged(free, LEAST_DISK, LITTLE_DISK), found, advice)


def shared_memory(folder: Path = SHARED) -> Iterator[Finding]:
    """Room in the shared memory, and what ended processes have left there."""
    if not folder.is_dir():
        found = f'{folder} is not there: the middleware falls back to UDP'
        yield Finding('shared memory', 'note', found)
        return
    free = shutil.disk_usage(folder).free
    advice = '' if free > LITTLE_SHARED else 'end what fills it; containers: --shm-size=512m'
    yield Finding(
        'shared memory', _judged(free, LEAST_SHARED, LITTLE_SHARED),
        f'{free / MEGA:.0f} MB free in {folder}', advice,
    )  # fmt: skip
    left = left_over(folder)
    if left:
        size = sum(left.values())
        found = f'{len(left)} files of ended Fast DDS processes in {folder}, {size / MEGA:.0f} MB'
        many = len(left) > MANY_SEGMENTS or free <= LITTLE_SHARED
        patterns = ' '.join(f'{folder}/*{name}*' for name in OF_FAST_DDS)
        advice = f'while no node runs: rm {patterns}'
        yield Finding('shared memory', 'warning' if many else 'note', found, advice)


def left_over(folder: Path) -> dict[Path, int]:
    """Files of Fast DDS, of this user, that no process uses, and their sizes in bytes."""
    names = [(path, path.name.removeprefix('sem.')) for path in folder.iterdir()]
    ours = [path for path, name in names if name.startswith(OF_FAST_DDS)]
    used = _in_use(folder)
    found = {}
    for path in ours:
        with suppress(FileNotFoundError):  # its process has ended meanwhile
            about = path.stat()
            if str(path) not in used and about.st_uid == os.getuid():
                found[path] = about.st_size
    return found


def _in_use(folder: Path) -> set[str]:
    """Paths in a folder that a process maps or has open."""
    used: set[str] = set()
    for process in Path('/proc').glob('[0-9]*'):
        try:
            lines = (process / 'maps').read_text(errors='replace').splitlines()
            used |= {line[line.index('/') :] for line in lines if f' {folder}/' in line}
            links = list((process / 'fd').iterdir())
        except OSError:
            continue  # it has ended, or is somebody else's
        for link in links:
            with suppress(OSError):  # closed meanwhile
                used.add(os.readlink(link))
    return used


def files() -> Iterator[Finding]:
    """Limit of open files per process: a participant takes some dozens."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if limit == resource.RLIM_INFINITY:
        yield Finding('open files', 'ok', 'no limit')
        return
    verdict = _judged(limit, LEAST_FILES, FEW_FILES - 1)
    advice = '' if verdict == 'ok' else f'ulimit -n {FEW_FILES}'
    found = f'{limit} per process'
    yield Finding('open files', verdict, found, advice)


def clock() -> Iterator[Finding]:
    """Whether the clock is later than the files of this program: stamps and bags rest on it."""
    now, written = time.time(), Path(__file__).stat().st_mtime
    day = time.strftime('%Y-%m-%d %H:%M:%S UTC', time.gmtime(now))
    if now < written - 60.0:
        found = f'{day}, earlier than the files of this program'
        yield Finding('clock', 'warning', found, 'set the clock, such as by timedatectl or chrony')
    else:
        yield Finding('clock', 'ok', day)


def cores() -> Iterator[Finding]:
    """Number of cores: a run has five nodes that wait for one another."""
    count = len(os.sched_getaffinity(0))
    advice = '' if count > 1 else 'auv run --composed takes one process: it is faster there'
    yield Finding('cores', 'ok' if count > 1 else 'warning', f'{count}', advice)


def programs() -> Iterator[Finding]:
    """Optional tools."""
    if not any(map(shutil.which, BROWSERS)):
        found = 'absent: reports open in any browser, only tests of reports are skipped'
        yield Finding('chromium', 'note', found)
    if not shutil.which('ros2'):
        found = 'absent: auv starts the nodes itself; ros2 topic, run, launch come with apt'
        yield Finding('ros2', 'note', found)


def _judged(free: float, least: float, little: float) -> Verdict:
    return 'broken' if free < least else 'warning' if free <= little else 'ok'
