"""Monte Carlo over random model errors and disturbances, the same for every controller."""

import math
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from auv_analysis.runs.run import Hold
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.studies.tune.cost import Measures, joined, of_each
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

FREQUENCIES = 0.3, 1.5  # rad/s, of the waves' forces
BELOW_ONE = ('mass', 'added_mass', 'damping', 'buoyancy', 'inertia')  # no plant without any


@dataclass(frozen=True)
class Spread:
    """Ranges of the draws; each number is drawn uniformly within its own.

    Attributes
    ----------
    mass, added_mass, damping, buoyancy : largest relative error of the plant
    inertia : the same of M, along each of its own directions, for a vehicle whose M_RB and M_A are
        not apart; takes the place of mass and added_mass
    disturbance : largest relative change of the scenario's own disturbance
    waves : largest amplitude of an added harmonic force, as an acceleration, m/s2 and rad/s2
    current : fastest added current, m/s, constant, horizontal

    """

    mass: float = 0.05
    added_mass: float = 0.2
    damping: float = 0.3
    buoyancy: float = 0.02
    inertia: float = 0.1
    disturbance: float = 0.5
    waves: float = 0.05
    current: float = 0.1


def spread_of(texts: Iterable[str], vehicle: Vehicle) -> Spread:
    """Spread of the command line: NAME=VALUE each, the others as they are.

    Raises
    ------
    InputError : no such name for this vehicle, no number, or one that is out of bounds

    """
    spread = Spread()
    known = applicable(spread, vehicle)
    for text in texts:
        name, _, value = text.partition('=')
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if name not in known:
            expected = f'NAME=VALUE with NAME {one_of(name, known)}'
            raise InputError('--spread', '', expected, text)
        top = 1.0 if name in BELOW_ONE else math.inf
        if not 0 <= number < top:
            bound = ' below 1' if name in BELOW_ONE else ''
            raise InputError('--spread', name, f'a number from 0 up{bound}', value)
        spread = replace(spread, **{name: number})
    return spread


def applicable(spread: Spread, vehicle: Vehicle) -> dict[str, float]:
    """The part of a spread that applies to a vehicle, name -> value."""
    unused = ('inertia',) if vehicle.M_RB is not None else ('mass', 'added_mass')
    return {name: value for name, value in asdict(spread).items() if name not in unused}


def monte_carlo(
    scenario: Scenario, spread: Spread, samples: int, seed: int, hold: Hold, threads: int,
    progress: Callable[[], None] = lambda: None,
) -> dict[str, Measures]:  # fmt: skip
    """Measures of every controller of a scenario over the same draws.

    Parameters
    ----------
    scenario : with the controllers to compare
    spread, samples, seed : of the draws, one at least
    hold : 'continuous' or 'zoh'
    threads : how many draws run at a time
    progress : called after each draw

    Returns
    -------
    measures : controller -> Measures of (samples,); row i is draw i for every controller

    """

    def one(index: int) -> dict[str, Measures]:
        measures = of_each(perturbed(scenario, spread, seed, index), hold)
        progress()
        return measures

    rows = [one(0)]  # alone: it may compile
    with ThreadPoolExecutor(threads) as pool:
        try:
            rows += pool.map(one, range(1, samples))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return {name: joined([row[name] for row in rows]) for name in scenario.controllers}


def perturbed(scenario: Scenario, spread: Spread, seed: int, index: int) -> Scenario:
    """The scenario with the changes of one draw, which depend on seed and index alone.

    Parameters
    ----------
    scenario : of `load_scenario`
    spread : how far the changes go
    seed, index : of the draw

    Returns
    -------
    changed : Scenario with another `disturbance` and, for its sensors, another seed

    Raises
    ------
    InputError : the changes and the scenario's own model errors make no plant

    """
    rng = np.random.default_rng([seed, index])
    factor = 1 + spread.disturbance * rng.uniform(-1, 1)
    own = [_scaled(spec, factor, rng) for spec in scenario.data['disturbance']]
    added = [
        _model_error(scenario.vehicle, spread, rng),
        _waves(scenario.vehicle.M, spread.waves, rng),
        _current(spread.current, rng),
    ]
    seed_of_noise = int(rng.integers(2**31))
    values = {'disturbance': [*own, *(spec for spec in added if len(spec) > 1)]}
    try:
        return changed_scenario(scenario, values | {'seed': seed_of_noise})
    except InputError as error:
        expected = f'draws that leave {error.key} {error.expected}'
        raise InputError('--spread', '', expected, error.found) from None


