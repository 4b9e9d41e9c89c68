"""The rollouts with the smallest figures, with the values that made them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.exploration.opening import Sweep
from auv_analysis.measures import MEASURES, Measure

Row = dict[str, Any]
COUNT = 10  # rows of each controller


def smallest(
    sweep: Sweep, values: np.ndarray, measure: Measure, count: int = COUNT
) -> list[tuple[int, Row]]:
    """Rows of each controller with the smallest values of a measure: place in the sweep, names.

    Parameters
    ----------
    sweep : whose rows they are
    values : (n,) of the measure in all rows
    measure : by which they are sorted
    count : at most so many of a controller

    """
    found = []
    for i, controller in enumerate(sweep.controllers):
        rows = np.flatnonzero((sweep.controller == i) & (sweep.status == 0) & np.isfinite(values))
        order = rows[np.argsort(values[rows], kind='stable')[:count]]
        for rank, row in enumerate(order, start=1):
            found.append((int(row), {'by': measure.name, 'controller': controller, 'rank': rank}))
    return found


def with_values(
    sweep: Sweep, found: Sequence[tuple[int, Row]], figures: Mapping[str, np.ndarray]
) -> list[Row]:
    """The same rows with rollout, seed, varied values and all measures.

    Parameters
    ----------
    sweep : whose rows they are
    found : of `smallest`
    figures : measure -> (n,)

    """
    places = [row for row, _ in found]
    table = sweep.table(['index', 'seed', *sweep.paths]).take(places)
    rows = []
    for (place, names), given in zip(found, table.to_pylist(), strict=True):
        row = {**names, 'rollout': given.pop('index'), **given}
        for measure in MEASURES:
            value = figures[measure.name][place]
            row[measure.name] = float(value) if np.isfinite(value) else None
        rows.append(row)
    return rows
