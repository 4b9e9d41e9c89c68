"""PID on the velocity error with feed-forward of the model: the baseline to compare with."""

from typing import Any, NamedTuple

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


class PID(NamedTuple):
    """Gains, each (36,) row-major: k_P in N s/m, k_I in N/m, k_D in kg; two more have defaults.

    omega_f in rad/s is the cut-off of the derivative's first-order filter (Astrom & Hagglund 2006,
    section 3.3); k_FF scales the feed-forward of the model at the set-point, 0: off.
    """

    k_P: np.ndarray
    k_I: np.ndarray
    k_D: np.ndarray
    omega_f: Any = 20.0
    k_FF: Any = 1.0

    STATES = 12  # type: ignore[misc]  # no gain, but a constant of the law: z, then the filter's x
    INTEGRALS = 6  # type: ignore[misc]  # only z: the filter is no integral

    @staticmethod
    def wrench(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'PID', model: ControlModel,
    ) -> tuple[Numbers, Numbers]:  # fmt: skip
        """(tau, 0): the wrench in N and N m, body frame; there is no adaptive part."""
        M = model.dynamics.M
        z, x = vector(state, 0), vector(state, 6)
        nu_err = sub(nu_d, nu)
        d = matvec(gains.omega_f, sub(nu_err, x))  # nu_err_dot behind the filter
        feed_forward = add(
            matvec(M, nu_d_dot),
            add(coriolis(M, nu_d, nu_d), damping(model.dynamics, nu_d, nu_d)),
        )
        tau = add(
            add(restoring(model.dynamics, attitude), matvec(gains.k_FF, feed_forward)),
            add(matvec(gains.k_P, nu_err), add(matvec(gains.k_I, z), matvec(gains.k_D, d))),
        )
        return tau, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @staticmethod
    def state_rate(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'PID', model: ControlModel,
    ) -> Vector:  # fmt: skip
        """Twelve rates: z_dot = nu_err, then x_dot = omega_f (nu_err - x)."""
        nu_err = sub(nu_d, nu)
        return nu_err + matvec(gains.omega_f, sub(nu_err, vector(state, 6)))

    @staticmethod
    def body_gains(gains: 'PID', model: ControlModel) -> tuple[np.ndarray, np.ndarray]:
        """(K_D, K_f) (6, 6): what multiplies a fast velocity error, and no adaptation."""
        k_P, k_D, omega_f = (np.reshape(K, (6, 6)) for K in (gains.k_P, gains.k_D, gains.omega_f))
        return k_P + k_D @ omega_f, np.zeros((6, 6))

    @staticmethod
    def own_rate(gains: 'PID') -> float:
        """Cut-off of the fastest filter, 1/s."""
        return np.abs(np.linalg.eigvals(np.reshape(gains.omega_f, (6, 6)))).max()

    @staticmethod
    def check(gains: 'PID') -> None:
        """Raise ValueError for a filter that is not stable."""
        smallest = np.linalg.eigvals(np.reshape(gains.omega_f, (6, 6))).real.min()
        if not smallest > 0:
            text = f'smallest real part of its eigenvalues {smallest:g}'
            raise ValueError(f'omega_f: expected a positive cut-off (rad/s), found {text}')

    @staticmethod
    def search(step: float) -> dict[str, Range]:
        """Bounds of each gain for a control period in s: no rate is searched above 1/step."""
        fastest = 1 / step
        return {  # k_FF stays 1: the other laws have no share of the feed-forward to choose either
            'k_P': Range(True, 0.05, fastest), 'k_I': Range(True, 1e-3, fastest**2),
            'k_D': Range(True, 1e-3, 3.0), 'omega_f': Range(False, 0.01 * fastest, fastest),
        }  # fmt: skip
