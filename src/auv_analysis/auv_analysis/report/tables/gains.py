"""Step 1 of the paper's procedure: the decomposition, and the gains that it amounts to."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from auv_analysis.output.text import join, plain
from auv_analysis.report import paper
from auv_analysis.report.document import Cell, Column, Table, cell
from auv_analysis.report.quantities import Maths
from auv_analysis.report.tables.sources import Summaries, summary_source
from auv_analysis.runs.run import Facts
from auv_dynamics.vehicle import DOFS

ZERO = 'zero (no adaptive term)'
SYMBOLS = {'K_D': 'velocity gain K_D', 'K_f': 'adaptation gain K_f'}
MATRIX = (Column('', numeric=False), *(Column(dof) for dof in DOFS))


def gains_tables(runs: Mapping[str, Facts], summaries: Summaries) -> Iterator[Table]:
    """Upsilon and N of each vehicle that differs, then K_D and K_f that are no multiples of I."""
    vehicles = decompositions(runs, summaries)
    for number, entry in enumerate(vehicles, start=1):
        tail = '' if len(vehicles) == 1 else f'_{number}'
        yield from _of_vehicle(entry, tail, alone=len(vehicles) == 1)
    count = 0
    for entry in body_gains(summaries):
        if entry['text'] is None:
            count += 1
            owner, symbol = entry['controllers'][0], entry['symbol']
            words = f'The {SYMBOLS[symbol]} of {{}} in the body frame.'
            caption = Maths(words, join(entry['controllers']))
            where = owner, 'gains', symbol
            name = f'gain_{symbol}_{count}'
            yield _matrix(name, caption, entry['gain'], where)


def scalar_gains(summaries: Summaries) -> list[dict[str, Any]]:
    """Gains that a sentence says: multiples of I, and zero."""
    return [entry for entry in body_gains(summaries) if entry['text'] is not None]


def _of_vehicle(entry: Mapping[str, Any], tail: str, *, alone: bool) -> Iterator[Table]:
    owner, parts, vehicle = entry['controllers'][0], entry['parts'], entry['vehicle']
    whose = vehicle if alone else f'{vehicle} ({join(entry["controllers"])})'
    where = owner, 'decomposition', 'Upsilon'
    yield _matrix(f'Upsilon{tail}', f'Υ of {whose}, of (4).', parts['Upsilon'], where)
    rows = [
        [Cell('ours')]
        + [
            cell(N, summary_source(owner, 'decomposition', 'N', i), digits=6)
            for i, N in enumerate(parts['N'])
        ]
    ]
    caption = f'Diagonal of N of {whose}, kg and kg m²'
    if vehicle.startswith('herman2018'):
        caption += '; the paper’s from (38)'
        printed = [Cell(f'{N:.1f}', N, 'paper') for N in paper.N]
        rows.append([Cell('paper', kind='paper'), *printed])
    yield Table(f'N{tail}', f'{caption}.', MATRIX, rows)


def _matrix(name: str, caption: str, values: Any, where: tuple[str, ...]) -> Table:
    rows = [
        [Cell(dof)]
        + [
            Cell(plain(x), x, summary_source(*where, i, j), 'zero' if x == 0 else '')
            for j, x in enumerate(row)
        ]
        for i, (dof, row) in enumerate(zip(DOFS, values, strict=True))
    ]
    return Table(name, caption, MATRIX, rows)


def decompositions(runs: Mapping[str, Facts], summaries: Summaries) -> list[dict[str, Any]]:
    """Upsilon and N, once for each vehicle that differs."""
    found: list[dict[str, Any]] = []
    for name, run in runs.items():
        parts = summaries[name]['decomposition']
        same = [entry for entry in found if entry['parts'] == parts]
        if same:
            same[0]['controllers'].append(name)
        else:
            entry = {'parts': parts, 'vehicle': run.vehicle.name, 'controllers': [name]}
            found.append(entry)
    return found


def body_gains(summaries: Summaries) -> list[dict[str, Any]]:
    """K_D and K_f, once for those that share them: the matrix, or text for a multiple of I."""
    rows: list[dict[str, Any]] = []
    for name, summary in summaries.items():
        for symbol in SYMBOLS:
            gain = summary['gains'][symbol]
            same = [row for row in rows if (row['symbol'], row['gain']) == (symbol, gain)]
            if same:
                same[0]['controllers'].append(name)
            elif gain is not None:
                row = {'controllers': [name], 'symbol': symbol, 'gain': gain}
                rows.append(row | {'text': _multiple(np.array(gain))})
    return rows


def _multiple(matrix: np.ndarray) -> str | None:
    """A matrix as a multiple of I in words; None where it is none."""
    if not matrix.any():
        return ZERO
    scalar = np.array_equal(matrix, matrix[0, 0] * np.eye(6))
    return f'{plain(matrix[0, 0], 6)} I' if scalar else None
