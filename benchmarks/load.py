"""What other programs took of the machine while something was measured."""

import os
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

QUIET = 1.5  # load of others above which nothing is judged
LOADAVG, STAT = Path('/proc/loadavg'), Path('/proc/stat')
TICKS = os.sysconf('SC_CLK_TCK')


def _spent() -> tuple[float, float, float]:
    """Wall time, CPU time of all programs and that of this one with those that it ended, in s.

    What the machine does for interrupts is nobody's: most of it is for the measured programs.
    """
    user, nice, system, _, _, _, _, steal = map(int, STAT.read_text().split()[1:9])
    return time.monotonic(), (user + nice + system + steal) / TICKS, sum(os.times()[:4])


@dataclass(frozen=True)
class Load:
    """What others did beside a measurement.

    Attributes
    ----------
    others : their tasks that ran or wanted to, on average; as long as the measured programs are
        at rest that is what a load average counts. At least the processors that they had
    cpu : share of the machine's processors that they, or the host of a virtual machine, took
    average : the machine's load average over the last minute, which counts what is measured too

    """

    others: float
    cpu: float
    average: float

    @property
    def quiet(self) -> bool:
        """Whether what was measured may be judged."""
        return self.others <= QUIET


@dataclass
class Watch:
    """Follows the load of others; `look` is to be called while the measured programs rest.

    Attributes
    ----------
    seen : tasks of others that ran or wanted to, at each look

    """

    seen: list[int] = field(default_factory=list)
    _began: tuple[float, float, float] = field(default_factory=_spent)

    def look(self) -> None:
        """Count the tasks of others that run or want to."""
        running = LOADAVG.read_text().split()[3].partition('/')[0]
        self.seen.append(int(running) - 1)  # but for the one that reads

    def load(self) -> Load:
        """Load of others since this began."""
        wall, busy, own = (now - then for now, then in zip(_spent(), self._began, strict=True))
        cores = max(0.0, busy - own) / wall
        waiting = statistics.mean(self.seen) if self.seen else 0.0
        share = min(1.0, cores / (os.cpu_count() or 1))
        return Load(max(waiting, cores), share, os.getloadavg()[0])


_watches: list[Watch] = []


@contextmanager
def watched() -> Iterator[Watch]:
    """Watch the load of others during a block; `look` is heard by it."""
    watch = Watch()
    _watches.append(watch)
    try:
        watch.look()
        yield watch
        watch.look()
    finally:
        _watches.remove(watch)


def look() -> None:
    """Count the tasks of others now, for whoever watches."""
    for watch in _watches:
        watch.look()
