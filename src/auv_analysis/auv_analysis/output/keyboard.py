"""The keys that are pressed in a terminal, while something else is shown in it."""

import os
import select
import sys
import termios
import time
import tty
from contextlib import ExitStack, suppress

from auv_dynamics.files.errors import on_signals


class Keyboard:
    """Reads single keys while it is entered; terminal and signals are as before afterwards.

    Attributes
    ----------
    ended : whether somebody wants an end

    """

    def __init__(self) -> None:
        self.ended = False
        self._file = sys.stdin.fileno() if _has_keys() else None

    def __enter__(self) -> 'Keyboard':
        self._signals = ExitStack()
        self._signals.enter_context(on_signals(self._end))
        if self._file is not None:
            self._terminal = termios.tcgetattr(self._file)
            tty.setcbreak(self._file)
        return self

    def _end(self) -> None:
        self.ended = True

    @property
    def there(self) -> bool:
        """Whether there is a terminal to press keys in."""
        return self._file is not None

    def wait(self, seconds: float) -> bytes:
        """Wait for a key, at most so many s; the keys that were pressed."""
        if self._file is None:
            time.sleep(seconds)
        elif select.select([self._file], [], [], seconds)[0]:
            keys = b''
            with suppress(OSError):  # the terminal was closed
                keys = os.read(self._file, 64)
            self.ended = self.ended or not keys or b'q' in keys.lower()
            return keys
        return b''

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            with suppress(termios.error):  # the terminal was closed
                termios.tcsetattr(self._file, termios.TCSADRAIN, self._terminal)
        self._signals.close()


def _has_keys() -> bool:
    """Whether there is a terminal, and this process in front: one behind would be stopped."""
    if sys.stdin is None or sys.stdin.closed or not sys.stdin.isatty():
        return False
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:  # not the terminal of this session
        return True
