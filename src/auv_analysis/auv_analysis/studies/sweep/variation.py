"""What a campaign varies: grids, lists side by side, and designs of distributions.

The values of a rollout depend on the root seed and on its position alone, not on what was asked
for before: any part of a sweep is had at the same cost.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from auv_analysis.studies.distributions import Values, axis_values, make_distribution, take
from auv_dynamics.files.errors import InputError

SAMPLES = 0  # first of the two spawn keys of a group; a rollout's seed has one key
LEVELS = 4  # of the grid that Morris walks on
MOST_AT_ONCE = 10_000_000  # numbers of a design that is made as a whole: 80 MB

Seed = np.random.SeedSequence | int


class Design(Protocol):
    """Points of the unit cube."""

    size: int  # number of points

    def at(self, positions: np.ndarray) -> np.ndarray:
        """Points (n, k) at positions (n,) below `size`."""


def make_design(kind: str, paths: list[str], spec: dict[str, Any], seed: int, group: int) -> Design:
    """Design of a checked group of a campaign.

    Parameters
    ----------
    kind : a key of DESIGNS
    paths : names of the k coordinates
    spec : the group's `count` and what else its kind takes
    seed, group : root seed of the campaign and the group's number

    Raises
    ------
    ValueError : (expected, found)

    """
    return DESIGNS[kind](paths, spec, np.random.SeedSequence(seed, spawn_key=(SAMPLES, group)))


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
        self, paths: Sequence[str], spec: dict[str, Any], seed: Seed, width: int | None = None
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

    def __init__(self, paths: Sequence[str], spec: dict[str, Any], seed: Seed):
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


def _latin_hypercube(paths: list[str], spec: dict[str, Any], seed: Seed) -> Design:
    from scipy.stats import qmc

    sampler = qmc.LatinHypercube(len(paths), rng=np.random.default_rng(seed))
    return AtOnce(spec['count'], len(paths), lambda: sampler.random(spec['count']))


def morris(paths: Sequence[str], spec: dict[str, Any], seed: Seed) -> Design:
    """Trajectories of Morris on a grid: k + 1 points, one coordinate changed at each step."""
    from SALib.sample import morris

    number = seed if isinstance(seed, int) else int(seed.generate_state(1)[0])
    levels = spec.get('levels', LEVELS)
    return AtOnce(
        spec['count'] * (len(paths) + 1),
        len(paths),
        lambda: morris.sample(cube(paths), spec['count'], num_levels=levels, seed=number),
    )


def cube(names: Sequence[str]) -> dict[str, Any]:
    """The unit cube of some factors, as SALib takes it."""
    return {'num_vars': len(names), 'names': list(names), 'bounds': [[0.0, 1.0]] * len(names)}


DESIGNS: dict[str, Callable[[list[str], dict[str, Any], np.random.SeedSequence], Design]] = {
    'random': Random,
    'sobol': Sobol,
    'saltelli': Saltelli,
    'latin_hypercube': _latin_hypercube,
    'morris': morris,
}


class Group(Protocol):
    """What varies together."""

    size: int  # number of combinations

    def at(self, positions: np.ndarray) -> dict[str, Values]:
        """Path -> n values at positions (n,) below `size`."""


class Grid:
    """Every combination of listed values; the last path runs fastest."""

    def __init__(self, axes: dict[str, Values]):
        self._axes = axes
        self.size = int(np.prod([len(values) for values in axes.values()], dtype=object))

    def at(self, positions: np.ndarray) -> dict[str, Values]:
        """See `Group`."""
        found: dict[str, Values] = {}
        for path in reversed(self._axes):
            values = self._axes[path]
            found[path] = take(values, positions % len(values))
            positions = positions // len(values)
        return {path: found[path] for path in self._axes}


class Zip:
    """Listed values side by side, all of one length."""

    def __init__(self, axes: Mapping[str, Values]):
        lengths = {path: len(values) for path, values in axes.items()}
        if len(set(lengths.values())) > 1:
            found = ', '.join(f'{length} of {path}' for path, length in lengths.items())
            raise ValueError('as many values of each path', found)
        self._axes, self.size = axes, next(iter(lengths.values()))

    def at(self, positions: np.ndarray) -> dict[str, Values]:
        """See `Group`."""
        return {path: take(values, positions) for path, values in self._axes.items()}


class Drawn:
    """Distributions along the coordinates of a design of the unit cube."""

    def __init__(self, quantiles: Mapping[str, Callable[[np.ndarray], Values]], design: Design):
        self._quantiles, self._design, self.size = quantiles, design, design.size

    def at(self, positions: np.ndarray) -> dict[str, Values]:
        """See `Group`."""
        points = self._design.at(positions)
        return {path: q(points[:, i]) for i, (path, q) in enumerate(self._quantiles.items())}


def kind_of(spec: Mapping[str, Any]) -> str:
    """Kind of a checked entry of `vary`."""
    return next(key for key in ('grid', 'zip', *DESIGNS) if key in spec)


def make_group(spec: Mapping[str, Any], seed: int, number: int, file: object) -> Group:
    """Group of a checked entry of `vary`.

    Parameters
    ----------
    spec : one kind with its paths, and what that kind takes
    seed, number : root seed of the campaign, and which entry this is
    file : named in errors

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    kind = kind_of(spec)
    place = f'vary[{number}].{kind}'
    try:
        if kind in ('grid', 'zip'):
            axes = _each(spec[kind], axis_values, place, file)
            return Grid(axes) if kind == 'grid' else Zip(axes)
        drawn = _each(spec[kind], make_distribution, place, file)
        if kind == 'morris':
            _check_bounded(drawn, place, file)
        options = {key: int(value) for key, value in spec.items() if key != kind}  # 4.0 is 4
        design = make_design(kind, list(drawn), options, seed, number)
        return Drawn({path: entry.quantile for path, entry in drawn.items()}, design)
    except InputError:
        raise
    except ValueError as error:
        raise _refusal(error, file, place) from None


def _each(
    specs: Mapping[str, Any], make: Callable[[Any], Any], place: str, file: object
) -> dict[str, Any]:
    made = {}
    for path, spec in specs.items():
        try:
            made[path] = make(spec)
        except ValueError as error:
            raise _refusal(error, file, f'{place}.{path}') from None
    return made


def _check_bounded(drawn: Mapping[str, Any], place: str, file: object) -> None:
    for path, distribution in drawn.items():
        if not distribution.bounded:
            expected = 'from and to: the design takes the smallest and the largest value'
            raise InputError(file, f'{place}.{path}', expected, 'a distribution without ends')


def _refusal(error: ValueError, file: object, place: str) -> Exception:
    """One line for a user; an error that is none of ours stays what it is."""
    return InputError(file, place, *error.args) if len(error.args) == 2 else error
