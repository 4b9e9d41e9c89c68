"""Several vehicles at once: arrays whose last axis is the vehicles, and choices without branches.

The mathematics is written for one vehicle, whose coefficients and state are arrays of floats. A
batch runs the same source on *lanes*: arrays (n, W) of W vehicles, an element of which is W numbers
that are added and multiplied together. Compiled, those are the numbers in one vector register, see
`simd`; without numba they are NumPy arrays, and W is the size of the batch.

What the vehicles may decide differently cannot be an `if`: it is a `select`.
"""

from typing import Any

import numpy as np

from auv_dynamics.kernel.compile import JITTED, helper

Number = Any  # a float, or that of each of several vehicles: a lane
ALIGNMENT = 64  # bytes of a cache line


def _register() -> int:
    """How many float64 a vector register of this machine holds, at least four."""
    if JITTED:
        from llvmlite.binding import get_host_cpu_features

        return 8 if get_host_cpu_features().get('avx512f') else 4
    return 4


LANES = _register()


def select(condition: Any, a: Number, b: Number) -> Number:
    """`a` where the condition holds, else `b`."""
    return np.where(condition, a, b) if isinstance(condition, np.ndarray) else a if condition else b


def anywhere(condition: Any) -> bool:
    """Whether a condition holds for any of the vehicles."""
    return bool(np.any(condition))


@helper
def clip(x: Number, low: Number, high: Number) -> Number:
    """`x` brought between two bounds; NaN stays what it is."""
    return select(x < low, low, select(x > high, high, x))


def sqrt(x: Number) -> Number:
    """Square root."""
    return np.sqrt(x)


def uncounted(value: Any) -> Any:
    """The same arrays without numba's reference counts, which cost more than the arithmetic.

    Whoever calls the kernel holds the arrays for as long as it runs.
    """
    return value


def align_stack() -> None:
    """Let a kernel put the lanes that find no register at the borders of cache lines.

    Else it depends on the caller's depth whether they straddle them, and on that a fifth of the
    time.
    """


def of_block(value: Any, b: int) -> Any:
    """Lanes of one block of a batch.

    Parameters
    ----------
    value : array (blocks, ..., W), or a named tuple of such arrays and of numbers; a named tuple
        whose class says `SHARED` belongs to all vehicles and is given as it is
    b : index of the block; an array of one block is that of all

    Returns
    -------
    value : the same with arrays (..., W)

    """
    if getattr(value, 'SHARED', False):
        return value
    if isinstance(value, np.ndarray):
        return value[b if len(value) > 1 else 0]
    if isinstance(value, tuple):
        return type(value)(*(of_block(part, b) for part in value))
    return value


def width(batch: int) -> int:
    """Number of lanes W of a batch of so many vehicles."""
    return LANES if JITTED else max(batch, 1)


def packed(values: np.ndarray, lanes: int) -> np.ndarray:
    """Lanes of the values of a batch.

    Parameters
    ----------
    values : (B, ...) a row per vehicle; B = 1: the same for all
    lanes : W

    Returns
    -------
    blocks : (blocks, ..., W), the last block filled up with its last vehicle; blocks = 1 for B = 1

    """
    values = np.asarray(values, float)
    count = -(-len(values) // lanes)
    rows = np.minimum(np.arange(count * lanes), len(values) - 1)
    blocks = empty((count, *values.shape[1:], lanes))
    blocks[...] = np.moveaxis(values[rows].reshape(count, lanes, *values.shape[1:]), 1, -1)
    return blocks


def unpacked(blocks: np.ndarray, count: int) -> np.ndarray:
    """Values (B, ...) of the first `count` vehicles of blocks (blocks, ..., W)."""
    rows = np.moveaxis(blocks, -1, 1)
    return rows.reshape(rows.shape[0] * rows.shape[1], *rows.shape[2:])[:count].copy()


def empty(shape: tuple[int, ...]) -> np.ndarray:
    """Uninitialised float64 array that begins at a cache line."""
    size = int(np.prod(shape)) * 8
    memory = np.empty(size + ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % ALIGNMENT
    return memory[start : start + size].view(float).reshape(shape)


if JITTED:
    # both give the functions above their compiled form
    import auv_dynamics.kernel.simd
    import auv_dynamics.kernel.simd_memory  # noqa: F401
