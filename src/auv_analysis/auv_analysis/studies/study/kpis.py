"""The KPIs that a study follows, and why some of them have no sensitivity."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from auv_analysis.metrics.coupling import structural_zeros
from auv_analysis.metrics.quantities import Quantity, quantity
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws.model import control_model

SIX = (
    'velocity_error.rms', 'velocity_error.max_after_2s', 'velocity_error.settling_time',
    'effort.rms', 'effort.max', 'lumped_error.rms', 'lumped_error.max_after_2s',
    'coupling.delta_xi_max', 'coupling.delta_pi_max', 'kinetic_energy.shares_percent',
)  # fmt: skip
TOTAL = 'kinetic_energy.mean'
ROUNDING = 1e-9  # of the largest of its kind, and of a relative change: below it is no signal


@dataclass(frozen=True)
class Kpi:
    """One number of a run.

    Attributes
    ----------
    name : key of `summary.json`, such as 'velocity_error.rms'
    dof : its degree of freedom; 'all' of the total energy

    """

    name: str
    dof: str

    @property
    def column(self) -> str:
        """Column of `rollouts`."""
        return self.name if self.dof == 'all' else f'{self.name}.{self.dof}'

    @property
    def quantity(self) -> Quantity:
        """What it is."""
        return quantity(self.column)


@dataclass(frozen=True)
class Excluded:
    """A KPI that has no sensitivity, and why."""

    kpi: Kpi
    reason: str


KPIS = (*(Kpi(name, dof) for name in SIX for dof in DOFS), Kpi(TOTAL, 'all'))


def sort_out(found: Mapping[str, np.ndarray], vehicle: Vehicle) -> tuple[list[Kpi], list[Excluded]]:
    """KPIs whose logarithm is defined and changes, and the others with the reason.

    Parameters
    ----------
    found : columns of `rollouts` (n,) that are all 'ok'
    vehicle : whose structure makes couplings vanish

    """
    model = control_model(vehicle)
    Upsilon, Upsilon_inv = (m.reshape(6, 6) for m in (model.Upsilon, model.Upsilon_inv))
    zeros = structural_zeros(Upsilon, Upsilon_inv)
    kept, excluded = [], []
    for kpi in KPIS:
        reason = _structural(kpi, zeros) or _reason(kpi, found)
        if reason:
            excluded.append(Excluded(kpi, reason))
        else:
            kept.append(kpi)
    return kept, excluded


def _structural(kpi: Kpi, zeros: Mapping[str, list[str]]) -> str:
    for kind, dofs in zeros.items():
        if kpi.name == f'coupling.{kind}_max' and kpi.dof in dofs:
            return 'zero for every motion by the structure of M'
    return ''


def _reason(kpi: Kpi, found: Mapping[str, np.ndarray]) -> str:
    """Why a KPI cannot be followed; empty where it can."""
    values = np.asarray(found[kpi.column], float)
    missing, zero = np.isnan(values), values == 0.0
    lacks = 'does not settle' if 'settling' in kpi.name else 'does not exist'
    for what, where in ((lacks, missing), ('zero', zero)):
        if where.all():
            return f'{what} in any rollout' if where is missing else 'zero throughout'
        if where.any():
            return f'{what} in {where.sum()} of {len(values)} rollouts'
    if values.max() <= ROUNDING * _largest_of_kind(kpi, found):
        return 'rounding: below 1e-9 of the largest of its kind'
    return 'the same whatever the gains' if np.ptp(np.log(values)) <= ROUNDING else ''


def _largest_of_kind(kpi: Kpi, found: Mapping[str, np.ndarray]) -> float:
    if kpi.dof == 'all':
        return 0.0
    i = DOFS.index(kpi.dof)
    alike = range(3) if i < 3 else range(3, 6)
    return max(float(np.nanmax(found[f'{kpi.name}.{DOFS[j]}'], initial=0.0)) for j in alike)
