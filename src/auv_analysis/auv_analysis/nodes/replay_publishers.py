"""Output of a replay: publishers, the guard of commands, and flow control.

Flow control goes by acknowledgement and by the answers to odometry.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from geometry_msgs.msg import Twist, TwistStamped, Wrench, WrenchStamped
from rclpy.client import Client
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from std_srvs.srv import Trigger

from auv_analysis.bag.metadata import Definition, offered_profiles
from auv_analysis.bag.ros2msg import definition
from auv_analysis.bag.step_topics import ODOMETRY, role_of
from auv_analysis.replay.selection import Selection
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import KINDS, first_stamp, message_of
from auv_dynamics.ros.endpoints import NAMED, NAMELESS, acts, full_name, is_of, other_subscribers
from auv_dynamics.ros.interface import DEPTH, NANOSECONDS, Frames
from auv_dynamics.ros.node_interface import ASK_AGAIN, NodeInterface
from auv_dynamics.ros.topics import Topic, message_class


def make_publishers(
    graph: NodeInterface, recorded: dict[str, Definition], selection: Selection
) -> dict[str, Any]:
    """Publishers by recorded name; what cannot be published moves to `selection.left_out`.

    Parameters
    ----------
    graph : of the node
    recorded : recorded name -> its definition
    selection : of the topics

    """
    publishers = {}
    for topic, name in list(selection.names.items()):
        about = recorded[topic]
        kind = _installed(about.kind)
        why = f'its type {about.kind or "(none)"} is not installed'
        if kind is not None:
            qos = offered_again(about.qos, volatile=topic in selection.guarded)
            publisher = graph.publisher(Topic(name, kind), qos)
            if _means_the_same(graph.node, publisher, about.digest):
                publishers[topic] = publisher
                continue
            graph.node.destroy_publisher(publisher)
            why = f'its type {about.kind} is defined in another way here'
        del selection.names[topic]
        selection.guarded.discard(topic)
        selection.left_out[topic] = why
    return publishers


def _installed(name: str) -> type | None:
    """Class of a message type; what a bag names is imported only where it is a message package."""
    try:
        kind = message_class(name)
        definition(name)
    except (FileNotFoundError, ImportError, AttributeError):
        return None
    return kind


def _means_the_same(node: Any, publisher: Any, digest: str) -> bool:
    """Whether the installed type is the recorded one, as far as the bag says which it was."""
    for one in node.get_publishers_info_by_topic(publisher.topic_name):
        if is_of(node, one) and digest.startswith('RIHS01_') and str(one.topic_type_hash) != digest:
            return False
    return True


KEPT = ('transient_local', 1)  # as rosbag2 writes it: a word, or the number of the middleware
LATE = 100  # messages kept for late comers where the recorded depth is not known
LONGEST = 10_000  # characters of a profile that is read


def offered_again(recorded: str, *, volatile: bool = False) -> QoSProfile:
    """Profile for publishing a recorded topic.

    It is reliable, which every subscription accepts, and as durable as it was recorded.

    Parameters
    ----------
    recorded : offered profiles as rosbag2 writes them into a channel; empty: not known
    volatile : keep nothing for late comers, whatever was recorded

    """
    depths = [] if volatile else _kept(recorded)
    durability = DurabilityPolicy.TRANSIENT_LOCAL if depths else DurabilityPolicy.VOLATILE
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=max(depths) if depths else DEPTH,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


def _kept(recorded: str) -> list[int]:
    """Depths of the profiles that keep messages for late comers."""
    profiles = offered_profiles(recorded) if len(recorded) < LONGEST else []
    kept = [p for p in profiles if isinstance(p, dict) and p.get('durability') in KEPT]
    depths = [profile.get('depth') for profile in kept]
    return [d if isinstance(d, int) and 0 < d <= DEPTH else LATE for d in depths]


ACKNOWLEDGED = Duration(seconds=0.5)
STAMPED = {Twist: TwistStamped, Wrench: WrenchStamped}  # of what has no header


class Commands:
    """Commands that a vehicle may hear.

    Parameters
    ----------
    publishers : name -> publisher
    heard : whether they go to nodes that act on them

    """

    def __init__(self, publishers: Mapping[str, Publisher], heard: bool):
        self._publishers, self._heard = publishers, heard
        self._last: dict[str, Wrench | WrenchStamped] = {}

    def check(self, name: str, data: bytes) -> None:
        """Raise BadMessageError for a command that must not go out: one that is not finite."""
        publisher = self._publishers.get(name)
        plain: Any = publisher.msg_type if publisher is not None else None
        kind = STAMPED.get(plain, plain)
        read = KINDS[kind].read if kind in KINDS else None
        if read is None:
            return
        message = stamped = message_of(data, plain, name)
        if kind is not plain:
            stamped = kind(**{plain.__name__.lower(): message})
        child = getattr(stamped, 'child_frame_id', stamped.header.frame_id)
        read(stamped, Frames(stamped.header.frame_id, child), name)
        if isinstance(stamped, WrenchStamped):
            self._last[name] = message

    def let_go(self) -> None:
        """Publish a zero wrench where a vehicle holds the last one."""
        for name, last in self._last.items() if self._heard else ():
            still = isinstance(last, WrenchStamped)
            self._publishers[name].publish(WrenchStamped(header=last.header) if still else Wrench())
            self._publishers[name].wait_for_all_acked(ACKNOWLEDGED)
        self._last.clear()


class CommandGuard:
    """Watches who subscribes to the commands of a replay.

    Parameters
    ----------
    node : that publishes them
    publishers : recorded name -> publisher, of the guarded commands alone
    foreign : publish them to whomever

    Attributes
    ----------
    stopped : why no more commands are published; empty: they are

    """

    def __init__(self, node: Any, publishers: Mapping[str, Any], foreign: bool):
        self._node, self._publishers, self._foreign = node, publishers, foreign
        self._judged: dict[str, int] = {}  # topic -> number of subscribers that are known
        self._strange: dict[str, float] = {}  # topic -> since when one of them has no name
        self.stopped = ''

    def refusal(self, *, final: bool) -> InputError | None:
        """Why commands must not be published at all; `final`: a name does not come any more."""
        if self._foreign:
            return None
        for publisher in self._publishers.values():
            found = self._actors(publisher)
            if found and (final or found != [NAMELESS]):
                key, expected = publisher.topic_name, 'nobody who acts on recorded commands'
                names = f'{", ".join(found)} (allowed by --force-commands)'
                return InputError(self._node.get_name(), key, expected, names)
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
            self._node.graph.complain(f'commands are not published any more: {self.stopped}')
            return False
        self._judged[topic] = count
        return True


WINDOW = 1000  # messages of a topic that may be under way: far fewer than subscribers keep
ANSWERS = 2  # the first may come from the moment before the data arrived, the next does not
PATIENCE = 10.0  # s, after which a subscriber that does not answer is not waited for any more
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
        self.silent: list[str] = []

    def find(self) -> None:
        """Look for subscribers that can be asked."""
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

    def ask(self, *, always: bool) -> None:
        """Go on asking; begin when half of a window is used, or `always` when it is used at all."""
        if self._round is None:
            enough = 1 if always else WINDOW // 2
            used = (self._sent[name] - taken for name, taken in self._taken.items())
            if max(used) < enough:
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
        wrench = topics.Topic(topic, topics.WRENCH.type)
        graph.subscribe(wrench, self._take, topics.every_step())

    def _take(self, data: bytes, _: dict[str, Any]) -> None:
        if first_stamp(data, self._topic) == self._asked:
            self._asked = None

    def expect(self, topic: str, kind: str, data: bytes) -> None:
        """Wait for the answer to an odometry that goes out; BadMessageError without a stamp."""
        if is_odometry(topic, kind):
            self._asked, self._since = first_stamp(data, topic), time.monotonic()

    def are_complete(self) -> bool:
        """Whether no answer is waited for."""
        return self._asked is None

    def overdue(self) -> str:
        """The subscriber or answer that is overdue, or an empty text."""
        if self._asked is None or time.monotonic() - self._since < PATIENCE:
            return ''
        seconds = self._asked / NANOSECONDS
        return f'no answer on {self._topic} to the odometry of {seconds:g} s for {PATIENCE:g} s'


def is_odometry(topic: str, kind: str) -> bool:
    """Whether a law answers the messages of a recorded topic."""
    return role_of(topic) == interface.ODOM and kind == ODOMETRY
