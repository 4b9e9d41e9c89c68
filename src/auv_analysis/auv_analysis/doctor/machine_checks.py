"""The machine: disk, shared memory, open files, clock, cores, and programs that some want."""

import os
import resource
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from auv_analysis.doctor.finding import Finding, Verdict

GIGA, MEGA = 1 << 30, 1 << 20
LEAST_DISK, LITTLE_DISK = 200 * MEGA, 2 * GIGA
LEAST_SHARED, LITTLE_SHARED = 8 * MEGA, 64 * MEGA
LEAST_FILES, FEW_FILES = 128, 1024
MANY_SEGMENTS = 50  # left over; each takes about half a megabyte
SHARED = Path('/dev/shm')
OF_FAST_DDS = ('fastrtps_', 'fastdds_', 'sem.fastrtps_', 'sem.fastdds_')
BROWSERS = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')


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
        size = sum(path.stat().st_size for path in left if path.exists())
        found = f'{len(left)} files of ended Fast DDS processes in {folder}, {size / MEGA:.0f} MB'
        many = len(left) > MANY_SEGMENTS or free <= LITTLE_SHARED
        advice = f'while no node runs: rm {folder}/*fastrtps_* {folder}/*fastdds_*'
        yield Finding('shared memory', 'warning' if many else 'note', found, advice)


def left_over(folder: Path) -> list[Path]:
    """Files of Fast DDS, of this user, that no process uses."""
    ours = [path for path in folder.iterdir() if path.name.startswith(OF_FAST_DDS)]
    used = _in_use(folder)
    own = os.getuid()
    return [path for path in ours if str(path) not in used and path.stat().st_uid == own]


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
    """How many files a process may open: a participant takes some dozens."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    limit = hard if soft == resource.RLIM_INFINITY else soft
    good = limit == resource.RLIM_INFINITY or limit > FEW_FILES
    verdict = 'ok' if good else _judged(limit, LEAST_FILES, FEW_FILES - 1)
    advice = '' if verdict == 'ok' else f'ulimit -n {FEW_FILES}'
    found = 'no limit' if limit == resource.RLIM_INFINITY else f'{limit} per process'
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
    """How many cores there are: a run has five nodes that wait for one another."""
    count = len(os.sched_getaffinity(0))
    advice = '' if count > 1 else 'auv run --composed takes one process: it is faster there'
    yield Finding('cores', 'ok' if count > 1 else 'warning', f'{count}', advice)


def programs() -> Iterator[Finding]:
    """Programs that some uses want."""
    if not any(map(shutil.which, BROWSERS)):
        found = 'absent: reports open in any browser, only tests of reports are skipped'
        yield Finding('chromium', 'note', found)
    if not shutil.which('ros2'):
        found = 'absent: auv starts the nodes itself; ros2 topic, run, launch come with apt'
        yield Finding('ros2', 'note', found)


def _judged(free: float, least: float, little: float) -> Verdict:
    return 'broken' if free < least else 'warning' if free <= little else 'ok'
