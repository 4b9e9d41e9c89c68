"""Lines with few points that look the same: the extremes of every column of pixels."""

from collections.abc import Sequence

import numpy as np

COLUMNS = 2000  # finer than the pixels of a panel; a line has at most two points in each
FEW = 2 * (COLUMNS - 1)  # samples that are all drawn
Line = tuple[np.ndarray, np.ndarray]  # t and y, (m,) each


class Trace:
    """A line that is thinned while its samples come in, see `thinned`.

    Parameters
    ----------
    first, last : times between which the columns lie, s
    logarithmic : columns of equal width on a logarithmic time axis; first > 0 then

    """

    def __init__(self, first: float, last: float, *, logarithmic: bool = False):
        self._ends, self._logarithmic = (first, last), logarithmic
        self._parts: list[Line] = []
        self._seen = self._held = 0

    def add(self, t: np.ndarray, y: np.ndarray) -> None:
        """Add the next samples, (n,) each, n may be 0."""
        self._parts.append((np.array(t), np.array(y)))  # not views: those would keep the block
        self._seen += len(t)
        self._held += len(t)
        if self._held > 2 * FEW:
            self._parts = [self.line()]
            self._held = len(self._parts[0][0])

    def line(self) -> Line:
        """Times and values to be drawn."""
        t, y = (np.concatenate(values) for values in zip(*self._parts, strict=True))
        if self._seen <= FEW:
            return t, y
        return thinned(t, y, self._ends, logarithmic=self._logarithmic)


def thinned(
    t: np.ndarray,
    y: np.ndarray,
    ends: tuple[float, float] | None = None,
    *,
    logarithmic: bool = False,
    columns: int = COLUMNS,
) -> Line:
    """The first and the last sample, and every column's smallest and largest.

    Parameters
    ----------
    t, y : (n,) samples, t rising
    ends : times between which the columns lie; none: the first and the last
    logarithmic : columns of equal width on a logarithmic time axis; t > 0 then
    columns : how many

    Returns
    -------
    t, y : (m,) some of the samples in their order; thinning them again changes nothing

    """
    place, (left, right) = t, ends or (t[0], t[-1])
    if logarithmic:
        place, left, right = np.log(t), np.log(left), np.log(right)
    column = np.floor((place - left) / (right - left) * (columns - 1)).clip(0, columns - 2)
    starts = np.flatnonzero(np.diff(column, prepend=-1.0))
    owner = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(t)))
    low = np.flatnonzero(y == np.minimum.reduceat(y, starts)[owner])
    high = np.flatnonzero(y == np.maximum.reduceat(y, starts)[owner])
    low = low[np.diff(owner[low], prepend=-1) > 0]  # where several are smallest, the first
    high = high[np.diff(owner[high], append=len(starts)) > 0]  # and the last that is largest
    keep = np.zeros(len(t), bool)
    keep[low] = keep[high] = keep[[0, -1]] = True
    return t[keep], y[keep]


def broken(line: Line, breaks: Sequence[float]) -> Line:
    """The same line with a NaN at each of some times that it crosses."""
    t, y = line
    places = np.asarray(breaks)
    at = np.searchsorted(t, places)
    inside = (at > 0) & (at < len(t))
    return np.insert(t, at[inside], places[inside]), np.insert(y, at[inside], np.nan)
