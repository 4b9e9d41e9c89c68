"""The GVC law, equations (16) to (21): velocity tracking in generalised velocity components."""

from typing import NamedTuple

import numpy as np

from auv_dynamics.kernel.six import (
    Numbers,
    Vector,
    add,
    matvec,
    scale,
    sub,
    upper,
    upper_T,
    vector,
)
from auv_dynamics.vehicle.model import coriolis, damping, restoring
from auv_gvc_controller.laws.model import ControlModel, Range


class GVC(NamedTuple):
    """Gains, each (36,) row-major: k_D in 1/s, k_I in N/m, Lambda in 1/s, Gamma in 1/s2."""

    k_D: np.ndarray
    k_I: np.ndarray
    Lambda: np.ndarray
    Gamma: np.ndarray

    STATES = 12  # type: ignore[misc]  # no gain, but a constant of the law: z, then the integral of s_xi

    @staticmethod
    def wrench(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'GVC', model: ControlModel,
    ) -> tuple[Numbers, Numbers]:  # fmt: skip
        """(tau, f): the wrench and its adaptive part, N and N m, body frame.

        nu = Upsilon xi; U is Upsilon. The terms of (16) stand in its order, those that share a
        factor U^T, (10) to (12), added before it is applied.

        Equations (16) to (21), and (14) from pi back to tau.
        """
        M, U, U_inv, N = model.dynamics.M, model.Upsilon, model.Upsilon_inv, model.N
        z, S = vector(state, 0), vector(state, 6)
        nu_err = sub(nu_d, nu)  # (17)

        nu_r = add(nu_d, matvec(gains.Lambda, z))
        xi_r = upper(U_inv, nu_r)  # (18)
        s_xi = sub(xi_r, upper(U_inv, nu))  # (19)
        xi_r_dot = upper(U_inv, add(nu_d_dot, matvec(gains.Lambda, nu_err)))  # (20)
        f_xi = scale(N, matvec(gains.Gamma, S))  # (21), integrated

        pi = add(  # (16)
            add(
                scale(N, xi_r_dot),  # N xi_r_dot
                upper_T(
                    U,
                    add(
                        add(
                            coriolis(M, nu, nu_r),  # C_xi xi_r = U^T C(nu) nu_r, (10)
                            damping(model.dynamics, nu, nu_r),  # D_xi xi_r = U^T D(nu) nu_r, (11)
                        ),
                        add(
                            restoring(model.dynamics, attitude),  # g_xi = U^T g, (12)
                            matvec(gains.k_I, z),  # U^T k_I z
                        ),
                    ),
                ),
            ),
            add(
                scale(N, matvec(gains.k_D, s_xi)),  # N k_D s_xi
                f_xi,
            ),
        )
        return upper_T(U_inv, pi), upper_T(U_inv, f_xi)  # (14)

    @staticmethod
    def state_rate(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'GVC', model: ControlModel,
    ) -> Vector:  # fmt: skip
        """Twelve rates: z_dot = nu_err (17), then s_xi (19), which (21) integrates."""
        nu_err = sub(nu_d, nu)
        z = vector(state, 0)
        s_xi = upper(model.Upsilon_inv, add(nu_err, matvec(gains.Lambda, z)))
        return nu_err + s_xi

    @staticmethod
    def body_gains(gains: 'GVC', model: ControlModel) -> tuple[np.ndarray, np.ndarray]:
        """(K_D, K_f) = (U^-T N k_D U^-1, U^-T N Gamma U^-1), (6, 6): step 1 of section 4.2."""
        U_inv, N = model.Upsilon_inv.reshape(6, 6), np.diag(model.N)
        k_D, Gamma = gains.k_D.reshape(6, 6), gains.Gamma.reshape(6, 6)
        return U_inv.T @ N @ k_D @ U_inv, U_inv.T @ N @ Gamma @ U_inv

    @staticmethod
    def search(step: float) -> dict[str, Range]:
        """Bounds of each gain for a control period in s: no rate is searched above 1/step."""
        fastest = 1 / step
        return {
            'k_D': Range(False, 0.05, fastest), 'k_I': Range(True, 1e-3, fastest**2),
            'Lambda': Range(False, 0.01, fastest), 'Gamma': Range(False, 1e-3, fastest**2),
        }  # fmt: skip