def _scaled(spec: Mapping[str, Any], factor: float, rng: np.random.Generator) -> dict[str, Any]:
    """A disturbance of the scenario, larger or smaller; a harmonic at another phase as well."""
    if spec['kind'] == 'herman2018':
        return {**spec, 'scale': (factor * np.asarray(spec.get('scale', 1.0))).tolist()}
    if spec['kind'] != 'harmonic':
        return dict(spec)
    changed: dict[str, Any] = {'kind': 'harmonic'}
    for dof in DOFS:
        if dof in spec:
            terms = [
                {
                    **term,
                    'amplitude': factor * term['amplitude'],
                    'phase': float(rng.uniform(0, 2 * np.pi)),
                }
                for term in spec[dof].get('terms', [])
            ]
            offset = factor * spec[dof].get('offset', 0.0)
            changed[dof] = {'offset': offset, 'terms': terms}
    return changed


def _model_error(vehicle: Vehicle, spread: Spread, rng: np.random.Generator) -> dict[str, Any]:
    """Relative errors; where M_RB and M_A are not apart, matrices dM and dD of that size."""
    error: dict[str, Any] = {'kind': 'model_error'}
    units = rng.uniform(-1, 1, 4).tolist()
    directions = rng.standard_normal((6, 6))
    sizes, axes = rng.uniform(-1, 1, (2, 6))
    apart = vehicle.M_RB is not None
    for name, unit in zip(('mass', 'added_mass', 'damping', 'buoyancy'), units, strict=True):
        if getattr(spread, name) and (apart or name == 'buoyancy'):
            error[name] = getattr(spread, name) * unit
    if spread.inertia and not apart:
        error['dM'] = _relative(vehicle.M, directions, spread.inertia * sizes).tolist()
    if spread.damping and not apart:
        root = np.sqrt(1 + spread.damping * axes)  # of each axis: what dissipates goes on to do so
        error['dD'] = (np.outer(root, root) * vehicle.D_linear - vehicle.D_linear).tolist()
    return error


def _relative(M: np.ndarray, directions: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """DM with x^T (M + dM) x between 1 + min(sizes) and 1 + max(sizes) times x^T M x.

    M = L L^T and dM = L Q diag(sizes) Q^T L^T with Q orthogonal: M + dM is positive definite for
    sizes above -1.
    """
    Q, R = np.linalg.qr(directions)
    LQ = np.linalg.cholesky(M) @ (Q * np.sign(np.diagonal(R)))
    dM = (LQ * sizes) @ LQ.T
    return (dM + dM.T) / 2


def _waves(M: np.ndarray, largest: float, rng: np.random.Generator) -> dict[str, Any]:
    """A harmonic force on each axis."""
    sizes = largest * np.diagonal(M) * rng.uniform(0, 1, 6)
    omegas, phases = rng.uniform(*FREQUENCIES, 6), rng.uniform(0, 2 * np.pi, 6)
    if not largest:
        return {'kind': 'harmonic'}
    terms = [
        {'amplitude': float(a), 'omega': float(omega), 'phase': float(phase)}
        for a, omega, phase in zip(sizes, omegas, phases, strict=True)
    ]
    return {'kind': 'harmonic', **{dof: {'terms': [t]} for dof, t in zip(DOFS, terms, strict=True)}}


def _current(fastest: float, rng: np.random.Generator) -> dict[str, Any]:
    """A constant horizontal current."""
    speed, heading = fastest * rng.uniform(), rng.uniform(0, 2 * np.pi)
    if not fastest:
        return {'kind': 'current'}
    velocity = [float(speed * np.cos(heading)), float(speed * np.sin(heading)), 0.0]
    return {'kind': 'current', 'velocity': velocity}
