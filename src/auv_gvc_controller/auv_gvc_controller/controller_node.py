"""The velocity controller as a lifecycle node: odometry and set-points in, wrench out."""

import sys
import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import AccelStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_srvs.srv import Trigger

from auv_dynamics import interface
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.bulk import BulkMixin
from auv_dynamics.ros.graph import Graph, steady_timer
from auv_dynamics.ros.life import main_of
from auv_dynamics.ros.parameters import refuse_unknown
from auv_gvc_controller.controller import Answer, VelocityController
from auv_gvc_controller.controller_parameters import ControllerParameters
from auv_gvc_controller.pairing import SAME

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
        self._heard: float | None = None
        self._held: Answer | None = None
        self._wrench = self.graph.publisher(topics.WRENCH)
        self._estimate = self.graph.publisher(topics.DISTURBANCE_ESTIMATE)
        self.graph.also_ready_when(lambda: '' if self._active else 'inactive')
        self._subscribe()
        self.create_service(Trigger, '~/reset', self._on_reset)
        steady_timer(self, 0.05, self._watch)
        if self._settings.autostart:
            self._autostart()

    def _subscribe(self) -> None:
        p = self._settings
        odometry = topics.one_at_a_time() if p.lockstep else topics.newest_measurement()
        self.graph.subscribe(topics.ODOM, self._on_odometry, odometry)
        self.graph.subscribe(topics.CMD_VEL, self._on_setpoint, topics.every_step())
        if p.acceleration == SAME:
            self.graph.subscribe(topics.CMD_ACCEL, self._on_acceleration, topics.every_step())

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
        self._active, self._heard = True, None
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

    def _build(self) -> bool:
        try:
            self._controller = self._settings.build()
        except (ValueError, ArithmeticError) as error:  # InputError among them
            print(error, file=sys.stderr, flush=True)
            self.graph.trouble = str(error)
            return False
        return True

    def _on_odometry(self, message: Odometry) -> None:
        if not self._active:
            return
        try:
            ns, x = interface.read_odometry(message, self.graph.frames)
            self._say(self._controller.odometry(ns, x))
            self._heard = time.monotonic()
        except interface.BadMessageError as error:
            self.graph.refuse(str(error))
        except ValueError as error:
            self.graph.refuse(f'odom: {error}')

    def _on_setpoint(self, message: TwistStamped) -> None:
        name, pairing = topics.CMD_VEL.name, self._settings.pairing
        self._take(name, pairing.setpoint, interface.read_twist, message)

    def _on_acceleration(self, message: AccelStamped) -> None:
        name, pairing = topics.CMD_ACCEL.name, self._settings.pairing
        self._take(name, pairing.derivative, interface.read_accel, message)

    def _take(self, topic: str, keep: Callable, read: Callable, message: Any) -> None:
        try:
            keep(*read(message, self.graph.frames, topic))
        except interface.BadMessageError as error:
            self.graph.refuse(str(error))
            return
        except ValueError as error:
            self.graph.refuse(f'{topic}: {error}')
            return
        if self._active:
            self._say(self._controller.answer())

    def _say(self, answer: Answer | None) -> None:
        if answer is None:
            return
        self._held = None if self.graph.ready() else answer
        if self._held is not None:
            return  # until the expected subscribers have matched; see _watch
        if answer.trouble:
            self.graph.complain(answer.trouble)
        self._wrench.publish(convert.wrench(answer.ns, answer.tau, self.graph.frames))
        self._estimate.publish(convert.wrench(answer.ns, answer.f, self.graph.frames))
        self.graph.latest_ns = answer.ns

    def _watch(self) -> None:
        """Say what is held back; in real time, let go when odometry falls silent."""
        if self._held is not None:
            self._say(self._held)
        if self._settings.lockstep or not self._active or self._heard is None:
            return
        if time.monotonic() - self._heard > self._settings.odometry_timeout:
            self._heard = None
            self._say(self._controller.silence('no odometry'))

    def _let_go(self) -> None:
        if not self._active:
            return
        lockstep = self._settings.lockstep
        if not lockstep or self._controller.unanswered is not None:
            self._say(self._controller.silence())

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._active:
            self._controller.reset()
        response.success, response.message = True, 'integrals are zero'
        return response

    def close(self) -> None:
        """Leave the vehicle without a wrench, and see that it hears of it."""
        self._let_go()
        self._wrench.wait_for_all_acked(Duration(seconds=0.5))


def main() -> None:
    """Run the node."""
    main_of(ControllerNode)
