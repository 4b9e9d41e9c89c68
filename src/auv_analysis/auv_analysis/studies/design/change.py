"""Changes of a vehicle: their parameters and bounds, and what they do to M, restoring forces, D."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.vehicle.vehicle import Vehicle, rigid_body_matrix
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

SHIFT, BALLAST, DISC_PART = 'shift', 'ballast', 'disc'
PARTS = (SHIFT, BALLAST, DISC_PART)
ALL = 'all'
PART_WORDS = {  # of the heads of tables
    SHIFT: 'centre of gravity', BALLAST: 'trimmed ballast', DISC_PART: 'disc', ALL: 'all together',
}  # fmt: skip
NAMES = (
    'shift.x', 'shift.y', 'shift.z',
    'ballast.mass', 'ballast.x', 'ballast.y', 'ballast.z',
    'disc.radius', 'disc.x', 'disc.y', 'disc.z', 'disc.azimuth', 'disc.elevation',
)  # fmt: skip
SWITCHES = ('ballast.mass', 'disc.radius')  # zero: the part is not there
SHIFTED = 0.1  # of the semi-axes: how far the centre of gravity may go
BALLASTED = 0.05  # of the mass: the largest ballast
DISC_SHARE = 0.1  # of the mean of M11, M22, M33: the largest added mass of the disc
KEPT = 0.5  # of the static stability: what must be left of it
THINNEST = 0.05  # of the largest semi-axis: the smallest
STEPS = 1000.0  # of a range, at least, to which a proposal is rounded
DISC = 8 / 3  # added mass of a thin disc that moves broadside, in rho a^3: Lamb 1932
DISC_TURNED = 16 / 45  # its added moment of inertia about a diameter, in rho a^5: Lamb 1932
DISC_DRAG = 1.17  # drag coefficient of a disc broadside, of its area: Hoerner 1965
UPPER = np.triu_indices(6)
WIDTH = len(UPPER[0]) + 3 + 6  # numbers of a `ChangeEffect` as one row
PLACES = [i for i, name in enumerate(NAMES) if name[-2:] in ('.x', '.y', '.z') and i > 2]
LEAST_RIGHTING = 0.01  # of weight times length: less static stability than that counts as this
ASIDE = 0.2  # of a part at its bound: what a place at the edge of the vehicle counts for


@dataclass(frozen=True)
class Parameter:
    """One number of a change.

    Attributes
    ----------
    name : of `NAMES`
    unit : m, kg or deg
    lower, upper : bounds
    reason : of the bounds

    """

    name: str
    unit: str
    lower: float
    upper: float
    reason: str

    @property
    def part(self) -> str:
        """Of `PARTS`."""
        return self.name.split('.', maxsplit=1)[0]


def indices_of(part: str) -> list[int]:
    """Places in `NAMES` of what a part, or all of them, is described by."""
    return [i for i, name in enumerate(NAMES) if part in (ALL, name.split('.')[0])]


def semi_axes(vehicle: Vehicle, data: Mapping[str, Any]) -> tuple[np.ndarray, str]:
    """Half lengths (3,) in m of a body of the vehicle's size, and what body that is.

    The homogeneous ellipsoid of the same mass and moments of inertia; the sphere of the same
    volume where the file gives M itself and no rigid body apart from the water around it.
    """
    body = data['rigid_body']
    if 'inertia' not in body:
        radius = float(np.cbrt(0.75 / np.pi * data['hydrostatics']['volume']))
        return np.full(3, radius), 'radius of the sphere of the displaced volume'
    inertia = np.array(body['inertia'], float)
    if body['inertia_reference'] == 'co':
        inertia = inertia - spread(body['mass'], vehicle.r_G)
    moments = np.diag(inertia)
    squares = 2.5 * (moments.sum() - 2 * moments) / body['mass']
    least = THINNEST**2 * squares.max()
    return np.sqrt(np.maximum(squares, least)), 'semi-axis of the ellipsoid of the same inertia'


def parameters_of(
    vehicle: Vehicle, data: Mapping[str, Any], own: Sequence[tuple[str, float, float]] = ()
) -> tuple[Parameter, ...]:
    """Parameters of the changes of a vehicle, in the order of `NAMES`.

    Parameters
    ----------
    vehicle : as loaded
    data : contents of its file
    own : name, lower and upper bound in place of the usual ones

    Raises
    ------
    InputError : no such parameter, or bounds that leave no room for the vehicle as it is

    """
    axes, which = semi_axes(vehicle, data)
    mass, density = float(data['rigid_body']['mass']), data['environment']['water_density']
    moved = np.trace(vehicle.M[:3, :3]) / 3
    radius = min(float(np.cbrt(DISC_SHARE * moved / (DISC * density))), float(axes.mean()))
    found = {}
    for i, axis in enumerate('xyz'):
        reach = SHIFTED * axes[i]
        place = (float(vehicle.r_B[i] - axes[i]), float(vehicle.r_B[i] + axes[i]))
        found[f'shift.{axis}'] = ('m', -reach, reach, f'{SHIFTED:g} of the {which}')
        for part in (BALLAST, DISC_PART):
            found[f'{part}.{axis}'] = ('m', *place, f'centre of buoyancy ± the {which}')
    found['shift.z'] = _stable(vehicle, found['shift.z'])
    found['ballast.mass'] = ('kg', 0.0, BALLASTED * mass, f'{BALLASTED:g} of the mass')
    text = f'added mass of {DISC_SHARE:g} of the mean of M11, M22, M33; at most the mean semi-axis'
    found['disc.radius'] = ('m', 0.0, radius, text)
    for angle in ('azimuth', 'elevation'):
        found[f'disc.{angle}'] = ('deg', -90.0, 90.0, 'every direction')
    every = {}
    for name in NAMES:
        unit, lower, upper, reason = found[name]
        every[name] = Parameter(name, unit, _short(lower), _short(upper), reason)
    for name, lower, upper in own:
        every[name] = _own(every, name, lower, upper)
    return tuple(every.values())


def _short(bound: float) -> float:
    """Towards zero to four digits: a bound that a reader can write down."""
    if bound == 0.0:
        return 0.0
    decimals = 3 - int(np.floor(np.log10(abs(bound))))
    return float(round(np.trunc(bound * 10.0**decimals) / 10.0**decimals, decimals))


def spread(mass: float, r: np.ndarray) -> np.ndarray:
    """Moment of inertia (3, 3) in kg m2 of a point mass about the origin of r (3,), in m."""
    return mass * (r @ r * np.eye(3) - np.outer(r, r))


def _stable(vehicle: Vehicle, found: tuple[Any, ...]) -> tuple[Any, ...]:
    """Bounds of `shift.z`: as much static stability as must be left is left."""
    unit, lower, upper, reason = found
    stability = vehicle.model.hydrostatics[3]
    room = -(1 - KEPT) * stability / vehicle.weight if stability > 0 else 0.0
    if room <= lower:
        return found
    kept = f'{KEPT:g} of the static stability is left' if stability > 0 else 'no less stable'
    return unit, float(room), upper, f'{reason}; upwards: {kept}'


def _own(every: Mapping[str, Parameter], name: str, lower: float, upper: float) -> Parameter:
    if name not in every:
        raise InputError('--bound', '', one_of(name, NAMES), name)
    if not -1e6 <= lower <= upper <= 1e6:
        expected = 'LOWER:UPPER, two numbers in ascending order, at most 1e6'
        raise InputError('--bound', name, expected, f'{lower:g}:{upper:g}')
    switch = name in SWITCHES
    if (switch and lower != 0) or (name.startswith(SHIFT) and not lower <= 0 <= upper):
        expected = '0:UPPER' if switch else 'bounds with 0 between them, the vehicle as it is'
        raise InputError('--bound', name, expected, f'{lower:g}:{upper:g}')
    return replace(every[name], lower=lower, upper=upper, reason='as asked for')


def point_mass(mass: float | np.ndarray, r: np.ndarray) -> np.ndarray:
    """M_RB of point masses (...,) in kg, or of one, at r (..., 3) in m: (..., 6, 6)."""
    return rigid_body_matrix(np.broadcast_to(mass, r.shape[:-1]), r, np.zeros((3, 3)), 'cg')


def normal_of(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3): azimuth from surge to sway, elevation from there to heave, deg."""
    turned, raised = azimuth * np.pi / 180, elevation * np.pi / 180
    flat = np.cos(raised)
    parts = (flat * np.cos(turned), flat * np.sin(turned), np.sin(raised))
    return np.stack(parts, axis=-1)


