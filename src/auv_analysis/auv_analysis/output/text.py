"""Text of numbers, lists and symbols: rounded, grouped, with a true minus, indices lowered."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain, zip_longest
from typing import Any

from markupsafe import Markup, escape

MISSING = '–'
_RAISED = '-0123456789'
_SUPERSCRIPT = str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹')
LETTERS = {'Lambda': 'Λ', 'Gamma': 'Γ', 'lambda': 'λ', 'omega': 'ω', 'phi': 'φ'}
GAINS = ('k_D', 'k_I', 'k_P', 'k_S', 'K_D', 'K_f', 'Lambda', 'Gamma', 'omega_f', 'phi')
_LETTER = re.compile(rf'(?<![^\W_])({"|".join(LETTERS)})(?![^\W_])')
_INDEX = re.compile(r'\b(Δ?[A-Za-zτξπωνΓΛΥλ])_([A-Za-z0-9]{1,3})\b')
_POWER = re.compile(r'\^([-−]?[A-Za-z0-9]+(?:/\d)?)')
_NUMBERED = re.compile(r'(?<=[ξπ])([1-6])\b')


def number(value: Any, digits: int = 3) -> str:
    """Text of a number with that many significant digits; an en dash for None and NaN.

    Whole digits are never rounded away: 11479.1 with 3 digits is 11 479.

    """
    if value is None or math.isnan(value):
        return MISSING
    value = float(value)
    if value == 0.0:
        return '0'
    if math.isinf(value):
        return '∞' if value > 0 else '−∞'
    mantissa, exponent = f'{value:.{digits - 1}e}'.split('e')
    power = int(exponent)
    if power < -4 or power > 6:
        text = f'{mantissa}·10{str(power).translate(_SUPERSCRIPT)}'
    else:
        text = f'{value:,.{max(digits - 1 - power, 0)}f}'.replace(',', '\u202f')
    return text.replace('-', '−')


def plain(value: float, digits: int = 4) -> str:
    """Text of a number with at most that many significant digits: 12 stays 12."""
    text = number(value, digits)
    head, separator, power = text.partition('·')
    return (head.rstrip('0').rstrip('.') if '.' in head else head) + separator + power


def fixed(value: float | None, decimals: int) -> str:
    """Text of a number with that many decimals; an en dash for None and NaN."""
    if value is None or math.isnan(value):
        return MISSING
    return f'{value:z,.{decimals}f}'.replace(',', '\u202f').replace('-', '−')


def typeset(text: str) -> str:
    """The same text for a figure: its font has no raised digits, powers are set as formulas."""
    powers = str.maketrans(''.join(map(chr, _SUPERSCRIPT.values())), _RAISED)
    return re.sub(
        r'([−\d.\u202f]+)·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)',
        lambda m: f'${m[1].replace("−", "-")}\\cdot10^{{{m[2].translate(powers)}}}$',
        text,
    )


def tied(text: str) -> str:
    """The same text, whose numbers do not part from their units at the end of a line."""
    text = re.sub(r'(?<=\d) (?=(J|N|N m|m|s|%|m/s|rad/s|kg)\b|%)', '\u00a0', text)
    return re.sub(r'\bN m\b', 'N\u00a0m', text)


def largest(values: Sequence[float | None], members: Iterable[int] = range(6)) -> int | None:
    """Index of the largest of some values, None where none of them is known."""
    known = {i: x for i in members if (x := values[i]) is not None and not math.isnan(x)}
    return max(known, key=known.__getitem__, default=None)


def join(words: Sequence[str]) -> str:
    """One, two and three as 'one, two and three'."""
    return ' and '.join(filter(None, [', '.join(words[:-1]), *words[-1:]]))


def capital(text: str) -> str:
    """A text as the begin of a sentence."""
    return text[:1].upper() + text[1:]


def residuals(summary: Mapping[str, Any]) -> list[str]:
    """Largest error of the final dwell time per degree of freedom of a summary, with its unit."""
    units = 3 * ['m/s'] + 3 * ['rad/s']
    return [
        f'{number(value, 2)} {unit}'
        for value, unit in zip(summary['settling']['residual'], units, strict=True)
    ]


class Maths(str):
    """Words of ours whose symbols a page sets: w_X, k_D, ξ3, M^-1, Lambda.

    Every other text is a user's, or may be, and is shown as it stands.

    Parameters
    ----------
    words : ours; each `{}` stands for the next field
    fields : of users, shown as they stand, or `Maths` again

    """

    __slots__ = ('parts',)
    parts: tuple[str, ...]  # words and fields in turn

    def __new__(cls, words: str, *fields: str) -> 'Maths':
        """Words with fields as a text in which the symbols are ASCII."""
        pieces = zip_longest(words.split('{}'), fields, fillvalue='')
        parts = tuple(chain.from_iterable(pieces))
        found = super().__new__(cls, ''.join(parts))
        found.parts = parts
        return found

    def html(self) -> Markup:
        """The text with indices lowered, powers raised, and Greek letters for their names."""
        fields = (
            part.html() if isinstance(part, Maths) else escape(part) for part in self.parts[1::2]
        )
        words = map(_set, self.parts[::2])
        return Markup('').join(chain.from_iterable(zip(words, fields, strict=True)))


def _set(words: str) -> Markup:
    text = _LETTER.sub(lambda match: LETTERS[match[0]], str(escape(words)))
    text = _INDEX.sub(r'\1<sub>\2</sub>', text)
    text = _POWER.sub(lambda match: f'<sup>{match[1].replace("-", "−")}</sup>', text)
    return Markup(_NUMBERED.sub(r'<sub>\1</sub>', text))


def symbol(gain: str) -> str:
    """A gain's name, to be set where it is one of ours; that of a user's law stays as it stands."""
    return Maths(gain) if gain in GAINS else gain
