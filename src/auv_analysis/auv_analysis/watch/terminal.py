"""The terminal of a dashboard: what is shown on it, and the keys that are pressed in it."""

import io
import os
import select
import sys
import termios
import time
import tty
from contextlib import ExitStack, suppress

import rich.live

from auv_analysis.output.progress import TextConsole
from auv_analysis.watch.screen import screen
from auv_analysis.watch.snapshot import Snapshot
from auv_dynamics.files.ending import on_signals


class Display:
    """Shows snapshots: on the whole terminal while it is entered, or printed one after another.

    Parameters
    ----------
    stderr : whether standard output is for something else
    single : print the last snapshot only; else, without a terminal, each that holds something

    Attributes
    ----------
    live : whether the whole terminal is taken, which is as before afterwards

    """

    def __init__(self, *, stderr: bool, single: bool):
        stream = sys.stderr if stderr else sys.stdout
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='replace')  # bars and dashes, where the encoding has none
        self._console = TextConsole(stderr=stderr, highlight=False)
        self._single = single
        self.live = self._console.is_terminal and not single
        self._live = rich.live.Live(console=self._console, screen=True, auto_refresh=False)

    def __enter__(self) -> 'Display':
        if self.live:
            self._live.start()
        return self

    def show(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        if self.live:
            self._live.update(screen(snapshot, *self._console.size), refresh=True)
        elif snapshot.heard and not self._single:
            self._print(snapshot)
            self._console.print()

    def end(self, snapshot: Snapshot) -> None:
        """Show the last one, where it alone is wanted."""
        if self._single:
            self._print(snapshot)

    def _print(self, snapshot: Snapshot) -> None:
        self._console.print(screen(snapshot, self._console.width))

    def __exit__(self, *_: object) -> None:
        if self.live:
            self._live.stop()


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
