"""How far work is and how long it will take: on a terminal, and nowhere else."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from auv_analysis.console import TextConsole
from auv_analysis.counting import counting

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
