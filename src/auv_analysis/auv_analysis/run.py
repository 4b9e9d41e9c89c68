"""A run: what was simulated or recorded, as arrays."""

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from auv_dynamics.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class Run:
    """One closed loop from start to end, n + 1 samples.

    Attributes
    ----------
    t : (n + 1,) s
    eta : (n + 1, 6) position in m (NED), ZYX Euler angles in rad, psi unwrapped
    nu : (n + 1, 6) body velocity, m/s and rad/s
    nu_d, nu_d_dot : (n + 1, 6) set-point and its derivative
    tau : (n + 1, 6) commanded wrench, N and N m, body frame
    disturbance : (n + 1, 6) lumped uncertainty F of (1), or None where it is not known
    disturbance_estimate : (n + 1, 6) f of the law
    vehicle : what the controller knows
    scenario : name of the scenario
    controller, law : name of the controller and of its law
    gains : the law's gains as the scenario gives them
    step : control period, s
    source : 'simulate' or 'bag'
    hold : 'continuous' or 'zoh': whether the wrench was held between the samples
    measured : (n + 1, 6) velocity that the law saw; None: the true one
    applied : (n + 1, 6) wrench that the actuators delivered; None: the command
    law_state : (n + 1, m) the law's integrals, None where they are not known
    kinds : kinds of the disturbances, None where they are not known
    notes : what is worth saying about the run, one line each

    """

    t: np.ndarray
    eta: np.ndarray
    nu: np.ndarray
    nu_d: np.ndarray
    nu_d_dot: np.ndarray
    tau: np.ndarray
    disturbance: np.ndarray | None
    disturbance_estimate: np.ndarray
    vehicle: Vehicle
    scenario: str
    controller: str
    law: str
    gains: dict[str, Any]
    step: float
    source: str
    hold: str = 'zoh'
    measured: np.ndarray | None = None
    applied: np.ndarray | None = None
    law_state: np.ndarray | None = None
    kinds: frozenset[str] | None = None
    notes: tuple[str, ...] = field(default=())

    def part(self, keep: Any) -> 'Run':
        """Run of the samples that an index, slice or mask of samples keeps."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return replace(self, **{k: v[keep] for k, v in values.items() if isinstance(v, np.ndarray)})

    @property
    def nu_measured(self) -> np.ndarray:
        """(n + 1, 6) velocity that the law saw, m/s and rad/s."""
        return self.nu if self.measured is None else self.measured

    @property
    def tau_applied(self) -> np.ndarray:
        """(n + 1, 6) wrench that the actuators delivered, N and N m."""
        return self.tau if self.applied is None else self.applied

    @property
    def duration(self) -> float:
        """Length of the run, s."""
        return float(self.t[-1] - self.t[0])
