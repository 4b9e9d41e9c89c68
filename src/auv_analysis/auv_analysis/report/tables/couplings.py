"""Step 5 of the paper's procedure: how much the degrees of freedom deform each other, and which."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from auv_analysis.metrics.coupling import input_deformation, velocity_deformation
from auv_analysis.output.text import MISSING, plain
from auv_analysis.report.document import Cell, Column, Table, cell
from auv_analysis.report.quantities import Maths
from auv_analysis.report.tables.sources import (
    VELOCITIES,
    VELOCITY,
    WRENCH,
    WRENCHES,
    Summaries,
    summary_source,
)
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.decomposition import inverse_upper

KINDS = {  # symbol, units, signals that it is a linear form of
    'delta_xi': ('Δξ', VELOCITY, list(VELOCITIES)),
    'delta_pi': ('Δπ', WRENCH, [f'τ_{x}' for x in WRENCHES]),
}


def couplings_table(summaries: Summaries, vehicle: str) -> Table:
    """Rows of delta_xi and delta_pi: the rule, and each run's largest magnitude.

    Parameters
    ----------
    summaries : name -> `summarize(run)`
    vehicle : whose rule is shown where there are several, else ''

    """
    caption = 'Couplings: the rule, and the largest magnitude over the run'
    caption += f'; the rule is that of {vehicle}.' if vehicle else '.'
    columns = [
        Column(
            '', meaning=Maths('Δξ_i = ξ_i − ν_i of (33), Δπ_i = π_i − τ_i of (34)'), numeric=False
        ),
        Column('', meaning='degree of freedom that is deformed', numeric=False),
        Column('rule', meaning='what adds to it, by (31) and (32)', numeric=False),
        *(Column(name, meaning=f'largest magnitude in the run {name}') for name in summaries),
        Column('unit', numeric=False),
    ]
    rows = [row for kind in KINDS for row in _rows(kind, summaries)]
    return Table('couplings', caption, columns, rows, stub=2)


def _rows(kind: str, summaries: Summaries) -> Iterator[list[Cell]]:
    symbol, units, signals = KINDS[kind]
    first = next(iter(summaries))
    Upsilon = np.array(summaries[first]['decomposition']['Upsilon'])
    weights = {
        'delta_xi': velocity_deformation(inverse_upper(Upsilon)),
        'delta_pi': input_deformation(Upsilon),
    }[kind]
    zeros = summaries[first]['coupling']['structural_zeros'][kind]
    for i, dof in enumerate(DOFS):
        structural = dof in zeros
        figures = {f'of {DOFS[j]}': abs(float(x)) for j, x in enumerate(weights[i]) if x}
        rule = Cell('structural zero') if structural else Cell(Maths(_linear(weights[i], signals)))
        values = [
            cell(
                summary['coupling'][f'{kind}_max'][i],
                summary_source(name, 'coupling', f'{kind}_max', i),
                kind='zero' if structural else '',
            )
            for name, summary in summaries.items()
        ]
        named = Cell(rule.text, figures=figures, source=summary_source(first, 'coupling_terms'))
        shown = rule if structural else named
        yield [Cell(Maths(f'{symbol}_{i + 1}')), Cell(dof), shown, *values, Cell(units[i // 3])]


def terms_table(name: str, summary: Mapping[str, Any]) -> Table | None:
    """Pieces of (31) and (32) of a run, with their part in what they add to; None without any.

    Parameters
    ----------
    name : of the run
    summary : `summarize(run)`

    """
    rows = []
    for kind, (symbol, units, signals) in KINDS.items():
        for k, term in enumerate(summary['coupling_terms'][kind]):
            i, j = DOFS.index(term['to']), DOFS.index(term['from'])

            def where(key: str, kind: str = kind, k: int = k) -> str:
                return summary_source(name, 'coupling_terms', kind, k, key)

            share = term['share_percent']
            part = Cell(MISSING) if share is None else Cell(_percent(share), share, where(SHARE))
            rows.append([
                Cell(Maths(f'{symbol}_{i + 1}')), Cell(term['to']), Cell(term['from']),
                cell(term['coefficient'], where('coefficient')),
                Cell(Maths(signals[j])),
                cell(term['rms'], where('rms')), cell(term['max'], where('max')),
                Cell(units[i // 3]), part,
            ])  # fmt: skip
    if not rows:
        return None
    caption = f'The pieces that add to the couplings of {name}: which motion or input causes which.'
    return Table('terms', caption, TERMS, rows, stub=3)


SHARE = 'share_percent'
TERMS = (
    Column('', meaning='component that is deformed', numeric=False),
    Column('of', meaning='degree of freedom that is deformed', numeric=False),
    Column('by', meaning='degree of freedom that deforms it', numeric=False),
    Column('coefficient', '', 'entry of Υ⁻¹ in (31), of Υᵀ in (32)'),
    Column('times', meaning='velocity or input that the coefficient multiplies', numeric=False),
    Column('RMS', '', 'root mean square of the piece over the run'),
    Column('max', '', 'largest magnitude of the piece over the run'),
    Column('unit', numeric=False),
    Column(
        'part', '%',
        'part of the mean square of the whole deformation; those of one component add to 100 %, '
        'one is negative where the piece takes away from what the others add',
    ),
)  # fmt: skip


def _percent(value: float) -> str:
    return f'{value:.2f}'.replace('-', '−') if abs(value) >= 0.005 else plain(value, 1)


def _linear(row: np.ndarray, signals: list[str]) -> str:
    """A linear form such as '−0.015 p + 0.075 r'; entries that are rounding are left out."""
    scale = 1e-12 * max(1.0, np.abs(row).max())
    terms = [(value, name) for value, name in zip(row, signals, strict=True) if abs(value) > scale]
    text = ' '.join(f'{"+" if v > 0 else "−"} {plain(abs(v), 3)} {name}' for v, name in terms)
    return (text.removeprefix('+ ') if text[:1] == '+' else text.replace('− ', '−', 1)) or '0'
