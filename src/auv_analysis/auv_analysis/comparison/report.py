"""The report of a comparison: what differs, one table with a row per run, six figures each."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa

from auv_analysis.comparison.entries import CSV, TABLE, Entry
from auv_analysis.comparison.figures import SIX
from auv_analysis.comparison.findings import findings
from auv_analysis.comparison.ranking import Ranking
from auv_analysis.measures import FAMILIES, MEASURES, described
from auv_analysis.report.document import Cell, Column, Section, Table, cell
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.grids import ALWAYS
from auv_analysis.report.rendering import write_document
from auv_analysis.report.text import join
from auv_dynamics.signals import DOFS

NAMED = {  # column of words -> head, meaning
    'scenario': 'what is asked of the vehicle, and what disturbs it',
    'vehicle': 'what the controller knows of the vehicle',
    'controller': 'name of the controller in its scenario',
    'law': 'control law',
}
PLAIN = {  # column of numbers -> unit, meaning
    'duration': ('s', 'length of the run'),
    'step': ('s', 'control period'),
}
SHARES = 'kinetic_energy.shares_percent'
TABLES = {  # section -> families of its tables and figures
    'errors': ('Errors', ('rms_errors', 'late_errors', 'settling_times')),
    'couplings': ('Couplings', ('delta_xi', 'delta_pi')),
    'inputs': ('Inputs', ('rms_inputs', 'peak_inputs')),
}


def write_comparison(
    out: Path,
    entries: Sequence[Entry],
    table: pa.Table,
    ranking: Ranking,
    figures: Mapping[str, FigureRecord],
) -> Path:
    """Write report.html of a comparison; returns its path.

    Parameters
    ----------
    out : folder, existing
    entries, table, ranking, figures : of the same runs

    """
    rows = table.to_pylist()
    sections = [
        Section('overview', 'All runs', [overview(rows), figures['ranking'], figures['errors']]),
        Section('energy', 'Kinetic energy', [_six_table(rows, SHARES), figures['kinetic_energy']]),
    ]
    for name, (title, members) in TABLES.items():
        blocks = [block for m in members for block in (_six_table(rows, SIX[m][0]), figures[m])]
        sections.append(Section(name, title, blocks))
    about = (
        f'{len(entries)} runs of {_counted(entries, "scenario")} on '
        f'{_counted(entries, "vehicle")}. '
        f'Every figure of every run: {TABLE} and {CSV}.'
    )
    title = f'Comparison of {len(entries)} runs'
    return write_document(out, title, about, findings(entries, rows, ranking), sections)


def _counted(entries: Sequence[Entry], name: str) -> str:
    """'3 scenarios', or the only one by its name."""
    found = list(dict.fromkeys(getattr(entry, name) for entry in entries))
    return f'{name} {found[0]}' if len(found) == 1 else f'{len(found)} {name}s'


def overview(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The table with a row per run: who it is, and every measure that sums it up."""
    columns = [Column('run', numeric=False)]
    columns += [Column(name, meaning=text, numeric=False) for name, text in NAMED.items()]
    columns += [Column(name, unit, text) for name, (unit, text) in PLAIN.items()]
    columns += [Column(m.label, m.unit, m.meaning) for m in MEASURES]
    columns += [_column(f'{SHARES}.{dof}', dof, 'share of kinetic energy') for dof in DOFS]
    numbers = [*PLAIN, *(m.name for m in MEASURES), *(f'{SHARES}.{dof}' for dof in DOFS)]
    body = []
    for i, row in enumerate(rows):
        words = [Cell(row[name]) for name in NAMED]
        body.append([_head(row), *words, *(_cell(row, name, i) for name in numbers)])
    caption = 'All runs. Click on a head to sort by it.'
    failed = [row['run'] for row in rows if row['failure']]
    note = f'Failed, without figures: {join(failed)}.' if failed else ''
    return Table('runs', caption, columns, body, note=note)


def _six_table(rows: Sequence[Mapping[str, Any]], family: str) -> Table:
    columns = [Column('run', numeric=False)]
    columns += [_column(f'{family}.{dof}', dof) for dof in DOFS]
    body = [
        [_head(row), *(_cell(row, f'{family}.{dof}', i) for dof in DOFS)]
        for i, row in enumerate(rows)
    ]
    meaning = FAMILIES[family].meaning
    return Table(family.replace('.', '_'), f'{meaning[0].upper()}{meaning[1:]}.', columns, body)


def _head(row: Mapping[str, Any]) -> Cell:
    return Cell(row['run'], remark='failed' if row['failure'] else '')


def _column(name: str, label: str, group: str = '') -> Column:
    _, unit, meaning = described(name)
    return Column(label, unit, meaning, group=group)


def _cell(row: Mapping[str, Any], name: str, index: int) -> Cell:
    family, _, dof = name.rpartition('.')
    kind = family.removeprefix('coupling.').removesuffix('_max')
    if dof in (row.get(f'coupling.structural_zeros.{kind}') or '').split('; '):
        return Cell(ALWAYS, 0.0, f'{TABLE}:{name}[{index}]', 'zero')
    return cell(row.get(name), f'{TABLE}:{name}[{index}]')
