"""Power balance along integrated runs: d/dt (kinetic + potential) = nu' (tau - F - D nu)."""

from collections.abc import Callable

import herman_reference as reference
import numpy as np
import pytest
import yaml
from helpers.physics import drive, energy, vehicle_of
from helpers.strategies import QUICK, attitudes, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose

from auv_dynamics.files.shipped import shipped
from auv_dynamics.plant.plant import initial_state

BOOLE = np.array([14.0, 32.0, 12.0, 32.0]) * 2 / 45  # of order 6, one above ode5
STEP, STEPS = 0.00125, 800  # the stiffest of vehicles() loses spin in some 20 ms


def swell(mass: float) -> tuple[list[dict], Callable]:
    """F of a size that goes with the mass: as a scenario gives it, and as a function of t (n,)."""
    force, couple = 0.3 * mass, 0.1 * mass
    sway = {'offset': force, 'terms': [{'amplitude': force, 'omega': 3.0}]}
    specs = [
        {'kind': 'harmonic', 'sway': sway},
        {'kind': 'harmonic', 'yaw': {'offset': couple, 'terms': []}},
    ]

    def F(t: np.ndarray) -> np.ndarray:
        values = np.zeros((len(t), 6))
        values[:, 1], values[:, 5] = force * (1.0 + np.sin(3.0 * t)), couple
        return values

    return specs, F


def integral(values: np.ndarray, step: float) -> float:
    """Boole's rule over samples 0, 4, 8, ... and those between; their number less 1 is 4 n."""
    n = (len(values) - 1) // 4
    assert len(values) == 4 * n + 1
    weights = np.append(np.tile(BOOLE, n), BOOLE[0])
    weights[[0, -1]] /= 2
    return step * float(weights @ values)


def test_the_rule_is_exact_for_polynomials_of_degree_five():
    t = np.linspace(0.0, 2.0, 41)
    for degree in range(6):
        expected = 2.0 ** (degree + 1) / (degree + 1)
        assert integral(t**degree, 0.05) == pytest.approx(expected, rel=1e-14)


def powers(data: dict, nu: np.ndarray, tau: np.ndarray, F: np.ndarray) -> dict[str, np.ndarray]:
    """Power that each term of (1) brings in along a run, W."""
    m = reference.vehicle_matrices(data)
    drag = np.array([reference.damping(m, row) @ row for row in nu])
    return {
        'tau': nu @ tau,
        'F': -np.sum(nu * F, axis=1),
        'D': -np.sum(nu * drag, axis=1),
    }


def check_balance(data: dict, eta, nu, push, accuracy: float) -> None:
    mass = data['rigid_body']['mass']
    tau, (specs, F) = mass * push, swell(mass)
    start = initial_state(eta, nu)
    x = drive(vehicle_of(data), start, tau=tau, F=specs, step=STEP, steps=STEPS)
    brought = powers(data, x[:, 7:], tau, F(STEP * np.arange(STEPS + 1)))
    gained = energy(data, x[-1]) - energy(data, x[0])
    total = integral(sum(brought.values()), STEP)
    scale = sum(integral(np.abs(power), STEP) for power in brought.values())
    scale += np.ptp(energy(data, x)) + 1e-3 * data['rigid_body']['mass']
    assert gained == pytest.approx(total, abs=accuracy * scale)
    for name, power in brought.items():  # none is so small that its sign would not matter
        if np.abs(power).max() > 1.0:
            assert integral(np.abs(power), STEP) > 100 * accuracy * scale, name


@QUICK
@given(vehicles(), attitudes(), vectors(largest=1.0), vectors(largest=1.0))
def test_power_balance_with_linear_damping(data, eta, nu, push):
    data['damping']['quadratic'] = [0.0] * 6
    data.pop('lift', None)
    check_balance(data, eta, nu, push, accuracy=1e-6)


@QUICK
@given(vehicles(), attitudes(), vectors(largest=1.0), vectors(largest=1.0))
def test_power_balance_with_quadratic_damping_and_lift(data, eta, nu, push):
    # less accurate: where a velocity changes its sign, abs(nu) has a kink inside a step
    check_balance(data, eta, nu, push, accuracy=1e-5)


@pytest.mark.parametrize('name', ['herman2018', 'rexrov'])
def test_power_balance_of_shipped_vehicles(name):
    data = yaml.safe_load(shipped('vehicles', name).read_text(encoding='utf-8'))
    push = np.array([0.5, -0.15, 0.25, 0.04, -0.06, 0.1])
    nu = np.array([0.5, -0.4, 0.3, 0.1, -0.2, 0.3])
    check_balance(data, np.zeros(6), nu, push, accuracy=1e-8)


@QUICK
@given(vehicles(heavy_water=True), vectors(largest=1.0), attitudes())
def test_without_damping_and_wrench_energy_is_kept(data, nu, eta):
    data['damping'] = {'linear': [0.0] * 6, 'quadratic': [0.0] * 6}
    data.pop('lift', None)
    x = drive(vehicle_of(data), initial_state(eta, nu), step=STEP, steps=STEPS)
    assert np.abs(x[-1] - x[0]).max() > 0.0
    kept = energy(data, x)
    scale = np.abs(kept).max() + data['rigid_body']['mass']
    assert_allclose(kept, kept[0], rtol=0, atol=1e-8 * scale)


@QUICK
@given(vehicles(), vectors(largest=1.0), attitudes())
def test_without_wrench_energy_never_grows(data, nu, eta):
    x = drive(vehicle_of(data), initial_state(eta, nu), step=STEP, steps=STEPS)
    left = energy(data, x)
    assert np.diff(left).max() <= 1e-9 * (np.abs(left).max() + data['rigid_body']['mass'])
    if np.abs(nu).max() > 0.1:
        assert left[-1] < left[0]
