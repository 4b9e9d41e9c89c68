"""What a tuning leaves as Parquet: all gains that were tried, and a row per draw and controller."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from auv_analysis.tuning.measures import Measures
from auv_analysis.tuning.rivals import Rival

SEARCH, MONTE_CARLO = 'search.parquet', 'monte_carlo.parquet'


def write_search(path: Path, rivals: Mapping[str, Rival]) -> None:
    """Write a row for every point that was evaluated.

    Parameters
    ----------
    path : of the file; columns controller, law, structure, stage, diverged, allowed (its velocity
        loop is slow enough for the control period), the measures, then what was searched: a gain
        as the law takes it or, where the structure is a matrix times a number, that number

    """
    tables = []
    for name, rival in rivals.items():
        for found in rival.searches:
            x, measures, room, stages = found.tried.since()
            columns: dict[str, object] = {
                'controller': [name] * len(x),
                'law': [rival.law] * len(x),
                'structure': [found.space.structure] * len(x),
                'stage': stages.tolist(),
                'diverged': np.isnan(measures.error),
                'allowed': room >= 0.0,
                **_columns(measures),
            }
            columns |= {f'gain.{name}': np.exp(x[:, i]) for i, name in enumerate(found.space.names)}
            tables.append(pa.table(columns))
    parquet.write_table(pa.concat_tables(tables, promote_options='default'), path)


def write_draws(path: Path, draws: Mapping[str, Measures]) -> None:
    """Write a row per draw and controller: draw, controller, diverged, the measures."""
    tables = [
        pa.table({
            'draw': np.arange(len(measures.error)),
            'controller': [name] * len(measures.error),
            'diverged': np.isnan(measures.error),
            **_columns(measures),
        })
        for name, measures in draws.items()
    ]  # fmt: skip
    parquet.write_table(pa.concat_tables(tables), path)


def _columns(measures: Measures) -> dict[str, pa.Array]:
    """The measures; null for what diverged or does not settle."""
    return {
        name: pa.array(values, pa.float64(), mask=~np.isfinite(values))
        for name, values in measures._asdict().items()
    }
