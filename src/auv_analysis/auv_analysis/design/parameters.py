"""The numbers that describe a change of a vehicle, and the bounds that they are kept within."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.design.bodies import DISC
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.vehicle.vehicle import Vehicle

SHIFT, BALLAST, DISC_PART = 'shift', 'ballast', 'disc'
PARTS = (SHIFT, BALLAST, DISC_PART)
ALL = 'all'
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
        inertia = _about_gravity(body['mass'], vehicle.r_G, inertia)
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


def _about_gravity(mass: float, r_G: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    return inertia - mass * (r_G @ r_G * np.eye(3) - np.outer(r_G, r_G))


def _stable(vehicle: Vehicle, found: tuple[Any, ...]) -> tuple[Any, ...]:
    """Bounds of `shift.z`: as much static stability as must be left is left."""
    unit, lower, upper, reason = found
    stability = vehicle.weight * vehicle.r_G[2] - vehicle.buoyancy * vehicle.r_B[2]
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


def rounded(x: np.ndarray, parameters: Sequence[Parameter]) -> np.ndarray:
    """Values to a thousandth of their range, or finer, as a workshop reads them; within bounds."""
    lower, upper = bounds(parameters)
    step = 10.0 ** np.floor(np.log10(np.maximum(upper - lower, 1e-12) / STEPS))
    decimals = (-np.log10(step)).round().astype(int)
    values = [round(float(v), int(d)) for v, d in zip(x, decimals, strict=True)]
    return np.clip(values, lower, upper)


def bounds(parameters: Sequence[Parameter]) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bounds, (13,) each."""
    return np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])
