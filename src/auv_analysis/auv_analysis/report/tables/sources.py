"""Where the numbers of tables are found, and the words that tables share."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from auv_analysis.output.text import fixed
from auv_analysis.report.document import Cell

Summaries = Mapping[str, Mapping[str, Any]]
VELOCITIES, WRENCHES = 'uvwpqr', 'XYZKMN'
VELOCITY, WRENCH = ('m/s', 'rad/s'), ('N', 'N m')


def summary_source(*keys: object) -> str:
    """Where a number stands in summary.json, as a JSON pointer behind the file's name."""
    return pointer('summary.json', *keys)


def pointer(file: str, *keys: object) -> str:
    """Where a number stands in a JSON file, as a JSON pointer behind the file's name."""
    parts = (str(key).replace('~', '~0').replace('/', '~1') for key in keys)
    return f'{file}:/{"/".join(parts)}'


def count(value: int, source: str) -> Cell:
    """Cell of a whole number, without decimals."""
    return Cell(fixed(value, 0), float(value), source, 'zero' if value == 0 else '')


def numbers_in(data: Any, path: str = '') -> Iterator[tuple[str, float]]:
    """Path and value of each number in nested mappings and lists, such as those of a scenario."""
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield from numbers_in(value, f'{path}/{key}')
    elif isinstance(data, Sequence) and not isinstance(data, str):
        for i, value in enumerate(data):
            yield from numbers_in(value, f'{path}/{i}')
    elif isinstance(data, int | float) and not isinstance(data, bool):
        yield path, float(data)
