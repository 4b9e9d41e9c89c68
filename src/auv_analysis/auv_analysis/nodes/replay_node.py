"""A recorded bag as a node: its messages again, byte for byte, in the order and pace of the bag."""

import math
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.context import Context
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from auv_analysis.bag.step_topics import ODOMETRY
from auv_analysis.graph.domain import ANNOUNCED
from auv_analysis.nodes.replay_publishers import (
    Answers,
    CommandGuard,
    Commands,
    Receivers,
    is_odometry,
    make_publishers,
)
from auv_analysis.replay.played_bag import GAP, PlayedMessage, messages
from auv_analysis.replay.selection import REPLAY, ReplayPlan, make_plan, nothing_left
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.endpoints import NAMED, NAMELESS, full_name, onlookers, other_publishers
from auv_dynamics.ros.interface import NANOSECONDS, BadMessageError
from auv_dynamics.ros.node_interface import NodeInterface, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.participant import Participant

HELD = math.inf


class Playback:
    """Says when a message is due; times are s of the steady clock and ns of the bag.

    Due times are counted from one place in the bag, not from message to message, so that nothing
    drifts.

    Parameters
    ----------
    rate : seconds of the bag per second; 0: as fast as possible
    paused : whether it begins paused
    skips_gaps : whether a message behind a gap is due at once

    Attributes
    ----------
    rate, paused : as they are now

    """

    def __init__(self, rate: float, paused: bool = False, *, skips_gaps: bool = False):
        self.rate, self.paused, self._skips_gaps = rate, paused, skips_gaps
        self._place: tuple[float, int] | None = None  # a time of the clock, and of the bag then
        self._reached = 0
        self._until = -1  # ns up to which is played although it is paused

    def restart(self) -> None:
        """Forget the place in the bag: the next message is the first one."""
        self._place, self._until = None, -1

    def wait(self, now: float, ns: int) -> float:
        """Seconds until a message of this log time is due; 0 or less: it is; HELD: paused."""
        if self._place is None:
            self._place, self._reached = (now, ns), ns
        if self.paused:
            return 0.0 if ns <= self._until else HELD
        if self.rate == 0.0:
            return 0.0
        if self._skips_gaps and ns - self._reached > GAP:
            self._place = now, ns
        clock, place = self._place
        return clock + (ns - place) / (self.rate * NANOSECONDS) - now

    def played(self, ns: int) -> None:
        """Note that a message of this log time was published."""
        self._reached = max(self._reached, ns)

    def pause(self, now: float, ns: int) -> None:
        """Hold; `ns` is the log time of the next message."""
        if not self.paused:
            self._hold(now, ns)
            self.paused = True

    def run(self, now: float) -> None:
        """Go on from where it was held."""
        if self.paused:
            self.paused = False
            self._place = (now, self._reached) if self._place else None

    def step(self, ns: int) -> None:
        """Although paused, play everything up to the log time `ns`."""
        self._until = ns

    def change_rate(self, now: float, ns: int, rate: float) -> None:
        """Go on from here at another rate; `ns` is the log time of the next message."""
        if not self.paused:
            self._hold(now, ns)
        self.rate = rate

    def _hold(self, now: float, ns: int) -> None:
        """Begin to count from the present place: between two messages, never beyond the next."""
        if self._place is None:
            return
        clock, place = self._place
        passed = min((now - clock) * self.rate * NANOSECONDS, float(ns - place))  # may be infinite
        self._reached = max(self._reached, place + round(passed) if self.rate else self._reached)
        self._place = now, self._reached


BATCH = 0.01  # s of messages between two looks at services and signals
SOON = 0.002  # s until it is asked again whether subscribers have room
LONGEST = 0.01  # s between two looks at what is due: a timer that the data path is in time for


