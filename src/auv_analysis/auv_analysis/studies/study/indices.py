"""Designs of factors after Sobol' and Morris, and the spread of answers at their points."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from auv_analysis.studies.sweep.indices import morris_indices, sobol_indices
from auv_analysis.studies.sweep.variation import LEVELS, Saltelli, morris

Method = Literal['sobol', 'morris']
METHODS: tuple[str, ...] = get_args(Method)
BOOTSTRAPS = 1000  # of the confidence of a spread
CONFIDENCE = 0.95
NAMES = {
    'sobol': ('S1', 'S1_conf', 'ST', 'ST_conf'),
    'morris': ('mu_star', 'mu_star_conf', 'sigma'),
}


@dataclass(frozen=True)
class Design:
    """Points at which k factors are tried.

    Attributes
    ----------
    method : 'sobol': rows A, A with a column of B each, B; 'morris': trajectories
    names : of the k factors
    count : base points of Sobol', a power of two; trajectories of Morris
    seed : of the points and of every resampling

    """

    method: Method
    names: tuple[str, ...]
    count: int
    seed: int

    def __post_init__(self) -> None:
        """Refuse what SALib would take and answer badly."""
        if self.method not in METHODS:
            raise ValueError(f'method: expected {" or ".join(METHODS)}, found {self.method!r}')
        if not self.names:
            raise ValueError('names: expected at least one factor, found none')
        power = self.count >= 2 and self.count & (self.count - 1) == 0
        if self.method == 'sobol' and not power:
            raise ValueError(f'count: expected a power of two from 2 on, found {self.count}')
        if self.count < 2:
            raise ValueError(f'count: expected at least 2, found {self.count}')

    @property
    def width(self) -> int:
        """Rows that belong together: k + 2 of a base point, k + 1 of a trajectory."""
        return len(self.names) + (2 if self.method == 'sobol' else 1)

    @cached_property
    def points(self) -> np.ndarray:
        """(n, k) points within -1 and 1."""
        return 2.0 * self._unit - 1.0

    @cached_property
    def _unit(self) -> np.ndarray:
        make = Saltelli if self.method == 'sobol' else morris
        design = make(self.names, {'count': self.count}, self.seed + 1)
        return design.at(np.arange(design.size))

    def indices(self, y: np.ndarray) -> dict[str, np.ndarray]:
        """Indices of the factors for answers that are not all the same.

        Parameters
        ----------
        y : (n,) finite answer at each point

        Returns
        -------
        indices : name -> (k,): of 'sobol' S1 and ST, the shares of the variance that a factor has
            alone and with all others; of 'morris' mu_star, the mean size of the change of y from
            one end of a factor to the other, and sigma, its standard deviation; '_conf' is half of
            the 95 % interval. `slope` of both is the change of y over half of a factor's range,
            by least squares.

        """
        if self.method == 'sobol':
            found = sobol_indices(self.names, y, self.seed + 1)
        else:
            found = morris_indices(self.names, self._unit, y, self.seed + 1, LEVELS)
        known = {name: np.asarray(found[name], float) for name in NAMES[self.method]}
        return known | {'slope': self._slope(y)}

    def _slope(self, y: np.ndarray) -> np.ndarray:
        free = self.points[self.independent.ravel()]
        terms = np.column_stack([free, np.ones(len(free))])
        solution, *_ = np.linalg.lstsq(terms, y[self.independent.ravel()], rcond=None)
        return solution[:-1]

    @property
    def independent(self) -> np.ndarray:
        """(count, m) rows that are drawn over the whole box, in the groups that are resampled."""
        first = np.arange(self.count)[:, None] * self.width
        inside = [0, self.width - 1] if self.method == 'sobol' else range(self.width)
        return first + np.array(inside)


def spreads(design: Design, answers: np.ndarray) -> dict[str, np.ndarray]:
    """Standard deviations of several answers, their intervals by a bootstrap that pairs answers.

    Parameters
    ----------
    design : whose points were tried
    answers : (n, F) finite

    Returns
    -------
    spreads : name -> (F,): spread, spread_low, spread_high and spread_conf, with the 95 % interval
        and half of it; rank, rank_low, rank_high, place among the F answers, 1 the largest

    """
    groups = answers[design.independent]  # (count, m, F)
    centred = groups - groups.mean(axis=(0, 1))
    size, rng = groups.shape[1], np.random.default_rng(design.seed)
    counts = rng.multinomial(design.count, np.full(design.count, 1 / design.count), BOOTSTRAPS)
    value, again = (
        _deviation(weights, centred, size) for weights in (np.ones((1, design.count)), counts)
    )
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(again, [tail, 100.0 - tail], axis=0)
    places = _ranks(again)
    ends = np.percentile(places, [tail, 100.0 - tail], axis=0, method='nearest')
    found = {'spread': value[0], 'spread_low': low, 'spread_high': high}
    found |= {'spread_conf': 0.5 * (high - low), 'rank': _ranks(value)[0]}
    return found | dict(zip(('rank_low', 'rank_high'), ends.astype(int), strict=True))


def _deviation(weights: np.ndarray, centred: np.ndarray, size: int) -> np.ndarray:
    """(R, F) standard deviations of R samples with these (R, count) counts of each group."""
    total = weights.sum(axis=1, keepdims=True) * size
    mean = weights @ centred.sum(axis=1) / total
    return np.sqrt(np.maximum(weights @ (centred**2).sum(axis=1) / total - mean**2, 0.0))


def _ranks(values: np.ndarray) -> np.ndarray:
    """Places (R, F) by falling value, from 1 on."""
    return np.argsort(np.argsort(-values, axis=1, kind='stable'), axis=1, kind='stable') + 1
