"""The plant under recorded commands: the steps of the plant's node, whatever runs beside them."""

import os
import subprocess
import sys
from pathlib import Path

import herman_reference as reference
import numpy as np
import pytest
from helpers.closed_loops import TURNED, file_of
from helpers.needs import needing
from helpers.plants import plant_of, push
from helpers.strategies import QUICK, vehicles
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import auv_analysis.simulation.open_loop as module
from auv_analysis import open_loop
from auv_dynamics import load_vehicle
from auv_dynamics.kernel.compile import JITTED, plain
from auv_dynamics.plant.actuators import make_actuators
from auv_dynamics.plant.plant import eta_of, initial_state
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import make_model
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

STEP, STEPS = 0.02, 40
START = initial_state(TURNED['eta'], TURNED['nu'])
PUSH = np.array([30.0, -20.0, 15.0, 4.0, -6.0, 5.0])
FLOW = [0.3, -0.2, 0.1]


def recorded(vehicle, segments=1, seed=1):
    """Commands (S, n, 6) that move a vehicle of its mass."""
    size = np.diag(vehicle.M) * np.array([0.5, 0.5, 0.5, 0.3, 0.3, 0.3])
    return size * np.random.default_rng(seed).uniform(-1, 1, (segments, STEPS, 6))


def in_segments(x, segments=1):
    return np.tile(x, (1, segments, 1))


def varied(vehicle, count, seed=2):
    """Coefficients of `count` plants around those of a vehicle, M kept positive definite."""
    draw = np.random.default_rng(seed)
    scale = draw.uniform(0.8, 1.2, (count, 6))
    spread = [
        A * draw.uniform(0.7, 1.3, (count, 6, 6))
        for A in (vehicle.D_linear, vehicle.D_quadratic, vehicle.lift)
        if A is not None
    ]
    hydrostatics = vehicle.model.hydrostatics * draw.uniform(0.7, 1.3, (count, 4))
    M = scale[:, :, None] * vehicle.M * scale[:, None, :]
    return make_model(M, *spread[:2], hydrostatics, *spread[2:])


def one_of(model, i):
    return type(model)(*(None if part is None else part[i : i + 1] for part in model))


@pytest.mark.parametrize(
    ('name', 'integrator', 'lag', 'bias', 'current'),
    [
        ('rexrov', 'rk4', 0.0, False, False), ('rexrov', 'euler', 0.1, True, False),
        ('bluerov2_heavy', 'ode5', 0.15, True, True), ('herman2018', 'rk4', 0.0, False, True),
        ('lauv', 'ode5', 0.1, True, True), ('lauv', 'rk4', 0.0, False, False),
    ],
)  # fmt: skip
def test_every_step_is_the_plants_to_the_last_bit(name, integrator, lag, bias, current):
    vehicle = load_vehicle(name)
    specs = []
    if bias:  # F opposes tau
        pushes = zip(DOFS, PUSH, strict=True)
        specs.append({'kind': 'harmonic', **{dof: {'offset': -size} for dof, size in pushes}})
    if current:
        specs.append({'kind': 'current', 'velocity': FLOW})
    actuators = make_actuators({'lag': lag} if lag else None, vehicle, STEP, 'scenario.yaml')
    commands = recorded(vehicle, 2)
    found = open_loop(
        vehicle, commands, in_segments(START, 2), STEP, follow=actuators.follow[None],
        applied=np.zeros((1, 2, 6)), bias=PUSH[None] if bias else None,
        current=np.array([FLOW]) if current else None, integrator=integrator,
    )  # fmt: skip
    assert found.shape == (1, 2, STEPS, 13)
    for segment, states in zip(commands, found[0], strict=True):
        plant = plant_of(vehicle, specs, STEP, integrator, START, actuators=actuators)
        for tau, x in zip(segment, states, strict=True):
            push(plant, tau)
            assert_array_equal(x, plant.x)


