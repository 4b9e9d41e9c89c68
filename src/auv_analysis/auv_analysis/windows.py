"""A run cut where questions about it may begin or end, so that answers come from a few parts."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np


class Windows:
    """Cuts in time.

    Parameters
    ----------
    times : s; a sample at one of them belongs to the part behind it

    Attributes
    ----------
    parts : number of parts, one more than there are cuts

    """

    def __init__(self, times: Iterable[float]):
        self._times = sorted(set(times))
        self.parts = len(self._times) + 1

    def split(self, t: np.ndarray) -> Iterator[tuple[int, slice]]:
        """Number of each part that some samples at rising times (n,) lie in, and which do."""
        edges = [0, *np.searchsorted(t, self._times).tolist(), len(t)]
        for i, (first, last) in enumerate(pairwise(edges)):
            if last > first:
                yield i, slice(first, last)

    def between(self, first: float | None = None, last: float | None = None) -> range:
        """Numbers of the parts from one cut up to another; None: from or to the end."""
        begin = 0 if first is None else self._times.index(first) + 1
        end = self.parts if last is None else self._times.index(last) + 1
        return range(begin, end)
