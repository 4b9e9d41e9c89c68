"""State of a live graph: rates and gaps of its topics, its motion, its problems."""

import math
from bisect import bisect_right
from collections import OrderedDict, deque
from collections.abc import Mapping
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from auv_analysis.metrics.coupling import LiveAnalysis
from auv_analysis.watch.snapshot import (
    Alert,
    Energy,
    Errors,
    NodeState,
    Six,
    Snapshot,
    TopicState,
)
from auv_dynamics.ros import interface
from auv_dynamics.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from auv_dynamics.ros.endpoints import Endpoints

WINDOW = 2.5  # s over which rates are formed
SHORTEST = 0.2  # s: no rate from less
STEPS = 32  # differences of stamps whose median is the topic's step
ENOUGH = 8  # differences before a gap can be told
GAP = 1.5  # steps between two stamps that follow each other: one is missing
CAPACITY = 4096  # set-points that are kept; more than any horizon that is accepted
PENDING = 512  # messages that wait for the one of the same stamp
FRESH = 3.0  # s for which an analysis that was published is shown
HELD_NS = interface.NANOSECONDS  # how far a set-point may lie behind the odometry
VELOCITY = 7  # numbers of a state before its velocity: position and quaternion
BUCKET, BUCKETS = 0.5, 20  # s, and how many of them errors are shown of


