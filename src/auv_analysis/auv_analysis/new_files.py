"""Files that are made anew: no link is followed, and a file is there as a whole or as it was."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from auv_analysis.folder import UNFINISHED

NEW = os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_WRONLY | os.O_CLOEXEC


def unfinished_name(path: Path) -> Path:
    """Name of a file while it is being written."""
    return path.with_name(f'{path.name}{UNFINISHED}')


def created(path: Path) -> IO[bytes]:
    """Open a new file, and sync it when it is whole.

    What stands under the name, such as what a killed process has left there, is removed first. Of
    a link only the link is: what it leads to is not touched, even where somebody puts it back.
    """
    path.unlink(missing_ok=True)
    return os.fdopen(os.open(path, NEW, 0o666), 'wb')


@contextlib.contextmanager
def replacing(path: Path, unfinished: Path | None = None) -> Iterator[IO[bytes]]:
    """Write a file that takes its name when it is on the disk.

    Parameters
    ----------
    path : of the file; a link of that name is replaced, not followed
    unfinished : its name until then, in the same folder; default: `unfinished_name(path)`

    """
    unfinished = unfinished or unfinished_name(path)
    with created(unfinished) as file:
        yield file
        synced(file)
    os.replace(unfinished, path)
    sync_folder(path.parent)


def synced(file: IO[bytes]) -> None:
    """Wait until what was written is on the disk."""
    file.flush()
    os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, where the system can do that."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
