"""Sums and extremes of many signals over parts of a run, block by block, for whatever is asked."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import reduce

import numpy as np

from auv_analysis.runs.run import Windows


@dataclass(frozen=True, eq=False)
class Part:
    """Statistics of consecutive samples of signals, (k,) each but for the count.

    Attributes
    ----------
    count : number of samples
    first, last : values at the ends
    sums, squares : over the samples
    low, high : extremes
    peak, at : largest magnitude and the time where it is first reached, s
    path : sum of abs(change) from one sample to the next

    """

    count: int
    first: np.ndarray
    last: np.ndarray
    sums: np.ndarray
    squares: np.ndarray
    low: np.ndarray
    high: np.ndarray
    peak: np.ndarray
    at: np.ndarray
    path: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """Means (k,)."""
        return self.sums / self.count

    @property
    def rms(self) -> np.ndarray:
        """Root mean squares (k,)."""
        return np.sqrt(self.squares / self.count)

    @property
    def span(self) -> np.ndarray:
        """Largest minus smallest value (k,)."""
        return self.high - self.low

    def of(self, columns: slice) -> 'Part':
        """The same of some of the signals."""
        count, *values = (getattr(self, entry.name) for entry in fields(self))
        return Part(count, *(value[columns] for value in values))


def part_of(t: np.ndarray, values: np.ndarray) -> Part:
    """Part of samples (n, k) at times (n,), n at least 1."""
    size = np.abs(values)
    where = size.argmax(axis=0)
    return Part(
        count=len(t),
        first=values[0].copy(),  # a view would keep the block
        last=values[-1].copy(),
        sums=values.sum(axis=0),
        squares=np.einsum('ij,ij->j', values, values),
        low=values.min(axis=0),
        high=values.max(axis=0),
        peak=size[where, np.arange(size.shape[1])],
        at=t[where],
        path=np.abs(np.diff(values, axis=0)).sum(axis=0),
    )


def followed(a: Part, b: Part) -> Part:
    """Part of the samples of one and of those that come next."""
    return Part(
        count=a.count + b.count,
        first=a.first,
        last=b.last,
        sums=a.sums + b.sums,
        squares=a.squares + b.squares,
        low=np.minimum(a.low, b.low),
        high=np.maximum(a.high, b.high),
        peak=np.maximum(a.peak, b.peak),
        at=np.where(b.peak > a.peak, b.at, a.at),
        path=a.path + np.abs(b.first - a.last) + b.path,
    )


class Statistics:
    """Parts of a run between those times at which a question may begin or end.

    Parameters
    ----------
    times : s; a sample at one of them belongs to what is behind it

    """

    def __init__(self, times: Iterable[float]):
        self._windows = Windows(times)
        self._parts: dict[int, Part] = {}

    def add(self, t: np.ndarray, values: np.ndarray) -> None:
        """Add the next samples: times (n,) and signals (n, k)."""
        for i, inside in self._windows.split(t):
            part = part_of(t[inside], values[inside])
            self._parts[i] = followed(self._parts[i], part) if i in self._parts else part

    def between(self, first: float | None = None, last: float | None = None) -> Part | None:
        """Part from one of the times up to another, None: from or to the end; None: no sample."""
        parts = (self._parts.get(i) for i in self._windows.between(first, last))
        found = [part for part in parts if part is not None]
        return reduce(followed, found) if found else None
