"""What ArduSub is told of the vehicle, against physics that this code has no part in."""

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import json_backend
import numpy as np
import pytest
import yaml
from ardusub_mixer import motor_pulses
from helpers.sitl_peer import ROOT, DirectPeer, direct
from reference_devices import thruster_matrix
from reference_plant import Plant
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from auv_analysis import load_run
from auv_dynamics.files.errors import FailedError
from auv_dynamics.vehicle.thruster_curves import load_curve

DEEP = ('0', '0', '20', '0.1', '-0.2', '1')  # NED, rad
SHALLOW = ('0', '0', '0.05', '0', '0', '0')
G = np.array([0.0, 0.0, 9.80665])
VEHICLES = {'bluerov2': 6, 'bluerov2_heavy': 8}
LEVELS = (0.3, -0.4, 0.2, 0.5, -0.3, 0.25, -0.2, 0.35)  # of full, one for each motor
AHEAD = motor_pulses([1500, 1500, 1500, 1500, 1580, 1500], 8)
TURNING = [round(1500 + 400 * level) for level in LEVELS]


def vehicle_data(name: str) -> dict[str, Any]:
    return yaml.safe_load((ROOT / 'config' / 'vehicles' / f'{name}.yaml').read_text())


@pytest.fixture(scope='module', params=VEHICLES)
def vehicle(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope='module')
def deep(vehicle: str) -> Iterator[DirectPeer]:
    with direct('--vehicle', vehicle, '--eta', *DEEP) as made:
        yield made


def anew(peer: DirectPeer) -> DirectPeer:
    peer.count, peer.rate = 1, 400
    peer.frame()  # so that frame 0 goes back
    peer.count = 0
    return peer


@pytest.fixture
def peer(deep: DirectPeer) -> DirectPeer:
    return anew(deep)


@pytest.fixture(scope='module')
def calm(deep: DirectPeer) -> dict[str, np.ndarray]:
    return anew(deep).run(0.25)


@pytest.fixture(scope='module')
def turning(deep: DirectPeer) -> dict[str, np.ndarray]:
    return anew(deep).run(1.2, TURNING)


def attitudes(told: dict[str, np.ndarray]) -> Rotation:
    return Rotation.from_quat(np.roll(told['quaternion'], -1, axis=1))


def force(told: dict[str, np.ndarray], rate: int) -> np.ndarray:
    """Specific force in the body from the velocity and attitude of each frame alone."""
    acceleration = np.gradient(told['velocity'], 1 / rate, axis=0)
    return attitudes(told).inv().apply(acceleration - G)


AXES = ('pitch', 'roll', 'throttle', 'yaw', 'forward', 'lateral')
SEEN = {  # where a positive input of the pilot is seen, and which way
    'forward': (0, 1), 'lateral': (1, 1), 'throttle': (2, -1),
    'roll': (3, 1), 'pitch': (4, 1), 'yaw': (5, 1),
}  # fmt: skip


@pytest.mark.parametrize('axis', AXES)
@pytest.mark.parametrize('way', [1, -1])
def test_signs_of_the_pilots_axes(
    calm: dict, peer: DirectPeer, vehicle: str, axis: str, way: int
) -> None:
    motors = VEHICLES[vehicle]
    inputs = [1500 + 160 * way * (name == axis) for name in AXES]
    told = peer.run(0.25, motor_pulses(inputs, motors))
    if (axis, motors) == ('pitch', 6):  # which six thrusters do not have
        assert all(np.array_equal(told[key], calm[key]) for key in told)
        return
    i, sign = SEEN[axis]
    body = attitudes(told).inv().apply(told['velocity'])[-1]
    rest = attitudes(calm).inv().apply(calm['velocity'])[-1]
    moved = np.concatenate([body - rest, told['gyro'][-1] - calm['gyro'][-1]])
    assert sign * way * moved[i] > 0.02
    if i < 3:  # and it is felt
        felt = (told['accel_body'] - calm['accel_body'])[40]  # once the rotors turn
        assert sign * way * felt[i] > 0.2
    else:
        turned = (attitudes(calm)[-1].inv() * attitudes(told)[-1]).as_rotvec()
        assert sign * way * turned[i - 3] > 0.002


def test_specific_force_is_that_of_the_reported_motion(turning: dict) -> None:
    told = turning
    assert np.abs(told['gyro']).max() > 0.3
    expected = force(told, 400)
    assert told['accel_body'][2:-2] == pytest.approx(expected[2:-2], abs=0.03)
    assert np.abs(told['accel_body'] + [0, 0, 9.8]).max() > 0.5  # far more than that tolerance


