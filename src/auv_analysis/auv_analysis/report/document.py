"""What a report consists of: sections of paragraphs, sentences, tables and figures, as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa
from markupsafe import Markup
from pyarrow import parquet

from auv_analysis.output.text import MISSING, number
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.panel import PanelSet

Kind = TypeVar('Kind')
NUMBERS = 'numbers.parquet'  # beside the report: every number that its tables show


@dataclass(frozen=True)
class Cell:
    """One cell of a table.

    Attributes
    ----------
    text : as it is shown
    value : the number behind the text, in the unit of its column; None where there is none
    source : where that number is found: 'summary.json:/gvc/velocity_error/rms/0' (a JSON pointer),
        'sensitivity.parquet:ST', 'scenario.yaml:/duration'; '*100' behind it where it is shown in %
    kind : of its look: 'zero', 'good', 'bad', 'badge'; of a row's first cell that of the row, such
        as 'paper'
    figures : name -> number, of a text with several
    remark : below the text, smaller
    anchor : of a row's first cell: that of the row

    """

    text: str
    value: float | None = None
    source: str = ''
    kind: str = ''
    figures: Mapping[str, float] = field(default_factory=dict)
    remark: str = ''
    anchor: str = ''


@dataclass(frozen=True)
class Column:
    """Head of a column.

    Attributes
    ----------
    label : short, indices with an underscore
    unit : '' where there is none
    meaning : one line for a reader without the paper
    numeric : whether its cells are numbers, set right
    group : columns with the same one stand under a common head

    """

    label: str
    unit: str = ''
    meaning: str = ''
    numeric: bool = True
    group: str = ''


@dataclass(frozen=True)
class Table:
    """A table that a reader can sort and download.

    Attributes
    ----------
    name : its anchor, 'table-' before it, and the name of its CSV file
    caption : what it shows, a sentence
    columns : heads
    rows : cells, as many as there are columns
    stub : number of leading columns that name the row
    note : below the table

    """

    name: str
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    stub: int = 1
    note: str = ''

    def __post_init__(self) -> None:
        """Raise ValueError where a row has another number of cells than there are columns."""
        for row in self.rows:
            if len(row) != len(self.columns):
                expected = f'{len(self.columns)} cells'
                raise ValueError(f'{self.name}: expected {expected}, found {len(row)}')

    @property
    def heads(self) -> list[tuple[str, int]]:
        """Common heads of columns, and how many columns each is above."""
        runs = groupby(self.columns, key=lambda column: column.group)
        return [(group, len(list(columns))) for group, columns in runs]

    @property
    def meanings(self) -> list[Column]:
        """Columns whose meaning is said below the table."""
        return [column for column in self.columns if column.meaning]


@dataclass(frozen=True)
class Sentence:
    """A sentence computed from numbers.

    Attributes
    ----------
    text : of the sentence, with its full stop
    source : anchor of the table, figure or section that carries its numbers

    """

    text: str
    source: str = ''


@dataclass(frozen=True)
class Prose:
    """Paragraphs that are HTML already: those of `prose.html.j2`."""

    html: Markup


@dataclass(frozen=True)
class Gallery:
    """Panels, and the still figures that stand for them on paper and where no script runs."""

    panels: PanelSet
    figures: Sequence[FigureRecord]


Block = str | Prose | Sentence | Table | FigureRecord | Gallery


@dataclass(frozen=True)
class Section:
    """A section: its anchor, its title, and what stands in it."""

    name: str
    title: str
    blocks: Sequence[Block]

    def of(self, kind: type[Kind]) -> Iterator[Kind]:
        """Blocks of one kind, those in galleries too."""
        for block in self.blocks:
            members = block.figures if isinstance(block, Gallery) else (block,)
            yield from (member for member in members if isinstance(member, kind))


def cell(value: float | None, source: str = '', *, digits: int = 3, kind: str = '') -> Cell:
    """Cell of a number with so many significant digits, an en dash for None."""
    if value is None:
        return Cell(MISSING)
    return Cell(number(value, digits), float(value), source, kind or ('zero' if value == 0 else ''))


def percent(share: float | None, source: str, *, digits: int = 3, kind: str = '') -> Cell:
    """Cell of a share, 0 to 1 where `source` has it, in a column whose unit is %."""
    value = None if share is None else 100 * share
    return cell(value, f'{source}*100', digits=digits, kind=kind)


def write_numbers(path: Path, tables: Sequence[Table]) -> None:
    """Write a row for every number that some tables show.

    Parameters
    ----------
    path : of the Parquet file; columns table, row, column, name, text, value, unit, source, where
        name is that of a figure in a cell with several, else ''
    tables : of one report

    """
    rows = [entry for table in tables for entry in _numbers(table)]
    columns = ('table', 'row', 'column', 'name', 'text', 'value', 'unit', 'source')
    types = [pa.float64() if column == 'value' else pa.string() for column in columns]
    values = [pa.array([row[i] for row in rows], kind) for i, kind in enumerate(types)]
    parquet.write_table(pa.table(dict(zip(columns, values, strict=True))), path)


def _numbers(table: Table) -> Iterator[tuple[Any, ...]]:
    for row in table.rows:
        name = ', '.join(entry.text for entry in row[: table.stub])
        for column, entry in zip(table.columns, row, strict=True):
            where = table.name, name, ' '.join(filter(None, [column.group, column.label]))
            if entry.value is not None:
                yield *where, '', entry.text, entry.value, column.unit, entry.source
            for figure, value in entry.figures.items():
                yield *where, figure, entry.text, value, column.unit, entry.source
