"""`sensitivity.parquet`: a row per controller, figure and gain, and one per figure left out."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from auv_analysis.study.effects import Index, Sensitivity, Variable
from auv_analysis.study.figures import Excluded
from auv_analysis.study.parquet import write_table

FILE = 'sensitivity.parquet'
OF_VARIABLE = (
    'value', 'smallest', 'largest', 'spread', 'spread_low', 'spread_high', 'rank', 'rank_low',
    'rank_high',
)  # fmt: skip
OF_INDEX = (
    'elasticity', 'S1', 'S1_conf', 'ST', 'ST_conf', 'mu_star', 'mu_star_conf', 'sigma',
)  # fmt: skip


def write_sensitivities(folder: Path, found: Sequence[Sensitivity]) -> Path:
    """Write the sensitivities of all controllers.

    Columns: controller, law, figure, dof, unit, those of `Variable`, gain, those of `Index`,
    method, count, rollouts, span, span_asked, diverged (at all spans together), seed, and reason:
    why a figure, or all of them, has no indices.

    """
    rows = [row for sensitivity in found for row in _rows(sensitivity)]
    return write_table(folder / FILE, {name: [row[name] for row in rows] for name in rows[0]})


def _rows(of: Sensitivity) -> Iterator[dict[str, Any]]:
    for variable in of.variables:
        for index in variable.indices:
            yield _row(of, variable, index)
    for excluded in of.excluded:
        yield _row(of, excluded=excluded)
    if of.refusal:
        yield _row(of)


def _row(
    of: Sensitivity,
    variable: Variable | None = None,
    index: Index | None = None,
    excluded: Excluded | None = None,
) -> dict[str, Any]:
    figure = variable.figure if variable else excluded.figure if excluded else None
    numbers = {name: getattr(variable, name) if variable else None for name in OF_VARIABLE}
    parts = asdict(index) if index else {}
    return {
        'controller': of.controller,
        'law': of.law,
        'figure': figure.name if figure else '',
        'dof': figure.dof if figure else '',
        'unit': figure.unit if figure else '',
        **{name: None if value is None else float(value) for name, value in numbers.items()},
        'gain': parts.get('gain', ''),
        **{name: parts.get(name) for name in OF_INDEX},
        'method': of.method,
        'count': of.count,
        'rollouts': of.rollouts,
        'span': of.span,
        'span_asked': of.asked,
        'diverged': sum(of.failed.values()),
        'seed': of.seed,
        'reason': excluded.reason if excluded else of.refusal,
    }