@pytest.mark.parametrize('name', ['rexrov', 'lauv'])
def test_states_are_those_of_the_independent_implementation(name):
    vehicle, data, lag, step = load_vehicle(name), file_of(name), 0.1, 0.005
    [commands] = recorded(vehicle)
    found = open_loop(
        vehicle, commands[None], in_segments(START), step,
        follow=np.full((1, 6), -np.expm1(-step / lag)), applied=np.zeros((1, 1, 6)),
        bias=PUSH[None], current=np.array([FLOW]), integrator='ode5',
    )[0, 0]  # fmt: skip
    plant = reference.Plant(data, {'kind': 'current', 'velocity': FLOW})
    actuators = reference.Actuators({'lag': lag}, data, step)
    pose, (c, A, b) = reference.EulerAngles(), reference.TABLEAUX['ode5']
    x = np.concatenate([TURNED['eta'], TURNED['nu']])
    for tau, state in zip(commands, found, strict=True):
        held, rates = actuators(tau) + PUSH, []
        for row, t in zip(A, c, strict=True):
            y = x + step * sum((a * k for a, k in zip(row, rates, strict=True)), np.zeros(12))
            R, eta_dot = pose.rate(y[:6], y[6:])
            rates.append(np.concatenate([eta_dot, plant.acceleration(t, R, y[6:], held)]))
        x = x + step * sum(w * k for w, k in zip(b, rates, strict=True))
        assert_allclose(eta_of(state), x[:6], atol=1e-9)
        assert_allclose(state[7:], x[6:], atol=1e-9)


def close(one, other):
    assert_allclose(one, other, rtol=1e-11, atol=1e-11)


def everything(vehicle, V, S, seed=3):
    """Arguments of V variants over S segments, none of which is as any other."""
    draw = np.random.default_rng(seed)
    start = np.tile(START, (V, S, 1))
    start[..., :3] += draw.normal(size=(V, S, 3))
    start[..., 7:] += 0.1 * draw.normal(size=(V, S, 6))
    measured = np.tile(START[3:], (S, STEPS, 1)) + 0.05 * draw.normal(size=(S, STEPS, 10))
    measured[draw.random(measured.shape) < 0.2] = np.nan
    commands = draw.uniform(-1, 1, (S, STEPS, 8))
    size = np.diag(vehicle.M)[:, None] * 0.2
    by_variant = {
        'allocation': size * draw.uniform(-1, 1, (V, 6, 8)), 'follow': draw.uniform(0.1, 1, (V, 6)),
        'bias': PUSH * draw.uniform(-1, 1, (V, 6)), 'current': draw.uniform(-0.5, 0.5, (V, 3)),
        'start': start,
    }  # fmt: skip
    common = {'commands': commands, 'measured': measured, 'observer': draw.uniform(0, 0.3, 10)}
    return varied(vehicle, V, seed), by_variant, common


def rows_of(model, by_variant, common, v, s, **changes):
    """Variants v of segments s, indices or slices."""
    own = {name: value[v] for name, value in by_variant.items()}
    own['start'] = own['start'][:, s]
    common = {**common, 'commands': common['commands'][s], 'measured': common['measured'][s]}
    part = type(model)(*(None if rows is None else rows[v] for rows in model))
    return open_loop(part, step=STEP, **(own | common | changes))


