"""Sensitivity indices after Sobol' and Morris: of a campaign, and of a design of one's own."""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from auv_analysis.metrics.measures import Measure
from auv_analysis.output.new_files import known
from auv_analysis.studies.sweep.dataset import Sweep
from auv_analysis.studies.sweep.variation import (
    LEVELS,
    Group,
    cube,
    kind_of,
    make_group,
    morris,
    saltelli,
)

Row = dict[str, Any]
METHODS = ('saltelli', 'morris')
FIRST_AND_TOTAL, SECOND = ('S1', 'S1_conf', 'ST', 'ST_conf'), ('S2', 'S2_conf')
EFFECTS = ('mu', 'mu_star', 'mu_star_conf', 'sigma')
MOST_OTHERS = 8  # combinations of the other groups of which each has indices of its own
FEWEST = 8  # base points or trajectories
SEED = 1  # of the bootstrap of the confidence intervals; SALib takes 0 for none


class Designed(NamedTuple):
    """A group of a campaign whose design allows indices.

    Attributes
    ----------
    kind : 'saltelli' or 'morris'
    paths : names of its coordinates
    spec : the group in the campaign file
    step : rows of one base point or trajectory
    positions : (n,) place of each row of the sweep in the design
    others : (n,) which combination of the other groups it has
    cases : what each of these is, '' where it is the only one
    points : (size, k) of the unit cube; None of saltelli, which needs none

    """

    kind: str
    paths: list[str]
    spec: dict[str, Any]
    step: int
    positions: np.ndarray
    others: np.ndarray
    cases: list[str]
    points: np.ndarray | None


def designed(sweep: Sweep) -> tuple[list[Designed], list[str]]:
    """Groups of a sweep that allow indices, and what has to be said of those that do not."""
    specs, seed = sweep.campaign['vary'], sweep.campaign['seed']
    if not any(kind_of(spec) in METHODS for spec in specs):
        return [], []
    groups = [make_group(spec, seed, i, sweep.folder) for i, spec in enumerate(specs)]
    found, notes = [], []
    for i, spec in enumerate(specs):
        if kind_of(spec) not in METHODS:
            continue
        entry = _designed(sweep, groups, i, spec)
        if len(entry.cases) > MOST_OTHERS:
            notes.append(
                f'no indices of {", ".join(entry.paths)}: {len(entry.cases)} combinations of '
                f'the other groups, of at most {MOST_OTHERS}'
            )
        elif not _is_the_same(sweep, groups[i], entry):
            notes.append(f'no indices of {", ".join(entry.paths)}: the design drawn now is another')
        else:
            found.append(entry)
    return found, notes


