"""The plant: the vehicle file plus model errors, a current and the explicit F, solved for nu_dot.

Where M_RB and M_A are apart, the forces are written from first principles and without a Coriolis
matrix: Newton and Euler for the body, with its velocity over ground, and Kirchhoff for the water,
with the velocity through it,

    M_RB nu_dot + n_RB(nu) + M_A (nu_r_dot) + n_A(nu_r) + D(nu_r) nu_r + g + F = tau,
    nu_r = nu - nu_c,  nu_c = (R^T v_c, 0),  nu_c_dot = (R^T v_c_dot - omega x R^T v_c, 0).

n_RB(nu) = C_RB(nu) nu and n_A(nu_r) = C_A(nu_r) nu_r for every valid C.  Which parametrisation of
C is taken matters only where its argument and the vector behind it differ, which is nowhere here.

dM has no split between body and water.  It is inertia of the relative velocity, added to M_A.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from reference_signals import current, disturbance, entries, varies
from reference_vehicle import (
    Array,
    cross,
    damping,
    restoring_from_rotation,
    square,
    vehicle_matrices,
)

MODEL_ERRORS = ('mass', 'added_mass', 'damping', 'buoyancy')


def symmetric(value: Any, what: str) -> Array:
    """A 6x6 of a 6 or 6x6; asymmetry above 1e-3 of the largest entry is an error."""
    m = square(value)
    if np.abs(m - m.T).max() > 1e-3 * np.abs(m).max():
        raise ValueError(f'{what} must be symmetric')
    return (m + m.T) / 2


def plant_matrices(vehicle: dict[str, Any], items: list[dict[str, Any]]) -> dict[str, Any]:
    """The matrices of a vehicle file with the sum of the given model errors."""
    mats = vehicle_matrices(vehicle)
    relative = dict.fromkeys(MODEL_ERRORS, 0.0)
    d_m, d_d = np.zeros((6, 6)), np.zeros((6, 6))
    for item in items:
        unknown = set(item) - {'kind', 'dM', 'dD', *MODEL_ERRORS}
        if unknown:
            raise ValueError(f'model_error does not know {sorted(unknown)}')
        for key in MODEL_ERRORS:
            if mats['M_RB'] is None and key != 'buoyancy' and key in item:
                raise ValueError(f'model_error {key!r} is not for a file with inertia_matrix')
            relative[key] += float(item.get(key, 0.0))
        d_m += symmetric(item.get('dM', 0.0), 'dM')
        d_d += square(item.get('dD', 0.0))
    heavier, wetter = 1.0 + relative['mass'], 1.0 + relative['added_mass']
    mats['W'] *= heavier
    mats['B'] *= 1.0 + relative['buoyancy']
    mats['D_linear'] = (1.0 + relative['damping']) * mats['D_linear'] + d_d
    mats['D_quadratic'] = (1.0 + relative['damping']) * mats['D_quadratic']
    mats['lift'] = (1.0 + relative['damping']) * mats['lift']
    if mats['M_RB'] is None:
        mats['M'] = mats['M'] + d_m
    else:
        mats['M_RB'], mats['M_A'] = heavier * mats['M_RB'], wetter * mats['M_A'] + d_m
        mats['M'] = mats['M_RB'] + mats['M_A']
    np.linalg.cholesky(mats['M'])  # LinAlgError (a ValueError) unless positive definite
    return mats


def newton_euler(M_RB: Array, nu: Array) -> Array:
    """n_RB(nu), about the body origin, of a rigid body whose mass matrix is M_RB.

    Force m (omega x v + omega x (omega x r_G)), moment omega x I omega + m r_G x (omega x v).
    """
    m = M_RB.item(0, 0)
    m_r = [M_RB.item(5, 1), M_RB.item(3, 2), M_RB.item(4, 0)]  # lower left block: m S(r_G)
    v, omega = nu[:3].tolist(), nu[3:].tolist()
    turning = cross(omega, v)
    swing = cross(omega, cross(omega, m_r))
    gyro = cross(omega, (M_RB[3:, 3:] @ nu[3:]).tolist())
    lever = cross(m_r, turning)
    force = [m * a + b for a, b in zip(turning, swing, strict=True)]
    return np.array(force + [a + b for a, b in zip(gyro, lever, strict=True)])


def kirchhoff(M: Array, nu: Array) -> Array:
    """n(nu) of any symmetric M: with (a, b) = M nu, force omega x a, moment omega x b + v x a."""
    momentum = (M @ nu).tolist()
    v, omega = nu[:3].tolist(), nu[3:].tolist()
    spin, slip = cross(omega, momentum[3:]), cross(v, momentum[:3])
    moment = [a + b for a, b in zip(spin, slip, strict=True)]
    return np.array(cross(omega, momentum[:3]) + moment)


class Plant:
    """nu_dot of the plant; form 'split' as above, or 'relative' as docs/model.md has it."""

    def __init__(
        self,
        vehicle: dict[str, Any],
        spec: list[dict[str, Any]] | dict[str, Any] | None,
        form: str | None = None,
    ):
        items = entries(spec)
        errors = [item for item in items if item['kind'] == 'model_error']
        self.currents = [item for item in items if item['kind'] == 'current']
        self.explicit = [i for i in items if i['kind'] not in ('model_error', 'current')]
        self.mats = plant_matrices(vehicle, errors)
        split = self.mats['M_RB'] is not None
        if varies(self.currents) and not split:
            raise ValueError('a varying current needs M_RB, inertia_matrix does not give it')
        if varies(self.currents) and any('dM' in item for item in errors):
            raise ValueError('a varying current and dM: the split of dM is not known')
        self.form = form or ('split' if split else 'relative')
        if self.form == 'split' and not split:
            raise ValueError('the split form needs M_RB')
        self.M_inv = np.linalg.inv(self.mats['M'])

    def acceleration(self, t: float, R: Array, nu: Array, tau: Array) -> Array:
        """nu_dot at attitude R (body to NED) and velocity nu over ground, under tau."""
        mats = self.mats
        nu_r, nu_c_dot, wind = nu, np.zeros(6), np.zeros(6)
        if self.currents:
            v_c, v_c_dot = current(self.currents, t)
            nu_c = np.concatenate((R.T @ v_c, np.zeros(3)))
            wind[:3] = R.T @ v_c_dot
            nu_c_dot[:3] = wind[:3] - cross(nu[3:].tolist(), nu_c[:3].tolist())
            nu_r = nu - nu_c
        rest = tau - disturbance(self.explicit, t) - restoring_from_rotation(mats, R)
        rest -= damping(mats, nu_r) @ nu_r
        if self.form == 'split':
            rest -= newton_euler(mats['M_RB'], nu) + kirchhoff(mats['M_A'], nu_r)
            return self.M_inv @ (rest + mats['M_A'] @ nu_c_dot)
        rest -= kirchhoff(mats['M'], nu_r)
        if mats['M_RB'] is not None:
            rest -= mats['M_RB'] @ wind
        return self.M_inv @ rest + nu_c_dot
