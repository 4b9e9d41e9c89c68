"""The velocity controller as a lifecycle node: odometry and set-points in, wrench out."""

import json
import math
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError, first_line
from auv_dynamics.files.nearest import one_of as nearest_of
from auv_dynamics.ros import topics
from auv_dynamics.ros.endpoints import why_silent
from auv_dynamics.ros.interface import (
    CONTROLLER,
    GAIN,
    GAINS_FACT,
    LAW_FACT,
    NANOSECONDS,
    SETTINGS_FACT,
)
from auv_dynamics.ros.node_interface import (
    ERROR,
    OK,
    STALE,
    WARN,
    Health,
    NodeInterface,
    steady_timer,
)
from auv_dynamics.ros.node_main import BulkMixin, main_of
from auv_dynamics.ros.parameters import declare, given, refuse_unknown
from auv_dynamics.ros.rclpy_internals import RCLError
from auv_dynamics.ros.settings import name_of
from auv_gvc_controller.control.controller import Answer, VelocityController
from auv_gvc_controller.control.odometry_guard import UNTIMED, Now
from auv_gvc_controller.control.setpoint_buffer import SAME
from auv_gvc_controller.control.settings import ControllerSettings
from auv_gvc_controller.laws.law import SHIPPED, is_unasked, law_class, make_gains, refusal, try_law
from auv_gvc_controller.laws.model import control_model

GAINS = {gain for law in SHIPPED.values() for gain in law._fields}
SETTINGS = {name_of(entry) for entry in fields(ControllerSettings) if entry.metadata}
FIXED = {'setpoint_pairing', 'setpoint_acceleration'}  # which decide what is heard
LAWS = f'{", ".join(SHIPPED)} or module:Class of your own'


