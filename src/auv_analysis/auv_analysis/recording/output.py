"""The file under a bag: unbuffered, locked, cut back to whole records when a write fails."""

import contextlib
import fcntl
import os
from pathlib import Path

from auv_analysis.output.new_files import NEW


class Output:
    """A new file that is written record by record; each write reaches the system at once.

    Its lock says to others, such as `auv recover`, that it is being written. The lock is advisory
    and goes with the process.

    Parameters
    ----------
    path : must not exist

    Attributes
    ----------
    position : bytes that the system has taken

    """

    def __init__(self, path: Path):
        self.path, self.position, self._synced = path, 0, 0
        self._fd = os.open(path, NEW | os.O_APPEND, 0o644)
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # some network file systems give an open file another number than its name
        self._has_identity = self._identity() == self._identity_of_path()

    def write(self, data: bytes) -> int:
        """Write all of it, or nothing: then the OSError of the system."""
        begin, rest = self.position, memoryview(data)
        try:
            while rest:
                written = os.write(self._fd, rest)
                rest = rest[written:]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._fd, begin)
            raise
        self.position += len(data)
        return len(data)

    def tell(self) -> int:
        """Position of the next write, bytes."""
        return self.position

    def flush(self) -> None:
        """Nothing is held back."""

    def sync(self) -> None:
        """Wait until what was written is on the disk, where that is not sure yet."""
        if self._synced < (position := self.position):
            os.fdatasync(self._fd)
            self._synced = position

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def loss(self) -> str:
        """What somebody else did to the file under us; empty when nothing."""
        position = self.position
        try:
            found = self._identity_of_path()
        except (FileNotFoundError, NotADirectoryError):
            return 'removed or renamed while it was being recorded'
        if self._has_identity and found != self._identity():
            return 'replaced by another file while it was being recorded'
        if os.fstat(self._fd).st_size < position:
            return 'shortened by somebody else while it was being recorded'
        return ''

    def free_space(self) -> int:
        """Bytes of its file system that are left for its user."""
        system = os.fstatvfs(self._fd)
        return system.f_bavail * system.f_frsize

    def _identity(self) -> tuple[int, int]:
        status = os.fstat(self._fd)
        return status.st_dev, status.st_ino

    def _identity_of_path(self) -> tuple[int, int]:
        status = os.lstat(self.path)
        return status.st_dev, status.st_ino
