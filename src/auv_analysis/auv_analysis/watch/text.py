"""Numbers as short texts for a terminal."""

from datetime import UTC, datetime

MISSING = '–'
BLOCKS = ' ▁▂▃▄▅▆▇█'
DATES = 1e9  # s: stamps from here on are of the wall clock


def fixed(value: float | None, digits: int = 4) -> str:
    """Number with so many decimals; those that are very large in powers of ten."""
    if value is None:
        return MISSING
    return _plain(f'{value:.{digits}f}') if abs(value) < 1000 else f'{value:.1e}'


def short(value: float | None) -> str:
    """Number in at most eight characters, with the decimals that its size leaves room for."""
    if value is None:
        return MISSING
    size = abs(value)
    if size >= 1e6:
        return f'{value:.1e}'
    digits = 0 if size >= 1000 else 1 if size >= 100 else 2 if size >= 10 else 3
    return _plain(f'{value:.{digits}f}')


def _plain(text: str) -> str:
    """Text of a number without the sign of a zero."""
    return text.removeprefix('-') if not text.strip('-0.') else text


def count(value: int | None) -> str:
    """Whole number."""
    return MISSING if value is None else f'{value}'


def seconds(value: float | None) -> str:
    """Age or time in s."""
    if value is None:
        return MISSING
    return f'{value:.1f} s' if value < 100 else f'{value:.0f} s'


def stamp(value: float) -> str:
    """Time of a message: s since the start of a simulation, else the time of day."""
    if value < DATES:
        return f'{value:.2f} s'
    return datetime.fromtimestamp(value, UTC).strftime('%H:%M:%S.%f')[:-5] + ' UTC'


def fact(value: str) -> str:
    """What a node says of itself; a number with three digits."""
    try:
        return value if value.lstrip('-').isdecimal() else f'{float(value):.3g}'
    except ValueError:
        return value


def rate(value: float | None) -> str:
    """Messages per second."""
    if value is None:
        return MISSING
    return f'{value:.1f}' if value < 99.95 else f'{value:.0f}'


def spark(values: list[float]) -> str:
    """Values from 0 up as a row of blocks, the largest one full."""
    top = max(values, default=0.0)
    if top <= 0:
        return BLOCKS[1] * len(values)
    steps = len(BLOCKS) - 2
    return ''.join(BLOCKS[1 + round(steps * value / top)] for value in values)