class ControllerParameters:
    """Declares the parameters at construction, builds a controller from them on demand."""

    def __init__(self, node: Any):
        self._node = node
        self._named = declare(node, 'law', str, '', LAWS, writable=True)
        names = {*(f'{GAIN}{gain}' for gain in GAINS), *given(node, GAIN)}
        for name in sorted(names):
            text = '1 number (times identity), 6 (diagonal) or 36 (row-major)'
            declare(node, name, list[float], None, text, writable=True)
        self._vehicle = declare(node, 'vehicle', str, '', 'vehicle file, or shipped bare name')
        self._begun = self.settings = ControllerSettings.read(self._declare, node.get_name())
        self.acceleration = self.settings.setpoint_acceleration
        self.setpoints = self.settings.setpoints()
        self.autostart = declare(node, 'autostart', bool, True, 'configure and activate at once')

    def _declare(self, name: str, *about: Any, **accepted: Any) -> Any:
        if name == 'lockstep':
            return self._node.lockstep
        return declare(self._node, name, *about, writable=name not in FIXED, **accepted)

    def _present(self, changed: Mapping[str, Any]) -> ControllerSettings:
        """Settings of this moment, with what is about to change; InputError for a wrong value."""

        def value(name: str, *_: Any, **accepted: Any) -> Any:
            found = changed[name] if name in changed else self._node.get_parameter(name).value
            if accepted.get('one_of') and found not in accepted['one_of']:
                expected = nearest_of(found, accepted['one_of'])
                raise InputError(self._node.get_name(), name, expected, found)
            return found

        return ControllerSettings.read(value, self._node.get_name())

    def build(self) -> VelocityController:
        """Controller of the present values; InputError when law, vehicle or a gain is missing."""
        node = self._node
        name = node.get_name()
        law = node.get_parameter('law').value
        if not law:
            raise InputError(name, 'law', LAWS, None)
        if not self._vehicle:
            raise InputError(name, 'vehicle', 'a vehicle file', None)
        vehicle = load_vehicle(self._vehicle)
        self.vehicle_name = vehicle.name
        try:
            values = self._gains(law)
            gains = make_gains(law, values)
            try_law(gains, control_model(vehicle))
        except ValueError as error:
            gain, expected, found = refusal(error)
            key = f'{GAIN}{gain}' if gain else 'law'
            raise InputError(name, key, expected, found) from None
        self.settings = self._present({})
        self.settings.check_bounded()
        self.told = {
            LAW_FACT: law,
            GAINS_FACT: json.dumps(values, sort_keys=True),
            SETTINGS_FACT: json.dumps(self.settings.unlike(self._begun), sort_keys=True),
        }
        self.setpoints.believe(*self.settings.believed)
        if self.settings.lockstep:
            self.setpoints.reset()
        else:  # what came to an inactive controller may be of a time that is over
            self.setpoints.forget()
        return self.settings.build(gains, vehicle, self.setpoints)

    def _gains(self, law: str) -> dict[str, Any]:
        values = {}
        known = law_class(law)
        given_here = (name.removeprefix(GAIN) for name in given(self._node, GAIN))
        for gain in {*known._fields, *given_here}:
            parameter = self._node.get_parameter_or(f'{GAIN}{gain}', None)
            if parameter is not None and parameter.type_ != Parameter.Type.NOT_SET:
                values[gain] = list(parameter.value)
        needed = {*known._fields} - getattr(known, '_field_defaults', {}).keys()
        if law != self._named and values.keys() >= needed:  # others are of the law at the start
            values = {gain: value for gain, value in values.items() if gain in known._fields}
        return values

    def refuse_while(self, active: bool, parameters: list[Parameter]) -> SetParametersResult:
        """Answer a change of parameters: law, gains and settings are taken while inactive only."""
        changed = {one.name: one.value for one in parameters if one.name in SETTINGS}
        for parameter in parameters:
            of_law = parameter.name == 'law' or parameter.name.startswith(GAIN)
            if not of_law and parameter.name not in changed:
                continue
            if active:
                reason = f'{parameter.name}: expected an inactive controller, found an active one'
                return SetParametersResult(successful=False, reason=reason)
            try:
                if not of_law:
                    self._present(changed)
                elif parameter.name == 'law':
                    self._check_law(parameter.value)
                elif len(parameter.value) not in (1, 6, 36) or not all(
                    map(math.isfinite, parameter.value)
                ):
                    found = f'{len(parameter.value)} numbers'
                    raise ValueError(f'expected 1, 6 or 36 finite numbers, found {found}')
            except (ValueError, TypeError) as error:
                text = str(error).removeprefix(f'{self._node.get_name()}: ')
                reason = text if not of_law else f'{parameter.name}: {text}'
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _check_law(self, name: str) -> None:
        """Refuse a module that only the network names: to import it is to run it."""
        if is_unasked(name) and name != self._named:
            expected = f'one of {", ".join(SHIPPED)}, or the law that was named at the start'
            raise ValueError(f'expected {expected}, found {name!r}')
        law_class(name)


LATE = 1.0  # s without a message, after which nobody is said to publish
NO_ODOMETRY, NO_SETPOINT = 'no odometry', 'no set-point'  # what the watchdog's texts begin with


