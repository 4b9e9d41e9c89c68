"""Common parts of all nodes: publishers, subscriptions, start barrier, diagnostics."""

import math
import re
import time
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidServiceNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSPolicyKind, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.task import Future
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import meant
from auv_dynamics.ros.codec import Codec
from auv_dynamics.ros.convert import stamp
from auv_dynamics.ros.endpoints import crowds, has_conflict, onlookers, why_silent
from auv_dynamics.ros.interface import BadMessageError, Frames
from auv_dynamics.ros.parameters import declare
from auv_dynamics.ros.rclpy_internals import has_data_path
from auv_dynamics.ros.settings import GraphSettings, read_settings
from auv_dynamics.ros.topics import (
    ANALYSIS_TOPICS,
    CLOCK,
    DIAGNOSTICS,
    SINGLE,
    STEP_TOPICS,
    Topic,
    every_step,
    one_at_a_time,
)

DIAGNOSTICS_PERIOD = 1.0  # s
LOUD = 1.0  # s between two reports of the same kind
ASK_AGAIN = 1.0  # s: an answer is lost when it comes before both ends have matched
LASTING = 1.0  # s, after which what is wrong is logged: names and matches may come late
REPEATED = 10.0  # s between two logs of what is wrong and lasts
SILENT = 2.0  # s without odometry in real time, after which it is missed
OK, WARN = DiagnosticStatus.OK, DiagnosticStatus.WARN
STALE, ERROR = DiagnosticStatus.STALE, DiagnosticStatus.ERROR
WORSE = (OK, WARN, STALE, ERROR)
NUMBER = re.compile(r'[-+]?\d')  # with the first one reports of the same kind may begin to differ
Health = tuple[bytes, str]  # level of a DiagnosticStatus, and why it is not OK


def kind_of(text: str) -> str:
    """Key shared by reports of the same kind."""
    return NUMBER.split(text, maxsplit=1)[0]


def worst(found: list[Health]) -> Health:
    """The worst of some that have a text."""
    return max(
        (one for one in found if one[1]), key=lambda one: WORSE.index(one[0]), default=(OK, '')
    )


def hears_odometry(node: Any, topic: Topic, last: float | None) -> Health:
    """Whether a node hears it, in lock-step whether it ever did; `last`: when, steady clock, s."""
    if last is None:
        return STALE, why_silent(node, topic) or 'no odometry yet'
    since = time.monotonic() - last
    if node.lockstep or since < SILENT:
        return OK, ''
    return STALE, why_silent(node, topic) or f'no odometry for {since:.0f} s'


class Lasting:
    """Logs what is wrong once it lasts, then now and then, and that it is over.

    Parameters
    ----------
    logger : of the node

    """

    def __init__(self, logger: Any):
        self._logger = logger
        self._kind, self._text = '', ''
        self._since = self._said = -math.inf

    def see(self, level: bytes, text: str) -> None:
        """Take the present state; an empty text: nothing is wrong."""
        now, kind = time.monotonic(), kind_of(text)
        if kind != self._kind:
            if self._said > self._since and not text:
                self._logger.info(f'over: {self._text}')
            self._kind, self._since, self._said = kind, now, -math.inf
        self._text = text
        if text and now - self._since >= LASTING and now - self._said >= REPEATED:
            self._said = now
            if level == ERROR:
                self._logger.error(text)
            else:
                self._logger.warning(text)


def steady_timer(node: Node, period: float, callback: Callable[[], None]) -> Timer:
    """Timer on the steady clock, whatever `use_sim_time` says."""
    return node.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


