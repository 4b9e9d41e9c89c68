"""Faults tabulated step by step: times, delays, losses, efficiencies, random streams."""

import numpy as np
import pytest
from helpers.plants import plant_of, push
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.actuators import make_actuators
from auv_dynamics.plant.devices import LOST, SensorNoise
from auv_dynamics.plant.faults import (
    AGE,
    AXES,
    END,
    HELD,
    THRUSTERS,
    WRENCH,
    ZEROED,
    FaultRows,
    Faults,
    FaultSetting,
    make_faults,
)
from auv_dynamics.plant.plant import initial_state

H = 0.01
HEAVY = load_vehicle('bluerov2_heavy')


def faults(*specs: dict) -> Faults:
    places = [f'faults[{i}]' for i in range(len(specs))]
    setting = FaultSetting(H, 10.0, HEAVY.thrusters, True, HEAVY.name, 'scenario.yaml')
    return make_faults(specs, places, setting)


def rows(*specs: dict, count: int = 40, seed: int = 3) -> np.ndarray:
    return FaultRows(faults(*specs), seed).rows(count)


@pytest.mark.parametrize(
    ('begin', 'end', 'steps'),
    [(0.05, 0.08, [5, 6, 7]), (0.051, 0.079, [6, 7]), (0.0, 0.02, [0, 1]), (0.07, 0.07001, [7])],
)
def test_a_fault_is_there_from_its_begin_to_before_its_end(begin, end, steps):
    found = rows({'kind': 'wrench_loss', 'from': begin, 'to': end})
    assert_array_equal(np.flatnonzero(found[:, WRENCH]), steps)


def test_it_may_begin_with_the_last_step_and_not_later():
    assert faults({'kind': 'wrench_loss', 'from': 10.0}).entries[0].first == 1000
    with pytest.raises(InputError, match=r'a time within the run of 10 s, found 10\.01 s'):
        faults({'kind': 'wrench_loss', 'from': 10.01})


def test_without_times_it_is_always_there():
    assert (rows({'kind': 'wrench_loss'})[:, WRENCH] == HELD).all()


def test_times_beyond_all_steps_are_never_reached():
    setting = FaultSetting(1e-9, None, None, False, 'x', 'f')
    late = {'kind': 'wrench_loss', 'from': 0.0, 'to': 1e300}
    assert make_faults([late], ['a'], setting).entries[0].end == END
    with pytest.raises(InputError, match='a step between from'):
        make_faults([{'kind': 'wrench_loss', 'from': 1e299, 'to': 1e300}], ['a'], setting)
    with pytest.raises(InputError, match=r'a step between from .*, found nothing'):
        make_faults([{'kind': 'wrench_loss', 'from': 1e299}], ['a'], setting)
    with pytest.raises(InputError, match='at most 1000000 steps'):
        make_faults([{'kind': 'sensor_delay', 'delay': 1.0}], ['a'], setting)


def test_the_age_of_what_has_arrived():
    found = rows(
        {'kind': 'sensor_delay', 'delay': 0.03, 'from': 0.05, 'to': 0.12},
        {'kind': 'sensor_delay', 'delay': 0.01, 'from': 0.12, 'to': 0.15},
    )
    age = found[:, AGE]
    assert_array_equal(age[:18], [0] * 5 + [1, 2, 3, 3, 3, 3, 3] + [1, 1, 1] + [0] * 3)
    assert_array_equal(rows({'kind': 'sensor_delay', 'delay': 0.03})[:6, AGE], [0, 1, 2, 3, 3, 3])


def test_a_wrench_is_kept_then_zero():
    found = rows(
        {'kind': 'wrench_loss', 'from': 0.05, 'to': 0.1, 'timeout': 0.02},
        {'kind': 'wrench_loss', 'from': 0.2, 'to': 0.23},
    )[:, WRENCH]
    assert_array_equal(found[5:10], [HELD, HELD, ZEROED, ZEROED, ZEROED])
    assert_array_equal(found[20:23], [HELD] * 3)
    assert np.count_nonzero(found) == 8


def test_efficiencies_multiply_and_stuck_is_an_offset():
    found = rows(
        {'kind': 'actuator', 'axis': 'heave', 'efficiency': 0.5, 'to': 0.2},
        {'kind': 'actuator', 'axis': 'heave', 'efficiency': 0.4, 'from': 0.1},
        {'kind': 'thruster', 'thruster': 'T3', 'stuck': -7.0, 'from': 0.3},
    )
    heave, third = AXES + 2, THRUSTERS + 2
    assert_allclose(found[[0, 10, 20], heave], [0.5, 0.2, 0.4])
    assert not found[:, AXES + 6 : AXES + 12].any()
    assert_array_equal(found[[29, 30], third], [1.0, 0.0])
    assert_array_equal(found[[29, 30], third + 8], [0.0, -7.0])
    others = np.delete(found[:, THRUSTERS : THRUSTERS + 8], 2, axis=1)
    assert (others == 1.0).all()


