"""A sweep: blocks of rollouts on any executor, stored as they come; memory does not grow."""

import json
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
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.output.arrow import pa
from auv_analysis.scenario.changes import VEHICLE
from auv_analysis.scenario.scenario import Scenario, scenario_from
from auv_analysis.studies.sweep.campaign import Campaign, concerns, of_controller
from auv_analysis.studies.sweep.folder import SweepFolder, versions
from auv_analysis.studies.sweep.variation import Values, take
from auv_dynamics.files.errors import FailedError, InputError, first_line

Figures = dict[str, np.ndarray]  # column -> (n,)


class BlockError(RuntimeError):
    """A block could not be run; the text is one line."""


def contents_of(campaign: Campaign) -> str:
    """Scenario and vehicles of a campaign as a JSON text; `scenario_of` makes them from it."""
    scenario = campaign.scenario
    vehicles = {
        name: {'path': entry.vehicle_path.name, 'data': entry.vehicle_data}
        for name, entry in ({'': scenario} | campaign.scenarios).items()
    }
    return json.dumps({
        'path': scenario.path.name,  # named in reasons, which shall not depend on the machine
        'scenario': scenario.data,
        'vehicles': vehicles,
        'setpoint.csv': scenario.attachments.get('setpoint.csv'),
        'versions': versions(),
    })  # fmt: skip


@lru_cache(maxsize=64)
def scenario_of(contents: str, vehicle: str) -> Scenario:
    """Scenario of `contents_of` with one of its vehicles."""
    parts = json.loads(contents)
    entry, table = parts['vehicles'][vehicle], parts['setpoint.csv']
    texts = {} if table is None else {'setpoint.csv': table}
    data = parts['scenario'] | ({VEHICLE: vehicle} if vehicle else {})
    return scenario_from(data, entry['data'], Path(parts['path']), Path(entry['path']), texts)


def block_figures(
    contents: str,
    controllers: list[str],
    hold: str,
    changes: dict[str, Values],
    seeds: np.ndarray,
) -> dict[str, Figures]:
    """Figures of a block.

    Parameters
    ----------
    contents : of `contents_of`
    controllers : names
    hold : 'continuous' or 'zoh'
    changes : path -> n values
    seeds : (n,)

    Returns
    -------
    figures : controller -> column -> (n,), see `rollouts`

    Raises
    ------
    BlockError : this worker cannot run it

    """
    asked, here = json.loads(contents)['versions'], versions()
    if asked != here:
        differing = ', '.join(k for k in asked if asked[k] != here.get(k))
        raise BlockError(f'expected workers with the same versions, found another {differing}')
    try:
        return {name: _figures(contents, name, hold, changes, seeds) for name in controllers}
    except InputError as error:  # the sweep could load it: the worker lacks the user's own law
        raise BlockError(f'a worker cannot run this: {error}') from None


def _figures(
    contents: str, controller: str, hold: Any, changes: dict[str, Values], seeds: np.ndarray
) -> Figures:
    from auv_analysis.simulation.rollouts import rollouts

    varied = {
        of_controller(path, controller): values
        for path, values in changes.items()
        if path != VEHICLE and concerns(path, controller)
    }
    vehicles = np.array(changes.get(VEHICLE, [''] * len(seeds)))
    parts, order = [], []
    for vehicle in dict.fromkeys(vehicles.tolist()):
        mine = np.flatnonzero(vehicles == vehicle)
        values = {path: take(column, mine) for path, column in varied.items()}
        try:
            scenario = scenario_of(contents, vehicle)
        except InputError:  # valid in some rows, if any
            scenario = scenario_of(contents, '')
            values[VEHICLE] = [json.loads(contents)['vehicles'][vehicle]['data']] * len(mine)
        parts.append(rollouts(scenario, controller, values, seeds=seeds[mine], hold=hold))
        order.append(mine)
    if len(parts) == 1:
        return parts[0]
    back = np.argsort(np.concatenate(order))
    return {key: np.concatenate([part[key] for part in parts])[back] for key in parts[0]}


