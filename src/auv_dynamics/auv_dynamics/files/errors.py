"""Errors and exits: wrong input as one line, work that failed, signals."""

import re
import reprlib
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unicodedata import category

OBEYED = ('Cc', 'Cf', 'Cs', 'Co', 'Zl', 'Zp')  # control, format, surrogates, separators
MARK = '\N{REPLACEMENT CHARACTER}'


def printable(text: str) -> str:
    """Text without what a terminal would obey: control characters become a mark, lines stay."""
    return ''.join(c if c == '\n' or category(c) not in OBEYED else MARK for c in text)


PLAIN = re.compile(r'[^\W\d](?:[\w ./:-]{0,55}\w)?')  # a word or two
LONGEST = 200  # characters of what was found
_repr = reprlib.Repr()
_repr.maxlevel, _repr.maxlist, _repr.maxdict, _repr.maxstring = 3, 10, 5, 57


class InputError(ValueError):
    """Wrong input from the user; its text is one line fit for a terminal."""

    def __init__(self, file: object, key: str, expected: str, found: object):
        self.file, self.key, self.expected = str(file), key, expected
        self.found = found if isinstance(found, str) else shorten(found)
        if len(self.found) > LONGEST:
            self.found = f'{self.found[: LONGEST - 3]}...'
        place = f'{self.file}: {key}' if key else self.file
        line = f'{place}: expected {expected}, found {self.found}'
        super().__init__(printable(' '.join(line.split())))


def reason(error: OSError) -> str:
    """The system's reason for an error, as a few words for a message."""
    return (error.strerror or str(error)).lower()


@contextmanager
def refusing(file: object, key: str, expected: str) -> Iterator[None]:
    """Refuse a file or folder with what the system says while this lasts."""
    try:
        yield
    except OSError as error:
        raise InputError(file, key, expected, reason(error)) from None


def first_line(error: BaseException) -> str:
    """A library's error as one line; its type where it said nothing."""
    return (str(error) or type(error).__name__).splitlines()[0]


def named_line(error: BaseException) -> str:
    """Type of an error and the first line of what it says."""
    return f'{type(error).__name__}: {error}'.splitlines()[0]


def shorten(value: object) -> str:
    """One short line that shows a value."""
    if isinstance(value, str) and PLAIN.fullmatch(value):
        return value  # only what looks like no word is quoted: '', '1', control characters
    text = 'nothing' if value is None else _repr.repr(value)
    text = ' '.join(text.split())
    return text if len(text) <= 60 else text[:57] + '...'


class FailedError(RuntimeError):
    """The work failed: exit code 1; the text is one line, or one with a program's last lines.

    Parameters
    ----------
    text : what failed
    document : what `--json` prints all the same; none: nothing

    """

    def __init__(self, text: str, document: dict[str, Any] | None = None):
        super().__init__(text)
        self.document = document


ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


def take_signals(handler: Any) -> dict[signal.Signals, Any]:
    """Set the handler of all of them; the handlers before.

    A SIGHUP that is ignored stays so: `nohup` was asked to let the program outlive its terminal.
    """
    kept = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    taken = [number for number in ENDING if not (kept and number == signal.SIGHUP)]
    return {number: signal.signal(number, handler) for number in taken}


@contextmanager
def on_signals(callback: Callable[[], None]) -> Iterator[None]:
    """Call back on any of them while this lasts."""
    with _taken(lambda *_: callback()):
        yield


@contextmanager
def _taken(handler: Any) -> Iterator[None]:
    before = take_signals(handler)
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Let Ctrl-C and the other signals that end a command wait for the end of this.

    Compiled code may need that: pybind11 makes "Unable to convert call argument" of what a handler
    raises while it converts one.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked: list[int] = []
    with _taken(lambda number, _: asked.append(number)):
        yield
    for number in asked[:1]:
        signal.raise_signal(number)