MANY = (
    {'kind': 'wrench_loss', 'probability': 0.4, 'timeout': 0.02},
    {'kind': 'sensor_delay', 'delay': 0.05, 'from': 0.1, 'to': 0.3},
    {'kind': 'sensor_drop_out', 'probability': 0.3, 'from': 0.05},
    {'kind': 'sensor_bias', 'attitude': [0.1, 0.2, 0.3], 'to': 0.2},
)


@pytest.mark.parametrize('sizes', [(1, 9, 0, 30), (1,) * 40])
def test_the_numbers_do_not_depend_on_how_they_are_asked_for(sizes):
    of_faults, seen = FaultRows(faults(*MANY), 7), SensorNoise({}, 7, faults(*MANY))
    parts = [(of_faults.rows(n), seen.rows(n)) for n in sizes]
    assert_array_equal(np.vstack([part for part, _ in parts]), rows(*MANY, seed=7))
    whole = SensorNoise({}, 7, faults(*MANY)).rows(40)
    assert_array_equal(np.vstack([part for _, part in parts]), whole)


def test_the_streams_are_those_of_the_documentation():
    def drawn(*key: int) -> np.ndarray:
        sequence = np.random.SeedSequence(3, spawn_key=key)
        return np.random.Generator(np.random.PCG64(sequence)).random(40)

    two = [{'kind': 'wrench_loss', 'probability': p} for p in (0.2, 0.3)]
    lost = (drawn(2, 1, 0) < 0.2) | (drawn(2, 1, 1) < 0.3)
    assert_array_equal(rows(*two)[:, WRENCH] > 0, lost)
    gone = {'kind': 'sensor_drop_out', 'probability': 0.5, 'from': 0.1}
    expected = (drawn(2, 0, 0) < 0.5) & (np.arange(40) >= 10)
    assert_array_equal(SensorNoise({}, 3, faults(gone)).rows(40)[:, LOST] > 0, expected)


def test_noise_is_that_of_the_sensors_alone():
    spec = {'velocity_noise': 0.1, 'attitude_noise': 0.05, 'drop_out': 0.2}
    plain = SensorNoise(spec, 3).rows(40)
    dropped = SensorNoise(spec, 3, faults({'kind': 'sensor_drop_out', 'from': 0.3})).rows(40)
    assert_array_equal(dropped[:, :LOST], plain[:, :LOST])
    assert_array_equal(dropped[:30], plain[:30])
    assert dropped[30:, LOST].all()
    bias = {'kind': 'sensor_bias', 'velocity': [1, 2, 3, 4, 5, 6]}
    biased = SensorNoise(spec, 3, faults(bias)).rows(40)
    assert_allclose(biased[:, :6], plain[:, :6] + np.arange(1, 7), rtol=1e-12)
    assert_array_equal(biased[:, 6:], plain[:, 6:])


def test_faults_of_a_kind_add_up():
    two = (
        {'kind': 'sensor_bias', 'velocity': [0.1] * 6},
        {'kind': 'sensor_bias', 'attitude': [0.2] * 3, 'from': 0.1},
        {'kind': 'sensor_bias', 'velocity': [0.3] * 6, 'attitude': [0.1] * 3, 'from': 0.2},
    )
    found = SensorNoise({}, 3, faults(*two)).rows(30)[[5, 15, 25]]
    assert_allclose(found[:, 0], [0.1, 0.1, 0.4])
    turned = np.sqrt(3.0) * np.array([0.0, 0.2, 0.3])  # rad
    assert_allclose(found[:, 6], np.cos(turned / 2))
    gone = [{'kind': 'sensor_drop_out', 'from': a, 'to': b} for a, b in ((0.05, 0.1), (0.2, 0.23))]
    lost = SensorNoise({}, 3, faults(*gone)).rows(40)[:, LOST]
    assert_array_equal(np.flatnonzero(lost), [*range(5, 10), 20, 21, 22])
    silent = {'kind': 'wrench_loss', 'from': 0.05}
    kept = rows({**silent, 'timeout': 0.02}, silent)[5:10, WRENCH]
    assert_array_equal(kept, [HELD, HELD, ZEROED, ZEROED, ZEROED])


def test_a_first_sample_is_never_lost():
    lost = SensorNoise({}, 1, faults({'kind': 'sensor_drop_out'})).rows(5)[:, LOST]
    assert_array_equal(lost, [0, 1, 1, 1, 1])


