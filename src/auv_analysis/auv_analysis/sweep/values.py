"""Listed values and ranges of a campaign, as arrays of one kind."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from auv_dynamics.files import shorten

Values = np.ndarray | list[Any]  # numbers and true/false as an array, words and lists as they are
LARGEST_INTEGER = 2**63 - 1


def axis_values(axis: Any) -> Values:
    """Values of a checked axis: a list, or a range with both its ends.

    Raises
    ------
    ValueError : (expected, found)

    """
    if not isinstance(axis, Mapping):
        return of_one_kind(axis)
    first, last, count = float(axis['from']), float(axis['to']), int(axis['count'])
    if axis.get('spacing', 'linear') == 'linear':
        return np.linspace(first, last, count)
    if first * last <= 0:
        raise ValueError('from and to of one sign for spacing log', f'{first:g} to {last:g}')
    return np.geomspace(first, last, count)


def of_one_kind(values: Sequence[Any]) -> Values:
    """Listed values, which must all be numbers, all words, all true or false, or all lists.

    Raises
    ------
    ValueError : (expected, found)

    """
    kinds = {_kind(value): value for value in values}
    if len(kinds) > 1:
        found = ' and '.join(shorten(value) for value in kinds.values())
        raise ValueError('values of one kind', found)
    kind = next(iter(kinds))
    if kind == 'number':
        whole = all(isinstance(v, int) and abs(v) <= LARGEST_INTEGER for v in values)
        return np.array(values, np.int64 if whole else np.float64)
    if kind == 'truth':
        return np.array(values, bool)
    return list(values)


def _kind(value: Any) -> str:
    if isinstance(value, bool):
        return 'truth'
    if isinstance(value, int | float):
        return 'number'
    if isinstance(value, str):
        return 'word'
    return f'list {_dimensions(value)}'


def _dimensions(value: list[Any]) -> int:
    """Levels of nested lists, which must hold numbers alone."""
    try:
        array = np.array(value, float)
    except (ValueError, TypeError):
        raise ValueError('a list or matrix of numbers', shorten(value)) from None
    if not np.isfinite(array).all():
        raise ValueError('finite numbers', shorten(value))
    return array.ndim


def take(values: Values, indices: np.ndarray) -> Values:
    """Values at indices (n,)."""
    if isinstance(values, np.ndarray):
        return values[indices]
    return [values[i] for i in indices]
