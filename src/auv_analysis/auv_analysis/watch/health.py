"""What is wrong with a graph: refused messages, endpoints that do not fit, nodes that complain."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from auv_analysis.watch.snapshot import NodeState, TopicState, Trouble
from auv_dynamics.ros import interface

if TYPE_CHECKING:
    from auv_dynamics.ros.endpoints import Endpoints

KEPT = 30.0  # s for which what was wrong once is shown
MOST = 50  # different complaints and nodes that are kept
SILENT = 3.0  # s without a message of a topic that is published every step
STEP_TOPICS = (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS)
ALONE = (*STEP_TOPICS, *interface.ANALYSIS_TOPICS)  # topics with one publisher each


class Health:
    """Keeps what was complained about, by whom and when; times are steady, in s."""

    def __init__(self) -> None:
        self.endpoints: Mapping[str, Endpoints] = {}
        self._since: dict[str, float] = {}  # when a topic was first seen to be published
        self._said: dict[str, tuple[str, int, float]] = {}
        self._nodes: dict[str, tuple[float, NodeState]] = {}

    def complain(self, now: float, text: str) -> None:
        """Keep an error; those that differ only in what was found are one."""
        text = ' '.join(text.split())
        key = text.partition(', found')[0]
        _, count, _ = self._said.pop(key, ('', 0, 0.0))
        self._said[key] = text, count + 1, now
        while len(self._said) > MOST:
            del self._said[next(iter(self._said))]

    def see(self, now: float, endpoints: 'Mapping[str, Endpoints]') -> None:
        """Take who publishes and subscribes what."""
        self.endpoints = endpoints
        published = [name for name, ends in endpoints.items() if ends.publishers]
        self._since = {name: self._since.get(name, now) for name in published}

    def diagnose(self, now: float, state: NodeState) -> None:
        """Keep what a node says of itself."""
        self._nodes.pop(state.name, None)
        self._nodes[state.name] = now, state
        while len(self._nodes) > MOST:
            del self._nodes[next(iter(self._nodes))]

    def nodes(self, now: float) -> tuple[NodeState, ...]:
        """Nodes that were heard lately, by name."""
        found = []
        for name, (at, state) in sorted(self._nodes.items()):
            age = now - at
            if age < KEPT:
                level = 'stale' if age > SILENT else state.level
                found.append(NodeState(name, level, state.text, age, state.facts))
        return tuple(found)

    def troubles(self, now: float, topics: Iterable[TopicState]) -> tuple[Trouble, ...]:
        """All that is wrong, errors first."""
        topics = list(topics)
        found = [
            Trouble('error', text, count, now - at)
            for text, count, at in reversed(self._said.values())
            if now - at < KEPT
        ]
        found += self._misfits()
        found += self._complaints(now)
        found += _crowds(topics)
        found += self._silences(now, topics)
        return tuple(sorted(found, key=lambda trouble: trouble.level != 'error'))

    def _misfits(self) -> list[Trouble]:
        texts: list[str] = []
        for name, ends in self.endpoints.items():
            texts += ends.conflicts
            if ends.foreign:
                texts.append(f'{name}: expected the type of this topic, found {ends.foreign}')
        return [Trouble('error', text) for text in texts]

    def _complaints(self, now: float) -> list[Trouble]:
        return [
            Trouble(node.level, f'{node.name}: {node.text}', age=node.age)
            for node in self.nodes(now)
            if node.level in ('warning', 'error')
        ]

    def _silences(self, now: float, topics: list[TopicState]) -> list[Trouble]:
        ages = {}
        for topic in topics:
            if topic.name in STEP_TOPICS and topic.name in self._since:
                age = now - self._since[topic.name] if topic.age is None else topic.age
                ages[topic.name] = age
        silent = [name for name, age in ages.items() if age > SILENT]
        if not silent:
            return []
        text = f'published, but nothing comes: {", ".join(silent)}'
        return [Trouble('warning', text, age=min(ages[name] for name in silent))]


def _crowds(topics: list[TopicState]) -> list[Trouble]:
    return [
        Trouble('warning', f'{topic.name}: expected one publisher, found {topic.publishers}')
        for topic in topics
        if topic.name in ALONE and topic.publishers > 1
    ]
