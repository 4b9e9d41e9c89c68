"""The folder of a sweep, opened to be read column by column."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
from pyarrow import parquet

from auv_analysis.metrics.measures import Measure
from auv_analysis.output.folder import PART, ROLLOUTS, SWEEP
from auv_analysis.studies.sweep.variation import kind_of
from auv_dynamics.files.errors import InputError, first_line, reason

STATUSES = ('ok', 'diverged', 'refused')
OWN = ('index', 'controller', 'seed', 'status', 'reason')
BROKEN = 'a finished part of a sweep'


class Pair(NamedTuple):
    """Two controllers by their places, and rows of the same rollouts (m,) of each."""

    first: int
    second: int
    mine: np.ndarray
    other: np.ndarray


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
        """What varies, in the order of the campaign."""
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

    def _place(self, column: str, words: Sequence[str]) -> np.ndarray:
        found = pc.index_in(self.table([column])[column], value_set=pa.array(words))
        if found.null_count:
            unknown = pc.unique(self.table([column])[column]).to_pylist()
            raise InputError(self.folder, column, f'one of {", ".join(words)}', f'{unknown}')
        return found.to_numpy().astype(np.int16)

    @cached_property
    def pairs(self) -> list[Pair]:
        """For each two controllers, the rows of the rollouts that both have."""
        found = []
        for a, b in combinations(range(len(self.controllers)), 2):
            first, second = (np.flatnonzero(self.controller == i) for i in (a, b))
            both = np.intersect1d(self.index[first], self.index[second], return_indices=True)
            found.append(Pair(a, b, first[both[1]], second[both[2]]))
        return found

    def numbers(self, column: str) -> np.ndarray:
        """Column of numbers (n,), NaN where there is none."""
        return self.table([column])[column].to_numpy().astype(float)

    def measure(self, measure: Measure) -> np.ndarray:
        """Values (n,) of a measure, NaN where there is none."""
        table = self.table(list(measure.columns))
        return measure.of(lambda name: table[name].to_numpy().astype(float))

    @cached_property
    def _dataset(self) -> ds.Dataset:
        """The parts as one; kept, so that what they say of themselves is read once."""
        return ds.dataset([str(path) for path in self.parts], format='parquet')

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
        for spec in self.campaign['vary']:
            kind = kind_of(spec)
            if path in spec[kind]:
                return kind, spec[kind][path]
        raise KeyError(path)


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
    parts = sorted(_parts(folder / ROLLOUTS))
    if not parts:
        expected = 'finished blocks of a sweep'
        raise InputError(folder / ROLLOUTS, '', expected, 'no part-*.parquet')
    sweep = Sweep(folder, manifest, parts, 0)
    needed = [*OWN, *sweep.paths]
    rows = sum(_checked(path, needed) for path in parts)
    return Sweep(folder, manifest, parts, rows)


def _parts(folder: Path) -> Iterator[Path]:
    try:
        yield from (path for path in folder.iterdir() if PART.fullmatch(path.name))
    except OSError as error:
        raise InputError(folder, '', 'the rows of a sweep', reason(error)) from None


def _manifest(path: Path) -> dict[str, Any]:
    try:
        manifest = json.loads(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise InputError(path, '', 'the manifest of a sweep', reason(error)) from None
    except ValueError:
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
