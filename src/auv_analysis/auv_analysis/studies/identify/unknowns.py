"""The unknown parameters theta: unbounded, without units, zero at the prior.

M = S R R^T S with S = sqrt(diag M) of the prior and R lower triangular, its diagonal by its
logarithm: M is symmetric positive definite whatever theta is. Lag and gains go by their logarithm,
everything else is added to the prior in a unit of its own. Those units are the standard deviations
that the prior is given where nobody says one: wide, so that what the data know is left to them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.model import Model
from auv_dynamics.vehicle.vehicle import Vehicle, make_model
from auv_dynamics.vehicle.vehicle_file import is_definite

LOWER = [(i, j) for i in range(6) for j in range(i + 1)]
RESTORING = ('force', 'couple_x', 'couple_y', 'couple_z')
UNFAMILIAR = 0.7  # logarithm: what a prior's inertia, lag or gain may be off by
GAIN_UNFAMILIAR = 0.2
CORRELATION = 0.5  # of off-diagonal inertia
DAMPING = 3.0  # times the prior's resistance
SHORTEST_LAG = 0.02  # s, where the prior has none
DEFAULT = ('M', 'D_linear', 'D_quadratic', 'restoring', 'lag', 'delay')


@dataclass(frozen=True, eq=False)
class Coefficients:
    """A model and what stands between command and wrench; any number of leading axes.

    Attributes
    ----------
    M, D_linear, D_quadratic : (..., 6, 6) of (1), body frame, SI, damping positive
    hydrostatics : (..., 4) W - B in N, then W r_G - B r_B in N m
    lag, delay : (...,) s, of the actuators
    gain : (..., 6) by which the wrench commanded is multiplied
    bias : (..., 6) constant wrench, N and N m, body frame
    current : (..., 3) constant velocity of the water, m/s, NED

    """

    M: np.ndarray
    D_linear: np.ndarray
    D_quadratic: np.ndarray
    hydrostatics: np.ndarray
    lag: np.ndarray
    delay: np.ndarray
    gain: np.ndarray
    bias: np.ndarray
    current: np.ndarray

    def model(self, lift: np.ndarray | None) -> Model:
        """The same for the kernel, one leading axis; lift (6, 6) is that of all."""
        lifts = None if lift is None else np.broadcast_to(lift, self.M.shape)
        return make_model(self.M, self.D_linear, self.D_quadratic, self.hydrostatics, lifts)


@dataclass(frozen=True)
class Entry:
    """One unknown: a place in the `Coefficients`, and how theta moves it."""

    group: str
    index: tuple[int, ...]
    name: str
    unit: float  # of theta, in that of the coefficient; of logarithms without one
    si: str  # unit of the coefficient

    @property
    def is_log(self) -> bool:
        """Whether theta moves its logarithm."""
        return self.group in ('lag', 'gain') or (
            self.group == 'M' and self.index[0] == self.index[1]
        )


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Free coefficients of a vehicle.

    Attributes
    ----------
    prior : their values at theta = 0, without leading axes
    entries : the free ones, in the order of theta
    is_delay_free : whether the delay is searched, which is no part of theta
    believed : name -> (value, standard deviation) of the coefficients that somebody knows; the
        values are those of `prior`

    """

    prior: Coefficients
    entries: tuple[Entry, ...]
    is_delay_free: bool = False
    believed: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Of the free coefficients."""
        return [entry.name for entry in self.entries]

    @cached_property
    def _scales(self) -> tuple[np.ndarray, np.ndarray]:
        s = np.sqrt(np.diag(self.prior.M))
        return s, np.linalg.cholesky(self.prior.M / np.outer(s, s))

    def coefficients(self, theta: np.ndarray) -> Coefficients:
        """Coefficients of theta (..., n)."""
        theta = np.asarray(theta, float)
        lead = theta.shape[:-1]
        own = {
            name: np.broadcast_to(value, (*lead, *np.shape(value))).copy()
            for name, value in vars(self.prior).items()
        }
        s, R0 = self._scales
        R = np.broadcast_to(R0, (*lead, 6, 6)).copy()
        for k, entry in enumerate(self.entries):
            step = entry.unit * theta[..., k]
            at: Any = (..., *entry.index)
            of = R if entry.group == 'M' else own[entry.group]
            of[at] = of[at] * np.exp(step) if entry.is_log else of[at] + step
        own['M'] = s[:, None] * (R @ np.swapaxes(R, -1, -2)) * s
        return Coefficients(**own)

    def theta(self, wanted: Coefficients) -> np.ndarray:
        """Theta (n,) of coefficients without leading axes, as far as they are free."""
        s, R0 = self._scales
        R = np.linalg.cholesky(wanted.M / np.outer(s, s))
        found = np.zeros(len(self.entries))
        for k, entry in enumerate(self.entries):
            if entry.group == 'M':
                new, old = R[entry.index], R0[entry.index]
            else:
                new, old = (getattr(c, entry.group)[entry.index] for c in (wanted, self.prior))
            found[k] = (np.log(new / old) if entry.is_log else new - old) / entry.unit
        return found

    def values(self, theta: np.ndarray) -> np.ndarray:
        """Free coefficients (..., n) in their own units."""
        found, free = self.coefficients(theta), np.array(theta, float)
        for k, entry in enumerate(self.entries):
            free[..., k] = getattr(found, entry.group)[(..., *entry.index)]
        return free

    def gradient(self, theta: np.ndarray) -> np.ndarray:
        """Derivatives (n, n) of `values` by theta, by central steps."""
        h = 1e-5
        steps = h * np.eye(len(theta))
        return (self.values(theta + steps) - self.values(theta - steps)).T / (2 * h)

    def precision(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Precision (n, n) of the prior near theta, and the gradient (n,) of its cost / 2."""
        n = len(self.entries)
        P, g = np.eye(n), np.asarray(theta, float).copy()
        if self.believed:
            values, J = self.values(theta), self.gradient(theta)
            for name, (value, deviation) in self.believed.items():
                k = self.names.index(name)
                row = J[k] / deviation
                P[k, k] -= 1.0  # what is known takes the place of the wide default
                g[k] -= theta[k]
                P += np.outer(row, row)
                g += row * (values[k] - value) / deviation
        return P, g

    def prior_cost(self, theta: np.ndarray) -> float:
        """Squared distance from the prior in its standard deviations."""
        kept = [k for k, name in enumerate(self.names) if name not in self.believed]
        cost = float(theta[kept] @ theta[kept])
        if self.believed:
            values = dict(zip(self.names, self.values(theta), strict=True))
            cost += sum(((values[n] - v) / d) ** 2 for n, (v, d) in self.believed.items())
        return cost

    def with_delay(self, delay: float) -> 'Unknowns':
        """The same with another delay, which is not a part of theta."""
        return replace(self, prior=replace(self.prior, delay=np.array(float(delay))))

    def without(self, names: Sequence[str], **values: np.ndarray) -> 'Unknowns':
        """Fewer unknowns; the prior takes other values."""
        entries = tuple(entry for entry in self.entries if entry.name not in names)
        believed = {name: self.believed[name] for name in self.believed if name not in names}
        prior = replace(self.prior, **values)
        return replace(self, entries=entries, prior=prior, believed=believed)


