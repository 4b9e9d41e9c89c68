"""Publishers of recorded topics, and the guard of those that a vehicle may act on."""

from collections.abc import Callable, Mapping
from typing import Any

import yaml
from geometry_msgs.msg import WrenchStamped
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from auv_analysis.bag.ros2msg import definition
from auv_analysis.replay.played_bag import PlayedTopic
from auv_analysis.replay.selection import Selection
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.codec import KINDS, message_of
from auv_dynamics.ros.endpoints import NAMED, NAMELESS, acts, full_name, is_of, other_subscribers
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.node_interface import NodeInterface
from auv_dynamics.ros.topics import DEPTH, Topic, message_class


def make_publishers(
    graph: NodeInterface, recorded: dict[str, PlayedTopic], selection: Selection
) -> dict[str, Any]:
    """Publishers by recorded name; what cannot be published moves to `selection.left_out`.

    Parameters
    ----------
    graph : of the node
    recorded : recorded name -> how it was recorded
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
    try:
        profiles: Any = yaml.safe_load(recorded) if len(recorded) < LONGEST else None
    except (yaml.YAMLError, ValueError, RecursionError):
        return []
    if not isinstance(profiles, list):
        return []
    kept = [p for p in profiles if isinstance(p, dict) and p.get('durability') in KEPT]
    depths = [profile.get('depth') for profile in kept]
    return [d if isinstance(d, int) and 0 < d <= DEPTH else LATE for d in depths]


ACKNOWLEDGED = Duration(seconds=0.5)


class Commands:
    """Commands that a vehicle may hear.

    Parameters
    ----------
    publishers : name -> publisher
    heard : whether they go to nodes that act on them

    """

    def __init__(self, publishers: Mapping[str, Publisher], heard: bool):
        self._publishers, self._heard = publishers, heard
        self._last: dict[str, WrenchStamped] = {}

    def check(self, name: str, data: bytes) -> None:
        """Raise BadMessageError for a command that must not go out: one that is not finite."""
        publisher = self._publishers.get(name)
        kind = KINDS.get(publisher.msg_type) if publisher is not None else None
        if publisher is None or kind is None or kind.read is None:
            return
        message = message_of(data, publisher.msg_type, name)
        child = getattr(message, 'child_frame_id', message.header.frame_id)
        kind.read(message, Frames(message.header.frame_id, child), name)
        if isinstance(message, WrenchStamped):
            self._last[name] = message

    def let_go(self) -> None:
        """Publish a zero wrench where a vehicle holds the last one."""
        for name, last in self._last.items() if self._heard else ():
            self._publishers[name].publish(WrenchStamped(header=last.header))
            self._publishers[name].wait_for_all_acked(ACKNOWLEDGED)
        self._last.clear()


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
