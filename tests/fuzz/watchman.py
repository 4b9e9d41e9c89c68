"""Watches an input while it is tried: how long it takes, and which files are written."""

import os
import signal
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PATIENCE = 20  # s for an input; 0: another watches
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGES = {'os.mkdir', 'os.rename', 'os.remove', 'os.rmdir', 'os.link', 'os.symlink', 'os.truncate'}


class HangError(AssertionError):
    """An input takes too long."""


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


def _late(*_: Any) -> None:
    raise HangError(f'more than {PATIENCE} s')


@contextmanager
def watched(*folders: Path) -> Iterator[None]:
    """Try an input; files may be written in these folders alone.

    Raises
    ------
    HangError, StrayFileError : what must not happen

    """
    global _allowed  # noqa: PLW0603  # an audit hook cannot be taken away again
    cache = os.environ.get('AUV_GVC_CACHE_DIR', str(Path.home() / '.cache' / 'auv_gvc'))
    system = [Path('/dev'), Path('/proc'), Path(cache)]
    _allowed = [Path(os.path.realpath(folder)) for folder in (*folders, *system)]
    _stray.clear()
    if PATIENCE:
        before = signal.signal(signal.SIGALRM, _late)
        signal.alarm(PATIENCE)
    try:
        yield
    finally:
        _allowed = None
        if PATIENCE:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, before)
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
