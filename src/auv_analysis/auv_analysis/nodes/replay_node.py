"""A recorded bag as a node: its messages again, byte for byte, in the order and pace of the bag."""

import math
import sys
import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.context import Context
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from auv_analysis.nodes.player import Player
from auv_analysis.replay.selection import replay_parameters
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import interface
from auv_dynamics.ros.endpoints import NAMED, NAMELESS, full_name, other_publishers
from auv_dynamics.ros.node_interface import NodeInterface, steady_timer
from auv_dynamics.ros.node_main import BulkNode, main_of
from auv_dynamics.ros.participant import Participant

NAME = 'replay_node'
DISCOVERY = 1.0  # s in which those who are there already are met
CAREFUL = 3.0  # s, the same where a vehicle may be among them
LOOK = 0.1  # s between two looks at the others
SHOWN = 5  # gaps that are named, the longest ones


class ReplayNode(BulkNode):
    """Publishes the messages of a bag; see `replay_parameters` for what it is told."""

    def __init__(self, **options: Any):
        super().__init__(NAME, **options)
        self.graph = NodeInterface(self, barrier=False)
        self.settings = p = replay_parameters(self)
        self.player = Player(self, p)
        careful = p.selection.guarded and not p.foreign
        self._until = time.monotonic() + (CAREFUL if careful else DISCOVERY)
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
        """What is odd about the bag, and what of it is not played."""
        p = self.settings
        longest = sorted(p.gaps, key=lambda gap: gap[0] - gap[1])[:SHOWN]
        then = 'jumped over' if p.skip_gaps else '--skip-gaps jumps over it'
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
            self.player.meet()
            if met and not self.player.waits_for():
                self._phase = self._play
                if self.aloud:
                    self.begin(f'plays {self.settings.index.bag}')
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
        self.player.look(now)
        rival = self._rival(now)
        failure = str(rival) if rival is not None else self.player.failure
        if failure:
            self.failure = failure
            self.get_logger().error(failure)
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
        player, p = self.player, self.settings
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
            seconds = (ns - self.settings.index.first) / interface.NANOSECONDS
            response.message = f'to {seconds:g} s of the bag'
        else:
            response.message = 'at the end of the bag' if paused else 'not paused'
        return response

    def _on_parameters(self, changed: list[Parameter]) -> SetParametersResult:
        for parameter in changed:
            if parameter.name == 'rate':
                if not math.isfinite(parameter.value):
                    return SetParametersResult(successful=False, reason='rate: not finite')
                self.player.change_rate(float(parameter.value))
        return SetParametersResult(successful=True)

    def close(self) -> None:
        """Leave no vehicle with a wrench."""
        self.player.let_go()


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
            return ReplayNode(
                context=context, parameter_overrides=given, use_global_arguments=False
            )

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
