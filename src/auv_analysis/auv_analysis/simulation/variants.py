"""Many closed loops that differ in numbers of one scenario, packed as arrays for a batch.

Gains, the vehicle's numbers, relative model errors, set-points and initial states are packed as
columns of numbers; any other value makes a scenario of its own, checked like a file. Both ways give
the same numbers, and what a column cannot vouch for goes the long way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.scenario.changes import bounds, split
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.closed_loop import Loop
from auv_analysis.simulation.simulate import loop_of
from auv_dynamics.files.yaml_files import LARGEST
from auv_dynamics.kernel.lanes import arrays, joined, take_rows, with_batch_axis
from auv_dynamics.plant.disturbance import Harmonics
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.plant.uncertainty import PlantModel, with_errors
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle, rigid_body_matrix, row_major
from auv_dynamics.vehicle.vehicle_file import (
    ABSURD,
    is_definite,
    is_semidefinite,
    is_symmetric,
    principal_moments,
    satisfies_triangle,
)
from auv_gvc_controller.laws.law import SHIPPED
from auv_gvc_controller.laws.model import control_model

Keys = tuple[str | int, ...]  # place of a value in a file, such as ('damping', 'linear', 0)
RELATIVE = ('mass', 'added_mass', 'damping', 'buoyancy')  # errors of a plant
NUMERIC = (  # of M, D and g
    'rigid_body', 'inertia_matrix', 'hydrostatics', 'added_mass', 'damping', 'lift', 'environment',
)  # fmt: skip
TERM = ('amplitude', 'omega', 'phase')
SEEDS = 1 << 63  # that there are, from zero on
SHAPES = ((6,), (6, 6))  # of what stands for a matrix, beside a number where that may stand


def in_columns(scenario: Scenario, controller: str, path: str, values: np.ndarray) -> bool:
    """Whether values of this path are packed as a column.

    Parameters
    ----------
    scenario, controller : that are changed
    path : of `changes`
    values : (B, ...) that stand there

    """
    keys = split(path)
    head, rest = keys[0], keys[1:]
    if values.dtype.kind not in 'iuf' or not rest:
        return head == 'seed' and _are_seeds(values)
    if head == 'controllers':
        return rest[0] == controller and _gain_fits(scenario, controller, rest[1:], values)
    if head == 'vehicle':
        return rest[0] in NUMERIC and _fits(scenario.vehicle_data, rest, values, SHAPES)
    if head == 'disturbance':
        return values.ndim == 1 and _error_fits(scenario, rest)
    if head == 'setpoint':
        return values.ndim == 1 and _setpoint_fits(scenario.data['setpoint'], rest)
    return head == 'initial' and _fits(scenario.data, keys, values, ())


def _are_seeds(values: np.ndarray) -> bool:
    whole = values.dtype.kind in 'iu' and values.ndim == 1
    return whole and bool(np.all((values >= 0) & (values < SEEDS)))


def _error_fits(scenario: Scenario, keys: Keys) -> bool:
    """A relative error of an entry that has such, of a vehicle that can have them."""
    specs = scenario.data['disturbance'] if scenario.vehicle.M_RB is not None else []
    match keys:
        case (int(i), name):
            return name in RELATIVE and i < len(specs) and specs[i]['kind'] == 'model_error'
    return False


def _setpoint_fits(spec: Mapping[str, Any], keys: Keys) -> bool:
    """A number of a degree of freedom that has a set-point, of a term that there is."""
    match keys:
        case (dof, 'offset'):
            return dof in spec
        case (dof, 'terms', int(j), _):
            return j < len(spec.get(str(dof), {}).get('terms', []))
    return False


def _gain_fits(scenario: Scenario, controller: str, keys: Keys, values: np.ndarray) -> bool:
    entry = scenario.data['controllers'][controller]
    gain = entry['law'] in SHIPPED and keys != ('anti_windup',)
    return gain and _fits(entry, keys, values, (*SHAPES, ()))


def _fits(data: Any, keys: Keys, values: np.ndarray, shapes: Sequence[tuple[int, ...]]) -> bool:
    """Whether values stand where numbers stood, in the same shape or another one that may."""
    try:
        for key in keys:
            data = data[key]
        there = np.shape(np.asarray(data, float))
    except (KeyError, IndexError, TypeError, ValueError):
        return False
    shape = values.shape[1:]
    return shape == there or (shape in shapes and there in shapes)


def within(scenario: Scenario, path: str, values: np.ndarray) -> np.ndarray:
    """(B,) whether each value of a column is one that the schema takes."""
    allowed = bounds(scenario, path)
    if allowed is None:
        return np.zeros(len(values), bool)
    flat = np.reshape(values, (len(values), -1)).astype(float)
    inside = (flat > allowed[0]) & (flat < allowed[1]) & (np.abs(flat) < LARGEST)
    return inside.all(axis=1)


@dataclass(frozen=True)
class Variants:
    """Closed loops of one structure.

    Attributes
    ----------
    rows : (B,) index of each among all rollouts
    scenarios : that they are changed from, each of which gives what is not in the arrays
    of : (B,) index of the scenario of each
    loop : arrays with a leading axis of B or 1
    x : (B, 13 + m) initial states
    seeds : (B,) of the sensors' noise
    setpoint : with a leading axis of B; None: that of the scenarios

    """

    rows: np.ndarray
    scenarios: tuple[Scenario, ...]
    of: np.ndarray
    loop: Loop
    x: np.ndarray
    seeds: np.ndarray
    setpoint: Harmonics | None

    def part(self, keep: np.ndarray) -> 'Variants':
        """Those that a mask (B,) keeps."""
        if keep.all():
            return self
        arrays = {name: getattr(self, name)[keep] for name in ('rows', 'of', 'x', 'seeds')}
        setpoint = self.setpoint and self.setpoint.part(keep)
        return replace(self, loop=take_rows(self.loop, keep), setpoint=setpoint, **arrays)

    @property
    def structure(self) -> tuple[Any, ...]:
        """Properties that closed loops must share to run in one batch."""
        scenario, loop = self.scenarios[0], self.loop
        sizes = tuple(np.shape(array)[1:] for array in arrays(loop))
        common = loop.truth.exact, loop.actuators.delay, loop.guard.integrals, loop.faults
        time = scenario.step, scenario.steps, scenario.data['integrator']
        tables = scenario.uncertainty.current is None, scenario.senses
        waves = self.setpoint and tuple(terms.shape[1] for terms in self.setpoint.terms)
        return type(loop.gains), sizes, common, time, tables, waves


def merged(parts: Sequence[Variants]) -> Variants:
    """Closed loops of one structure as one."""
    if len(parts) == 1:
        return parts[0]
    counts = [len(part.rows) for part in parts]
    firsts = np.cumsum([0, *(len(part.scenarios) for part in parts)])
    of = [part.of + first for part, first in zip(parts, firsts, strict=False)]
    return Variants(
        np.concatenate([part.rows for part in parts]),
        tuple(scenario for part in parts for scenario in part.scenarios),
        np.concatenate(of),
        joined([part.loop for part in parts], counts),
        np.concatenate([part.x for part in parts]),
        np.concatenate([part.seeds for part in parts]),
        _joined_setpoints([part.setpoint for part in parts if part.setpoint is not None]),
    )


def _joined_setpoints(parts: Sequence[Harmonics]) -> Harmonics | None:
    if not parts:
        return None
    terms = (np.concatenate(of_axis) for of_axis in zip(*(p.terms for p in parts), strict=True))
    return Harmonics(np.concatenate([part.offset for part in parts]), tuple(terms))


def packed_variants(
    scenario: Scenario,
    controller: str,
    columns: Mapping[str, np.ndarray],
    rows: np.ndarray,
    seeds: np.ndarray,
) -> tuple[Variants, np.ndarray]:
    """Closed loops of one scenario with columns in the place of its values.

    Parameters
    ----------
    scenario, controller : that are changed
    columns : path -> (B, ...), of those that are `in_columns`
    rows, seeds : (B,)

    Returns
    -------
    variants : of all rows
    good : (B,) whether a scenario with these values would be accepted; where not, the arrays are
        those of the scenario as it is

    """
    count = len(rows)
    good = np.ones(count, bool)
    for path, values in columns.items():
        good &= within(scenario, path, values)
    safe = {split(path): _harmless(values, good) for path, values in columns.items()}
    loop = with_batch_axis(loop_of(scenario, controller))
    gains = _gains(scenario, controller, safe, count, good)
    loop = loop._replace(gains=gains or loop.gains)
    vehicle = scenario.vehicle
    of_vehicle = _below(safe, 'vehicle')
    if of_vehicle:
        vehicle, accepted = fleet(scenario.vehicle_data, of_vehicle, vehicle, count)
        good &= accepted
        vehicle = vehicle.changed(**_definite(vehicle, good))
        loop = loop._replace(model=control_model(vehicle))
    if of_vehicle or any(keys[0] == 'disturbance' for keys in safe):
        loop = loop._replace(truth=_truth(scenario, vehicle, safe, good))
    x = _initial(scenario, safe, count, type(loop.gains).STATES)
    setpoint = _setpoint(scenario, safe, count)
    return Variants(rows, (scenario,), np.zeros(count, int), loop, x, seeds, setpoint), good


def _setpoint(
    scenario: Scenario, columns: Mapping[Keys, np.ndarray], count: int
) -> Harmonics | None:
    """Set-points with a leading axis, None where none of their numbers vary."""
    varying = _below(columns, 'setpoint')
    if not varying:
        return None
    base = Harmonics.from_spec(scenario.data['setpoint'])
    offset, *terms = (np.repeat(part[None], count, axis=0) for part in (base.offset, *base.terms))
    for keys, values in varying.items():
        i = DOFS.index(str(keys[0]))
        if keys[1] == 'offset':
            offset[:, i] = values
        else:
            terms[i][:, int(keys[2]), TERM.index(str(keys[3]))] = values
    return Harmonics(offset, tuple(terms))


def _harmless(values: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Copy of values with zero in the rows that are not good."""
    kept = np.array(values, float)
    kept[~good] = 0.0
    return kept