class NodeInterface:
    """Interface shared by every node of the graph.

    Declares `lockstep`, `odom_frame`, `base_frame` and `expected_subscribers`, offers `~/ready`,
    publishes `/diagnostics` and reports what is refused.

    Parameters
    ----------
    node : that it is of
    barrier : whether these parameters are declared
    lockstep : without them: whether the node waits for nothing but messages

    """

    def __init__(self, node: Any, *, barrier: bool = True, lockstep: bool = False):
        self.node = node
        self.publishers: dict[str, Publisher] = {}
        self.trouble = ''
        self.refused: Counter[str] = Counter()  # how often, by what was wrong
        self.latest_ns = 0
        self.facts: dict[str, Any] = {}
        self.hardware_id = node.get_namespace().strip('/')  # the vehicle, by its name if known
        self._said: dict[str, float] = {}
        self._ready = False
        self._not_ready: Callable[[], str] = str
        self._reasons: list[Callable[[], Health]] = [self._crowd, self._conflict]
        self._lasting = Lasting(node.get_logger())
        self._single: set[Topic] = set()  # that are for one publisher and concern this node
        self._conflicts: dict[str, Topic] = {}  # by what was said of them
        self._expected: dict[str, int] = {}
        self.frames = Frames()
        self.must_hold = 0  # messages: a publisher of step topics needs a greater depth
        if barrier:
            common = read_settings(GraphSettings, partial(declare, node), node.get_name())
            lockstep = common.lockstep
            self.frames = Frames(common.odom_frame, common.base_frame)
            self._expected = self._counts(common.expected_subscribers)
        node.lockstep = lockstep
        self._diagnostics = node.create_publisher(
            DIAGNOSTICS.type, DIAGNOSTICS.name, one_at_a_time()
        )
        node.create_service(Trigger, '~/ready', self._answer_ready)
        steady_timer(node, DIAGNOSTICS_PERIOD, self.publish_diagnostics)

    def publisher(self, topic: Topic, qos: QoSProfile | None = None) -> Publisher:
        """Publisher of a topic, by default one that loses nothing."""
        events = PublisherEventCallbacks(
            incompatible_qos=lambda event: self._incompatible(topic, event),
            use_default_callbacks=False,
        )
        publisher = self.node.create_publisher(
            topic.type,
            topic.name,
            qos or every_step(),
            event_callbacks=events,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(
                callback=lambda used: self._deep_enough(topic, used)
            ),
        )
        self.publishers[topic.name] = publisher
        self._single |= {topic} & SINGLE
        return publisher

    def codec(self, topic: Topic) -> Codec:
        """Numbers <-> messages of a topic; in real time message objects, as rclpy has them."""
        return Codec(
            topic.type, self.frames, topic.name, patched=self.node.lockstep and has_data_path()
        )

    def output(self, topic: Topic) -> Callable[[int, Any], None]:
        """Publisher of a topic as a function of a stamp in ns and the numbers."""
        publish = self.publisher(topic).publish
        encode = self.codec(topic).encode
        return lambda ns, values: publish(encode(ns, values))

    def listen(
        self, topic: Topic, callback: Callable[[int, tuple[float, ...]], None], qos: QoSProfile
    ) -> None:
        """Subscription to the stamps in ns and the numbers of a topic; broken ones are refused.

        So are those for which the callback raises ValueError.
        """
        codec = self.codec(topic)

        def take(data: bytes, _: dict[str, Any]) -> None:
            try:
                callback(*codec.decode(data))
            except ValueError as error:
                raise BadMessageError(str(error)) from error

        self.subscribe(topic, take, qos)

    def subscribe(
        self, topic: Topic, callback: Callable[[bytes, dict[str, Any]], None], qos: QoSProfile
    ) -> None:
        """Subscription to the serialized messages of a topic, which a data path may serve.

        The callback gets what rclpy knows of a message's way as well; a message for which it raises
        BadMessageError is refused. An incompatible publisher is an error that is heard.
        """

        def take(data: bytes, way: dict[str, Any]) -> None:
            try:
                callback(data, way)
            except BadMessageError as error:
                text = str(error)
                self.refuse(text if text.startswith(topic.name) else f'{topic.name}: {text}')

        events = SubscriptionEventCallbacks(
            incompatible_qos=lambda event: self._incompatible(topic, event),
            use_default_callbacks=False,
        )
        subscription = self.node.create_subscription(
            topic.type,
            topic.name,
            take,
            qos,
            event_callbacks=events,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            raw=True,
        )
        self.node.add_data(subscription)
        self._single |= {topic} & SINGLE

    def ready(self) -> bool:
        """Whether every expected subscriber has matched; once true it stays true."""
        self._ready = self._ready or not self._missing()
        return self._ready

    def also_ready_when(self, reason: Callable[[], str]) -> None:
        """Add a condition to `~/ready`: `reason` says why not, or gives an empty text."""
        self._not_ready = reason

    def in_trouble_while(self, reason: Callable[[], Health]) -> None:
        """Let diagnostics and log say what is wrong for as long as `reason` gives a text."""
        self._reasons.append(reason)

    def refuse(self, text: str) -> None:
        """Say loudly that a message was refused."""
        self.refused[text.partition('expected')[0].rstrip(': ')] += 1
        self.complain(f'refused: {text}')

    def complain(self, text: str) -> None:
        """Log an error and keep it for the diagnostics; the like of it at most once a second."""
        # rclpy's own throttling looks at the simulated clock, which may stand still
        now, kind = time.monotonic(), kind_of(text)
        if now - self._said.get(kind, -LOUD) >= LOUD:
            self._said = {k: at for k, at in self._said.items() if now - at < LOUD}
            self._said[kind] = now
            self.node.get_logger().error(text)
        self.trouble = text

    def publish_diagnostics(self) -> None:
        """Publish this node's health, stamped with the latest step."""
        status = DiagnosticStatus(name=self.node.get_fully_qualified_name())
        status.hardware_id = self.hardware_id
        level, text = worst([ask() for ask in self._reasons])
        self._lasting.see(level, text)
        status.level = ERROR if self.trouble else level
        status.message = '; '.join(filter(None, (text, self.trouble))) or 'ok'
        refused = {f'refused {kind}': count for kind, count in sorted(self.refused.items())}
        count = self.refused.total()
        facts = {'ready': self._ready, 'refused': count, **self.facts, **refused}
        status.values = [KeyValue(key=key, value=str(value)) for key, value in facts.items()]
        message = DiagnosticArray(status=[status])
        message.header.stamp, message.header.frame_id = stamp(self.latest_ns), self.frames.base
        self._diagnostics.publish(message)
        self.trouble = ''

    def _crowd(self) -> Health:
        """Topics for a single publisher that have more of them, and the publishers' names."""
        clock = {CLOCK} if self.node.get_parameter('use_sim_time').value else set()
        return ERROR, '; '.join(crowds(self.node, self._single | clock))

    def _deep_enough(self, topic: Topic, qos: QoSProfile) -> SetParametersResult:
        name = f'qos_overrides.{self.node.resolve_topic_name(topic.name)}.publisher.depth'
        if topic in STEP_TOPICS and qos.depth <= self.must_hold:
            expected = f'more than {self.must_hold}, the steps that may be under way'
            raise InputError(self.node.get_name(), name, expected, qos.depth)
        return SetParametersResult(successful=True)

    def _counts(self, listed: Sequence[str]) -> dict[str, int]:
        known = [topic.name for topic in (*STEP_TOPICS, *ANALYSIS_TOPICS)]
        counts = {}
        for entry in listed:
            topic, _, count = entry.partition('=')
            if topic not in known or not count.isdecimal():
                expected = f'topic=count with a topic of {", ".join(known)}{meant(topic, known)}'
                raise InputError(self.node.get_name(), 'expected_subscribers', expected, entry)
            counts[topic] = int(count)
        return counts

    def _missing(self) -> str:
        for topic, count in self._expected.items():
            publisher = self.publishers.get(topic)
            found = publisher.get_subscription_count() if publisher else 0
            if publisher and found >= count:  # who only looks on is not waited for, nor counted
                found -= onlookers(self.node, publisher, self.node.get_namespace())
            if found < count:
                return f'{topic}: expected {count} subscribers, found {found}'
        return ''

    def _answer_ready(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        reason = self._not_ready() or ('' if self.ready() else self._missing())
        response.success, response.message = not reason, reason or 'ready'
        return response

    def _conflict(self) -> Health:
        """Whom this node does not hear, or who does not hear it, for as long as that lasts."""
        told = self._conflicts.items()
        return ERROR, next((text for text, topic in told if has_conflict(self.node, topic)), '')

    def _incompatible(self, topic: Topic, event: Any) -> None:
        policy = QoSPolicyKind(event.last_policy_kind).name.lower()
        text = f'{topic.name}: incompatible QoS with another endpoint: {policy}'
        self._conflicts[text] = topic
        self.complain(text)


class Peers:
    """Asks the `~/ready` of other nodes until each has said yes.

    Parameters
    ----------
    node : that asks
    names : of the nodes, relative to its namespace

    Raises
    ------
    InputError : a node cannot have such a name

    """

    def __init__(self, node: Node, names: list[str]):
        try:
            self._clients = {name: node.create_client(Trigger, f'{name}/ready') for name in names}
        except InvalidServiceNameException:
            raise InputError(node.get_name(), 'start_after', 'names of nodes', names) from None
        self._pending: dict[str, tuple[float, Future]] = {}
        self._ready: set[str] = set()
        if names:
            self._timer = steady_timer(node, 0.05, self._ask)

    def not_ready(self) -> str:
        """Name of the first node that has not said yes, or an empty text."""
        return next((name for name in self._clients if name not in self._ready), '')

    def _ask(self) -> None:
        for name, client in self._clients.items():
            if name in self._ready or not client.service_is_ready():
                continue
            asked, future = self._pending.get(name, (0.0, None))
            if future is None or time.monotonic() - asked > ASK_AGAIN:
                self._pending[name] = (time.monotonic(), client.call_async(Trigger.Request()))
            elif future.done():
                if future.result() is not None and future.result().success:
                    self._ready.add(name)
                del self._pending[name]
        if not self.not_ready():
            self._timer.cancel()
