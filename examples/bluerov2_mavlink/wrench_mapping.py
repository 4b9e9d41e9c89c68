"""From a wrench to the pilot's input that ArduSub takes, by the vehicle file's thrusters.

ArduSub adds the six axes up in the command of each thruster, with factors of +-1, and thrust goes
with the square of the command. Both are undone here: the thrusts that give the wrench have a part
that gives none, and there is one choice of it whose commands are a sum of axes. Where that is
beyond what the axes or the thrusters reach, the whole wrench is scaled: its direction stays.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.vehicle import Vehicle

BISECTIONS = 60
ALIKE = 1e-9
VERTICAL, HORIZONTAL = (2, 3, 4), (0, 1, 5)  # degrees of freedom by group of thrusters

# T200: full thrust by supply, Blue Robotics, bollard pull
VOLTS = (12.0, 16.0, 20.0)  # the limits of the vehicle files belong to the one in the middle
FORWARD, REVERSE = (3.71, 5.25, 6.7), (2.92, 4.1, 5.05)  # kgf

OVERRIDE, MANUAL_CONTROL = 'rc_override', 'manual_control'
NEUTRAL_PWM, HALF = 1500, 400  # microseconds
KEEP = 65535  # a channel that is left as it is
FULL, MIDDLE = 1000, 500  # of MANUAL_CONTROL; its z runs from 0 to 1000 in ArduSub
FOUR = (0, 1, 2, 5)  # surge, sway, heave, yaw: what MANUAL_CONTROL has for all versions


class PilotAxes(NamedTuple):
    """Pilot's input, each within +-1: ArduSub's names and signs, throttle up, yaw to starboard."""

    forward: float = 0.0
    lateral: float = 0.0
    throttle: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0

    def pulses(self) -> tuple[int, ...]:
        """Input channels 1 to 6: pitch, roll, throttle, yaw, forward, lateral; microseconds."""
        axes = self.pitch, self.roll, self.throttle, self.yaw, self.forward, self.lateral
        return tuple(NEUTRAL_PWM + round(HALF * axis) for axis in axes)


NEUTRAL = PilotAxes()
SIGNS = np.array([1.0, 1.0, -1.0, 1.0, 1.0, 1.0])  # of the axes against the degrees of freedom


class Group(NamedTuple):
    """Thrusters that ArduSub mixes together, and the degrees of freedom that they serve."""

    thrusters: np.ndarray  # indices, (n,)
    dofs: tuple[int, ...]  # indices, (m,)
    inverse: np.ndarray  # (n, m) thrusts of a wrench
    axes: np.ndarray  # (m, n) axes of commands, their best fit
    idle: np.ndarray | None  # (n,) thrusts without a wrench
    odd: np.ndarray | None  # (n,) commands that no axes give


class WrenchMapping:
    """Wrench to pilot's axes.

    Parameters
    ----------
    vehicle : with its thrusters, those of a BlueROV2 or BlueROV2 Heavy
    dofs : indices of the degrees of freedom that are commanded
    voltage : of the supply, V

    Raises
    ------
    InputError : thrusters that this mixing does not serve

    """

    def __init__(self, vehicle: Vehicle, dofs: tuple[int, ...], voltage: float):
        if vehicle.thrusters is None:
            raise InputError(vehicle.name, 'thrusters', 'a vehicle with thrusters', 'none')
        self._T = T = vehicle.thrusters.matrix
        reverse, forward = supply_factors(voltage)
        self._limits = vehicle.thrusters.reverse * reverse, vehicle.thrusters.forward * forward
        upright = np.abs(T[2]) > 0.5
        lost = vehicle.thrusters.unactuated()
        names = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
        self.dofs = tuple(dof for dof in dofs if names[dof] not in lost)
        self._groups = [
            _group(T, np.flatnonzero(mask), tuple(d for d in served if d in self.dofs), vehicle)
            for mask, served in ((~upright, HORIZONTAL), (upright, VERTICAL))
        ]

    def axes(self, tau: np.ndarray, reach: float = 1.0) -> tuple[PilotAxes, float]:
        """Axes for a wrench.

        Parameters
        ----------
        tau : (6,) in N and N m, FSD; what cannot be commanded is left out
        reach : largest axis that gets through, below 1 with a pilot gain

        Returns
        -------
        axes : PilotAxes
        share : of the wrench that they give, 1 where nothing saturates

        """
        commands, axes = np.zeros(self._T.shape[1]), np.zeros(6)
        wanted = np.array(tau, float)
        for group in self._groups:
            here = self._limits[0][group.thrusters], self._limits[1][group.thrusters]
            p = _commands(group, group.inverse @ wanted[list(group.dofs)], here)
            commands[group.thrusters] = p
            axes[list(group.dofs)] = group.axes @ p
            wanted -= self._T[:, group.thrusters] @ thrust_of(p, *here)  # e.g. pitch by surge
        largest = np.abs(commands).max()  # no axis is larger: each is a mean of them, but for signs
        scale = min(1.0, reach / largest) if largest else 1.0
        return PilotAxes(*(SIGNS * axes * scale).tolist()), scale**2


def _group(T: np.ndarray, thrusters: np.ndarray, dofs: tuple[int, ...], vehicle: Vehicle) -> Group:
    found = f'{len(thrusters)} thrusters for {len(dofs)} degrees of freedom'
    other = InputError(vehicle.name, 'thrusters', 'the arrangement of a BlueROV2', found)
    if not (len(thrusters) and dofs):
        raise other
    own = T[np.ix_(list(dofs), thrusters)]
    factors = np.sign(own).T  # ArduSub's, as the geometry has them
    idle, odd = _null(own), _null(factors.T)
    inverse = np.linalg.pinv(own)
    if np.allclose(inverse, inverse[0]):  # each thruster the same, of one degree of freedom
        return Group(thrusters, dofs, inverse, np.linalg.pinv(factors), None, None)
    strange = len(thrusters) - len(dofs) > 1
    if idle is not None and odd is not None:
        odd = odd if idle @ odd > 0 else -odd
        strange = strange or bool(np.any(idle * odd < -ALIKE))
    if strange:
        raise other
    return Group(thrusters, dofs, inverse, np.linalg.pinv(factors), idle, odd)


def _null(A: np.ndarray) -> np.ndarray | None:
    """(n,) with A x = 0, None where there is none or more than one."""
    _, sizes, V = np.linalg.svd(A)
    free = A.shape[1] - int(np.sum(sizes > ALIKE * sizes[0]))
    return V[-1] if free == 1 else None


def _commands(group: Group, thrust: np.ndarray, limits: tuple) -> np.ndarray:
    """Commands whose thrusts give the same wrench and that are a sum of axes."""
    if group.idle is None or group.odd is None:
        return command_of(thrust, *limits)
    # odd . p rises with the share of idle thrust: there is one zero, and it lies in between
    low, high = -(span := np.abs(thrust).max() / np.abs(group.idle).min()), span
    each = [
        *zip(*(array.tolist() for array in (thrust, group.idle, group.odd, *limits)), strict=True)
    ]
    for _ in range(BISECTIONS):  # on plain numbers: arrays of four take three times as long
        middle, total = (low + high) / 2.0, 0.0
        for own, idle, odd, reverse, forward in each:
            f = own + middle * idle
            total += odd * math.sqrt(f / forward) if f > 0 else -odd * math.sqrt(-f / reverse)
        low, high = (middle, high) if total < 0 else (low, middle)
    return command_of(thrust + middle * group.idle, *limits)


def supply_factors(voltage: float) -> tuple[float, float]:
    """Full thrust at a supply voltage over that at 16 V: reverse and forward.

    Parameters
    ----------
    voltage : at the speed controllers, V; taken as 12 to 20, beyond which nothing is published

    """
    reverse, forward = (float(np.interp(voltage, VOLTS, t) / t[1]) for t in (REVERSE, FORWARD))
    return reverse, forward


def command_of(thrust: np.ndarray, reverse: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Commands (n,), 1 for full, of thrusts (n,) in N with full thrusts (n,) each way, N."""
    return np.sign(thrust) * np.sqrt(np.abs(thrust) / np.where(thrust < 0, reverse, forward))