def _below(columns: Mapping[Keys, np.ndarray], *at: str) -> dict[Keys, np.ndarray]:
    return {k[len(at) :]: v for k, v in columns.items() if k[: len(at)] == at}


def _gains(
    scenario: Scenario,
    controller: str,
    columns: Mapping[Keys, np.ndarray],
    count: int,
    good: np.ndarray,
) -> Any:
    """The law's named tuple of (B, 36) arrays, None where no gain varies."""
    varying = _below(columns, 'controllers', controller)
    if not varying:
        return None
    base, given = scenario.gains(controller), scenario.gain_values(controller)
    law, fields = type(base), {}
    for name in law._fields:
        if any(keys[0] == name for keys in varying):
            fields[name] = row_major(matrices(numbers(given[name], varying, (name,), count)))
        else:
            fields[name] = getattr(base, name)[None]
    gains = law(**fields)
    if hasattr(law, 'check'):
        for i in np.flatnonzero(good):
            try:
                law.check(law(*(v[i if len(v) > 1 else 0] for v in gains)))
            except ValueError:
                good[i] = False
    return gains


def _definite(vehicle: Vehicle, good: np.ndarray) -> dict[str, np.ndarray]:
    """The fleet's M with the identity where a row is not good: it must have an inverse."""
    instead = np.where(good[:, None, None], vehicle.M, np.eye(6))
    kept = {'M': instead}
    if vehicle.M_RB is not None and vehicle.M_A is not None:
        kept |= {'M_RB': vehicle.M_RB, 'M_A': vehicle.M_A}
    return kept