class Player:
    """Messages of a bag and the publishers that they go to.

    Parameters
    ----------
    node : that publishes
    settings : what is to be played, and how

    Attributes
    ----------
    playback : time of the bag
    guard : of the commands
    published : recorded topic -> number of messages, over all loops
    loops : how often the end was reached
    now_ns : log time of the last message
    ended : whether all has been played, and taken

    """

    def __init__(self, node: Any, plan: ReplayPlan):
        self._node, self._plan = node, plan
        index, selection, settings = plan.index, plan.selection, plan.settings
        self._publishers = make_publishers(node.graph, index.topics, selection)
        if not self._publishers:
            raise nothing_left(index, selection)
        foreign = settings.allow_commands_to_foreign
        guarded = {topic: self._publishers[topic] for topic in selection.guarded}
        self.guard = CommandGuard(node, guarded, foreign)
        self.commands = Commands(guarded, foreign)
        self.receivers = Receivers(node, self._publishers)
        self._answers = Answers(node.graph, settings.answers) if settings.answers else None
        self._publish_clock = node.graph.output(topics.CLOCK) if settings.clock else None
        self.playback = Playback(
            settings.rate, settings.start_paused, skips_gaps=settings.skip_gaps
        )
        self.published: Counter[str] = Counter()
        self.loops, self.now_ns = 0, plan.begin
        self._clock_ns: int | None = None  # that was published last
        self.ended = False
        self._stream = self._rewound()
        self._next: PlayedMessage | None = None

    @property
    def names(self) -> dict[str, str]:
        """Recorded topic -> full name under which it is published."""
        return {topic: one.topic_name for topic, one in self._publishers.items()}

    @property
    def alone(self) -> dict[str, str]:
        """Full names of what only one may publish -> the option that leaves it to others.

        A second odometry beside that of a vehicle would be believed by its controller.
        """
        found = {interface.CLOCK: '--no-clock'} if self._publish_clock is not None else {}
        for topic, name in self.names.items():
            measured = self._plan.index.topics[topic].kind == ODOMETRY
            if measured and REPLAY not in name.split('/'):
                found[name] = '--topics, or under /replay'
        return found

    def waits_for(self) -> str:
        """Expected subscribers that are missing, or an empty text."""
        for topic, count in self._plan.expected.items():
            publisher = self._publishers[topic]
            found = publisher.get_subscription_count()
            if found >= count:  # the graph is that of the topics, whose names a replay may change
                namespace = publisher.topic_name.rpartition('/')[0] or '/'
                found -= onlookers(self._node, publisher, namespace)
            if found < count:
                return f'{topic}: expected {count} subscribers, found {found}'
        return ''

    def advance(self, now: float) -> float:
        """Publish what is due; s until it is worth looking again."""
        self.receivers.ask(always=self._peek() is None)
        until = now + BATCH
        while (message := self._peek()) is not None:
            wait = self.playback.wait(now, message.ns)
            if wait > 0.0:
                if self.playback.paused:  # also after a step
                    self.commands.let_go()
                return min(wait, LONGEST)
            if now >= until:
                return 0.0
            if not self._goes_out(message, now):
                return SOON
            self._next = None
            self.playback.played(message.ns)
            now = time.monotonic()
        self._end_of_bag()
        return SOON

    def look(self, now: float) -> str:
        """Look who listens; why it cannot go on, or an empty text."""
        self.receivers.find()
        self.guard.look(now)
        if self._answers and not self.playback.paused:
            return self._answers.overdue()
        return ''

    def pause(self) -> None:
        """Hold; a vehicle that hears the commands is then left without a wrench."""
        self.playback.pause(time.monotonic(), self._ahead())

    def run(self) -> None:
        """Go on from where it was held."""
        self.playback.run(time.monotonic())

    def step(self) -> int | None:
        """Play the messages of the next log time, although paused; that time in ns."""
        message = self._peek()
        if message is None:
            return None
        self.playback.step(message.ns)
        return message.ns

    def change_rate(self, rate: float) -> None:
        """Go on at another rate."""
        self.playback.change_rate(time.monotonic(), self._ahead(), rate)

    def _peek(self) -> PlayedMessage | None:
        if self._next is None:
            self._next = next(self._stream, None)
        return self._next

    def _ahead(self) -> int:
        message = self._peek()
        return self.now_ns if message is None else message.ns

    def _rewound(self) -> Iterator[PlayedMessage]:
        p = self._plan
        return messages(p.index, self._publishers, p.begin, p.end)

    def _goes_out(self, message: PlayedMessage, now: float) -> bool:
        """Publish a message that is due; False where it has to wait."""
        topic = message.topic
        kind = self._plan.index.topics[topic].kind
        waits = self._answers is not None and not self._answers.are_complete()
        if waits and is_odometry(topic, kind):
            return False
        allowed = self.guard.may(topic, now)
        if allowed is None or not self.receivers.have_room(topic):
            return False
        if message.ns != self._clock_ns and self._publish_clock is not None:
            self._publish_clock(message.ns, ())
        self.now_ns = self._clock_ns = message.ns
        if allowed:
            self._publish(topic, kind, message.data)
        return True

    def _publish(self, topic: str, kind: str, data: bytes) -> None:
        try:
            self.commands.check(topic, data)
            if self._answers is not None:
                self._answers.expect(topic, kind, data)
        except BadMessageError as error:
            self._node.graph.refuse(str(error))
            return
        self._publishers[topic].publish(data)
        self.receivers.sent(topic)
        self.published[topic] += 1

    def _end_of_bag(self) -> None:
        """Wait until all has been taken; then end, or begin again."""
        if not self.receivers.have_all() or (self._answers and not self._answers.are_complete()):
            return
        self.loops += 1
        if self._plan.settings.loop:
            self.playback.restart()
            self._stream, self._clock_ns = self._rewound(), None
        else:
            self.ended = True


