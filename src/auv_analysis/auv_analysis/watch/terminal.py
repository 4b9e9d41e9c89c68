"""The dashboard of a terminal: what is shown on it, keys that are pressed in it, and its end."""

import io
import math
import os
import select
import sys
import termios
import time
import tty
from contextlib import ExitStack, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import rich.live

from auv_analysis.graph.domain import place_of
from auv_analysis.output.progress import TextConsole, say
from auv_analysis.watch.screen import BASIC, screen
from auv_analysis.watch.snapshot import Alert, Snapshot
from auv_dynamics.files.ending import on_signals
from auv_dynamics.files.errors import FailedError

if TYPE_CHECKING:
    from auv_analysis.watch.monitor import GraphMonitor

LOOK = 0.05  # s between two looks at what has come
PATIENCE = 3.0  # s after which it is said what is waited for
SETTLED = 2.0  # s after the first message, when rates are known
ON_SCREEN, IN_PIPE = 4.0, 1.0  # refreshes per second where nothing is asked for


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


class Session:
    """Listens and shows until there is a reason to end.

    Parameters
    ----------
    monitor : what is known of the graph
    listener : tells the monitor what comes in
    display : shows snapshots
    rate : refreshes per second; None: as many as suit the display

    """

    def __init__(
        self, monitor: 'GraphMonitor', listener: Any, display: Display, rate: float | None
    ):
        self._monitor, self._listener, self._display = monitor, listener, display
        self._period = 1.0 / (rate or (ON_SCREEN if display.live else IN_PIPE))
        self._said = False

    def run(self, keyboard: Keyboard, limit: float, *, once: bool) -> Snapshot:
        """Run for at most so many s; FailedError when nothing was heard in them."""
        begin = due = time.monotonic()
        settled = math.inf
        while True:
            self._listener.listen()
            now = time.monotonic()
            if self._monitor.moves and settled == math.inf:
                settled = now + SETTLED
            if now >= due:
                self._show(now, waits=now - begin > PATIENCE)
                due = max(due + self._period, now)
            if keyboard.ended or (once and now >= settled):
                break
            if now - begin >= limit:
                snapshot = self._monitor.snapshot(now)
                if not snapshot.heard:
                    raise FailedError(f'{self._waits_for(snapshot)}: gave up after {limit:g} s')
                break
            keyboard.wait(LOOK)
        snapshot = self._monitor.snapshot(time.monotonic())
        self._display.end(snapshot)
        return snapshot

    def _show(self, now: float, *, waits: bool) -> None:
        snapshot = self._monitor.snapshot(now)
        if waits and not snapshot.heard:
            text = f'{self._waits_for(snapshot)}; waiting'
            snapshot = replace(snapshot, alerts=(Alert('warning', text), *snapshot.alerts))
            if not (self._said or self._display.live):
                say(text)
                self._said = True
        self._display.show(snapshot)

    def _waits_for(self, snapshot: Snapshot) -> str:
        what = 'nothing comes of' if snapshot.published else 'nobody publishes'
        names = f'{", ".join(BASIC[:-1])} or {BASIC[-1]}'
        text = f'{what} {names} on {place_of(snapshot.domain, snapshot.namespace)}'
        elsewhere = ' or '.join(self._listener.elsewhere())
        return f'{text}, but odometry in {elsewhere}: see --namespace' if elsewhere else text
