"""Whether the machine stood still meanwhile: what was seen then says nothing of what was tested."""

import threading
import time
from collections.abc import Callable
from typing import TypeVar

from helpers.patience import patience

PAUSE = 0.25  # s: watchdogs of half a second have then been called by the machine
TRIES = round(patience(3.0))  # the busier the machine, the more
Found = TypeVar('Found')


class Pauses(threading.Thread):
    """Measures for how long this process gets no turn."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.longest = 0.0  # s

    def run(self) -> None:
        """Sleep, and see how late it wakes."""
        now, sleep = time.monotonic, threading.Event().wait  # tests replace those of `time`
        while True:
            before = now()
            sleep(0.02)
            self.longest = max(self.longest, now() - before)


PAUSES = Pauses()


def undisturbed(
    attempt: Callable[[], Found],
    as_promised: Callable[[Found], bool],
    stalled: Callable[[Found], bool] = lambda _: False,
) -> Found:
    """What an attempt finds: the first that is as promised, or during which nothing stood still.

    `stalled` says of what was found whether it shows that another process stood still.
    """
    found = attempt()
    for _ in range(TRIES - 1):
        if as_promised(found) or not (PAUSES.longest > PAUSE or stalled(found)):
            break
        PAUSES.longest = 0.0
        found = attempt()
    return found
