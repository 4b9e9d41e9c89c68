"""The plant node's motion and forces are those of the independent implementation; its pace."""

import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import herman_reference as reference
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers import nodes_in_process as by_hand
from helpers.nodes_in_process import Program, program, quaternion_of, write_vehicle
from helpers.patience import patience
from numpy.testing import assert_allclose
from reference_cases import off_centre
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger

from auv_dynamics.nodes import plant_node
from auv_dynamics.nodes.plant_node import MET, PlantNode
from auv_dynamics.plant.faults import END, Fault, Losses
from auv_dynamics.ros import topics

H, STEP = 0.02, 20_000_000
LAST = 6
POSE = reference.RotationMatrix()
ETA, NU = [1.0, -2.0, 3.0, 0.4, -0.5, 2.5], [0.4, -0.3, 0.2, 0.1, -0.2, 0.3]
TAU = np.random.default_rng(11).uniform(-1, 1, (LAST + 1, 6)) * [900, 800, 700, 90, 80, 70]
LIMIT = [400.0, 350.0, 300.0, 40.0, 35.0, 30.0]
NOISE = [0.1, 0.2, 0.3, 0.04, 0.05, 0.06]
WATER = [
    {'kind': 'harmonic', 'sway': {'offset': 25.0, 'terms': [
        {'amplitude': 40.0, 'omega': 0.8, 'phase': 0.3}]}, 'pitch': {'offset': -8.0}},
    {'kind': 'model_error', 'dD': [90.0, 80.0, 70.0, 9.0, 8.0, 7.0], 'buoyancy': 0.02},
    {'kind': 'current', 'velocity': [0.5, -0.3, 0.2]},
]  # fmt: skip
PARAMETERS: dict[str, Any] = {
    'step': H, 'duration': LAST * H, 'lockstep': True, 'initial.eta': ETA, 'initial.nu': NU,
    'disturbance.names': ['a', 'b', 'c'], 'disturbance.a.kind': 'harmonic',
    'disturbance.a.sway.offset': 25.0, 'disturbance.a.sway.amplitude': [40.0],
    'disturbance.a.sway.omega': [0.8], 'disturbance.a.sway.phase': [0.3],
    'disturbance.a.pitch.offset': -8.0, 'disturbance.b.kind': 'model_error',
    'disturbance.b.dD': WATER[1]['dD'], 'disturbance.b.buoyancy': 0.02,
    'disturbance.c.kind': 'current', 'disturbance.c.velocity': WATER[2]['velocity'],
}  # fmt: skip
DEVICES = {'actuators.limit': LIMIT, 'sensors.velocity_noise': NOISE, 'seed': 3}


@pytest.fixture(scope='module')
def vehicle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_vehicle(tmp_path_factory.mktemp('vehicle'), off_centre())


@pytest.fixture
def made() -> Iterator[Program]:
    with program() as new:
        heard = (topics.ODOM, topics.TWIST, topics.DISTURBANCE, topics.CLOCK)
        new.listen(*heard, topics.WRENCH_APPLIED, topics.GROUND_TRUTH)
        yield new


def moved(
    steps: int, limit: Any, integrator: str = 'ode5', reset: int | None = None
) -> Iterator[tuple]:
    """Position, rotation, nu, applied wrench and F of each step, under TAU."""
    plant, known = reference.Plant(off_centre(), WATER), reference.vehicle_matrices(off_centre())
    nodes, rows, weights = reference.TABLEAUX[integrator]
    x = start = np.concatenate((POSE.start(np.array(ETA)), NU))
    n = POSE.size

    def rate(t: float, x: np.ndarray, tau: np.ndarray) -> np.ndarray:
        R, pose_dot = POSE.rate(x[:n], x[n:])
        return np.concatenate((pose_dot, plant.acceleration(t, R, x[n:], tau)))

    for k in range(steps + 1):
        applied, R, nu = np.clip(TAU[k], -limit, limit), POSE.rotation(x[:n]), x[n:]
        model = known['M'] @ plant.acceleration(k * H, R, nu, applied)
        model += (reference.coriolis(known['M'], nu) + reference.damping(known, nu)) @ nu
        F = applied - model - reference.restoring_from_rotation(known, R)
        yield x[:3], R, nu, applied, F
        stages = np.zeros((len(nodes), len(x)))
        for i, (node, row) in enumerate(zip(nodes, rows, strict=True)):
            stages[i] = rate((k + node) * H, x + H * (np.array(row) @ stages[:i]), applied)
        x = x + H * (np.array(weights) @ stages)
        x[:n] = POSE.tidy(x[:n])
        x = start if k == reset else x