def thrust_of(command: np.ndarray, reverse: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Thrusts (n,) in N of commands (n,); the inverse of `command_of`."""
    return command * np.abs(command) * np.where(command < 0, reverse, forward)


def rc_override(axes: PilotAxes, system: int, component: int) -> Any:
    """RC_CHANNELS_OVERRIDE of channels 1 to 6; 4.0 takes zeros of the others as a release."""
    return mavlink.MAVLink_rc_channels_override_message(
        system, component, *axes.pulses(), *[KEEP] * 12
    )


def manual_control(axes: PilotAxes, system: int, gain: float) -> Any:
    """MANUAL_CONTROL of four axes; ArduSub multiplies what it gets by the pilot gain."""
    x, y, z, r = (
        max(-FULL, min(FULL, round(FULL * axis / gain)))
        for axis in (axes.forward, axes.lateral, axes.throttle, axes.yaw)
    )
    return mavlink.MAVLink_manual_control_message(system, x, y, MIDDLE + round(z / 2), r, 0)


def pulses_of(message: Any, gain: float, heave: float) -> tuple[int, ...]:
    """Input channels 1 to 6 that ArduSub makes of a MANUAL_CONTROL, to 2 us.

    Parameters
    ----------
    message : MANUAL_CONTROL
    gain, heave : pilot gain, and JS_THR_GAIN

    """
    side, up = HALF * gain / FULL, 2.0 * HALF * gain * heave / FULL
    middle = int(NEUTRAL_PWM - MIDDLE * up)
    others = (NEUTRAL_PWM + side * axis for axis in (message.r, message.x, message.y))
    pulses = NEUTRAL_PWM, NEUTRAL_PWM, middle + up * message.z, *others
    return tuple(int(max(NEUTRAL_PWM - HALF, min(NEUTRAL_PWM + HALF, p))) for p in pulses)