def _designed(sweep: Sweep, groups: list[Group], number: int, spec: dict[str, Any]) -> Designed:
    group, sizes = groups[number], [group.size for group in groups]
    inner = int(np.prod(sizes[number + 1 :], dtype=np.int64))
    positions = sweep.index // inner % sizes[number]
    outer = sweep.index // (inner * sizes[number])
    kind = kind_of(spec)
    paths = list(spec[kind])
    points = None
    if kind == 'morris' and group.plan is not None:
        points = group.plan.at(np.arange(group.size))
    step = sizes[number] // int(spec['count'])
    others = outer * inner + sweep.index % inner
    cases = _cases(sweep, others, paths, sweep.manifest['rollouts'] // sizes[number])
    return Designed(kind, paths, spec, step, positions, others, cases, points)


def _cases(sweep: Sweep, others: np.ndarray, paths: list[str], count: int) -> list[str]:
    """The other variations, in each combination that has rows."""
    beside = [path for path in sweep.paths if path not in paths]
    if not beside or count > MOST_OTHERS:
        return [''] * count
    table, cases = sweep.table(beside), []
    for case in range(count):
        rows = np.flatnonzero(others == case)
        values = table.slice(rows[0], 1).to_pylist()[0] if len(rows) else {}
        cases.append(', '.join(f'{path} = {value}' for path, value in values.items()))
    return cases


def _is_the_same(sweep: Sweep, group: Group, entry: Designed) -> bool:
    """Whether the design that is drawn now gives the values that the rows have."""
    drawn = group.at(entry.positions)
    for path in entry.paths:
        there, here = sweep.table([path])[path].to_pylist(), drawn[path]
        if isinstance(here, np.ndarray) and here.dtype.kind == 'f':
            if not np.allclose(here, there, rtol=1e-9, atol=0.0):
                return False
        elif list(here) != there:
            return False
    return True


def indices(sweep: Sweep, entry: Designed, values: np.ndarray, measure: Measure) -> Iterator[Row]:
    """Indices of a measure: of each controller and each combination of the other groups.

    A base point or trajectory with a row that is missing or failed is left out, as a whole. There
    are no indices of a figure that some rows do not have, such as a time to settle: they would be
    those of the rows that were chosen by the figure itself.

    Parameters
    ----------
    sweep : whose rows they are
    entry : of `designed`
    values : (n,) of the measure in all rows
    measure : what it is

    """
    analyze = _sobol if entry.kind == 'saltelli' else _morris
    size = int(entry.spec['count']) * entry.step
    for i, controller in enumerate(sweep.controllers):
        for other, case in enumerate(entry.cases):
            rows = _rows(sweep, entry, i, other)
            if not np.isfinite(values[rows]).all():
                continue
            Y, whole = np.full(size, np.nan), _whole(entry, rows)
            Y[entry.positions[rows]] = values[rows]
            used = Y.reshape(-1, entry.step)[whole]
            if len(used) < FEWEST or np.ptp(used) <= 1e-12 * np.abs(used).max():
                continue
            names: Row = {'method': 'sobol' if entry.kind == 'saltelli' else 'morris'}
            names |= {'controller': controller, 'figure': measure.name, 'unit': measure.unit}
            names |= {'case': case, 'points': len(used), 'of': int(entry.spec['count'])}
            with np.errstate(all='ignore'):
                found = list(analyze(entry, used, whole))
            yield from (names | row for row in found)


def _rows(sweep: Sweep, entry: Designed, controller: int, other: int) -> np.ndarray:
    """Mask of the rows of a controller and combination that came to their end."""
    return (sweep.controller == controller) & (sweep.status == 0) & (entry.others == other)


def _whole(entry: Designed, rows: np.ndarray) -> np.ndarray:
    """Mask of the base points or trajectories of which all rows are among these (n,)."""
    there = np.zeros(int(entry.spec['count']) * entry.step, bool)
    there[entry.positions[rows]] = True
    return np.all(there.reshape(-1, entry.step), axis=1)


def omitted(sweep: Sweep, entry: Designed, values: np.ndarray, measure: Measure) -> Iterator[str]:
    """Note on a measure without indices: some rows have no such figure."""
    for i, controller in enumerate(sweep.controllers):
        lacks = [np.isnan(values[_rows(sweep, entry, i, k)]) for k in range(len(entry.cases))]
        if any(mask.any() and not mask.all() for mask in lacks):
            of_all = np.concatenate(lacks)
            yield (
                f'no indices of {measure.label} under {controller}: {of_all.sum()} of '
                f'{of_all.size} rows have none, and the rest is no sample of the design'
            )


def reached(sweep: Sweep, entry: Designed) -> Iterator[str]:
    """Notes on a design of which a part has no indices, or whose rows are noisy."""
    paths, of = ', '.join(entry.paths), int(entry.spec['count'])
    saltelli = entry.kind == 'saltelli'
    blocks, biased = ('base points', 'S_T') if saltelli else ('trajectories', 'μ* and σ')
    there = 0
    for i, controller in enumerate(sweep.controllers):
        whole = [_whole(entry, _rows(sweep, entry, i, k)).sum() for k in range(len(entry.cases))]
        used = [int(count) for count in whole if count >= FEWEST]
        there += len(used)
        if sum(used) < of * len(used):
            yield (
                f'indices of {paths} under {controller} are of the {sum(used)} of '
                f'{of * len(used)} {blocks} whose rows all came to their end'
            )
        if lacking := len(whole) - len(used):
            where = f' in {lacking} of {len(whole)} cases' if used else ''
            yield (
                f'no indices of {paths} under {controller}{where}: fewer than {FEWEST} of {of} '
                f'{blocks} have rows that all came to their end'
            )
    if there and _noisy(sweep):
        yield (
            f'{biased} of {paths} contain the noise of sensors or faults, which every rollout '
            'draws for itself: above 0 without any effect'
        )


def _noisy(sweep: Sweep) -> bool:
    """Whether the seed of a rollout, which no two have in common, matters to its figures."""
    scenario = sweep.manifest['scenario']
    chances = [fault.get('probability', 1.0) for fault in scenario.get('faults', ())]
    return (
        any(np.any(value) for value in scenario.get('sensors', {}).values())
        or any(0.0 < chance < 1.0 for chance in chances)
        or any(p.startswith('sensors.') or p.endswith('.probability') for p in sweep.paths)
    )


def _sobol(entry: Designed, Y: np.ndarray, whole: np.ndarray) -> Iterator[Row]:
    second = bool(entry.spec.get('second_order'))
    found = sobol_indices(entry.paths, Y.ravel(), SEED, second_order=second)
    for i, path in enumerate(entry.paths):
        yield {'path': path, 'with': None} | {key: known(found[key][i]) for key in FIRST_AND_TOTAL}
    if second:
        for i, path in enumerate(entry.paths):
            for j in range(i + 1, len(entry.paths)):
                row = {key: known(found[key][i, j]) for key in SECOND}
                yield {'path': path, 'with': entry.paths[j]} | row


def _morris(entry: Designed, Y: np.ndarray, whole: np.ndarray) -> Iterator[Row]:
    assert entry.points is not None
    X = entry.points.reshape(len(whole), entry.step, -1)[whole].reshape(Y.size, -1)
    found = morris_indices(entry.paths, X, Y.ravel(), SEED, int(entry.spec.get('levels', LEVELS)))
    for i, path in enumerate(entry.paths):
        yield {'path': path, 'with': None} | {key: known(found[key][i]) for key in EFFECTS}


def sobol_indices(
    names: Sequence[str], y: np.ndarray, seed: int, *, second_order: bool = False
) -> dict[str, np.ndarray]:
    """Sobol' indices S1 (k,), ST (k,) and S2 (k, k) by SALib; '_conf' is half of the 95 % interval.

    Parameters
    ----------
    names : of the k factors
    y : (n,) answers at the points of a Saltelli design, base point after base point
    seed : of the bootstrap
    second_order : whether the design has the rows for S2

    """
    from SALib.analyze import sobol

    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', 'Constant values')  # whose indices are 0
        return sobol.analyze(cube(names), y, calc_second_order=second_order, seed=seed)


def morris_indices(
    names: Sequence[str], points: np.ndarray, y: np.ndarray, seed: int, levels: int
) -> dict[str, np.ndarray]:
    """Elementary effects of Morris over the whole range by SALib: mu, mu_star and sigma, each (k,).

    Parameters
    ----------
    names : of the k factors
    points : (n, k) of the unit cube, trajectory after trajectory
    y : (n,) answers at the points
    seed : of the bootstrap behind mu_star_conf, half of the 95 % interval
    levels : of the grid of the design

    """
    from SALib.analyze import morris

    return morris.analyze(cube(names), points, y, num_levels=levels, seed=seed)


Method = Literal['sobol', 'morris']
BOOTSTRAPS = 1000  # of the confidence of a spread
CONFIDENCE = 0.95
NAMES = {
    'sobol': FIRST_AND_TOTAL,
    'morris': EFFECTS[1:],
}


@dataclass(frozen=True)
class SensitivityPlan:
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
        if self.method not in NAMES:
            raise ValueError(f'method: expected {" or ".join(NAMES)}, found {self.method!r}')
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
        make = saltelli if self.method == 'sobol' else morris
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
        chosen = {name: np.asarray(found[name], float) for name in NAMES[self.method]}
        return chosen | {'slope': self._slope(y)}

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


def spreads(design: SensitivityPlan, answers: np.ndarray) -> dict[str, np.ndarray]:
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
    from scipy.stats import rankdata

    groups = answers[design.independent]  # (count, m, F)
    centred = groups - groups.mean(axis=(0, 1))
    size, rng = groups.shape[1], np.random.default_rng(design.seed)
    counts = rng.multinomial(design.count, np.full(design.count, 1 / design.count), BOOTSTRAPS)
    value, again = (
        _deviation(weights, centred, size) for weights in (np.ones((1, design.count)), counts)
    )
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(again, [tail, 100.0 - tail], axis=0)
    places = rankdata(-again, 'ordinal', axis=1)
    ends = np.percentile(places, [tail, 100.0 - tail], axis=0, method='nearest')
    found = {'spread': value[0], 'spread_low': low, 'spread_high': high}
    found |= {'spread_conf': 0.5 * (high - low), 'rank': rankdata(-value, 'ordinal', axis=1)[0]}
    return found | dict(zip(('rank_low', 'rank_high'), ends.astype(int), strict=True))


def _deviation(weights: np.ndarray, centred: np.ndarray, size: int) -> np.ndarray:
    """(R, F) standard deviations of R samples with these (R, count) counts of each group."""
    total = weights.sum(axis=1, keepdims=True) * size
    mean = weights @ centred.sum(axis=1) / total
    return np.sqrt(np.maximum(weights @ (centred**2).sum(axis=1) / total - mean**2, 0.0))
