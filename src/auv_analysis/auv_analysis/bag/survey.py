"""What a first reading of a bag remembers: everything while it is short, else its stamps."""

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from auv_analysis.bag.contents import Series
from auv_analysis.bag.held import SETPOINTS, held_parts
from auv_analysis.bag.messages import Batch
from auv_analysis.bag.steps import complete_blocks
from auv_analysis.runs.run import BLOCK
from auv_dynamics.ros import interface


class Survey:
    """Stamps of all topics; those that are equally spaced cost nothing to keep.

    Parameters
    ----------
    whole : messages of a topic up to which the values are kept as well

    Attributes
    ----------
    kept : topic -> its batches; None as soon as one has more messages
    counts, last : topic -> number of messages, last stamp in ns
    rising : whether no stamp of a topic is before the one that came before it

    """

    def __init__(self, whole: int):
        self._whole = whole
        self._stamps: list[tuple[str, range | np.ndarray]] = []
        self.kept: dict[str, list[Series]] | None = {}
        self.counts: dict[str, int] = {}
        self.last: dict[str, int] = {}
        self.rising = True

    def add(self, batch: Batch) -> None:
        """Note the next messages of a topic."""
        topic, stamps, rows = batch
        apart = np.diff(stamps)
        first, last = int(stamps[0]), int(stamps[-1])
        self.rising &= first >= self.last.get(topic, first) and bool(np.all(apart >= 0))
        self.counts[topic] = self.counts.get(topic, 0) + len(stamps)
        self.last[topic] = last
        even = len(stamps) > 1 and apart[0] > 0 and bool(np.all(apart == apart[0]))
        self._stamps.append((topic, range(first, last + 1, int(apart[0])) if even else stamps))
        if self.counts[topic] > self._whole:
            self.kept = None
        elif self.kept is not None:
            self.kept.setdefault(topic, []).append((stamps, rows))

    def ends(self, topics: Mapping[str, str], *, held: bool) -> dict[str, int]:
        """Role -> stamp of its last message; of set-points that are held, the odometry's."""
        sources = {
            role: topics[interface.ODOM] if held and role in SETPOINTS else topic
            for role, topic in topics.items()
        }
        return {role: self.last[topic] for role, topic in sources.items()}

    def steps(self, topics: Mapping[str, str], *, held: bool) -> tuple[int, int, int, float]:
        """Number of complete steps, first and last stamp in ns, median time between them in ns.

        Parameters
        ----------
        topics : role -> topic
        held : set-points are held to the odometry

        """
        number, first, last = 0, 0, 0
        intervals: Counter[int] = Counter()
        parts, ends = self._series(topics), self.ends(topics, held=held)
        for ns, _ in complete_blocks(held_parts(parts) if held else parts, ends, BLOCK):
            if number:
                intervals[int(ns[0]) - last] += 1
            else:
                first = int(ns[0])
            apart, times = np.unique(np.diff(ns), return_counts=True)
            intervals.update(dict(zip(apart.tolist(), times.tolist(), strict=True)))
            number, last = number + len(ns), int(ns[-1])
        return number, first, last, _median(intervals)

    def _series(self, topics: Mapping[str, str]) -> Iterator[tuple[str, Series]]:
        roles = {topic: role for role, topic in topics.items()}
        for topic, stamps in self._stamps:
            ns = np.array(stamps, np.int64)
            yield roles.get(topic, ''), (ns, np.zeros((len(ns), 0)))


def _median(counts: Mapping[int, int]) -> float:
    """Median of numbers that are counted; NaN of none."""
    values = np.array(sorted(counts), float)
    below = np.cumsum([counts[int(value)] for value in values])
    if not len(values):
        return float('nan')
    middle = (below[-1] - 1) // 2, below[-1] // 2
    return float(np.mean([values[np.searchsorted(below, i, 'right')] for i in middle]))
