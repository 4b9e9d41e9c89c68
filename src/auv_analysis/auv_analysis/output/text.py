"""Numbers and lists as a reader wants them: rounded, grouped, with a true minus."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

MISSING = '–'
_RAISED = '-0123456789'
_SUPERSCRIPT = str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹')


def number(value: Any, digits: int = 3) -> str:
    """Text of a number with that many significant digits; an en dash for None.

    Whole digits are never rounded away: 11479.1 with 3 digits is 11 479.

    """
    if value is None:
        return MISSING
    value = float(value)
    if value == 0.0:
        return '0'
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
    """Text of a number with that many decimals; an en dash for None."""
    if value is None:
        return MISSING
    return f'{value:,.{decimals}f}'.replace(',', '\u202f').replace('-', '−')


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


def join(words: Sequence[str]) -> str:
    """One, two and three as 'one, two and three'."""
    return ' and '.join(filter(None, [', '.join(words[:-1]), *words[-1:]]))


def residuals(summary: Mapping[str, Any]) -> list[str]:
    """Largest error of the final dwell time per degree of freedom of a summary, with its unit."""
    units = 3 * ['m/s'] + 3 * ['rad/s']
    return [
        f'{number(value, 2)} {unit}'
        for value, unit in zip(summary['settling']['residual'], units, strict=True)
    ]
