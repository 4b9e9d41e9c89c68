"""Repair of a bag where it lies: nothing is lost, whenever the repair itself is ended."""

import contextlib
import errno
import fcntl
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from auv_analysis.output.new_files import sync_folder, unfinished_name
from auv_analysis.recovery.audit import Audit
from auv_analysis.recovery.rewrite import Rewriter
from auv_dynamics.files.errors import FailedError, InputError, reason

DAMAGED = '.damaged'  # ends the name under which a damaged file is kept
QUIET = 2.0  # s: a file that was written more recently is watched for so long
EXPECTED = 'a bag that nobody is recording'
Progress = Callable[[str, int, int], None]  # what is done, bytes that are done, bytes of all


@contextlib.contextmanager
def taken(paths: list[Path]) -> Iterator[list[str]]:
    """Hold the locks of files; InputError where a recorder or another repair has one.

    Gives a note for each file that could not be locked: one that somebody else repairs at the same
    time is not noticed.
    """
    with contextlib.ExitStack() as stack:
        notes = []
        for path in paths:
            descriptor = _opened(path)
            stack.callback(os.close, descriptor)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(path, '', EXPECTED, 'a file that is being written') from None
            except OSError as error:
                notes.append(f'{path.name}: not locked: {reason(error)}')
        yield notes


def _opened(path: Path) -> int:
    """Descriptor of a file, for writing where that is allowed: network file systems want that."""
    try:
        return os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise
        return os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)


def watch(path: Path, before: tuple[int, int, int]) -> None:
    """Refuse a file that grows: a recorder that takes no lock.

    Parameters
    ----------
    path : of the file, which is not finished
    before : its `state` before it was read

    """
    age = time.time() - path.stat().st_mtime
    if 0 <= age < QUIET:
        time.sleep(QUIET - age)
    if state(path) != before:
        raise InputError(path, '', EXPECTED, 'a file that is being written')


def state(path: Path) -> tuple[int, int, int]:
    """What changes when a file is written or replaced."""
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


def repair(audit: Audit, target: Path, before: tuple[int, int, int], progress: Progress) -> str:
    """Write a file anew and put it into the place of the damaged one, which is kept.

    Parameters
    ----------
    audit : of the damaged file: `target`, or what an interrupted repair has kept of it
    target : name of the repaired file
    before : `state` of the damaged file when it was audited

    Returns
    -------
    kept_as : name of the damaged file

    """
    unfinished = unfinished_name(target)
    Rewriter(audit, target.name).write(
        unfinished, lambda place: progress(f'repairing {target.name}', place, audit.size)
    )
    if state(audit.path) != before:
        unfinished.unlink()
        raise InputError(audit.path, '', EXPECTED, 'a file that is being written')
    os.chmod(unfinished, audit.path.stat().st_mode & 0o777)
    kept = audit.path if audit.path != target else keep(target)
    os.replace(unfinished, target)
    sync_folder(target.parent)
    return kept.name


def keep(path: Path) -> Path:
    """Give a file a second name that says that it is damaged; an earlier one is not replaced."""
    kept = path.with_name(f'{path.name}{DAMAGED}')
    number = 2
    while os.path.lexists(kept):
        if os.path.samestat(
            os.lstat(kept), os.lstat(path)
        ):  # of a repair that was ended after this
            return kept
        kept = path.with_name(f'{path.name}{DAMAGED}.{number}')
        number += 1
    try:
        os.link(path, kept)
    except OSError:  # a file system without links: between here and the next step there is only
        os.rename(path, kept)  # the damaged name, from which the next repair goes on
    sync_folder(path.parent)
    return kept


def set_aside(path: Path) -> str:
    """Take a file out of its bag, since nothing in it can be used."""
    kept = keep(path)
    path.unlink(missing_ok=True)
    sync_folder(path.parent)
    return kept.name


def failed(path: Path, error: OSError) -> FailedError:
    """What ends a repair that the system does not let happen."""
    return FailedError(f'{error.filename or path}: {reason(error)}; the file is as it was')
