"""CSV logs as messages: a file with named columns is a topic, a line a message."""

import contextlib
import csv
import math
import os
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain, islice, repeat
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.bag.limits import MOST_NAMED
from auv_analysis.bag.metadata import TABLES
from auv_analysis.bag.reading import BagContents
from auv_dynamics.files.errors import InputError, refusing

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


def blocks_of_csv(
    path: Path, topics: Collection[str], notes: list[str]
) -> Iterator[tuple[str, 'Block']]:
    """Topic and lines of some files, many at once."""
    for topic, file in csv_files(path).items():
        if topic in topics:
            with Table(file) as table:
                for block in table.blocks(notes):
                    yield topic, block


class Span(NamedTuple):
    """Number of values in a column, the least and the largest."""

    filled: int
    low: float
    high: float


def column_spans(table: 'Table', notes: list[str]) -> dict[str, Span]:
    """Column -> its numbers; columns of text are left out."""
    spans = dict.fromkeys(table.columns, Span(0, np.inf, -np.inf))
    for block in table.blocks(notes):
        for name, span in list(spans.items()):
            try:
                values = block.column(name)
            except InputError:
                del spans[name]
                continue
            known = values[np.isfinite(values)]
            if len(known):
                low, high = min(span.low, known.min()), max(span.high, known.max())
                spans[name] = Span(span.filled + len(known), float(low), float(high))
    return {name: span for name, span in spans.items() if span.filled}


class Table(contextlib.AbstractContextManager['Table']):
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
        self.places: dict[str, int] = {}  # column -> its place in a line
        self._number = 0  # of the line that was read
        self._first: list[str] = []  # line of numbers that was read with the head
        with refusing(file, '', 'a CSV file'):
            with file.open('rb') as stream:
                is_wide = stream.read(2) in (BOM_UTF16_LE, BOM_UTF16_BE)  # as Windows writes it
            encoding = 'utf-16' if is_wide else 'utf-8-sig'
            self._stream = file.open(encoding=encoding, errors='replace', newline='')
        try:
            self._read_head()
        except BaseException:
            self._stream.close()
            raise

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
        self.places = {name: i for i, name in enumerate(cells)}
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
        cells = self._cells(self._reader([line]), [self._number])
        return [cell.strip() for cell in next(cells, [])]

    def blocks(self, notes: list[str]) -> Iterator['Block']:
        """Lines that are no comments, many at once.

        Parameters
        ----------
        notes : gets a line where the last line is cut off

        Raises
        ------
        InputError : a line has another number of cells than there are names

        """
        lines = self.data()
        while True:
            found = [(self._number, line) for line in islice(lines, TOGETHER)]
            if not found:
                return
            numbers, texts = (list(part) for part in zip(*found, strict=True))
            cells = self._numbers_alone(texts)
            if cells is None:
                numbers, parsed = self._parsed(numbers, texts, notes)
                if numbers:
                    yield Block(self, numbers, parsed)
            else:
                yield Block(self, numbers, cells)

    def _numbers_alone(self, texts: list[str]) -> np.ndarray | None:
        """Numbers (n, k) of lines; None where a cell is none, or a line has others."""
        try:
            values = np.loadtxt(texts, delimiter=self._separator, comments=None, ndmin=2)
        except ValueError:  # empty cells, texts, decimals with a comma
            return None
        return values if values.shape[1] == len(self.columns) else None

    def _parsed(
        self, numbers: list[int], texts: list[str], notes: list[str]
    ) -> tuple[list[int], list[list[str]]]:
        """Numbers and cells of lines that are not numbers alone."""
        width, reader = len(self.columns), self._reader(texts)
        found: list[tuple[int, list[str]]] = []
        for cells in self._cells(reader, numbers):
            line = numbers[reader.line_num - 1]
            if len(cells) == width + 1 and not cells[-1]:
                cells.pop()
            if len(cells) != width:
                if not texts[-1].endswith(('\n', '\r')) and line == numbers[-1]:
                    notes.append(f'{self.file.name}: its last line is cut off, and left out')
                    break
                expected = f'{width} cells, one per column'
                raise InputError(self.file, f'line {line}', expected, str(len(cells)))
            found.append((line, cells))
        return [line for line, _ in found], [cells for _, cells in found]

    def _reader(self, lines: Iterable[str]) -> Any:
        return csv.reader(lines, delimiter=self._separator, skipinitialspace=True)

    def _cells(self, reader: Any, numbers: Sequence[int]) -> Iterator[list[str]]:
        """Cells of lines; InputError, which names the line, where they are none."""
        try:
            yield from reader
        except csv.Error as error:
            where = f'line {numbers[reader.line_num - 1]}'
            raise InputError(self.file, where, 'cells', str(error)) from None

    def data(self) -> Iterator[str]:
        """Lines that are no comments, from the first with numbers."""
        for line in chain(self._first, self.lines()):
            if not _is_comment(line):
                yield line

    def number(self, cell: str) -> float:
        """Number in a cell, NaN where it has no value; ValueError: a text."""
        try:
            return float(cell)
        except ValueError:
            if cell.strip().lower() in NOTHING:
                return np.nan
            if self._separator == ';':  # beside which decimals may have a comma
                return float(cell.replace(',', '.'))
            raise

    def is_number(self, cell: str) -> bool:
        """Whether a cell has a number."""
        with contextlib.suppress(ValueError):
            return not math.isnan(self.number(cell))
        return False


class Block:
    """Lines of a table.

    Parameters
    ----------
    table : whose
    lines : number of each line in the file
    cells : (n, k) numbers, or the texts of the cells of each line

    """

    def __init__(self, table: Table, lines: list[int], cells: np.ndarray | list[list[str]]):
        self.table, self.lines, self._cells = table, lines, cells
        self._columns: dict[str, np.ndarray] = {}

    def column(self, name: str) -> np.ndarray:
        """Numbers (n,); AttributeError without such a column, InputError of a text."""
        if name in self._columns:
            return self._columns[name]
        place = self.table.places.get(name)
        if place is None:
            raise AttributeError(name)
        if isinstance(self._cells, np.ndarray):
            found = self._cells[:, place]
        else:
            texts = [cells[place] for cells in self._cells]
            try:
                found = np.array(texts, float)
            except ValueError:  # an empty one among them
                found = np.array([*map(self._number, texts, self.lines, repeat(name))])
        self._columns[name] = found
        return found

    def _number(self, text: str, line: int, name: str) -> float:
        try:
            return self.table.number(text)
        except ValueError:
            where = f'line {line}, column {name}'
            raise InputError(self.table.file, where, 'a number, or nothing', text) from None

    def first(self) -> SimpleNamespace:
        """The first line as a message whose fields are the columns of numbers."""
        found: dict[str, Any] = {}
        for name, cell in zip(self.table.columns, self._cells[0], strict=True):
            with contextlib.suppress(ValueError):
                found[name] = self.table.number(cell)
        return SimpleNamespace(**found | {'header': None, 'child_frame_id': ''})


def _is_comment(line: str) -> bool:
    """Whether there are no cells in a line."""
    text = line.lstrip()
    return not text or text.startswith(COMMENTS)