def test_position_and_attitude_are_integrals_of_velocity_and_gyro(turning: dict) -> None:
    told = turning
    way = cumulative_trapezoid(told['velocity'], dx=1 / 400, axis=0)
    assert told['position'][1:] - told['position'][0] == pytest.approx(way, abs=1e-5)
    attitude = attitudes(told)[0]
    for before, after in zip(told['gyro'], told['gyro'][1:], strict=False):
        attitude *= Rotation.from_rotvec((before + after) / 2 / 400)
    assert (attitude.inv() * attitudes(told)[-1]).magnitude() < 1e-4
    euler = attitudes(told).as_euler('ZYX')[:, ::-1]
    assert told['attitude'] == pytest.approx(euler, abs=1e-9)


def wrench(name: str, pulses: list[int]) -> np.ndarray:
    """Of pulses, from the vehicle file's thrusters and Blue Robotics' table at 16 V."""
    T, _, _ = thruster_matrix(vehicle_data(name)['thrusters'])
    curve = load_curve('t200_16v')
    return T @ np.interp(pulses[: T.shape[1]], curve.commands, curve.thrusts)


def test_motion_is_that_of_the_second_implementation(turning: dict, vehicle: str) -> None:
    told = turning
    plant, tau = Plant(vehicle_data(vehicle), []), wrench(vehicle, TURNING)
    for k in range(228, len(told['gyro']) - 1, 57):  # the rotors turn
        R = attitudes(told)[k].as_matrix()
        gyro, felt = told['gyro'][k], (told['accel_body'][k] + told['accel_body'][k + 1]) / 2
        nu_dot = plant.acceleration(0.0, R, np.concatenate([R.T @ told['velocity'][k], gyro]), tau)
        expected = nu_dot[:3] + np.cross(gyro, R.T @ told['velocity'][k]) - R.T @ G
        assert felt == pytest.approx(expected, abs=0.005)
        turning = (told['gyro'][k + 1] - told['gyro'][k - 1]) * 200
        assert turning == pytest.approx(nu_dot[3:], abs=0.05)


def test_neutral_and_silent_motors_do_nothing(peer: DirectPeer) -> None:
    neutral = peer.run(0.2)
    peer.count = 0
    silent = peer.run(0.2, [0] * 16)
    peer.count = 0
    within = peer.run(0.2, [1480, 1520] * 8)  # the dead band of the speed controller
    for told in (silent, within):
        assert np.array_equal(told['velocity'], neutral['velocity'])


def test_a_buoyant_vehicle_stays_at_the_surface() -> None:
    with direct('--vehicle', 'bluerov2', '--eta', *SHALLOW, rate=100) as peer:
        told = peer.run(5.0)
    depth = told['position'][:, 2]
    assert depth[0] > 0.04
    assert (depth >= 0).all()
    assert (depth[-200:] == 0).all()
    assert (told['velocity'][-200:] == 0).all()
    assert told['accel_body'][-200:] == pytest.approx(np.tile(-G, (200, 1)), abs=1e-9)
    # the stop is felt: the integral of the specific force is the change of the velocity
    felt = np.cumsum((told['accel_body'] + G)[1:] / 100, axis=0)
    assert felt == pytest.approx(told['velocity'][1:] - told['velocity'][0], abs=1e-6)


SCENARIO = {
    'name': 'reef',
    'vehicle': 'bluerov2_heavy',
    'duration': 1.0,
    'step': 0.01,
    'initial': {'eta': [0, 0, 10, 0, 0, 0.7]},
    'controllers': {'gvc': {'law': 'gvc', 'k_D': 5.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 5.0}},
    'setpoint': {'surge': {'offset': 0.1}},
}


def scenario(folder: Path, **changes: Any) -> str:
    path = folder / 'reef.yaml'
    path.write_text(yaml.safe_dump(copy.deepcopy(SCENARIO) | changes))
    return str(path)


def test_the_scenario_and_the_options_reach_the_physics(tmp_path: Path, monkeypatch) -> None:
    physics, motors = Mock(), Mock(return_value=(None, ''))
    monkeypatch.setattr(json_backend, 'Physics', physics)
    monkeypatch.setattr(json_backend, 'make_motors', motors)
    path = scenario(tmp_path, integrator='euler', step=0.02)
    for told, integrator, eta in (
        (['--scenario', path], 'euler', [0, 0, 10, 0, 0, 0.7]),
        (['--vehicle', 'bluerov2_heavy', '--eta', *DEEP], 'rk4', [0, 0, 20, 0.1, -0.2, 1]),
    ):
        asked = [*told, '--motors', '2,1', '--voltage', '14.5']
        json_backend.made(json_backend.options_of(asked))
        assert motors.call_args.args[1:] == ('2,1', 14.5)
        _, _, _, found, start, _, faults, _ = physics.call_args.args
        assert (found, start[0].tolist(), start[1].tolist()) == (integrator, eta, [0] * 6)
        assert faults[1] == (0.02 if integrator == 'euler' else 1.0)


