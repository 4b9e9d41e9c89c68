"""Named tuples of arrays, and of named tuples, taken as a whole."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np


def mapped(function: Callable[[np.ndarray], Any], value: Any) -> Any:
    """The same with every array replaced by what the function makes of it."""
    if isinstance(value, np.ndarray):
        return function(value)
    if isinstance(value, tuple):
        return type(value)(*(mapped(function, part) for part in value))
    return value


def arrays(value: Any) -> Iterator[np.ndarray]:
    """Every array, in the order of the fields."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for part in value:
            yield from arrays(part)


def led(value: Any, axes: int = 0) -> Any:
    """With a leading axis of 1 on every array, or on those that have less than so many axes."""
    return mapped(lambda array: array if 0 < axes <= array.ndim else array[None], value)


def kept(value: Any, keep: np.ndarray | slice) -> Any:
    """Rows that a mask or slice keeps of arrays (B, ...); arrays (1, ...) are those of all rows."""
    return mapped(lambda array: array if len(array) == 1 else array[keep], value)


def joined(values: Sequence[Any], counts: Sequence[int]) -> Any:
    """Rows of several, each of as many rows as `counts` says or of one that stands for all."""
    first = values[0]
    if isinstance(first, np.ndarray):
        pairs = zip(values, counts, strict=True)
        return np.concatenate([np.broadcast_to(v, (n, *v.shape[1:])) for v, n in pairs])
    if isinstance(first, tuple):
        return type(first)(*(joined(parts, counts) for parts in zip(*values, strict=True)))
    return first
