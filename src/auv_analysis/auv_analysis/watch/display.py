"""Where snapshots are shown: on the whole terminal, or printed one below the other."""

from types import TracebackType
from typing import Protocol

import rich.live
from rich.console import Console

from auv_analysis.watch.screen import screen
from auv_analysis.watch.snapshot import Snapshot


class Display(Protocol):
    """Shows snapshots while it is entered."""

    live: bool

    def show(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""

    def end(self, snapshot: Snapshot) -> None:
        """Show the last one."""

    def __enter__(self) -> 'Display': ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class Live:
    """The whole terminal, which is as before afterwards."""

    live = True

    def __init__(self, console: Console):
        self._console = console
        self._live = rich.live.Live(console=console, screen=True, auto_refresh=False)

    def __enter__(self) -> 'Live':
        self._live.start()
        return self

    def show(self, snapshot: Snapshot) -> None:
        """Replace what is shown."""
        width, height = self._console.size
        self._live.update(screen(snapshot, width, height), refresh=True)

    def end(self, snapshot: Snapshot) -> None:
        """Nothing: the terminal is given back."""

    def __exit__(self, *_: object) -> None:
        self._live.stop()


class Printed:
    """Text, with or without a terminal.

    Parameters
    ----------
    console : where it goes
    every : print each snapshot in which something was heard, else the last one only

    """

    live = False

    def __init__(self, console: Console, *, every: bool):
        self._console, self._every = console, every

    def __enter__(self) -> 'Printed':
        return self

    def show(self, snapshot: Snapshot) -> None:
        """Print a snapshot and an empty line."""
        if self._every and snapshot.heard:
            self._print(snapshot)
            self._console.print()

    def end(self, snapshot: Snapshot) -> None:
        """Print the last snapshot."""
        if not self._every:
            self._print(snapshot)

    def _print(self, snapshot: Snapshot) -> None:
        self._console.print(screen(snapshot, self._console.width))

    def __exit__(self, *_: object) -> None:
        pass
