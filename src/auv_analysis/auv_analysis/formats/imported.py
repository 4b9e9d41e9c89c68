"""An imported vehicle: its numbers, the source of each, and the decisions that were taken."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.frames import swap_body_matrix, swap_inertia

SNAME, POSITIVE = 'sname', 'positive'


@dataclass(frozen=True)
class Choices:
    """Facts that a user adds to a file; None: nothing.

    Attributes
    ----------
    sign : 'sname' (damping, lift, added mass are negative derivatives) or 'positive'
    products : 'integral' (Ixy is the integral of x y dm) or 'tensor' (the tensor's entry)
    inertia_reference : 'cg' or 'co'
    lift : 'alone' (of body and fins) or 'combined' (with the terms of the added mass)
    quadratic_abs : xUU is meant as xUabsU
    swap_weight_buoyancy : W and B stand for each other
    leave_out : what a vehicle file cannot hold is left out and reported, not refused
    water_density, gravity, volume : kg/m3, m/s2, m3
    center_of_buoyancy : (3,) FSD, m
    mass, center_of_gravity, inertia : of a mesh's vehicle: kg, (3,) FSD, m, three moments and
        perhaps the three products, kg m2
    units, axes : of a mesh, such as 'mm', 'flu'
    origin : (3,) of the body frame, in the axes and units of a mesh
    tolerance, panels : where the refinement of a mesh ends: relative error, number of panels

    """

    sign: str | None = None
    products: str | None = None
    inertia_reference: str | None = None
    lift: str | None = None
    quadratic_abs: bool = False
    swap_weight_buoyancy: bool = False
    leave_out: bool = False
    water_density: float | None = None
    gravity: float | None = None
    volume: float | None = None
    center_of_buoyancy: Sequence[float] | None = None
    mass: float | None = None
    center_of_gravity: Sequence[float] | None = None
    inertia: Sequence[float] | None = None
    units: str | None = None
    axes: str | None = None
    origin: Sequence[float] | None = None
    tolerance: float | None = None
    panels: int | None = None


@dataclass
class ImportedVehicle:
    """Numbers gathered by an importer.

    Attributes
    ----------
    file : it is read from, for errors
    choices : of the user
    name : of the vehicle
    values : key of a vehicle file, such as 'rigid_body.mass', to its value in FSD, positive
    comments : the same keys to where the value is from
    traps, assumed, left_out : sentences of the report

    """

    file: object
    choices: Choices
    name: str = ''
    values: dict[str, Any] = field(default_factory=dict)
    comments: dict[str, str] = field(default_factory=dict)
    traps: list[str] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    @property
    def report(self) -> dict[str, list[str]]:
        """The sentences of the report under their titles."""
        return {'handled': self.traps, 'assumed': self.assumed, 'left out': self.left_out}

    def put(self, key: str, value: Any, comment: str) -> None:
        """Set a value, with the text of its comment; a zero has no sign."""
        self.values[key] = np.asarray(value, float) + 0.0 if np.ndim(value) else value
        self.comments[key] = comment

    def refuse(self, key: str, expected: str, found: object) -> InputError:
        """Error that names this file."""
        return InputError(self.file, key, expected, found)

    def cannot_hold(self, key: str, why: str) -> None:
        """Leave a coefficient out where that was asked for; else InputError."""
        if not self.choices.leave_out:
            expected = 'what a vehicle file can hold, or --leave-out'
            raise self.refuse(key, expected, why)
        self.left_out.append(f'{key}: {why}')

    def above_zero(self, key: str, value: float) -> float:
        """The number itself, which others are divided by; InputError where it is not positive."""
        if not 0 < value < float('inf'):
            raise self.refuse(key, 'a positive number', value)
        return value

    def positive(self, key: str, A: np.ndarray, convention: str, name: str) -> np.ndarray:
        """(6, 6) matrix of positive sign of coefficients that follow a sign convention.

        The user's choice of sign takes the place of the format's; a diagonal entry that then acts
        the wrong way is refused, as signs are then not what they were taken for. Lift may feed
        its own motion where damping, put before, has shown what the sign is; some of the quadratic
        damping where the user has said what it is.
        """
        used = self.choices.sign or convention
        turned = -A if used == SNAME else A.copy()
        wrong = np.flatnonzero(np.diagonal(turned) < 0)
        damping = [np.diagonal(A) for name, A in self.values.items() if name.startswith('damping.')]
        some = key == 'damping.quadratic' and bool(np.any(np.diagonal(turned) > 0))
        told = some and self.choices.sign is not None
        if len(wrong) and not told and not (key == 'lift' and np.any(damping)):
            i = int(wrong[0])
            other = POSITIVE if used == SNAME else SNAME
            sign = 'negative, as derivatives are' if used == SNAME else 'positive'
            feeds = f', or --sign {used} if this one feeds its motion' * some
            raise self.refuse(
                key,
                f'{sign}, or --sign {other} if all are of the other sign{feeds}',
                f'{A[i, i]:g} in {name}',
            )
        if not np.any(A):
            self.assumed.append(f'{key}: zero, as there is none in the file')
        elif used == SNAME:
            self.traps.append(f'{key}: SNAME derivatives, sign turned: positive matrices here')
        return turned

    def lift_by_abs_u(self, names: Sequence[str]) -> None:
        """Say that products with u become products with abs(u)."""
        if names:
            self.traps.append(
                f'{", ".join(names)}: u nu_j there, abs(u) nu_j here, which is the same ahead'
            )

    def from_flu(self, key: str, A: np.ndarray) -> np.ndarray:
        """The matrix in FSD of one in FLU, (6, 6) or the tensor (3, 3)."""
        turned = swap_inertia(A) if A.shape == (3, 3) else swap_body_matrix(A)
        changed = int(np.count_nonzero(turned != A))
        if changed:
            self.traps.append(f'{key}: from forward-left-up to FSD, {changed} entries turn sign')
        return turned

    def point_from_flu(self, key: str, point: np.ndarray, comment: str) -> None:
        """Put a point that is given in FLU."""
        if np.any(point[1:]):
            self.traps.append(f'{key}: from forward-left-up to FSD, y and z turn sign')
        self.put(key, point * [1.0, -1.0, -1.0], comment)

    def environment(self, density: tuple[float, str] | None, gravity: tuple[float, str]) -> None:
        """Put density and gravity: the user's, else the file's; gravity else an assumed one.

        Each is a value with its comment; density None: not given.
        """
        if self.choices.water_density is not None:
            density = self.choices.water_density, 'given by --water-density'
        if density is None:
            expected = '--water-density (kg/m3): the file does not say it'
            raise self.refuse('environment.water_density', expected, None)
        if self.choices.gravity is not None:
            gravity = self.choices.gravity, 'given by --gravity'
        elif gravity[1].startswith('assumed'):
            self.assumed.append(
                f'environment.gravity: {gravity[0]:g} m/s2{gravity[1].removeprefix("assumed")}'
            )
        for key, (value, said) in (('water_density', density), ('gravity', gravity)):
            self.put(f'environment.{key}', self.above_zero(f'environment.{key}', value), said)

    def buoyancy(self, volume: tuple[float, str] | None, point: tuple[Any, str] | None) -> None:
        """Put volume and, in FLU, its centre: the user's (FSD), else the file's."""
        if self.choices.volume is not None:
            volume = self.choices.volume, 'given by --volume'
        if volume is None:
            expected = '--volume (m3): the file does not say it'
            raise self.refuse('hydrostatics.volume', expected, None)
        self.put('hydrostatics.volume', *volume)
        key = 'hydrostatics.center_of_buoyancy'
        if self.choices.center_of_buoyancy is not None:
            self.put(key, self.choices.center_of_buoyancy, 'given by --center-of-buoyancy')
        elif point is None:
            expected = '--center-of-buoyancy X Y Z (m, FSD): the file does not say it'
            raise self.refuse(key, expected, None)
        else:
            self.point_from_flu(key, np.asarray(point[0], float), point[1])
