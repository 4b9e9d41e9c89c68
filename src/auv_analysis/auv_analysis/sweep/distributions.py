"""Distributions by their quantile functions: numbers in (0, 1) in, values out."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.sweep.values import Values, of_one_kind, take

SMALLEST = 2.0**-54  # of a number in (0, 1), so that no quantile is infinite
LARGEST = 1 - 2.0**-53


class Distribution(NamedTuple):
    """A distribution.

    Attributes
    ----------
    quantile : (n,) in [0, 1] -> n values
    bounded : whether it has a smallest and a largest value

    """

    quantile: Callable[[np.ndarray], Values]
    bounded: bool


def make_distribution(spec: Mapping[str, Mapping[str, Any]]) -> Distribution:
    """Distribution of a checked entry: one name, and what that one takes.

    Raises
    ------
    ValueError : (expected, found)

    """
    ((name, values),) = spec.items()
    return KINDS[name](values)


def _interval(spec: Mapping[str, Any]) -> tuple[float, float]:
    low, high = float(spec['from']), float(spec['to'])
    if low > high:
        raise ValueError(f'a number from {low:g} up in to', f'{high:g}')
    return low, high


def _uniform(spec: Mapping[str, Any]) -> Distribution:
    low, high = _interval(spec)
    return Distribution(lambda u: low + (high - low) * u, bounded=True)


def _loguniform(spec: Mapping[str, Any]) -> Distribution:
    low, high = _interval(spec)
    return Distribution(lambda u: low * (high / low) ** u, bounded=True)


def _normal(spec: Mapping[str, Any]) -> Distribution:
    mean, std = float(spec['mean']), float(spec['std'])
    low, high = ((spec[key] - mean) / std if key in spec else None for key in ('from', 'to'))
    return _cut(low, high, lambda z: mean + std * z)


def _lognormal(spec: Mapping[str, Any]) -> Distribution:
    median, sigma = float(spec['median']), float(spec['sigma'])
    low, high = (
        float(np.log(spec[key] / median)) / sigma if key in spec else None for key in ('from', 'to')
    )
    return _cut(low, high, lambda z: median * np.exp(sigma * z))


def _cut(
    low: float | None, high: float | None, value: Callable[[np.ndarray], np.ndarray]
) -> Distribution:
    """Increasing function of a standard normal variable between two ends, None: without end."""
    from scipy.special import ndtr, ndtri

    a, b = -np.inf if low is None else low, np.inf if high is None else high
    mirrored = a > 0  # the upper tail loses its digits near 1, the lower one keeps them
    first, last = (ndtr(-b), ndtr(-a)) if mirrored else (ndtr(a), ndtr(b))
    if not last > first:
        expected = 'from and to with some probability between them'
        raise ValueError(expected, f'{a:.4g} to {b:.4g} standard deviations')

    def quantile(u: np.ndarray) -> np.ndarray:
        u = np.clip(u, SMALLEST, LARGEST)
        if mirrored:
            z = -ndtri(first + (1 - u) * (last - first))
        else:
            z = ndtri(first + u * (last - first))
        return value(np.clip(z, a, b))

    return Distribution(quantile, bounded=low is not None and high is not None)


def _triangular(spec: Mapping[str, Any]) -> Distribution:
    low, high = _interval(spec)
    mode = float(spec['mode'])
    if not low <= mode <= high:
        raise ValueError(f'a mode from {low:g} to {high:g}', f'{mode:g}')

    def quantile(u: np.ndarray) -> np.ndarray:
        rising = low + np.sqrt(u * (high - low) * (mode - low))
        falling = high - np.sqrt((1 - u) * (high - low) * (high - mode))
        return np.where(u * (high - low) < mode - low, rising, falling)

    return Distribution(quantile, bounded=True)


def _integers(spec: Mapping[str, Any]) -> Distribution:
    low, high = (int(x) for x in _interval(spec))

    def quantile(u: np.ndarray) -> np.ndarray:
        return np.minimum(low + np.floor(u * (high - low + 1)).astype(np.int64), high)

    return Distribution(quantile, bounded=True)


def _choice(spec: Any) -> Distribution:
    values = of_one_kind(spec)
    last = len(values) - 1

    def quantile(u: np.ndarray) -> Values:
        return take(values, np.minimum((u * len(values)).astype(np.int64), last))

    return Distribution(quantile, bounded=True)


KINDS: dict[str, Callable[[Any], Distribution]] = {
    'uniform': _uniform,
    'loguniform': _loguniform,
    'normal': _normal,
    'lognormal': _lognormal,
    'triangular': _triangular,
    'integers': _integers,
    'choice': _choice,
}
