"""CSV files with named columns as messages of topics: a file is a topic, a line a message."""

import csv
import math
import os
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.bag.limits import MOST_NAMED
from auv_analysis.bag.metadata import TABLES
from auv_analysis.bag.reading import BagContents
from auv_dynamics.files.errors import InputError, reason

CSV = 'csv'  # message type
SEPARATORS = ',;\t'
COMMENTS = ('#', '%', '//')
LONGEST = 1 << 20  # characters of a line
TOGETHER = 8192  # lines
NOTHING = ('', '-', 'na', 'n/a', 'nan', 'null', 'none')  # cells without a value, in any case


def csv_files(path: Path) -> dict[str, Path]:
    """Topic -> its file; InputError where two have one name."""
    if not os.path.isdir(path):
        return {path.stem: path}
    found: dict[str, Path] = {}
    for file in sorted(path.iterdir()):
        if file.suffix.lower() in TABLES and file.is_file():
            if file.stem in found:
                raise InputError(path, file.stem, 'one CSV file of each name', file.name)
            found[file.stem] = file
    return found


def survey_of_csv(path: Path) -> BagContents:
    """Topics and numbers of lines; there is no time of logging."""
    contents = BagContents()
    for topic, file in csv_files(path).items():
        with Table(file) as table:
            contents.types[topic] = CSV
            contents.counts[topic] = sum(1 for _ in table.data())
    return contents


def rows_of_csv(
    path: Path, topics: Collection[str], notes: list[str]
) -> Iterator[tuple[str, int, 'Row']]:
    """Topic, 0 in the place of a time of logging, and message of every line of some files."""
    for topic, file in csv_files(path).items():
        if topic in topics:
            with Table(file) as table:
                for line, cells in table.rows(notes):
                    yield topic, 0, Row(table, line, cells)


class Span(NamedTuple):
    """How many numbers a column has, and the least and the largest."""

    filled: int
    low: float
    high: float


def column_spans(file: Path, notes: list[str]) -> dict[str, Span]:
    """Column -> its numbers; columns of text are left out."""
    with Table(file) as table:
        spans = dict.fromkeys(table.columns, Span(0, np.inf, -np.inf))
        waiting: list[list[str]] = []
        for _, cells in table.rows(notes):
            waiting.append(cells)
            if len(waiting) == TOGETHER:
                _widen(spans, table, waiting)
        _widen(spans, table, waiting)
    return {name: span for name, span in spans.items() if span.filled}


def _widen(spans: dict[str, Span], table: 'Table', waiting: list[list[str]]) -> None:
    """Take lines into the spans; columns with a text are given up."""
    for name, column in zip(table.columns, zip(*waiting, strict=True), strict=False):
        if name not in spans:
            continue
        try:
            values = table.numbers(column)
        except ValueError:
            del spans[name]
            continue
        known = values[np.isfinite(values)]
        if len(known):
            count, low, high = spans[name]
            low, high = min(low, float(known.min())), max(high, float(known.max()))
            spans[name] = Span(count + len(known), low, high)
    waiting.clear()


