"""Recorded commands where a vehicle may hear them: none to a node that would act on them."""

from collections.abc import Callable, Mapping
from typing import Any

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.endpoints import NAMED, NAMELESS, acts, full_name, other_subscribers


class Guard:
    """Watches who subscribes to the commands of a replay.

    Parameters
    ----------
    node : that publishes them
    publishers : recorded name -> publisher, of the guarded commands alone
    foreign : publish them to whomever
    complain : is told why commands have been stopped

    Attributes
    ----------
    stopped : why no more commands are published; empty: they are

    """

    def __init__(
        self,
        node: Any,
        publishers: Mapping[str, Any],
        foreign: bool,
        complain: Callable[[str], None],
    ):
        self._node, self._publishers, self._foreign = node, publishers, foreign
        self._complain = complain
        self._judged: dict[str, int] = {}  # topic -> number of subscribers that are known
        self._strange: dict[str, float] = {}  # topic -> since when one of them has no name
        self.stopped = ''

    def refusal(self, *, final: bool) -> InputError | None:
        """Why commands must not be published at all; `final`: a name does not come any more."""
        if self._foreign:
            return None
        for topic, publisher in self._publishers.items():
            found = self._actors(publisher)
            if found and (final or found != [NAMELESS]):
                key, expected = publisher.topic_name, 'nobody who acts on recorded commands'
                names = f'{", ".join(found)} (allowed by --force-commands)'
                return InputError(self._node.get_name(), key, expected, names)
            self._judged.pop(topic, None)
        return None

    def _actors(self, publisher: Any) -> list[str]:
        """Who may act on what is published, full names."""
        found = other_subscribers(self._node, publisher.topic_name)
        return sorted({full_name(one) for one in found if acts(one)})

    def look(self, now: float) -> None:
        """Judge all subscribers anew."""
        for topic in self._publishers:
            self._judged.pop(topic, None)
            self.may(topic, now)

    def may(self, topic: str, now: float) -> bool | None:
        """Whether a message may be published; None: not yet, a subscriber is not known yet."""
        publisher = self._publishers.get(topic)
        if publisher is None or self._foreign:
            return True
        if self.stopped:
            return False
        # what is discovered, not what has matched: that comes later, and messages go out between
        count = self._node.count_subscribers(publisher.topic_name)
        if count == self._judged.get(topic):
            return True
        found = self._actors(publisher)
        if found == [NAMELESS] and now - self._strange.setdefault(topic, now) < NAMED:
            return None
        self._strange.pop(topic, None)
        if found:
            self.stopped = f'{", ".join(found)} on {publisher.topic_name}'
            self._complain(f'commands are not published any more: {self.stopped}')
            return False
        self._judged[topic] = count
        return True
