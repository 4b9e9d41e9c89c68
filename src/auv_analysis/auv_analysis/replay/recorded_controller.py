"""The controller of a bag as its attached parameters describe it, to be given any law."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.bag import attached
from auv_dynamics.allocation import Reach, make_reach
from auv_dynamics.files import InputError
from auv_dynamics.vehicle import Vehicle
from auv_gvc_controller.controller import VelocityController
from auv_gvc_controller.hand_over import HandOver
from auv_gvc_controller.laws import law_class, make_gains, refusal, try_law
from auv_gvc_controller.limits import Limits
from auv_gvc_controller.model import control_model
from auv_gvc_controller.odometry_guard import OdometryGuard
from auv_gvc_controller.pairing import DIFFERENCE, SAME, Pairing
from auv_gvc_controller.sampled import SampledLaw

KEY = 'controller_node: '  # of its parameters, in refusals
RAMP, GAP = 0.2, 1.0  # s, what the node takes where nothing is written


class RecordedController:
    """Everything of a controller but its law, without the clock: that of the stamps is enough.

    Parameters
    ----------
    parameters : of the node, as they were attached to the bag; empty: not known
    vehicle : what it knows
    bag : for refusals
    derivatives : whether nu_d_dot was recorded

    Attributes
    ----------
    law, gains : as they were; 'unknown' and none where the bag does not say

    Raises
    ------
    InputError : a parameter is not what it should be

    """

    def __init__(
        self, parameters: Mapping[str, Any], vehicle: Vehicle, bag: Path, *, derivatives: bool
    ):
        self._parameters, self._vehicle, self._file = parameters, vehicle, f'{bag}: params.yaml'
        self.law, self.gains = attached.law_and_gains(dict(parameters), bag)
        self._lockstep = parameters.get('lockstep') is True
        chosen = parameters.get('setpoint_acceleration', SAME) == SAME
        self._acceleration = SAME if derivatives and chosen else DIFFERENCE
        self._limits = Limits(
            self._number('limits.speed', np.inf),
            self._number('limits.rate', np.inf),
            self._number('limits.acceleration', np.inf),
        )
        self._gap = round(self._number('limits.gap', GAP) * 1e9)
        self._wrench = self._six('limits.wrench')
        believed = np.abs(vehicle.M).sum(axis=1) * self._limits.acceleration
        limit = self._wrench or tuple(believed.tolist())
        ramp = 0.0 if self._lockstep else self._number('ramp', RAMP)
        self._output = limit, self._six('limits.wrench_rate'), ramp
        self._reach = self._known_reach()

    def build(self, law: str, gains: Mapping[str, Any]) -> tuple[VelocityController, Pairing]:
        """Controller with a law, and what it keeps set-points in; InputError: no such law."""
        model = control_model(self._vehicle)
        try:
            made = make_gains(law, gains)
            try_law(made, model)
        except ValueError as error:
            gain, expected, found = refusal(error)
            raise InputError('--gain' if gain else '--law', gain, expected, found) from None
        pairing = Pairing(self._lockstep, self._acceleration, self._limits)
        controller = VelocityController(
            SampledLaw(made, model, self._reach),
            pairing,
            OdometryGuard(self._gap, self._limits, self._lockstep),
            HandOver(*self._output),
            exact=self._lockstep,
            timeouts=None,
        )
        return controller, pairing

    def gains_of(self, law: str, given: Mapping[str, Any]) -> dict[str, Any]:
        """Gains for a law: those that are given, the others as they were recorded."""
        try:
            names = law_class(law)._fields
        except ValueError as error:
            raise InputError('--law', '', *refusal(error)[1:]) from None
        return {**{name: v for name, v in self.gains.items() if name in names}, **given}

    def _known_reach(self) -> Reach:
        if self._parameters.get('anti_windup', True) is not True:
            return make_reach(None, None)
        limits = [limit for limit in (self._wrench, self._six('actuators.limit')) if limit]
        smallest = [min(axis) for axis in zip(*limits, strict=True)]
        thrusters = self._parameters.get('actuators.thrusters') is True
        return make_reach(smallest or None, self._vehicle if thrusters else None)

    def _number(self, key: str, default: float) -> float:
        value = self._parameters.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0:
            raise InputError(self._file, f'{KEY}{key}', 'a number of at least 0', value)
        return float(value)

    def _six(self, key: str) -> tuple[float, ...]:
        """Six positive numbers; none where there is no such parameter."""
        value = self._parameters.get(key, [])
        listed = value * 6 if isinstance(value, list) and len(value) == 1 else value
        numbers = isinstance(listed, list) and all(
            isinstance(v, int | float) and not isinstance(v, bool) and v > 0 for v in listed
        )
        if not numbers or len(listed) not in (0, 6):
            raise InputError(self._file, f'{KEY}{key}', '1 or 6 positive numbers', value)
        return tuple(map(float, listed))
