"""Which stored number stands in which cell of a report: by table, row and head, with its unit.

A line of `table_heads.txt` is `table | row | head | unit | source`. The source is that of
`numbers.parquet`; in it

- `<row>` is a word of the row, `<head>` the head, both as they stand;
- `<dof>` is the number of the degree of freedom that the row names, `<DOF>` of the one in the head;
- `<n>` is the number of an entry all of whose names stand in the row, in a list or a Parquet file;
- `<any>` is any name, and `<gain>` any word.

A table, row, head that no line has is an error: whoever adds a column says here what it holds.
The heads of a row, and rows that stand there by name, come in the order of the lines.
"""

import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

from pyarrow import parquet

DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
WORDS = {  # as stored -> as a row says it
    'weighted_error': 'time-weighted error', 'late_error': 'error after 2 s',
    'peak_effort': 'peak effort', 'settling': 'settled',
}  # fmt: skip
NAMES = ('controller', 'other', 'against', 'measure', 'name', 'coupling', 'label', 'path', 'value',
         'status', 'reason', 'to', 'from', 'dof', 'run', 'predictor', 'pair', 'with')  # fmt: skip
LINES = Path(__file__).with_suffix('.txt').read_text(encoding='utf-8')
ANY = {'<gain>': '.*', '<run>': '.*', '<phase>': 'before|after', '<DOF>': '|'.join(DOFS),
       '<dofs>': '|'.join(DOFS), '<linear>': '|'.join(DOFS[:3]),
       '<angular>': '|'.join(DOFS[3:])}  # fmt: skip


def _pattern(text: str) -> str:
    """Regular expression of a row's or head's words."""
    if text == '*':
        return '.*'
    if text.endswith('.*') and '<' not in text:
        return re.escape(text.removesuffix('.*')) + '.*'
    parts = re.split('(<[^>]+>)', text)
    return ''.join(f'({ANY[part]})' if part in ANY else re.escape(part) for part in parts)


RULES = [
    (re.compile(table), re.compile(_pattern(row)), re.compile(_pattern(head)), unit, source)
    for line in LINES.strip().splitlines()
    for table, row, head, unit, source in [[part.strip() for part in line.split('|')]]
]


def check_head(row: dict[str, Any], files: dict[str, Any], folder: Path) -> int:
    """Hold a number of a report's tables against where its row and its head say that it stands.

    Returns the number of the line that says so.

    Parameters
    ----------
    row : of `numbers.parquet`
    files : contents of files that were read, by name
    folder : of the report

    """
    rules = [
        rule for rule in RULES
        if rule[0].fullmatch(row['table']) and rule[1].fullmatch(row['row'])
        and rule[2].fullmatch(row['column'])
        and rule[4].partition(':')[0] == row['source'].partition(':')[0]
    ]  # fmt: skip
    assert rules, f'no line of table_heads.txt for {row}'
    told = [rule for rule in rules if _told(row, rule, files, folder)]
    assert told, row
    return RULES.index(told[0])


def check_order(shown: list[tuple[dict[str, Any], int]]) -> None:
    """Hold the order of a table's heads, and of rows that lines name, against that of the lines.

    Parameters
    ----------
    shown : rows of `numbers.parquet` in their order, each with the number of its line

    """
    heads: set[str] = set()  # of one row
    for (one, line), (other, next_line) in pairwise(shown):
        heads.add(one['column'])
        in_row = one['row'] == other['row'] and other['column'] not in heads
        heads = heads if in_row else set()
        by_name = '.*' != RULES[line][1].pattern != RULES[next_line][1].pattern != '.*'
        if one['table'] == other['table'] and (in_row or by_name):
            assert line <= next_line, (one, other)


def _told(row: dict[str, Any], rule: Any, files: dict[str, Any], folder: Path) -> bool:
    _, _, head, unit, source = rule
    if unit not in (row['unit'], '<gain>'):
        return False
    names: list[str] = []

    def part(match: re.Match[str]) -> str:
        names.append(match[0])
        return r'([^/\[\]]+)' if match[0] not in ('<best>',) else r'(.+)'

    pattern = re.sub('<[^>]+>', part, re.sub(r'[.\[\]*+()]', r'\\\g<0>', source))
    found = re.fullmatch(pattern, row['source'])
    if found is None:
        return False
    column = head.fullmatch(row['column'])
    words = f', {row["row"]}, '
    for place, (name, value) in enumerate(zip(names, found.groups(), strict=True), start=1):
        entry = _entry(row['source'], found.end(place), files, folder)
        if not _fits(name, value, row, column.groups(), words, entry):
            return False
    return True


def _fits(name: str, value: str, row: dict[str, Any], column: Any, words: str, entry: Any) -> bool:
    if name == '<row>':
        return f', {value}, ' in words
    if name == '<head>':
        return value == row['column']
    if name == '<name>':
        return value == column[-1]
    if name == '<dof>':
        return f', {DOFS[int(value)]}, ' in words
    if name == '<DOF>':
        return DOFS[int(value)] == column[-1]
    if name in ('<first>', '<second>'):
        return row['row'].split(', ')[1 + (name == '<second>')] == DOFS[int(value)]
    if name == '<best>':
        return value.endswith(row['column']) or row['column'] in _labels(value)
    if name == '<n>':
        names = [key for key in NAMES if entry.get(key) is not None]
        names = [key for key in ('run', 'name') if key in entry][:1] or names
        return all(_said(entry[key], words) for key in names)
    if name == '<fault>':
        mine = row['table'].rpartition('_')[2] == str(entry['fault'])
        return mine and _said(entry['controller'], words) and _said(entry['dof'], words)
    if name == '<of the objective>':
        return _said(entry['controller'], words) and entry['measure'] == 'weighted_error'
    if name == '<of the part>':
        return _said(entry['coupling'], words) and _part(entry['part']) == row['column']
    if name == '<part>':
        return _part(entry['part']) == row['row']
    if name.startswith('<kpi'):
        gain = name[8:-1]
        mine = row['table'].removeprefix('sensitivity_') == entry['controller']
        return (
            mine
            and entry['dof'] in ('', 'all', row['row'].rpartition(', ')[2])
            and (not gain or entry['gain'] == gain)
        )
    return True


def _labels(column: str) -> list[str]:
    from auv_analysis.metrics.measures import BY_NAME

    return [BY_NAME[column].label] if column in BY_NAME else []


def _part(name: str) -> str:
    from auv_analysis.studies.design.change import PART_WORDS

    return PART_WORDS[name]


def _said(value: Any, words: str) -> bool:
    """Whether a row has a name, or the end of a path."""
    text = WORDS.get(str(value), str(value))
    return any(f'{before}{text}, ' in words for before in (', ', ' ')) or any(
        text.endswith(f'.{word}') for word in words.strip(', ').split(', ')
    )


def _entry(source: str, end: int, files: dict[str, Any], folder: Path) -> Any:
    """Entry of a file that a part of a pointer leads to."""
    file, _, place = source.partition(':')
    if file not in files:
        files[file] = (
            parquet.read_table(folder / file).to_pylist() if file.endswith('.parquet')
            else json.loads((folder / file).read_text(encoding='utf-8'))
        )  # fmt: skip
    if file.endswith('.parquet'):
        return files[file][int(re.findall(r'\[(\d+)\]', place)[-1])]
    found = files[file]
    for key in source[len(file) + 2 : end].split('/'):
        found = found[int(key)] if isinstance(found, list) else found[key]
    return found
