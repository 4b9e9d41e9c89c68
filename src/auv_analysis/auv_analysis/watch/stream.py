"""How the messages of one topic come in: rate, pace of their stamps, gaps, repeated stamps."""

from collections import deque
from statistics import median

WINDOW = 2.5  # s over which rates are formed
SHORTEST = 0.2  # s: no rate from less
STEPS = 32  # differences of stamps whose median is the topic's step
ENOUGH = 8  # differences before a gap can be told
GAP = 1.5  # steps between two stamps that follow each other: one is missing
SECOND = 1e9


class Stream:
    """What is known of one topic.

    Messages that are not heard, because nobody listened, are counted by the numbers that the
    middleware gives them; stamps are judged between messages that follow each other.

    Parameters
    ----------
    judged : whether the stamps are meant to be evenly spaced

    Attributes
    ----------
    heard, published : messages, the latter since the first one that was heard
    publishers : of this topic
    newest : stamp in ns of the message heard last, or None

    """

    def __init__(self, *, judged: bool = True):
        self._judged = judged
        self.heard = self.published = self._gaps = self._repeats = 0
        self.publishers = 1
        self.newest: int | None = None
        self._before: tuple[int, int] | None = None  # number and stamp of a message, if known
        self._steps: deque[int] = deque(maxlen=STEPS)
        self._step = 0.0
        self._window: deque[tuple[float, int, int]] = deque()

    def hear(self, now: float, number: int | None, ns: int) -> bool:
        """Take a message: steady time in s, number by its publisher, stamp in ns.

        Returns
        -------
        anew : whether another publisher has begun with its first messages and earlier stamps

        """
        self.heard += 1
        ahead = since = 0  # messages and ns since the one before, as far as can be told
        if self._before and number is not None and self.publishers == 1:
            ahead, since = number - self._before[0], ns - self._before[1]
        self.newest, self._before = ns, None if number is None else (number, ns)
        anew = ahead not in (0, 1) and since < 0
        self.published += 1 if anew else max(ahead, 1)
        if anew:
            self._steps.clear()
            self._window.clear()
            self._gaps = self._repeats = 0
        elif ahead == 1 and self._judged:
            self._judge(since)
        if self._window and self._window[-1][0] == now:
            self._window.pop()
        self._window.append((now, self.published, ns))
        return anew

    def _judge(self, difference: int) -> None:
        if difference <= 0:
            self._repeats += 1
            return
        if len(self._steps) >= ENOUGH and difference > GAP * self._step:
            self._gaps += round(difference / self._step) - 1
        self._steps.append(difference)
        if len(self._steps) <= ENOUGH or self.heard % STEPS == 0:
            self._step = median(self._steps)

    @property
    def gaps(self) -> int | None:
        """Stamps that are missing; None: not known, or no even stamps are meant."""
        return self._gaps if self._steps else None

    @property
    def repeats(self) -> int | None:
        """Stamps that are not later than the one before; None as above."""
        return self._repeats if self._steps or self._repeats else None

    def rate(self, now: float) -> float | None:
        """Messages per second of the publisher; None: not known yet."""
        span, messages, _ = self._span(now)
        if span >= SHORTEST:
            return messages / span
        age = self.age(now)
        return 0.0 if age is not None and age > WINDOW else None

    def pace(self, now: float) -> float | None:
        """Seconds of stamps per second of the wall; None: not known."""
        span, _, ns = self._span(now)
        return ns / SECOND / span if span >= SHORTEST else None

    def age(self, now: float) -> float | None:
        """Time since the last message was taken, s; None: there was none."""
        return now - self._window[-1][0] if self._window else None

    def _span(self, now: float) -> tuple[float, int, int]:
        """Seconds, messages and ns between the first and the last message of the window."""
        window = self._window
        while len(window) > 1 and window[0][0] < now - WINDOW:
            window.popleft()
        if not window:
            return 0.0, 0, 0
        (begin, first, first_ns), (end, last, last_ns) = window[0], window[-1]
        return end - begin, last - first, last_ns - first_ns