class Table:
    """A CSV file whose head is read: separator, names of the columns, and their units if told.

    Parameters
    ----------
    file : separated by commas, semicolons or tabs; the names stand in the first line that is no
        comment, or in the comment just before lines of numbers; a line of units may follow

    Raises
    ------
    InputError : no names, or no text

    """

    def __init__(self, file: Path):
        self.file = file
        self.columns: tuple[str, ...] = ()
        self.units: dict[str, str] = {}
        self._number = 0  # of the line that was read
        self._first: list[str] = []  # line of numbers that was read with the head
        self._is_whole = True  # whether the line that was read has an end
        try:
            self._stream = file.open(encoding='utf-8-sig', errors='replace', newline='')
        except OSError as error:
            raise InputError(file, '', 'a CSV file', reason(error)) from None
        try:
            self._read_head()
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> 'Table':
        """Nothing to do."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._stream.close()

    def _read_head(self) -> None:
        comment = ''
        line = next(self.lines(), '')
        while line and _is_comment(line):
            comment = line if line.strip() else comment
            line = next(self.lines(), '')
        self._separator = max(SEPARATORS, key=line.count)
        cells = self._split(line)
        if cells and all(self.is_number(cell) for cell in cells):
            self._first = [line]
            text = comment.strip().lstrip('#%/')
            cells = self._split(text)
            if len(cells) != len(self._split(line)):
                cells = []
        if cells and not cells[-1]:
            cells.pop()  # lines that end with a separator
        self._check_names(cells, line)
        self.columns = tuple(cells)
        self._places = {name: i for i, name in enumerate(cells)}
        if not self._first:
            self._first = [line for line in [next(self.lines(), '')] if line]
            told = self._split(self._first[0])[: len(cells)] if self._first else []
            if any(told) and not any(map(self.is_number, told)):
                told = [text.strip('[]() ') for text in told]
                self.units = dict(zip(cells, told, strict=False))
                self._first = []

    def _check_names(self, cells: Sequence[str], line: str) -> None:
        expected = 'a line with the names of the columns before the numbers'
        if not cells or not all(cells):
            raise InputError(self.file, f'line {self._number}', expected, line.strip() or 'none')
        if len(cells) > MOST_NAMED:
            raise InputError(self.file, '', f'at most {MOST_NAMED} columns', str(len(cells)))
        twice = [name for i, name in enumerate(cells) if name in cells[:i]]
        if twice:
            raise InputError(self.file, f'line {self._number}', 'each name once', twice[0])

    def lines(self) -> Iterator[str]:
        """Lines that follow, with their ends."""
        while line := self._stream.readline(LONGEST + 1):
            self._number += 1
            if len(line) > LONGEST:
                expected = f'at most {LONGEST} characters'
                raise InputError(self.file, f'line {self._number}', expected, 'more')
            yield line

    def _split(self, line: str) -> list[str]:
        return [cell.strip() for cell in next(self._cells([line]), [])]

    def rows(self, notes: list[str]) -> Iterator[tuple[int, list[str]]]:
        """Number and cells of every line that is no comment.

        Parameters
        ----------
        notes : gets a line where the last line is cut off

        Raises
        ------
        InputError : a line has another number of cells than there are names

        """
        width = len(self.columns)
        for cells in self._cells(self.data()):
            if len(cells) == width + 1 and not cells[-1]:
                cells.pop()
            if len(cells) != width:
                if not self._is_whole:
                    notes.append(f'{self.file.name}: its last line is cut off, and left out')
                    return
                expected = f'{width} cells, one per column'
                raise InputError(self.file, f'line {self._number}', expected, str(len(cells)))
            yield self._number, cells

    def _cells(self, lines: Iterable[str]) -> Iterator[list[str]]:
        cells = csv.reader(lines, delimiter=self._separator, skipinitialspace=True)
        try:
            yield from cells
        except csv.Error as error:
            raise InputError(self.file, f'line {self._number}', 'cells', str(error)) from None

    def data(self) -> Iterator[str]:
        """Lines that are no comments, from the first with numbers."""
        for line in chain(self._first, self.lines()):
            if not _is_comment(line):
                self._is_whole = line.endswith(('\n', '\r'))
                yield line

    def number(self, cell: str) -> float:
        """Number in a cell, NaN where it has no value; ValueError: a text."""
        try:
            return float(cell)
        except ValueError:
            if _is_nothing(cell):
                return np.nan
            if self._separator == ';':  # beside which decimals may have a comma
                return float(cell.replace(',', '.'))
            raise

    def numbers(self, cells: Sequence[str]) -> np.ndarray:
        """Numbers (n,) of cells as `number` reads them."""
        try:
            return np.array(cells, float)
        except ValueError:  # an empty one among them
            return np.array([self.number(cell) for cell in cells])

    def is_number(self, cell: str) -> bool:
        """Whether a cell has a number."""
        try:
            return not math.isnan(self.number(cell))
        except ValueError:
            return False

    def value(self, line: int, cells: Sequence[str], name: str) -> float:
        """Number of a column in a line; AttributeError without the column, InputError of a text."""
        place = self._places.get(name)
        if place is None:
            raise AttributeError(name)
        try:
            return self.number(cells[place])
        except ValueError:
            where = f'line {line}, column {name}'
            raise InputError(self.file, where, 'a number, or nothing', cells[place]) from None


class Row:
    """A line as a message whose fields are the columns, read when they are asked for."""

    __slots__ = ('_cells', '_line', '_table')
    header, child_frame_id = None, ''

    def __init__(self, table: Table, line: int, cells: Sequence[str]):
        self._table, self._line, self._cells = table, line, cells

    def __getattr__(self, name: str) -> float:
        """Return the number of a column."""
        return self._table.value(self._line, self._cells, name)

    @property
    def __dict__(self) -> dict[str, Any]:  # type: ignore[override]
        pairs = zip(self._table.columns, self._cells, strict=True)
        return {name: self._table.number(cell) for name, cell in pairs
                if _is_nothing(cell) or self._table.is_number(cell)}  # fmt: skip


def _is_nothing(cell: str) -> bool:
    return cell.strip().lower() in NOTHING


def _is_comment(line: str) -> bool:
    """Whether there are no cells in a line."""
    text = line.lstrip()
    return not text or text.startswith(COMMENTS)
