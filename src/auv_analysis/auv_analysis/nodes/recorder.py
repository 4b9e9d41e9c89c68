"""Parts of the recorder: parameters, clock, choice of topics, time of arrival."""

import re
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.subscription import Subscription

from auv_analysis.bag.metadata import RECORDING, recording_text
from auv_analysis.bag.output import LEAST_DURATION, LEAST_SIZE, Storage
from auv_analysis.bag.ros2msg import schema_text
from auv_analysis.bag.writer import BagWriter
from auv_analysis.graph.node_settings import ALL, RecorderSettings
from auv_dynamics.files.errors import InputError, first_line, refusing
from auv_dynamics.files.nearest import meant
from auv_dynamics.files.yaml_files import read_text
from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import qos_conflict
from auv_dynamics.ros.interface import DEPTH, GLOBALS, NANOSECONDS
from auv_dynamics.ros.node_main import BulkNode
from auv_dynamics.ros.rclpy_internals import RCLError, raw_class
from auv_dynamics.ros.topics import message_class

UNRECORDED = ('/rosout', '/parameter_events')  # unless they are asked for by name
Take = Callable[[str, str, bytes, dict[str, Any]], None]  # topic, type, message, what is known
EPOCH = 86_400 * NANOSECONDS  # ns between two clocks, from which they have different epochs
EARLY_TIME = 60.0  # s that messages wait for the first step, which tells the time of the graph
EARLY_COUNT, EARLY_SIZE = 10_000, 1 << 24  # messages and bytes that wait at most
Entry = tuple[str, str, bytes, dict[str, Any]]  # topic, type, message, what is known of its way


@dataclass(frozen=True)
class Wanted:
    """Choice of topics recorded beside those of the graph.

    Attributes
    ----------
    namespace : of the recorder; what lies in it is recorded
    extra : full names, or 'all'
    exclude : what is found in a name that is not recorded; None: nothing

    """

    namespace: str
    extra: tuple[str, ...] = ()
    exclude: re.Pattern[str] | None = None

    def __contains__(self, topic: str) -> bool:
        if self.exclude and self.exclude.search(topic):
            return False
        if topic in self.extra:
            return True
        if topic in UNRECORDED:
            return False
        inside = topic.startswith(f'{self.namespace.rstrip("/")}/')
        return inside or topic in GLOBALS or ALL in self.extra


class OtherTopics:
    """Subscribes to topics as they appear, with the quality of service that is offered.

    Parameters
    ----------
    node : the recorder
    wanted : which
    take : gets every message

    Attributes
    ----------
    left : topic -> why it is not recorded

    """

    def __init__(self, node: BulkNode, wanted: Wanted, take: Take):
        self._node, self._wanted, self._take = node, wanted, take
        self._heard: dict[str, Subscription] = {}
        self._kinds: dict[str, str] = {}
        self.left: dict[str, str] = {}

    def look(self, ours: set[str]) -> None:
        """Subscribe to what has appeared, but for `ours`, and follow publishers that have come."""
        for topic, _ in self._node.get_topic_names_and_types():
            if topic in ours or topic in self.left or topic not in self._wanted:
                continue
            found = self._node.get_publishers_info_by_topic(topic)
            if found:
                kind = self._kinds.setdefault(topic, found[0].topic_type)
                follow = self._adapt if topic in self._heard else self._begin
                follow(topic, [one for one in found if one.topic_type == kind])
                for other in {one.topic_type for one in found} - {kind}:
                    self._leave(f'{topic} of {other}', f'it is recorded as {kind}')

    def _begin(self, topic: str, publishers: list[Any]) -> None:
        kind = self._kinds[topic]
        try:
            schema_text(kind)
        except (OSError, ValueError):
            self._leave(topic, f'no definition of {kind}')
            return
        self._subscribe(topic, adapted(publishers))

    def _adapt(self, topic: str, publishers: list[Any]) -> None:
        """Ask for less where a publisher would not be heard, never for more."""
        asked = self._heard[topic].qos_profile
        if not any(qos_conflict(one.qos_profile, asked) for one in publishers):
            return
        self._node.take_data()
        self._node.drop_data(self._heard.pop(topic))
        self._subscribe(topic, adapted(publishers, asked))

    def _subscribe(self, topic: str, qos: QoSProfile) -> None:
        kind = self._kinds[topic]
        # what comes late is seen at the next look
        events = SubscriptionEventCallbacks(use_default_callbacks=False)
        callback: Any = partial(self._take, topic, kind)
        try:
            subscription = self._node.create_subscription(
                _class(kind), topic, callback, qos, event_callbacks=events, raw=True
            )
        except (ImportError, RCLError) as error:
            self._leave(topic, first_line(error))
            return
        self._heard[topic] = subscription
        self._node.add_data(subscription)

    def _leave(self, topic: str, why: str) -> None:
        if topic not in self.left:
            node: Any = self._node
            node.get_logger().warning(f'{topic}: not recorded, {why}')
        self.left[topic] = why


def _class(kind: str) -> type:
    try:
        return message_class(kind)
    except Exception:  # a package that is not installed, or whatever it raises
        return raw_class(kind)


def adapted(publishers: list[Any], asked: QoSProfile | None = None) -> QoSProfile:
    """Profile that every publisher of a topic offers at least.

    Parameters
    ----------
    publishers : their endpoints
    asked : profile so far, of which nothing is asked anew; None: there is none

    """
    offered = [one.qos_profile for one in publishers] + ([asked] if asked else [])
    reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offered)
    kept = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offered)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if kept else DurabilityPolicy.VOLATILE,
    )


