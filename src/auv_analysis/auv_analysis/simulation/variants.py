"""Many closed loops that differ in numbers of one scenario, packed as arrays for a batch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.scenario.changes import split
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.closed_loop import Loop
from auv_analysis.simulation.columns import RELATIVE, TERM, within
from auv_analysis.simulation.fleet import (
    Keys,
    fleet,
    matrices,
    numbers,
)
from auv_analysis.simulation.simulate import loop_of
from auv_dynamics.kernel.lanes import arrays, joined, take_rows, with_batch_axis
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.plant.signals import Harmonics
from auv_dynamics.plant.uncertainty import Truth, with_errors
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle, row_major
from auv_dynamics.vehicle.vehicle_file import is_definite
from auv_gvc_controller.laws.model import control_model


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
        """What closed loops must have in common to run in one batch."""
        scenario, loop = self.scenarios[0], self.loop
        sizes = tuple(np.shape(array)[1:] for array in arrays(loop))
        actuators = loop.actuators.ideal, loop.actuators.delay
        numbers_in_common = loop.truth.exact, *actuators, loop.faults
        guard = loop.guard.integrals, loop.guard.reach.bounded, loop.actuators.reach.bounded
        time = scenario.step, scenario.steps, scenario.data['integrator']
        water = scenario.uncertainty.current is None, scenario.senses, scenario.faults.thrusters
        waves = self.setpoint and tuple(terms.shape[1] for terms in self.setpoint.terms)
        return type(loop.gains), sizes, numbers_in_common, guard, time, water, waves


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
    by_keys = {split(path): np.array(values, float) for path, values in columns.items()}
    safe = {keys: _harmless(scenario, keys, values, good) for keys, values in by_keys.items()}
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


def _harmless(scenario: Scenario, keys: Keys, values: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Values with those of the rows that are not good put to one that is, or to zero."""
    if good.all():
        return values
    kept = values.copy()
    kept[~good] = values[good][0] if good.any() else 0.0
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
            good[i] = _accepted(law, law(*(v[i if len(v) > 1 else 0] for v in gains)))
    return gains


def _accepted(law: Any, gains: Any) -> bool:
    try:
        law.check(gains)
    except ValueError:
        return False
    return True


def _definite(vehicle: Vehicle, good: np.ndarray) -> dict[str, np.ndarray]:
    """The fleet's M with the identity where a row is not good: it must have an inverse."""
    instead = np.where(good[:, None, None], vehicle.M, np.eye(6))
    kept = {'M': instead}
    if vehicle.M_RB is not None and vehicle.M_A is not None:
        kept |= {'M_RB': vehicle.M_RB, 'M_A': vehicle.M_A}
    return kept


def _truth(
    scenario: Scenario, vehicle: Vehicle, columns: Mapping[Keys, np.ndarray], good: np.ndarray
) -> Truth:
    specs = [dict(spec) for spec in scenario.data['disturbance']]
    for keys, values in columns.items():
        if keys[0] == 'disturbance':
            specs[int(keys[1])][str(keys[2])] = values
    errors = [spec for spec in specs if spec['kind'] == 'model_error']
    for key in RELATIVE:
        left = 1 + sum(np.asarray(error.get(key, 0.0)) for error in errors)
        good &= (left > 0) if key == 'mass' else (left >= 0)
    plant, M_RB = with_errors(vehicle, errors)
    accepted = is_definite(plant.M)
    good &= accepted
    M = np.where(np.asarray(good)[:, None, None], plant.M, np.eye(6))
    exact = scenario.uncertainty.truth.exact
    known = vehicle.model
    model = known if plant is vehicle else plant.changed(M=M).model
    return Truth(
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
