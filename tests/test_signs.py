"""Every sign of every formula, turned one at a time in its source, is noticed."""

import importlib
from collections.abc import Callable, Collection
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers import sign_flips
from helpers.sign_checks import (
    check_algebra,
    check_C,
    check_couple,
    check_D,
    check_F,
    check_frames,
    check_g,
    check_inverse,
    check_J,
    check_M,
    check_step,
    check_U,
    published_vehicle,
)
from helpers.sign_checks_loop import (
    check_current,
    check_law,
    check_multisine,
    check_other_law,
    check_uncertainty,
)

from auv_dynamics.kernel.compile import plain
from auv_gvc_controller.laws.law import SHIPPED


@dataclass(frozen=True)
class Formula:
    """A symbol, where it is written, and what knows better."""

    symbol: str
    module: str
    names: Collection[str]
    check: Callable[[Any], None]
    least: int  # signs in it today: a formula that moves must take its check along


MODEL = 'auv_dynamics.vehicle.model'
FORMULAS = [
    Formula('C', MODEL, ['coriolis'], lambda m: check_C(plain(m.coriolis)), 12),
    Formula(
        'D', MODEL, ['damping', '_with_lift'],
        lambda m: check_D(plain(m.damping)), 2,
    ),
    Formula(
        'g', MODEL, ['down', 'restoring'], lambda m: check_g(plain(m.restoring)), 10
    ),
    Formula(
        'W - B', 'auv_dynamics.vehicle.vehicle', ['Vehicle.model'],
        lambda m: check_couple(published_vehicle(m.Vehicle)), 2,
    ),
    Formula('M', 'auv_dynamics.vehicle.vehicle', ['skew', 'rigid_body_matrix'], check_M, 5),
    Formula(
        'J', 'auv_dynamics.vehicle.kinematics',
        ['_first', 'quaternion', 'rotation', 'euler', 'jacobian', 'position_rate', 'attitude_rate'],
        check_J, 52,
    ),
    Formula(
        'U', 'auv_gvc_controller.laws.model', ['decompose', 'inverse_upper'], check_U, 7
    ),
    Formula(
        'U x', 'auv_dynamics.kernel.six',
        ['vector', 'fill_vector', 'add', 'sub', 'dot', 'upper', 'upper_T'], check_algebra, 62,
    ),
    Formula(
        'F', MODEL, ['acceleration'], lambda m: check_F(plain(m.acceleration)), 4
    ),
    Formula(
        'F inverse', 'auv_dynamics.vehicle.vehicle', ['Vehicle.inverse_dynamics'],
        lambda m: check_inverse(published_vehicle(m.Vehicle)), 4,
    ),
    Formula(
        'f gvc', 'auv_gvc_controller.laws.gvc', ['GVC.wrench', 'GVC.state_rate'],
        lambda m: check_law('gvc', m.GVC), 13,
    ),
    Formula(
        'f cl', 'auv_gvc_controller.laws.cl', ['CL.wrench', 'CL.state_rate'],
        lambda m: check_law('cl', m.CL), 13,
    ),
    Formula(
        'f pid', 'auv_gvc_controller.laws.pid', ['PID.wrench', 'PID.state_rate'],
        lambda m: check_other_law('pid', m.PID), 11,
    ),
    Formula(
        'f smc', 'auv_gvc_controller.laws.smc',
        ['SMC.wrench', 'SMC.state_rate', 'manifold', 'saturated'],
        lambda m: check_other_law('smc', m.SMC), 23,
    ),
    Formula(
        'f multisine', 'auv_gvc_controller.laws.multisine', ['_axis', 'MULTISINE.wrench'],
        lambda m: check_multisine(m.MULTISINE), 3,
    ),
    Formula(
        'F current', 'auv_dynamics.plant.uncertainty',
        ['make_current', 'to_body', 'true_acceleration'], check_current, 18,
    ),
    Formula(
        'F lumped', 'auv_dynamics.plant.uncertainty', ['with_errors', 'lumped'],
        check_uncertainty, 11
    ),
    Formula(
        'step', 'auv_dynamics.kernel.integrator',
        ['TABLEAUS', 'fill_step', 'fill_sum', 'stage_times'], check_step, 10,
    ),
    Formula(
        'frames', 'auv_dynamics.vehicle.frames',
        ['_S', '_checked', 'swap_position', 'swap_attitude', 'swap_state', 'swap_body',
         'swap_body_matrix', 'swap_inertia'],
        check_frames, 12,
    ),
]  # fmt: skip
EACH = pytest.mark.parametrize('formula', FORMULAS, ids=lambda f: f.symbol)


@EACH
def test_the_code_passes_its_check(formula: Formula) -> None:
    formula.check(importlib.import_module(formula.module))
    formula.check(sign_flips.as_written(formula.module))


def notices(check: Callable[[Any], None], variant: SimpleNamespace) -> bool:
    """Whether a check fails; an index, shape or type that does not fit is noticed by itself."""
    try:
        with np.errstate(all='ignore'):
            check(variant)
    except (AssertionError, pytest.fail.Exception, LookupError, TypeError, ValueError):
        return True
    return False


def survivors(formula: Formula, check: Callable[[Any], None]) -> list[str]:
    """Signs that a check lets through when they are turned, by module, line and column."""
    variants = list(sign_flips.with_one_flipped(formula.module, formula.names))
    assert len(variants) >= formula.least
    return [place for place, variant in variants if not notices(check, variant)]


@EACH
def test_every_flipped_sign_is_noticed(formula: Formula) -> None:
    unnoticed = '\n'.join(survivors(formula, formula.check))
    assert not unnoticed, f'signs that may be turned without notice:\n{unnoticed}'


def test_no_shipped_law_is_left_out() -> None:
    assert {f'f {law}' for law in SHIPPED} <= {formula.symbol for formula in FORMULAS}


def test_a_check_that_looks_at_less_lets_signs_through() -> None:
    def one_entry(m: Any) -> None:
        C_15 = m.coriolis(np.eye(6).ravel(), (0, 0, 1.0, 0, 0, 0), (0, 0, 0, 0, 1.0, 0))[0]
        assert C_15 == 1.0

    formula = FORMULAS[0]
    assert len(survivors(formula, lambda m: None)) == formula.least
    through = survivors(formula, one_entry)
    assert len(through) == formula.least
    assert all(place.startswith('auv_dynamics.vehicle.model:') for place in through)
    assert any(place.endswith('a0 * x[5] - a2 * x[3]') for place in through)
