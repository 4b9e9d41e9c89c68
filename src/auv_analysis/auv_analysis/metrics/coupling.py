"""Inertial couplings: deformation of each degree of freedom by the others, (31) to (34)."""

from typing import Any

import numpy as np

from auv_analysis.metrics.energy import (
    NEGLIGIBLE,
    depends_on_known,
    kinetic_energy,
    mapped,
    shares,
)
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws.model import decompose, inverse_upper


def velocity_deformation(Upsilon_inv: np.ndarray) -> np.ndarray:
    """Matrix (6, 6) from nu to delta_xi, (33)."""
    return Upsilon_inv - np.eye(6)


def input_deformation(Upsilon: np.ndarray) -> np.ndarray:
    """Matrix (6, 6) from tau to delta_pi, (34)."""
    return (Upsilon - np.eye(6)).T


def delta_xi(Upsilon_inv: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Xi - nu, (33): nu (..., 6) in m/s, rad/s to (..., 6) in the same units."""
    return mapped(velocity_deformation(Upsilon_inv), nu)


def delta_pi(Upsilon: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Pi - tau with pi = Upsilon^T tau, (34): tau (..., 6) in N, N m to (..., 6)."""
    return mapped(input_deformation(Upsilon), tau)


def structural_zeros(Upsilon: np.ndarray) -> dict[str, list[str]]:
    """Degrees of freedom whose delta_xi or delta_pi vanishes for every motion.

    Row i of Upsilon^-1 - I gives delta_xi_i, column i of Upsilon - I gives delta_pi_i. That row is
    zero where row i of Upsilon - I is: Upsilon is unit upper triangular.
    """
    deformation = np.abs(input_deformation(Upsilon))

    def empty(size: np.ndarray) -> list[str]:
        return [dof for dof, entry in zip(DOFS, size, strict=True) if entry <= NEGLIGIBLE]

    return {
        'delta_xi': empty(deformation.max(axis=0)),
        'delta_pi': empty(deformation.max(axis=1)),
    }


class Products:
    """Sums of products of six signals, gathered over blocks of samples.

    Attributes
    ----------
    known : (6,) whether each signal is known; one that is NaN throughout is not

    """

    def __init__(self) -> None:
        self.count = 0
        self.known = np.ones(6, bool)
        self.sums = np.zeros((6, 6))
        self.peaks = np.zeros(6)

    @np.errstate(over='ignore', invalid='ignore')  # what overflows is null in a summary
    def add(self, signals: np.ndarray) -> None:
        """Add the next samples (n, 6)."""
        self.count += len(signals)
        self.known = ~np.isnan(signals[:1]).any(axis=0)
        signals = signals if self.known.all() else np.where(self.known, signals, 0.0)
        self.sums += signals.T @ signals
        np.maximum(self.peaks, np.abs(signals).max(axis=0, initial=0.0), out=self.peaks)

    @property
    def means(self) -> np.ndarray:
        """Mean products (6, 6): the squares of the root mean squares on the diagonal."""
        return self.sums / max(self.count, 1)

    @property
    def rms(self) -> list[float]:
        """Root mean squares of the six signals."""
        return np.where(self.known, np.sqrt(np.diagonal(self.means)), np.nan).tolist()

    @property
    def largest(self) -> list[float]:
        """Largest magnitudes of the six signals."""
        return np.where(self.known, self.peaks, np.nan).tolist()


@np.errstate(over='ignore', invalid='ignore')
def coupling_terms(weights: np.ndarray, products: Products) -> list[dict[str, Any]]:
    """Pieces of (31) or (32) in figures: which degree of freedom deforms which other, and how much.

    Parameters
    ----------
    weights : (6, 6) of `velocity_deformation` or `input_deformation`
    products : of the signals that they are applied to, nu or tau

    Returns
    -------
    terms : a dict for each entry that is no structural zero: `to` and `from`, the `coefficient`,
        the `rms` and `max` of the piece in the unit of the component `to`, and `share_percent`,
        its part of the mean square of the deformation. The shares of one component add to 100 %;
        one is negative where the piece takes away from what the others add. None: nothing moves,
        or a signal that it needs is not known.

    """
    mean, rms, largest = products.means, products.rms, products.largest
    whole = depends_on_known(weights, products.known)
    along = weights @ mean  # (6, 6): mean of deformation i times signal j
    squares = (along * weights).sum(axis=1)
    found = []
    for i, j in zip(*np.nonzero(np.abs(weights) > NEGLIGIBLE), strict=True):
        weight, part = weights[i, j], weights[i, j] * along[i, j]
        share = float(100.0 * part / squares[i]) if whole[i] and squares[i] > 0 else None
        found.append({
            'to': DOFS[i],
            'from': DOFS[j],
            'coefficient': float(weight),
            'rms': float(abs(weight) * rms[j]),
            'max': float(abs(weight) * largest[j]),
            'share_percent': share,
        })  # fmt: skip
    return found


class LiveAnalysis:
    """Analyses samples of one vehicle: (6,) in, (6,) out, body frame and SI.

    Attributes
    ----------
    structural_zeros : degrees of freedom whose delta_xi or delta_pi vanishes for every motion

    """

    def __init__(self, vehicle: Vehicle):
        self._Upsilon, self._N = decompose(vehicle.M)
        self._Upsilon_inv = inverse_upper(self._Upsilon)
        self.structural_zeros = structural_zeros(self._Upsilon)

    def energy(self, nu: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Kinetic energy by component in J and its shares in %, (30)."""
        components = kinetic_energy(self._Upsilon_inv, self._N, np.array(nu))
        return components, shares(components)

    def delta_xi(self, nu: tuple[float, ...]) -> np.ndarray:
        """Xi - nu, (33)."""
        return delta_xi(self._Upsilon_inv, np.array(nu))

    def delta_pi(self, tau: tuple[float, ...]) -> np.ndarray:
        """Pi - tau, (34)."""
        return delta_pi(self._Upsilon, np.array(tau))
