"""Quantiles of one column of figures; of times, one that does not exist is the latest."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.output.new_files import known
from auv_analysis.studies.sweep.dataset import by_group

LEVELS = {'low': 0.05, 'quarter': 0.25, 'median': 0.5, 'three_quarters': 0.75, 'high': 0.95}
Row = dict[str, Any]
POINTS = 201  # of a distribution function as it is drawn


def ordered(values: np.ndarray, unit: str) -> np.ndarray:
    """The same values; a time that does not exist is later than any other."""
    return np.where(np.isnan(values), np.inf, values) if unit == 's' else values


class Ordered(NamedTuple):
    """Values of a figure in the m rows of a controller, sorted.

    Attributes
    ----------
    ascending : (k,) of those that exist; of a time, one that does not is infinite and the last
    places : (k,) which of the rows each is
    ranks : (m,) from 1 on, the mean of those that are equal; NaN of what does not exist

    """

    ascending: np.ndarray
    places: np.ndarray
    ranks: np.ndarray

    @classmethod
    def of(cls, values: np.ndarray, unit: str = '') -> 'Ordered':
        """Of the values (m,) of a figure in its unit."""
        at = ordered(values, unit)
        places = np.argsort(at)[: len(at) - int(np.isnan(at).sum())]  # NaN is the last
        ascending, ranks = at[places], np.full(len(at), np.nan)
        new = ascending[1:] != ascending[:-1]
        starts = np.flatnonzero(np.append([True], new)[: len(places)])  # of what is equal
        ends = np.append(starts[1:], len(ascending))
        ranks[places] = np.repeat((starts + ends + 1) / 2, ends - starts)
        return cls(ascending, places, ranks)

    def groups(self, codes: np.ndarray, count: int) -> list[np.ndarray]:
        """Values in each of so many groups, sorted, by the group (m,) of each row."""
        return by_group(self.ascending, codes[self.places], count)


def quantiles(values: np.ndarray, levels: Iterable[float]) -> np.ndarray:
    """Quantiles that are values themselves, so that one of them may be infinite; NaN is left out.

    Parameters
    ----------
    values : (n,)
    levels : from 0 to 1

    """
    there = values[~np.isnan(values)]
    places = _places(len(there), levels)
    return np.partition(there, places)[places] if len(there) else np.full(len(places), np.nan)


def _places(count: int, levels: Iterable[float]) -> np.ndarray:
    """Places of quantiles among sorted values: the inverse of their distribution function."""
    return np.clip(np.ceil(count * np.array([*levels]) - 1).astype(int), 0, max(count - 1, 0))


def spread(values: np.ndarray, unit: str) -> Row:
    """Quantiles of a figure as columns; None: it does not exist there, such as a settling time.

    `known` counts the values that exist; of a time, the quantiles count one that does not as late.
    """
    at = ordered(values, unit)
    at = at[~np.isnan(at)]
    if len(at):
        last = max(np.count_nonzero(at < np.inf) - 1, 0)
        at.partition([0, *_places(len(at), LEVELS.values()), last])  # sorted where it is read
    return spread_of_sorted(at, len(values))


def spread_of_sorted(values: np.ndarray, rows: int) -> Row:
    """The same of sorted values, of which the last ones may be infinite."""
    finite = values[: np.searchsorted(values, np.inf)]
    row: Row = {'rows': rows, 'known': len(finite)}
    row |= {'smallest': finite[0] if len(finite) else None}
    at = values[_places(len(values), LEVELS.values())] if len(values) else [np.nan] * len(LEVELS)
    row |= {name: known(value) for name, value in zip(LEVELS, at, strict=True)}
    row |= {'largest': finite[-1] if len(finite) else None}
    return row | {'mean': finite.mean() if len(finite) else None}


def thinned(values: np.ndarray) -> np.ndarray:
    """Values with the same quantiles, few enough to be drawn; NaN is left out."""
    count = np.count_nonzero(~np.isnan(values))
    return quantiles(values, np.linspace(0.0, 1.0, min(int(count), POINTS)))


def varying(values: Sequence[np.ndarray], unit: str) -> bool:
    """Whether there is more than one value; of a time, one that does not exist is one as well."""
    whole = np.concatenate(values)
    finite = whole[np.isfinite(whole)]
    if len(finite) == 0:
        return False
    late = unit == 's' and len(finite) < len(whole)
    return late or bool(np.ptp(finite) > 1e-12 * np.abs(finite).max())