def unknowns(
    vehicle: Vehicle,
    free: Sequence[str] = DEFAULT,
    fixed: Sequence[str] = (),
    *,
    speeds: np.ndarray,
    wrenches: np.ndarray,
    lag: float = 0.0,
    believed: Mapping[str, tuple[float, float]] | None = None,
    origin: object = 'options',
) -> Unknowns:
    """Unknowns of a vehicle.

    Parameters
    ----------
    vehicle : the prior
    free, fixed : names such as 'M', 'M.diagonal', 'M.pitch.surge', 'D_linear', 'D_linear.full',
        'D_quadratic.sway', 'restoring', 'lag', 'gain', 'bias', 'current'; fixed ones win
    speeds, wrenches : (6,) root mean squares in the recording, which give scales
    lag : s, of the prior
    believed : name -> (value, standard deviation); the value takes the place of the vehicle's
    origin : named in errors

    Raises
    ------
    InputError : no such name, or a value that no vehicle has

    """
    prior = Coefficients(
        vehicle.M, vehicle.D_linear, vehicle.D_quadratic, vehicle.model.hydrostatics,
        np.array(lag), np.array(0.0), np.ones(6), np.zeros(6), np.zeros(3),
    )  # fmt: skip
    every = _every(vehicle, prior, speeds, wrenches)
    kept = named(free, every, '--free', origin) - named(fixed, every, '--fixed', origin)
    entries = tuple(e for e in every if e.name in kept and e.group != 'delay')
    if any(entry.group == 'lag' for entry in entries) and lag < SHORTEST_LAG:
        prior = replace(prior, lag=np.array(SHORTEST_LAG))
    believed = dict(believed or {})
    names = sorted(entry.name for entry in entries)
    for name in believed:
        if name not in names:
            raise InputError(origin, '', one_of(name, names), name)
    prior = _with_believed(prior, [e for e in entries if e.name in believed], believed, origin)
    return Unknowns(prior, entries, 'delay' in kept, believed)


