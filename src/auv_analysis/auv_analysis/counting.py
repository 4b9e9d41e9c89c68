"""Parts of work that are counted where somebody watches; what computes loads no terminal for it."""

from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

T = TypeVar('T')
counting: 'ContextVar[tuple[Progress, TaskID] | None]' = ContextVar('counting', default=None)


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
