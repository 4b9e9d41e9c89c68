"""Parts of the plant that a good integrator hides: renormalisation, and which stage F is of."""

import numpy as np
import pytest
from helpers.plants import plant_of
from numpy.testing import assert_allclose

from auv_dynamics import load_vehicle
from auv_dynamics.kernel.compile import plain
from auv_dynamics.plant.plant import fill_unit_attitude, initial_state

VEHICLE = load_vehicle('rexrov')
START = initial_state(np.array([1, 2, 3, 0.2, -0.3, 0.4]), np.array([0.3, 0.2, -0.1, 0, 0.1, 0.2]))
WAVES = {
    dof: {'offset': 5.0 + i, 'terms': [{'amplitude': 90.0, 'omega': 20.0, 'phase': 0.3 + i}]}
    for i, dof in enumerate(('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw'))
}
STEADY = {'kind': 'current', 'velocity': [0.2, 0.1, 0.0]}


def test_only_the_attitude_is_renormalised():
    x = np.arange(1.0, 14.0)
    expected = x.copy()
    expected[3:7] = np.array([4.0, 5.0, 6.0, 7.0]) / np.sqrt(16.0 + 25.0 + 36.0 + 49.0)
    plain(fill_unit_attitude)(x)
    assert_allclose(x, expected, rtol=1e-15)


@pytest.mark.parametrize('integrator', ['euler', 'rk4', 'ode5'])
def test_F_is_that_of_the_sample_and_not_of_a_later_stage(integrator):
    """In a current F is what it does, plus d(t_k): the difference is the explicit part."""
    waves = {'kind': 'harmonic', **WAVES}
    plants = [
        plant_of(VEHICLE, specs, 0.05, integrator, START) for specs in ([STEADY, waves], [STEADY])
    ]
    for k in range(3):
        for plant in plants:
            plant.x[:] = START
        with_waves, without = (np.array(plant.answer((10.0,) * 6)[1]) for plant in plants)
        t = 0.05 * k
        d = [5.0 + i + 90.0 * np.sin(20.0 * t + 0.3 + i) for i in range(6)]
        assert_allclose(with_waves - without, d, atol=1e-9)
        assert np.abs(without).max() > 1.0
        for plant in plants:
            plant.advance()
