"""The controller's ROS parameters, and the controller that they describe."""

import math
from typing import Any

import numpy as np
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from auv_dynamics import load_vehicle
from auv_dynamics.allocation import Reach, make_reach
from auv_dynamics.files import InputError
from auv_dynamics.ros.parameters import declare, given
from auv_dynamics.vehicle import Vehicle
from auv_gvc_controller.controller import Timeouts, VelocityController
from auv_gvc_controller.hand_over import HandOver
from auv_gvc_controller.laws import SHIPPED, is_unasked, law_class, make_gains, refusal, try_law
from auv_gvc_controller.limits import Limits
from auv_gvc_controller.model import control_model
from auv_gvc_controller.odometry_guard import OdometryGuard
from auv_gvc_controller.pairing import DIFFERENCE, SAME, Pairing
from auv_gvc_controller.sampled import SampledLaw
from auv_gvc_controller.stamp_age import AUTO, CLOCKS, StampAge

GAINS = {gain for law in SHIPPED.values() for gain in law._fields}
WRITABLE = 'gains.'
LAWS = f'{", ".join(SHIPPED)} or module:Class of your own'


class ControllerParameters:
    """Declares the parameters at construction, builds a controller from them on demand."""

    def __init__(self, node: Node):
        self._node = node
        self._named = declare(node, 'law', str, '', LAWS, writable=True)
        names = {*(f'{WRITABLE}{gain}' for gain in GAINS), *given(node, WRITABLE)}
        for name in sorted(names):
            text = '1 number (times identity), 6 (diagonal) or 36 (row-major)'
            declare(node, name, list[float], None, text, writable=True)
        self._vehicle = declare(node, 'vehicle', str, '', 'vehicle file, or shipped bare name')
        self.lockstep = declare(node, 'lockstep', bool, False, 'answer every odometry, in its time')
        self.exact = (
            declare(
                node,
                'setpoint_pairing',
                str,
                'latest',
                'which set-point',
                one_of=('exact', 'latest'),
            )
            == 'exact'
        )
        self.acceleration = declare(
            node, 'setpoint_acceleration', str, DIFFERENCE, 'where nu_d_dot comes from',
            one_of=(SAME, DIFFERENCE),
        )  # fmt: skip
        self._odometry_timeout = self._time(
            'odometry_timeout', 0.5, 'silence or age of the stamp: zero wrench'
        )
        self._setpoint_timeout = self._time(
            'setpoint_timeout', 0.5, 'silence or age of the stamp: zero wrench'
        )
        self._gap = self._time('limits.gap', 1.0, 'longest step of time that is integrated')
        self._limits = Limits(
            self._size('limits.speed', 20.0, 'm/s'),
            self._size('limits.rate', 20.0, 'rad/s'),
            self._size('limits.acceleration', 100.0, 'm/s2, rad/s2'),
        )
        self._wrench_limit = self._six('limits.wrench', 'clips the wrench')
        self._slew = self._six('limits.wrench_rate', 'per s, limits its change')
        self._ramp = self._time('ramp', 0.2, 'real time: from no wrench to all of it, and back')
        self._stamp_clock = declare(
            node, 'stamp_clock', str, AUTO,
            "that odometry is stamped with: the node's own (ros), a free-running one (own), "
            'or auto: ros if they count from the same beginning, else its age is not judged',
            one_of=CLOCKS,
        )  # fmt: skip
        self._known_limit = self._six('actuators.limit', 'of the actuators, for anti-windup')
        self._thrusters = declare(
            node, 'actuators.thrusters', bool, False, "anti-windup knows the vehicle's thrusters"
        )
        self._anti_windup = declare(
            node, 'anti_windup', bool, True, 'stop integrating what pushes beyond these limits'
        )
        self.pairing = Pairing(self.exact, self.acceleration, self._limits)
        self.autostart = declare(node, 'autostart', bool, True, 'configure and activate at once')

    def _size(self, name: str, default: float, unit: str) -> float:
        return declare(self._node, name, float, default, f'{unit}; more is refused', at_least=0.0)

    def _time(self, name: str, default: float, text: str) -> float:
        return declare(self._node, name, float, default, f's, {text}', at_least=0.0)

    def _six(self, name: str, text: str) -> tuple[float, ...]:
        node = self._node
        text = f'1 or 6 numbers, N, N m, {text}; none: off'
        values = declare(node, name, list[float], None, text) or []
        values = values * 6 if len(values) == 1 else values
        if len(values) not in (0, 6) or not all(v > 0 and math.isfinite(v) for v in values):
            raise InputError(node.get_name(), name, '1 or 6 positive numbers', values)
        return tuple(values)

    def _reach(self, vehicle: Vehicle) -> Reach:
        """What anti-windup knows of the wrenches that can be had."""
        if self._thrusters and vehicle.thrusters is None:
            name, expected = self._node.get_name(), f'a vehicle with thrusters, not {vehicle.name}'
            raise InputError(name, 'actuators.thrusters', expected, 'true')
        if not self._anti_windup:
            return make_reach(None, None)
        limits = [limit for limit in (self._wrench_limit, self._known_limit) if limit]
        smallest = [min(axis) for axis in zip(*limits, strict=True)]
        return make_reach(smallest or None, vehicle if self._thrusters else None)

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
        try:
            gains = make_gains(law, self._gains(law))
            try_law(gains, control_model(vehicle))
        except ValueError as error:
            gain, expected, found = refusal(error)
            key = f'{WRITABLE}{gain}' if gain else 'law'
            raise InputError(name, key, expected, found) from None
        self.pairing.reset()
        law = SampledLaw(gains, control_model(vehicle), self._reach(vehicle))
        gap, limit = round(self._gap * 1e9), self._wrench_limit or self._believable(vehicle)
        if self.lockstep:
            guard = OdometryGuard(gap, self._limits, lockstep=True)
            output = HandOver(limit, self._slew)
            return VelocityController(
                law, self.pairing, guard, output, exact=self.exact, timeouts=None
            )
        late = Timeouts(self._odometry_timeout, self._setpoint_timeout)
        age = StampAge(self._stamp_clock, round(late.odometry * 1e9))
        guard = OdometryGuard(gap, self._limits, lockstep=False, patience=late.odometry, age=age)
        output = HandOver(limit, self._slew, self._ramp)
        return VelocityController(law, self.pairing, guard, output, exact=self.exact, timeouts=late)

    def _believable(self, vehicle: Vehicle) -> tuple[float, ...]:
        """Largest wrench of a controller without limits: what accelerations beyond belief take."""
        return tuple((np.abs(vehicle.M).sum(axis=1) * self._limits.acceleration).tolist())

    def _gains(self, law: str) -> dict[str, Any]:
        values = {}
        given_here = (name.removeprefix(WRITABLE) for name in given(self._node, WRITABLE))
        for gain in {*law_class(law)._fields, *given_here}:
            parameter = self._node.get_parameter_or(f'{WRITABLE}{gain}', None)
            if parameter is not None and parameter.type_ != Parameter.Type.NOT_SET:
                values[gain] = list(parameter.value)
        return values

    def refuse_while(self, active: bool, parameters: list[Parameter]) -> SetParametersResult:
        """Answer a change of parameters: laws and gains are taken while inactive only."""
        for parameter in parameters:
            if parameter.name != 'law' and not parameter.name.startswith(WRITABLE):
                continue
            if active:
                reason = f'{parameter.name}: expected an inactive controller, found an active one'
                return SetParametersResult(successful=False, reason=reason)
            try:
                if parameter.name == 'law':
                    self._check_law(parameter.value)
                elif len(parameter.value) not in (1, 6, 36) or not all(
                    map(math.isfinite, parameter.value)
                ):
                    found = f'{len(parameter.value)} numbers'
                    raise ValueError(f'expected 1, 6 or 36 finite numbers, found {found}')
            except (ValueError, TypeError) as error:
                reason = f'{parameter.name}: {error}'
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _check_law(self, name: str) -> None:
        """Refuse a module that only the network names: to import it is to run it."""
        if is_unasked(name) and name != self._named:
            expected = f'one of {", ".join(SHIPPED)}, or the law that was named at the start'
            raise ValueError(f'expected {expected}, found {name!r}')
        law_class(name)
