"""What the inertia of one vehicle couples, and what damping couples beside it."""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from auv_analysis.atlas.measures import (
    coupling_strength,
    inertial_correlation,
    input_shares,
    velocity_shares,
)
from auv_analysis.coupling import NEGLIGIBLE, structural_zeros
from auv_dynamics.signals import DOFS
from auv_dynamics.vehicle import Vehicle
from auv_gvc_controller.decomposition import decompose, inverse_upper

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Couplings:
    """Couplings of a vehicle by its inertia.

    Attributes
    ----------
    name, source : of the vehicle
    M, Upsilon, Upsilon_inv : (6, 6)
    N : (6,) kg, kg m2
    correlation : (6, 6) of `inertial_correlation`; what is rounding is zero
    velocity_shares, input_shares : (6, 6), in 0..1
    strength : of `coupling_strength`
    zeros : 'delta_xi' and 'delta_pi' -> degrees of freedom that vanish for every motion
    damped : pairs that damping or lift couples

    """

    name: str
    source: str
    M: np.ndarray
    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray
    correlation: np.ndarray
    velocity_shares: np.ndarray
    input_shares: np.ndarray
    strength: float
    zeros: dict[str, list[str]]
    damped: list[Pair]

    @property
    def is_diagonal(self) -> bool:
        """Whether nothing is coupled by inertia: Upsilon = I."""
        return not self.pairs

    @property
    def pairs(self) -> list[Pair]:
        """Pairs that inertia couples, the strongest first."""
        found = [(i, j) for i, j in combinations(range(6), 2) if self.correlation[i, j] != 0.0]
        found.sort(key=lambda pair: -abs(self.correlation[pair]))
        return [(DOFS[i], DOFS[j]) for i, j in found]

    @property
    def largest(self) -> float:
        """Largest magnitude of the inertial correlation of two degrees of freedom."""
        return float(np.abs(np.triu(self.correlation, 1)).max())

    def as_dict(self) -> dict[str, Any]:
        """All of it, ready for JSON; shares in %."""
        return {
            'source': self.source,
            'diagonal': self.is_diagonal,
            'strength_percent': 100 * self.strength,
            'largest_correlation_percent': 100 * self.largest,
            'pair_count': len(self.pairs),
            'pairs': [list(pair) for pair in self.pairs],
            'M': self.M.tolist(),
            'N': self.N.tolist(),
            'Upsilon': self.Upsilon.tolist(),
            'Upsilon_inv': self.Upsilon_inv.tolist(),
            'correlation': self.correlation.tolist(),
            'velocity_shares_percent': (100 * self.velocity_shares).tolist(),
            'input_shares_percent': (100 * self.input_shares).tolist(),
            'structural_zeros': self.zeros,
            'damping_pairs': [list(pair) for pair in self.damped],
        }


def couplings_of(vehicle: Vehicle, name: str) -> Couplings:
    """Couplings of a vehicle under a name."""
    Upsilon, N = decompose(vehicle.M)
    inverse = inverse_upper(Upsilon)
    correlation = _without_rounding(inertial_correlation(vehicle.M))
    diagonal = not np.triu(correlation, 1).any()
    return Couplings(
        name=name,
        source=vehicle.source or '',
        M=vehicle.M,
        Upsilon=Upsilon,
        Upsilon_inv=inverse,
        N=N,
        correlation=correlation,
        velocity_shares=_without_rounding(velocity_shares(vehicle.M), NEGLIGIBLE**2),
        input_shares=_without_rounding(input_shares(vehicle.M), NEGLIGIBLE**2),
        strength=0.0 if diagonal else coupling_strength(vehicle.M),
        zeros=structural_zeros(Upsilon, inverse),
        damped=_damped(vehicle),
    )


def _without_rounding(A: np.ndarray, below: float = NEGLIGIBLE) -> np.ndarray:
    return np.where(np.abs(A) <= below, 0.0, A)


def _damped(vehicle: Vehicle) -> list[Pair]:
    size = np.abs(vehicle.D_linear) + np.abs(vehicle.D_quadratic)
    if vehicle.lift is not None:
        size += np.abs(vehicle.lift)
    both = size + size.T
    return [(DOFS[i], DOFS[j]) for i, j in combinations(range(6), 2) if both[i, j] > 0.0]
