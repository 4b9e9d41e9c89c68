"""The files that hold what was found in a sweep."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import parquet

from auv_analysis.exploration.results import DOCUMENT, Results, Row


def document(results: Results) -> dict[str, Any]:
    """All of it, ready for JSON."""
    sweep = results.sweep
    return {
        'campaign': sweep.name,
        'folder': str(sweep.folder),
        'rows': sweep.rows,
        'planned_rows': sweep.planned,
        'controllers': results.counts(),
        'reasons': results.reasons(),
        'paths': [{'path': v.path, 'unit': v.unit, 'meaning': v.meaning, 'groups': len(v.labels)}
                  for v in results.varied],
        'fixed': results.fixed,
        'notes': results.notes,
        **results.tables,
    }  # fmt: skip


def write_results(results: Results, out: Path) -> dict[str, Any]:
    """Write analysis.json and a Parquet file per table that has rows; returns the former."""
    found = document(results)
    text = json.dumps(found, allow_nan=False)
    (out / DOCUMENT).write_text(text + '\n', encoding='utf-8')
    for name, rows in results.tables.items():
        if rows:
            parquet.write_table(pa.Table.from_pylist(_filled(rows)), out / f'{name}.parquet')
    return found


def _filled(rows: Sequence[Row]) -> list[Row]:
    """Rows that have all columns, in the order in which they first appear."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    return [{name: row.get(name) for name in names} for row in rows]
