"""From a wrench to the six axes that a pilot of ArduSub has, by the vehicle file's thrusters.

ArduSub adds the axes up in the command of each thruster, with factors of +-1, and thrust goes with
the square of the command. Both are undone here: the thrusts that give the wrench have a part that
gives none, and there is one choice of it whose commands are a sum of axes. Where that is beyond
what the axes or the thrusters reach, the whole wrench is scaled: its direction stays.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from t200 import command_of, supply_factors, thrust_of

from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.vehicle import Vehicle

BISECTIONS = 60
ALIKE = 1e-9
VERTICAL, HORIZONTAL = (2, 3, 4), (0, 1, 5)  # degrees of freedom by group of thrusters


class PilotAxes(NamedTuple):
    """Pilot's input, each within +-1: ArduSub's names and signs, throttle up, yaw to starboard."""

    forward: float = 0.0
    lateral: float = 0.0
    throttle: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0


NEUTRAL = PilotAxes()
SIGNS = np.array([1.0, 1.0, -1.0, 1.0, 1.0, 1.0])  # of the axes against the degrees of freedom


@dataclass(frozen=True, eq=False)
class Group:
    """Thrusters that ArduSub mixes together, and the degrees of freedom that they serve.

    Attributes
    ----------
    thrusters, dofs : indices
    inverse : (n, m) thrusts of a wrench
    axes : (m, n) axes of commands, their best fit
    idle, odd : (n,) thrusts without a wrench, commands that no axes give; None: there are none

    """

    thrusters: np.ndarray
    dofs: tuple[int, ...]
    inverse: np.ndarray
    axes: np.ndarray
    idle: np.ndarray | None
    odd: np.ndarray | None


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
            here = [limit[group.thrusters] for limit in self._limits]
            p = _commands(group, group.inverse @ wanted[list(group.dofs)], *here)
            commands[group.thrusters] = p
            axes[list(group.dofs)] = group.axes @ p
            wanted -= self._T[:, group.thrusters] @ thrust_of(p, *here)  # e.g. pitch by surge
        largest = max(np.abs(commands).max(), np.abs(axes).max())
        scale = min(1.0, reach / largest) if largest else 1.0
        return PilotAxes(*(SIGNS * axes * scale).tolist()), scale**2

    def wrench(self, commands: np.ndarray) -> np.ndarray:
        """Wrench (6,) that commands (n,) of the thrusters give, as this mapping takes it."""
        return self._T @ thrust_of(np.asarray(commands, float), *self._limits)


def _group(T: np.ndarray, thrusters: np.ndarray, dofs: tuple[int, ...], vehicle: Vehicle) -> Group:
    own = T[np.ix_(list(dofs), thrusters)]
    factors = np.sign(own).T  # ArduSub's, as the geometry has them
    idle, odd = _null(own), _null(factors.T)
    inverse = np.linalg.pinv(own)
    even = len(dofs) == 1 and np.allclose(inverse, inverse[0])  # each thruster the same
    if even:
        idle = odd = None
    elif len(thrusters) - len(dofs) > 1 or np.any(_product(idle, odd) < -ALIKE):
        found = f'{len(thrusters)} thrusters for {len(dofs)} degrees of freedom'
        raise InputError(vehicle.name, 'thrusters', 'the arrangement of a BlueROV2', found)
    if idle is not None and odd is not None and idle @ odd < 0:
        odd = -odd
    return Group(thrusters, dofs, inverse, np.linalg.pinv(factors), idle, odd)


def _null(A: np.ndarray) -> np.ndarray | None:
    """(n,) with A x = 0, None where there is none or more than one."""
    _, sizes, V = np.linalg.svd(A)
    free = A.shape[1] - int(np.sum(sizes > ALIKE * sizes[0]))
    return V[-1] if free == 1 else None


def _product(idle: np.ndarray | None, odd: np.ndarray | None) -> np.ndarray:
    if idle is None or odd is None:
        return np.zeros(1)
    product = idle * odd
    return product * np.sign(product.sum())


def _commands(
    group: Group, thrust: np.ndarray, reverse: np.ndarray, forward: np.ndarray
) -> np.ndarray:
    """Commands whose thrusts give the same wrench and that are a sum of axes."""
    if group.idle is None or group.odd is None:
        return command_of(thrust, reverse, forward)
    # odd . p rises with the share of idle thrust: there is one zero, and it lies in between
    low, high = -(span := 2.0 * np.abs(thrust).max() / np.abs(group.idle).min()), span
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        p = command_of(thrust + middle * group.idle, reverse, forward)
        low, high = (middle, high) if group.odd @ p < 0 else (low, middle)
    return p
