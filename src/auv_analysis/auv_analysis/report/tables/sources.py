"""Cells and pointers by hand, for the studies that have not moved to `results` yet."""

from auv_analysis.metrics.quantities import VELOCITY, WRENCH
from auv_analysis.output.text import fixed
from auv_analysis.report import run_tables
from auv_analysis.report.results import Cell

__all__ = ['VELOCITY', 'WRENCH', 'count', 'pointer']


def pointer(file: str, *keys: object) -> str:
    """Where a number stands in a JSON file, as a JSON pointer behind the file's name."""
    return run_tables.pointer(*keys, file=file)


def count(value: int, source: str) -> Cell:
    """Cell of a whole number, without decimals."""
    return Cell(fixed(value, 0), float(value), source, 'zero' if value == 0 else '')