def stamps(messages: list) -> list[int]:
    return [by_hand.ns_of(message) for message in messages]


def answered(made: Program, k: int) -> None:
    """Wait for step k, answer it, and wait for what opposed the answer."""
    made.until(lambda: stamps(made.heard['odom'])[-1:] == [k * STEP], f'step {k}')
    made.publish(topics.WRENCH, by_hand.six(topics.WRENCH.type, k * STEP, TAU[k]))
    made.until(lambda: stamps(made.heard['disturbance'])[-1:] == [k * STEP], f'F of step {k}')


def assert_state(message: Any, position: Any, R: Any, nu: Any) -> None:
    state = by_hand.state_of(message)
    assert by_hand.frames_of(message) == ('odom_ned', 'base_link_fsd')
    assert_allclose(state[:3], position, rtol=0, atol=1e-9)
    q = quaternion_of(R)
    assert_allclose(np.sign(q @ state[3:7]) * np.array(state[3:7]), q, rtol=0, atol=1e-9)
    assert_allclose(state[7:], nu, rtol=0, atol=1e-9)


def assert_six(message: Any, values: Any) -> None:
    assert by_hand.frames_of(message) == ('base_link_fsd',)
    assert_allclose(by_hand.six_of(message), values, rtol=1e-8, atol=1e-8)


def test_motion_and_forces_are_those_of_the_independent_implementation(made, vehicle) -> None:
    node = made.add(PlantNode, {**PARAMETERS, 'vehicle': str(vehicle)})
    for k in range(LAST + 1):
        answered(made, k)
    made.until(lambda: node.exit_code is not None, 'the end')
    made.until(lambda: len(made.heard['twist']) == LAST + 1, 'the last twist')
    assert node.exit_code == 0
    odometry, twists, forces = (made.heard[name] for name in ('odom', 'twist', 'disturbance'))
    clock: list[Clock] = made.heard['/clock']
    assert [m.clock.sec * 10**9 + m.clock.nanosec for m in clock] == stamps(odometry)
    assert stamps(odometry) == stamps(twists) == stamps(forces)
    assert not made.heard['wrench_applied']
    assert not made.heard['ground_truth/odom']
    for k, (position, R, nu, _, F) in enumerate(moved(LAST, np.inf)):
        assert_state(odometry[k], position, R, nu)
        assert_six(twists[k], nu)
        assert_six(forces[k], F)


def test_the_integrator_is_the_one_that_is_asked_for(made, vehicle) -> None:
    made.add(PlantNode, {**PARAMETERS, 'vehicle': str(vehicle), 'integrator': 'euler'})
    answered(made, 0)
    made.until(lambda: len(made.heard['odom']) == 2, 'step 1')
    state = by_hand.state_of(made.heard['odom'][1])
    (position, _, nu, _, _) = [*moved(1, np.inf, 'euler')][1]
    assert_allclose([*state[:3], *state[7:]], [*position, *nu], rtol=0, atol=1e-12)


def test_actuators_and_sensors_are_those_of_the_independent_implementation(made, vehicle) -> None:
    made.add(PlantNode, {**PARAMETERS, **DEVICES, 'vehicle': str(vehicle)})
    for k in range(LAST + 1):
        answered(made, k)
    made.until(lambda: len(made.heard['wrench_applied']) == LAST + 1, 'what was applied')
    made.until(lambda: len(made.heard['ground_truth/odom']) == LAST + 1, 'the truth')
    sensors = reference.Sensors({'velocity_noise': NOISE}, 3)
    for k, (position, R, nu, applied, F) in enumerate(moved(LAST, np.array(LIMIT))):
        measured = sensors(position, R, nu)
        assert_state(made.heard['odom'][k], *measured)
        assert_six(made.heard['twist'][k], measured[2])
        assert_state(made.heard['ground_truth/odom'][k], position, R, nu)
        assert_six(made.heard['wrench_applied'][k], applied)
        assert_six(made.heard['disturbance'][k], F)
        for name in ('ground_truth/odom', 'wrench_applied'):
            assert by_hand.ns_of(made.heard[name][k]) == k * STEP


