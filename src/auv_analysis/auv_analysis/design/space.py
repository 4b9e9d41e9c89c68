"""What a change does to a vehicle's M, restoring moment and damping, as functions of parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.design.bodies import (
    disc_added_mass,
    disc_drag,
    disc_mass,
    normal_of,
    point_mass,
)
from auv_analysis.design.parameters import NAMES, Parameter, bounds, parameters_of, semi_axes
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

UPPER = np.triu_indices(6)
WIDTH = len(UPPER[0]) + 3 + 6  # numbers of a `Difference` as one row
PLACES = [i for i, name in enumerate(NAMES) if name[-2:] in ('.x', '.y', '.z') and i > 2]
LEAST_RIGHTING = 0.01  # of weight times length: less static stability than that counts as this
ASIDE = 0.2  # of a part at its bound: what a place at the edge of the vehicle counts for


class Difference(NamedTuple):
    """What a change adds to a vehicle; any number of leading axes, real or complex.

    Attributes
    ----------
    M : (..., 6, 6) symmetric: kg, kg m, kg m2
    couple : (..., 3) of W r_G - B r_B, N m
    drag : (..., 6) diagonal of the quadratic damping

    """

    M: np.ndarray
    couple: np.ndarray
    drag: np.ndarray

    @property
    def row(self) -> np.ndarray:
        """The same as (..., WIDTH): upper triangle of M, couple, drag."""
        return np.concatenate([self.M[..., *UPPER], self.couple, self.drag], axis=-1)


@dataclass(frozen=True, eq=False)
class Space:
    """The changes of one vehicle.

    Attributes
    ----------
    data : contents of its file
    vehicle : as loaded from it
    parameters : with their bounds, in the order of `NAMES`

    """

    data: Mapping[str, Any]
    vehicle: Vehicle
    parameters: tuple[Parameter, ...]

    @classmethod
    def of(
        cls,
        data: Mapping[str, Any],
        file: object,
        own: Sequence[tuple[str, float, float]] = (),
    ) -> 'Space':
        """Changes of the vehicle of a file's contents; `own` are bounds, see `parameters_of`."""
        vehicle = vehicle_from_dict(dict(data), file)
        return cls(data, vehicle, parameters_of(vehicle, data, own))

    @property
    def mass(self) -> float:
        """Of the vehicle as it is, kg."""
        return float(self.data['rigid_body']['mass'])

    @property
    def density(self) -> float:
        """Of the water, kg/m3."""
        return float(self.data['environment']['water_density'])

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper, (13,) each."""
        return bounds(self.parameters)

    @property
    def unchanged(self) -> np.ndarray:
        """Values (13,) that leave the vehicle as it is."""
        return np.clip(np.zeros(len(NAMES)), *self.bounds)

    def difference(self, x: np.ndarray) -> Difference:
        """What the values of the parameters add to the vehicle.

        The ballast is trimmed: foam at its place carries its weight, so that W - B and
        W r_G - B r_B stay as they are. The disc is thin and as heavy as the water it displaces.

        Parameters
        ----------
        x : (..., 13) in the order of `NAMES`, real or complex

        """
        shift, ballast, at = x[..., 0:3], x[..., 3], x[..., 4:7]
        radius, centre, normal = x[..., 7], x[..., 8:11], normal_of(x[..., 11], x[..., 12])
        r_G = self.vehicle.r_G
        moved = point_mass(self.mass, r_G + shift) - point_mass(self.mass, r_G)
        disc = disc_added_mass(radius, centre, normal, self.density)
        return Difference(
            M=moved + point_mass(ballast, at) + disc,
            couple=self.vehicle.weight * shift,
            drag=disc_drag(radius, centre, normal, self.density),
        )

    def unrest(self, x: np.ndarray) -> np.ndarray:
        """How much worse the vehicle is at rest: (..., 13) to (...), real or complex.

        What turns it from level, squared, in proportion to what rights it, and the loss of what
        rights it, likewise; negative where it is nearer to level than before.
        """
        vehicle, change = self.vehicle, self.difference(x).couple
        before = vehicle.weight * vehicle.r_G - vehicle.buoyancy * vehicle.r_B
        rights = max(before[2], LEAST_RIGHTING * vehicle.weight * self._length)
        turns = (((before + change)[..., :2] ** 2).sum(axis=-1) - before[:2] @ before[:2]) / (
            before[:2] @ before[:2] + rights**2
        )
        lost = np.where(change[..., 2].real < 0, change[..., 2], 0.0) / rights
        return turns + lost**2

    @cached_property
    def _length(self) -> float:
        return float(semi_axes(self.vehicle, self.data)[0].mean())

    def size(self, x: np.ndarray) -> np.ndarray:
        """How large a change is: 0 none, 1 for each part that is at its bound; (..., 13) to (...).

        The centre of gravity counts by its distance from where it was, the ballast by its mass,
        the disc by its added mass; a little also how far from the middle they are placed, so that
        a coordinate that does nothing stays there.
        """
        lower, upper = self.bounds
        reach = np.maximum(-lower, upper)
        reach = np.where(reach > 0, reach, np.inf)  # what is held does not count
        way = (x[..., 0:3] / reach[0:3]) ** 2
        ballast = x[..., 3] / reach[3]
        disc = disc_mass(x[..., 7], 1.0) / disc_mass(reach[7], 1.0)
        aside = ((x - (lower + upper) / 2) / reach)[..., PLACES] ** 2
        return way.mean(axis=-1) + ballast + disc + ASIDE * aside.mean(axis=-1)
