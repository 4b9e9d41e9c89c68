"""A sweep: blocks of rollouts on any executor, stored as they come; memory does not grow."""

import os
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from auv_analysis.studies.distributions import Values
from auv_analysis.studies.sweep.blocks import BlockError, block_figures, contents_of
from auv_analysis.studies.sweep.campaign import Campaign
from auv_analysis.studies.sweep.folder import SweepFolder
from auv_dynamics.files.errors import FailedError, InputError, first_line

if TYPE_CHECKING:
    import pyarrow as pa


REFUSED = 'refused'


@dataclass
class Outcome:
    """What lies in the folder.

    Attributes
    ----------
    counts : (controller, status) -> number of rows
    reason : of the first refused row that was seen, '' where there is none
    rollouts : that are finished
    before : of these, that were there already

    """

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    reason: str = ''
    rollouts: int = 0
    before: int = 0

    def add(self, rows: 'pa.Table', controllers: int) -> None:
        """Take note of a block by its columns controller, status and reason."""
        controller, status, reason = (
            rows[name].to_pylist() for name in ('controller', 'status', 'reason')
        )
        self.counts.update(zip(controller, status, strict=True))
        if not self.reason:
            self.reason = next((r for r, s in zip(reason, status, strict=True) if s == REFUSED), '')
        self.rollouts += len(rows) // controllers


class SweepStoppedError(FailedError):
    """The sweep ended before its last block; what is finished is kept."""


@dataclass(frozen=True)
class _Task:
    block: int
    first: int
    seeds: np.ndarray
    changes: dict[str, Values]


def sweep(
    campaign: Campaign,
    folder: SweepFolder,
    executor: Executor,
    in_flight: Callable[[], int],
    progress: Callable[[int], None] = lambda _: None,
) -> Outcome:
    """Run what is not finished yet of a campaign.

    Parameters
    ----------
    campaign : of `load_campaign`
    folder : where its blocks go
    executor : any of concurrent.futures; the figures do not depend on it
    in_flight : tells how many blocks it may be given before one has come back
    progress : told the number of finished rollouts whenever it changes

    Returns
    -------
    outcome : of all blocks, those of earlier runs included

    Raises
    ------
    SweepStoppedError : it was interrupted, or a block failed; the same sweep goes on from there

    """
    run = _Run(campaign, folder, executor, in_flight, progress)
    try:
        run.all()
    except KeyboardInterrupt:
        run.finish_running()
        raise SweepStoppedError('interrupted') from None
    except Exception as error:
        run.cancel()
        if (why := _why(error)) is None:
            raise
        raise SweepStoppedError(why) from error
    return run.outcome


def _why(error: Exception) -> str | None:
    """What is said of an error that is none of the program; None for the others."""
    of_dask = type(error).__module__.startswith('distributed.')
    if of_dask or isinstance(error, CancelledError | BrokenExecutor):
        return f'the workers are lost ({type(error).__name__})'
    if isinstance(error, BlockError | ArithmeticError | OSError):
        return first_line(error)
    return None


class _Run:
    def __init__(
        self,
        campaign: Campaign,
        folder: SweepFolder,
        executor: Executor,
        in_flight: Callable[[], int],
        progress: Callable[[int], None],
    ):
        self._campaign, self._folder, self._executor = campaign, folder, executor
        self._in_flight, self._progress = in_flight, progress
        self._contents = contents_of(campaign)
        self._pending: dict[Future[Any], _Task] = {}
        self.outcome = Outcome()
        self._done = self._read_finished()

    def all(self) -> None:
        """Run every block that is not finished."""
        for task in self._tasks():
            while len(self._pending) >= self._in_flight():
                self._store_next()
            self._submit(task)
        while self._pending:
            self._store_next()

    def finish_running(self) -> None:
        """Store the blocks that cannot be cancelled any more."""
        self.cancel()
        while self._pending:
            self._store_next()

    def cancel(self) -> None:
        """Drop what has not begun."""
        for future in list(self._pending):
            if future.cancel():
                del self._pending[future]

    def _tasks(self) -> Iterator[_Task]:
        campaign, size = self._campaign, self._folder.block
        for block in range(-(-campaign.rollouts // size)):
            if block not in self._done:
                first, last = block * size, min((block + 1) * size, campaign.rollouts)
                yield _Task(block, first, campaign.seeds(first, last), campaign.values(first, last))

    def _submit(self, task: _Task) -> None:
        campaign = self._campaign
        future = self._executor.submit(
            block_figures, self._contents, campaign.controllers, campaign.hold, task.changes,
            task.seeds,
        )  # fmt: skip
        self._pending[future] = task

    def _store_next(self) -> None:
        from auv_analysis.studies.sweep.blocks import table_of

        done, _ = wait(self._pending, return_when=FIRST_COMPLETED)
        for future in done:
            task = self._pending.pop(future)
            rows = table_of(task.first, task.seeds, task.changes, future.result())
            self._folder.store(task.block, rows)
            self._count(rows)

    def _count(self, rows: 'pa.Table') -> None:
        self.outcome.add(rows, len(self._campaign.controllers))
        self._progress(self.outcome.rollouts)

    def _read_finished(self) -> set[int]:
        done = set()
        for block, rows in self._folder.finished(['controller', 'status', 'reason']):
            self._count(rows)
            done.add(block)
        self.outcome.before = self.outcome.rollouts
        return done


AHEAD = 2  # blocks handed over for each worker: one runs, one waits
PATIENCE = 30.0  # s for a scheduler and its first worker

Opened = tuple[Executor, Callable[[], int]]


@contextmanager
def opened(kind: str | None, scheduler: str | None, workers: int | None) -> Iterator[Opened]:
    """Executor, and how many blocks it may be given before one has come back.

    Parameters
    ----------
    kind : 'threads' or 'dask'; None: dask where there is a scheduler, else threads
    scheduler : address of a running dask scheduler; None: dask on this machine
    workers : threads, or processes of dask on this machine; None: as many as there are cores

    Raises
    ------
    InputError : options that do not fit together, no dask, no scheduler
    FailedError : a scheduler without workers

    """
    if scheduler is not None and kind == 'threads':
        raise InputError('--scheduler', '', 'no scheduler beside --executor threads', scheduler)
    if scheduler is not None and workers is not None:
        expected = 'no number beside --scheduler: its workers are its own'
        raise InputError('--workers', '', expected, str(workers))
    count = workers or len(os.sched_getaffinity(0))
    if kind == 'dask' or scheduler is not None:
        with _dask(scheduler, count) as found:
            yield found
        return
    executor = ThreadPoolExecutor(count, thread_name_prefix='sweep')
    try:
        yield executor, lambda: AHEAD * count
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


@contextmanager
def _dask(scheduler: str | None, count: int) -> Iterator[Opened]:
    try:
        import distributed
    except ImportError:
        expected = 'dask.distributed installed: pip install distributed'
        raise InputError('--executor dask', '', expected, 'no such module') from None
    with ExitStack() as stack:
        address: object = scheduler
        if scheduler is None:
            address = stack.enter_context(
                distributed.LocalCluster(count, threads_per_worker=1, dashboard_address=None)
            )
        try:
            client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, ImportError) as error:
            expected = 'the address of a dask scheduler, such as tcp://host:8786'
            found = f'{scheduler} ({first_line(error)})'
            raise InputError('--scheduler', '', expected, found) from None
        stack.enter_context(client)
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise FailedError(f'{scheduler}: no worker within {PATIENCE:g} s') from None
        yield client.get_executor(), lambda: AHEAD * max(1, sum(client.nthreads().values()))
