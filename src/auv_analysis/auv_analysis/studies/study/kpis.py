"""The figures that a study follows: groups, words, units, and which of them are left out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from auv_analysis.metrics.coupling import structural_zeros
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_gvc_controller.laws.model import control_model

Group = Literal['velocity error', 'input', 'estimation error', 'coupling', 'kinetic energy']
VELOCITY, WRENCH = ('m/s', 'rad/s'), ('N', 'N m')
KINDS: dict[str, tuple[Group, str, tuple[str, str]]] = {
    'velocity_error.rms': ('velocity error', 'RMS velocity error', VELOCITY),
    'velocity_error.max_after_2s': (
        'velocity error', 'largest velocity error after 2 s', VELOCITY,
    ),
    'velocity_error.settling_time': ('velocity error', 'settling time', ('s', 's')),
    'effort.rms': ('input', 'RMS input', WRENCH),
    'effort.max': ('input', 'largest input', WRENCH),
    'lumped_error.rms': ('estimation error', 'RMS estimation error w', WRENCH),
    'lumped_error.max_after_2s': (
        'estimation error', 'largest estimation error w after 2 s', WRENCH,
    ),
    'coupling.delta_xi_max': ('coupling', 'largest velocity deformation Δξ', VELOCITY),
    'coupling.delta_pi_max': ('coupling', 'largest input deformation Δπ', WRENCH),
    'kinetic_energy.shares_percent': ('kinetic energy', 'share of kinetic energy', ('%', '%')),
}  # fmt: skip
TOTAL = 'kinetic_energy.mean'
ROUNDING = 1e-9  # of the largest of its kind, and of a relative change: below it is no signal


@dataclass(frozen=True)
class Figure:
    """One number of a run.

    Attributes
    ----------
    name : key of `summary.json`, such as 'velocity_error.rms'
    dof : its degree of freedom; 'all' of the total energy
    group : what kind of quantity it is
    words : what it is
    unit : m/s, rad/s, N, N m, s, J or %

    """

    name: str
    dof: str
    group: Group
    words: str
    unit: str

    @property
    def column(self) -> str:
        """Column of `rollouts`."""
        return self.name if self.dof == 'all' else f'{self.name}.{self.dof}'

    @property
    def label(self) -> str:
        """Words with the degree of freedom."""
        return self.words if self.dof == 'all' else f'{self.words}, {self.dof}'

    @property
    def short(self) -> str:
        """The same in fewer words."""
        return SHORT[self.name] if self.dof == 'all' else f'{SHORT[self.name]}, {self.dof}'


SHORT = {  # for heads of rows
    'velocity_error.rms': 'RMS error',
    'velocity_error.max_after_2s': 'error after 2 s',
    'velocity_error.settling_time': 'settling time',
    'effort.rms': 'RMS input',
    'effort.max': 'largest input',
    'lumped_error.rms': 'RMS w',
    'lumped_error.max_after_2s': 'w after 2 s',
    'coupling.delta_xi_max': 'largest Δξ',
    'coupling.delta_pi_max': 'largest Δπ',
    'kinetic_energy.shares_percent': 'energy share',
    TOTAL: 'mean energy',
}


@dataclass(frozen=True)
class Excluded:
    """A figure that has no sensitivity, and why."""

    figure: Figure
    reason: str


def all_figures() -> list[Figure]:
    """Every figure that is looked at."""
    six = [
        Figure(name, dof, group, words, units[i // 3])
        for name, (group, words, units) in KINDS.items()
        for i, dof in enumerate(DOFS)
    ]
    return [*six, Figure(TOTAL, 'all', 'kinetic energy', 'mean kinetic energy', 'J')]


def sort_out(
    found: Mapping[str, np.ndarray], vehicle: Vehicle
) -> tuple[list[Figure], list[Excluded]]:
    """Figures whose logarithm is defined and changes, and the others with the reason.

    Parameters
    ----------
    found : columns of `rollouts` (n,) that are all 'ok'
    vehicle : whose structure makes couplings vanish

    """
    model = control_model(vehicle)
    Upsilon, Upsilon_inv = (m.reshape(6, 6) for m in (model.Upsilon, model.Upsilon_inv))
    zeros = structural_zeros(Upsilon, Upsilon_inv)
    kept, excluded = [], []
    for figure in all_figures():
        reason = _structural(figure, zeros) or _reason(figure, found)
        if reason:
            excluded.append(Excluded(figure, reason))
        else:
            kept.append(figure)
    return kept, excluded


def _structural(figure: Figure, zeros: Mapping[str, list[str]]) -> str:
    for kind, dofs in zeros.items():
        if figure.name == f'coupling.{kind}_max' and figure.dof in dofs:
            return 'zero for every motion by the structure of M'
    return ''


def _reason(figure: Figure, found: Mapping[str, np.ndarray]) -> str:
    """Why a figure cannot be followed; empty where it can."""
    values = np.asarray(found[figure.column], float)
    missing, zero = np.isnan(values), values == 0.0
    lacks = 'does not settle' if 'settling' in figure.name else 'does not exist'
    for what, where in ((lacks, missing), ('zero', zero)):
        if where.all():
            return f'{what} in any rollout' if where is missing else 'zero throughout'
        if where.any():
            return f'{what} in {where.sum()} of {len(values)} rollouts'
    if values.max() <= ROUNDING * _largest_of_kind(figure, found):
        return 'rounding: below 1e-9 of the largest of its kind'
    return 'the same whatever the gains' if np.ptp(np.log(values)) <= ROUNDING else ''


def _largest_of_kind(figure: Figure, found: Mapping[str, np.ndarray]) -> float:
    if figure.dof == 'all':
        return 0.0
    i = DOFS.index(figure.dof)
    alike = range(3) if i < 3 else range(3, 6)
    return max(float(np.nanmax(found[f'{figure.name}.{DOFS[j]}'], initial=0.0)) for j in alike)
