"""Disks that are small, and folders that take no more files."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def small_disk(folder: Path, kib: int) -> Iterator[Path | None]:
    """A file system of so many KiB in a folder; None where mounting is not permitted."""
    folder.mkdir(parents=True)
    mount = ['mount', '-t', 'tmpfs', '-o', f'size={kib}k', 'tmpfs', str(folder)]
    if not _is_done(mount):
        yield None
        return
    try:
        yield folder
    finally:
        subprocess.run(['umount', '-l', str(folder)], check=True)


@contextmanager
def no_more_files(folder: Path) -> Iterator[bool]:
    """Take away the right to make files in a folder; whether that was possible."""
    if os.geteuid():
        folder.chmod(0o555)
        undo = ['chmod', '755']
    elif not _is_done(['chattr', '+i', str(folder)]):
        yield False  # the superuser may write everywhere, and this file system knows no flags
        return
    else:
        undo = ['chattr', '-i']
    try:
        yield True
    finally:
        subprocess.run([*undo, str(folder)], check=True)


def _is_done(command: list[str]) -> bool:
    if shutil.which(command[0]) is None:
        return False
    return subprocess.run(command, capture_output=True, check=False).returncode == 0
