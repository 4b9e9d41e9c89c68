"""The twelve couplings of a vehicle by name, and how large each is in a run, free of units."""

from typing import NamedTuple

import numpy as np

from auv_analysis.metrics.coupling import delta_pi, delta_xi, structural_zeros
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws.model import control_model, decompose, inverse_upper

KINDS = ('delta_xi', 'delta_pi')
COUPLINGS = tuple(f'{kind}.{dof}' for kind in KINDS for dof in DOFS)
UNITS = dict(zip(COUPLINGS, ('m/s',) * 3 + ('rad/s',) * 3 + ('N',) * 3 + ('N m',) * 3, strict=True))
REST = 1e-12  # a share below this is rounding


class Sizes(NamedTuple):
    """How large the couplings and the effort of a run are.

    Attributes
    ----------
    peaks : (12,) largest magnitudes of delta_xi and delta_pi: m/s, rad/s; N, N m
    shares : (12,) free of units, see `shares_of`
    effort : mean of tau^T M^-1 tau with M of the unchanged vehicle, N m/s2 (W/s)

    """

    peaks: np.ndarray
    shares: np.ndarray
    effort: float

    @property
    def by_effort(self) -> float:
        """What an effort is divided by: inf, so that it does not count, where there was none."""
        return self.effort if self.effort > 0 else np.inf


def sizes_of(run: Run, M_inv: np.ndarray) -> Sizes:
    """Sizes of the couplings of a run; M_inv (6, 6) weighs the effort."""
    model = control_model(run.vehicle)
    Upsilon, inverse = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    xi, pi = delta_xi(inverse, run.nu), delta_pi(Upsilon, run.tau)
    peaks = np.concatenate([np.abs(xi).max(axis=0), np.abs(pi).max(axis=0)])
    even = np.full(len(run.t), 1 / len(run.t))
    shares = shares_of(xi, pi, model.N, run.nu @ inverse.T, run.tau @ Upsilon, even)
    return Sizes(peaks, shares, float(effort_of(run.tau, M_inv, even)))


def shares_of(
    xi_deformed: np.ndarray,
    pi_deformed: np.ndarray,
    N: np.ndarray,
    xi: np.ndarray,
    pi: np.ndarray,
    weights: np.ndarray,
) -> np.ndarray:
    """Couplings in proportion to the whole motion, free of units.

    A velocity weighs by the kinetic energy, sum of N_i xi_i^2 = nu^T M nu, an input by its dual,
    sum of pi_i^2 / N_i = tau^T M^-1 tau, which has the same N and Upsilon. So metres and radians
    can be compared, and a deformed velocity with a deformed input:
    sqrt(mean(N_i delta_xi_i^2) / mean(nu^T M nu)), sqrt(mean(delta_pi_i^2 / N_i) / mean(...)).

    Parameters
    ----------
    xi_deformed, pi_deformed : (..., n, 6) delta_xi, (33), and delta_pi, (34)
    N : (..., 6)
    xi, pi : (..., n, 6) generalised velocities and inputs
    weights : (n,) of the samples in a mean

    Returns
    -------
    shares : (..., 12) zero where nothing moves

    """
    energies = N * (weights @ xi_deformed**2), (weights @ pi_deformed**2) / N
    wholes = (N * (weights @ xi**2)).sum(-1), ((weights @ pi**2) / N).sum(-1)
    halves = [
        part / (whole + (whole == 0))[..., None]
        for part, whole in zip(energies, wholes, strict=True)
    ]
    return np.sqrt(np.concatenate(halves, axis=-1))


def effort_of(tau: np.ndarray, M_inv: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Mean of tau^T M^-1 tau: tau (..., n, 6) and weights (n,) to (...)."""
    return ((tau @ M_inv) * tau).sum(axis=-1) @ weights


def present(vehicle: Vehicle) -> list[str]:
    """Couplings that the structure of a vehicle's M allows, by name."""
    Upsilon, _ = decompose(vehicle.M)
    zeros = structural_zeros(Upsilon, inverse_upper(Upsilon))
    return [name for name in COUPLINGS if name.split('.')[1] not in zeros[name.split('.')[0]]]


def coupling_named(text: str, there: list[str]) -> str:
    """Name of a coupling as a user types it: `delta_xi.sway`, `delta_xi_max.sway`.

    Raises
    ------
    InputError : it is none of the twelve

    """
    name = text.replace('_max.', '.')
    if name not in COUPLINGS:
        expected = one_of(name, there) if there else 'such as delta_xi.sway'
        raise InputError('--reduce', '', expected, text)
    return name
