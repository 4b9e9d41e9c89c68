"""Independent tasks, by this process and, in a command on several cores, by a copy of it beside."""

import contextlib
import gc
import os
import pickle
import select
import signal
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar('T')
MOST = 256  # tasks whose numbers fit into a byte each
PATIENCE = 10.0  # s that the copy may take longer than this process, or than five times its share
_beside: ContextVar[bool] = ContextVar('beside', default=False)


@contextlib.contextmanager
def a_copy_beside() -> Iterator[None]:
    """Let `results` and `meanwhile` use a second core as long as this lasts."""
    token = _beside.set(True)
    try:
        yield
    finally:
        _beside.reset(token)


def results(tasks: Sequence[Callable[[], T]]) -> Iterator[T]:
    """Results of tasks in their order, which depend on nothing that another one does.

    Each process takes the next task that nobody has taken. What the copy does not give, for
    whatever reason, is done here, so that an error is raised where it would be without it.
    """
    from auv_analysis.output.progress import each  # with rich, without which `auv doctor` starts

    if not (1 < len(tasks) <= MOST and _two_cores()):
        yield from (task() for task in each(tasks, len(tasks)))
        return
    numbers, fill = os.pipe()
    os.write(fill, bytes(range(len(tasks))))
    os.close(fill)

    def share(taken: Iterable[tuple[int, bool]]) -> dict[int, T]:
        return {number: tasks[number]() for number, here in taken if here}

    try:
        with meanwhile(lambda: share(_taken(numbers))) as theirs:
            found = share(each(_taken(numbers), len(tasks))) | theirs()
    finally:
        os.close(numbers)
    yield from (found[i] if i in found else task() for i, task in enumerate(tasks))


@contextlib.contextmanager
def meanwhile(task: Callable[[], T]) -> Iterator[Callable[[], T]]:
    """What gives the result of a task, which a copy does until then where `results` has one."""
    if not _two_cores():
        yield task
        return
    answer, end = os.pipe()
    gc.freeze()  # neither process looks through, and so copies, what both have
    began, copy = time.monotonic(), fork()
    if not copy:
        try:
            with os.fdopen(end, 'wb') as stream:
                stream.write(pickle.dumps([task()]))
        finally:
            os._exit(0)
    os.close(end)

    def result() -> T:
        found: list[T] = _answered(answer, PATIENCE + 5 * (time.monotonic() - began))
        return found[0] if found else task()

    try:
        yield result
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(copy, signal.SIGKILL)
        os.waitpid(copy, 0)
        os.close(answer)


def _two_cores() -> bool:
    return _beside.get() and len(os.sched_getaffinity(0)) > 1


def _taken(numbers: int) -> Iterator[tuple[int, bool]]:
    """Number of each task, and whether it is to be done here: to read its byte is to take it."""
    following = 0
    while byte := os.read(numbers, 1):
        yield from ((number, False) for number in range(following, byte[0]))
        yield byte[0], True
        following = byte[0] + 1


def fork() -> int:
    """Process id of a copy of this process, 0 in the copy."""
    with warnings.catch_warnings():
        # Python warns where there are threads; the copy calls nothing of what they do, and is left
        warnings.simplefilter('ignore', DeprecationWarning)
        return os.fork()


def _answered(answer: int, patience: float) -> list[T]:
    """Result of the copy; none where it ended or hangs."""
    said, until = b'', time.monotonic() + patience
    while select.select([answer], [], [], max(0.0, until - time.monotonic()))[0]:
        part = os.read(answer, 1 << 16)
        if not part:
            break
        said += part
    try:
        found: list[T] = pickle.loads(said)
    except (EOFError, pickle.UnpicklingError):
        return []
    return found
