"""Several vehicles at once: batches of arrays, their lanes, and choices without branches.

The mathematics is written for one vehicle, whose coefficients and state are arrays of floats. A
batch has a leading axis of the vehicles on each of them. It is run in *blocks*: of one vehicle, or,
where `simd` is there, of as many as a vector register holds. Those are *lanes*: arrays (n, W), an
element of which is W numbers that are added and multiplied together.

What the vehicles may decide differently cannot be an `if`: it is a `select`.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from auv_dynamics.kernel.compile import helper, of_numbers

Number = Any  # a float, or that of each of several vehicles: a lane
ALIGNMENT = 64  # bytes of a cache line


@of_numbers
def select(condition: Any, a: Number, b: Number) -> Number:
    """`a` where the condition holds, else `b`."""
    return a if condition else b


@of_numbers
def anywhere(condition: Any) -> bool:
    """Whether a condition holds for any of the vehicles."""
    return bool(condition)


@helper
def clip(x: Number, low: Number, high: Number) -> Number:
    """`x` brought between two bounds; NaN stays what it is."""
    return select(x < low, low, select(x > high, high, x))


@of_numbers
def sqrt(x: Number) -> Number:
    """Square root."""
    return np.sqrt(x)


@of_numbers
def sin(x: Number) -> Number:
    """Sine of an angle in rad."""
    return np.sin(x)


def align_stack(lanes: int | None) -> None:
    """Let a kernel put the lanes that find no register at the borders of cache lines.

    Else it depends on the caller's depth whether they straddle them, and on that a fifth of the
    time.
    """


def of_block(value: Any, b: int, lanes: int | None) -> Any:
    """One block of a batch.

    Parameters
    ----------
    value : array (blocks, ...) or (blocks, ..., W), or a named tuple of such arrays and of numbers
    b : index of the block; an array of one block is that of all
    lanes : W; None: a block is one vehicle

    Returns
    -------
    value : the same with arrays (...), of floats or of lanes

    """
    return mapped(lambda array: array[b if len(array) > 1 else 0], value)


def packed(values: np.ndarray, lanes: int | None) -> np.ndarray:
    """Blocks of the values of a batch.

    Parameters
    ----------
    values : (B, ...) a row per vehicle; B = 1: the same for all
    lanes : W; None: a block is one vehicle

    Returns
    -------
    blocks : (blocks, ..., W), the last block filled up with its last vehicle, or (B, ...), a copy;
        blocks = 1 for B = 1

    """
    values = np.asarray(values, float)
    if lanes is None:
        return np.array(values, order='C')
    count = block_count(len(values), lanes)
    if count * lanes != len(values):
        values = values[np.minimum(np.arange(count * lanes), len(values) - 1)]
    rows = values.reshape(count, lanes, *values.shape[1:])
    blocks = empty((count, *values.shape[1:], lanes))
    blocks[...] = rows.transpose(0, *range(2, rows.ndim), 1)
    return blocks


def unpacked(blocks: np.ndarray, count: int, lanes: int | None) -> np.ndarray:
    """Values (B, ...) of the first `count` vehicles of blocks."""
    if lanes is None:
        return blocks[:count].copy()
    rows = np.moveaxis(blocks, -1, 1)
    return rows.reshape(rows.shape[0] * rows.shape[1], *rows.shape[2:])[:count].copy()


def block_count(count: int, lanes: int | None) -> int:
    """Number of blocks of so many vehicles."""
    return -(-count // (lanes or 1))


def empty(shape: tuple[int, ...]) -> np.ndarray:
    """Uninitialised float64 array that begins at a cache line."""
    size = math.prod(shape) * 8
    memory = np.empty(size + ALIGNMENT, np.uint8)
    start = -memory.__array_interface__['data'][0] % ALIGNMENT  # sooner there than `ctypes.data`
    return memory[start : start + size].view(float).reshape(shape)


def mapped(function: Callable[[np.ndarray], Any], value: Any) -> Any:
    """A tree of named tuples of arrays, with what a function makes of each array."""
    if isinstance(value, np.ndarray):
        return function(value)
    if isinstance(value, tuple):
        return type(value)(*(mapped(function, part) for part in value))
    return value


def arrays(value: Any) -> Iterator[np.ndarray]:
    """Every array of such a tree, in the order of the fields."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for part in value:
            yield from arrays(part)


def with_batch_axis(value: Any, axes: int = 0) -> Any:
    """With a leading axis of 1 on every array, or on those that have less than so many axes."""
    return mapped(lambda array: array if 0 < axes <= array.ndim else array[None], value)


def take_rows(value: Any, rows: np.ndarray | slice) -> Any:
    """Rows that a mask or slice takes of arrays (B, ...); arrays (1, ...) are those of all rows."""
    return mapped(lambda array: array if len(array) == 1 else array[rows], value)


def joined(values: Sequence[Any], counts: Sequence[int]) -> Any:
    """Rows of several, each of as many rows as `counts` says or of one that stands for all."""
    first = values[0]
    if isinstance(first, np.ndarray):
        pairs = zip(values, counts, strict=True)
        return np.concatenate([np.broadcast_to(v, (n, *v.shape[1:])) for v, n in pairs])
    if isinstance(first, tuple):
        return type(first)(*(joined(parts, counts) for parts in zip(*values, strict=True)))
    return first
