"""Uncertainty of the plant: model error, current, external disturbance, (3)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import matrix6
from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number
from auv_dynamics.kernel.six import (
    Numbers,
    Six,
    Vector,
    add,
    matvec,
    sub,
)
from auv_dynamics.plant.disturbance import Disturbance, Harmonics, make_disturbance
from auv_dynamics.vehicle.kinematics import position_rate
from auv_dynamics.vehicle.model import (
    Model,
    acceleration,
    coriolis,
    damping,
    restoring,
)
from auv_dynamics.vehicle.vehicle import Vehicle, row_major
from auv_dynamics.vehicle.vehicle_file import ASYMMETRY, is_definite

Current = Callable[[np.ndarray], np.ndarray]  # t (n,) in s -> (n, 6): v_c, v_c_dot in NED
AXES = {'north': 'surge', 'east': 'sway', 'down': 'heave'}


def make_current(specs: Sequence[Mapping[str, Any]]) -> Current | None:
    """Sum of the currents of a checked scenario; None where there is none.

    Parameters
    ----------
    specs : mappings of kind `current`: `velocity` (3,) in m/s, NED, constant; `north`, `east`,
        `down` with offset and terms, as of a harmonic

    Returns
    -------
    current : function of t (n,) in s, gives (n, 6): v_c in m/s and its derivative in m/s2, NED

    """
    if not specs:
        return None
    constant = np.sum([spec.get('velocity', [0.0] * 3) for spec in specs], axis=0, dtype=float)
    waves = [
        Harmonics.from_spec({dof: spec[axis] for axis, dof in AXES.items() if axis in spec})
        for spec in specs
    ]

    def current(t: np.ndarray) -> np.ndarray:
        t = np.asarray(t, float)
        flow = np.zeros((*t.shape, 6))
        flow[..., :3] = constant
        for wave in waves:
            flow[..., :3] += wave.value(t)[..., :3]
            flow[..., 3:] += wave.derivative(t)[..., :3]
        return flow

    return current


def varies(spec: Mapping[str, Any]) -> bool:
    """Whether the current of a mapping changes with time."""
    return any(
        term['amplitude'] != 0 and term['omega'] != 0
        for axis in AXES
        for term in spec.get(axis, {}).get('terms', [])
    )


@helper
def to_body(attitude: Vector, v: Vector) -> tuple[Number, Number, Number]:
    """R(q)^T v: a vector in NED seen in the body frame; R^T is R of the conjugate."""
    w, x, y, z = attitude
    return position_rate((w, -x, -y, -z), v)


APART = ('mass', 'added_mass', 'damping')  # relative errors, for M_RB and M_A given apart


class PlantModel(NamedTuple):
    """The plant's coefficients beside those of the vehicle file.

    Attributes
    ----------
    model : of the plant, errors included
    M_RB : (36,) rigid-body part of M with its error, zero where it is not known
    known : of the vehicle file, which defines F
    exact : the plant is the vehicle file's and there is no current: F is d(t) alone

    """

    model: Model
    M_RB: np.ndarray
    known: Model
    exact: bool


@dataclass(frozen=True)
class Uncertainty:
    """What acts on a plant besides the wrench.

    Attributes
    ----------
    truth : coefficients
    F : external disturbance d(t), function of t (n,) to (n, 6) in N, N m
    current : v_c and v_c_dot, function of t (n,) to (n, 6) in NED; None: still water

    """

    truth: PlantModel
    F: Disturbance
    current: Current | None

    def tables(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """F (n, s, 6) and current (n, s, 6) or (n, 0, 6) at the stage times t (n, s)."""
        F = self.F(t.ravel()).reshape(*t.shape, 6)
        if self.current is None:
            return F, np.zeros((len(t), 0, 6))
        return F, self.current(t.ravel()).reshape(*t.shape, 6)


def make_uncertainty(
    vehicle: Vehicle, specs: Sequence[Mapping[str, Any]], file: object, places: Sequence[str]
) -> Uncertainty:
    """Uncertainty of a plant.

    Parameters
    ----------
    vehicle : what the controller knows
    specs : disturbances of a checked scenario
    file, places : the file, and the key of each spec in it, for errors

    Raises
    ------
    InputError : an error that this vehicle's file cannot take, or that leaves M indefinite

    """
    _check_sums(specs, file, places)
    of_kind = {kind: [s for s in specs if s['kind'] == kind] for kind in ('model_error', 'current')}
    for spec, place in zip(specs, places, strict=True):
        _check(vehicle, spec, file, place, of_kind['model_error'])
    plant, M_RB = with_errors(vehicle, of_kind['model_error'])
    if not is_definite(plant.M):
        place = next(p for s, p in zip(specs, places, strict=True) if s['kind'] == 'model_error')
        found = f'smallest eigenvalue {np.linalg.eigvalsh(plant.M)[0]:.4g}'
        raise InputError(file, place, 'a positive definite M + dM', found)
    current = make_current(of_kind['current'])
    exact = current is None and not of_kind['model_error']
    truth = PlantModel(plant.model, row_major(M_RB), vehicle.model, exact)
    return Uncertainty(truth, make_disturbance(specs), current)


def _check_sums(specs: Sequence[Mapping[str, Any]], file: object, places: Sequence[str]) -> None:
    """Relative errors of several entries add up: what is left must not be negative."""
    errors = [spec for spec in specs if spec['kind'] == 'model_error']
    for key in (*APART, 'buoyancy'):
        left = 1 + _sum(errors, key)
        if left < 0 or (left == 0 and key == 'mass'):
            place = next(p for s, p in zip(specs, places, strict=True) if key in s)
            bound = 'above -1' if key == 'mass' else 'of at least -1'
            raise InputError(file, f'{place}.{key}', f'a sum of all entries {bound}', left - 1)


def _check(
    vehicle: Vehicle,
    spec: Mapping[str, Any],
    file: object,
    place: str,
    errors: Sequence[Mapping[str, Any]],
) -> None:
    apart = vehicle.M_RB is not None
    if spec['kind'] == 'model_error':
        for key in APART:
            if key in spec and not apart:
                expected = 'dM and dD for a vehicle given by inertia_matrix'
                raise InputError(file, f'{place}.{key}', expected, 'a relative error')
        dM = matrix6(spec.get('dM', 0.0))
        if np.abs(dM - dM.T).max() > ASYMMETRY * np.abs(dM).max():
            raise InputError(file, f'{place}.dM', 'a symmetric matrix', 'an asymmetric one')
    if spec['kind'] == 'current' and varies(spec):
        key = next(axis for axis in AXES if varies({axis: spec.get(axis, {})}))
        if not apart:
            expected = 'a constant current for a vehicle given by inertia_matrix'
            raise InputError(file, f'{place}.{key}', expected, 'one that varies in time')
        if any('dM' in error for error in errors):
            expected = 'a constant current beside dM, which does not say what is rigid body'
            raise InputError(file, f'{place}.{key}', expected, 'one that varies in time')


def with_errors(
    vehicle: Vehicle, errors: Sequence[Mapping[str, Any]]
) -> tuple[Vehicle, np.ndarray]:
    """The plant with its errors and its M_RB (..., 6, 6), zero where it is not known.

    Each relative error is a number, or (B,) of them for as many plants.
    """

    def factor(key: str) -> Any:
        return np.asarray(1 + _sum(errors, key))[..., None, None]

    if vehicle.M_RB is None or vehicle.M_A is None:
        M_RB, M = np.zeros((6, 6)), vehicle.M
    else:
        M_RB = vehicle.M_RB * factor('mass')
        M = M_RB + vehicle.M_A * factor('added_mass')
    if not errors:
        return vehicle, M_RB
    dM = np.sum([matrix6(error.get('dM', 0.0)) for error in errors], axis=0)
    drag = factor('damping')
    weight = vehicle.weight * (1 + _sum(errors, 'mass'))
    buoyancy = vehicle.buoyancy * (1 + _sum(errors, 'buoyancy'))
    plant = vehicle.changed(
        M=M + (dM + dM.T) / 2,
        D_linear=vehicle.D_linear * drag + sum(matrix6(error.get('dD', 0.0)) for error in errors),
        D_quadratic=vehicle.D_quadratic * drag,
        lift=None if vehicle.lift is None else vehicle.lift * drag,
        weight=weight,
        buoyancy=buoyancy,
    )
    return plant, M_RB


def _sum(errors: Sequence[Mapping[str, Any]], key: str) -> Any:
    return sum(error.get(key, 0.0) for error in errors)


@helper
def true_acceleration(
    truth: PlantModel,
    attitude: Vector,
    nu: Vector,
    tau: Vector,
    F: Vector,
    current: np.ndarray,
    stage: int,
) -> Six:
    """nu_dot of the plant at a stage of the step, in its current (v_c, v_c_dot) in NED.

    (1) in nu_r = nu - (R^T v_c, 0) with M_RB (R^T v_c_dot, 0) on its left-hand side, then
    nu_dot = nu_r_dot + (R^T v_c_dot - omega x R^T v_c, 0). Fossen 2021, section 10.3. `current`
    (s, 6), or (0, 6) in still water.
    """
    if current.shape[0] == 0:
        return acceleration(truth.model, attitude, nu, tau, F)
    flow = current[stage]
    c = to_body(attitude, (flow[0], flow[1], flow[2]))
    a = to_body(attitude, (flow[3], flow[4], flow[5]))
    carried = matvec(truth.M_RB, (a[0], a[1], a[2], 0.0, 0.0, 0.0))
    p, q, r = nu[3], nu[4], nu[5]
    nu_r = (nu[0] - c[0], nu[1] - c[1], nu[2] - c[2], p, q, r)
    b = acceleration(truth.model, attitude, nu_r, tau, add(F, carried))
    return (
        b[0] + a[0] - (q * c[2] - r * c[1]),
        b[1] + a[1] - (r * c[0] - p * c[2]),
        b[2] + a[2] - (p * c[1] - q * c[0]),
        b[3],
        b[4],
        b[5],
    )


@helper
def lumped(
    truth: PlantModel, attitude: Vector, nu: Vector, tau: Vector, F: Numbers, nu_dot: Vector
) -> Numbers:
    """F := tau - [M nu_dot + C nu + D nu + g] with the vehicle file's coefficients, (1), (3).

    `tau` is the wrench really applied, `F` the external part, `nu_dot` that of the plant.
    """
    if truth.exact:
        return F
    known = truth.known
    return sub(
        tau,
        add(
            add(matvec(known.M, nu_dot), coriolis(known.M, nu, nu)),
            add(damping(known, nu, nu), restoring(known, attitude)),
        ),
    )
