"""Factors of a sweep: values of a varied path in groups, bins of numbers or what it may be."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from auv_analysis.output.text import plain
from auv_analysis.scenario.changes import said_of, split
from auv_analysis.studies.sweep.dataset import Sweep
from auv_dynamics.files.errors import shorten

MOST_VALUES = 12  # different numbers up to which each is a group of its own
BINS = 16
LONGEST = 40  # of a word that is shown as it is
LONGEST_UNIT, LONGEST_LABEL = 14, 18  # of an axis, of a value at it
ROWS_PER_BIN = 12  # at least


@dataclass(frozen=True, eq=False)
class Factor:
    """A path and its values in every row.

    Attributes
    ----------
    path : of the campaign
    unit, meaning : what the schema says of it, '' where it says nothing
    numbers : (n,) float, None of words, truths and lists
    codes : (n,) group of each row
    labels : of the groups
    edges : (groups, 2) smallest and largest number in each; None where `numbers` is None
    binned : whether a group is a bin of different numbers

    """

    path: str
    unit: str
    meaning: str
    numbers: np.ndarray | None
    codes: np.ndarray
    labels: Sequence[str]
    edges: np.ndarray | None
    binned: bool

    @cached_property
    def middles(self) -> np.ndarray:
        """Median number of each group (groups,), over all rows; NaN of what is no number."""
        if self.numbers is None:
            return np.full(len(self.labels), np.nan)
        groups = by_group(self.numbers, self.codes, len(self.labels))
        return np.array([np.median(group) for group in groups])

    @property
    def differs(self) -> bool:
        """Whether it takes more than one value."""
        return len(self.labels) > 1

    def concerns(self, controller: str) -> bool:
        """Whether it has a say in the loop of a controller."""
        parts = split(self.path)
        return parts[0] != 'controllers' or parts[1] in ('*', controller)


def factors_of(sweep: Sweep) -> list[Factor]:
    """Paths of a sweep with their values, in the order of the campaign."""
    return [_varied(sweep, path) for path in sweep.paths]


def _varied(sweep: Sweep, path: str) -> Factor:
    column = sweep.table([path])[path]
    unit, meaning = _said(sweep, path)
    kind = column.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind):
        numbers = column.to_numpy().astype(float)
        codes, edges, binned = _groups(numbers)
        labels = _labels(edges)
        codes = codes.astype(np.int32)
        return Factor(path, unit, meaning, numbers, codes, labels, edges, binned)
    codes, labels = _categories(column)
    return Factor(path, unit, meaning, None, codes.astype(np.int32), labels, None, False)


def _said(sweep: Sweep, path: str) -> tuple[str, str]:
    named, every = path, 'controllers.*.'
    if path.startswith(every):
        named = f"controllers.'{sweep.controllers[0]}'.{path.removeprefix(every)}"
    vehicles = list(sweep.manifest.get('vehicles', {}).values())
    return said_of(sweep.manifest.get('scenario', {}), (vehicles or [{}])[0], named)


def _groups(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """Group of each number, ends of the groups, and whether they are bins."""
    values, codes = np.unique(numbers, return_inverse=True)
    if len(values) <= MOST_VALUES:
        return codes, np.stack([values, values], axis=1), False
    count = int(np.clip(len(numbers) // ROWS_PER_BIN, 2, BINS))
    cuts = np.unique(np.quantile(numbers, np.linspace(0, 1, count + 1)[1:-1]))
    codes = np.searchsorted(cuts, numbers, side='right')
    used, codes = np.unique(codes, return_inverse=True)
    order = np.argsort(codes, kind='stable')
    starts = np.searchsorted(codes[order], np.arange(len(used)))
    low = np.minimum.reduceat(numbers[order], starts)
    high = np.maximum.reduceat(numbers[order], starts)
    return codes, np.stack([low, high], axis=1), True


def _labels(edges: np.ndarray) -> list[str]:
    """Names of groups, with as many digits as tell them apart."""
    for digits in range(3, 18):
        labels = [_label(low, high, digits) for low, high in edges]
        if len({*labels}) == len(labels):
            break
    return labels


def _label(low: float, high: float, digits: int) -> str:
    if low == high:
        return plain(low, max(6, digits))
    return f'{plain(low, digits)}–{plain(high, digits)}'


def _categories(column: pa.ChunkedArray) -> tuple[np.ndarray, list[str]]:
    """Codes of words, truths or lists by their first appearance, and their names."""
    if pa.types.is_list(column.type):
        words = [json.dumps(value) for value in column.to_pylist()]
        column = pa.chunked_array([pa.array(words, pa.string())])
    known = pc.unique(column)
    codes = pc.index_in(column, value_set=known).to_numpy()
    return codes, [value if isinstance(value, str) and len(value) < LONGEST else shorten(value)
                   for value in known.to_pylist()]  # fmt: skip


PREFIXES = ('controllers.*.', 'vehicle.', 'setpoint.', 'controllers.')


def short_names(factor: Sequence[Factor]) -> dict[str, str]:
    """Path -> its name without where it is from, as long as that tells it from the others."""
    short = {v.path: _short(v.path) for v in factor}
    names = list(short.values())
    return {path: name if names.count(name) == 1 else path for path, name in short.items()}


def _short(path: str) -> str:
    for prefix in PREFIXES:
        if path.startswith(prefix):
            return path.removeprefix(prefix)
    return path


def with_unit(name: str, factor: Factor) -> str:
    """Axis label: the name, and the unit where the schema says a short one."""
    return f'{name} ({factor.unit})' if 0 < len(factor.unit) <= LONGEST_UNIT else name


def cut(label: str) -> str:
    """A value that has room at an axis."""
    return label if len(label) <= LONGEST_LABEL else f'{label[: LONGEST_LABEL - 2]}…'


def by_group(values: np.ndarray, codes: np.ndarray, count: int) -> list[np.ndarray]:
    """Values of each of so many groups."""
    order = np.argsort(codes, kind='stable')
    ends = np.searchsorted(codes[order], np.arange(count + 1))
    return [values[order[a:b]] for a, b in pairwise(ends)]