def _truth(
    scenario: Scenario, vehicle: Vehicle, columns: Mapping[Keys, np.ndarray], good: np.ndarray
) -> PlantModel:
    specs = [dict(spec) for spec in scenario.data['disturbance']]
    for keys, values in columns.items():
        if keys[0] == 'disturbance':
            specs[int(keys[1])][str(keys[2])] = values
    errors = [spec for spec in specs if spec['kind'] == 'model_error']
    for key in RELATIVE:
        good &= 1 + sum(np.asarray(error.get(key, 0.0)) for error in errors) > 0
    plant, M_RB = with_errors(vehicle, errors)
    accepted = is_definite(plant.M)
    good &= accepted
    M = np.where(np.asarray(good)[:, None, None], plant.M, np.eye(6))
    exact = scenario.uncertainty.truth.exact
    known = vehicle.model
    model = known if plant is vehicle else plant.changed(M=M).model
    return PlantModel(
        with_batch_axis(model, 2),
        with_batch_axis(row_major(M_RB), 2),
        with_batch_axis(known, 2),
        exact,
    )


def _initial(
    scenario: Scenario, columns: Mapping[Keys, np.ndarray], count: int, states: int
) -> np.ndarray:
    eta, nu = (
        np.broadcast_to(numbers(of, columns, ('initial', name), count), (count, 6))
        for name, of in zip(('eta', 'nu'), scenario.initial, strict=True)
    )
    return np.hstack([initial_state(eta, nu), np.zeros((count, states))])