def test_a_reset_puts_the_vehicle_back_after_the_step_that_is_under_way(made, vehicle) -> None:
    made.add(PlantNode, {**PARAMETERS, 'vehicle': str(vehicle)})
    for k in range(3):
        answered(made, k)
    made.until(lambda: len(made.heard['odom']) == 4, 'step 3')
    answer = made.call(Trigger, 'plant_node/reset')
    assert answer.success
    assert 'from step 4' in answer.message
    for k in range(3, 6):
        answered(made, k)
    for k, (position, R, nu, _, F) in enumerate(moved(5, np.inf, reset=3)):
        assert_state(made.heard['odom'][k], position, R, nu)
        assert_six(made.heard['disturbance'][k], F)


REAL = {'step': H, 'actuators.limit': [1e6], 'wrench_timeout': patience(0.2)}
PACE = patience(0.1)  # s, a step at which a loaded machine hears of every one in time
COUNT = 15  # of them are looked at


def arrivals(made: Program) -> list[tuple[float, float]]:
    """(steady s, stamp in s) of the odometry from now on."""
    seen: list[tuple[float, float]] = []
    made.node.create_subscription(
        topics.ODOM.type,
        topics.ODOM.name,
        lambda message: seen.append((time.monotonic(), by_hand.ns_of(message) / 1e9)),
        topics.every_step(),
    )
    return seen


def test_real_time_keeps_its_pace(made, vehicle, capfd) -> None:
    """n steps in n h by the steady clock, over a time in which the machine gave this process turns.

    A gap between two messages of half a step more or less is a stall, or what made up for one:
    then neither end of the window says when its step was due, and another window is taken.
    """
    made.add(PlantNode, {'vehicle': str(vehicle), **REAL, 'step': PACE})
    seen = arrivals(made)

    def window() -> list[tuple[float, float]]:
        gaps = np.diff([at for at, _ in seen])
        regular = np.abs(gaps - PACE) < PACE / 2
        for i in range(1, len(gaps) - COUNT):
            if regular[i - 1 : i + COUNT].all():
                return seen[i : i + COUNT + 1]
        return []

    found = np.array(made.until(window, f'{COUNT} steps without a stall'))
    pace = np.polyfit(*found.T, 1)[0]
    assert abs(pace - 1.0) < 0.05
    assert_allclose(np.diff(found[:, 1]), PACE, rtol=0, atol=1e-9)
    assert (
        'time goes on from step' not in capfd.readouterr().err
        or max(np.diff(np.array(seen)[:, 0])) > 0.4
    )


def test_the_first_step_in_real_time_is_the_beginning(made, vehicle) -> None:
    made.add(PlantNode, {'vehicle': str(vehicle), **REAL, 'step': 1.0})
    seen = arrivals(made)
    (zero, _), (one, _) = made.until(lambda: seen[1:] and seen[:2], 'two steps')
    assert one - zero > 0.5


def test_real_time_ends_with_its_last_step_and_tells_of_silence_until_then(made, vehicle) -> None:
    plant = made.add(PlantNode, {'vehicle': str(vehicle), **REAL, 'duration': 2.0})
    made.listen(topics.DIAGNOSTICS)
    told = made.heard['/diagnostics']

    def level() -> bytes:
        return told[-1].status[0].level if told else DiagnosticStatus.ERROR

    made.until(lambda: level() == DiagnosticStatus.STALE, 'silence to be told')
    (status,) = told[-1].status
    assert 'no wrench for' in status.message
    made.until(lambda: by_hand.ns_of(told[-1]) > 0, 'a later step')
    facts = {value.key: value.value for value in told[-1].status[0].values}
    assert int(facts['step']) * STEP == by_hand.ns_of(told[-1])
    assert (status.name, status.hardware_id) == ('/plant_node', 'rexrov')
    made.until(lambda: plant.exit_code is not None, 'the end')
    assert plant.exit_code == 0
    made.until(lambda: stamps(made.heard['odom'])[-2:] == [99 * STEP, 100 * STEP], 'the last step')
    count = len(told)
    made.until(lambda: len(told) > count and level() == DiagnosticStatus.OK, 'no silence behind it')


