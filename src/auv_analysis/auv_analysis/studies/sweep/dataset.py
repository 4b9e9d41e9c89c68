"""The folder of a sweep, opened to be read column by column."""

import json
import re
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.compute as pc
from pyarrow import parquet

from auv_analysis.output.arrow import pa
from auv_analysis.output.folder import PART, ROLLOUTS, SWEEP
from auv_analysis.output.text import plain
from auv_analysis.scenario.changes import said_of
from auv_analysis.studies.sweep.campaign import concerns, of_controller
from auv_analysis.studies.sweep.variation import kind_of
from auv_dynamics.files.errors import InputError, first_line, refusing, shorten

if TYPE_CHECKING:
    import pyarrow.dataset as ds

STATUSES = ('ok', 'diverged', 'refused')
OWN = ('index', 'controller', 'seed', 'status', 'reason')
BROKEN = 'a finished part of a sweep'
THREADS = 2  # that NumPy sorts in; each holds the columns of a measure


@dataclass(frozen=True, eq=False)
class Sweep:
    """Rows of a sweep; a column is read when it is asked for.

    Attributes
    ----------
    folder : of `auv sweep`
    manifest : contents of its sweep.json
    parts : its Parquet files, in the order of their numbers
    rows : in all of them

    """

    folder: Path
    manifest: dict[str, Any]
    parts: Sequence[Path]
    rows: int

    @property
    def campaign(self) -> dict[str, Any]:
        """Campaign file with every default filled in."""
        return self.manifest['campaign']

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return self.campaign['name']

    @property
    def controllers(self) -> list[str]:
        """Names of the controllers that were swept."""
        return self.campaign['controllers']

    @property
    def planned(self) -> int:
        """Rows that the finished sweep has."""
        return self.manifest['rollouts'] * len(self.controllers)

    @property
    def paths(self) -> list[str]:
        """Variations, in the order of the campaign."""
        return [path for spec in self.campaign['vary'] for path in spec[kind_of(spec)]]

    @cached_property
    def index(self) -> np.ndarray:
        """Number of the rollout of each row (n,)."""
        return self.table(['index'])['index'].to_numpy()

    @cached_property
    def controller(self) -> np.ndarray:
        """Place of the controller of each row in `controllers` (n,)."""
        return self._place('controller', self.controllers)

    @cached_property
    def status(self) -> np.ndarray:
        """Place of the status of each row in `STATUSES` (n,)."""
        return self._place('status', STATUSES)

    @cached_property
    def finished(self) -> dict[str, np.ndarray]:
        """Controller -> indices of its rows that have figures."""
        ok = self.status == 0
        return {
            name: np.flatnonzero(ok & (self.controller == i))
            for i, name in enumerate(self.controllers)
        }

    def _place(self, column: str, words: Sequence[str]) -> np.ndarray:
        found = pc.index_in(self.table([column])[column], value_set=pa.array(words))
        if found.null_count:
            unknown = pc.unique(self.table([column])[column]).to_pylist()
            raise InputError(self.folder, column, f'one of {", ".join(words)}', f'{unknown}')
        return found.to_numpy().astype(np.int16)

    @cached_property
    def pairs(self) -> list[tuple[int, int, np.ndarray, np.ndarray]]:
        """Places of each two controllers, and rows of the same rollouts (m,) of each."""
        found = []
        for a, b in combinations(range(len(self.controllers)), 2):
            first, second = (np.flatnonzero(self.controller == i) for i in (a, b))
            both = np.intersect1d(self.index[first], self.index[second], return_indices=True)
            found.append((a, b, first[both[1]], second[both[2]]))
        return found

    @cached_property
    def _dataset(self) -> 'ds.Dataset':
        """The parts as one; kept, so that what they say of themselves is read once."""
        import pyarrow.dataset as ds  # it asks for pandas, after which `arrow` looked

        return ds.dataset([str(path) for path in self.parts])

    def table(self, columns: list[str]) -> pa.Table:
        """Some columns of all rows, in the order of the parts."""
        try:
            return self._dataset.to_table(columns)
        except (pa.ArrowInvalid, OSError) as error:
            for path in self.parts:
                _read(path, columns)
            raise InputError(self.folder, '', BROKEN, first_line(error)) from None

    def spread_of(self, path: str) -> tuple[str, Any]:
        """Kind of a path's group and what the campaign says of it."""
        kinds = ((kind_of(spec), spec) for spec in self.campaign['vary'])
        return next((kind, spec[kind][path]) for kind, spec in kinds if path in spec[kind])


def numbers_of(table: pa.Table, column: str) -> np.ndarray:
    """Column of numbers (n,) of some rows, NaN where there is none."""
    return table[column].to_numpy().astype(float, copy=False)


def open_sweep(folder: Path) -> Sweep:
    """Sweep of a folder.

    Parameters
    ----------
    folder : of `auv sweep`, finished or not

    Raises
    ------
    InputError : a part or the manifest cannot be read, or there is no row

    """
    manifest = _manifest(folder / SWEEP)
    with refusing(folder / ROLLOUTS, '', 'the rows of a sweep'):
        files = (folder / ROLLOUTS).iterdir()
        parts = sorted(path for path in files if PART.fullmatch(path.name))
    if not parts:
        expected = 'finished blocks of a sweep'
        raise InputError(folder / ROLLOUTS, '', expected, 'no part-*.parquet')
    sweep = Sweep(folder, manifest, parts, 0)
    needed = [*OWN, *sweep.paths]
    rows = sum(_checked(path, needed) for path in parts)
    return Sweep(folder, manifest, parts, rows)


