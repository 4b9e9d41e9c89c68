"""The velocity controller as a lifecycle node: odometry and set-points in, wrench out."""

import sys
import time
from collections.abc import Callable
from typing import Any

from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_srvs.srv import Trigger

from auv_dynamics.ros import topics
from auv_dynamics.ros.bulk import BulkMixin
from auv_dynamics.ros.graph import Graph, steady_timer
from auv_dynamics.ros.health import OK, Health
from auv_dynamics.ros.life import main_of
from auv_dynamics.ros.parameters import refuse_unknown
from auv_gvc_controller.control.controller import Answer, VelocityController
from auv_gvc_controller.control.odometry_guard import UNTIMED
from auv_gvc_controller.control.setpoint_buffer import SAME
from auv_gvc_controller.control.stamp_age import Now
from auv_gvc_controller.nodes.controller_parameters import ControllerParameters
from auv_gvc_controller.nodes.idle import Idle

WATCH = 0.02  # s between two looks at what stays away
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class ControllerNode(BulkMixin, LifecycleNode):
    """Tracks `cmd_vel` with a law that is named by a parameter."""

    prompt = True

    def __init__(self) -> None:
        super().__init__('controller_node')
        self.graph = Graph(self)
        self._settings = ControllerParameters(self)
        refuse_unknown(self)
        self.add_on_set_parameters_callback(
            lambda changed: self._settings.refuse_while(self._active, changed)
        )
        self._controller: VelocityController  # exists once configured
        self._active = False
        self._held: Answer | None = None
        self._follows = False
        self._say_wrench = self.graph.output(topics.WRENCH)
        self._say_estimate = self.graph.output(topics.DISTURBANCE_ESTIMATE)
        self.graph.also_ready_when(lambda: '' if self._active else 'inactive')
        self._idle = Idle(self, self._settings.acceleration == SAME)
        self.graph.in_trouble_while(self._trouble)
        self._subscribe()
        self.create_service(Trigger, '~/reset', self._on_reset)
        steady_timer(self, WATCH, self._watch)
        if self._settings.autostart:
            self._autostart()
        if self.exit_code is None:
            law = self.get_parameter('law').value or 'a law'
            pace = 'lock-step' if self._settings.lockstep else 'real time'
            self.begin(f'tracks {topics.CMD_VEL.name} with {law} in {pace}')

    def _subscribe(self) -> None:
        p = self._settings
        odometry = topics.one_at_a_time() if p.lockstep else topics.newest_measurement()
        self.graph.listen(topics.ODOM, self._on_odometry, odometry)
        self._keep(topics.CMD_VEL, lambda ns, nu_d: p.pairing.setpoint(ns, nu_d, time.monotonic()))
        if p.acceleration == SAME:
            self._keep(topics.CMD_ACCEL, p.pairing.derivative)

    def _autostart(self) -> None:
        if self.trigger_configure() == SUCCESS and self.trigger_activate() == SUCCESS:
            return
        self.exit_code = 2

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build the controller; one line says what is missing."""
        return super().on_configure(state) if self._build() else FAILURE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start from zero integrals with the parameters of this moment."""
        if not self._build():
            return FAILURE
        self._active = True
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the vehicle without a wrench."""
        self._let_go()
        self._active = False
        return super().on_deactivate(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the vehicle without a wrench."""
        self._let_go()
        self._active = False
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the vehicle without a wrench; success leads to unconfigured, and on from there."""
        self._let_go()
        self._active = False
        return super().on_error(state)

    def _build(self) -> bool:
        try:
            self._controller = self._settings.build()
            self.graph.hardware_id = self._settings.vehicle_name
        except (ValueError, ArithmeticError) as error:  # InputError among them
            print(error, file=sys.stderr, flush=True)
            self.graph.trouble = str(error)
            return False
        return True

    def _on_odometry(self, ns: int, x: tuple[float, ...]) -> None:
        if not self._active:
            return
        try:
            self._say(self._controller.odometry(ns, x, self._now()))
        except ValueError as error:
            self.graph.refuse(f'{topics.ODOM.name}: {error}')

    def _now(self) -> Now:
        if self._settings.lockstep:
            return UNTIMED
        return Now(time.monotonic(), self.get_clock().now().nanoseconds)

    def _keep(self, topic: topics.Topic, keep: Callable[[int, tuple[float, ...]], None]) -> None:
        """Subscribe to set-points; one may be what an odometry has been waiting for."""

        def take(ns: int, values: tuple[float, ...]) -> None:
            self._idle.hear(topic, ns)
            try:
                keep(ns, values)
            except ValueError as error:
                self.graph.refuse(f'{topic.name}: {error}')
                return
            if self._active:
                self._say(self._controller.answer(self._now()))

        self.graph.listen(topic, take, topics.every_step())

    def _say(self, answer: Answer | None, *, leaves: bool = False) -> None:
        if answer is None:
            return
        self._held = None if self.graph.ready() else answer
        if self._held is not None:
            return  # until the expected subscribers have matched; see _watch
        if not leaves:
            self._tell(answer.trouble)
        elif self._follows:
            self._follows = False
            self.get_logger().info('lets go: zero wrench')
        self._say_wrench(answer.ns, answer.tau)
        self._say_estimate(answer.ns, answer.f)
        self.graph.latest_ns = answer.ns

    def _tell(self, trouble: str) -> None:
        """Log when the law takes over, and when it lets go."""
        if trouble and self._settings.lockstep:  # there nothing is late: something has failed
            self.graph.complain(trouble)
        elif self._follows == bool(trouble):
            self._follows = not trouble
            self.get_logger().info(f'lets go: {trouble}' if trouble else 'takes over')

    def _trouble(self) -> Health:
        """What is wrong for as long as it lasts."""
        if not self._active:
            return OK, ''
        return self._idle.health(self._controller.watchdog, self._controller.newest)

    def _watch(self) -> None:
        """Say what is held back; in real time, let go when odometry or set-points stay away."""
        if self._active:
            self._say(self._controller.watch(self._now()))
        if self._held is not None:
            self._say(self._held)
        self.graph.facts.update(self._health())

    def _health(self) -> dict[str, Any]:
        """What the diagnostics say of the controller."""
        if not self._active:
            return {'active': False}
        c = self._controller
        return {'active': True, 'watchdog': c.watchdog or 'none', 'watchdog trips': c.trips}

    def _let_go(self) -> None:
        if not self._active:
            return
        if not self._settings.lockstep or self._controller.unanswered is not None:
            self._say(self._controller.silence(), leaves=True)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._active:
            self._controller.reset()
        response.success, response.message = True, 'integrals are zero'
        return response

    def close(self) -> None:
        """Leave the vehicle without a wrench, and see that it hears of it."""
        self._let_go()
        self.graph.publishers[topics.WRENCH.name].wait_for_all_acked(Duration(seconds=0.5))


def main() -> None:
    """Run the node."""
    main_of(ControllerNode)