def test_a_plant_says_when_nothing_new_has_been_measured_and_of_which_step_it_is():
    late = faults(
        {'kind': 'sensor_delay', 'delay': 0.03, 'from': 0.05, 'to': 0.12},
        {'kind': 'sensor_drop_out', 'from': 0.07, 'to': 0.08},
    )
    x = initial_state(np.zeros(6), np.array([0.5, 0, 0, 0, 0, 0.1]))
    options = {'noise': SensorNoise({}, 0, late), 'faults': late}
    plant = plant_of(HEAVY, [], H, 'ode5', x, **options)
    found, truth = [], []
    for _ in range(16):
        truth.append(plant.x[7])
        found.append((plant.lost, plant.measured_at, plant.measured[7]))
        push(plant, (30.0, 0, 0, 0, 0, 1.0))
    lost = [k for k, (gone, *_) in enumerate(found) if gone]
    assert lost == [5, 6, 7, 10], (
        'on their way; what was measured at 7 is lost and would come at 10'
    )
    assert [at for _, at, _ in found] == [0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8, 12, 13, 14, 15]
    for _, at, speed in found:
        assert speed == truth[6 if at == 7 else at]


def test_a_reset_forgets_the_command_that_was_kept():
    lost = faults({'kind': 'wrench_loss', 'from': 0.02})
    plant = plant_of(HEAVY, [], H, 'ode5', initial_state(np.zeros(6), np.zeros(6)), faults=lost)
    applied = [push(plant, (k + 1.0, 0, 0, 0, 0, 0))[0][0] for k in range(4)]
    assert applied == [1.0, 2.0, 2.0, 2.0]
    assert plant.deaf
    plant.reset()
    assert push(plant, (9.0, 0, 0, 0, 0, 0))[0][0] == 0.0
    assert plant.answer((9.0, 0, 0, 0, 0, 0), heard=True)[0][0] == 9.0


def test_a_reset_forgets_what_was_on_its_way():
    gone = {'kind': 'sensor_drop_out', 'from': 0.04, 'to': 0.06}
    late = faults({'kind': 'sensor_delay', 'delay': 0.03}, gone)
    x = initial_state(np.zeros(6), np.array([0.5, 0, 0, 0, 0, 0.1]))
    noise = SensorNoise({}, 0, late)
    plant = plant_of(HEAVY, [], H, 'ode5', x, noise=noise, faults=late)
    for _ in range(6):
        push(plant, (30.0, 0, 0, 0, 0, 1.0))
    plant.reset()
    for _ in range(3):
        assert_array_equal(plant.measured, x)
        assert not plant.lost
        push(plant, (30.0, 0, 0, 0, 0, 1.0))


def test_a_thruster_is_stuck_within_what_it_gives_either_way():
    most = {'kind': 'thruster', 'thruster': 0, 'stuck': 51.5}  # N, of a T200
    faults(most, {**most, 'thruster': 1, 'stuck': -40.2})
    for stuck in (51.6, -40.3):
        with pytest.raises(InputError, match=r'a thrust of T1, -40.2 to 51.5 N'):
            faults({**most, 'stuck': stuck})


def test_a_dead_thruster_takes_its_column_out_of_the_wrench():
    dead = faults({'kind': 'thruster', 'thruster': 'T3', 'efficiency': 0.0})
    actuators = make_actuators({'thrusters': True}, HEAVY, H, 'f')
    x = initial_state(np.zeros(6), np.zeros(6))
    plant = plant_of(HEAVY, [], H, 'ode5', x, actuators=actuators, faults=dead)
    tau = np.array([10.0, -4.0, 6.0, 0.3, -0.2, 0.5])
    u = HEAVY.thrusters.inverse @ tau
    u[2] = 0.0
    assert_allclose(plant.answer(tuple(tau))[0], HEAVY.thrusters.matrix @ u, atol=1e-12)


def test_a_plant_says_what_of_it_fails():
    """Its wrench is lost in steps 3 to 5; its sensors are two steps late from step 4 on."""
    lost = {'kind': 'wrench_loss', 'from': 0.03, 'to': 0.06}
    late = {'kind': 'sensor_delay', 'from': 0.04, 'delay': 0.02}
    still = initial_state(np.zeros(6), np.zeros(6))
    plant = plant_of(HEAVY, [], H, 'rk4', still, faults=faults(lost, late))
    found = []
    for _ in range(300):  # beyond a block of steps that is tabulated at once
        found.append((plant.deaf, plant.measured_at, plant.lost))
        push(plant, (20.0, 0, 0, 0, 0, 0))
    assert [k for k, (deaf, _, _) in enumerate(found) if deaf] == [3, 4, 5]
    assert [at for _, at, _ in found[:8]] == [0, 1, 2, 3, 3, 3, 4, 5]
    assert [at for _, at, _ in found[295:]] == [293, 294, 295, 296, 297]
