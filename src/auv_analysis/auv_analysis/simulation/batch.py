"""Many closed loops at once: vehicles in lanes, blocks of lanes over threads, figures reduced."""

import re
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from math import prod
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.output.progress import each, say
from auv_analysis.simulation.closed_loop import (
    Grid,
    Loop,
    Motion,
    SharedTables,
    Tables,
    Workspace,
)
from auv_analysis.simulation.kernels import Kernel, kernels
from auv_analysis.simulation.reduction import Figures
from auv_analysis.simulation.trees import kept, mapped
from auv_dynamics.kernel.integrator import TABLEAUS, stage_times
from auv_dynamics.kernel.lanes import (
    empty,
    packed,
    unpacked,
    width,
)
from auv_dynamics.plant.actuators import memory
from auv_dynamics.plant.faulty_devices import history_shape
from auv_dynamics.plant.plant import SIZE
from auv_gvc_controller.control.sampled import user_law

Known = Callable[[np.ndarray], Tables]  # stage times t (T, s) of the next block -> its tables
SHARED_STEPS = 1024  # steps that are tabulated at once where all vehicles share the tables
OWN_STEPS = 256  # the same where each has its own
PARTS = 4  # of a batch per thread, so that a slow one is made up for
NESTED = re.compile(r'\w+Error: ')
LONGEST = 160  # of what is said of it
OWN_VEHICLES = 16  # of a part where each has its own tables


@dataclass(frozen=True)
class Batch:
    """B closed loops of one law over one grid of steps.

    Attributes
    ----------
    loop : every array with a leading axis of B, or of 1 where all vehicles have the same
    x : (B, 13 + m) at the start
    band : (B, 6) or (1, 6) of a settled error, m/s and rad/s
    step : s
    steps : n, index of the last sample
    integrator : 'ode5', 'rk4' or 'euler'
    hold : 'continuous' or 'zoh'
    shared : gives the tables of all vehicles; None: `own` gives those of each
    own : for the indices of some vehicles, a function of the same kind with tables (count, T, ...)
    record : what is kept of the samples: a named tuple with `start` and `fill_record`, as `Figures`

    """

    loop: Loop
    x: np.ndarray
    band: np.ndarray
    step: float
    steps: int
    integrator: str
    hold: str
    shared: Known | None
    own: Callable[[range], Known] | None = None
    record: Any = Figures

    def __len__(self) -> int:
        return len(self.x)


def run_batch(batch: Batch, threads: int = 1, executor: Executor | None = None) -> Any:
    """Run all loops of a batch.

    Parameters
    ----------
    batch : Batch; the figures of a vehicle do not depend, bit for bit, on the others in it
    threads : how many to use
    executor : of threads, to be used in place of own ones

    Returns
    -------
    figures : `batch.record` with arrays (B, n)

    """
    job = _job(batch, kernel_of(batch))
    parts = _parts(len(job.record.outside), job.lanes, threads, own=batch.shared is None)
    if executor is None and (threads == 1 or len(parts) == 1):
        for part in each(parts, len(parts)):
            _run_part(job, part)
    elif executor is not None:
        list(executor.map(partial(_run_part, job), parts))
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(each(pool.map(partial(_run_part, job), parts), len(parts)))
    return mapped(lambda blocks: unpacked(blocks, len(batch)), job.record)


class _Job(NamedTuple):
    batch: Batch
    kernel: Kernel
    lanes: int
    loop: Loop
    record: Any
    tables: Sequence[tuple[Grid, Tables]] | None


def kernel_of(batch: Batch) -> Kernel:
    """Fastest kernel that takes the batch's law; compiles a user's law to find out, once."""
    law = type(batch.loop.gains)
    with _CHOOSING:  # the others wait: numba compiles one at a time anyway
        if (law, batch.hold) not in _CHOSEN:
            _CHOSEN[law, batch.hold] = _chosen(batch, kernels(law, batch.hold))
    return _CHOSEN[law, batch.hold]


_CHOSEN: dict[tuple[Any, str], Kernel] = {}
_CHOOSING = threading.Lock()


def _chosen(batch: Batch, candidates: Sequence[Kernel]) -> Kernel:
    """First kernel that numba compiles, tried on no steps; the last one is plain Python."""
    *compiled, in_python = candidates
    for kernel in compiled:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter('ignore')  # what numba thinks of a user's code
                _run_part(_job(batch, kernel), range(1), trial=True)
        except Exception as error:  # numba fails in many ways on what it does not know
            why = _why(error)
        else:
            return kernel
    if compiled:
        law = type(batch.loop.gains).__name__
        say(f'note: the law {law} runs as plain Python, slower: numba cannot compile it: {why}')
    return in_python


