"""Order of convergence of whole runs: of the plant, of the closed loop, and of the two holds.

What is fitted everywhere: the slope of log(error) over log(step) by least squares, over at least
four steps that are small enough for the leading term and large enough to stand above rounding.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml
from helpers.physics import body, drive, vehicle_of

from auv_analysis import load_scenario, simulate
from auv_dynamics.files.shipped import shipped
from auv_dynamics.kernel.compile import plain
from auv_dynamics.kernel.integrator import TABLEAUS, fill_step, stage_times
from auv_dynamics.plant.plant import initial_state

ORDERS = {'euler': 1, 'rk4': 4, 'ode5': 5}
LAWS = {
    'gvc': {'law': 'gvc', 'k_D': 2.0, 'k_I': 100.0, 'Lambda': 0.5, 'Gamma': 1.0},
    'cl': {'law': 'cl', 'k_D': 3000.0, 'k_I': 100.0, 'Lambda': 0.5, 'Gamma': 1000.0},
}
HELD = ('ode5', 'rk4')  # the methods whose order is high enough to be lowered


def fitted_order(counts: list[int], errors: list[float]) -> float:
    assert len(counts) == len(errors) >= 4
    assert min(errors) > 3e-13  # above rounding
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


# The method and the plant alone, against analytic solutions.


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


@pytest.mark.parametrize('name', ORDERS)
def test_order_of_the_method(name):
    counts = [200, 400, 800, 1600] if name == 'euler' else [20, 28, 40, 56, 80]
    errors = [growth_error(name, steps) for steps in counts]
    assert fitted_order(counts, errors) == pytest.approx(ORDERS[name], abs=0.2)


def surging(mass: float, drag: float):
    """A body that surges against drag u abs(u)."""
    quadratic = {'linear': [0.0] * 6, 'quadratic': [drag] + [0.0] * 5}
    return vehicle_of(body(inertia_matrix=(mass * np.eye(6)).tolist(), damping=quadratic))


def speed(t: float, crossing: float) -> float:
    """u of 2 u_dot = 12 - 3 u abs(u): u = 0 at `crossing`, before it a tan, after it a tanh."""
    x = 3.0 * (t - crossing)
    return 2.0 * (np.tanh(x) if x > 0 else np.tan(x))


def plant_error(name: str, steps: int, crossing: float) -> float:
    """Error of u after 0.5 s; the wrench is 14 N and F takes 2 N of it."""
    start = initial_state(np.zeros(6), np.array([speed(0.0, crossing), 0, 0, 0, 0, 0]))
    F = [{'kind': 'harmonic', 'surge': {'offset': 2.0}}]
    x = drive(
        surging(2.0, 3.0), start, tau=[14.0, 0, 0, 0, 0, 0], F=F,
        step=0.5 / steps, steps=steps, integrator=name,
    )  # fmt: skip
    return abs(x[-1, 7] - speed(0.5, crossing))


@pytest.mark.parametrize('name', ORDERS)
def test_order_of_the_plant(name):
    counts = [200, 400, 800, 1600] if name == 'euler' else [32, 40, 50, 64, 80]
    errors = [plant_error(name, steps, crossing=-0.1) for steps in counts]
    assert fitted_order(counts, errors) == pytest.approx(ORDERS[name], abs=0.2)


def typical(errors: Any) -> float:
    """Root mean square over crossing times: the error depends on where in a step one falls."""
    return float(np.sqrt(np.mean(np.square(list(errors)))))


@pytest.mark.parametrize('name', HELD)
def test_a_sign_change_of_the_velocity_lowers_the_order_of_the_plant_to_3(name):
    # u abs(u) has a kink in its slope: the third derivative of u jumps, and the step with the
    # jump leaves an error of its third power
    counts, crossings = [20, 32, 50, 80, 125], 0.2 + 0.0618 * np.arange(1, 17) / 16
    errors = [typical(plant_error(name, n, c) for c in crossings) for n in counts]
    assert fitted_order(counts, errors) == pytest.approx(3.0, abs=0.3)


# The closed loop.


def scenario_of(folder, vehicle: dict, **entries: Any):
    (folder / 'vehicle.yaml').write_text(yaml.safe_dump(vehicle), encoding='utf-8')
    data = {'name': 'run', 'vehicle': 'vehicle.yaml', 'step': 0.01, 'setpoint': {}, **entries}
    (folder / 'run.yaml').write_text(yaml.safe_dump(data), encoding='utf-8')
    return load_scenario(folder / 'run.yaml')


def at_the_end(scenario, steps: int, integrator: str, hold: Any = 'continuous') -> np.ndarray:
    """Eta and nu (12,) at the end of the scenario's only controller, in so many steps."""
    changed = {'step': scenario.duration / steps, 'integrator': integrator}
    run = simulate(replace(scenario, data=scenario.data | changed), *scenario.controllers, hold)
    return np.concatenate([run.eta[-1], run.nu[-1]])


