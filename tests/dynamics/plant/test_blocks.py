"""The plant of the nodes over more steps than are tabulated at once, against one long table."""

import numpy as np
from helpers.plants import plant_of
from numpy.testing import assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.kernel.integrator import TABLEAUS, stage_times
from auv_dynamics.plant.actuators import make_actuators, memory
from auv_dynamics.plant.devices import LOST, SensorNoise, compiled_applied, compiled_measured
from auv_dynamics.plant.plant import (
    BLOCK,
    SIZE,
    compiled_plant_step,
    initial_state,
    lumped_uncertainty,
)
from auv_dynamics.plant.uncertainty import make_uncertainty

VEHICLE = load_vehicle('rexrov')
STEP, STEPS = 0.01, 2 * BLOCK + 5
SPECS = [
    {'kind': 'harmonic', 'surge': {'terms': [{'amplitude': 90.0, 'omega': 2.0, 'phase': 0.3}]}},
    {'kind': 'current', 'velocity': [0.2, 0.1, 0.0],
     'east': {'terms': [{'amplitude': 0.2, 'omega': 0.9}]}},
]  # fmt: skip
SEEN = {'velocity_noise': 0.02, 'attitude_noise': 0.01, 'drop_out': 0.2}
START = initial_state(np.array([1, 2, 3, 0.2, -0.3, 0.4]), np.array([0.3, 0.2, -0.1, 0, 0.1, 0.2]))


def command(k: int) -> tuple:
    return tuple(np.array([300.0, -200.0, 100.0, 20.0, -30.0, 40.0]) * np.sin(0.05 * k + 1.0))


def test_a_plant_goes_through_its_blocks_as_through_one_table():
    chain = make_actuators({'lag': 0.05, 'delay': 0.02}, VEHICLE, STEP, 'f')
    plant = plant_of(
        VEHICLE, SPECS, STEP, 'rk4', START, actuators=chain, noise=SensorNoise(SEEN, 4)
    )
    uncertainty = make_uncertainty(VEHICLE, SPECS, 'f', ['', ''])
    tableau = TABLEAUS['rk4']
    F, current = uncertainty.tables(stage_times(tableau, STEP, 0, STEPS + 1))
    rows = SensorNoise(SEEN, 4).rows(STEPS + 1)
    x, measured, state = START.copy(), START.copy(), memory(chain)
    stages, trial = np.zeros((4, SIZE)), np.zeros(SIZE)
    truth = uncertainty.truth
    for k in range(STEPS + 1):
        compiled_measured(rows[k], x, measured)
        assert plant.k == k
        assert plant.lost == (rows[k, LOST] == 1.0)
        assert_array_equal(plant.x, x)
        assert_array_equal(plant.measured, measured)
        applied = compiled_applied(chain, k, command(k), state)
        lump = lumped_uncertainty(truth, x, applied, F[k], current[k])
        assert_array_equal(plant.answer(command(k)), [applied, lump])
        compiled_plant_step(truth, x, applied, F[k], current[k], STEP, tableau, stages, trial)
        plant.advance()


def test_a_plant_of_the_files_own_coefficients_answers_with_the_explicit_F():
    plant = plant_of(VEHICLE, SPECS[:1], STEP, 'euler', START)
    for k in range(BLOCK + 3):
        applied, F = plant.answer(command(k))
        assert applied == command(k)
        assert_array_equal(F, [90.0 * np.sin(2.0 * (k * STEP) + 0.3), 0, 0, 0, 0, 0])
        assert plant.measured is plant.x
        assert not plant.lost
        plant.advance()


def test_reset_goes_back_to_the_start_but_not_in_time():
    chain = make_actuators({'delay': 0.02}, VEHICLE, STEP, 'f')
    plant = plant_of(VEHICLE, SPECS[:1], STEP, 'rk4', START, actuators=chain)
    for _ in range(5):
        plant.answer(command(7))
        plant.advance()
    plant.reset()
    assert plant.k == 5
    assert_array_equal(plant.x, START)
    assert_array_equal(plant.measured, START)
    applied, F = plant.answer(command(7))
    assert applied == (0.0,) * 6  # the commands under way are gone
    assert F[0] == 90.0 * np.sin(2.0 * (5 * STEP) + 0.3)


def test_without_an_answer_no_wrench_is_applied():
    one, other = (plant_of(VEHICLE, [], STEP, 'rk4', START) for _ in range(2))
    one.advance()
    other.answer((0.0,) * 6)
    other.advance()
    assert_array_equal(one.x, other.x)


def test_a_velocity_that_no_vehicle_has_is_divergence():
    plant = plant_of(VEHICLE, [], STEP, 'rk4', START)
    assert not plant.diverged
    for i in range(6):
        for bad, lost in ((99.9, False), (-99.9, False), (100.0, True), (-100.1, True),
                          (np.nan, True), (np.inf, True)):  # fmt: skip
            plant.reset()
            plant.x[7 + i] = bad
            assert plant.diverged is lost
    plant.reset()
    plant.x[:3] = 1e6  # far away is not fast
    assert not plant.diverged