@pytest.mark.parametrize('rate', [2, 1200])
def test_the_rate_of_frames_is_no_part_of_the_physics(rate: int, tmp_path: Path) -> None:
    spec = {'thrusters': True, 'rotor_lag': 0.0}  # rotors are held over a step
    with direct('--scenario', scenario(tmp_path, actuators=spec)) as peer:
        usual = peer.run(0.5, TURNING)
        peer.count, peer.rate = 0, rate
        other = peer.run(0.5, TURNING)
    for key in ('position', 'velocity', 'gyro', 'quaternion'):
        assert other[key][-1] == pytest.approx(usual[key][-1], abs=1e-7)


def test_velocity_in_a_current_is_over_ground(tmp_path: Path) -> None:
    current = [{'kind': 'current', 'velocity': [0.3, -0.1, 0.0]}]
    with direct('--scenario', scenario(tmp_path, disturbance=current), rate=100) as peer:
        told = peer.run(20.0)
    assert told['velocity'][-1, :2] == pytest.approx([0.3, -0.1], abs=0.02)
    assert told['position'][-1, :2] == pytest.approx(np.array([0.3, -0.1]) * 20, abs=1.5)
    first = told['accel_body'][0] + [0, 0, 9.80665]  # pushed the way of the current
    pushed = Rotation.from_euler('z', 0.7).apply(first)
    assert pushed[0] > 0.01
    assert pushed[1] < -0.01
    expected = force(told, 100)
    assert told['accel_body'][2:-2] == pytest.approx(expected[2:-2], abs=0.02)


def test_disturbances_go_on_when_the_rate_changes(tmp_path: Path) -> None:
    push = [{'kind': 'harmonic', 'surge': {'terms': [{'amplitude': 10.0, 'omega': 3.0}]}}]
    with direct('--scenario', scenario(tmp_path, disturbance=push)) as peer:
        steady = peer.run(0.6)
        peer.count = 0
        peer.run(0.3)
        peer.rate = 1000
        changed = peer.run(0.3)
    for key in ('position', 'velocity'):
        assert changed[key][-1] == pytest.approx(steady[key][-1], abs=1e-6)


@pytest.mark.parametrize('lag', ['lag', 'rotor_lag'])
def test_thrusters_go_on_following_when_the_rate_changes(lag: str, tmp_path: Path) -> None:
    spec = {'thrusters': True, 'rotor_lag': 0.0} | {lag: 0.3}
    with direct('--scenario', scenario(tmp_path, actuators=spec)) as peer:
        before = peer.run(0.15, AHEAD)['accel_body'][:, 0]
        peer.rate = 1000
        after = peer.run(0.005, AHEAD)['accel_body'][:, 0]
    assert before[-1] > 5 * before[0]
    assert after[0] == pytest.approx(before[-1], rel=0.02)  # it rises by 1 % in a step


def test_a_thruster_that_fails_is_that_of_its_motor(tmp_path: Path) -> None:
    fault = {'kind': 'thruster', 'thruster': 'T2', 'efficiency': 0.0, 'from': 0.5}
    spec = {'faults': [fault], 'actuators': {'thrusters': True}}
    with direct('--scenario', scenario(tmp_path, **spec)) as peer:
        told = peer.run(0.6, AHEAD)
        peer.count = 0
        again = peer.run(0.6, AHEAD)
    assert np.abs(told['gyro'][:200, [0, 2]]).max() < 1e-9  # surge pitches, and no more
    without = [1500 if motor == 1 else pulse for motor, pulse in enumerate(AHEAD)]
    lost = wrench('bluerov2_heavy', AHEAD) - wrench('bluerov2_heavy', without)
    inertia = 0.37 + 0.222
    yawing = (told['gyro'][203] - told['gyro'][200])[2] / (3 / 400)
    assert yawing == pytest.approx(-lost[5] / inertia, rel=0.05)
    assert np.array_equal(told['gyro'], again['gyro'])  # the fault begins again with the autopilot


