"""Energy and couplings of single samples, from the functions that analyse whole runs."""

import numpy as np

from auv_analysis.metrics.coupling import delta_pi, delta_xi, structural_zeros
from auv_analysis.metrics.energy import kinetic_energy, shares
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws.decomposition import decompose, inverse_upper


class LiveAnalysis:
    """Analyses samples of one vehicle: (6,) in, (6,) out, body frame and SI.

    Attributes
    ----------
    structural_zeros : degrees of freedom whose delta_xi or delta_pi vanishes for every motion

    """

    def __init__(self, vehicle: Vehicle):
        self._Upsilon, self._N = decompose(vehicle.M)
        self._Upsilon_inv = inverse_upper(self._Upsilon)
        self.structural_zeros = structural_zeros(self._Upsilon, self._Upsilon_inv)

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