class Idle:
    """Explains the watchdog of a controller by what has been heard.

    Parameters
    ----------
    node : the controller node
    derivative : whether each set-point needs its `cmd_accel`

    """

    def __init__(self, node: Any, derivative: bool):
        self._node, self._derivative = node, derivative
        # topic -> its newest stamp, ns, and when that came by the steady clock, s
        self._heard = dict.fromkeys((topics.CMD_VEL, topics.CMD_ACCEL), (0, -math.inf))

    def hear(self, topic: topics.Topic, ns: int) -> None:
        """Note a set-point or its derivative."""
        self._heard[topic] = ns, time.monotonic()

    def health(self, watchdog: str, odometry_ns: int | None) -> Health:
        """Level and explanation of what the watchdog says.

        Parameters
        ----------
        watchdog : why the law is not in charge; empty while it is
        odometry_ns : stamp of the last odometry; None: there was none yet

        """
        if not watchdog and odometry_ns is None:
            watchdog = f'{NO_ODOMETRY} yet'
        level, why = ERROR if watchdog else OK, ''
        if watchdog.startswith(NO_ODOMETRY):
            level, why = STALE, why_silent(self._node, topics.ODOM)
        elif watchdog.startswith(NO_SETPOINT):
            level, why = WARN, self._no_setpoint(odometry_ns or 0)
        return level, f'{watchdog}: {why}' if why else watchdog

    def _no_setpoint(self, odometry_ns: int) -> str:
        (ns, at), (_, derivative_at) = self._heard.values()
        if time.monotonic() - at > LATE:
            return why_silent(self._node, topics.CMD_VEL)
        if self._derivative and time.monotonic() - derivative_at > LATE:
            silent = why_silent(self._node, topics.CMD_ACCEL) or 'no cmd_accel of its stamp comes'
            return f'{silent}; setpoint_acceleration: topic waits for it'
        if (apart := abs(ns - odometry_ns) / NANOSECONDS) > LATE:
            found = f'stamps {apart:.3g} s apart from those of odom' if ns else 'stamp 0'
            return f'cmd_vel: expected the time at which it is valid as stamp, found {found}'
        return ''


