"""Live analysis as a node: kinetic energy, couplings and lumped error of every tenth step."""

from collections import OrderedDict
from collections.abc import Callable

import numpy as np
from rclpy.serialization import deserialize_message

from auv_analysis.live_analysis import LiveAnalysis
from auv_dynamics import interface, load_vehicle
from auv_dynamics.files import InputError
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.bulk import BulkNode, first_stamp
from auv_dynamics.ros.graph import Graph
from auv_dynamics.ros.life import main_of
from auv_dynamics.ros.parameters import declare, refuse_unknown

CAPACITY = 2 * topics.DEPTH  # messages per topic that wait for their odometry
READERS: dict[topics.Topic, Callable] = {
    topics.ODOM: interface.read_odometry,
    topics.CMD_VEL: interface.read_twist,
    topics.WRENCH: interface.read_wrench,
    topics.DISTURBANCE: interface.read_wrench,
    topics.DISTURBANCE_ESTIMATE: interface.read_wrench,
}


class AnalysisNode(BulkNode):
    """Publishes `analysis/*` for every step whose number is a multiple of `every`."""

    def __init__(self) -> None:
        super().__init__('analysis_node')
        self.graph = Graph(self)
        vehicle = declare(self, 'vehicle', str, '', 'vehicle file, or shipped bare name')
        self._every = declare(self, 'every', int, 10, 'steps between samples', at_least=1)
        truth = declare(
            self, 'ground_truth', bool, False, 'look at ground_truth/odom in place of odom'
        )
        refuse_unknown(self)
        self._odometry = topics.GROUND_TRUTH if truth else topics.ODOM
        if not vehicle:
            raise InputError(self.get_name(), 'vehicle', 'a vehicle file', None)
        self._live = LiveAnalysis(load_vehicle(vehicle))
        self._k = 0  # odometry messages so far
        self._due: OrderedDict[int, set[topics.Topic]] = OrderedDict()
        self._waiting: dict[topics.Topic, OrderedDict[int, bytes]] = {
            topic: OrderedDict() for topic in READERS
        }
        self._values: dict[int, dict[topics.Topic, tuple]] = {}
        for topic in topics.ANALYSIS_TOPICS:
            self.graph.publisher(topic)
        for topic in READERS:
            self._watch(topic)

    def _watch(self, topic: topics.Topic) -> None:
        def callback(message: bytes) -> None:
            self._take(topic, first_stamp(message), message)

        source = self._odometry if topic is topics.ODOM else topic
        self.graph.subscribe(source, callback, topics.every_step(), raw=True)

    def _take(self, topic: topics.Topic, ns: int, message: bytes) -> None:
        waiting = self._waiting[topic]
        waiting[ns] = message
        if topic is topics.ODOM:
            if self._k % self._every == 0:
                self._due[ns] = set(READERS)
                self.graph.latest_ns = ns
            self._k += 1
        for due in list(self._due):
            self._advance(due)
        while len(waiting) > CAPACITY:
            waiting.popitem(last=False)

    def _advance(self, ns: int) -> None:
        """Read what has arrived for a due stamp and publish what can be said of it."""
        missing = self._due[ns]
        values = self._values.setdefault(ns, {})
        for topic in [t for t in missing if ns in self._waiting[t]]:
            missing.remove(topic)
            try:
                message = deserialize_message(self._waiting[topic][ns], topic.type)
                values[topic] = READERS[topic](message, self.graph.frames, topic.name)[1]
            except interface.BadMessageError as error:
                self.graph.refuse(str(error))
                continue
            self._publish(ns, topic, values)
        late = len(self._due) > CAPACITY // self._every
        if not missing or late:
            del self._due[ns], self._values[ns]
            for waiting in self._waiting.values():
                while waiting and next(iter(waiting)) <= ns:
                    waiting.popitem(last=False)

    def _publish(self, ns: int, topic: topics.Topic, values: dict) -> None:
        frames, publish = self.graph.frames, self._send
        if topic is topics.ODOM:
            nu = values[topic][7:]
            energy, shares = self._live.energy(nu)
            publish(topics.KINETIC_ENERGY, convert.joint_state(ns, energy, frames))
            publish(topics.KINETIC_ENERGY_SHARES, convert.joint_state(ns, shares, frames))
            publish(topics.DELTA_XI, convert.twist(ns, self._live.delta_xi(nu), frames))
        elif topic is topics.WRENCH:
            pi = self._live.delta_pi(values[topic])
            publish(topics.DELTA_PI, convert.wrench(ns, pi, frames))
        pair = (topics.DISTURBANCE, topics.DISTURBANCE_ESTIMATE)
        if topic in pair and all(t in values for t in pair):
            w = np.subtract(values[pair[1]], values[pair[0]])
            publish(topics.LUMPED_ERROR, convert.wrench(ns, w, frames))
        if {topics.ODOM, topics.CMD_VEL} <= values.keys():
            error = np.subtract(values[topics.CMD_VEL], values[topics.ODOM][7:])
            self.graph.facts['largest velocity error'] = float(np.abs(error).max())

    def _send(self, topic: topics.Topic, message: object) -> None:
        if self.graph.ready():
            self.graph.publishers[topic.name].publish(message)


def main() -> None:
    """Run the node."""
    main_of(AnalysisNode)
