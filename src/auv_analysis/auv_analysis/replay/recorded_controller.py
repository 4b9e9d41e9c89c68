"""The controller of a bag as its attached parameters describe it, to be given any law."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from auv_analysis.bag import attachments
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.control.controller import VelocityController
from auv_gvc_controller.control.setpoint_buffer import SAME, Pairing
from auv_gvc_controller.control.settings import ControllerSettings, usual_acceleration
from auv_gvc_controller.laws.law import (
    law_class,
    make_gains,
    refusal,
    try_law,
)
from auv_gvc_controller.laws.model import control_model


class RecordedController:
    """Everything of a controller but its law; its clock is that of the stamps.

    Parameters
    ----------
    parameters : of the node, as they were attached to the bag; empty: not known
    vehicle : what it knows
    bag : for refusals
    derivatives : whether nu_d_dot was recorded

    Attributes
    ----------
    law, gains : as they were; 'unknown' and none where the bag does not say
    settings : what the node runs with where it is given the same parameters

    Raises
    ------
    InputError : a parameter is not what it should be

    """

    def __init__(
        self, parameters: Mapping[str, Any], vehicle: Vehicle, bag: Path, *, derivatives: bool
    ):
        self._vehicle = vehicle
        self.law, self.gains = attachments.law_and_gains(dict(parameters), bag)
        source = f'{bag}: params.yaml: controller_node'
        self.settings = recorded_settings(parameters, source)
        if self.settings.setpoint_acceleration == SAME and not derivatives:
            usual = usual_acceleration(self.settings.lockstep)
            self.settings = replace(self.settings, setpoint_acceleration=usual)

    def build(self, law: str, gains: Mapping[str, Any], pairing: Pairing) -> VelocityController:
        """Controller with a law, and the set-points that have come; InputError: no such law."""
        try:
            made = make_gains(law, gains)
            try_law(made, control_model(self._vehicle))
        except ValueError as error:
            gain, expected, found = refusal(error)
            raise InputError('--gain' if gain else '--law', gain, expected, found) from None
        return self.settings.build(made, self._vehicle, pairing)

    def gains_of(self, law: str, given: Mapping[str, Any]) -> dict[str, Any]:
        """Gains for a law: those that are given, the others as they were recorded."""
        try:
            names = law_class(law)._fields
        except ValueError as error:
            raise InputError('--law', '', *refusal(error)[1:]) from None
        return {**{name: v for name, v in self.gains.items() if name in names}, **given}


def recorded_settings(values: Mapping[str, Any], source: str) -> ControllerSettings:
    """Settings of parameters by name, as a bag carries them; InputError for a wrong one."""

    def reader(
        name: str, kind: Any, default: Any, _: str, *, at_least: float = 0.0,
        at_most: float = math.inf, one_of: tuple[str, ...] = (),
    ) -> Any:  # fmt: skip
        value = values.get(name, default)
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        good = {
            float: lambda: (
                isinstance(value, float) and at_least <= value <= at_most and value < math.inf
            ),
            list[float]: lambda: value is None or isinstance(value, list),
            str: lambda: value in one_of,
            bool: lambda: isinstance(value, bool),
        }
        if not good[kind]():
            expected = {
                float: f'a number from {at_least:g} to {at_most:g}',
                str: f'one of {", ".join(one_of)}',
                list[float]: 'a list of numbers', bool: 'true or false',
            }  # fmt: skip
            raise InputError(source, name, expected[kind], value)
        return value

    return ControllerSettings.read(reader, source)
