"""Live analysis as a node: kinetic energy, couplings and lumped error of every tenth step."""

import time
from collections import OrderedDict
from typing import Any

import numpy as np

from auv_analysis.graph.node_settings import AnalysisSettings
from auv_analysis.metrics.coupling import LiveAnalysis
from auv_dynamics import load_vehicle
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.ros.node_interface import NodeInterface, hears_odometry
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import declare_settings

CAPACITY = 2 * interface.DEPTH  # messages per topic that wait for their odometry
HEARD = (
    topics.ODOM, topics.CMD_VEL, topics.WRENCH, topics.DISTURBANCE, topics.DISTURBANCE_ESTIMATE
)  # fmt: skip


class AnalysisNode(BulkNode):
    """Publishes `analysis/*` for every step whose number is a multiple of `every`."""

    def __init__(self, **options: Any):
        super().__init__('analysis_node', **options)
        self.graph = NodeInterface(self)
        p = declare_settings(self, AnalysisSettings)
        self._every = p.every
        self._odometry = topics.GROUND_TRUTH if p.ground_truth else topics.ODOM
        known = load_vehicle(p.vehicle)
        self.graph.hardware_id = known.name
        self._live = LiveAnalysis(known)
        self._k = 0  # odometry messages so far
        self._due: OrderedDict[int, set[topics.Topic]] = OrderedDict()
        self._waiting: dict[topics.Topic, OrderedDict[int, bytes]] = {
            topic: OrderedDict() for topic in HEARD
        }
        self._values: dict[int, dict[topics.Topic, tuple[float, ...]]] = {}
        self._outputs = {topic: self.graph.output(topic) for topic in topics.ANALYSIS_TOPICS}
        self._codecs = {topic: self.graph.codec(topic) for topic in HEARD}
        for topic in HEARD:
            self._watch(topic)
        self._heard: float | None = None  # steady clock, s
        self.graph.in_trouble_while(lambda: hears_odometry(self, self._odometry, self._heard))
        self.begin(f'analyses one step in {self._every} of {self.graph.hardware_id}')

    def _watch(self, topic: topics.Topic) -> None:
        def callback(message: bytes, _: dict[str, Any]) -> None:
            self._take(topic, first_stamp(message, topic.name), message)

        source = self._odometry if topic is topics.ODOM else topic
        self.graph.subscribe(source, callback, topics.every_step())

    def _take(self, topic: topics.Topic, ns: int, message: bytes) -> None:
        waiting = self._waiting[topic]
        waiting[ns] = message
        if topic is topics.ODOM:
            self._heard = time.monotonic()
            if self._k % self._every == 0:
                self._due[ns] = set(HEARD)
                self.graph.latest_ns = ns
                room = max(1, CAPACITY // self._every)
                if len(self._due) > room:  # one that will not come any more
                    self._values.pop(self._due.popitem(last=False)[0], None)
            self._k += 1
        if ns in self._due:
            self._advance(ns)
        while len(waiting) > CAPACITY:
            waiting.popitem(last=False)

    def _advance(self, ns: int) -> None:
        """Read what has arrived for a due stamp and publish what can be said of it."""
        missing = self._due[ns]
        values = self._values.setdefault(ns, {})
        for topic in [t for t in missing if ns in self._waiting[t]]:
            missing.remove(topic)
            try:
                values[topic] = self._codecs[topic].decode(self._waiting[topic][ns])[1]
            except interface.BadMessageError as error:
                self.graph.refuse(str(error))
                continue
            self._publish(ns, topic, values)
        if not missing:
            del self._due[ns], self._values[ns]
            for waiting in self._waiting.values():
                while waiting and next(iter(waiting)) <= ns:
                    waiting.popitem(last=False)

    def _publish(
        self, ns: int, topic: topics.Topic, values: dict[topics.Topic, tuple[float, ...]]
    ) -> None:
        publish = self._send
        if topic is topics.ODOM:
            nu = values[topic][7:]
            energy, shares = self._live.energy(nu)
            publish(topics.KINETIC_ENERGY, ns, energy)
            publish(topics.KINETIC_ENERGY_SHARES, ns, shares)
            publish(topics.DELTA_XI, ns, self._live.delta_xi(nu))
        elif topic is topics.WRENCH:
            publish(topics.DELTA_PI, ns, self._live.delta_pi(values[topic]))
        pair = (topics.DISTURBANCE, topics.DISTURBANCE_ESTIMATE)
        if topic in pair and all(t in values for t in pair):
            w = np.subtract(values[pair[1]], values[pair[0]])
            publish(topics.LUMPED_ERROR, ns, w)
        if {topics.ODOM, topics.CMD_VEL} <= values.keys():
            error = np.subtract(values[topics.CMD_VEL], values[topics.ODOM][7:])
            self.graph.facts['largest velocity error'] = float(np.abs(error).max())

    def _send(self, topic: topics.Topic, ns: int, values: np.ndarray) -> None:
        if self.graph.ready():
            self._outputs[topic](ns, values)


def main() -> None:
    """Run the node."""
    main_of(AnalysisNode)