WATCH = 0.02  # s between two looks at what stays away
WATCH_LOCKSTEP = 0.1  # s in lock-step, where nothing is late: each look costs the time of a step
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class ControllerNode(BulkMixin, LifecycleNode):
    """Tracks `cmd_vel` with a law that is named by a parameter."""

    latency_critical = True

    def __init__(self, **options: Any):
        super().__init__(CONTROLLER, **options)
        self.graph = NodeInterface(self)
        self._settings = ControllerParameters(self)
        refuse_unknown(self)
        self.add_on_set_parameters_callback(
            lambda changed: self._settings.refuse_while(self._active, changed)
        )
        self._controller: VelocityController  # exists once configured
        self._active = False
        self._held: tuple[Answer, bool] | None = None  # and whether the controller leaves with it
        self._missed: tuple[int, tuple[float, ...]] | None = None  # odometry of an inactive one
        self._follows = False
        self._publish_wrench = self.graph.output(topics.WRENCH)
        self._publish_estimate = self.graph.output(topics.DISTURBANCE_ESTIMATE)
        self.graph.also_ready_when(lambda: '' if self._active else 'inactive')
        self._idle = Idle(self, self._settings.acceleration == SAME)
        self.graph.in_trouble_while(self._trouble)
        self._subscribe()
        for service in self.services:
            service.callback = partial(self._answer, service.callback)
        self.create_service(Trigger, '~/reset', self._on_reset)
        steady_timer(self, WATCH_LOCKSTEP if self.lockstep else WATCH, self._watch)
        if self._settings.autostart:
            self._autostart()
        if self.exit_code is None:
            self.begin(self._task())

    def _task(self) -> str:
        law = self.get_parameter('law').value or 'a law'
        pace = 'lock-step' if self.lockstep else 'real time'
        return f'tracks {topics.CMD_VEL.name} with {law} in {pace}'

    def _subscribe(self) -> None:
        p = self._settings
        odometry = topics.one_at_a_time() if self.lockstep else topics.newest_measurement()
        self.graph.listen(topics.ODOM, self._on_odometry, odometry)
        self._keep(
            topics.CMD_VEL, lambda ns, nu_d: p.setpoints.setpoint(ns, nu_d, time.monotonic())
        )
        if p.acceleration == SAME:
            self._keep(topics.CMD_ACCEL, p.setpoints.derivative)

    def _autostart(self) -> None:
        if self.trigger_configure() == SUCCESS and self.trigger_activate() == SUCCESS:
            return
        self.exit_code = 2

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build the controller; one line says what is missing."""
        return SUCCESS if self._build() else FAILURE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start from zero integrals with the parameters of this moment.

        In lock-step a plant waits for the answer to an odometry that came before.
        """
        if not self._build():
            return FAILURE
        self._active, self.task = True, self._task()
        self.graph.facts.update(self._health())
        self.graph.publish_diagnostics()  # a bag has each law, however short it was in charge
        missed, self._missed = self._missed, None
        if missed is not None:
            try:
                self._on_odometry(*missed)
            except ValueError as error:
                self.graph.refuse(f'{topics.ODOM.name}: {error}')
        return SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the vehicle without a wrench."""
        self._disengage()
        self._active = False
        return SUCCESS

    on_shutdown = on_deactivate
    on_error = on_deactivate  # success leads to unconfigured, and on from there

    def _answer(self, callback: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        """Answer of rclpy's services; it leaves a transition that does not exist without one."""
        try:
            return callback(request, response)
        except RCLError as error:
            self.get_logger().error(f'refused: {first_line(error)}')
            return response

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
        if self._active:
            self._say(self._controller.odometry(ns, x, self._now()))
        elif self.lockstep:
            self._missed = ns, x

    def _now(self) -> Now:
        if self.lockstep:
            return UNTIMED
        return Now(time.monotonic(), self.get_clock().now().nanoseconds)

    def _keep(self, topic: topics.Topic, keep: Callable[[int, tuple[float, ...]], None]) -> None:
        """Subscribe to set-points; one may be what an odometry has been waiting for."""

        def take(ns: int, values: tuple[float, ...]) -> None:
            self._idle.hear(topic, ns)
            keep(ns, values)
            if self._active:
                self._say(self._controller.answer(self._now()))

        self.graph.listen(topic, take, topics.every_step())

    def _say(self, answer: Answer | None, leaves: bool = False) -> None:
        if answer is None:
            return
        self._held = None if self.graph.ready() else (answer, leaves)
        if self._held is not None:  # until the expected subscribers have matched; see _watch
            if not self.lockstep:
                self._controller.unheard()
            return
        if not leaves:
            self._tell(answer.trouble)
        elif self._follows:
            self._follows = False
            self.get_logger().info('disengages: zero wrench')
        self._publish_wrench(answer.ns, answer.tau)
        self._publish_estimate(answer.ns, answer.f)
        self.graph.latest_ns = answer.ns

    def _tell(self, trouble: str) -> None:
        """Log when the law engages, and when it disengages."""
        if trouble and self.lockstep:  # there nothing is late: something has failed
            self.graph.complain(trouble)
        elif self._follows == bool(trouble):
            self._follows = not trouble
            self.get_logger().info(f'disengages: {trouble}' if trouble else 'engages')

    def _trouble(self) -> Health:
        """The present problem, for as long as it lasts."""
        if not self._active:
            return OK, ''
        return self._idle.health(self._controller.watchdog, self._controller.newest)

    def _watch(self) -> None:
        """Say what is held back; in real time, disengage when odometry or set-points stay away."""
        if self._active:
            self._say(self._controller.watch(self._now()))
        if self._held is not None:
            self._say(*self._held)
        self.graph.facts.update(self._health())

    def _health(self) -> dict[str, Any]:
        """Entries of the controller in the diagnostics."""
        if not self._active:
            return {'active': False}
        c = self._controller
        watchdog = {'watchdog': c.watchdog or 'none', 'watchdog trips': c.trips}
        return {'active': True, **watchdog, **self._settings.told}

    def _disengage(self) -> None:
        if not self._active:
            return
        waited_for = self._held is not None or self._controller.unanswered is not None
        if waited_for or not self.lockstep:
            self._say(self._controller.silence(), leaves=True)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._active:
            self._controller.reset()
        response.success, response.message = True, 'integrals are zero'
        return response

    def close(self) -> None:
        """Leave the vehicle without a wrench, and see that it hears of it."""
        self._disengage()
        self.graph.publishers[topics.WRENCH.name].wait_for_all_acked(Duration(seconds=0.5))


def main() -> None:
    """Run the node."""
    main_of(ControllerNode)