def numbers(data: Any, columns: Mapping[Keys, np.ndarray], at: Keys, count: int) -> np.ndarray:
    """The number, list or matrix at a place of a file, for each of many files.

    Parameters
    ----------
    data : what stands there in the file that all of them are changed from
    columns : place -> (count, ...) values that are put there
    at : its keys
    count : of the files

    Returns
    -------
    values : (count, ...), or (1, ...) where nothing there is changed

    """
    values = np.asarray(data, float)[None]
    inside = sorted((keys for keys in columns if keys[: len(at)] == at), key=len)
    for keys in inside:
        index: tuple[Any, ...] = keys[len(at) :]
        if not index:
            values = np.array(columns[keys], float)
            continue
        if len(values) != count:
            values = np.repeat(values, count, axis=0)
        values[(slice(None), *index)] = columns[keys]
    return values


def matrices(values: np.ndarray) -> np.ndarray:
    """Matrices (B, 6, 6) of scalars (B,) times identity, diagonals (B, 6) or (B, 6, 6)."""
    if values.ndim == 3:
        return values
    rows = values[:, None] if values.ndim == 1 else values
    return np.broadcast_to(rows, (len(rows), 6))[:, :, None] * np.eye(6)


def fleet(
    data: dict[str, Any], columns: Mapping[Keys, np.ndarray], vehicle: Vehicle, count: int
) -> tuple[Vehicle, np.ndarray]:
    """Vehicles of one file with columns of numbers in the place of its own.

    Parameters
    ----------
    data : contents of a checked vehicle file
    columns : place in it, such as ('damping', 'linear', 0) -> (count, ...) finite numbers
    vehicle : of `data`
    count : of the vehicles

    Returns
    -------
    fleet : Vehicle whose M, D, forces and centres have a leading axis of `count`
    good : (count,) whether the file would be accepted

    """

    def of(*at: str) -> np.ndarray:
        found: Any = data
        for key in at:
            found = found[key]
        return np.broadcast_to(
            given := numbers(found, columns, at, count), (count, *given.shape[1:])
        )

    sign = -1.0 if data.get('sign') == 'sname' else 1.0
    mass, r_G = of('rigid_body', 'mass'), of('rigid_body', 'center_of_gravity')
    good = np.ones(count, bool)
    M_RB = M_A = None
    if 'inertia_matrix' in data:
        M = of('inertia_matrix')
        good &= is_symmetric(M)
        M = _symmetric(M)
    else:
        inertia, reference = of('rigid_body', 'inertia'), data['rigid_body']['inertia_reference']
        added = sign * matrices(of('added_mass'))
        good &= is_symmetric(inertia) & is_symmetric(added)
        inertia, M_A = _symmetric(inertia), _symmetric(added)
        moments = principal_moments(mass, r_G, inertia, reference)
        good &= (moments[:, 0] > 0) & satisfies_triangle(moments) & is_semidefinite(M_A)
        M_RB = rigid_body_matrix(mass, r_G, inertia, reference)
        M = M_RB + M_A
    linear = sign * matrices(of('damping', 'linear'))
    density, volume = of('environment', 'water_density'), of('hydrostatics', 'volume')
    good &= (density * volume <= ABSURD * mass) & (mass <= ABSURD * density * volume)
    gravity = of('environment', 'gravity')
    result = vehicle.changed(
        M=M,
        D_linear=linear,
        D_quadratic=sign * matrices(of('damping', 'quadratic')),
        lift=sign * matrices(of('lift')) if 'lift' in data else None,
        weight=mass * gravity,
        buoyancy=density * gravity * volume,
        r_G=r_G,
        r_B=of('hydrostatics', 'center_of_buoyancy'),
        M_RB=M_RB,
        M_A=M_A,
    )
    return result, good & is_definite(M) & is_semidefinite(_symmetric(linear))


def _symmetric(A: np.ndarray) -> np.ndarray:
    return (A + np.swapaxes(A, -2, -1)) / 2
