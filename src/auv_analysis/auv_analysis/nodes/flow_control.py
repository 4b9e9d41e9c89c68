"""Flow control of a replay by acknowledgement, and by the answers to its odometry."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from rclpy.client import Client
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future
from std_srvs.srv import Trigger

from auv_analysis.bag.step_topics import ODOMETRY, role_of
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.ros.endpoints import full_name
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.ros.node_interface import ASK_AGAIN, NodeInterface

WINDOW = 1000  # messages of a topic that may be under way: far fewer than subscribers keep
ANSWERS = 2  # the first may come from the moment before the data arrived, the next does not
PATIENCE = 10.0  # s, after which a subscriber that does not answer is not waited for any more
LOOK = 0.2  # s between two looks at who subscribes
READY = 'ready'
NOW = Duration(seconds=0)


@dataclass
class _Round:
    """A question to all: whether they have taken so many messages of each topic."""

    counts: dict[str, int]
    began: float = field(default_factory=time.monotonic)
    arrived: bool = False
    answers: dict[str, int] = field(default_factory=dict)
    pending: dict[str, tuple[float, Future]] = field(default_factory=dict)


class Receivers:
    """Follows messages to those who subscribe: all that they acknowledge is on their side.

    Our nodes answer `~/ready` in the thread in which they take their data; what had arrived before
    one answer is taken before the next. Of others it is only known that the data has arrived.

    Parameters
    ----------
    node : that publishes
    publishers : name -> publisher

    Attributes
    ----------
    silent : who has not answered in time

    """

    def __init__(self, node: Node, publishers: Mapping[str, Publisher]):
        self._node, self._publishers = node, publishers
        self._sent = dict.fromkeys(publishers, 0)
        self._taken = dict(self._sent)
        self._clients: dict[str, Client] = {}
        self._round: _Round | None = None
        self._found = -LOOK
        self.silent: list[str] = []

    def find(self) -> None:
        """Look for subscribers that can be asked, now and then."""
        if time.monotonic() - self._found < LOOK:
            return
        self._found = time.monotonic()
        services = {name for name, _ in self._node.get_service_names_and_types()}
        for publisher in self._publishers.values():
            for one in self._node.get_subscriptions_info_by_topic(publisher.topic_name):
                name = full_name(one)
                if name not in self._clients and f'{name}/{READY}' in services:
                    self._clients[name] = self._node.create_client(Trigger, f'{name}/{READY}')

    def sent(self, name: str) -> None:
        """Count a message that was published."""
        self._sent[name] += 1

    def have_room(self, name: str) -> bool:
        """Whether a further message of a topic may be published."""
        return self._sent[name] - self._taken[name] < WINDOW

    def have_all(self) -> bool:
        """Whether everything that was published is known to have been taken."""
        return self._sent == self._taken

    def ask(self, *, always: bool = False) -> None:
        """Go on asking; begin when half of a window is used, or `always` when it is used at all."""
        if self._round is None:
            enough = 1 if always else WINDOW // 2
            used = (self._sent[name] - taken for name, taken in self._taken.items())
            if max(used, default=0) < enough:
                return
            self._round = _Round(dict(self._sent))
        if self._has_arrived(self._round) and self._is_answered(self._round):
            self._taken, self._round = self._round.counts, None

    def _has_arrived(self, asked: _Round) -> bool:
        late = time.monotonic() - asked.began > PATIENCE
        for name, publisher in self._publishers.items():
            if not (asked.arrived or publisher.wait_for_all_acked(NOW)):
                if not late:
                    return False
                self._give_up(f'a subscriber of {name}')
        asked.arrived = True
        return True

    def _is_answered(self, asked: _Round) -> bool:
        waits = False
        for name, client in self._clients.items():
            if asked.answers.get(name, 0) >= ANSWERS or not client.service_is_ready():
                continue
            if time.monotonic() - asked.began > PATIENCE:
                self._give_up(name)
            elif name not in self.silent:
                self._ask_one(asked, name, client)
                waits = True
        return not waits

    def _ask_one(self, asked: _Round, name: str, client: Client) -> None:
        since, future = asked.pending.get(name, (0.0, None))
        if future is not None and future.done():
            asked.answers[name] = asked.answers.get(name, 0) + 1
            del asked.pending[name]
        elif future is None or time.monotonic() - since > ASK_AGAIN:
            asked.pending[name] = time.monotonic(), client.call_async(Trigger.Request())

    def _give_up(self, who: str) -> None:
        if who not in self.silent:
            self.silent.append(who)
            text = f'{who} did not answer for {PATIENCE:g} s, messages to it may be lost'
            self._node.get_logger().error(text)


class Answers:
    """Pairs odometry with the messages of a topic by their stamps, as lock-step does.

    Parameters
    ----------
    graph : of the node
    topic : of the wrenches that answer

    """

    def __init__(self, graph: NodeInterface, topic: str):
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
