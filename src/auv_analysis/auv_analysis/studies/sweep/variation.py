"""Variations of a campaign: grids, lists side by side, and designs of distributions.

The values of a rollout depend on the root seed and on its position alone, not on what was asked
for before: any part of a sweep is had at the same cost.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError, shorten

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
    # as scipy.stats has them, which takes longer to load than a small sweep to compute
    if mode is not None and not low <= mode <= high:
        raise ValueError(f'a mode from {low:g} to {high:g}', f'{mode:g}')
    if low == high:
        return _choice(np.array([low]))
    if name == 'loguniform':
        ends = np.log([low, high])
        return Distribution(
            lambda u: np.clip(np.exp(ends[0] + u * (ends[1] - ends[0])), low, high), bounded=True
        )
    c = None if mode is None else (mode - low) / (high - low)

    def quantile(u: np.ndarray) -> np.ndarray:
        if c is not None:
            u = np.where(u < c, np.sqrt(c * u), 1 - np.sqrt((1 - c) * (1 - u)))
        return u * (high - low) + low

    return Distribution(quantile, bounded=True)


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


SAMPLES = 0  # first of the two spawn keys of a group; a rollout's seed has one key
LEVELS = 4  # of the grid that Morris walks on
MOST_AT_ONCE = 10_000_000  # numbers of a design that is made as a whole: 80 MB

Seed = np.random.SeedSequence | int


class SamplingPlan(NamedTuple):
    """Points of the unit cube.

    Attributes
    ----------
    size : number of points
    at : positions (n,) below `size` -> points (n, k)

    """

    size: int
    at: Callable[[np.ndarray], np.ndarray]


def _in_runs(positions: np.ndarray, draw: Callable[[int, int], np.ndarray]) -> np.ndarray:
    """Points at any positions by a function that gives `count` points from `first` on."""
    wanted, where = np.unique(positions, return_inverse=True)
    breaks = np.flatnonzero(np.diff(wanted) != 1) + 1
    return np.concatenate([draw(int(run[0]), len(run)) for run in np.split(wanted, breaks)])[where]


def random(
    paths: Sequence[str], spec: dict[str, Any], seed: np.random.SeedSequence
) -> SamplingPlan:
    """Independent uniform numbers: counter-based, so that any row is had at the same cost."""
    key, width = seed.generate_state(2, np.uint64), len(paths)
    blocks = -(-width // 4)  # of four words, which one count of Philox gives

    def draw(first: int, count: int) -> np.ndarray:
        stream = np.random.Philox(key=key, counter=first * blocks)
        words = stream.random_raw(count * blocks * 4).reshape(count, -1)[:, :width]
        return ((words >> np.uint64(11)) + 0.5) * 2.0**-53

    return SamplingPlan(spec['count'], lambda positions: _in_runs(positions, draw))


def sobol(
    paths: Sequence[str], spec: dict[str, Any], seed: Seed, width: int | None = None
) -> SamplingPlan:
    """Scrambled Sobol' sequence; going forward costs least."""
    from scipy.stats import qmc

    width = width or len(paths)
    if width > qmc.Sobol.MAXDIM:
        raise ValueError(f'at most {qmc.Sobol.MAXDIM} coordinates', f'{width}')
    sequence = qmc.Sobol(width, rng=np.random.default_rng(seed))

    def draw(first: int, count: int) -> np.ndarray:
        if first < sequence.num_generated:
            sequence.reset()
        if first > sequence.num_generated:
            sequence.fast_forward(first - sequence.num_generated)
        if first == 0 and count > 1:  # what is not a power of two is warned of at the first draw
            return np.concatenate([sequence.random(1), sequence.random(count - 1)])
        return np.asarray(sequence.random(count))

    return SamplingPlan(spec['count'], lambda positions: _in_runs(positions, draw))


def saltelli(paths: Sequence[str], spec: dict[str, Any], seed: Seed) -> SamplingPlan:
    """Rows A, A with a column of B each, (B with a column of A each,) B: as SALib.sample.sobol."""
    k = len(paths)
    rows = (2 if spec.get('second_order') else 1) * k + 2
    base = sobol(paths, spec, seed, 2 * k)

    def at(positions: np.ndarray) -> np.ndarray:
        point, row = np.divmod(positions, rows)
        A, B = np.split(base.at(point), 2, axis=1)
        mixed = np.where((row <= k)[:, None], A, B)
        # the last row is B itself: no column is taken from A
        column = np.where(row == rows - 1, -1, np.where(row <= k, row - 1, row - k - 1))
        other = np.where((row <= k)[:, None], B, A)
        return np.where(np.arange(k) == column[:, None], other, mixed)

    return SamplingPlan(spec['count'] * rows, at)


