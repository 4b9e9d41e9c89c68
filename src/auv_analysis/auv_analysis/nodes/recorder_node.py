"""The recorder as a node: raw messages into a bag, every step checked, progress published."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from rclpy.duration import Duration
from std_msgs.msg import Header

from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.ros2msg import schema_text
from auv_analysis.bag.writer import RecordingError
from auv_analysis.graph.node_settings import RecorderSettings
from auv_analysis.nodes.recorder import EPOCH, GraphClock, OtherTopics, make_wanted, make_writer
from auv_dynamics.files.yaml_files import yaml_text
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.codec import first_stamp
from auv_dynamics.ros.interface import RECORDER, BadMessageError
from auv_dynamics.ros.node_interface import NodeInterface, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.parameters import declare_settings
from auv_dynamics.ros.topics import qos_entry, type_name


class LostStepError(RuntimeError):
    """A step is missing or came twice; the text names topic and step."""


class StepLedger:
    """Counts the steps of every step topic, in order.

    Parameters
    ----------
    topics : names of the step topics
    step_ns : time between steps, ns
    strict : every step must come once and in order; else gaps are only counted

    """

    def __init__(self, topics: Sequence[str], step_ns: int, strict: bool = True):
        self._step, self._strict = step_ns, strict
        self._newest = dict.fromkeys(topics, -1)
        self._last: dict[str, int] = {}
        self._origin = self._latest = -1  # stamps of the first step and of the last message
        self.gaps = dict.fromkeys(topics, 0)

    def add(self, topic: str, ns: int) -> None:
        """Count a message of a step topic stamped `ns`; Lost when it is not the next step."""
        if self._origin < 0:
            self._origin = self._latest = ns
        if not self._strict:
            self._follow(topic, ns)
        k, rest = divmod(ns - self._origin, self._step)
        expected = self._newest[topic] + 1
        if self._strict and (rest or k != expected):
            due = self._origin + expected * self._step
            text = f'{topic}: expected step {expected} ({due} ns), found {ns} ns'
            raise LostStepError(f'{text}: {"doubled" if k < expected else "lost"}')
        self._newest[topic] = max(self._newest[topic], k)

    def _follow(self, topic: str, ns: int) -> None:
        """Without a grid: count gaps, and take no time for passed where a clock was set."""
        apart, self._latest = ns - self._latest, ns
        if abs(apart) > EPOCH:
            self._origin += apart
        last = self._last.get(topic, ns)
        if abs(ns - last) > EPOCH:
            last = ns
        self.gaps[topic] += max(0, round((ns - last) / self._step) - 1)
        self._last[topic] = max(ns, last)

    @property
    def complete(self) -> int:
        """Last step that has arrived on every step topic, -1 before the first."""
        return min(self._newest.values())

    @property
    def furthest(self) -> int:
        """Last step that has arrived on any of them."""
        return max(self._newest.values())

    def reaches(self, last: int, clock: int) -> bool:
        """Whether a step has arrived on any of them, or a clock, ns, has come to it."""
        return self.furthest >= last or clock >= self._origin + last * self._step

    @property
    def complete_ns(self) -> int:
        """Stamp of that step."""
        return self._origin + self.complete * self._step

    def short_of(self, last: int) -> list[str]:
        """Topics that have not come to a step."""
        return [topic for topic, k in self._newest.items() if k < last]

    def behind(self) -> str:
        """Topics that have not reached the furthest one, for a message to a person."""
        steps = self._newest.items()
        late = [f'{topic} at step {k}' for topic, k in steps if k < self.furthest]
        return ', '.join(late) or 'none'


class PublicationLedger:
    """Follows the numbers that the middleware gives to a publisher's messages.

    It sees what the steps do not show, a loss on a topic that has no message for every step. The
    first number is any, for a publisher may have joined late.

    Parameters
    ----------
    strict : a gap is an error, else it is only counted
    several : whether a topic has several publishers, whose numbers tell nothing; without `strict`

    """

    def __init__(self, strict: bool = True, several: Callable[[str], bool] = lambda _: False):
        self._strict, self._several = strict, several
        self._newest: dict[str, int] = {}
        self.gaps: dict[str, int] = {}

    def add(self, topic: str, number: int | None) -> None:
        """Count a publication; LostStepError after a gap. None: the middleware does not number."""
        if number is None:
            return
        last = self._newest.get(topic, number)
        self._newest[topic] = number
        if number > last + 1 and (self._strict or not self._several(topic)):
            self.gaps[topic] = self.gaps.get(topic, 0) + number - last - 1
            if self._strict:
                text = f'{topic}: expected publication {last + 1}, found {number}'
                raise LostStepError(f'{text}: lost')


PATIENCE = 2.0  # s without any step, after which what lacks at the end does not come any more
GONE = 10.0  # s beyond the time of a run, or without any step, after which it is given up
NUMBERED = {*topics.STEP_TOPICS, *topics.ANALYSIS_TOPICS, topics.CLOCK}  # with one publisher each
TIMED = {*topics.STEP_TOPICS, topics.CLOCK}  # whose stamp is the log time, and the publish time


class RecorderNode(BulkNode):
    """Records raw messages; log time is the stamp of steps, of others the time when they came."""

    def __init__(self, **options: Any):
        super().__init__(RECORDER, **options)
        self._settings = p = declare_settings(self, RecorderSettings)
        grid, wanted = p.grid(RECORDER), make_wanted(self, p)
        self._last, self._last_due = grid.last, None
        if grid.last is not None and p.analysis_every:
            self._last_due = grid.last // p.analysis_every * p.analysis_every * grid.step_ns
        self._writer = make_writer(self, p)
        # in real time set-points lie on a grid of their own, ahead of the odometry
        ahead = () if p.strict else (topics.CMD_VEL.name, topics.CMD_ACCEL.name)
        self._counted = [topic for topic in p.topics if topic not in ahead] or list(p.topics)
        self._ledger = StepLedger(self._counted, grid.step_ns, p.strict)
        self._publications = PublicationLedger(
            p.strict, lambda topic: self.count_publishers(self.resolve_topic_name(topic)) > 1
        )
        self._time = GraphClock(self, p.strict)
        awaited = (topics.CLOCK, *topics.ANALYSIS_TOPICS)
        self._newest = {topic.name: -1 for topic in awaited}  # stamps, ns
        self._heard = 0.0  # steady s of the last step
        self._began = self._reached = 0.0  # of the first, and of the end if the run is over by then
        self._reported = -1
        self._complaints: set[str] = set()
        self.graph = NodeInterface(self, barrier=False, lockstep=p.strict)
        self._progress = self.graph.publisher(topics.PROGRESS, topics.one_at_a_time())
        self._ours = {self._record(topic) for topic in topics.TOPICS}
        self._others = OtherTopics(self, wanted, self._take)
        steady_timer(self, 0.05, self._report)
        steady_timer(self, 0.2, self._keep)
        steady_timer(self, 0.5, lambda: self._others.look(self._ours))
        expected = ', '.join(p.topics)
        self.begin(f'records {wanted.namespace} into {p.bag}, expects {expected}')

    def _record(self, topic: topics.Topic) -> str:
        """Subscribe to a topic of the graph; its full name."""
        name, kind = topic.name, type_name(topic.type)
        resolved = self.resolve_topic_name(name)
        step_topic = name if name in self._counted else ''
        numbered, awaited = topic in NUMBERED, name in self._newest
        # what is said of a step in lock-step belongs to it, however late it comes
        of_a_step = self._settings.strict and topic in topics.ANALYSIS_TOPICS
        timed = topic in TIMED or of_a_step
        zero_is_a_time = self._time.simulated or topic is topics.CLOCK

        def callback(message: bytes, way: dict[str, Any]) -> None:
            try:
                ns = first_stamp(message, name) if timed or awaited else 0
            except BadMessageError:
                self._take(resolved, kind, message, way)
                raise
            stamped = timed and (ns or zero_is_a_time)
            if stamped and step_topic:
                self._time.follow(ns)
                self._release()
            if stamped and (topic is topics.CLOCK or self._time.is_near(ns)):
                published = (of_a_step and way.get('source_timestamp')) or ns
                self._write(resolved, kind, message, ns, published)
            else:
                self._take(resolved, kind, message, way)
            if numbered:
                self._count(name, step_topic, ns, way.get('publication_sequence_number'))
            if awaited:
                self._newest[name] = max(self._newest[name], ns)

        self.graph.subscribe(topic, callback, topics.every_step())
        return resolved

    def _take(self, topic: str, kind: str, message: bytes, way: dict[str, Any]) -> None:
        """Write a message at the time when it came; before that is known, it waits."""
        ns = self._time.now(way.get('received_timestamp'))
        if ns is None:
            self._meet(topic, kind)  # its publisher may be gone by then
            self._time.hold((topic, kind, message, way))
        else:
            self._write(topic, kind, message, ns, max(0, way.get('source_timestamp') or ns))

    def _release(self, *, ends: bool = False) -> None:
        """Write what has waited, once the time of the graph is known or not waited for."""
        for entry in self._time.released(ends=ends) if self._time.early else ():
            self._take(*entry)

    def _write(self, topic: str, kind: str, message: bytes, ns: int, published: int) -> None:
        self._meet(topic, kind)
        with suppress(RecordingError):  # `_report` ends with it
            self._writer.write(topic, ns, message, published)

    def _meet(self, topic: str, kind: str) -> None:
        """Define a topic in the bag, with what its publishers offer."""
        if self._writer.has_channel(topic):
            return
        found = self.get_publishers_info_by_topic(topic)
        offered = [one for one in found if one.topic_type == kind]
        qos = yaml_text([qos_entry(one.qos_profile) for one in offered], default_flow_style=False)
        known = [*offered, *self.get_subscriptions_info_by_topic(topic)]
        digest = next((str(one.topic_type_hash) for one in known), '')
        definition = Definition(topic, kind, qos=qos, digest=digest)
        with suppress(RecordingError):  # `_report` ends with it
            self._writer.add_channel(definition, schema_text(kind))

    def _count(self, name: str, step_topic: str, ns: int, number: int | None) -> None:
        try:
            if step_topic:
                self._heard = time.monotonic()
                self._began = self._began or self._heard
                self._ledger.add(step_topic, ns)
            self._publications.add(name, number)
        except LostStepError as error:
            self._end(str(error))

    def _report(self) -> None:
        """Publish the last complete step when it is new, and end when it is the last one."""
        if self._writer.trouble:
            self._end(self._writer.trouble)
        complete = self._ledger.complete
        if complete > self._reported:
            self._reported = complete
            self._say_progress()
        if self._last is not None and self._is_whole(self._last):
            self._end()
        elif self._last is not None and (lacking := self._given_up(self._last)):
            self._end(lacking)

    def _is_whole(self, last: int) -> bool:
        """Whether all has come to the last step, or what need not come has stayed away.

        In real time that is any topic, for a measurement may be withheld; of all of them where the
        clock has come to the last step. In lock-step it is the clock.
        """
        due, newest = self._last_due, self._newest
        analysed = due is None or all(newest[t.name] >= due for t in topics.ANALYSIS_TOPICS)
        late = time.monotonic() - self._heard > PATIENCE
        if self._ledger.complete < last or not analysed:
            reached = self._ledger.reaches(last, newest[topics.CLOCK.name])
            return late and not self._settings.strict and reached
        return late or not 0 <= newest[topics.CLOCK.name] < self._ledger.complete_ns

    def _given_up(self, last: int) -> str:
        """Why what lacks is not waited for any more, once the time of the run has passed."""
        now = time.monotonic()
        over = now - self._began - last * self._settings.step
        if not self._began or over <= 0.0:
            return ''
        short = self._ledger.short_of(last)
        reached = self._ledger.reaches(last, self._newest[topics.CLOCK.name])
        self._reached = (self._reached or now) if reached else 0.0
        if reached and now - self._reached > GONE and not self._settings.strict:
            return f'came to step {last} without {", ".join(short) or "its analysis"}'
        names = {topic: self.resolve_topic_name(topic) for topic in short}
        gone = [topic for topic, name in names.items() if not self.count_publishers(name)]
        if not gone or now - self._heard <= GONE:
            return ''
        who = f'nobody publishes {", ".join(gone)} any more'
        return f'came to step {self._ledger.complete} of {last}: {who}'

    def _say_progress(self) -> None:
        if self._reported >= 0:
            message = Header(stamp=convert.stamp(self._ledger.complete_ns))
            message.frame_id = self.graph.frames.base
            self._progress.publish(message)

    def _keep(self) -> None:
        """Repeat the progress for whoever has joined since."""
        self._release()
        self._say_progress()
        self.graph.latest_ns = max(0, self._time.latest)
        self.graph.facts.update(complete=self._ledger.complete, behind=self._ledger.behind())

    def _end(self, error: str = '') -> None:
        if self.exit_code is not None:
            return
        self.exit_code = 0
        if error:
            self._complain(error)
        self._progress.wait_for_all_acked(Duration(seconds=1.0))

    def _complain(self, text: str) -> None:
        """Log an error, once, and fail."""
        if text not in self._complaints:
            self.get_logger().error(text)
        self._complaints.add(text)
        self.exit_code = 1

    def close(self) -> None:
        """Finish the bag with everything that has arrived, and say what has not."""
        self.take_data()
        self._release(ends=True)
        try:
            self._writer.close()
        except RecordingError as error:
            self._complain(str(error))
        lost = {topic: gaps for topic, gaps in self._ledger.gaps.items() if gaps}
        if lost or self._publications.gaps:
            lost.update(self._publications.gaps)
            steps = f'steps of {self._settings.step:g} s without a message'
            self.get_logger().warning(f'{steps}, or messages that did not arrive: {lost}')
        if not self._complaints:
            self._name_silent()
        left = [f'{topic} ({why})' for topic, why in sorted(self._others.left.items())]
        self.task = f'recorded {self._writer.count} messages into {self._settings.bag}'
        self.task += f', not {", ".join(left)}' if left else ''

    def _name_silent(self) -> None:
        """Fail where a topic that is expected has had no message."""
        p, has = self._settings, self._writer.has_channel
        silent = [topic for topic in p.topics if not has(self.resolve_topic_name(topic))]
        if silent:
            self._complain(f'{p.bag}: expected topics without any message: {", ".join(silent)}')


def main() -> None:
    """Run the node."""
    main_of(RecorderNode)
