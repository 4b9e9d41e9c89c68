"""A signal of the last seconds in a few buckets: its largest values, rms, and a history."""

from collections import deque

import numpy as np

BUCKET = 0.5  # s
BUCKETS = 20


class _Bucket:
    """Figures of the samples of half a second."""

    def __init__(self, begin: float):
        self.begin = begin
        self.largest = np.zeros(6)
        self.squares = np.zeros(6)
        self.count = 0


class Trend:
    """The last ten seconds of six numbers that come in at steady times."""

    def __init__(self) -> None:
        self._buckets: deque[_Bucket] = deque(maxlen=BUCKETS)

    def add(self, now: float, values: np.ndarray) -> None:
        """Take a sample (6,) at a steady time in s."""
        if not self._buckets or now - self._buckets[-1].begin >= BUCKET:
            self._buckets.append(_Bucket(now))
        bucket = self._buckets[-1]
        size = np.abs(values)
        np.maximum(bucket.largest, size, out=bucket.largest)
        bucket.squares += size * size
        bucket.count += 1

    def forget(self) -> None:
        """Begin anew."""
        self._buckets.clear()

    @property
    def largest(self) -> tuple[float, ...] | None:
        """Largest absolute values (6,), or None without a sample."""
        if not self._buckets:
            return None
        return tuple(np.max([bucket.largest for bucket in self._buckets], axis=0).tolist())

    @property
    def rms(self) -> tuple[float, ...] | None:
        """Root mean squares (6,) of the samples, or None without one."""
        count = sum(bucket.count for bucket in self._buckets)
        if not count:
            return None
        squares = np.sum([bucket.squares for bucket in self._buckets], axis=0)
        return tuple(np.sqrt(squares / count).tolist())

    @property
    def history(self) -> tuple[tuple[float, ...], ...]:
        """Largest absolute values (6,) of each half second, the oldest first."""
        return tuple(tuple(bucket.largest.tolist()) for bucket in self._buckets)