def test_a_pause_in_real_time_stops_the_time_of_the_run(made, vehicle) -> None:
    node = made.add(PlantNode, {'vehicle': str(vehicle), **REAL})
    made.until(lambda: len(made.heard['odom']) > 5, 'odometry')
    assert made.call(SetBool, 'plant_node/run', SetBool.Request(data=False)).message == 'paused'
    count = node.plant.k
    made.until(lambda: len(made.heard['odom']) == count, 'what was under way')
    made.spin(10 * H)
    assert len(made.heard['odom']) == count
    assert made.call(SetBool, 'plant_node/run', SetBool.Request(data=True)).message == 'running'
    made.until(lambda: len(made.heard['odom']) > count + 5, 'odometry again')
    assert stamps(made.heard['odom']) == [k * STEP for k in range(len(made.heard['odom']))]


def test_silence_of_the_controller_gives_zero_wrench_and_it_comes_back(made, vehicle) -> None:
    made.add(PlantNode, {'vehicle': str(vehicle), **REAL, 'step': PACE, 'initial.nu': NU})
    applied = made.heard['wrench_applied']
    made.until(lambda: len(applied) > 3, 'the beginning')
    assert by_hand.six_of(applied[-1]) == [0.0] * 6, 'nothing before the first wrench'
    for tau in (TAU[0], TAU[1]):

        def drives(tau: np.ndarray = tau) -> bool:
            newest = by_hand.ns_of(made.heard['odom'][-1])
            made.publish(topics.WRENCH, by_hand.six(topics.WRENCH.type, newest, tau))
            made.spin(H)
            return by_hand.six_of(applied[-1]) == [*tau]

        first = time.monotonic()  # those that follow may come late, and be refused
        made.until(drives, 'the wrench')
        begun = len(applied)
        made.until(lambda: by_hand.six_of(applied[-1]) == [0.0] * 6, 'a zero wrench')
        assert time.monotonic() - first > REAL['wrench_timeout'], 'it is held before'
        held = [by_hand.six_of(message) for message in applied[begun:]]
        assert held == [[*tau]] * (len(held) - 1) + [[0.0] * 6]


