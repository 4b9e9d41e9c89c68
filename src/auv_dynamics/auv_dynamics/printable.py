"""Text for a terminal, wherever it comes from."""

from unicodedata import category

OBEYED = ('Cc', 'Cf', 'Cs', 'Co', 'Zl', 'Zp')  # control, format, surrogates, separators
MARK = '\N{REPLACEMENT CHARACTER}'


def printable(text: str) -> str:
    """Text without what a terminal would obey: control characters become a mark, lines stay."""
    return ''.join(c if c == '\n' or category(c) not in OBEYED else MARK for c in text)
