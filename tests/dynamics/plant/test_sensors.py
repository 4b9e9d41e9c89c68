"""Measurements: seeded, of the stated size, lost as often as stated, repeated when lost."""

import numpy as np
import pytest
from helpers.plants import plant_of, push
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.plant.devices import LOST, SensorNoise, fill_measured
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.vehicle.kinematics import rotation

SPEC = {
    'velocity_noise': [0.1, 0.2, 0.3, 0.01, 0.02, 0.03],
    'attitude_noise': 0.05,
    'drop_out': 0.2,
}
X = initial_state(np.array([1, 2, 3, 0.2, -0.4, 1.5]), np.array([1, 0.5, -0.2, 0.1, 0.2, -0.3]))


def test_the_numbers_do_not_depend_on_how_they_are_asked_for():
    whole = SensorNoise(SPEC, 7).rows(100)
    noise = SensorNoise(SPEC, 7)
    assert_array_equal(np.vstack([noise.rows(n) for n in (1, 9, 40, 50)]), whole)
    assert np.abs(SensorNoise(SPEC, 8).rows(100) - whole).max() > 0.1


def test_the_streams_are_those_of_the_documentation():
    first, second = np.random.SeedSequence(7).spawn(2)
    normals = np.random.Generator(np.random.PCG64(first)).standard_normal((5, 9))
    uniform = np.random.Generator(np.random.PCG64(second)).random(5)
    deviation = np.array([*SPEC['velocity_noise'], 0.05, 0.05, 0.05])
    rows = SensorNoise(SPEC, 7).rows(5)
    noise = normals * deviation
    assert_array_equal(rows[:, :6], noise[:, :6])
    for row, turn in zip(rows, noise[:, 6:], strict=True):
        size = np.linalg.norm(turn)
        expected = [np.cos(size / 2), *(np.sin(size / 2) * turn / size)]
        assert_allclose(row[6:10], expected, rtol=1e-14)  # exp(noise / 2)
    assert_array_equal(rows[:, LOST], (uniform < 0.2) & (np.arange(5) > 0))


def test_size_of_the_noise_and_share_of_lost_samples():
    rows = SensorNoise(SPEC, 1).rows(40_000)
    deviation = np.array([*SPEC['velocity_noise'], 0.025, 0.025, 0.025])
    noise = rows[:, [0, 1, 2, 3, 4, 5, 7, 8, 9]]
    assert_allclose(noise.std(axis=0), deviation, rtol=0.03)
    assert_allclose(noise.mean(axis=0), 0.0, atol=0.02 * deviation.max())
    assert rows[:, LOST].mean() == pytest.approx(0.2, abs=0.01)


def test_what_is_measured():
    turned = np.array([0.3, -0.2, 0.1])
    angle = np.linalg.norm(turned)
    q = [np.cos(angle / 2), *(np.sin(angle / 2) * turned / angle)]
    noise = np.array([0.1, 0.2, 0.3, 0.01, 0.02, 0.03, *q, 0.0])
    measured = np.zeros(13)
    fill_measured(noise, X, measured)
    assert_array_equal(measured[:3], X[:3])
    assert_allclose(measured[7:], X[7:] + noise[:6], rtol=1e-15)
    turn = rotation(X[3:7]).T @ rotation(measured[3:7])
    assert np.trace(turn) == pytest.approx(1 + 2 * np.cos(angle), rel=1e-12)
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    assert_allclose(axis / (2 * np.sin(angle)), turned / angle, rtol=1e-12)  # body axes
    assert np.linalg.norm(measured[3:7]) == pytest.approx(1.0, abs=1e-14)


def test_without_noise_the_truth_is_measured():
    measured = np.zeros(13)
    fill_measured(SensorNoise({}, 1).rows(1)[0], X, measured)
    assert_array_equal(measured, X)


def test_a_lost_sample_repeats_the_last_and_the_first_is_never_lost():
    first, second = SensorNoise({'drop_out': 1.0}, 3).rows(2)
    measured = np.full(13, 5.0)
    fill_measured(second, X, measured)
    assert_array_equal(measured, np.full(13, 5.0))
    fill_measured(first, X, measured)
    assert_array_equal(measured, X)


def test_the_plant_repeats_while_the_truth_goes_on():
    vehicle = load_vehicle('rexrov')
    x = initial_state(np.zeros(6), np.array([0.5, 0, 0, 0, 0, 0.1]))
    noise = SensorNoise({'drop_out': 0.5}, 2)
    lost = SensorNoise({'drop_out': 0.5}, 2).rows(300)[:, LOST] > 0
    plant = plant_of(vehicle, [], 0.01, 'ode5', x, noise=noise)
    last = None
    for k in range(300):
        if lost[k]:
            assert plant.lost
            assert_array_equal(plant.measured, last)
            assert np.abs(plant.measured - plant.x).max() > 0
        else:
            assert not plant.lost
            assert_array_equal(plant.measured, plant.x)
        last = plant.measured.copy()
        push(plant, (10.0, 0, 0, 0, 0, 1.0))
