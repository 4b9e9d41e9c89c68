"""Settings of a controller beside law, gains and vehicle: defaults, ranges, construction."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import is_number
from auv_dynamics.ros.interface import LARGEST
from auv_dynamics.ros.settings import LONGEST, Reader, name_of, read_settings, setting
from auv_dynamics.vehicle.thrusters import SATURATIONS, SCALED, AttainableWrench, make_reach
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.control.controller import OutputStage, Timeouts, VelocityController
from auv_gvc_controller.control.odometry_guard import AUTO, CLOCKS, Limits, OdometryGuard, StampAge
from auv_gvc_controller.control.sampled_law import SampledLaw
from auv_gvc_controller.control.setpoint_buffer import (
    DIFFERENCE,
    FILTER,
    NONE,
    SAME,
    ReferenceFilter,
    SetpointBuffer,
)
from auv_gvc_controller.laws.model import control_model

LATEST, EXACT = 'latest', 'exact'
_number = partial(setting, at_least=0.0)
_seconds = partial(_number, at_most=LONGEST)


def _six(text: str, name: str) -> Any:
    return setting((), f'1 or 6 numbers, N, N m, {text}; none: off', name)


@dataclass(frozen=True)
class ControllerSettings:
    """Settings of a controller, by the names of its parameters with `_` for a dot.

    Times in s; `()` stands for six numbers that are not given.
    """

    lockstep: bool = setting(False, 'answer every odometry, in its time')
    setpoint_pairing: str = setting(
        LATEST,
        'set-point of the same stamp as odom (exact), or the newest at or before it (latest)',
        one_of=(EXACT, LATEST),
    )
    setpoint_acceleration: str = setting(
        FILTER,
        'where nu_d_dot comes from: cmd_accel of the same stamp (topic), a reference filter that '
        'smooths nu_d as well (filter; usual in real time), nowhere, zero (none), or the '
        'difference of two set-points (difference; usual in lock-step)',
        one_of=(SAME, FILTER, NONE, DIFFERENCE),
    )
    filter_omega: float = setting(
        1.0, 'rad/s, natural frequency', 'setpoint_filter.omega', at_least=0.01, at_most=20.0
    )
    filter_zeta: float = setting(
        1.0, 'damping ratio', 'setpoint_filter.zeta', at_least=0.5, at_most=5.0
    )
    filter_speed: float = _number(3.0, 'm/s, largest nu_d of an axis', 'setpoint_filter.speed')
    filter_rate: float = _number(1.0, 'rad/s, largest nu_d of an axis', 'setpoint_filter.rate')
    filter_acceleration: float = _number(
        0.2, 'm/s2, largest of an axis; of the difference as well', 'setpoint_filter.acceleration'
    )
    filter_angular_acceleration: float = _number(
        0.2, 'rad/s2, the same of roll, pitch and yaw', 'setpoint_filter.angular_acceleration'
    )
    odometry_timeout: float = _seconds(0.5, 's, silence or age of the stamp: zero wrench')
    setpoint_timeout: float = _seconds(0.5, 's, silence or age of the stamp: zero wrench')
    limits_gap: float = _seconds(1.0, 's, longest step of time that is integrated', 'limits.gap')
    limits_speed: float = _number(20.0, 'm/s; more is refused', 'limits.speed')
    limits_rate: float = _number(20.0, 'rad/s; more is refused', 'limits.rate')
    limits_acceleration: float = _number(
        100.0, 'm/s2, rad/s2; more is refused', 'limits.acceleration', at_most=LARGEST
    )
    limits_wrench: tuple[float, ...] = _six(
        'largest wrench; must be known in real time', 'limits.wrench'
    )
    limits_wrench_rate: tuple[float, ...] = _six('per s, its fastest change', 'limits.wrench_rate')
    ramp: float = _number(0.2, 's, real time: over which a law engages and disengages')
    stamp_clock: str = setting(
        AUTO,
        "that odometry is stamped with: the node's own (ros), a free-running one (own), "
        'or auto: ros if they count from the same beginning, else own',
        one_of=CLOCKS,
    )
    actuators_limit: tuple[float, ...] = _six(
        'largest wrench of the actuators, for anti-windup', 'actuators.limit'
    )
    actuators_thrusters: bool = setting(
        False, "anti-windup knows the vehicle's thrusters", 'actuators.thrusters'
    )
    actuators_saturation: str = setting(
        SCALED,
        'of thrusts beyond their limits: all alike (scaled), or heave and attitude kept (priority)',
        'actuators.saturation',
        one_of=SATURATIONS,
    )
    anti_windup: bool = setting(True, 'stop integrating what pushes beyond these limits')
    source: str = ''  # node or file that they come from, for refusals

    @classmethod
    def read(cls, reader: Reader, source: str) -> 'ControllerSettings':
        """Settings from whatever knows parameters.

        Parameters
        ----------
        reader : `(name, type, default, description, *, at_least, at_most, one_of)` -> value
        source : node or file, for refusals

        Raises
        ------
        InputError : what the reader refuses, or six numbers that are none

        """
        usual = usual_acceleration(reader('lockstep', bool, False, ''))
        read = read_settings(cls, reader, source, setpoint_acceleration=usual)
        six: dict[str, Any] = {
            entry.name: _six_numbers(getattr(read, entry.name), source, name_of(entry))
            for entry in fields(cls)
            if entry.type == tuple[float, ...]
        }
        return replace(read, source=source, **six)

    def unlike(self, other: 'ControllerSettings') -> dict[str, Any]:
        """Name of a parameter -> value here, of those that have another value there."""
        values = {entry: getattr(self, entry.name) for entry in fields(self) if entry.metadata}
        return {name_of(entry): value for entry, value in values.items()
                if value != getattr(other, entry.name)}  # fmt: skip

    def setpoints(self) -> SetpointBuffer:
        """Buffer that keeps set-points until their odometry comes."""
        exact = self.setpoint_pairing == EXACT
        return SetpointBuffer(exact, self.setpoint_acceleration, *self.believed)

    @property
    def believed(self) -> tuple[Limits, tuple[float, ...] | None]:
        """Limits of set-points, and those of the difference of two."""
        return self.limits, None if self.lockstep else self._steepest

    @property
    def limits(self) -> Limits:
        """Velocities and accelerations that are believed."""
        return Limits(self.limits_speed, self.limits_rate, self.limits_acceleration)

    @property
    def _steepest(self) -> tuple[float, ...]:
        """(6,) largest nu_d_dot of the filter and of the difference."""
        return (self.filter_acceleration,) * 3 + (self.filter_angular_acceleration,) * 3

    def _reference_filter(self) -> ReferenceFilter | None:
        if self.setpoint_acceleration != FILTER:
            return None
        fastest = (self.filter_speed,) * 3 + (self.filter_rate,) * 3
        return ReferenceFilter(self.filter_omega, self.filter_zeta, fastest, self._steepest)

    def build(self, gains: Any, vehicle: Vehicle, setpoints: SetpointBuffer) -> VelocityController:
        """Controller with a law.

        Parameters
        ----------
        gains : of the law, which they name (`make_gains`)
        vehicle : what the law knows
        setpoints : with the set-points that have come

        """
        law = SampledLaw(gains, control_model(vehicle), self._reach(vehicle))
        live = not self.lockstep
        timeouts = Timeouts(self.odometry_timeout, self.setpoint_timeout) if live else None
        guard = OdometryGuard(
            round(self.limits_gap * 1e9),
            self.limits,
            self.lockstep,
            patience=self.odometry_timeout,
            age=StampAge(self.stamp_clock, self.odometry_timeout) if live else None,
        )
        ramp = self.ramp if live else 0.0
        return VelocityController(
            law,
            setpoints,
            guard,
            OutputStage(self._wrench_limit(vehicle), self.limits_wrench_rate, ramp),
            timeouts=timeouts,
            reference_filter=self._reference_filter(),
        )

    def check_bounded(self) -> None:
        """Raise InputError for a controller beside a vehicle whose wrench nothing limits."""
        if self.lockstep or self.limits_wrench or self.actuators_limit or self.actuators_thrusters:
            return
        expected = 'in real time the largest wrench of the vehicle, 1 or 6 numbers in N, N m'
        raise InputError(self.source, 'limits.wrench', expected, None)

    def _wrench_limit(self, vehicle: Vehicle) -> tuple[float, ...]:
        """Largest wrench; without limits what accelerations beyond belief take."""
        if not self.lockstep and not self.limits_wrench:
            if self.actuators_limit:
                return self.actuators_limit
            if self.actuators_thrusters and vehicle.thrusters is not None:
                return tuple(vehicle.thrusters.largest().tolist())
        believable = np.abs(vehicle.M).sum(axis=1) * self.limits_acceleration
        return self.limits_wrench or tuple(believable.tolist())

    def _reach(self, vehicle: Vehicle) -> AttainableWrench:
        """The attainable wrench set, for anti-windup."""
        if self.actuators_thrusters and vehicle.thrusters is None:
            expected = f'a vehicle with thrusters, not {vehicle.name}'
            raise InputError(self.source, 'actuators.thrusters', expected, 'true')
        if not self.anti_windup:
            return make_reach(None, None)
        limits = [limit for limit in (self.limits_wrench, self.actuators_limit) if limit]
        smallest = [min(axis) for axis in zip(*limits, strict=True)]
        thrusters = vehicle.thrusters if self.actuators_thrusters else None
        return make_reach(smallest or None, thrusters, self.actuators_saturation)


def usual_acceleration(lockstep: bool) -> str:
    """Where nu_d_dot comes from when nobody says it."""
    return DIFFERENCE if lockstep else FILTER


def _six_numbers(values: Sequence[Any], source: str, name: str) -> tuple[float, ...]:
    """Six numbers of one or six, zero for an axis without actuators; none of none."""
    listed = [*values] * (6 if len(values) == 1 else 1)
    good = all(is_number(value) and 0 <= value < math.inf for value in listed)
    if len(listed) not in (0, 6) or not good or (listed and not any(listed)):
        raise InputError(source, name, '1 or 6 numbers of at least 0, one above it', [*values])
    return tuple(map(float, listed))