def _why(error: Exception) -> str:
    """What the innermost error of numba says, and where it met it, in one line."""
    lines = [line.strip() for line in f'{type(error).__name__}: {error}'.splitlines()]
    last = max((i for i, line in enumerate(lines) if NESTED.match(line)), default=0)
    said = lines[last : last + 2] if 'Failed in' in lines[last] else lines[last : last + 1]
    where = next((line.rstrip(':') for line in lines[last:] if line.startswith('File "')), '')
    return ', '.join(filter(None, (said[-1][:LONGEST], where)))


def _job(batch: Batch, kernel: Kernel) -> _Job:
    lanes = 1 if kernel.alone else width(len(batch))
    loop, band = pack(batch.loop, lanes), packed(batch.band, lanes)
    count = -(-len(batch) // lanes)
    record = batch.record.start(loop.model, band, batch.step, partial(_full, count, lanes))
    return _Job(batch, kernel, lanes, loop, record, _listed(batch))


def pack(value: Any, lanes: int) -> Any:
    """Lanes of every array (B, ...) or (1, ...); one that stands in several places only once."""
    done: dict[tuple[Any, ...], np.ndarray] = {}

    def once(array: np.ndarray) -> np.ndarray:
        place = array.ctypes.data, array.shape, array.strides
        if place not in done:
            done[place] = packed(array, lanes)
        return done[place]

    return mapped(once, value)


def _full(count: int, lanes: int, n: int, value: float) -> np.ndarray:
    array = empty((count, n, lanes))
    array[...] = value
    return array


def _parts(count: int, lanes: int, threads: int, *, own: bool) -> list[range]:
    """Blocks 0 ... count in pieces that threads work on."""
    size = -(-count // (PARTS * threads)) if threads > 1 else count
    if own:
        size = min(size, max(1, OWN_VEHICLES // lanes))
    return [range(first, min(first + size, count)) for first in range(0, count, size)]


def _grids(batch: Batch, size: int) -> Iterator[Grid]:
    tableau, count = TABLEAUS[batch.integrator], batch.steps + 1
    for first in range(0, count, size):
        t = stage_times(tableau, batch.step, first, min(size, count - first))
        yield Grid(t, batch.step, first, batch.steps)


def _listed(batch: Batch) -> Sequence[tuple[Grid, Tables]] | None:
    """Shared tables of the whole run where they are few; else each part makes them anew."""
    if batch.shared is None or batch.steps > 64 * SHARED_STEPS:
        return None
    return list(_shared(batch))


def _shared(batch: Batch) -> Iterator[tuple[Grid, Tables]]:
    assert batch.shared is not None
    for grid in _grids(batch, SHARED_STEPS):
        yield grid, SharedTables(*batch.shared(grid.t))


def _own(batch: Batch, lanes: int, blocks: range) -> Iterator[tuple[Grid, Tables]]:
    assert batch.own is not None
    known = batch.own(range(blocks.start * lanes, min(blocks.stop * lanes, len(batch))))
    for grid in _grids(batch, OWN_STEPS):
        yield grid, Tables(*(packed(table, lanes) for table in known(grid.t)))


def _run_part(job: _Job, blocks: range, *, trial: bool = False) -> None:
    """Run some blocks of lanes from the first step to the last; a trial takes no step."""
    batch, lanes = job.batch, job.lanes
    tableau, size = TABLEAUS[batch.integrator], batch.x.shape[1]
    x = packed(batch.x[blocks.start * lanes : blocks.stop * lanes], lanes)
    count, faults = len(x), job.loop.faults
    held, history = memory(job.loop.actuators, faults=faults.any).shape, history_shape(faults)
    motion = Motion(
        x,
        x[:, :SIZE].copy(),
        _full(count, lanes, size - SIZE, 0.0),
        _full(count, lanes, prod(held), 0.0).reshape(count, *held, lanes),
        _full(count, lanes, prod(history), 0.0).reshape(count, *history, lanes),
    )
    work = Workspace(empty((1, len(tableau.b), size, lanes)), empty((1, size, lanes)))
    here = slice(blocks.start, blocks.stop)
    loop, record = kept(job.loop, here), kept(job.record, here)
    known = job.tables or (_shared(batch) if batch.shared else _own(batch, lanes, blocks))
    for grid, tables in known:
        steps = grid._replace(t=grid.t[:0]) if trial else grid
        with np.errstate(all='ignore'), nullcontext() if trial else user_law(loop.gains):
            job.kernel.run(loop, tables, steps, tableau, motion, work, record, 0, count)
        if trial:
            return
