"""The known name that a wrong one was probably meant for, wherever the set of names is known."""

from collections.abc import Iterable
from difflib import get_close_matches

LIKE = 0.6  # of 1: a name that is less like what was typed would only puzzle


def nearest(name: object, known: Iterable[str], count: int = 1) -> list[str]:
    """Known names that are like a wrong one.

    Parameters
    ----------
    name : what was found; large and small letters are the same
    known : the names that there are
    count : at most so many

    Returns
    -------
    names : the likest first; none where nothing is like it

    """
    if not isinstance(name, str):
        return []
    written = {entry.lower(): entry for entry in known}
    return [written[key] for key in get_close_matches(name.lower(), written, count, LIKE)]


def meant(name: object, known: Iterable[str]) -> str:
    """` (nearest: NAME)`, which ends what an error expects; empty where nothing is like it."""
    return ''.join(f' (nearest: {entry})' for entry in nearest(name, known))


def one_of(name: object, known: Iterable[str]) -> str:
    """Expectation in an error on an unknown name: `one of a, b`."""
    known = list(known)
    return f'one of {", ".join(known)}{meant(name, known)}'
