"""What a report shows, read back from its page."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from helpers.table_heads import check_head, check_order
from pyarrow import parquet

TOKEN = re.compile(r'−?\d(?:[\d\u202f]*)(?:\.\d+)?(?:·10(?P<power>[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?')
POWERS = str.maketrans('⁻⁰¹²³⁴⁵⁶⁷⁸⁹', '-0123456789')


class Page(HTMLParser):
    """Tables of a page: name -> rows of (text, value) of the body's cells; ids; links."""

    def __init__(self, text: str):
        super().__init__()
        self.tables: dict[str, list[list[tuple[str, str | None]]]] = {}
        self.ids: list[str] = []
        self.links: list[str] = []
        self._table: list | None = None
        self._cell: list[str] | None = None
        self._value: str | None = None
        self._body = False
        self.feed(text)
        assert len(set(self.ids)) == len(self.ids), {
            one for one in self.ids if self.ids.count(one) > 1
        }

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.ids += [values['id']] if 'id' in values else []
        self.links += [values['href'][1:]] if tag == 'a' else []
        if tag == 'table':
            name = values.get('data-name')  # the keys of panels are tables without one
            self._table = self.tables.setdefault(name, []) if name else []
        elif tag == 'tbody':
            self._body = True
        elif tag == 'tr' and self._body:
            self._table.append([])
        elif tag in ('td', 'th') and self._body:
            self._cell, self._value = [], values.get('data-value')

    def handle_endtag(self, tag):
        if tag == 'tbody':
            self._body = False
        elif tag in ('td', 'th') and self._body:
            self._table[-1].append((''.join(self._cell), self._value))
            self._cell = None

    def handle_data(self, data):
        if self._cell is not None:
            self._cell.append(data)


def tokens(text: str) -> list[tuple[float, float]]:
    """Numbers in a text, each with half a unit of its last digit."""
    return [value_of(match[0]) for match in TOKEN.finditer(text)]


def value_of(text: str) -> tuple[float, float]:
    """A number, and half a unit of its last digit."""
    plain = text.replace('\u202f', '').replace('−', '-')
    mantissa, _, power = plain.replace('·10', 'e').partition('e')
    scale = 10.0 ** int(power.translate(POWERS) or 0)
    return float(mantissa) * scale, 0.5000001 * scale * 10.0 ** -len(mantissa.partition('.')[2])


def at(document, pointer: str):
    for part in pointer.split('/')[1:]:
        key = part.replace('~1', '/').replace('~0', '~')
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document


def check_numbers(folder: Path) -> int:
    """Hold every number of a report's tables against its text, its head, its unit and its source.

    Returns how many have their source in a JSON file of the folder, or in a row of a Parquet file.
    """
    kept: dict[str, Any] = {}
    heads: dict[str, Any] = {}
    shown_at: list[tuple[dict[str, Any], int]] = []
    checked = 0
    for row in parquet.read_table(folder / 'numbers.parquet').to_pylist():
        shown_at.append((row, check_head(row, heads, folder)))
        shown = tokens(row['text'])
        if shown and not re.search('[<–]', row['text']):  # a bound, a range
            assert abs(shown[0][0] - row['value']) <= shown[0][1] + 1e-12 * abs(shown[0][0]), row
        file, _, place = row['source'].partition(':')
        place, _, factor = place.partition('*')
        if file.endswith('.json'):
            kept[file] = kept.get(file) or json.loads((folder / file).read_text(encoding='utf-8'))
            assert row['unit'] != '%' or factor == '100' or 'percent' in place, row
            value = at(kept[file], place)
        elif place.endswith(']'):
            kept[file] = kept.get(file) or parquet.read_table(folder / file).to_pylist()
            name, _, index = place.removesuffix(']').rpartition('[')
            value = kept[file][int(index)][name]
        else:
            continue
        assert value * float(factor or 1) == pytest.approx(row['value'], rel=1e-12), row
        checked += 1
    check_order(shown_at)
    return checked
