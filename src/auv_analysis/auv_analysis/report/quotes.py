"""Numbers in sentences, each kept as data beside its text."""

from collections.abc import Callable, Iterable, Sequence
from math import isfinite
from typing import NamedTuple

from auv_analysis.output.text import fixed, number

Text = Callable[[float], str]
UNBOUNDED = 'unbounded'


class Value(NamedTuple):
    """A number that a sentence shows.

    Attributes
    ----------
    name : what it is, unique within its sentence
    value : None where it does not exist
    unit : empty for a ratio

    """

    name: str
    value: float | None
    unit: str


class Quotes:
    """Makes numbers into text and keeps what it made into text."""

    def __init__(self) -> None:
        self._values: dict[str, Value] = {}

    @property
    def values(self) -> tuple[Value, ...]:
        """All numbers so far, in their order."""
        return tuple(self._values.values())

    def __call__(self, name: str, value: float, unit: str = '', text: Text | int = 3) -> str:
        """Text of a number.

        Parameters
        ----------
        name, value, unit : as of `Value`
        text : makes the text; a number of significant digits for `number`

        """
        value = float(value)
        self._keep(Value(name, value if isfinite(value) else None, unit))
        if not isfinite(value):
            return UNBOUNDED
        return number(value, text) if isinstance(text, int) else text(value)

    def _keep(self, entry: Value) -> None:
        """Take in a number; one that is shown twice stands once."""
        known = self._values.setdefault(entry.name, entry)
        if known != entry:
            raise ValueError(f'expected one value of {entry.name}, found {known} and {entry}')

    def listed(
        self, names: Sequence[str], values: Iterable[float], unit: str, text: Text | int = 3
    ) -> str:
        """Texts of several numbers, separated by commas."""
        return ', '.join(self(*pair, unit, text) for pair in zip(names, values, strict=True))


def decimals(count: int) -> Text:
    """Text with that many decimals."""
    return lambda value: fixed(value, count)


def short(value: float) -> str:
    """Text of a time that is round: 10, 0.5."""
    return f'{value:g}'


def percent(value: float) -> str:
    """Text of a change in % with its sign."""
    return f'{round(value, 1) + 0.0:+.1f}'.replace('-', '−')
