"""Figures of a block as a table: one row per rollout and controller.

The arrays are made of their buffers: `pa.array` imports pandas wherever that is installed, which
takes longer than a thousand rollouts.
"""

from typing import Any

import numpy as np
import pyarrow as pa

from auv_analysis.sweep.block import Figures
from auv_analysis.sweep.values import Values


def table_of(
    first: int, seeds: np.ndarray, changes: dict[str, Values], figures: dict[str, Figures]
) -> pa.Table:
    """Table of a block, controller by controller.

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
    count, names = len(seeds), list(figures)
    columns = {
        'index': column(np.tile(np.arange(first, first + count), len(names))),
        'controller': column([name for name in names for _ in range(count)]),
        'seed': column(np.tile(seeds, len(names))),
    }
    for path, values in changes.items():
        every = (
            np.tile(values, len(names)) if isinstance(values, np.ndarray) else values * len(names)
        )
        columns[path] = column(every)
    for key in figures[names[0]]:
        whole = np.concatenate([figures[name][key] for name in names])
        columns[key] = column(whole.tolist() if whole.dtype == object else whole)
    return pa.table(columns)


def column(values: Values) -> pa.Array:
    """Arrow array of values of one kind.

    Parameters
    ----------
    values : array of int64, float64 (NaN becomes null) or bool, or a list of words or of nested
        lists of numbers

    """
    if isinstance(values, np.ndarray):
        return _of_array(values)
    if isinstance(values[0], list):
        inner = [entry for value in values for entry in value]
        ends = _buffer(_ends(values))
        entries = column(np.array(inner, float) if not isinstance(inner[0], list) else inner)
        kind = pa.list_(entries.type)
        return pa.Array.from_buffers(kind, len(values), [None, ends], children=[entries])
    encoded = [word.encode() for word in values]
    return pa.StringArray.from_buffers(
        len(encoded), _buffer(_ends(encoded)), pa.py_buffer(b''.join(encoded))
    )


def _of_array(values: np.ndarray) -> pa.Array:
    if values.dtype == bool:
        bits = [None, _buffer(np.packbits(values, bitorder='little'))]
        return pa.Array.from_buffers(pa.bool_(), len(values), bits)
    if values.dtype == np.int64:
        return pa.Array.from_buffers(pa.int64(), len(values), [None, _buffer(values)])
    values = values.astype(np.float64)
    known = np.packbits(~np.isnan(values), bitorder='little')
    return pa.Array.from_buffers(pa.float64(), len(values), [_buffer(known), _buffer(values)])


def _buffer(values: np.ndarray) -> pa.Buffer:
    return pa.py_buffer(np.ascontiguousarray(values))


def _ends(values: list[Any]) -> np.ndarray:
    return np.cumsum([0, *map(len, values)], dtype=np.int32)
