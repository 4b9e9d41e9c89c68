"""What runs the blocks of a sweep: threads of this process, or dask here and elsewhere."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager

from auv_analysis.failure import FailedError
from auv_dynamics.files import InputError, first_line

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