def disc_mass(radius: np.ndarray, density: float) -> np.ndarray:
    """Added mass in kg of thin discs that move broadside: radius (...,) in m."""
    return DISC * density * radius**3


def _disc_way(r: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """H (..., 6) with h nu the velocity of the point r along a normal, (..., 3) each."""
    return np.concatenate([normal, np.cross(r, normal)], axis=-1)


def disc_added_mass(
    radius: np.ndarray, r: np.ndarray, normal: np.ndarray, density: float
) -> np.ndarray:
    """M_A of thin discs in unbounded water, positive semidefinite.

    Parameters
    ----------
    radius : (...,) m
    r, normal : (..., 3) centre in m and unit normal, body frame
    density : of the water, kg/m3

    Returns
    -------
    M_A : (..., 6, 6) m_a h h^T, h = [n; r x n], and the moment about the disc's own diameters

    """
    way = _disc_way(r, normal)
    M_A = disc_mass(radius, density)[..., None, None] * way[..., :, None] * way[..., None, :]
    turned = np.eye(3) - normal[..., :, None] * normal[..., None, :]
    own = DISC_TURNED * density * radius**5
    M_A[..., 3:, 3:] += own[..., None, None] * turned
    return M_A


def disc_drag(radius: np.ndarray, r: np.ndarray, normal: np.ndarray, density: float) -> np.ndarray:
    """Contribution of thin discs to the diagonal of the quadratic damping, (..., 6).

    Exact for a motion in one degree of freedom alone. The products of two velocities, which the
    format of a vehicle file has no place for, are left out; it dissipates for every motion.

    Parameters are those of `disc_added_mass`.
    """
    way = _disc_way(r, normal)
    return (0.5 * density * DISC_DRAG * np.pi * radius**2)[..., None] * np.abs(way) ** 3


class ChangeEffect(NamedTuple):
    """Additions of a change to a vehicle; any number of leading axes.

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
class ChangeSpace:
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
    ) -> 'ChangeSpace':
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
        pairs = np.array([(one.lower, one.upper) for one in self.parameters])
        return pairs[:, 0], pairs[:, 1]

    @property
    def unchanged(self) -> np.ndarray:
        """Values (13,) that leave the vehicle as it is."""
        return np.clip(np.zeros(len(NAMES)), *self.bounds)

    def effect(self, x: np.ndarray) -> ChangeEffect:
        """Additions to the vehicle by values of the parameters.

        The ballast is trimmed: foam at its place carries its weight, so that W - B and
        W r_G - B r_B stay as they are. The disc is thin and as heavy as the water it displaces.

        Parameters
        ----------
        x : (..., 13) in the order of `NAMES`

        """
        shift, ballast, at = x[..., 0:3], x[..., 3], x[..., 4:7]
        radius, centre, normal = x[..., 7], x[..., 8:11], normal_of(x[..., 11], x[..., 12])
        r_G = self.vehicle.r_G
        moved = point_mass(self.mass, r_G + shift) - point_mass(self.mass, r_G)
        disc = disc_added_mass(radius, centre, normal, self.density)
        return ChangeEffect(
            M=moved + point_mass(ballast, at) + disc,
            couple=self.vehicle.weight * shift,
            drag=disc_drag(radius, centre, normal, self.density),
        )

    def hydrostatic_penalty(self, x: np.ndarray) -> np.ndarray:
        """Penalty on the vehicle at rest: (..., 13) to (...).

        What turns it from level, squared, in proportion to what rights it, and the loss of what
        rights it, likewise; negative where it is nearer to level than before.
        """
        vehicle, change = self.vehicle, self.vehicle.weight * x[..., 0:3]
        length = float(semi_axes(vehicle, self.data)[0].mean())
        before = vehicle.model.hydrostatics[1:]
        rights = max(before[2], LEAST_RIGHTING * vehicle.weight * length)
        turns = (((before + change)[..., :2] ** 2).sum(axis=-1) - before[:2] @ before[:2]) / (
            before[:2] @ before[:2] + rights**2
        )
        lost = np.minimum(change[..., 2], 0.0) / rights
        return turns + lost**2

    def size(self, x: np.ndarray) -> np.ndarray:
        """Size of a change: 0 none, 1 for each part that is at its bound; (..., 13) to (...).

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


def rounded(x: np.ndarray, space: ChangeSpace) -> np.ndarray:
    """Values (13,) to a thousandth of their range, or finer, as a workshop reads them."""
    lower, upper = space.bounds
    step = 10.0 ** np.floor(np.log10(np.maximum(upper - lower, 1e-12) / STEPS))
    decimals = (-np.log10(step)).round().astype(int)
    values = [round(float(v), int(d)) for v, d in zip(x, decimals, strict=True)]
    return np.clip(values, lower, upper)


def parts_of(x: np.ndarray) -> list[str]:
    """Parts of a vehicle that a change (13,) changes; a ballast has a mass, a disc a radius."""
    there = {SHIFT: x[0:3].any(), BALLAST: x[3] > 0, DISC_PART: x[7] > 0}
    return [part for part in PARTS if there[part]]


def values_of(x: np.ndarray) -> dict[str, float]:
    """Parameters of the parts that a change (13,) changes, by name."""
    parts = parts_of(x)
    return {n: float(v) for n, v in zip(NAMES, x, strict=True) if n.split('.')[0] in parts}
