"""Many closed loops at once: vehicles in lanes, blocks of them over threads, metrics reduced."""

import re
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.output.progress import each, say
from auv_analysis.simulation.closed_loop import (
    RUNS,
    Loop,
    LoopState,
    StepBlock,
    Tables,
    Workspace,
)
from auv_analysis.simulation.reduction import Figures
from auv_dynamics.kernel import LANES
from auv_dynamics.kernel.compile import JITTED, plain, uncached
from auv_dynamics.kernel.integrator import TABLEAUS, stage_times
from auv_dynamics.kernel.lanes import (
    block_count,
    empty,
    mapped,
    packed,
    take_rows,
    unpacked,
)
from auv_dynamics.plant.actuators import memory
from auv_dynamics.plant.devices import history_shape
from auv_dynamics.plant.plant import SIZE
from auv_gvc_controller.control.sampled_law import user_law
from auv_gvc_controller.laws.law import SHIPPED

Known = Callable[[np.ndarray], Tables]  # stage times t (T, s) of the next block -> its tables
SHARED_STEPS = 128  # steps that are tabulated at once where all vehicles share the tables
OWN_STEPS = 256  # the same where each has its own
LISTED = 64  # blocks of shared tables that are kept for all parts of a batch
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


def run_batch(batch: Batch, threads: int = 1) -> Any:
    """Run all loops of a batch.

    Parameters
    ----------
    batch : Batch; the figures of a vehicle do not depend, bit for bit, on the others in it
    threads : how many to use

    Returns
    -------
    figures : `batch.record` with arrays (B, n)

    """
    job = _job(batch, kernel_of(batch))
    parts = _parts(len(job.record.outside), job.kernel.lanes, threads, own=batch.shared is None)
    if threads == 1 or len(parts) == 1:
        for part in each(parts, len(parts)):
            _run_part(job, part)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(each(pool.map(partial(_run_part, job), parts), len(parts)))
    return mapped(lambda blocks: unpacked(blocks, len(batch), job.kernel.lanes), job.record)


class Kernel(NamedTuple):
    """A function of `RUNS`, compiled or not, and how many vehicles it takes side by side.

    Attributes
    ----------
    run : takes the blocks from `first` to before `last`
    lanes : vehicles of a block; None: one, alone
    how : in words, for people

    """

    run: Callable[..., None]
    lanes: int | None
    how: str


IN_REGISTERS, ALONE, IN_PYTHON = 'in vector registers', 'compiled', 'as plain Python'


@cache
def kernels(law: Any, hold: str) -> Sequence[Kernel]:
    """Kernels for a law, the fastest first; the last one always works.

    A user's law runs in vector registers where numba can compile it so: plain arithmetic on
    six-tuples, without branches. Else it is compiled for one vehicle at a time, and where that
    fails as well it runs as plain Python. Code compiled for it is not kept in the shared folder.

    Parameters
    ----------
    law : its class
    hold : 'continuous' or 'zoh'

    """
    source = plain(RUNS[hold])
    in_python = Kernel(source, None, IN_PYTHON)
    if not JITTED:
        return [in_python]
    if law in SHIPPED.values():
        return [Kernel(RUNS[hold], LANES, IN_REGISTERS if LANES else ALONE)]
    # of each law its own: numba takes two classes of one name for the same
    in_registers = [Kernel(uncached(source), LANES, IN_REGISTERS)] if LANES else []
    return [*in_registers, Kernel(uncached(source), None, ALONE), in_python]


class _Job(NamedTuple):
    batch: Batch
    kernel: Kernel
    loop: Loop
    record: Any
    tables: Sequence[tuple[StepBlock, Tables]] | None


def kernel_of(batch: Batch) -> Kernel:
    """Fastest kernel that takes the batch's law; compiles a user's law to find out, once."""
    law: Any = type(batch.loop.gains)
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
    """The innermost error of numba with its place, in one line."""
    lines = [line.strip() for line in f'{type(error).__name__}: {error}'.splitlines()]
    last = max((i for i, line in enumerate(lines) if NESTED.match(line)), default=0)
    said = lines[last : last + 2] if 'Failed in' in lines[last] else lines[last : last + 1]
    where = next((line.rstrip(':') for line in lines[last:] if line.startswith('File "')), '')
    return ', '.join(filter(None, (said[-1][:LONGEST], where)))


