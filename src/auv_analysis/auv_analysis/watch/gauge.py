"""Takes what is heard of a graph and says what is known of it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from auv_analysis.metrics.live_analysis import LiveAnalysis
from auv_analysis.watch.health import STEP_TOPICS, Health
from auv_analysis.watch.motion import Motion
from auv_analysis.watch.snapshot import NodeState, Six, Snapshot, TopicState, Trouble
from auv_analysis.watch.stream import Stream
from auv_dynamics.ros import interface
from auv_dynamics.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from auv_dynamics.ros.endpoints import Endpoints

EVEN = (*STEP_TOPICS, *interface.ANALYSIS_TOPICS)  # stamps at even distances
HEARD = (*EVEN, interface.PROGRESS, interface.DIAGNOSTICS)


class Gauge:
    """What is known of one graph; all times are steady, in s.

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
        self._motion = Motion(self._live)
        self._health = Health()
        self._streams = {name: Stream(judged=name in EVEN) for name in HEARD}
        self._refused = dict.fromkeys(HEARD, 0)
        self._begin = begin

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
        self._health.complain(now, text)

    def complain(self, now: float, text: str) -> None:
        """Take note of an error."""
        self._health.complain(now, text)

    def diagnose(self, now: float, state: NodeState) -> None:
        """Take what a node says of itself."""
        self._health.diagnose(now, state)

    def see(self, now: float, endpoints: 'Mapping[str, Endpoints]') -> None:
        """Take who publishes and subscribes what."""
        self._health.see(now, endpoints)
        for name, ends in endpoints.items():
            self._streams[name].publishers = ends.publishers

    @property
    def moves(self) -> bool:
        """Whether any message has come that is published every step."""
        return any(self._streams[name].heard for name in STEP_TOPICS)

    def load(self, now: float) -> float:
        """Messages per second that the graph publishes."""
        return sum(stream.rate(now) or 0.0 for stream in self._streams.values())

    def snapshot(self, now: float, *, sampled: bool = False) -> Snapshot:
        """All that is known."""
        motion, health = self._motion, self._health
        topics = tuple(self._topic(now, name) for name in HEARD)
        source = self._streams.get(motion.source or '')
        recorded = self._streams[interface.PROGRESS].newest
        computed = self._live is not None and not (
            motion.published(now, interface.KINETIC_ENERGY)
            and motion.published(now, interface.DELTA_PI)
        )
        return Snapshot(
            domain=self.domain,
            namespace=self.namespace,
            vehicle=self._vehicle.name if self._vehicle else None,
            seconds=now - self._begin,
            sampled=sampled,
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
            structural_zeros=self._live.structural_zeros if self._live else None,
            topics=topics,
            nodes=health.nodes(now),
            troubles=(*health.troubles(now, topics), *self._unmatched(topics)),
        )

    def _topic(self, now: float, name: str) -> TopicState:
        stream, ends = self._streams[name], self._health.endpoints.get(name)
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

    def _unmatched(self, topics: tuple[TopicState, ...]) -> list[Trouble]:
        """Set-points and odometry that come, but not at times that fit."""
        rate = next(topic.rate for topic in topics if topic.name == interface.CMD_VEL)
        if not rate or self._motion.nu is None or self._motion.nu_d is not None:
            return []
        text = f'{interface.CMD_VEL}: expected a set-point of the last second, found none'
        return [Trouble('warning', text)]
