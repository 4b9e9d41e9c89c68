"""What sensors do that are given no numbers, and the first sample of those that lose all."""

import numpy as np
import pytest
from helpers.plants import plant_of
from numpy.testing import assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.plant.devices import WIDTH, SensorNoise
from auv_dynamics.plant.plant import initial_state

PERFECT = np.eye(WIDTH)[6]  # no noise, no rotation, nothing lost
START = initial_state(np.zeros(6), np.array([0.3, 0.2, -0.1, 0, 0.1, 0.2]))


def test_no_numbers_mean_perfect_sensors():
    assert_array_equal(SensorNoise({}, 1).rows(500), np.tile(PERFECT, (500, 1)))


@pytest.mark.parametrize('given', ['velocity_noise', 'attitude_noise'])
def test_one_kind_of_noise_alone(given):
    rows = SensorNoise({given: 0.5}, 1).rows(500)
    noisy = np.zeros(WIDTH, bool)
    noisy[{'velocity_noise': slice(0, 6), 'attitude_noise': slice(6, 10)}[given]] = True
    assert_array_equal((rows != PERFECT).any(axis=0), noisy)


def test_sensors_that_lose_everything_keep_the_first_sample():
    noise = SensorNoise({'velocity_noise': 0.1, 'drop_out': 1.0}, 1)
    plant = plant_of(load_vehicle('rexrov'), [], 0.01, 'rk4', START, noise=noise)
    first = plant.measured.copy()
    assert not plant.lost
    for _ in range(3):
        plant.advance()
        assert plant.lost
        assert_array_equal(plant.measured, first)
