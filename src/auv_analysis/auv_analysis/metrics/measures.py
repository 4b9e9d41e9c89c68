"""Figures of runs as columns: their names, units and meanings, and the few that sum up six.

A column is named like its keys in `summary.json`, such as `velocity_error.rms.surge`: of one run in
a comparison, of a rollout in a sweep.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any, Literal

import numpy as np

from auv_analysis.metrics.quantities import HALVES, METRICS
from auv_analysis.metrics.settling import SETTLED
from auv_dynamics.vehicle import DOFS

MATRICES = ('gains.K_D', 'gains.K_f')
TOTAL = 'kinetic_energy.mean'
FAMILIES = {name: METRICS[name] for name in METRICS if name != TOTAL}


@dataclass(frozen=True)
class Measure:
    """A figure that sums up columns.

    Attributes
    ----------
    name : of its own column
    label : for axes and heads of tables
    unit : of its values
    meaning : one line that a reader without the paper understands
    columns : it is made of
    rule : 'norm' is the root of the sum of squares, 'largest' the largest, 'only' the one that
        there is
    """

    name: str
    label: str
    unit: str
    meaning: str
    columns: tuple[str, ...]
    rule: Literal['norm', 'largest', 'only']

    def of(self, column: Callable[[str], np.ndarray]) -> np.ndarray:
        """Values (n,) from those of its columns; NaN where one of them does not exist."""
        values = map(column, self.columns)
        if self.rule == 'norm':
            return np.sqrt(sum(map(np.square, values)))
        return reduce(np.maximum, values)


def _halves(family: str, rule: Literal['norm', 'largest']) -> Iterator[Measure]:
    """Measures of the linear and of the angular columns of a family."""
    sums_up = 'of the vector of the three' if rule == 'norm' else 'the largest of the three'
    for word, dofs in HALVES.items():
        half, columns = FAMILIES[family].of(word), tuple(f'{family}.{dof}' for dof in dofs)
        meaning = f'{half.meaning}; {sums_up} {word} degrees of freedom'
        yield Measure(f'overall.{family}.{word}', half.label, half.unit, meaning, columns, rule)


MEASURES = (
    Measure(
        TOTAL, METRICS[TOTAL].label, METRICS[TOTAL].unit, METRICS[TOTAL].meaning, (TOTAL,), 'only'
    ),
    Measure(
        'overall.velocity_error.settling_time',
        'settled',
        's',
        f'time from which all six velocity errors stay within {SETTLED}; none: not in this run',
        tuple(f'velocity_error.settling_time.{dof}' for dof in DOFS),
        'largest',
    ),
    *_halves('velocity_error.rms', 'norm'),
    *_halves('velocity_error.max_after_2s', 'largest'),
    *_halves('lumped_error.rms', 'norm'),
    *_halves('coupling.delta_xi_max', 'largest'),
    *_halves('coupling.delta_pi_max', 'largest'),
    *_halves('effort.rms', 'norm'),
    *_halves('effort.max', 'largest'),
)
BY_NAME = {measure.name: measure for measure in MEASURES}


def flat(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Columns of a run from its summary, then those of `MEASURES`; matrices go entry by entry."""
    found: dict[str, Any] = {}
    for key, value in summary.items():
        found |= _columns(key, value)
    for measure in MEASURES:
        parts = {name: np.array([found.get(name)], float) for name in measure.columns}
        value = float(measure.of(parts.__getitem__)[0])
        found[measure.name] = None if np.isnan(value) else value
    return found


def _columns(key: str, value: Any) -> dict[str, Any]:
    if isinstance(value, Mapping):
        parts = [_columns(f'{key}.{name}', entry) for name, entry in value.items()]
        return {name: entry for part in parts for name, entry in part.items()}
    if value is None and (key in FAMILIES or key in MATRICES):
        value = [None] * 6 if key in FAMILIES else []
    if not isinstance(value, list):
        return {key: value}
    if value and isinstance(value[0], Mapping):
        return _columns(key, {_item(entry): _figures(entry) for entry in value})
    if key in MATRICES and not value:
        return {}
    if not value or isinstance(value[0], str):
        return {key: '; '.join(value)}
    names = DOFS if len(value) == 6 else ('from', 'to')
    pairs = zip(names, value, strict=True)
    return {k: v for name, entry in pairs for k, v in _columns(f'{key}.{name}', entry).items()}


def _item(entry: Mapping[str, Any]) -> str:
    """Name of an entry of a list: what deforms what, or a window of time."""
    if 'window' in entry:
        return 'to'.join(f'{time:g}' for time in entry['window'])
    return f'{entry["to"]}.{entry["from"]}'


def _figures(entry: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in entry.items() if key not in ('to', 'from', 'window')}
