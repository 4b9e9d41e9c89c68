"""Distributions of varied values, by `scipy.stats`, and listed values and ranges beside them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import shorten

Values = np.ndarray | list[Any]  # numbers and true/false as an array, words and lists as they are
LARGEST_INTEGER = 2**63 - 1
SMALLEST, LARGEST = 2.0**-54, 1 - 2.0**-53  # of a probability, so that no quantile is infinite


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


class Distribution(NamedTuple):
    """A distribution.

    Attributes
    ----------
    quantile : (n,) in [0, 1] -> n values
    bounded : whether it has a smallest and a largest value

    """

    quantile: Callable[[np.ndarray], Values]
    bounded: bool


def make_distribution(spec: Mapping[str, Any]) -> Distribution:
    """Distribution of a checked entry: one name, and what that one takes.

    Raises
    ------
    ValueError : (expected, found)

    """
    ((name, values),) = spec.items()
    if name == 'choice':
        return _choice(of_one_kind(values))
    if name in ('normal', 'lognormal'):
        return _normal(values, log=name == 'lognormal')
    low, high = float(values['from']), float(values['to'])
    if low > high:
        raise ValueError(f'a number from {low:g} up in to', f'{high:g}')
    if name == 'integers':
        return _choice(range(int(low), int(high) + 1))
    return _of_interval(name, low, high, values.get('mode'))


def _of_interval(name: str, low: float, high: float, mode: float | None) -> Distribution:
    from scipy import stats

    if mode is not None and not low <= mode <= high:
        raise ValueError(f'a mode from {low:g} to {high:g}', f'{mode:g}')
    if low == high:
        return _choice(np.array([low]))
    if mode is not None:
        frozen = stats.triang((mode - low) / (high - low), low, high - low)
    elif name == 'loguniform':
        frozen = stats.loguniform(low, high)
    else:
        frozen = stats.uniform(low, high - low)
    return Distribution(frozen.ppf, bounded=True)


def _normal(spec: Mapping[str, Any], *, log: bool) -> Distribution:
    """Normal distribution of a number or of its logarithm, cut at `from` and `to`."""
    from scipy import stats

    scale = np.log if log else float
    mean, std = (scale(spec['median']), spec['sigma']) if log else (spec['mean'], spec['std'])
    low, high = spec.get('from', -np.inf), spec.get('to', np.inf)
    a = (scale(low) - mean) / std if 'from' in spec else -np.inf
    b = (scale(high) - mean) / std if 'to' in spec else np.inf
    tails = stats.norm.sf if a > 0 else stats.norm.cdf  # the upper one has its digits in sf
    if not abs(tails(b) - tails(a)) > 0 or a > b:
        expected = 'from and to with some probability between them'
        raise ValueError(expected, f'{a:.4g} to {b:.4g} standard deviations')
    frozen = stats.truncnorm(a, b, mean, std)

    def quantile(u: np.ndarray) -> np.ndarray:
        values = frozen.ppf(np.clip(u, SMALLEST, LARGEST))
        return np.clip(np.exp(values) if log else values, low, high)

    return Distribution(quantile, bounded='from' in spec and 'to' in spec)


def _choice(values: Values | range) -> Distribution:
    """Equally likely values; a point of a design on the edge between two takes the upper one."""
    last = len(values) - 1

    def quantile(u: np.ndarray) -> Values:
        places = np.minimum((u * len(values)).astype(np.int64), last)
        return values.start + places if isinstance(values, range) else take(values, places)

    return Distribution(quantile, bounded=True)