def _job(batch: Batch, kernel: Kernel) -> _Job:
    lanes = kernel.lanes
    loop, band = pack(batch.loop, lanes), packed(batch.band, lanes)
    like = partial(_full, block_count(len(batch), lanes), lanes)
    record = batch.record.start(loop.model, band, batch.step, like)
    return _Job(batch, kernel, loop, record, _listed(batch, lanes))


def pack(value: Any, lanes: int | None) -> Any:
    """Blocks of every array (B, ...) or (1, ...); one that stands in several places only once."""
    done: dict[tuple[Any, ...], np.ndarray] = {}

    def once(array: np.ndarray) -> np.ndarray:
        place = array.ctypes.data, array.shape, array.strides
        if place not in done:
            done[place] = packed(array, lanes)
        return done[place]

    return mapped(once, value)


def _full(count: int, lanes: int | None, shape: int | tuple[int, ...], value: float) -> np.ndarray:
    inner = (shape,) if isinstance(shape, int) else shape
    array = empty((count, *inner, *([] if lanes is None else [lanes])))
    array[...] = value
    return array


def _parts(count: int, lanes: int | None, threads: int, *, own: bool) -> list[range]:
    """Blocks 0 ... count in pieces that threads work on."""
    size = -(-count // (PARTS * threads)) if threads > 1 else count
    if own:
        size = min(size, max(1, OWN_VEHICLES // (lanes or 1)))
    return [range(first, min(first + size, count)) for first in range(0, count, size)]


def _grids(batch: Batch, size: int) -> Iterator[StepBlock]:
    tableau, count = TABLEAUS[batch.integrator], batch.steps + 1
    for first in range(0, count, size):
        t = stage_times(tableau, batch.step, first, min(size, count - first))
        yield StepBlock(t, batch.step, first, batch.steps)


def _listed(batch: Batch, lanes: int | None) -> Sequence[tuple[StepBlock, Tables]] | None:
    """Shared tables of the whole run where they are few; else each part makes them anew."""
    if batch.shared is None or batch.steps > LISTED * SHARED_STEPS:
        return None
    return list(_shared(batch, lanes))


def _shared(batch: Batch, lanes: int | None) -> Iterator[tuple[StepBlock, Tables]]:
    assert batch.shared is not None
    for grid in _grids(batch, SHARED_STEPS):
        yield grid, Tables(*(packed(table[None], lanes) for table in batch.shared(grid.t)))


def _own(batch: Batch, lanes: int | None, blocks: range) -> Iterator[tuple[StepBlock, Tables]]:
    assert batch.own is not None
    wide = lanes or 1
    known = batch.own(range(blocks.start * wide, min(blocks.stop * wide, len(batch))))
    for grid in _grids(batch, OWN_STEPS):
        yield grid, Tables(*(packed(table, lanes) for table in known(grid.t)))


def _run_part(job: _Job, blocks: range, *, trial: bool = False) -> None:
    """Run some blocks of vehicles from the first step to the last; a trial takes no step."""
    batch, lanes = job.batch, job.kernel.lanes
    tableau, size, wide = TABLEAUS[batch.integrator], batch.x.shape[1], lanes or 1
    x = packed(batch.x[blocks.start * wide : blocks.stop * wide], lanes)
    count, faults = len(x), job.loop.faults
    held, history = memory(job.loop.actuators, faults=faults.any).shape, history_shape(faults)
    zeros = partial(_full, count, lanes, value=0.0)
    motion = LoopState(x, x[:, :SIZE].copy(), zeros(size - SIZE), zeros(held), zeros(history))
    work = Workspace(_full(1, lanes, (len(tableau.b), size), 0.0), _full(1, lanes, size, 0.0))
    here = slice(blocks.start, blocks.stop)
    loop, record = take_rows(job.loop, here), take_rows(job.record, here)
    known = job.tables or (_shared(batch, lanes) if batch.shared else _own(batch, lanes, blocks))
    for grid, tables in known:
        steps = grid._replace(t=grid.t[:0]) if trial else grid
        with np.errstate(all='ignore'), nullcontext() if trial else user_law(loop.gains):
            job.kernel.run(loop, tables, steps, tableau, motion, work, record, 0, count, lanes)
        if trial:
            return
