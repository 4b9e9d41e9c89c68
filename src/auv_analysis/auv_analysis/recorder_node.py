"""The recorder as a node: every topic of the graph into an MCAP bag, every step checked."""

import time
from typing import Any

from rclpy.duration import Duration
from std_msgs.msg import Header

from auv_analysis.ledger import LostStepError, PublicationLedger, StepLedger
from auv_analysis.recorder_parameters import recorder_parameters
from auv_analysis.recording import RecordingError
from auv_analysis.schemas import schema_text
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.bulk import BulkNode
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.ros.graph import Graph, steady_timer
from auv_dynamics.ros.kinds import begins_with_stamp, message_class, qos_entry, type_name
from auv_dynamics.ros.life import main_of

UNRECORDED = ('/rosout', '/parameter_events')
PATIENCE = 2.0  # s for the clock of the last steps, which nothing else waits for
NUMBERED = (*topics.STEP_TOPICS, *topics.ANALYSIS_TOPICS, topics.CLOCK)  # with one publisher each


class RecorderNode(BulkNode):
    """Records raw messages; log time is the header stamp, so a bag is in simulated time."""

    def __init__(self) -> None:
        super().__init__('recorder_node')
        self._settings = p = recorder_parameters(self)
        self._writer = p.writer
        # in real time set-points lie on a grid of their own, ahead of the odometry
        ahead = () if p.strict else (topics.CMD_VEL.name, topics.CMD_ACCEL.name)
        self._counted = [topic for topic in p.topics if topic not in ahead] or list(p.topics)
        self._ledger = StepLedger(self._counted, p.step_ns, p.strict)
        self._publications = PublicationLedger(p.strict)
        self._latest = 0  # stamp of the newest step message, for messages without one
        self._newest = {topics.LUMPED_ERROR.name: -1, topics.CLOCK.name: -1}  # stamps, ns
        self._whole_since: float | None = None  # steady s
        self._reported = -1
        self._complaints: set[str] = set()
        self._known: set[str] = set()
        self.graph = Graph(self, barrier=False)
        self._progress = self.graph.publisher(topics.PROGRESS, topics.one_at_a_time())
        for topic in topics.TOPICS:
            self._record(topic.name, topic.type, topic)
        steady_timer(self, 0.02, self._report)
        steady_timer(self, 0.2, self._keep)
        steady_timer(self, 0.5, self._discover)

    def _record(self, name: str, kind: type, topic: topics.Topic | None = None) -> None:
        resolved = self.resolve_topic_name(name)
        step_topic = topic.name if topic and topic.name in self._counted else ''
        numbered = topic in NUMBERED
        stamped = begins_with_stamp(kind)

        def callback(message: bytes, info: dict[str, Any]) -> None:
            ns = first_stamp(message) if stamped else self._latest
            self._take(resolved, kind, message, ns or self._beginning())
            if numbered:
                self._count(name, step_topic, ns, info.get('publication_sequence_number'))
            if name in self._newest:
                self._newest[name] = max(self._newest[name], ns)

        self._known.add(resolved)
        self.graph.subscribe(topic or topics.Topic(resolved, kind), callback, topics.every_step())

    def _beginning(self) -> int:
        """Log time of what has no stamp: zero where time is simulated, else that of the clock."""
        return 0 if self._settings.strict else int(self.get_clock().now().nanoseconds)

    def _take(self, topic: str, kind: type, message: bytes, ns: int) -> None:
        if self._writer.broken:
            return
        try:
            if not self._writer.has_channel(topic):
                self._add_channel(topic, type_name(kind))
            self._writer.write(topic, ns, message)
        except RecordingError as error:
            self._end(1, str(error))
        if self._writer.trouble:
            self._end(1, self._writer.trouble)

    def _add_channel(self, topic: str, kind: str) -> None:
        endpoints = self.get_publishers_info_by_topic(topic)
        qos = [qos_entry(endpoint.qos_profile) for endpoint in endpoints]
        endpoints = endpoints or self.get_subscriptions_info_by_topic(topic)
        digest = str(endpoints[0].topic_type_hash) if endpoints else ''
        self._writer.add_channel(topic, kind, schema_text(kind), qos, digest)

    def _count(self, name: str, step_topic: str, ns: int, number: int | None) -> None:
        try:
            if step_topic:
                self._latest = max(self._latest, ns)
                self._ledger.add(step_topic, ns)
            self._publications.add(name, number)
        except LostStepError as error:
            self._end(1, str(error))

    def _report(self) -> None:
        """Publish the last complete step when it is new, and end when it is the last one."""
        if self._writer.trouble:
            self._end(1, self._writer.trouble)
        complete = self._ledger.complete
        if complete > self._reported:
            self._reported = complete
            self._say_progress()
        p = self._settings
        analysed = p.last_due is None or self._newest[topics.LUMPED_ERROR.name] >= p.last_due
        if p.last is not None and complete >= p.last and analysed and self._clock_is_whole():
            self._end(0)

    def _clock_is_whole(self) -> bool:
        """Whether the clock, if there is one, has come to the last step too, or stands still."""
        now = time.monotonic()
        self._whole_since = self._whole_since or now
        late = 0 <= self._newest[topics.CLOCK.name] < self._ledger.complete_ns
        return not late or now - self._whole_since > PATIENCE

    def _say_progress(self) -> None:
        if self._reported >= 0:
            message = Header(stamp=convert.stamp(self._ledger.complete_ns))
            message.frame_id = self.graph.frames.base
            self._progress.publish(message)

    def _keep(self) -> None:
        """Repeat the progress for whoever has joined since."""
        self._say_progress()
        self.graph.latest_ns = self._latest
        self.graph.facts.update(complete=self._ledger.complete, behind=self._ledger.behind())

    def _discover(self) -> None:
        """Record topics that are not ours as well."""
        for topic, kinds in self.get_topic_names_and_types():
            if topic in self._known or topic in UNRECORDED:
                continue
            try:
                kind = message_class(kinds[0])
                schema_text(kinds[0])
            except (ImportError, AttributeError, FileNotFoundError):
                self.get_logger().warning(f'{topic}: not recorded, no definition of {kinds[0]}')
                self._known.add(topic)
                continue
            self._record(topic, kind)

    def _end(self, code: int, text: str = '') -> None:
        if self.exit_code is not None:
            return
        if text:
            self._complain(text)
        self.exit_code = code
        self._progress.wait_for_all_acked(Duration(seconds=1.0))

    def _complain(self, text: str) -> None:
        if text not in self._complaints:
            self.get_logger().error(text)
        self._complaints.add(text)

    def close(self) -> None:
        """Finish the bag with everything that has arrived."""
        self.take_data()
        try:
            self._writer.close()
        except RecordingError as error:
            self._complain(str(error))
            self.exit_code = 1
        lost = {topic: gaps for topic, gaps in self._ledger.gaps.items() if gaps}
        if lost or self._publications.gaps:
            lost.update(self._publications.gaps)
            self.get_logger().warning(f'steps or messages that did not arrive: {lost}')


def main() -> None:
    """Run the node."""
    main_of(RecorderNode)
