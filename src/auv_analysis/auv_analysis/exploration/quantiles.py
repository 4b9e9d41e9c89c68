"""Quantiles of figures: of all rows of a controller, and of groups of them."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from auv_analysis.exploration.opening import Sweep
from auv_analysis.measures import FAMILIES, MEASURES, Measure, described
from auv_dynamics.signals import DOFS

LEVELS = {'low': 0.05, 'quarter': 0.25, 'median': 0.5, 'three_quarters': 0.75, 'high': 0.95}
POINTS = 201  # of a distribution function as it is drawn
Row = dict[str, Any]


def ordered(values: np.ndarray, unit: str) -> np.ndarray:
    """The same values; a time that does not exist is later than any other."""
    return np.where(np.isnan(values), np.inf, values) if unit == 's' else values


def quantiles(values: np.ndarray, levels: Iterable[float]) -> np.ndarray:
    """Quantiles that are values themselves, so that one of them may be infinite."""
    known = values[~np.isnan(values)]
    levels = np.asarray(list(levels))
    if len(known) == 0:
        return np.full(len(levels), np.nan)
    return np.quantile(known, levels, method='inverted_cdf')


def finite(value: float) -> float | None:
    """A number, None where it is not finite."""
    return float(value) if np.isfinite(value) else None


def spread(values: np.ndarray, unit: str) -> Row:
    """Quantiles of a figure as columns; None: it does not exist there, such as a settling time.

    `known` counts the values that exist; of a time, the quantiles count one that does not as late.
    """
    known = values[np.isfinite(values)]
    at = quantiles(ordered(values, unit), LEVELS.values())
    row: Row = {'rows': len(values), 'known': len(known)}
    row |= {'smallest': finite(known.min()) if len(known) else None}
    row |= {name: finite(value) for name, value in zip(LEVELS, at, strict=True)}
    row |= {'largest': finite(known.max()) if len(known) else None}
    return row | {'mean': finite(known.mean()) if len(known) else None}


def figures_spread(sweep: Sweep) -> Iterator[Row]:
    """Rows of `quantiles.parquet`: controller, figure, its unit and meaning, its quantiles."""
    for measure in MEASURES:
        yield from _of_column(sweep, measure.name, sweep.measure(measure))
    for family in FAMILIES:
        table = sweep.table([f'{family}.{dof}' for dof in DOFS])
        for name in table.column_names:
            yield from _of_column(sweep, name, table[name].to_numpy().astype(float))


def _of_column(sweep: Sweep, name: str, values: np.ndarray) -> Iterator[Row]:
    label, unit, meaning = described(name)
    for i, controller in enumerate(sweep.controllers):
        rows = (sweep.controller == i) & (sweep.status == 0)
        names = {'controller': controller, 'figure': name, 'label': label}
        yield names | {'unit': unit, 'meaning': meaning} | spread(values[rows], unit)


def distribution(values: np.ndarray, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
    """Distribution function as a line: values and the share of rows at or below each, in %.

    Rows without the figure count as rows above every value where it is a time.
    """
    at = ordered(values, measure.unit)
    at = at[~np.isnan(at)]
    levels = np.linspace(0.0, 1.0, POINTS)
    if len(at) == 0:
        return np.empty(0), np.empty(0)
    lines = np.quantile(at, levels, method='inverted_cdf')
    below = np.searchsorted(np.sort(at), lines, side='right') / len(at)
    inside = np.isfinite(lines)
    return lines[inside], 100 * below[inside]


def by_group(values: np.ndarray, codes: np.ndarray, count: int) -> list[np.ndarray]:
    """Values of each of so many groups."""
    order = np.argsort(codes, kind='stable')
    ends = np.searchsorted(codes[order], np.arange(count + 1))
    return [values[order[a:b]] for a, b in pairwise(ends)]


def varying(values: Sequence[np.ndarray], unit: str) -> bool:
    """Whether there is more than one value; of a time, one that does not exist is one as well."""
    whole = np.concatenate(values)
    known = whole[np.isfinite(whole)]
    if len(known) == 0:
        return False
    late = unit == 's' and len(known) < len(whole)
    return late or bool(np.ptp(known) > 1e-12 * np.abs(known).max())
