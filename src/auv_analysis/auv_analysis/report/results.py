"""Results: named Arrow tables, written once; terminal, HTML and CSV are views of them.

A study fills `Results` from rows or columns of numbers and says by `Column` what each column is.
Nothing else is typed: texts, heads, units, and the pointer from a shown cell to the stored number
follow from the table.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any, Literal, TypeAlias, cast

from pyarrow import parquet
from rich import table as rich_table
from rich.text import Text

from auv_analysis.metrics.quantities import Quantity
from auv_analysis.output.arrow import pa
from auv_analysis.output.new_files import known, write_json
from auv_analysis.output.text import MISSING, Maths, fixed, number, plain

Rows: TypeAlias = Sequence[Mapping[str, Any]] | Mapping[str, Sequence[Any]] | pa.Table
Pointer = Callable[[int, str], str]
Look = Literal['', 'maths', 'badge', 'below', 'plain']
KINDS = {'good': 'green', 'bad': 'red', 'zero': 'dim'}  # of a cell, and its look in a terminal


@dataclass(frozen=True)
class Column:
    """Contents of a column, and the display of its cells.

    Attributes
    ----------
    of : its quantity, or a bare label where it has none
    group : columns with the same one stand under a common head
    digits : significant digits
    decimals : decimals in place of significant digits
    scale : 100 where a stored ratio is shown in %
    look : of words: 'maths', ours, whose symbols are set; 'badge', a verdict; 'below', smaller,
        in the cell of the column before; of numbers: 'plain', without trailing zeros
    kind : name of the column that says of each row whether the cell is 'good', 'bad' or 'zero'
    numeric : whether it holds numbers, which its table sees

    """

    of: Quantity | str
    group: str = ''
    digits: int = 3
    decimals: int | None = None
    scale: float = 1.0
    look: Look = ''
    kind: str = ''
    numeric: bool = False

    @property
    def quantity(self) -> Quantity:
        """Its quantity; of a bare label one without symbol and unit."""
        return self.of if isinstance(self.of, Quantity) else Quantity('', '', self.of)

    @property
    def label(self) -> str:
        """Head of the column."""
        return self.quantity.label

    @property
    def unit(self) -> str:
        """Unit of the numbers shown."""
        return '%' if self.scale == 100.0 else self.quantity.unit

    @property
    def meaning(self) -> str:
        """One line for a reader without the paper."""
        return self.quantity.meaning


Shown = Column | Quantity | str  # what a column of a table is


@dataclass(frozen=True)
class Cell:
    """A cell as it is shown.

    Attributes
    ----------
    text : rounded
    value : the number behind the text, in the unit of its column; None where there is none
    source : where that number is stored: 'draws.parquet:effort[3]' or
        'summary.json:/gvc/effort/rms/0'; '*100' behind it where it is shown in %
    kind : of its look: 'zero', 'good', 'bad', 'badge'
    remark : below the text, smaller
    anchor : of a row's first cell: that of the row

    """

    text: str
    value: float | None = None
    source: str = ''
    kind: str = ''
    remark: str = ''
    anchor: str = ''


@dataclass(frozen=True, eq=False)
class Table:
    """A named table of results.

    Attributes
    ----------
    name : of its file, its anchor on a page and its key in JSON
    caption : what it shows, a sentence
    data : the numbers, null where one is not known
    shown : column of `data` -> how it is shown; others are stored and not shown
    note : below the table
    stub : number of leading columns that name a row
    file : Parquet file that holds `data`; '' where it has none of its own
    pointer : row and column of `data` -> where the number is stored, for a table that is a view of
        a JSON document; default: the cell of `file`
    anchor : anchor of a row: this word, a hyphen and the text of its first cell
    folded : whether a page shows its caption first, and the rest when asked for

    """

    name: str
    caption: str
    data: pa.Table
    shown: Mapping[str, Column]
    note: str = ''
    stub: int = 1
    file: str = ''
    pointer: Pointer | None = None
    anchor: str = ''
    folded: bool = False

    def __post_init__(self) -> None:
        """See which columns hold numbers."""
        kinds = {name: self.data.schema.field(name).type for name in self.shown}
        numeric = {n: pa.types.is_integer(k) or pa.types.is_floating(k) for n, k in kinds.items()}
        shown = {name: replace(c, numeric=numeric[name]) for name, c in self.shown.items()}
        object.__setattr__(self, 'shown', shown)

    @cached_property
    def columns(self) -> list[Column]:
        """Shown columns that have a head."""
        return [column for column in self.shown.values() if column.look != 'below']

    @property
    def heads(self) -> list[tuple[str, int]]:
        """Common heads of columns, and how many columns each is above."""
        runs = groupby(self.columns, key=lambda column: column.group)
        return [(group, len(list(columns))) for group, columns in runs]

    @property
    def meanings(self) -> list[Column]:
        """Columns whose meaning is said below the table."""
        return [column for column in self.columns if column.meaning]

    @cached_property
    def rows(self) -> list[list[Cell]]:
        """Shown cells, row by row."""
        columns = {name: self.data[name].to_pylist() for name in self.data.column_names}
        return [self._row(i, columns) for i in range(self.data.num_rows)]

    def _row(self, i: int, columns: Mapping[str, Sequence[Any]]) -> list[Cell]:
        found: list[Cell] = []
        for name, column in self.shown.items():
            kind = columns[column.kind][i] or '' if column.kind else ''
            made = self._cell(i, name, column, columns[name][i], kind)
            if column.look == 'below':
                found[-1] = replace(found[-1], remark=made.text)
            else:
                found.append(made)
        if self.anchor and found:
            found[0] = replace(found[0], anchor=f'{self.anchor}-{found[0].text}')
        return found

    def _cell(self, i: int, name: str, column: Column, value: Any, kind: str) -> Cell:
        if value is None:
            return Cell(MISSING)
        if not column.numeric:
            text = spelled(value)
            text = Maths(text) if column.look in ('maths', 'below') else text
            return Cell(text, kind='badge' if column.look == 'badge' else kind)
        value = value if column.scale == 1.0 else value * column.scale
        if column.decimals is not None:
            text = fixed(value, column.decimals)
        elif column.look == 'plain':
            text = plain(value, max(column.digits, 4))
        else:
            text = fixed(value, 0) if isinstance(value, int) else number(value, column.digits)
        return Cell(text, value, self.source(i, name), kind or ('zero' if value == 0 else ''))

    def source(self, row: int, column: str) -> str:
        """Where a number of `data` is stored."""
        default = f'{self.file}:{column}[{row}]' if self.file else ''
        where = self.pointer(row, column) if self.pointer else default
        scale = self.shown[column].scale
        return f'{where}*{scale:g}' if where and scale != 1.0 else where

    def records(self) -> list[dict[str, Any]]:
        """Rows as JSON has them."""
        return cast(list[dict[str, Any]], self.data.to_pylist())


def make_table(
    name: str,
    caption: str,
    rows: Rows,
    shown: Mapping[str, Shown],
    **about: Any,
) -> Table:
    """Table from rows or columns of numbers and words.

    Parameters
    ----------
    name, caption : as of `Table`
    rows : mappings, one per row; or column -> values; or an Arrow table; NaN and None are unknown
    shown : column -> what it is
    about : note, stub, file, pointer, anchor, folded of `Table`

    """
    looks = {n: c if isinstance(c, Column) else Column(c) for n, c in shown.items()}
    data = rows if isinstance(rows, pa.Table) else _arrow(rows, list(looks))
    for i, entry in enumerate(data.schema):
        if entry.name in looks:
            data = data.set_column(i, _described(entry, looks[entry.name].quantity), data[i])
    return Table(name, caption, data.replace_schema_metadata({'title': caption}), looks, **about)


def _arrow(rows: Sequence[Mapping[str, Any]] | Mapping[str, Sequence[Any]], order: Any) -> pa.Table:
    if isinstance(rows, Mapping):
        columns = rows
    else:
        names = dict.fromkeys([*order, *(name for row in rows for name in row)])
        columns = {name: [row.get(name) for row in rows] for name in names}
    return pa.table({name: array_of(values) for name, values in columns.items()})


def array_of(values: Sequence[Any]) -> pa.Array:
    """Arrow array of values of one kind; None and NaN become null."""
    found = pa.array(values, from_pandas=True)
    return found.cast(pa.float64()) if pa.types.is_null(found.type) else found


def _described(entry: pa.Field, what: Quantity) -> pa.Field:
    about = {key: getattr(what, key) for key in ('symbol', 'unit', 'label', 'equation', 'meaning')}
    return entry.with_metadata({key: str(value) for key, value in about.items() if value})


def spelled(value: Any) -> str:
    """Words of a cell that is no number."""
    if isinstance(value, bool):
        return 'yes' if value else 'no'
    if isinstance(value, list):
        return ', '.join(map(spelled, value))
    return number(value) if isinstance(value, int | float) else str(value)


@dataclass
class Results:
    """Findings of a command or a study.

    Attributes
    ----------
    name : of the JSON document, without ending
    facts : its keys
    tables : name -> table

    """

    name: str
    facts: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, Table] = field(default_factory=dict)

    def add(
        self, name: str, caption: str, rows: Rows, shown: Mapping[str, Shown], **about: Any
    ) -> Table:
        """Add a table, see `make_table`, with a Parquet file of its name."""
        self.tables[name] = make_table(name, caption, rows, shown, file=f'{name}.parquet', **about)
        return self.tables[name]

    @property
    def file(self) -> str:
        """Name of the JSON document."""
        return f'{self.name}.json'

    def to_json(self) -> dict[str, Any]:
        """The JSON document."""
        return known(self.facts)

    def write(self, folder: Path) -> list[Path]:
        """Write one Parquet file per table and the JSON document; their paths."""
        paths = [folder / self.file]
        write_json(paths[0], self.to_json())
        for table in self.tables.values():
            paths.append(folder / table.file)
            parquet.write_table(table.data, paths[-1])
        return paths


def numbers_of(tables: Iterable[Any]) -> Iterator[dict[str, Any]]:
    """Every number that some tables show: table, row, column, text, value, unit, source."""
    for table in tables:
        heads = table.columns
        for row in table.rows:
            words = ', '.join(entry.text for entry in row[: table.stub] if entry.text)
            for head, entry in zip(heads, row, strict=True):
                where = {
                    'table': table.name,
                    'row': words,
                    'column': ' '.join(filter(None, [head.group, head.label])),
                }
                about = {'text': entry.text, 'unit': head.unit, 'source': entry.source}
                if entry.value is not None:
                    yield {**where, 'value': float(entry.value), **about}


def terminal(table: Table, *, title: bool = False) -> rich_table.Table:
    """A table for a terminal: heads with units, numbers to the right.

    Parameters
    ----------
    table : whose cells are shown
    title : whether its caption stands above

    """
    shown = rich_table.Table(
        title=table.caption if title else None, title_justify='left', box=None,
        header_style='bold', pad_edge=False,
    )  # fmt: skip
    for i, head in enumerate(table.columns):
        label = ' '.join(filter(None, [head.group, head.label]))
        label = f'{label}, {head.unit}' if head.unit else label
        side: Literal['left', 'right'] = 'right' if head.numeric else 'left'
        shown.add_column(label, justify=side, overflow='fold', no_wrap=head.numeric and i > 0)
    for row in table.rows:
        shown.add_row(*(Text(cell.text, KINDS.get(cell.kind, '')) for cell in row))
    return shown


def view_of_file(
    name: str,
    caption: str,
    numbered: Iterable[tuple[int, Mapping[str, Any]]],
    shown: Mapping[str, Shown],
    file: str = '',
    **about: Any,
) -> Table:
    """Table of some rows of a Parquet file, each behind its place there; default: of its name."""
    places, rows = zip(*numbered, strict=True)
    where = file or f'{name}.parquet'
    pointer = lambda row, column: f'{where}:{column}[{places[row]}]'  # noqa: E731
    return make_table(name, caption, rows, shown, pointer=pointer, **about)


def json_pointer(*keys: object, file: str = 'summary.json') -> str:
    """Where a number stands in a JSON file: a JSON pointer behind the file's name."""
    parts = (str(key).replace('~', '~0').replace('/', '~1') for key in keys)
    return f'{file}:/{"/".join(parts)}'