@pytest.mark.parametrize('name', ['rexrov', 'lauv'])
def test_a_state_does_not_depend_on_what_runs_beside_it(name):
    given = everything(load_vehicle(name), V := 11, S := 3)
    together = rows_of(*given, slice(None), slice(None), threads=1)
    assert together.shape == (V, S, STEPS, 13)
    assert np.isfinite(together).all()
    assert len(np.unique(together[:, :, -1, 7])) == V * S
    for threads in (2, 5):
        others = rows_of(*given, slice(None), slice(None), threads=threads)
        assert_array_equal(others, together)
    backwards = rows_of(*given, slice(None, None, -1), slice(None, None, -1))
    assert_array_equal(backwards[::-1, ::-1], together)
    for v, s in ((0, 0), (4, 1), (V - 1, S - 1)):
        alone = rows_of(*given, [v], [s])
        assert_array_equal(alone[0, 0], together[v, s])
    assert_array_equal(
        rows_of(*given, slice(None), slice(None), every=7), together[:, :, 6::7][:, :, : STEPS // 7]
    )


@pytest.mark.parametrize('name', ['rexrov', 'lauv'])
def test_lanes_give_what_plain_python_gives(name, monkeypatch):
    given = everything(load_vehicle(name), 3, 2)
    together = rows_of(*given, slice(None), slice(None))
    monkeypatch.setattr(module, 'LANES', None)
    monkeypatch.setattr(module, 'run_open', plain(module.run_open))
    alone = rows_of(*given, slice(None), slice(None))
    close(alone, together)


@QUICK
@given(vehicles(), st.integers(0, 2**32 - 1), st.sampled_from(['rk4', 'ode5']))
def test_any_vehicle_moves_as_its_plant_does(data, seed, integrator):
    vehicle = vehicle_from_dict(data, 'vehicle.yaml')
    commands = recorded(vehicle, seed=seed)[:, :10]
    found = open_loop(vehicle, commands, in_segments(START), 0.01, integrator=integrator)
    plant = plant_of(vehicle, [], 0.01, integrator, START)
    for tau, x in zip(commands[0], found[0, 0], strict=True):
        push(plant, tau)
        assert_array_equal(x, plant.x)


def test_a_variant_that_diverges_does_so_alone():
    vehicle = load_vehicle('rexrov')
    model, commands = varied(vehicle, 9), recorded(vehicle, 2)
    expected = open_loop(model, commands, in_segments(START, 2), STEP)
    model.D_quadratic[4] *= -1e9
    found = open_loop(model, commands, in_segments(START, 2), STEP)
    assert not np.isfinite(found[4, :, -1]).any(axis=-1).all()
    others = np.arange(9) != 4
    assert_array_equal(found[others], expected[others])
    assert np.isfinite(found[others]).all()


def test_commands_of_thrusters_are_the_wrenches_of_their_allocation():
    vehicle = load_vehicle('bluerov2_heavy')
    T = vehicle.thrusters.matrix
    u = np.random.default_rng(5).uniform(-20, 20, (1, STEPS, T.shape[1]))
    tau, given = u @ T.T, (in_segments(START), STEP)
    slow = {'follow': np.full((1, 6), 0.2)}
    by_thrusters = slow | {'allocation': T[None]}
    found = open_loop(vehicle, u, *given, **by_thrusters)
    close(found, open_loop(vehicle, tau, *given, **slow))
    close(found, open_loop(vehicle, u, *given, applied=tau[None, :, 0], **by_thrusters))
    from_rest = open_loop(vehicle, u, *given, applied=np.zeros((1, 1, 6)), **by_thrusters)
    assert np.abs(from_rest - found).max() > 1e-3


def test_several_vehicles_one_of_which_has_lift():
    fleet = [load_vehicle(name) for name in ('rexrov', 'lauv', 'bluerov2_heavy')]
    commands = recorded(fleet[2])
    found = open_loop(fleet, commands, in_segments(START), STEP)
    for vehicle, states in zip(fleet, found, strict=True):
        [alone] = open_loop(vehicle, commands, in_segments(START), STEP)
        assert_allclose(states, alone, rtol=1e-12, atol=1e-12)


@needing('numba', JITTED)
def test_nothing_is_compiled_anew_for_arrays_of_another_kind():
    vehicle = load_vehicle('rexrov')
    commands, start = recorded(vehicle, 2), in_segments(START, 2)
    expected = open_loop(vehicle, commands, start, STEP)
    known = list(module.run_open.signatures)
    for array in (commands, start):
        array.flags.writeable = False
    assert_array_equal(open_loop(vehicle, commands, start, STEP), expected)
    turned = np.asfortranarray(commands)
    assert_array_equal(open_loop(vehicle, turned, start.tolist(), STEP, threads=2), expected)
    ones = {'follow': np.ones((1, 6)), 'bias': np.zeros((1, 6), int), 'every': np.int64(1)}
    assert_array_equal(open_loop(vehicle, commands, start, STEP, **ones), expected)
    assert module.run_open.signatures == known


def test_of_no_segments_or_no_whole_row_nothing_comes():
    vehicle = load_vehicle('rexrov')
    none = open_loop([vehicle] * 2, np.zeros((0, 5, 6)), np.zeros((1, 0, 13)), STEP)
    assert none.shape == (2, 0, 5, 13)
    short = open_loop(vehicle, np.zeros((1, 5, 6)), in_segments(START), STEP, every=6)
    assert short.shape == (1, 1, 0, 13)


class TestObserver:
    vehicle = load_vehicle('rexrov')
    commands = recorded(vehicle)
    free = open_loop(vehicle, commands, in_segments(START), STEP)

    def observed(self, measured, gains, **options):
        return open_loop(
            self.vehicle, self.commands, in_segments(START), STEP,
            measured=np.array(measured)[None], observer=np.array(gains), **options,
        )[0, 0]  # fmt: skip

    def test_of_nothing_measured_or_no_gain_corrects_nothing(self):
        nothing = np.full((STEPS, 10), np.nan)
        assert_array_equal(self.observed(nothing, np.ones(10)), self.free[0, 0])
        far = self.free[0, 0, :, 3:] + np.array([0] * 4 + [1] * 6)
        assert_allclose(self.observed(far, np.zeros(10)), self.free[0, 0], rtol=1e-12, atol=1e-13)

    def test_moves_by_its_gain_after_the_step(self):
        target = self.free[0, 0, :, 3:].copy()
        target[0, 4:] += np.arange(1.0, 7.0)
        target[1:] = np.nan
        gains = np.array([0] * 4 + [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
        moved = self.observed(target, gains)[0] - self.free[0, 0, 0]
        assert_allclose(moved[7:], gains[4:] * np.arange(1.0, 7.0), rtol=1e-9)
        assert_allclose(moved[:7], 0, atol=1e-15)

    def test_of_gain_one_is_the_measurement_where_there_is_one(self):
        draw = np.random.default_rng(7)
        measured = self.free[0, 0, :, 3:] + 0.1 * draw.normal(size=(STEPS, 10))
        measured[:, :4] /= np.linalg.norm(measured[:, :4], axis=1)[:, None]
        measured[::3, 5] = np.nan
        known = ~np.isnan(measured)
        found = self.observed(measured, np.ones(10))[:, 3:]
        assert_allclose(found[known], measured[known], atol=1e-14)
        other = measured * np.array([-1] * 4 + [1] * 6)  # the same attitude
        assert_allclose(self.observed(other, np.ones(10))[:, 3:], found, atol=1e-14)

    def test_takes_a_quaternion_as_a_whole_and_keeps_it_a_unit(self):
        measured = np.tile([0.5, 0.5, -0.5, 0.5, *[np.nan] * 6], (STEPS, 1))
        found = self.observed(measured, np.full(10, 0.3))
        assert_allclose(np.linalg.norm(found[:, 3:7], axis=1), 1.0, rtol=1e-14)
        assert np.abs(found - self.free[0, 0]).max() > 0.1
        measured[:, 2] = np.nan
        assert_array_equal(self.observed(measured, np.full(10, 0.3)), self.free[0, 0])


GIVEN = {
    'model': load_vehicle('rexrov'),
    'commands': np.zeros((2, 5, 6)),
    'start': in_segments(START, 2),
    'step': 0.01,
}


@pytest.mark.parametrize(
    ('changes', 'match'),
    [
        ({'commands': np.zeros((2, 5, 8))}, r'commands: expected .*6.*, found \(2, 5, 8\)'),
        ({'commands': np.full((2, 5, 6), np.nan)}, 'commands: expected finite'),
        ({'start': in_segments(START, 3)}, r'start: expected .*\(any, 2, 13\), found \(1, 3, 13\)'),
        ({'allocation': np.zeros((1, 6, 5))}, r'allocation: expected .*\(any, 6, 6\)'),
        ({'bias': np.zeros(6)}, r'bias: expected .*\(any, 6\), found \(6,\)'),
        ({'bias': np.zeros((2, 6)), 'current': np.zeros((3, 3))}, 'bias: expected 1 or 3 variants'),
        ({'measured': np.zeros((2, 5, 10))}, 'observer: expected together with measured'),
        ({'integrator': 'rk5'}, "integrator: expected ode5, rk4, euler, found 'rk5'"),
        ({'every': 0}, 'every: expected a whole number from 1, found 0'),
        ({'model': []}, 'model: expected a vehicle, found none'),
    ],
)  # fmt: skip
def test_wrong_arguments(changes, match):
    with pytest.raises(ValueError, match=match):
        open_loop(**{**GIVEN, **changes})


@pytest.mark.long
@needing('numba', JITTED)
def test_the_same_source_runs_without_numba():
    command = [sys.executable, '-m', 'pytest', '-q', '-x', '-p', 'no:cacheprovider', __file__]
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': '1'}
    root = Path(__file__).parents[3]
    done = subprocess.run(
        command, check=False, env=environment, cwd=root, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:]
