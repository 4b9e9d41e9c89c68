"""Thrusters of a vehicle: T of tau = T u, its inverse, and the attainable wrench set.

The numbers of a vehicle file become T, (6, n), whose column i is the wrench of one newton of
thruster i: (e_i, r_i x e_i), Fossen 2021, section 11.2.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError, shorten
from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, select
from auv_dynamics.kernel.six import (
    Numbers,
    Six,
    Vector,
    add,
    clipped,
    dot,
    scale,
    sub,
)
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.thruster_curves import ThrusterCurve, curve_of

LEFT = 0.01  # of a thruster's limit, by priority: small parts of the rest find room
FULLER = (1.0 / (1.0 - LEFT),) * 6
DEPENDENT = 1e-9  # a singular value or a row below this, relative to the largest, counts as zero
UNIT = 0.01  # deviation of the norm of a direction from 1 that is worth a warning
SCALED, PRIORITY = SATURATIONS = ('scaled', 'priority')
FIRST = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0])  # heave and attitude before surge and sway
BEYOND = 0.02  # of the thrust at the end of a curve: how far a limit may be beyond it


@dataclass(frozen=True)
class Rotor:
    """Drive of a thruster, steady and in time; by default it delivers each thrust at once.

    Attributes
    ----------
    curve : steady thrust of its commands at the nominal voltage; None: the square law
    voltage : nominal, V; None: unknown
    dead_band : thrusts in N, reverse and forward, below which it does not turn
    lag : s, time constant of the rotor's speed; 0: none
    omega, zeta : rad/s and damping ratio of a second-order response of it; omega = 0: none
    lag_at : thrust in N at which lag is the time constant, which goes by 1/sqrt(thrust); 0: always

    """

    curve: ThrusterCurve | None = None
    voltage: float | None = None
    dead_band: tuple[float, float] = (0.0, 0.0)
    lag: float = 0.0
    omega: float = 0.0
    zeta: float = 1.0
    lag_at: float = 0.0


@dataclass(frozen=True, eq=False)
class Thrusters:
    """Geometry and limits of n thrusters, body frame forward-starboard-down, SI units.

    Attributes
    ----------
    names : n words
    matrix : (6, n) T of tau = T u, u in N; N and N m per N
    reverse, forward : (n,) largest thrusts against and along each direction, N, both positive
    rotors : what turns each of them; none: all deliver each thrust at once
    inverse : (n, 6) T^+, the pseudo-inverse of T: least squares, and of these the smallest u

    """

    names: tuple[str, ...]
    matrix: np.ndarray
    reverse: np.ndarray
    forward: np.ndarray
    rotors: tuple[Rotor, ...] = ()
    inverse: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Invert T; what rounding alone makes non-zero stays out of the inverse."""
        object.__setattr__(self, 'inverse', np.linalg.pinv(self.matrix, rcond=DEPENDENT))

    @property
    def rank(self) -> int:
        """Number of independent wrenches, at most 6."""
        largest = np.linalg.norm(self.matrix, 2)
        return int(np.linalg.matrix_rank(self.matrix, tol=DEPENDENT * largest))

    def allocate(self, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Thrusts for a wrench, and the wrench that they deliver.

        u = T^+ tau; where one of them is beyond its limit, all are scaled down by the one
        factor that brings each within its limits, so that the direction of T u stays.

        Parameters
        ----------
        tau : (6,) wrench asked for, N and N m

        Returns
        -------
        u : (n,) thrusts, N, positive along each thruster's direction
        delivered : (6,) T u, N and N m; tau itself where T has rank 6 and no limit is reached

        """
        u = self.inverse @ np.asarray(tau, float)
        most = np.max(np.abs(u) / np.where(u < 0, self.reverse, self.forward))
        u = u / max(1.0, most)
        return u, self.matrix @ u

    def largest(self) -> np.ndarray:
        """(6,) largest wrench along each axis, N and N m, whichever way it is larger."""
        return self.both_ways().max(axis=0)

    def both_ways(self) -> np.ndarray:
        """(2, 6) largest wrench along each axis, N and N m: astern, ahead."""
        ahead = np.where(self.matrix > 0, self.matrix * self.forward, -self.matrix * self.reverse)
        astern = np.where(self.matrix > 0, self.matrix * self.reverse, -self.matrix * self.forward)
        return np.array([astern.sum(axis=1), ahead.sum(axis=1)])

    def alone(self) -> np.ndarray:
        """(2, 6) largest wrench of each axis without the others, N and N m: astern, ahead."""
        far = 1.0 / np.finfo(float).eps  # N, N m: beyond any limit
        both = [[self.allocate(way * axis)[1] @ axis for axis in np.eye(6)] for way in (-far, far)]
        return np.abs(both)

    def unactuated(self) -> dict[str, tuple[str, ...]]:
        """Degrees of freedom without a wrench of their own, and what each comes along with.

        Rows of T are taken in the order surge to yaw. One that depends on those before it is
        a degree of freedom that cannot be commanded; its value is a sum of the ones named,
        none where no thruster acts on it at all.
        """
        size = np.linalg.norm(self.matrix)
        independent: list[int] = []
        lost: dict[str, tuple[str, ...]] = {}
        for i, row in enumerate(self.matrix):
            basis = self.matrix[independent].T
            weights = np.linalg.lstsq(basis, row, rcond=None)[0]
            if np.linalg.norm(row - basis @ weights) > DEPENDENT * size:
                independent.append(i)
            else:
                pairs = zip(independent, weights, strict=True)
                lost[DOFS[i]] = tuple(DOFS[j] for j, weight in pairs if abs(weight) > DEPENDENT)
        return lost


def thrusters_of(
    entries: Sequence[Mapping[str, Any]], file: object
) -> tuple[Thrusters, list[tuple[str, str]]]:
    """Thrusters of the `thrusters` of a checked vehicle file.

    Parameters
    ----------
    entries : mappings with name, position (3,) in m, direction (3,) and limit: a number, or
        reverse and forward, in N; and what is known of its rotor
    file : named in errors

    Returns
    -------
    thrusters : Thrusters, directions normalised
    warnings : key and text of what is odd but usable

    Raises
    ------
    InputError : a name that stands twice, a direction of length zero, a rotor that cannot be

    """
    warnings: list[tuple[str, str]] = []
    names = [entry['name'] for entry in entries]
    columns = []
    for i, entry in enumerate(entries):
        key = f'thrusters[{i}]'
        if names.index(entry['name']) < i:
            raise InputError(file, f'{key}.name', 'each name once', f'{entry["name"]} again')
        r, e = np.array(entry['position'], float), np.array(entry['direction'], float)
        length = float(np.linalg.norm(e))
        if length == 0.0:
            raise InputError(file, f'{key}.direction', 'a direction that is not zero', e.tolist())
        if abs(length - 1.0) > UNIT:
            warnings.append((f'{key}.direction', f'its length is {length:.4g}: normalised'))
        columns.append(np.concatenate([e / length, np.cross(r, e / length)]))
    limits = np.array([np.broadcast_to(entry['limit'], 2) for entry in entries], float)
    rotors: tuple[Rotor, ...] = ()
    if any('rotor' in entry for entry in entries):
        rotors = tuple(_rotor(entry, f'thrusters[{i}]', file) for i, entry in enumerate(entries))
    thrusters = Thrusters(tuple(names), np.array(columns).T, limits[:, 0], limits[:, 1], rotors)
    lost = thrusters.unactuated()
    if lost:
        axes = '; '.join(_without(dof, others) for dof, others in lost.items())
        warnings.append(('thrusters', f'T has rank {thrusters.rank} of 6: {axes}'))
    return thrusters, warnings


def _rotor(entry: Mapping[str, Any], place: str, file: object) -> Rotor:
    """Rotor of an entry, against which the limits and each other its numbers are checked."""
    spec, key = entry.get('rotor', {}), f'{place}.rotor'
    curve = curve_of(spec['curve'], file, f'{key}.curve') if 'curve' in spec else None
    voltage = spec.get('voltage')
    if curve is not None and curve.voltage is not None:
        if voltage not in (None, curve.voltage):
            expected = f'that of {curve.name}, {curve.voltage:g} V'
            raise InputError(file, f'{key}.voltage', expected, f'{voltage:g} V')
        voltage = curve.voltage
    reverse, forward = (float(limit) for limit in np.broadcast_to(entry['limit'], 2))
    if curve is not None:
        for limit, end in ((reverse, -curve.thrusts[0]), (forward, curve.thrusts[-1])):
            if limit > (1 + BEYOND) * end:
                expected = f'at most what the curve of its rotor gives, {end:.4g} N'
                raise InputError(file, f'{place}.limit', expected, f'{limit:g} N')
    band = tuple(float(least) for least in np.broadcast_to(spec.get('dead_band', 0.0), 2))
    if band[0] >= reverse or band[1] >= forward:
        expected = f'less than the limits, {reverse:g} and {forward:g} N'
        raise InputError(file, f'{key}.dead_band', expected, shorten(spec['dead_band']))
    if 'lag' in spec and 'omega' in spec:
        raise InputError(file, f'{key}.omega', 'one of lag and omega', 'both of them')
    if 'zeta' in spec and 'omega' not in spec:
        raise InputError(file, f'{key}.zeta', 'omega beside it', None)
    if 'lag_at' in spec and not spec.get('lag'):
        raise InputError(file, f'{key}.lag_at', 'a positive lag beside it', spec.get('lag'))
    times = ('lag', 'lag_at', 'omega', 'zeta')
    numbers = {name: float(spec[name]) for name in times if name in spec}
    return Rotor(curve, voltage, (band[0], band[1]), **numbers)


def _without(dof: str, others: tuple[str, ...]) -> str:
    if not others:
        return f'{dof} cannot be actuated'
    return f'{dof} cannot be actuated apart from {" and ".join(others)}'


class AttainableWrench(NamedTuple):
    """Attainable wrench set: what a law may know of its actuators.

    Attributes
    ----------
    bounded : whether there is any bound
    limit : (6,) largest absolute wrench per axis, N and N m; inf where there is none
    T_inv, T : (n, 6) pseudo-inverse and (6, n) configuration of the thrusters, n = 0 for none
    reverse, forward : (n,) largest thrust each way, N
    own : (6,) 1 for a degree of freedom that the thrusters give a wrench of its own, else 0
    first : (6,) 1 for a degree of freedom that is served before those of 0; None: all are scaled
        down together

    """

    bounded: bool
    limit: np.ndarray
    T_inv: np.ndarray
    T: np.ndarray
    reverse: np.ndarray
    forward: np.ndarray
    own: np.ndarray
    first: np.ndarray | None = None


def make_reach(
    limit: Any, thrusters: Thrusters | None, saturation: str = SCALED
) -> AttainableWrench:
    """Attainable wrench of axis limits and of thrusters.

    Parameters
    ----------
    limit : 1 or 6 numbers, N and N m; None: none
    thrusters : None: the wrench is not allocated
    saturation : of `SATURATIONS`, what happens to thrusts beyond their limits

    """
    bounds = np.full(6, np.inf) if limit is None else six_numbers(limit)
    if thrusters is None:
        no, every = np.zeros(0), np.ones(6)
        return AttainableWrench(
            limit is not None, bounds, np.zeros((0, 6)), np.zeros((6, 0)), no, no, every
        )
    return AttainableWrench(
        True,
        bounds,
        np.ascontiguousarray(thrusters.inverse),
        np.ascontiguousarray(thrusters.matrix),
        thrusters.reverse.astype(float),
        thrusters.forward.astype(float),
        np.array([float(dof not in thrusters.unactuated()) for dof in DOFS]),
        FIRST.copy() if saturation == PRIORITY else None,
    )


def six_numbers(value: Any) -> np.ndarray:
    """(6,) of one number for all axes, or six."""
    return np.broadcast_to(np.asarray(value, float), 6).copy()


@helper
def thrust(reach: AttainableWrench, i: int, tau: Vector) -> Number:
    """u_i of u = T^+ tau in N, without limits."""
    return dot(reach.T_inv[i], 0, tau)


@helper
def share_within(reach: AttainableWrench, tau: Vector) -> Number:
    """Largest share of the thrusts T^+ tau, at most 1, that is within every thruster's limits."""
    share = 1.0
    for i in range(reach.T.shape[1]):
        u = thrust(reach, i, tau)
        most = select(u > 0.0, reach.forward[i], reach.reverse[i])
        over = abs(u) * share > most
        share = select(over, most / select(over, abs(u), 1.0), share)
    return share


@helper
def share_beside(reach: AttainableWrench, kept: Vector, tau: Vector) -> Number:
    """Largest share of the thrusts T^+ tau, at most 1, for which there is room beside T^+ kept."""
    share = 1.0
    for i in range(reach.T.shape[1]):
        there, u = thrust(reach, i, kept), thrust(reach, i, tau)
        room = select(u > 0.0, reach.forward[i] - there, reach.reverse[i] + there)
        room = select(room > 0.0, room, 0.0)
        over = abs(u) * share > room
        share = select(over, room / select(over, abs(u), 1.0), share)
    return share


@helper
def shaped(first: np.ndarray | None, reach: AttainableWrench, tau: Numbers) -> tuple[Any, Number]:
    """Wrench, and the share of its thrusts, that brings every thrust within its limits.

    Without priority it is tau and one share. With it, what comes first is scaled down by itself, to
    all but `LEFT` of each limit, then the rest to the room that is left. `first` is that of reach:
    without priority the branch is none when compiled.
    """
    if first is None:
        return tau, share_within(reach, tau)
    kept = scale(first, tau)
    rest = sub(tau, kept)
    share = share_within(reach, scale(FULLER, kept))
    kept = scale((share, share, share, share, share, share), kept)
    left = share_beside(reach, kept, rest)
    return add(kept, scale((left, left, left, left, left, left), rest)), 1.0


@helper
def column(reach: AttainableWrench, i: int, u: Number) -> Six:
    """Wrench of the thrust u in N of thruster i."""
    T = reach.T
    return (T[0, i] * u, T[1, i] * u, T[2, i] * u, T[3, i] * u, T[4, i] * u, T[5, i] * u)


@helper
def left_of(left: np.ndarray | None, i: int, n: int, u: Number) -> Number:
    """Delivered part of the thrust u of thruster i of n; `left` as of `delivered`.

    The branch is none when compiled, as without lift.
    """
    if left is None:
        return u
    return left[i] * u + left[n + i]


@helper
def delivered(
    reach: AttainableWrench, tau: Numbers, share: Number, left: np.ndarray | None
) -> Numbers:
    """T u with u a share of T^+ tau: six floats, N and N m.

    Parameters
    ----------
    left : (2 n,) factor and offset in N that faults leave of each thrust; None: no faults

    """
    n = reach.T.shape[1]
    total = (0.0 * tau[0], 0.0 * tau[1], 0.0 * tau[2], 0.0 * tau[3], 0.0 * tau[4], 0.0 * tau[5])
    for i in range(n):
        u = left_of(left, i, n, thrust(reach, i, tau) * share)
        total = add(total, column(reach, i, u))
    return total


@helper
def demanded(reach: AttainableWrench, tau: Numbers) -> Numbers:
    """Wrench demanded of the actuators: T T^+ tau, had the thrusters no limits.

    A degree of freedom without a wrench of its own keeps its command: it is never delivered.
    """
    if reach.T.shape[1] == 0:
        return tau
    spanned, own = delivered(reach, tau, 1.0, None), reach.own
    return (
        select(own[0] > 0.0, spanned[0], tau[0]),
        select(own[1] > 0.0, spanned[1], tau[1]),
        select(own[2] > 0.0, spanned[2], tau[2]),
        select(own[3] > 0.0, spanned[3], tau[3]),
        select(own[4] > 0.0, spanned[4], tau[4]),
        select(own[5] > 0.0, spanned[5], tau[5]),
    )


@helper
def allocated(reach: AttainableWrench, tau: Numbers, left: np.ndarray | None) -> Numbers:
    """T u with u = T^+ tau, scaled down until every thrust is within its limits.

    `left` is what faults leave of u, as of `delivered`; the allocation does not know of them.
    """
    if reach.T.shape[1] == 0:
        return tau
    command, share = shaped(reach.first, reach, tau)
    return delivered(reach, command, share, left)


@helper
def reachable(reach: AttainableWrench, tau: Numbers) -> Six:
    """The wrench that is had for the command tau: thruster allocation, then the axis limits."""
    return clipped(allocated(reach, tau, None), reach.limit)
