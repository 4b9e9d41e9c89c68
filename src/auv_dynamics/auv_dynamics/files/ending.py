"""Signals that end a program in good order: of the keyboard, of others, of a closed terminal."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

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
    before = take_signals(lambda *_: callback())
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