def rexrov(folder, law: str):
    """A dense inertia that turns, dives and is disturbed, with linear damping only."""
    vehicle = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
    vehicle['damping']['quadratic'] = [0.0] * 6
    return scenario_of(
        folder,
        vehicle,
        duration=2.0,
        controllers={law: LAWS[law]},
        setpoint={
            'surge': {'offset': 0.5, 'terms': [{'amplitude': 0.3, 'omega': 1.0}]},
            'yaw': {'terms': [{'amplitude': 0.2, 'omega': 1.5}]},
        },
        disturbance={'kind': 'harmonic', 'sway': {'terms': [{'amplitude': 50.0, 'omega': 2.0}]}},
        initial={'eta': [0, 0, 0, 0.2, -0.3, 0.5], 'nu': [0.3, 0.2, -0.2, 0.1, 0.15, -0.1]},
    )


@pytest.mark.parametrize('name', ORDERS)
@pytest.mark.parametrize('law', LAWS)
def test_order_of_the_closed_loop(tmp_path, law, name):
    scenario = rexrov(tmp_path, law)
    exact = at_the_end(scenario, 8000, 'ode5')  # its own error is rounding
    counts = [200, 400, 800, 1600] if name == 'euler' else [32, 40, 50, 64, 80]
    errors = [np.abs(at_the_end(scenario, n, name) - exact).max() for n in counts]
    assert fitted_order(counts, errors) == pytest.approx(ORDERS[name], abs=0.25)


@pytest.mark.parametrize('law', LAWS)
def test_zero_order_hold_tends_to_continuous_at_first_order(tmp_path, law):
    scenario = rexrov(tmp_path, law)
    exact = at_the_end(scenario, 8000, 'ode5')
    counts = [100, 200, 400, 800, 1600]
    errors = [np.abs(at_the_end(scenario, n, 'ode5', 'zoh') - exact).max() for n in counts]
    assert fitted_order(counts, errors) == pytest.approx(1.0, abs=0.1)


# m e_dot + (k abs(u) + k_D) e = 0 with u = u_d - e: (22) where only k_D is not zero, and N = m
MASS, DRAG, K_D, GOAL = 2.0, 30.0, 5.0, 0.6


def error_of_speed(t: float, e: float) -> float:
    """Solution e(t) > 0 from e: 1/e is linear on either side of u = 0."""
    y = 1.0 / e
    for sign, end in ((-1.0, 1.0 / GOAL), (1.0, np.inf)):  # u < 0 until e = u_d, then u > 0
        rate, shift = (K_D + sign * DRAG * GOAL) / MASS, sign * DRAG / (K_D + sign * DRAG * GOAL)
        if y >= end:
            continue
        until = np.log((end - shift) / (y - shift)) / rate if np.isfinite(end) else np.inf
        y = shift + (y - shift) * np.exp(rate * min(t, until))
        t -= min(t, until)
    return 1.0 / y


def loop_error(scenario, steps: int, name: str, start: float) -> float:
    """Error of u after 0.5 s from u = start."""
    initial = {'initial': {'eta': [0.0] * 6, 'nu': [start, 0, 0, 0, 0, 0]}}
    scenario = replace(scenario, data=scenario.data | initial)
    u = at_the_end(scenario, steps, name)[6]
    return abs(u - (GOAL - error_of_speed(0.5, GOAL - start)))


def surging_loop(folder, law: str):
    quadratic = {'linear': [0.0] * 6, 'quadratic': [DRAG] + [0.0] * 5}
    gain = {'gvc': K_D / MASS, 'cl': K_D}[law]
    gains = {'law': law, 'k_D': gain, 'k_I': 0.0, 'Lambda': 0.0, 'Gamma': 0.0}
    return scenario_of(
        folder,
        body(inertia_matrix=(MASS * np.eye(6)).tolist(), damping=quadratic),
        duration=0.5,
        controllers={law: gains},
        setpoint={'surge': {'offset': GOAL}},
    )


@pytest.mark.parametrize('name', HELD)
@pytest.mark.parametrize('law', LAWS)
def test_without_a_sign_change_quadratic_damping_keeps_the_order(tmp_path, law, name):
    scenario, counts = surging_loop(tmp_path, law), [32, 40, 50, 64, 80]
    errors = [loop_error(scenario, n, name, 0.1) for n in counts]
    assert fitted_order(counts, errors) == pytest.approx(ORDERS[name], abs=0.25)


@pytest.mark.parametrize('name', HELD)
@pytest.mark.parametrize('law', LAWS)
def test_a_sign_change_of_the_velocity_lowers_the_order_of_the_loop_to_2(tmp_path, law, name):
    # the law holds D(nu) nu_r with nu_r not zero where nu is: abs(nu) itself has the kink, the
    # second derivative of nu jumps, and the step with the jump leaves an error of its square
    scenario, counts = surging_loop(tmp_path, law), [20, 32, 50, 80, 125, 200]
    starts = -0.3 - 0.1 * np.arange(16) / 16
    errors = [typical(loop_error(scenario, n, name, u) for u in starts) for n in counts]
    assert 1.7 < fitted_order(counts, errors) < 2.4