class GraphClock:
    """Time of the graph: that of the steps in lock-step, else of the node's clock.

    Where a driver stamps by a clock of another epoch, the node's clock is moved there by the first
    step, so that all of a bag lies together.

    Attributes
    ----------
    latest : newest stamp of a step, ns; -1 before the first
    early : messages that came before the time was known

    """

    def __init__(self, node: BulkNode, strict: bool):
        self._node, self._strict, self.latest = node, strict, -1
        self.simulated = strict or bool(node.get_parameter('use_sim_time').value)
        self._offset: int | None = None
        self._newest: int | None = None  # stamp of a step
        self.early: list[Entry] = []
        self._since = 0.0  # steady s

    def follow(self, ns: int) -> None:
        """Note the stamp of a step."""
        self.latest, self._newest = max(self.latest, ns), ns
        if self._offset is None:
            apart = ns - self._node.get_clock().now().nanoseconds
            self._offset = apart if abs(apart) > EPOCH else 0

    def is_near(self, ns: int) -> bool:
        """Whether a stamp is of the epoch of the newest step, as far as that is known."""
        return self._newest is None or abs(ns - self._newest) <= EPOCH

    def now(self, received: int | None) -> int | None:
        """Time in ns of a message that came at `received` of the system's; None: not known yet."""
        if not self.simulated:
            wall = received or int(self._node.get_clock().now().nanoseconds)
            return None if self._offset is None else max(0, wall + self._offset)
        told = 0 if self._strict else int(self._node.get_clock().now().nanoseconds)
        return told or (self.latest if self.latest >= 0 else None)

    def hold(self, entry: Entry) -> None:
        """Let a message wait until the time is known."""
        self._since = self._since or time.monotonic()
        self.early.append(entry)

    def released(self, *, ends: bool = False) -> list[Entry]:
        """Messages that have waited, once the time is known; the wait is bounded."""
        late = time.monotonic() - self._since > EARLY_TIME
        size = sum(len(message) for _, _, message, _ in self.early)
        if ends or late or len(self.early) > EARLY_COUNT or size > EARLY_SIZE:
            # without a step the time is the node's, zero where it is simulated
            self.latest, self._offset = max(self.latest, 0), self._offset or 0
        waiting, self.early = self.early, []
        return waiting


def make_writer(node: Node, p: RecorderSettings) -> BagWriter:
    """Open the bag, once the settings are checked; InputError when something is wrong."""
    name, bag, known = node.get_name(), Path(p.bag), [topic.name for topic in topics.STEP_TOPICS]
    for topic in p.topics:
        if topic not in known:
            listed = f'step topics: {", ".join(known)}{meant(topic, known)}'
            raise InputError(name, 'topics', listed, topic)
    attachments = {}
    for entry in p.attachments:
        label, equals, path = entry.partition('=')
        source = Path(path if equals else label)
        attachments[label if equals else source.name] = read_text(source, 'attachment')
    attachments[RECORDING] = recording_text(p.strict, remapped(node), node.get_namespace())
    if 0 < p.max_duration < LEAST_DURATION:
        expected = f'0 for one file, or at least {LEAST_DURATION:g} s'
        raise InputError(name, 'storage.max_duration', expected, p.max_duration)
    least = LEAST_SIZE + sum(len(text.encode()) for text in attachments.values())
    if 0 < p.max_size < least:
        expected = f'0 for one file, or at least {least} bytes with these attachments'
        raise InputError(name, 'storage.max_size', expected, p.max_size)
    if p.free_space:
        there = next((folder for folder in bag.absolute().parents if folder.is_dir()), Path('/'))
        free = shutil.disk_usage(there).free
        if free < p.free_space:
            expected = f'at most what is free on the file system of {bag}'
            raise InputError(name, 'storage.free_space', expected, f'{free} bytes free')
    longest = round(p.max_duration * NANOSECONDS)
    pace = node.resolve_topic_name(p.topics[0]) if p.topics else ''
    storage = Storage(p.compression, p.chunk_size, p.max_size, longest, pace, p.free_space)
    with refusing(bag, '', 'a folder without a bag that can be written'):
        return BagWriter(bag, attachments, storage)


def make_wanted(node: Node, p: RecorderSettings) -> Wanted:
    """Topics beside those of the graph."""
    name, extra = node.get_name(), []
    for topic in p.extra_topics:
        try:
            extra.append(topic if topic == ALL else node.resolve_topic_name(topic))
        except (RCLError, ValueError):
            expected = f'names of topics, or {ALL}'
            raise InputError(name, 'extra_topics', expected, topic) from None
    try:
        pattern = re.compile(p.exclude) if p.exclude else None
    except (re.error, RecursionError, OverflowError) as error:
        raise InputError(name, 'exclude', f'a regular expression ({error})', p.exclude) from None
    return Wanted(node.get_namespace(), tuple(extra), pattern)


def remapped(node: Node) -> dict[str, str]:
    """Topics of ours that have another name here -> what they would be called in this namespace."""
    space = node.get_namespace().rstrip('/')
    names = {}
    for topic in topics.TOPICS:
        usual = topic.name if topic.name.startswith('/') else f'{space}/{topic.name}'
        if (resolved := node.resolve_topic_name(topic.name)) != usual:
            names[resolved] = usual
    return names
