"""Answers to replayed odometry: each is waited for before the next odometry goes out."""

import time
from typing import Any

from auv_analysis.bag.step_topics import ODOMETRY, role_of
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.ros.graph import Graph
from auv_dynamics.ros.interface import NANOSECONDS

PATIENCE = 10.0  # s


class Answers:
    """Pairs odometry with the messages of a topic by their stamps, as lock-step does.

    Parameters
    ----------
    graph : of the node
    topic : of the wrenches that answer

    """

    def __init__(self, graph: Graph, topic: str):
        self._topic = topic
        self._asked: int | None = None
        self._since = 0.0
        wrench = topics.Topic(topic, topics.WRENCH.type)
        graph.subscribe(wrench, self._take, topics.every_step())

    def _take(self, data: bytes, _: dict[str, Any]) -> None:
        if first_stamp(data) == self._asked:
            self._asked = None

    def sent(self, topic: str, kind: str, data: bytes) -> None:
        """Note a message that was published; of odometry, wait for the answer."""
        if is_odometry(topic, kind):
            self._asked, self._since = first_stamp(data), time.monotonic()

    def are_complete(self) -> bool:
        """Whether no answer is waited for."""
        return self._asked is None

    def overdue(self) -> str:
        """What has been waited for too long, or an empty text."""
        if self._asked is None or time.monotonic() - self._since < PATIENCE:
            return ''
        seconds = self._asked / NANOSECONDS
        return f'no answer on {self._topic} to the odometry of {seconds:g} s for {PATIENCE:g} s'


def is_odometry(topic: str, kind: str) -> bool:
    """Whether a law answers the messages of a recorded topic."""
    return role_of(topic) == interface.ODOM and kind == ODOMETRY