class Stream:
    """State of one topic.

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
        if anew or since < -HELD_NS:  # the clock begins anew, as in a loop of a replay
            self._window.clear()
        if anew:
            self._steps.clear()
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
        return ns / interface.NANOSECONDS / span if span >= SHORTEST else None

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


class Bucket(NamedTuple):
    """Samples (6,) of half a second: steady time of the first, largest sizes, squares, how many."""

    begin: float
    largest: np.ndarray
    squares: np.ndarray
    samples: int


class Trend:
    """The last ten seconds of six numbers that come in at steady times."""

    def __init__(self) -> None:
        self._buckets: deque[Bucket] = deque()

    def add(self, now: float, values: np.ndarray) -> None:
        """Take a sample (6,) at a steady time in s."""
        while self._buckets and now - self._buckets[0].begin >= BUCKET * BUCKETS:
            self._buckets.popleft()
        size = np.abs(values)
        new = Bucket(now, size, size * size, 1)
        if self._buckets and now - self._buckets[-1].begin < BUCKET:
            last = self._buckets.pop()
            largest = np.maximum(last.largest, size)
            new = Bucket(last.begin, largest, last.squares + new.squares, last.samples + 1)
        self._buckets.append(new)

    @property
    def largest(self) -> Six | None:
        """Largest absolute values (6,), or None without a sample."""
        if not self._buckets:
            return None
        return tuple(np.max([bucket.largest for bucket in self._buckets], axis=0).tolist())

    @property
    def rms(self) -> Six | None:
        """Root mean squares (6,) of the samples, or None without one."""
        count = sum(bucket.samples for bucket in self._buckets)
        if not count:
            return None
        squares = np.sum([bucket.squares for bucket in self._buckets], axis=0)
        return tuple(np.sqrt(squares / count).tolist())

    @property
    def history(self) -> tuple[Six, ...]:
        """Largest absolute values (6,) of each half second, the oldest first."""
        return tuple(tuple(bucket.largest.tolist()) for bucket in self._buckets)


class LiveMotion:
    """The newest numbers of each topic and what follows from them.

    Parameters
    ----------
    live : analysis of the vehicle, for what the graph does not publish itself

    Attributes
    ----------
    source : topic of the velocity; the true one, where it is published
    ns, nu, nu_d : stamp, velocity and set-point; the newest ones that belong together
    tau, lumped_error : newest values

    """

    def __init__(self, live: LiveAnalysis | None = None):
        self._live = live
        self.forget()

    def forget(self) -> None:
        """Begin anew, as another run does."""
        self.source: str | None = None
        self.ns: int | None = None
        self.nu: Six | None = None
        self.nu_d: Six | None = None
        self.tau: Six | None = None
        self.lumped_error: Six | None = None
        self._paired = -math.inf  # when a velocity was last heard together with its set-point
        self._stamps: list[int] = []
        self._setpoints: list[Six] = []
        self._pending: dict[str, OrderedDict[int, Six]] = {
            name: OrderedDict() for name in (interface.DISTURBANCE, interface.DISTURBANCE_ESTIMATE)
        }
        self._published: dict[str, tuple[float, Six]] = {}

    def hear(self, now: float, topic: str, ns: int, values: Six) -> None:
        """Take the numbers of a message: steady time in s, stamp in ns."""
        if topic in (interface.ODOM, interface.GROUND_TRUTH):
            self._move(now, topic, ns, values[VELOCITY:])
        elif topic == interface.CMD_VEL:
            self._keep_setpoint(ns, values)
        elif topic == interface.WRENCH:
            self.tau = values
        elif topic in self._pending:
            self._match(topic, ns, values)
        elif topic in interface.ANALYSIS_TOPICS:
            self._published[topic] = now, values

    def _move(self, now: float, topic: str, ns: int, nu: Six) -> None:
        if topic == interface.ODOM and self.source == interface.GROUND_TRUTH:
            return
        if topic != self.source:
            self.source, self._trend = topic, Trend()
        nu_d = self._setpoint(ns)
        if nu_d is not None:
            self._trend.add(now, np.subtract(nu_d, nu))
            self._paired = now
        if nu_d is not None or now - self._paired > FRESH:
            self.ns, self.nu, self.nu_d = ns, nu, nu_d

    def _keep_setpoint(self, ns: int, values: Six) -> None:
        del self._stamps[bisect_right(self._stamps, ns) :]  # of an earlier run
        del self._setpoints[len(self._stamps) :]
        self._stamps.append(ns)
        self._setpoints.append(values)
        if len(self._stamps) >= 2 * CAPACITY:
            del self._stamps[:CAPACITY], self._setpoints[:CAPACITY]

    def _setpoint(self, ns: int) -> Six | None:
        """Newest set-point at or before a stamp."""
        i = bisect_right(self._stamps, ns) - 1
        return self._setpoints[i] if i >= 0 and ns - self._stamps[i] <= HELD_NS else None

    def _match(self, topic: str, ns: int, values: Six) -> None:
        self._pending[topic][ns] = values
        F, f = (self._pending[name] for name in self._pending)
        if ns in F and ns in f:
            self.lumped_error = tuple(np.subtract(f[ns], F[ns]).tolist())
        while len(self._pending[topic]) > PENDING:
            self._pending[topic].popitem(last=False)

    @property
    def errors(self) -> Errors:
        """Velocity errors, now and lately."""
        if self.nu is None or self.nu_d is None:
            return Errors()
        trend, now = self._trend, np.subtract(self.nu_d, self.nu)
        largest, rms, window = trend.largest, trend.rms, BUCKET * BUCKETS
        return Errors(tuple(now.tolist()), largest, rms, window, trend.history)

    def published(self, now: float, topic: str) -> Six | None:
        """Newest numbers of an analysis topic, while it is alive."""
        at, values = self._published.get(topic, (now, None))
        return values if now - at < FRESH else None

    def energy(self, now: float) -> Energy | None:
        """Kinetic energy, as published or else computed."""
        components = self.published(now, interface.KINETIC_ENERGY)
        shares = self.published(now, interface.KINETIC_ENERGY_SHARES)
        if components is None or shares is None:
            if self._live is None or self.nu is None:
                return None
            components, shares = (tuple(x.tolist()) for x in self._live.energy(self.nu))
        return Energy(sum(components), components, shares)

    def delta_xi(self, now: float) -> Six | None:
        """Xi - nu, as published or else computed."""
        return self._coupling(now, interface.DELTA_XI, self.nu)

    def delta_pi(self, now: float) -> Six | None:
        """Pi - tau, as published or else computed."""
        return self._coupling(now, interface.DELTA_PI, self.tau)

    def _coupling(self, now: float, topic: str, values: Six | None) -> Six | None:
        found = self.published(now, topic)
        if found is not None or self._live is None or values is None:
            return found
        of = self._live.delta_xi if topic == interface.DELTA_XI else self._live.delta_pi
        return tuple(of(values).tolist())

    def lumped(self, now: float) -> Six | None:
        """W = f - F, as published or else computed."""
        return self.published(now, interface.LUMPED_ERROR) or self.lumped_error


STEP_TOPICS = (*interface.STEP_TOPICS, *interface.OPTIONAL_STEP_TOPICS)
EVEN = (*STEP_TOPICS, *interface.ANALYSIS_TOPICS)  # one publisher each, stamps at even distances
HEARD = (*EVEN, interface.PROGRESS, interface.DIAGNOSTICS)
KEPT = 30.0  # s for which what was wrong once is shown
MOST = 50  # different complaints and nodes that are kept
SILENT = 3.0  # s without a message of a topic that is published every step


class GraphMonitor:
    """State of one graph; all times are steady, in s.

    Parameters
    ----------
    domain, namespace : where is listened
    vehicle : for energy and couplings that the graph does not publish
    begin : when listening began

    """

    def __init__(
        self, domain: int, namespace: str = '/', vehicle: Vehicle | None = None, begin: float = 0.0
    ):
        self.domain, self.namespace, self._vehicle = domain, namespace, vehicle
        self._live = None if vehicle is None else LiveAnalysis(vehicle)
        self._motion = LiveMotion(self._live)
        self._streams = {name: Stream(judged=name in EVEN) for name in HEARD}
        self._refused = dict.fromkeys(HEARD, 0)
        self._begin = begin
        self._endpoints: Mapping[str, Endpoints] = {}
        self._since: dict[str, float] = {}  # when a topic was first seen to be published
        self._complaints: dict[str, tuple[str, int, float]] = {}
        self._nodes: dict[str, tuple[float, NodeState]] = {}

    def hear(self, now: float, topic: str, number: int | None, ns: int, values: Six | None) -> None:
        """Take a message: number by its publisher, stamp in ns, numbers where it carries some."""
        anew = self._streams[topic].hear(now, number, ns)
        if anew and topic in (self._motion.source, interface.ODOM):
            self._motion.forget()
        if values is not None:
            self._motion.hear(now, topic, ns, values)

    def refuse(self, now: float, topic: str, text: str) -> None:
        """Take note of a message that must not be used."""
        self._refused[topic] += 1
        self.complain(now, text)

    def complain(self, now: float, text: str) -> None:
        """Take note of an error; those that differ only in what was found are one."""
        text = ' '.join(text.split())
        key = text.partition(', found')[0]
        _, count, _ = self._complaints.pop(key, ('', 0, 0.0))
        self._complaints[key] = text, count + 1, now
        while len(self._complaints) > MOST:
            del self._complaints[next(iter(self._complaints))]

    def diagnose(self, now: float, state: NodeState) -> None:
        """Take what a node says of itself."""
        self._nodes.pop(state.name, None)
        self._nodes[state.name] = now, state
        while len(self._nodes) > MOST:
            del self._nodes[next(iter(self._nodes))]

    def see(self, now: float, endpoints: 'Mapping[str, Endpoints]') -> None:
        """Take who publishes and subscribes what."""
        self._endpoints = endpoints
        published = [name for name, ends in endpoints.items() if ends.publishers]
        self._since = {name: self._since.get(name, now) for name in published}
        for name, ends in endpoints.items():
            self._streams[name].publishers = ends.publishers

    @property
    def moves(self) -> bool:
        """Whether any message has come that is published every step."""
        return any(self._streams[name].heard for name in STEP_TOPICS)

    def snapshot(self, now: float) -> Snapshot:
        """All that is known."""
        motion, live = self._motion, self._live
        topics = tuple(self._topic(now, name) for name in HEARD)
        nodes = self._recent_nodes(now)
        source = self._streams.get(motion.source or '')
        recorded = self._streams[interface.PROGRESS].newest
        computed = live is not None and not (
            motion.published(now, interface.KINETIC_ENERGY)
            and motion.published(now, interface.DELTA_PI)
        )
        return Snapshot(
            domain=self.domain,
            namespace=self.namespace,
            vehicle=self._vehicle.name if self._vehicle else None,
            seconds=now - self._begin,
            motion=motion.source,
            time=None if motion.ns is None else motion.ns / interface.NANOSECONDS,
            pace=source.pace(now) if source else None,
            recorded=None if recorded is None else recorded / interface.NANOSECONDS,
            nu=motion.nu,
            nu_d=motion.nu_d,
            tau=motion.tau,
            velocity_error=motion.errors,
            lumped_error=motion.lumped(now),
            kinetic_energy=motion.energy(now),
            delta_xi=motion.delta_xi(now),
            delta_pi=motion.delta_pi(now),
            computed=computed,
            structural_zeros=live.structural_zeros if live else None,
            topics=topics,
            nodes=nodes,
            alerts=self._alerts(now, topics, nodes),
        )

    def _topic(self, now: float, name: str) -> TopicState:
        stream, ends = self._streams[name], self._endpoints.get(name)
        return TopicState(
            name,
            publishers=ends.publishers if ends else 0,
            subscribers=ends.subscribers if ends else 0,
            rate=stream.rate(now),
            age=stream.age(now),
            heard=stream.heard,
            published=stream.published,
            gaps=stream.gaps,
            repeats=stream.repeats,
            refused=self._refused[name],
        )

    def _recent_nodes(self, now: float) -> tuple[NodeState, ...]:
        """Nodes that were heard lately, by name."""
        found = []
        for name, (at, state) in sorted(self._nodes.items()):
            age = now - at
            if age < KEPT:
                level = 'stale' if age > SILENT else state.level
                found.append(NodeState(name, level, state.text, age, state.facts))
        return tuple(found)

    def _alerts(
        self, now: float, topics: tuple[TopicState, ...], nodes: tuple[NodeState, ...]
    ) -> tuple[Alert, ...]:
        """All that is wrong, errors first."""
        found = [
            Alert('error', text, count, now - at)
            for text, count, at in reversed(self._complaints.values())
            if now - at < KEPT
        ]
        for name, ends in self._endpoints.items():
            found += [Alert('error', text) for text in ends.conflicts]
            if ends.foreign:
                text = f'{name}: expected the type of this topic, found {ends.foreign}'
                found.append(Alert('error', text))
        found += [
            Alert(node.level, f'{node.name}: {node.text}', age=node.age)
            for node in nodes
            if node.level in ('warning', 'error')
        ]
        found += [
            Alert('warning', f'{one.name}: expected one publisher, found {one.publishers}')
            for one in topics
            if one.name in EVEN and one.publishers > 1
        ]
        found += self._silences(now, topics)
        return (*sorted(found, key=lambda alert: alert.level != 'error'), *self._unmatched(topics))

    def _silences(self, now: float, topics: tuple[TopicState, ...]) -> list[Alert]:
        """Topics that are published and do not come."""
        ages = {
            topic.name: now - self._since[topic.name] if topic.age is None else topic.age
            for topic in topics
            if topic.name in STEP_TOPICS and topic.name in self._since
        }
        silent = [name for name, age in ages.items() if age > SILENT]
        if not silent:
            return []
        text = f'published, but nothing comes: {", ".join(silent)}'
        return [Alert('warning', text, age=min(ages[name] for name in silent))]

    def _unmatched(self, topics: tuple[TopicState, ...]) -> list[Alert]:
        """Set-points and odometry that come, but not at times that fit."""
        rate = next(topic.rate for topic in topics if topic.name == interface.CMD_VEL)
        if not rate or self._motion.nu is None or self._motion.nu_d is not None:
            return []
        text = f'{interface.CMD_VEL}: expected a set-point of the last second, found none'
        return [Alert('warning', text)]
