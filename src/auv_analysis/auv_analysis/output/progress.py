"""Terminal output: progress of long work, text that is safe to print, a share as a bar."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeVar

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress_bar import ProgressBar
from rich.segment import Segment

from auv_dynamics.files.errors import printable

T = TypeVar('T')
counting: ContextVar[tuple[Progress, TaskID] | None] = ContextVar('counting', default=None)


def each(entries: Iterable[T], total: int) -> Iterator[T]:
    """Go through entries, counted by a `progress.waiting` around; without one, just through.

    Parameters
    ----------
    entries : of similar length in time
    total : how many

    """
    around = counting.get()
    if around is None:
        yield from entries
        return
    shown, task = around
    counting.set(None)  # what is counted inside of an entry is no part of this
    shown.update(task, total=total, completed=0)
    try:
        for entry in entries:
            yield entry
            shown.advance(task)
    finally:
        counting.set(around)
        # how long the rest takes is not known; `update` takes None for no change
        next(one for one in shown.tasks if one.id == task).total = None


class TextConsole(Console):
    """A console without markup; what the terminal would obey is its own, never part of a text.

    Parameters
    ----------
    options : of rich's Console

    """

    def __init__(self, **options: Any):
        super().__init__(markup=False, emoji=False, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Segments of a renderable, their texts without control characters."""
        for segment in super().render(renderable, options):
            text, style, control = segment
            yield segment if control else Segment(printable(text), style)


def say(text: object) -> None:
    """Print a line, or some, on stderr."""
    print(printable(str(text)), file=sys.stderr, flush=True)


console = TextConsole(stderr=True)


class Speed(ProgressColumn):
    """Parts of the work per second.

    Parameters
    ----------
    unit : of the parts, such as steps

    """

    def __init__(self, unit: str):
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> str:
        """Text of the column."""
        speed = task.finished_speed or task.speed
        return f'{speed:>6.0f} {self._unit}/s' if speed else ''


def count(unit: str = '') -> TextColumn:
    """A column with how many parts are done, of how many."""
    return TextColumn(f'{{task.completed:.0f}}/{{task.total:.0f}} {unit}'.rstrip())


def bar(*columns: ProgressColumn, keep: bool = False) -> Progress:
    """A bar with what is being done, how far it is and what is left.

    Parameters
    ----------
    columns : between the bar and the times
    keep : leave it there at the end, and print that line also where there is no terminal

    """
    return Progress(
        TextColumn('{task.description}'), BarColumn(bar_width=30), *columns,
        TimeElapsedColumn(), TimeRemainingColumn(), console=console, transient=not keep,
        disable=not (keep or console.is_terminal),
    )  # fmt: skip


@contextmanager
def waiting(text: str) -> Iterator[None]:
    """A line that says what takes time and since when; with what is left where `each` counts."""
    columns = SpinnerColumn(), TextColumn('{task.description}'), TimeElapsedColumn()
    quiet = not console.is_terminal
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, disable=quiet
    ) as shown:
        token = counting.set((shown, shown.add_task(text, total=None)))
        try:
            yield
        finally:
            counting.reset(token)


STYLE = 'cyan'


def share_bar(percent: float, width: int) -> ProgressBar:
    """Bar of so many columns for a share in %."""
    return ProgressBar(100.0, percent, width, complete_style=STYLE, finished_style=STYLE)
