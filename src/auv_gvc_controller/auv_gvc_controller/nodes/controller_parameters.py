"""The controller's ROS parameters, and the controller that they describe."""

import math
from array import array
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.parameters import declare, given
from auv_gvc_controller.control.controller import VelocityController
from auv_gvc_controller.control.settings import ControllerSettings
from auv_gvc_controller.laws.law import (
    SHIPPED,
    is_unasked,
    law_class,
    make_gains,
    refusal,
    try_law,
)
from auv_gvc_controller.laws.model import control_model

GAINS = {gain for law in SHIPPED.values() for gain in law._fields}
WRITABLE = 'gains.'
SETTINGS = {entry.metadata['name'] for entry in fields(ControllerSettings)[1:]}
FIXED = ('lockstep', 'setpoint_pairing', 'setpoint_acceleration')  # which decide what is heard
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
        self.settings = ControllerSettings.read(self._declare, node.get_name())
        self.lockstep = self.settings.lockstep
        self.acceleration = self.settings.setpoint_acceleration
        self.pairing = self.settings.pairing()
        self.autostart = declare(node, 'autostart', bool, True, 'configure and activate at once')

    def _declare(self, name: str, *about: Any, **accepted: Any) -> Any:
        return declare(self._node, name, *about, writable=name not in FIXED, **accepted)

    def _present(self, changed: Mapping[str, Any]) -> ControllerSettings:
        """Settings of this moment, with what is about to change; InputError for a wrong value."""

        def value(name: str, *_: Any, **__: Any) -> Any:
            found = changed[name] if name in changed else self._node.get_parameter(name).value
            if isinstance(found, float) and not math.isfinite(found):
                raise InputError(self._node.get_name(), name, 'a finite number', found)
            return list(found) if isinstance(found, array) else found

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
            gains = make_gains(law, self._gains(law))
            try_law(gains, control_model(vehicle))
        except ValueError as error:
            gain, expected, found = refusal(error)
            key = f'{WRITABLE}{gain}' if gain else 'law'
            raise InputError(name, key, expected, found) from None
        self.settings = self._present({})
        self.settings.check_bounded()
        self.pairing.believe(*self.settings.believed)
        self.pairing.reset()
        return self.settings.build(gains, vehicle, self.pairing)

    def _gains(self, law: str) -> dict[str, Any]:
        values = {}
        given_here = (name.removeprefix(WRITABLE) for name in given(self._node, WRITABLE))
        for gain in {*law_class(law)._fields, *given_here}:
            parameter = self._node.get_parameter_or(f'{WRITABLE}{gain}', None)
            if parameter is not None and parameter.type_ != Parameter.Type.NOT_SET:
                values[gain] = list(parameter.value)
        return values

    def refuse_while(self, active: bool, parameters: list[Parameter]) -> SetParametersResult:
        """Answer a change of parameters: law, gains and settings are taken while inactive only."""
        changed = {one.name: one.value for one in parameters if one.name in SETTINGS}
        for parameter in parameters:
            of_law = parameter.name == 'law' or parameter.name.startswith(WRITABLE)
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
