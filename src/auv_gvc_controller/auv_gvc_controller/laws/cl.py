"""The classical law CL, equation (29): the same law without N and Upsilon in the gains."""

from typing import NamedTuple

import numpy as np

from auv_dynamics.kernel.six import (
    Numbers,
    Vector,
    add,
    matvec,
    sub,
    vector,
)
from auv_dynamics.vehicle.model import coriolis, damping, restoring
from auv_gvc_controller.laws.model import ControlModel, Range


class CL(NamedTuple):
    """Gains, each (36,) row-major: k_D in N s/m, k_I in N/m, Lambda in 1/s, Gamma in N/m."""

    k_D: np.ndarray
    k_I: np.ndarray
    Lambda: np.ndarray
    Gamma: np.ndarray

    STATES = 12  # type: ignore[misc]  # no gain, but a constant of the law: z, then the integral of s

    @staticmethod
    def wrench(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'CL', model: ControlModel,
    ) -> tuple[Numbers, Numbers]:  # fmt: skip
        """(tau, f): the wrench and its adaptive part, N and N m, body frame; equation (29)."""
        M = model.dynamics.M
        z, S = vector(state, 0), vector(state, 6)
        nu_err = sub(nu_d, nu)
        nu_r = add(nu_d, matvec(gains.Lambda, z))
        nu_r_dot = add(nu_d_dot, matvec(gains.Lambda, nu_err))
        s = sub(nu_r, nu)
        f = matvec(gains.Gamma, S)

        tau = add(  # (29)
            add(
                add(matvec(M, nu_r_dot), coriolis(M, nu, nu_r)),
                add(damping(model.dynamics, nu, nu_r), restoring(model.dynamics, attitude)),
            ),
            add(add(matvec(gains.k_D, s), matvec(gains.k_I, z)), f),
        )
        return tau, f

    @staticmethod
    def state_rate(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'CL', model: ControlModel,
    ) -> Vector:  # fmt: skip
        """Twelve rates: z_dot = nu_err, then s = nu_err + Lambda z, which f integrates."""
        nu_err = sub(nu_d, nu)
        return nu_err + add(nu_err, matvec(gains.Lambda, vector(state, 0)))

    @staticmethod
    def search(step: float) -> dict[str, Range]:
        """Bounds of each gain for a control period in s: no rate is searched above 1/step."""
        fastest = 1 / step
        return {
            'k_D': Range(True, 0.05, fastest), 'k_I': Range(True, 1e-3, fastest**2),
            'Lambda': Range(False, 0.01, fastest), 'Gamma': Range(True, 1e-3, fastest**2),
        }  # fmt: skip