def _manifest(path: Path) -> dict[str, Any]:
    try:
        with refusing(path, '', 'the manifest of a sweep'):
            manifest = json.loads(path.read_text(encoding='utf-8'))
    except (json.JSONDecodeError, UnicodeDecodeError):
        raise InputError(path, '', 'the manifest of a sweep', 'no JSON') from None
    try:
        campaign = manifest['campaign']
        whole = isinstance(manifest['rollouts'], int) and all(campaign['controllers'])
        known = [kind_of(spec) for spec in campaign['vary']]
    except (TypeError, KeyError, StopIteration):
        whole, known = False, []
    if not (whole and known):
        expected = 'campaign and rollouts, as `auv sweep` writes them'
        raise InputError(path, '', expected, 'another document')
    return manifest


def _checked(path: Path, needed: Sequence[str]) -> int:
    """Number of rows of a part; InputError where it cannot be read or has other columns."""
    try:
        metadata = parquet.read_metadata(path)
        names = set(metadata.schema.to_arrow_schema().names)
    except (pa.ArrowInvalid, OSError) as error:
        raise InputError(path, '', BROKEN, first_line(error)) from None
    for name in needed:
        if name not in names:
            raise InputError(path, name, 'a column of every part', 'nothing')
    return metadata.num_rows


def _read(path: Path, columns: list[str]) -> None:
    try:
        parquet.ParquetFile(path).read(columns)
    except (pa.ArrowInvalid, OSError) as error:
        raise InputError(path, '', BROKEN, first_line(error)) from None


MOST_VALUES = 12  # different numbers up to which each is a group of its own
FIRST = 1000  # rows that mostly show whether there are more
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
        """Whether it affects this controller."""
        return concerns(self.path, controller)


def factors_of(sweep: Sweep) -> list[Factor]:
    """Paths of a sweep with their values, in the order of the campaign."""
    table = sweep.table(sweep.paths)
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(partial(_varied, sweep), sweep.paths, table.columns))


def _varied(sweep: Sweep, path: str, column: pa.ChunkedArray) -> Factor:
    unit, meaning = _said(sweep, path)
    kind = column.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind):
        numbers = column.to_numpy().astype(float)
        codes, edges, binned = _groups(numbers)
        return Factor(path, unit, meaning, numbers, _small(codes), _labels(edges), edges, binned)
    codes, labels = _categories(column)
    return Factor(path, unit, meaning, None, _small(codes), labels, None, False)


def _small(codes: np.ndarray) -> np.ndarray:
    """Groups as the smallest integers that hold them: NumPy sorts those of 16 bits by radix."""
    return codes.astype(np.min_scalar_type(int(codes.max(initial=0))))


def _said(sweep: Sweep, path: str) -> tuple[str, str]:
    vehicles = list(sweep.manifest.get('vehicles', {}).values())
    scenario, named = sweep.manifest.get('scenario', {}), of_controller(path, sweep.controllers[0])
    return said_of(scenario, (vehicles or [{}])[0], named)


def _groups(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """Group of each number, ends of the groups, and whether they are bins."""
    if len(np.unique(numbers[:FIRST])) <= MOST_VALUES:  # else there is no need to sort them all
        values, codes = np.unique(numbers, return_inverse=True)
        if len(values) <= MOST_VALUES:
            return codes, np.stack([values, values], axis=1), False
    count = int(np.clip(len(numbers) // ROWS_PER_BIN, 2, BINS))
    cuts = np.unique(np.quantile(numbers, np.linspace(0, 1, count + 1)[1:-1]))
    codes = np.searchsorted(cuts, numbers, side='right')
    used = np.bincount(codes) > 0
    codes = _small((np.cumsum(used) - 1)[codes])
    groups = by_group(numbers, codes, int(used.sum()))
    return codes, np.array([[group.min(), group.max()] for group in groups]), True


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
    """Codes of words, truths or lists by their first appearance, and their names.

    Names that were shortened to the same text have a number before it.
    """
    if pa.types.is_list(column.type):
        words = [json.dumps(value) for value in column.to_pylist()]
        column = pa.chunked_array([pa.array(words, pa.string())])
    known = pc.unique(column)
    codes = pc.index_in(column, value_set=known).to_numpy()
    names = [value if isinstance(value, str) and len(value) < LONGEST else shorten(value)
             for value in known.to_pylist()]  # fmt: skip
    count = Counter(names)
    return codes, [f'{i}: {name}' if count[name] > 1 else name for i, name in enumerate(names, 1)]


PREFIX = re.compile(r'^(controllers\.(\*\.)?|vehicle\.|setpoint\.)')


def short_names(factor: Sequence[Factor]) -> dict[str, str]:
    """Path -> its name without where it is from, as long as that tells it from the others."""
    short = {v.path: PREFIX.sub('', v.path) for v in factor}
    names = list(short.values())
    return {path: name if names.count(name) == 1 else path for path, name in short.items()}


def with_unit(name: str, factor: Factor) -> str:
    """Axis label: the name, and the unit where the schema says a short one."""
    return f'{name} ({factor.unit})' if 0 < len(factor.unit) <= LONGEST_UNIT else name


def cut(label: str) -> str:
    """A value that has room at an axis."""
    return label if len(label) <= LONGEST_LABEL else f'{label[: LONGEST_LABEL - 2]}…'


def by_group(values: np.ndarray, codes: np.ndarray, count: int) -> list[np.ndarray]:
    """Values of each of so many groups."""
    order = np.argsort(codes.astype(np.min_scalar_type(count)), kind='stable')  # few: by radix
    ends = [0, *np.cumsum(np.bincount(codes, minlength=count))]
    return [values[order[a:b]] for a, b in pairwise(ends)]