def test_lost_commands_are_held_and_then_none(tmp_path: Path) -> None:
    fault = {'kind': 'wrench_loss', 'from': 0.5, 'timeout': 0.25}
    with direct('--scenario', scenario(tmp_path, faults=[fault])) as peer:
        before, held, after = (
            peer.run(seconds, pulses)
            for seconds, pulses in ((0.5, AHEAD), (0.25, [1500] * 8), (0.5, AHEAD))
        )
    faster = [np.diff(np.linalg.norm(told['velocity'], axis=1)) for told in (before, held, after)]
    assert (faster[0] > 0).all()
    assert (faster[1] > 0).all()
    assert (faster[2][80:] < 0).all()


DOWN = motor_pulses([1500, 1500, 1400, 1500, 1500, 1500], 8)


@pytest.mark.parametrize(
    ('lags', 'share'),
    [
        ({'lag': 0.02, 'rotor_lag': 0.0}, 1 - np.exp(-1.0)),
        ({'rotor_lag': 0.02}, (1 - np.exp(-1.0)) ** 2),
        ({'rate': 100.0, 'rotor_lag': 0.0}, 100.0 * 0.02 / wrench('bluerov2_heavy', DOWN)[2]),
    ],
)
def test_lags_are_those_of_the_scenario(lags: dict, share: float, tmp_path: Path) -> None:
    felt = []
    for spec in (lags, {'rotor_lag': 0.0}):
        actuators = {'thrusters': True, **spec}
        with direct('--scenario', scenario(tmp_path, actuators=actuators)) as peer:
            calm = peer.run(0.1)['accel_body'][-1, 2]
            felt.append(peer.run(0.02, DOWN)['accel_body'][:, 2] - calm)
    slow, quick = felt
    # 8 frames: 0.02 s; thrust goes by the square of a rotor's speed
    assert slow[7] / quick[0] == pytest.approx(share, abs=0.03)


def test_rotors_of_the_vehicle_file_follow_late(peer: DirectPeer) -> None:
    calm = peer.run(0.1)['accel_body'][-1]
    felt = np.linalg.norm(peer.run(0.1, TURNING)['accel_body'] - calm, axis=1)
    assert felt[0] < 0.1 * felt[-1]


def test_a_vehicle_that_leaves_the_finite_numbers_is_a_failure(tmp_path: Path) -> None:
    fast = {'nu': [500.0, 0, 0, 0, 0, 0]}
    failed = pytest.raises(FailedError, match=r'the simulation diverges at 0\.0025 s')
    with direct('--scenario', scenario(tmp_path, initial=fast)) as peer, failed:
        peer.frame()


def test_a_recording_is_a_run(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    fault = {'kind': 'thruster', 'thruster': 'T2', 'efficiency': 0.5, 'from': 0.5}
    spec = {
        'faults': [fault],
        'actuators': {'thrusters': True},
        'disturbance': [{'kind': 'current', 'velocity': [0.3, -0.1, 0.0]}],
    }
    bag = tmp_path / 'dive'
    with direct('--scenario', scenario(tmp_path, **spec), '--bag', str(bag)) as peer:
        peer.run(0.2)
        peer.count = 0
        told = peer.run(1.0, TURNING)
    said = capsys.readouterr().err
    assert 'reef.yaml: controllers, sensors, limits and delay left out' in said
    assert 'FRAME_CONFIG 2; motors 1 to 8: T1, T2' in said
    assert len(load_run(bag).t) == 20
    run = load_run(tmp_path / 'dive_2')
    assert (run.scenario, len(run.t)) == ('reef', 100)
    kept = slice(3, None, 4)  # row k of the run is the state that frame 4 k begins with
    assert run.eta[1:, :3] == pytest.approx(told['position'][kept][:-1], abs=1e-12)
    assert run.nu[1:, 3:] == pytest.approx(told['gyro'][kept][:-1], abs=1e-12)
    assert run.tau == pytest.approx(np.tile(wrench('bluerov2_heavy', TURNING), (100, 1)))
    assert run.tau_applied[30:50] == pytest.approx(run.tau[30:50], rel=1e-3)  # rotors turn
    assert np.abs(run.tau_applied[50:] - run.tau[50:]).max(axis=1).min() > 1.0
    # F is what the plain vehicle file does not know: its equation of motion holds with it
    plant = Plant(vehicle_data('bluerov2_heavy'), [])
    for k in (45, 95):
        R = attitudes(told)[4 * k - 1].as_matrix()
        nu_dot = plant.acceleration(0.0, R, run.nu[k], run.tau_applied[k] - run.disturbance[k])
        slope = (run.nu[k + 1] - run.nu[k - 1]) / 0.02
        assert slope == pytest.approx(nu_dot, abs=0.1)
