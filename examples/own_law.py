"""A law of your own: feedback linearisation with a PI on the velocity error."""

from typing import NamedTuple

import numpy as np

from auv_dynamics.vehicle.model import coriolis, damping, restoring


class ComputedTorque(NamedTuple):
    """Gains come from the scenario as (36,) arrays, row-major."""

    k_P: np.ndarray  # 1/s
    k_I: np.ndarray  # 1/s2

    STATES = 6  # z, the integral of the velocity error

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        """Tau = M (nu_d_dot + k_P nu_err + k_I z) + C(nu) nu + D(nu) nu + g(eta)."""
        vehicle = model.dynamics
        nu_err = np.array(nu_d) - np.array(nu)
        k_P, k_I = gains.k_P.reshape(6, 6), gains.k_I.reshape(6, 6)
        tau = vehicle.M.reshape(6, 6) @ (np.array(nu_d_dot) + k_P @ nu_err + k_I @ state)
        tau += np.array(coriolis(vehicle.M, nu, nu))
        tau += np.array(damping(vehicle, nu, nu))
        tau += np.array(restoring(vehicle, attitude))
        return tau, np.zeros(6)  # the wrench, and its adaptive part

    @staticmethod
    def state_rate(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        """z_dot = nu_err."""
        return np.array(nu_d) - np.array(nu)
