"""Points of the unit cube by their position: random, low-discrepancy or designed.

A point depends on the root seed and on its position alone, not on what was asked for before.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

SAMPLES = 0  # first of the two spawn keys of a group; a rollout's seed has one key
MOST_AT_ONCE = 10_000_000  # numbers of a design that is made as a whole: 80 MB


class Design(Protocol):
    """Points of the unit cube."""

    size: int  # number of points

    def at(self, positions: np.ndarray) -> np.ndarray:
        """Points (n, k) at positions (n,) below `size`."""


def make_design(kind: str, paths: list[str], spec: dict[str, Any], seed: int, group: int) -> Design:
    """Design of a checked group of a campaign.

    Parameters
    ----------
    kind : a key of KINDS
    paths : names of the k coordinates
    spec : the group's `count` and what else its kind takes
    seed, group : root seed of the campaign and the group's number

    Raises
    ------
    ValueError : (expected, found)

    """
    return KINDS[kind](paths, spec, np.random.SeedSequence(seed, spawn_key=(SAMPLES, group)))


def _in_runs(positions: np.ndarray, draw: Callable[[int, int], np.ndarray]) -> np.ndarray:
    """Points at any positions by a function that gives `count` points from `first` on."""
    wanted, where = np.unique(positions, return_inverse=True)
    breaks = np.flatnonzero(np.diff(wanted) != 1) + 1
    return np.concatenate([draw(int(run[0]), len(run)) for run in np.split(wanted, breaks)])[where]


class Random:
    """Independent uniform numbers: counter-based, so that any row is had at the same cost."""

    def __init__(self, paths: list[str], spec: dict[str, Any], seed: np.random.SeedSequence):
        self.size, self._width = spec['count'], len(paths)
        self._key = seed.generate_state(2, np.uint64)

    def at(self, positions: np.ndarray) -> np.ndarray:
        """See `Design`."""
        return _in_runs(positions, self._draw)

    def _draw(self, first: int, count: int) -> np.ndarray:
        blocks = -(-self._width // 4)  # of four words, which one count of Philox gives
        stream = np.random.Philox(key=self._key, counter=first * blocks)
        words = stream.random_raw(count * blocks * 4).reshape(count, -1)[:, : self._width]
        return ((words >> np.uint64(11)) + 0.5) * 2.0**-53


class Sobol:
    """Scrambled Sobol' sequence."""

    def __init__(
        self,
        paths: list[str],
        spec: dict[str, Any],
        seed: np.random.SeedSequence,
        width: int | None = None,
    ):
        from scipy.stats import qmc

        self.size, self._next = spec['count'], 0
        width = width or len(paths)
        if width > qmc.Sobol.MAXDIM:
            raise ValueError(f'at most {qmc.Sobol.MAXDIM} coordinates', f'{width}')
        self._sequence = qmc.Sobol(width, rng=np.random.default_rng(seed))

    def at(self, positions: np.ndarray) -> np.ndarray:
        """See `Design`; going forward costs least."""
        return _in_runs(positions, self._draw)

    def _draw(self, first: int, count: int) -> np.ndarray:
        if first < self._next:
            self._sequence.reset()
            self._next = 0
        if first > self._next:
            self._sequence.fast_forward(first - self._next)
        self._next = first + count
        if first == 0 and count > 1:  # what is not a power of two is warned of at the first draw
            return np.concatenate([self._sequence.random(1), self._sequence.random(count - 1)])
        return self._sequence.random(count)


class Saltelli:
    """Rows A, A with a column of B each, (B with a column of A each,) B: as SALib.sample.sobol."""

    def __init__(self, paths: list[str], spec: dict[str, Any], seed: np.random.SeedSequence):
        self._width = len(paths)
        self._rows = (2 if spec.get('second_order') else 1) * self._width + 2
        self._base = Sobol(paths, spec, seed, 2 * self._width)
        self.size = spec['count'] * self._rows

    def at(self, positions: np.ndarray) -> np.ndarray:
        """See `Design`."""
        k = self._width
        point, row = np.divmod(positions, self._rows)
        A, B = np.split(self._base.at(point), 2, axis=1)
        mixed = np.where((row <= k)[:, None], A, B)
        # the last row is B itself: no column is taken from A
        column = np.where(row == self._rows - 1, -1, np.where(row <= k, row - 1, row - k - 1))
        other = np.where((row <= k)[:, None], B, A)
        return np.where(np.arange(k) == column[:, None], other, mixed)


class AtOnce:
    """A design that is made as a whole."""

    def __init__(self, size: int, width: int, make: Callable[[], np.ndarray]):
        if size * width > MOST_AT_ONCE:
            expected = f'at most {MOST_AT_ONCE // width} points of {width} values: made as a whole'
            raise ValueError(expected, f'{size}; random, sobol and saltelli have no such limit')
        self.size, self._points = size, make()

    def at(self, positions: np.ndarray) -> np.ndarray:
        """See `Design`."""
        return self._points[positions]


def _latin_hypercube(
    paths: list[str], spec: dict[str, Any], seed: np.random.SeedSequence
) -> Design:
    from scipy.stats import qmc

    sampler = qmc.LatinHypercube(len(paths), rng=np.random.default_rng(seed))
    return AtOnce(spec['count'], len(paths), lambda: sampler.random(spec['count']))


def _morris(paths: list[str], spec: dict[str, Any], seed: np.random.SeedSequence) -> Design:
    from SALib.sample import morris

    width = len(paths)
    problem = {'num_vars': width, 'names': paths, 'bounds': [[0.0, 1.0]] * width}
    number, levels = int(seed.generate_state(1)[0]), spec.get('levels', 4)
    return AtOnce(
        spec['count'] * (width + 1),
        width,
        lambda: morris.sample(problem, spec['count'], num_levels=levels, seed=number),
    )


KINDS: dict[str, Callable[[list[str], dict[str, Any], np.random.SeedSequence], Design]] = {
    'random': Random,
    'sobol': Sobol,
    'saltelli': Saltelli,
    'latin_hypercube': _latin_hypercube,
    'morris': _morris,
}
