"""The kernel over blocks of lanes, and how far it is compiled for a user's own law.

The shipped laws run in vector registers. A user's law does too where numba can compile it so: plain
arithmetic on six-tuples, without branches. Else it is compiled for one vehicle at a time, and where
that fails as well it runs as plain Python. Code compiled for it is not kept in the shared folder.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

from auv_analysis.simulation.closed_loop import (
    Grid,
    Loop,
    Motion,
    Tables,
    Workspace,
    fill_continuous,
    fill_held,
    run_continuous,
    run_held,
)
from auv_analysis.simulation.trees import mapped
from auv_dynamics.kernel.compile import (
    JITTED,
    compiled,
    plain,
    uncached,
)
from auv_dynamics.kernel.integrator import Tableau
from auv_dynamics.kernel.lanes import align_stack, of_block, uncounted
from auv_gvc_controller.laws.law import SHIPPED


@compiled
def run_continuous_batch(
    loop: Loop, tables: Tables, grid: Grid, tableau: Tableau, motion: Motion, work: Workspace,
    record: Any, first: int, last: int,
) -> None:  # fmt: skip
    """`fill_continuous` for the blocks of lanes from `first` to before `last`."""
    align_stack()
    for b in range(first, last):
        fill_continuous(
            of_block(loop, b), of_block(tables, b), uncounted(grid), uncounted(tableau),
            of_block(motion, b), of_block(work, 0), of_block(record, b),
        )  # fmt: skip


@compiled
def run_held_batch(
    loop: Loop, tables: Tables, grid: Grid, tableau: Tableau, motion: Motion, work: Workspace,
    record: Any, first: int, last: int,
) -> None:  # fmt: skip
    """`fill_held` for the blocks of lanes from `first` to before `last`."""
    align_stack()
    for b in range(first, last):
        fill_held(
            of_block(loop, b), of_block(tables, b), uncounted(grid), uncounted(tableau),
            of_block(motion, b), of_block(work, 0), of_block(record, b),
        )  # fmt: skip


IN_LANES = {'continuous': run_continuous_batch, 'zoh': run_held_batch}
ALONE = {'continuous': run_continuous, 'zoh': run_held}
IN_PYTHON = 'as plain Python'


class Kernel(NamedTuple):
    """A function of (loop, tables, grid, tableau, motion, work, record, first, last).

    Attributes
    ----------
    run : takes the blocks from `first` to before `last`
    alone : a block is one vehicle: lanes of width 1
    how : in words, for people

    """

    run: Callable[..., None]
    alone: bool
    how: str


def kernels(law: Any, hold: str) -> Sequence[Kernel]:
    """Kernels for a law, the fastest first; the last one always works.

    Parameters
    ----------
    law : its class
    hold : 'continuous' or 'zoh'

    """
    if law in SHIPPED.values():
        run = IN_LANES[hold] if JITTED else plain(IN_LANES[hold])
        return [Kernel(run, False, 'in vector registers' if JITTED else 'as NumPy arrays')]
    return _of_user(law, hold)


@cache
def _of_user(law: Any, hold: str) -> Sequence[Kernel]:
    """Kernels of their own for each law: numba takes two classes of one name for the same."""
    in_python = Kernel(_one_by_one(plain(ALONE[hold])), True, IN_PYTHON)
    if not JITTED:
        return [in_python]
    return [
        Kernel(uncached(plain(IN_LANES[hold])), False, 'in vector registers'),
        Kernel(_one_by_one(uncached(plain(ALONE[hold]))), True, 'compiled'),
        in_python,
    ]


def _one_by_one(function: Callable[..., None]) -> Callable[..., None]:
    """A kernel of one vehicle as one of blocks, each of one vehicle."""

    def run(
        loop: Loop, tables: Tables, grid: Grid, tableau: Tableau, motion: Motion, work: Workspace,
        record: Any, first: int, last: int,
    ) -> None:  # fmt: skip
        def only(value: Any, b: int) -> Any:
            return mapped(lambda lanes: lanes[..., 0], of_block(value, b))

        for b in range(first, last):
            known = tables if getattr(tables, 'SHARED', False) else only(tables, b)
            function(
                only(loop, b), known, grid, tableau, only(motion, b), only(work, 0),
                only(record, b),
            )  # fmt: skip

    return run
