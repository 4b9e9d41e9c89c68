"""Groups of a campaign's `vary`: how many combinations, and the values of each."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from auv_analysis.sweep import designs
from auv_analysis.sweep.distributions import make_distribution
from auv_analysis.sweep.values import Values, axis_values, take
from auv_dynamics.files import InputError


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

    def __init__(
        self, quantiles: Mapping[str, Callable[[np.ndarray], Values]], design: designs.Design
    ):
        self._quantiles, self._design, self.size = quantiles, design, design.size

    def at(self, positions: np.ndarray) -> dict[str, Values]:
        """See `Group`."""
        points = self._design.at(positions)
        return {path: q(points[:, i]) for i, (path, q) in enumerate(self._quantiles.items())}


def kind_of(spec: Mapping[str, Any]) -> str:
    """Kind of a checked entry of `vary`."""
    return next(key for key in ('grid', 'zip', *designs.KINDS) if key in spec)


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
        design = designs.make_design(kind, list(drawn), options, seed, number)
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