def _with_believed(
    prior: Coefficients,
    entries: Sequence[Entry],
    believed: Mapping[str, tuple[float, float]],
    origin: object,
) -> Coefficients:
    """The prior with what somebody knows in it; a diagonal entry of M keeps its correlations."""
    own = {name: np.array(value) for name, value in vars(prior).items()}
    for entry in sorted(entries, key=lambda e: len(set(e.index))):  # diagonals first
        value, at = believed[entry.name][0], entry.index
        if entry.is_log and not value > 0.0:
            raise InputError(origin, entry.name, 'a positive value', value)
        if entry.group == 'M' and entry.is_log:
            scale = np.ones(6)
            scale[at[0]] = np.sqrt(value / own['M'][at])
            own['M'] *= np.outer(scale, scale)
        elif entry.group == 'M':
            own['M'][at[::-1]] = value
        own[entry.group][at] = value
    if not is_definite(own['M']):
        found = f'smallest eigenvalue {np.linalg.eigvalsh(own["M"])[0]:.4g}'
        raise InputError(origin, 'M', 'values with which it is positive definite', found)
    return Coefficients(**own)


def inertia_unit(i: int, j: int) -> str:
    """Unit of M_ij."""
    return ('kg', 'kg m', 'kg m²')[(i > 2) + (j > 2)]


def _every(
    vehicle: Vehicle, prior: Coefficients, speeds: np.ndarray, wrenches: np.ndarray
) -> list[Entry]:
    """All that may be free, in the order of reports."""
    made = []
    for i, j in LOWER:
        unit = UNFAMILIAR / 2 if i == j else CORRELATION  # M goes as the square of R
        made.append(Entry('M', (i, j), f'M.{DOFS[i]}.{DOFS[j]}', unit, inertia_unit(i, j)))
    drag = _resistance(vehicle, speeds, wrenches)
    for group, power in (('D_linear', 1), ('D_quadratic', 2)):
        for i in range(6):
            for j in range(6):
                unit = DAMPING * np.sqrt(drag[i] * drag[j] / (speeds[i] * speeds[j]) ** power)
                name = f'{group}.{DOFS[i]}' + ('' if i == j else f'.{DOFS[j]}')
                per = ('m/s' if j < 3 else 'rad/s') + ('' if power == 1 else ')²')
                si = f'{"N" if i < 3 else "N m"}/{"(" if power == 2 else ""}{per}'
                made.append(Entry(group, (i, j), name, unit, si))
    weight, size = float(vehicle.weight), np.abs(prior.hydrostatics)
    scales = [max(size[0], 0.02 * weight), *[max(size[1:].max(), 0.02 * weight)] * 3]
    for i, (name, unit) in enumerate(zip(RESTORING, scales, strict=True)):
        made.append(
            Entry('hydrostatics', (i,), f'restoring.{name}', unit, 'N' if i == 0 else 'N m')
        )
    made.append(Entry('lag', (), 'lag', 2 * UNFAMILIAR, 's'))
    made.append(Entry('delay', (), 'delay', 0.1, 's'))
    made += [Entry('gain', (i,), f'gain.{n}', GAIN_UNFAMILIAR, '') for i, n in enumerate(DOFS)]
    for i, dof in enumerate(DOFS):
        unit = max(wrenches[i], 1e-3 * weight * (1.0 if i < 3 else 0.1))
        made.append(Entry('bias', (i,), f'bias.{dof}', unit, 'N' if i < 3 else 'N m'))
    made += [Entry('current', (i,), f'current.{axis}', 0.3, 'm/s')
             for i, axis in enumerate(('north', 'east', 'down'))]  # fmt: skip
    return made


def _resistance(vehicle: Vehicle, speeds: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
    """(6,) N, N m: damping of the prior at the speeds of the recording, some of tau at least."""
    D = np.abs(np.diag(vehicle.D_linear)) + np.abs(np.diag(vehicle.D_quadratic)) * speeds
    least = 0.1 * np.maximum(wrenches, np.diag(vehicle.M) * speeds / 10.0)
    return np.maximum(D * speeds, least)


def named(patterns: Sequence[str], every: Sequence[Entry], key: str, origin: object) -> set[str]:
    """Names of the unknowns that patterns such as 'M', 'M.diagonal', 'M.pitch.surge' mean.

    Raises
    ------
    InputError : naming the key, a pattern that means none of them

    """
    found: set[str] = set()
    for pattern in patterns:
        some = {entry.name for entry in every if _matches(pattern, entry)}
        if not some:
            groups = dict.fromkeys(entry.name.partition('.')[0] for entry in every)
            raise InputError(origin, key, one_of(pattern, groups) + ' or a part of it', pattern)
        found |= some
    return found


def _matches(pattern: str, entry: Entry) -> bool:
    """Whether a name means this unknown: itself, either way round, a group or a part of one."""
    head, _, rest = pattern.partition('.')
    group, _, own = entry.name.partition('.')
    if head != group:
        return False
    is_diagonal = len(set(entry.index)) == 1
    if not rest:
        return group == 'M' or not group.startswith('D_') or is_diagonal
    if rest in ('full', 'diagonal'):
        return rest == 'full' or is_diagonal
    return rest == own or '.'.join(reversed(rest.split('.'))) == own
