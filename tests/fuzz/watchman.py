"""Watches an input while it is tried: time, memory, and which files are written."""

import os
import re
import signal
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from helpers.patience import patience

WORK = 20.0  # s of CPU for an input
WAITING = patience(600.0)  # s for one that only waits
CLOCKS = {signal.ITIMER_PROF: (signal.SIGPROF, WORK), signal.ITIMER_REAL: (signal.SIGALRM, WAITING)}
MEMORY = 1 << 29  # bytes that an input may need beside what there was before
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
sys.dont_write_bytecode = True  # a module that is compiled while an input is tried is no stray file
CHANGES = {'os.mkdir', 'os.rename', 'os.remove', 'os.rmdir', 'os.link', 'os.symlink', 'os.truncate'}


class HangError(AssertionError):
    """An input takes too long."""


class GreedError(AssertionError):
    """An input takes too much memory."""


class StrayFileError(AssertionError):
    """A file was touched outside of the folder of the results."""


_allowed: list[Path] | None = None
_stray: list[str] = []


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if _allowed is None:
        return
    if event == 'open':
        path, _, flags = arguments
        if not isinstance(flags, int) or not flags & WRITING:
            return
        touched = [path]
    elif event in CHANGES:
        touched = [part for part in arguments[:2] if isinstance(part, str | bytes | os.PathLike)]
    else:
        return
    for path in touched:
        if isinstance(path, int):
            continue
        where = Path(os.path.realpath(os.fsdecode(path)))
        if not any(where.is_relative_to(folder) for folder in _allowed):
            _stray.append(f'{event} {where}')


sys.addaudithook(_audit)


def _late(number: int, _: Any) -> None:
    raise HangError(f'more than {dict(CLOCKS.values())[number]:g} s')


def _peak() -> int:
    """Most memory that this process has held, bytes."""
    found = re.search(r'VmHWM:\s+(\d+) kB', Path('/proc/self/status').read_text())
    assert found
    return 1024 * int(found[1])


@contextmanager
def watched(*folders: Path) -> Iterator[None]:
    """Try an input; files may be written in these folders alone.

    Raises
    ------
    HangError, GreedError, StrayFileError : what must not happen

    """
    global _allowed  # noqa: PLW0603  # an audit hook cannot be taken away again
    cache = os.environ.get('AUV_GVC_CACHE_DIR', str(Path.home() / '.cache' / 'auv_gvc'))
    system = [Path('/dev'), Path('/proc'), Path(cache)]
    _allowed = [Path(os.path.realpath(folder)) for folder in (*folders, *system)]
    _stray.clear()
    before = {number: signal.signal(number, _late) for number, _ in CLOCKS.values()}
    for clock, (_, limit) in CLOCKS.items():
        signal.setitimer(clock, limit)
    Path('/proc/self/clear_refs').write_text('5')  # the peak is from now on
    begin = _peak()
    try:
        yield
    finally:
        _allowed = None
        for clock, (number, _) in CLOCKS.items():
            signal.setitimer(clock, 0)
            signal.signal(number, before[number])
    if (more := _peak() - begin) > MEMORY:
        raise GreedError(f'{more >> 20} MiB')
    if _stray:
        raise StrayFileError(', '.join(_stray))


@contextmanager
def playground() -> Iterator[Path]:
    """A folder of its own as working directory, gone afterwards."""
    home = os.getcwd()
    with tempfile.TemporaryDirectory(prefix='auv_gvc_fuzz_') as folder:
        os.chdir(folder)
        try:
            yield Path(folder)
        finally:
            os.chdir(home)