def document_table(
    results: Results,
    name: str,
    caption: str,
    rows: Sequence[Mapping[str, Any]],
    shown: Mapping[str, Shown],
    **about: Any,
) -> Table:
    """Table of values of the document of some results, and of words.

    Parameters
    ----------
    results : whose facts are the document
    name, caption : as of `Table`
    rows : column -> keys of a value in the document, a tuple, or a word that is shown as it stands
    shown : column -> what it is
    about : note, stub and anchor of `Table`

    """
    facts = results.facts
    data = [{column: _value(facts, row.get(column)) for column in {**shown, **row}} for row in rows]

    def pointer(i: int, column: str) -> str:
        entry = rows[i].get(column)
        if not isinstance(entry, tuple):
            return ''
        return json_pointer(*entry, file=results.file)

    return make_table(name, caption, data, shown, pointer=pointer, **about)


def _value(document: Mapping[str, Any], entry: Any) -> Any:
    """Value at some keys; None where one of them leads nowhere."""
    if not isinstance(entry, tuple):
        return entry
    value: Any = document
    for key in entry:
        if value is None:
            return None
        value = value.get(key) if isinstance(value, Mapping) else value[key]
    return value


def described(label: str, meaning: str = '', unit: str = '', **look: Any) -> Column:
    """Column of what is no quantity of the registry: head, one line of meaning, unit, look."""
    return Column(Quantity('', unit, label, '', meaning), **look)
