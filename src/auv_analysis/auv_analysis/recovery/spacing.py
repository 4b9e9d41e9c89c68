"""Gaps of a topic, by the spacing of its stamps."""

import heapq
from collections import Counter
from typing import Any

import numpy as np

from auv_dynamics.ros.interface import NANOSECONDS

MOST = 4096  # different intervals that are told apart
SHOWN = 10  # longest intervals whose place is remembered
WIDE = 1.5  # times the usual interval: from here on something is missing


class Spacing:
    """Intervals between the stamps of a topic, in the order of the bag.

    Attributes
    ----------
    first, last, earliest, latest : stamps in ns, in the order of the bag and by their size
    count : number of stamps
    intervals : ns -> how often
    longest : the longest of them, and where they begin, ns

    """

    def __init__(self) -> None:
        self.first: int | None = None
        self.last: int | None = None
        self.earliest: int | None = None
        self.latest: int | None = None
        self.count = 0
        self.intervals: Counter[int] = Counter()
        self.longest: list[tuple[int, int]] = []  # interval and where it begins, ns

    def add(self, stamps: np.ndarray) -> None:
        """Take the next stamps (n,), ns."""
        if not len(stamps):
            return
        if self.last is not None:
            stamps = np.insert(stamps, 0, self.last)
        else:
            self.first = int(stamps[0])
            self.count += 1
        self.count += len(stamps) - 1
        self._span(int(stamps.min()), int(stamps.max()))
        self.last = int(stamps[-1])
        apart = np.diff(stamps)
        values, counts = np.unique(apart, return_counts=True)
        for value, count in zip(values.tolist(), counts.tolist(), strict=True):
            self._note(value, count)
        for i in np.argsort(apart)[-SHOWN:].tolist():
            self._keep(int(apart[i]), int(stamps[i]))

    def join(self, other: 'Spacing') -> None:
        """Go on with what another file has of the topic."""
        if other.first is None or other.earliest is None or other.latest is None:
            return
        if self.last is not None:
            between = other.first - self.last
            self._note(between, 1)
            self._keep(between, self.last)
        else:
            self.first = other.first
        self.count += other.count
        self._span(other.earliest, other.latest)
        self.last = other.last
        for value, count in other.intervals.items():
            self._note(value, count)
        for interval, begin in other.longest:
            self._keep(interval, begin)

    def _span(self, earliest: int, latest: int) -> None:
        self.earliest = earliest if self.earliest is None else min(self.earliest, earliest)
        self.latest = latest if self.latest is None else max(self.latest, latest)

    def _note(self, interval: int, count: int) -> None:
        if len(self.intervals) < MOST or interval in self.intervals:
            self.intervals[interval] += count

    def _keep(self, interval: int, begin: int) -> None:
        heapq.heappush(self.longest, (interval, begin))
        if len(self.longest) > SHOWN:
            heapq.heappop(self.longest)

    def gaps(self) -> dict[str, Any]:
        """Number of gaps, of messages missing in them, and the longest ones in s, in order."""
        usual = self._usual()
        wide = {value: n for value, n in self.intervals.items() if usual and value > WIDE * usual}
        shown = sorted(
            (begin, interval)
            for interval, begin in self.longest
            if usual and interval > WIDE * usual
        )
        return {
            'gaps': sum(wide.values()),
            'missing': sum((round(value / usual) - 1) * n for value, n in wide.items()),
            'longest': [
                [begin / NANOSECONDS, (begin + interval) / NANOSECONDS] for begin, interval in shown
            ],
        }

    def _usual(self) -> int:
        """The median interval, ns; 0 where there is none."""
        rising = sorted((value, n) for value, n in self.intervals.items() if value > 0)
        half, seen = sum(n for _, n in rising) / 2, 0
        for value, n in rising:
            seen += n
            if seen >= half:
                return value
        return 0
