"""Quantities by the names of their columns: unit, symbol and label of each component."""

import pytest

from auv_analysis.metrics.quantities import (
    HALVES,
    METRICS,
    SIGNALS,
    Quantity,
    gain_mathtext,
    mathtext,
    quantity,
)
from auv_dynamics.vehicle import DOFS

SPEED, FORCE = ('m/s', 'rad/s'), ('N', 'N m')
UNITS = {
    'kinetic_energy.mean': ('J', 'J'), 'kinetic_energy.mean_by_component': ('J', 'J'),
    'kinetic_energy.shares_percent': ('%', '%'), 'velocity_error.rms': SPEED,
    'velocity_error.max_after_2s': SPEED, 'velocity_error.settling_time': ('s', 's'),
    'lumped_error.rms': FORCE, 'lumped_error.max_after_2s': FORCE,
    'coupling.delta_xi_max': SPEED, 'coupling.delta_pi_max': FORCE, 'effort.rms': FORCE,
    'effort.max': FORCE,
}  # fmt: skip


@pytest.mark.parametrize('name', METRICS)
def test_every_component_of_a_metric_has_the_unit_of_its_half(name: str) -> None:
    for unit, (half, dofs) in zip(UNITS[name], HALVES.items(), strict=True):
        assert {quantity(f'{name}.{dof}').unit for dof in dofs} == {unit}
        assert quantity(f'overall.{name}.{half}').unit == unit
    assert METRICS[name].units == UNITS[name]


def test_a_component_has_its_own_symbol_and_a_half_that_of_the_whole() -> None:
    for i, dof in enumerate(DOFS):
        found = quantity(f'coupling.delta_pi_max.{dof}')
        assert (found.symbol, found.label, found.components) == (f'Δπ_{i + 1}', f'Δπ, {dof}', ())
    for half in HALVES:
        found = quantity(f'overall.coupling.delta_pi_max.{half}')
        assert (found.symbol, found.label) == ('Δπ', f'Δπ, {half}')
    assert quantity('effort.rms.yaw').symbol == ''


def test_a_unit_is_found_by_the_place_and_by_the_word() -> None:
    tau = SIGNALS['tau']
    assert [tau.unit_of(i) for i in (0, 2, 3, 5)] == ['N', 'N', 'N m', 'N m']
    assert [tau.unit_of(dof) for dof in ('heave', 'roll')] == ['N', 'N m']
    assert SIGNALS['energy'].unit_of('yaw') == 'J'


def test_a_name_that_is_no_metric_is_its_own_label() -> None:
    for name in ('no such column', 'effort.rms.bow', 'effort.surge'):
        assert quantity(name) == Quantity('', '', name)


def test_symbols_are_set_for_plots() -> None:
    assert mathtext('Δξ_1') == r'$\Delta \xi_{1}$'
    assert mathtext('omega_f') == r'$\omega_{f}$'
    assert SIGNALS['tau'].axis([0, 2]) == r'$\tau_{X}$, $\tau_{Z}$ (N)'
    assert SIGNALS['error'].axis([5]) == r'$\Delta r$ (rad/s)'


def test_a_gain_of_a_users_law_stays_as_it_is_written() -> None:
    assert gain_mathtext('k_D') == '$k_{D}$'
    assert gain_mathtext('Lambda') == r'$\Lambda$'
    assert gain_mathtext('k_own') == 'k_own'