class Hours:
    """The steady clock of a plant, s, which goes on where a test says so."""

    now = 1000.0

    def go_on(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def hours(made: Program, monkeypatch: pytest.MonkeyPatch) -> Hours:
    found = Hours()
    monkeypatch.setattr(plant_node, 'MET', MET)  # as for a user
    monkeypatch.setattr(plant_node, 'time', SimpleNamespace(monotonic=lambda: found.now))
    return found


def begun(made: Program, hours: Hours, **given: Any) -> Any:
    """A plant in real time that has published step 0."""
    plant = made.add(PlantNode, {'vehicle': 'herman2018', **REAL, 'wrench_timeout': 0.5, **given})
    made.until(lambda: made.node.get_publishers_info_by_topic(topics.ODOM.name), 'the plant')
    made.spin(0.2)
    assert not made.heard['odom'], 'it waits for who is there already'
    hours.go_on(1.0)
    until_step(made, 0)
    return plant


def until_step(made: Program, k: int) -> None:
    """Wait until step k is published, and longer: no other one follows."""
    made.until(lambda: k * STEP in stamps(made.heard['odom']), f'step {k}')
    made.spin(3 * H)
    assert stamps(made.heard['odom']) == [i * STEP for i in range(k + 1)]


def test_real_time_publishes_what_is_due(made, hours, capfd) -> None:
    begun(made, hours)
    hours.go_on(3.5 * H)
    until_step(made, 3)
    assert made.call(SetBool, 'plant_node/run', SetBool.Request(data=False)).success
    hours.go_on(10.0)
    until_step(made, 3)
    assert made.call(SetBool, 'plant_node/run', SetBool.Request(data=True)).success
    until_step(made, 4)
    hours.go_on(1.99)
    until_step(made, 103)
    assert ' s late' not in capfd.readouterr().err
    hours.go_on(2.1)
    until_step(made, 104)
    assert ' s late: time goes on from step 104' in capfd.readouterr().err
    hours.go_on(1.5 * H)
    until_step(made, 105)


def test_a_long_step_is_not_late(made, hours, capfd) -> None:
    begun(made, hours, step=1.0)
    hours.go_on(1.0)
    made.until(lambda: len(made.heard['odom']) == 2, 'step 1')
    made.spin(0.1)
    said = capfd.readouterr().err
    assert ' s late' not in said
    assert 'simulates herman2018 in real time, 1 s per step' in said


def test_a_wrench_is_of_a_step_up_to_a_second_ahead_and_ends_a_silence(made, hours, capfd) -> None:
    plant = begun(made, hours)
    made.listen(topics.DIAGNOSTICS)
    told = made.heard['/diagnostics']
    silent = DiagnosticStatus.STALE
    made.until(lambda: told and told[-1].status[0].level == silent, 'silence to be told')

    def say(k: int) -> None:
        made.publish(topics.WRENCH, by_hand.six(topics.WRENCH.type, k * STEP, TAU[0]))
        made.spin(3 * H)

    for k in (0, 0, 51, 1):  # step 1 is the next one: one that is ahead locks out none but older
        say(k)
    assert plant.graph.refused.total() == 0
    made.until(lambda: told[-1].status[0].level == DiagnosticStatus.OK, 'no silence')
    say(0)
    assert 'wrench: stamp: expected newer than the last, found 0 ns' in capfd.readouterr().err
    say(52)
    assert plant.graph.refused.total() == 2
    hours.go_on(0.51)
    made.until(lambda: told[-1].status[0].level == silent, 'silence again')


@pytest.mark.parametrize('answered', [False, True])
def test_the_last_wrench_in_real_time_is_waited_for(made, hours, answered) -> None:
    plant = begun(made, hours, duration=2 * H)
    hours.go_on(2.5 * H)
    until_step(made, 2)
    made.publish(topics.WRENCH, by_hand.six(topics.WRENCH.type, STEP, TAU[1]))
    hours.go_on(0.4)
    until_step(made, 2)
    assert plant.exit_code is None
    if answered:
        made.publish(topics.WRENCH, by_hand.six(topics.WRENCH.type, 2 * STEP, TAU[2]))
    else:
        hours.go_on(0.2)
    made.until(lambda: plant.exit_code is not None, 'the end')
    assert plant.exit_code == 0


def test_a_recorder_ends_a_run_in_real_time_whose_plant_then_stands_still(
    made, hours, capfd
) -> None:
    plant = begun(made, hours, duration=2 * H, recorder_window=5)
    hours.go_on(2.5 * H)
    until_step(made, 2)
    hours.go_on(5.0)
    until_step(made, 2)
    for data in (False, True):
        assert made.call(SetBool, 'plant_node/run', SetBool.Request(data=data)).success
        until_step(made, 2)
    assert plant.exit_code is None
    assert ' s late' not in capfd.readouterr().err


def test_a_plant_that_diverges_in_real_time_says_after_which_step(made, hours, capfd) -> None:
    plant = begun(made, hours, **{'actuators.limit': [1e9]})
    made.publish(topics.WRENCH, by_hand.six(topics.WRENCH.type, 0, [1e9] * 6))
    made.spin(3 * H)
    hours.go_on(1.5 * H)
    made.until(lambda: plant.exit_code is not None, 'the end')
    hours.go_on(5.0)
    until_step(made, 1)
    assert plant.exit_code == 1
    said = capfd.readouterr().err
    assert said.count('diverges') == 1
    assert 'after step 1:' in said


def test_the_seed_says_what_is_lost_at_random(made, vehicle) -> None:
    spec = {'kind': 'wrench_loss', 'probability': 0.5}
    given = {f'faults.mute.{key}': value for key, value in spec.items()}
    node = made.add(
        PlantNode,
        {**PARAMETERS, 'vehicle': str(vehicle), 'seed': 3, 'faults.names': ['mute'], **given},
    )
    lost = []
    for _ in range(40):
        lost.append(node.plant.deaf)
        node.plant.answer((0.0,) * 6)
        node.plant.advance()
    assert lost == Losses(Fault(spec, 0, END, 0), 3).rows(np.arange(40)).tolist()
