"""Vehicles that differ in numbers of one vehicle file, as a `Vehicle` with a leading axis."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_dynamics.vehicle.vehicle import Vehicle, rigid_body_matrix
from auv_dynamics.vehicle.vehicle_file import (
    is_definite,
    is_semidefinite,
    is_symmetric,
    principal_moments,
    satisfies_triangle,
)

Keys = tuple[str | int, ...]


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
    gravity = of('environment', 'gravity')
    result = vehicle.changed(
        M=M,
        D_linear=linear,
        D_quadratic=sign * matrices(of('damping', 'quadratic')),
        lift=sign * matrices(of('lift')) if 'lift' in data else None,
        weight=mass * gravity,
        buoyancy=of('environment', 'water_density') * gravity * of('hydrostatics', 'volume'),
        r_G=r_G,
        r_B=of('hydrostatics', 'center_of_buoyancy'),
        M_RB=M_RB,
        M_A=M_A,
    )
    return result, good & is_definite(M) & is_semidefinite(_symmetric(linear))


def _symmetric(A: np.ndarray) -> np.ndarray:
    return (A + np.swapaxes(A, -2, -1)) / 2
