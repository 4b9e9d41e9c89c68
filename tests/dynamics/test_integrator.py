"""Fixed-step integrators: order of convergence, tableau conditions, times on the grid."""

from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from plants import plant_of, push

from auv_dynamics.integrator import TABLEAUS, fill_step, stage_times
from auv_dynamics.jit import plain
from auv_dynamics.plant import initial_state
from auv_dynamics.vehicle_file import vehicle_from_dict

ORDERS = {'euler': 1, 'rk4': 4, 'ode5': 5}


class Growth(NamedTuple):
    """x_dot = x cos t, so that x = e^(sin t): the rate depends on the time of each stage."""

    t: np.ndarray

    @staticmethod
    def fill_rate(system, stage, x, rate):
        rate[0] = x[0] * np.cos(system.t[stage])


def growth_error(name: str, steps: int) -> float:
    tableau, step = TABLEAUS[name], 2.0 / steps
    times = stage_times(tableau, step, 0, steps)
    x, trial = np.ones(1), np.zeros(1)
    stages = np.zeros((len(tableau.b), 1))
    for k in range(steps):
        plain(fill_step)(Growth(times[k]), x, step, tableau, stages, trial)
    return abs(x[0] - np.exp(np.sin(2.0)))


def fitted_order(counts, errors) -> float:
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


@pytest.mark.parametrize('name', ORDERS)
def test_order_on_an_analytic_solution(name):
    counts = [200, 400, 800, 1600] if name == 'euler' else [20, 40, 80, 160]
    errors = [growth_error(name, steps) for steps in counts]
    assert fitted_order(counts, errors) == pytest.approx(ORDERS[name], abs=0.2)


def sinking(name: str, steps: int) -> float:
    """Error of the compiled plant: m u_dot = X - 3 u|u| - F from rest."""
    vehicle = vehicle_from_dict(
        {
            'name': 'sinking',
            'source': 'none needed',
            'rigid_body': {'mass': 2.0, 'center_of_gravity': [0.0, 0.0, 0.0]},
            'inertia_matrix': (2.0 * np.eye(6)).tolist(),
            'hydrostatics': {'volume': 0.002, 'center_of_buoyancy': [0.0, 0.0, 0.0]},
            'damping': {'linear': [0.0] * 6, 'quadratic': [3.0] + [0.0] * 5},
            'environment': {'water_density': 1000.0, 'gravity': 9.81},
        },
        'sinking.yaml',
    )
    F = [{'kind': 'harmonic', 'surge': {'offset': 2.0}}]
    plant = plant_of(vehicle, F, 1.0 / steps, name, initial_state(np.zeros(6), np.zeros(6)))
    for _ in range(steps):
        push(plant, (14.0, 0, 0, 0, 0, 0))  # 14 - 2 N against 3 u^2: u = 2 tanh(3 t)
    assert plant.k == steps
    return abs(plant.x[7] - 2.0 * np.tanh(3.0)) + abs(plant.x[0] - 2.0 / 3.0 * np.log(np.cosh(3)))


@pytest.mark.parametrize('name', ORDERS)
def test_order_of_the_compiled_plant(name):
    counts = [200, 400, 800, 1600] if name == 'euler' else [20, 40, 80, 160]
    counts = [60, 120, 240] if name == 'ode5' else counts  # fifth order shows late here
    errors = [sinking(name, steps) for steps in counts]
    assert fitted_order(counts, errors) == pytest.approx(ORDERS[name], abs=0.3)


@pytest.mark.parametrize('name', ORDERS)
def test_tableau_conditions(name):
    A, b, c = TABLEAUS[name]
    assert_array_equal(A, np.tril(A, -1))  # explicit
    for power in range(ORDERS[name]):
        assert b @ c**power == pytest.approx(1.0 / (power + 1), rel=1e-14)
    assert_allclose(A.sum(axis=1), c)


def test_ode5_is_dormand_and_prince_without_the_last_stage():
    tableau = TABLEAUS['ode5']
    assert_allclose(tableau.c, [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1], atol=1e-14)
    assert tableau.b.shape == (6,)


def test_times_are_never_accumulated():
    step, last = 0.01, 1_000_000
    accumulated = np.cumsum(np.full(last, step))[-1]
    for name in ORDERS:
        times = stage_times(TABLEAUS[name], step, last, 2)
        assert times.shape == (2, len(TABLEAUS[name].b))
        assert times[0, 0] == last * step
        assert times[1, 0] == (last + 1) * step
        assert_allclose(times[0], (last + TABLEAUS[name].c) * step, rtol=1e-15)
    assert accumulated != last * step  # what the test would miss if times were summed


def test_stage_times_do_not_depend_on_where_a_block_begins():
    tableau = TABLEAUS['ode5']
    whole = stage_times(tableau, 0.01, 0, 600)
    assert_array_equal(stage_times(tableau, 0.01, 256, 40), whole[256:296])
