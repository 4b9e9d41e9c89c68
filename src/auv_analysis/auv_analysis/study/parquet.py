"""Tables of a study as Parquet files."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from auv_analysis.sweep.table import column


def write_table(path: Path, columns: Mapping[str, Sequence[Any]]) -> Path:
    """Write columns of words, whole numbers or numbers.

    Parameters
    ----------
    path : of the file
    columns : name -> as many values each; None among numbers becomes null

    """
    arrays = {name: _array(values) for name, values in columns.items()}
    pq.write_table(pa.table(arrays), path)
    return path


def _array(values: Sequence[Any]) -> pa.Array:
    if all(isinstance(value, str) for value in values):
        return column([str(value) for value in values]) if values else pa.array([], pa.string())
    if all(isinstance(value, int | np.integer) for value in values):
        return column(np.array(values, np.int64))
    return column(np.array([np.nan if value is None else value for value in values], float))
