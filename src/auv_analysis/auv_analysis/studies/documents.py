"""Tables that are views of a study's JSON document: each number is shown from where it stands."""

from collections.abc import Mapping, Sequence
from typing import Any

from auv_analysis.metrics.quantities import Quantity
from auv_analysis.report.results import Column, Results, Table, make_table

Shown = Column | Quantity | str  # what a column of a table is
Keys = tuple[str | int, ...]  # of a value in a document: a JSON pointer before it is spelled


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
    rows : column -> `Keys` of a value in the document, or a word that is shown as it stands
    shown : column -> what it is
    about : note, stub and anchor of `Table`

    """
    data = [{column: _value(results.facts, entry) for column, entry in row.items()} for row in rows]

    def pointer(i: int, column: str) -> str:
        entry = rows[i].get(column)
        if not isinstance(entry, tuple):
            return ''
        parts = (str(key).replace('~', '~0').replace('/', '~1') for key in entry)
        return f'{results.file}:/{"/".join(parts)}'

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


def labelled(label: str, meaning: str = '', unit: str = '') -> Quantity:
    """Quantity of a column that no registry has: head, one line of meaning, unit."""
    return Quantity('', unit, label, '', meaning)