NAME = 'replay_node'
DISCOVERY = 1.0  # s in which those who are there are met, where no vehicle may be among them
LOOK = 0.1  # s between two looks at the others
SHOWN = 5  # gaps that are named, the longest ones


class ReplayNode(BulkNode):
    """Publishes the messages of a bag; see `ReplaySettings` for what it is told."""

    def __init__(self, **options: Any):
        super().__init__(NAME, **options)
        self.graph = NodeInterface(self, barrier=False)
        self.plan = p = make_plan(self)
        self.player = Player(self, p)
        commands = p.selection.guarded and not p.settings.allow_commands_to_foreign
        odometry = self.player.alone.keys() - {interface.CLOCK}
        self._until = time.monotonic() + (ANNOUNCED if commands or odometry else DISCOVERY)
        self._phase: Callable[[float], float] = self._meet
        self.graph.also_ready_when(self.player.waits_for)
        self.create_service(SetBool, '~/run', self._on_run)
        self.create_service(Trigger, '~/step', self._on_step)
        self.add_on_set_parameters_callback(self._on_parameters)
        self.failure, self.aloud = '', False
        self._rivals_since: dict[str, float] = {}
        self._timer = steady_timer(self, LOOK, self._tick)
        steady_timer(self, LOOK, self._look)

    def remarks(self) -> list[str]:
        """Notes on the bag, and the parts that are not played."""
        p = self.plan
        longest = sorted(p.gaps, key=lambda gap: gap[0] - gap[1])[:SHOWN]
        then = 'jumped over' if p.settings.skip_gaps else '--skip-gaps jumps over it'
        gaps = [f'nothing from {a:g} to {b:g} s of the bag: {then}' for a, b in sorted(longest)]
        return [*p.index.notes, *p.selection.remarks(), *gaps]

    @property
    def playing(self) -> bool:
        """Whether the others have been met, and the bag is played or paused."""
        return self._phase == self._play

    def _tick(self) -> None:
        if self.exit_code is None:
            wait = self._phase(time.monotonic())
            self._timer.timer_period_ns = max(1, round(wait * interface.NANOSECONDS))
            self._timer.reset()

    def _meet(self, now: float) -> float:
        """Look who is there, before the first message."""
        met = now >= self._until
        refusal = self.player.guard.refusal(final=met) or self._rival(now)
        if refusal is not None:
            print(refusal, file=sys.stderr, flush=True)
            self.exit_code = 2
        else:
            self.player.receivers.find()
            if met and not self.player.waits_for():
                self._phase = self._play
                if self.aloud:
                    self.begin(f'plays {self.plan.index.bag}')
        return LOOK

    def _play(self, now: float) -> float:
        wait = self.player.advance(now)
        if self.player.ended:
            self.exit_code = 1 if self.player.guard.stopped else 0
        return wait

    def _look(self) -> None:
        """Look who has come since."""
        self.graph.latest_ns = self.player.now_ns
        self.graph.facts.update(self._facts())
        if self.exit_code is not None or not self.playing:
            return
        now = time.monotonic()
        overdue, rival = self.player.look(now), self._rival(now)
        self.failure = str(rival or overdue)
        if self.failure:
            self.get_logger().error(self.failure)
            self.exit_code = 1

    def _rival(self, now: float) -> InputError | None:
        """Who else publishes what only one may publish, once it has a name."""
        for topic, remedy in self.player.alone.items():
            others = sorted(map(full_name, other_publishers(self, topic)))
            if not others:
                self._rivals_since.pop(topic, None)
                continue
            since = self._rivals_since.setdefault(topic, now)
            if NAMELESS not in others or now - since >= NAMED:
                expected = f'no other publisher, or none from here ({remedy})'
                return InputError(self.get_name(), topic, expected, ', '.join(others))
        return None

    def _facts(self) -> dict[str, Any]:
        player, p = self.player, self.plan
        return {
            'time': (player.now_ns - p.index.first) / interface.NANOSECONDS,
            'rate': player.playback.rate,
            'paused': player.playback.paused,
            'published': player.published.total(),
            'loops': player.loops,
            'waits for': '' if self.playing else player.waits_for(),
        }

    def _on_run(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            self.player.run()
        else:
            self.player.pause()
        response.success, response.message = True, 'running' if request.data else 'paused'
        return response

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        paused = self.player.playback.paused
        ns = self.player.step() if paused else None
        response.success = ns is not None
        if ns is not None:
            seconds = (ns - self.plan.index.first) / interface.NANOSECONDS
            response.message = f'to {seconds:g} s of the bag'
        else:
            response.message = 'at the end of the bag' if paused else 'not paused'
        return response

    def _on_parameters(self, changed: list[Parameter]) -> SetParametersResult:
        for parameter in changed:
            if parameter.name == 'rate':
                self.player.change_rate(float(parameter.value))
        return SetParametersResult(successful=True)

    def close(self) -> None:
        """Leave no vehicle with a wrench."""
        self.player.commands.let_go()


class Replay(Participant):
    """A replay inside another program.

    Parameters
    ----------
    domain : ROS domain id
    parameters : of the node; None: its default

    Raises
    ------
    InputError : a parameter or the bag is wrong

    """

    def __init__(self, domain: int, parameters: dict[str, Any]):
        given = [Parameter(name, value=v) for name, v in parameters.items() if v is not None]

        def make(context: Context) -> ReplayNode:
            return ReplayNode(context=context, parameter_overrides=given)

        super().__init__(domain, make, NAME)

    @property
    def node(self) -> ReplayNode:
        """The node itself."""
        return self._node

    def close(self) -> None:
        """Leave the domain."""
        self._node.close()
        super().close()


def make_node() -> ReplayNode:
    """A replay that says what is odd about its bag."""
    node = ReplayNode()
    node.aloud = True
    for remark in node.remarks():
        node.get_logger().warning(remark)
    return node


def main() -> None:
    """Run the node."""
    main_of(make_node)