def table_of(
    first: int, seeds: np.ndarray, changes: dict[str, Values], figures: dict[str, Figures]
) -> pa.Table:
    """Table of a block: a row per rollout and controller, controller by controller.

    Parameters
    ----------
    first : index of the first of the n rollouts
    seeds : (n,) of the rollouts
    changes : path -> n values
    figures : controller -> column -> (n,)

    Returns
    -------
    table : index, controller, seed, a column per path, then the figures; what is not known is null

    """
    given = {'index': np.arange(first, first + len(seeds)), 'seed': seeds} | changes
    parts = []
    for name, found in figures.items():
        columns = {key: _column(values) for key, values in (given | found).items()}
        words = pa.repeat(name, len(seeds))
        parts.append(pa.table({'index': columns.pop('index'), 'controller': words} | columns))
    return pa.concat_tables(parts).combine_chunks()


def _column(values: Values) -> pa.Array:
    """Arrow array of values of one kind; NaN becomes null, lists of numbers hold floats."""
    if isinstance(values, np.ndarray):
        return pa.array(values, from_pandas=True)
    return pa.array(values, _lists_of_floats(values[0]))


def _lists_of_floats(value: Any) -> pa.DataType | None:
    """Type of nested lists, which hold floats whether they are written so or not."""
    if not isinstance(value, list):
        return pa.float64() if isinstance(value, int | float) else None
    return pa.list_(_lists_of_floats(value[0]) if value else pa.float64())


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

    def add(self, rows: pa.Table, controllers: int) -> None:
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
    outcome, contents, size = Outcome(), contents_of(campaign), folder.block
    pending: dict[Future[Any], tuple[int, np.ndarray, dict[str, Values]]] = {}

    def count(rows: pa.Table) -> None:
        outcome.add(rows, len(campaign.controllers))
        progress(outcome.rollouts)

    def store_next() -> None:
        done, _ = wait(pending, return_when=FIRST_COMPLETED)
        for future in done:
            first, seeds, changes = pending.pop(future)
            rows = table_of(first, seeds, changes, future.result())
            folder.store(first // size, rows)
            count(rows)

    def cancel() -> None:
        for future in list(pending):
            if future.cancel():
                del pending[future]

    finished = set()
    for block, rows in folder.finished(['controller', 'status', 'reason']):
        finished.add(block)
        count(rows)
    outcome.before = outcome.rollouts
    try:
        for block in range(-(-campaign.rollouts // size)):
            if block in finished:
                continue
            first, last = block * size, min((block + 1) * size, campaign.rollouts)
            seeds, changes = campaign.seeds(first, last), campaign.values(first, last)
            while len(pending) >= in_flight():
                store_next()
            asked = contents, campaign.controllers, campaign.hold, changes, seeds
            pending[executor.submit(block_figures, *asked)] = first, seeds, changes
        while pending:
            store_next()
    except KeyboardInterrupt:
        cancel()
        while pending:  # what cannot be cancelled any more
            store_next()
        raise SweepStoppedError('interrupted') from None
    except Exception as error:
        cancel()
        if (why := _why(error)) is None:
            raise
        raise SweepStoppedError(why) from error
    return outcome


def _why(error: Exception) -> str | None:
    """Line on an error that is none of the program; None for the others."""
    of_dask = type(error).__module__.startswith('distributed.')
    if of_dask or isinstance(error, CancelledError | BrokenExecutor):
        return f'the workers are lost ({type(error).__name__})'
    if isinstance(error, BlockError | ArithmeticError | OSError):
        return first_line(error)
    return None


LOOPBACK = '127.0.0.1:0'  # of the HTTP servers of dask
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
                distributed.LocalCluster(
                    count,
                    threads_per_worker=1,
                    dashboard_address=LOOPBACK,  # None: port 8787 of every network
                    worker_dashboard_address=LOOPBACK,
                    scheduler_kwargs={'dashboard': False},
                )
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
