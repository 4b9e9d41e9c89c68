"""The atlas of several vehicles, and the files that hold it."""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import parquet

from auv_analysis.atlas.couplings import Couplings, couplings_of
from auv_analysis.atlas.reached import reached
from auv_analysis.counting import each
from auv_analysis.studies.compare.sources import numbered
from auv_dynamics.signals import DOFS
from auv_dynamics.vehicle_file import load_vehicle

TABLE, DOCUMENT = 'atlas.parquet', 'atlas.json'
MATRICES = ('M', 'Upsilon', 'Upsilon_inv', 'correlation',
            'velocity_shares_percent', 'input_shares_percent')  # fmt: skip
WHOLE = ('diagonal', 'strength_percent', 'largest_correlation_percent')
PEAKS = ('delta_xi_max', 'delta_pi_max', 'delta_xi_energy_percent')


@dataclass(frozen=True, eq=False)
class Chart:
    """One vehicle of the atlas: its couplings, and what they reach in case 1."""

    couplings: Couplings
    reached: dict[str, Any]

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self.couplings.name


def charts(vehicles: Iterable[str]) -> list[Chart]:
    """Charts of vehicles, those that are coupled the most first.

    Parameters
    ----------
    vehicles : files, or bare names of shipped ones

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    vehicles = list(vehicles)
    loaded = [load_vehicle(vehicle) for vehicle in vehicles]
    names = numbered([vehicle.name for vehicle in loaded])
    known = [couplings_of(*pair) for pair in zip(loaded, names, strict=True)]
    pairs = each(zip(known, vehicles, strict=True), len(vehicles))
    found = [Chart(couplings, reached(vehicle)) for couplings, vehicle in pairs]
    return sorted(found, key=lambda chart: (-chart.couplings.strength, chart.name))


def document(found: Sequence[Chart]) -> dict[str, Any]:
    """The atlas, ready for JSON: vehicle -> its numbers."""
    vehicles = {chart.name: chart.couplings.as_dict() | {'case1': chart.reached} for chart in found}
    return {'dofs': list(DOFS), 'vehicles': vehicles}


def write_atlas(found: Sequence[Chart], out: Path) -> dict[str, Any]:
    """Write atlas.json and atlas.parquet, a row per vehicle and ordered pair; returns the first."""
    whole = document(found)
    text = json.dumps(whole, indent=1, allow_nan=False)
    (out / DOCUMENT).write_text(text + '\n', encoding='utf-8')
    rows = [row for name, entry in whole['vehicles'].items() for row in _rows(name, entry)]
    parquet.write_table(pa.Table.from_pylist(rows), out / TABLE)
    return whole


def _rows(name: str, entry: dict[str, Any]) -> Iterator[dict[str, Any]]:
    peaks = {f'case1_{key}': entry['case1'].get(key, [None] * 6) for key in PEAKS}
    for i, into in enumerate(DOFS):
        for j, of in enumerate(DOFS):
            row: dict[str, Any] = {'vehicle': name, 'in': into, 'of': of}
            row |= {key: entry[key][i][j] for key in MATRICES}
            row |= {key: values[i] if i == j else None for key, values in peaks.items()}
            yield row | {key: entry[key] for key in WHOLE}
