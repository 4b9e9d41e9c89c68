"""Which steps and publications have arrived: nothing lost, nothing doubled."""

from collections.abc import Sequence


class LostStepError(RuntimeError):
    """A step is missing or came twice; the text names topic and step."""


class StepLedger:
    """Counts the steps of every step topic, in order.

    Parameters
    ----------
    topics : names of the step topics
    step_ns : time between steps, ns
    strict : every step must come once and in order; else gaps are only counted

    """

    def __init__(self, topics: Sequence[str], step_ns: int, strict: bool = True):
        self._step, self._strict = step_ns, strict
        self._newest = dict.fromkeys(topics, -1)
        self._last: dict[str, int] = {}
        self._origin: int | None = None
        self.gaps = dict.fromkeys(topics, 0)

    def add(self, topic: str, ns: int) -> None:
        """Count a message of a step topic stamped `ns`; Lost when it is not the next step."""
        if self._origin is None:
            self._origin = ns
        k, rest = divmod(ns - self._origin, self._step)
        expected = self._newest[topic] + 1
        if self._strict and (rest or k != expected):
            due = self._origin + expected * self._step
            text = f'{topic}: expected step {expected} ({due} ns), found {ns} ns'
            raise LostStepError(f'{text}: {"doubled" if k < expected else "lost"}')
        if topic in self._last:  # without a grid: by the time since the message before
            self.gaps[topic] += max(0, round((ns - self._last[topic]) / self._step) - 1)
        self._last[topic] = max(ns, self._last.get(topic, ns))
        self._newest[topic] = max(self._newest[topic], k)

    @property
    def complete(self) -> int:
        """Last step that has arrived on every step topic, -1 before the first."""
        return min(self._newest.values())

    @property
    def complete_ns(self) -> int:
        """Stamp of that step."""
        return (self._origin or 0) + self.complete * self._step

    def behind(self) -> str:
        """Topics that have not reached the furthest one, for a message to a person."""
        furthest = max(self._newest.values())
        late = [f'{topic} at step {k}' for topic, k in self._newest.items() if k < furthest]
        return ', '.join(late) or 'none'


class PublicationLedger:
    """Follows the numbers that the middleware gives to a publisher's messages.

    It sees what the steps do not show, a loss on a topic that has no message for every step. Each
    topic is taken to have one publisher; the first number is any, for one may have joined late.

    Parameters
    ----------
    strict : a gap is an error, else it is only counted

    """

    def __init__(self, strict: bool = True):
        self._strict = strict
        self._newest: dict[str, int] = {}
        self.gaps: dict[str, int] = {}

    def add(self, topic: str, number: int | None) -> None:
        """Count a publication; LostStepError after a gap. None: the middleware does not number."""
        if number is None:
            return
        last = self._newest.get(topic, number - 1)
        self._newest[topic] = number
        if number > last + 1:
            self.gaps[topic] = self.gaps.get(topic, 0) + number - last - 1
            if self._strict:
                text = f'{topic}: expected publication {last + 1}, found {number}'
                raise LostStepError(f'{text}: lost')