def _at_once(size: int, width: int, make: Callable[[], np.ndarray]) -> SamplingPlan:
    """A design that is made as a whole."""
    if size * width > MOST_AT_ONCE:
        expected = f'at most {MOST_AT_ONCE // width} points of {width} values: made as a whole'
        raise ValueError(expected, f'{size}; random, sobol and saltelli have no such limit')
    points = make()
    return SamplingPlan(size, lambda positions: points[positions])


def _latin_hypercube(paths: list[str], spec: dict[str, Any], seed: Seed) -> SamplingPlan:
    from scipy.stats import qmc

    sampler = qmc.LatinHypercube(len(paths), rng=np.random.default_rng(seed))
    return _at_once(spec['count'], len(paths), lambda: sampler.random(spec['count']))


def morris(paths: Sequence[str], spec: dict[str, Any], seed: Seed) -> SamplingPlan:
    """Trajectories of Morris on a grid: k + 1 points, one coordinate changed at each step."""
    from SALib.sample import morris

    number = seed if isinstance(seed, int) else int(seed.generate_state(1)[0])
    levels = spec.get('levels', LEVELS)
    return _at_once(
        spec['count'] * (len(paths) + 1),
        len(paths),
        lambda: morris.sample(cube(paths), spec['count'], num_levels=levels, seed=number),
    )


def cube(names: Sequence[str]) -> dict[str, Any]:
    """The unit cube of some factors, as SALib takes it."""
    return {'num_vars': len(names), 'names': list(names), 'bounds': [[0.0, 1.0]] * len(names)}


DESIGNS: dict[str, Callable[[list[str], dict[str, Any], np.random.SeedSequence], SamplingPlan]] = {
    'random': random,
    'sobol': sobol,
    'saltelli': saltelli,
    'latin_hypercube': _latin_hypercube,
    'morris': morris,
}


class Group(NamedTuple):
    """What varies together.

    Attributes
    ----------
    size : number of combinations
    at : positions (n,) below `size` -> path -> n values
    plan : whose coordinates its distributions go along; None of listed values

    """

    size: int
    at: Callable[[np.ndarray], dict[str, Values]]
    plan: SamplingPlan | None = None


def _full_factorial(axes: dict[str, Values]) -> Group:
    """Every combination of listed values; the last path runs fastest."""

    def at(positions: np.ndarray) -> dict[str, Values]:
        found: dict[str, Values] = {}
        for path in reversed(axes):
            values = axes[path]
            found[path] = take(values, positions % len(values))
            positions = positions // len(values)
        return {path: found[path] for path in axes}

    return Group(int(np.prod([len(values) for values in axes.values()], dtype=object)), at)


def _zip(axes: dict[str, Values]) -> Group:
    """Listed values side by side, all of one length."""
    lengths = {path: len(values) for path, values in axes.items()}
    if len(set(lengths.values())) > 1:
        found = ', '.join(f'{length} of {path}' for path, length in lengths.items())
        raise ValueError('as many values of each path', found)
    size = next(iter(lengths.values()))
    return Group(size, lambda at: {path: take(values, at) for path, values in axes.items()})


def _drawn(distributions: dict[str, Distribution], plan: SamplingPlan) -> Group:
    """Distributions along the coordinates of a design of the unit cube."""

    def at(positions: np.ndarray) -> dict[str, Values]:
        points = plan.at(positions)
        columns = zip(distributions.items(), points.T, strict=True)
        return {path: one.quantile(column) for (path, one), column in columns}

    return Group(plan.size, at, plan)


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
            return _full_factorial(axes) if kind == 'grid' else _zip(axes)
        drawn = _each(spec[kind], make_distribution, place, file)
        if kind == 'morris':
            _check_bounded(drawn, place, file)
        options = {key: int(value) for key, value in spec.items() if key != kind}  # 4.0 is 4
        stream = np.random.SeedSequence(seed, spawn_key=(SAMPLES, number))
        return _drawn(drawn, DESIGNS[kind](list(drawn), options, stream))
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
