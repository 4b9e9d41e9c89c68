"""Adaptive sliding mode without chattering, after Soylu, Buckham & Podhorodeski 2008."""

from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import clip
from auv_dynamics.kernel.six import (
    Numbers,
    Six,
    Vector,
    add,
    matvec,
    sub,
    vector,
)
from auv_dynamics.vehicle.model import coriolis, damping, restoring
from auv_gvc_controller.laws.model import ControlModel, Range


class SMC(NamedTuple):
    """Gains, each (36,) row-major: k_D in N s/m, Lambda in 1/s, Gamma in N/m; two have defaults.

    k_S in N and N m switches inside the boundary layer phi (diagonal, m/s and rad/s; Slotine & Li
    1991, section 7.2); 0 leaves the adaptive term of Soylu et al. alone.
    """

    k_D: np.ndarray
    Lambda: np.ndarray
    Gamma: np.ndarray
    k_S: Any = 0.0
    phi: Any = 0.1

    STATES = 18  # type: ignore[misc]  # no gain, but a constant of the law: z, its integral, that of s

    @staticmethod
    def wrench(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'SMC', model: ControlModel,
    ) -> tuple[Numbers, Numbers]:  # fmt: skip
        """(tau, f): the wrench and its adaptive part, N and N m, body frame."""
        M = model.dynamics.M
        z = vector(state, 0)
        nu_err = sub(nu_d, nu)
        s = manifold(nu_err, state, gains)
        nu_r = add(nu, s)
        twice = matvec(gains.Lambda, add(nu_err, nu_err))
        nu_r_dot = add(nu_d_dot, add(twice, matvec(gains.Lambda, matvec(gains.Lambda, z))))
        f = matvec(gains.Gamma, vector(state, 12))
        equivalent = add(
            add(matvec(M, nu_r_dot), coriolis(M, nu, nu_r)),
            add(damping(model.dynamics, nu, nu_r), restoring(model.dynamics, attitude)),
        )
        switched = matvec(gains.k_S, saturated(s, gains.phi))
        return add(add(equivalent, matvec(gains.k_D, s)), add(switched, f)), f

    @staticmethod
    def state_rate(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'SMC', model: ControlModel,
    ) -> Vector:  # fmt: skip
        """Eighteen rates: z_dot = nu_err, z, and s, which f integrates."""
        nu_err = sub(nu_d, nu)
        return nu_err + vector(state, 0) + manifold(nu_err, state, gains)

    @staticmethod
    def body_gains(gains: 'SMC', model: ControlModel) -> tuple[np.ndarray, np.ndarray]:
        """(K_D, K_f) (6, 6): what multiplies s, steepest inside the layer, and its integral."""
        k_D, k_S, phi, Gamma = (
            np.reshape(K, (6, 6)) for K in (gains.k_D, gains.k_S, gains.phi, gains.Gamma)
        )
        return k_D + k_S / np.diagonal(phi), Gamma

    @staticmethod
    def check(gains: 'SMC') -> None:
        """Raise ValueError for a boundary layer that is no positive diagonal."""
        phi = np.reshape(gains.phi, (6, 6))
        if np.any(phi != np.diag(np.diagonal(phi))) or not np.all(np.diagonal(phi) > 0):
            found = (
                f'smallest {np.diagonal(phi).min():g}'
                if np.all(phi == phi * np.eye(6))
                else 'a full matrix'
            )
            raise ValueError(f'phi: expected a positive number or 6 of them, found {found}')
        with np.errstate(over='ignore'):
            steepest = np.reshape(gains.k_S, (6, 6)) / np.diagonal(phi)
        if not np.all(np.isfinite(steepest)):
            found = f'smallest {np.diagonal(phi).min():g}'
            raise ValueError(f'phi: expected a width by which k_S is finite, found {found}')

    @staticmethod
    def search(step: float) -> dict[str, Range]:
        """Bounds of each gain for a control period in s: no rate is searched above 1/step."""
        fastest = 1 / step
        return {
            'k_D': Range(True, 0.05, fastest), 'Lambda': Range(False, 0.01, fastest),
            'Gamma': Range(True, 1e-3, fastest**2),
            'k_S': Range(True, 1e-3, 10.0), 'phi': Range(False, 1e-3, 1.0),
        }  # fmt: skip


@helper
def manifold(nu_err: Vector, state: Vector, gains: SMC) -> Six:
    """S = (d/dt + Lambda)^2 of the integral of z: nu_err + 2 Lambda z + Lambda^2 integral(z)."""
    z, Z = vector(state, 0), vector(state, 6)
    return add(nu_err, matvec(gains.Lambda, add(add(z, z), matvec(gains.Lambda, Z))))


@helper
def saturated(s: Vector, phi: np.ndarray) -> Six:
    """sat(s / phi) by component, phi (36,) a diagonal."""
    return (
        clip(s[0] / phi[0], -1.0, 1.0),
        clip(s[1] / phi[7], -1.0, 1.0),
        clip(s[2] / phi[14], -1.0, 1.0),
        clip(s[3] / phi[21], -1.0, 1.0),
        clip(s[4] / phi[28], -1.0, 1.0),
        clip(s[5] / phi[35], -1.0, 1.0),
    )
