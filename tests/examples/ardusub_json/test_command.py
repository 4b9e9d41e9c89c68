"""Options, refusals and the end of the example; which thruster a motor is."""

import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import json_backend
import numpy as np
import pytest
import yaml
from ardusub_mixer import FRAMES
from helpers.patience import patience
from helpers.sitl_peer import BACKEND, NEUTRAL, ROOT, SitlPeer, backend, direct
from json_motors import make_motors

from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.vehicle.thruster_curves import load_curve

UP = ('0', '0', '-1', '0', '0', '0')  # NED, rad
PULSES = np.array([1600.0, 1350, 1480, 1700, 1450, 1550, 1300, 1900] + [0.0] * 24)


@pytest.fixture
def refused(capsys: pytest.CaptureFixture) -> Callable[..., str]:
    """The line with which it ends, exit code 2."""

    def said(*options: str) -> str:
        assert json_backend.main(options) == 2
        return capsys.readouterr().err.splitlines()[-1]

    return said


def test_a_port_in_use_is_named() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(('127.0.0.1', 0))
        place = f'127.0.0.1:{taken.getsockname()[1]}'
        command = [sys.executable, str(BACKEND), '--vehicle', 'bluerov2', '--listen', place]
        done = subprocess.run(
            command, stderr=subprocess.PIPE, text=True, timeout=patience(60), check=False
        )
    line = f'--listen: {place}: expected HOST:PORT that is free, found address already in use\n'
    assert (done.returncode, done.stderr) == (2, line)


@pytest.mark.parametrize(
    ('options', 'expected'),
    [
        (('--vehicle', 'rexrov'), 'rexrov: thrusters: expected a vehicle with thrusters'),
        (('--vehicle', 'bluerov'), 'bluerov2'),
        (('--vehicle', 'bluerov2', '--eta', *UP), 'eta: expected finite numbers, a depth'),
        (('--vehicle', 'bluerov2', '--motors', '1,2,3'), '--motors: expected each of T1, T2'),
        (('--vehicle', 'bluerov2', '--motors', '1,2,3,4,5,x'), '--motors: expected'),
        (('--vehicle', 'bluerov2', '--listen', 'here'), '--listen: here: expected HOST:PORT'),
        (('--vehicle', 'bluerov2', '--listen', '127.0.0.1:99999'), 'expected HOST:PORT'),
        (('--vehicle', 'bluerov2', '--voltage', '-12'), '--voltage: expected a positive'),
        (('--scenario', 'case1'), 'expected a vehicle with thrusters'),
        (('--scenario', 'nowhere.yaml'), 'nowhere.yaml'),
    ],
)
def test_wrong_input_is_one_line(refused, options: tuple[str, ...], expected: str) -> None:
    assert expected in refused(*options, *([] if '--listen' in options else ['--listen', ':0']))


def test_a_folder_with_a_bag_is_not_written_to(refused, tmp_path: Path) -> None:
    (tmp_path / 'dive_0.mcap').touch()
    line = refused('--vehicle', 'bluerov2', '--listen', ':0', '--bag', str(tmp_path))
    assert line.startswith('--bag: ')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_in_good_order(number: int, tmp_path: Path) -> None:
    with backend('--vehicle', 'bluerov2', '--bag', str(tmp_path / 'dive')) as process:
        SitlPeer(process.port).run(0.1)
        process.process.send_signal(number)
        assert process.ended() == 0
    assert process.said[-1] == '0.100 s, 40 frames, 0 lost'
    assert 'Traceback' not in ''.join(process.said)
    assert (tmp_path / 'dive' / 'metadata.yaml').is_file()


def test_it_says_once_that_nobody_is_there(monkeypatch, capsys) -> None:
    monkeypatch.setattr(json_backend, 'SILENCE', 0.5)
    with json_backend.opened('127.0.0.1:0') as port:
        waits = json_backend.Backend(port, None, lambda: None, paced=True)
        waits.serve()
        waits.serve()
        assert capsys.readouterr().err == 'no frame of ArduSub for 0.5 s: waiting\n'
        assert waits._is_peer(('127.0.0.1', 9))
        waits.serve()
    assert capsys.readouterr().err.endswith('no frame of ArduSub for 0.5 s: waiting\n'), 'again'


def test_what_cannot_be_sent_is_said_and_what_fails_is_no_wrong_input(monkeypatch, capsys) -> None:
    unreachable = Mock(side_effect=OSError(101, 'Network is unreachable'))
    port = SimpleNamespace(sendto=unreachable)
    json_backend.Backend(port, None, lambda: None, paced=True)._send(b'')
    assert capsys.readouterr().err == 'None: network is unreachable\n'
    monkeypatch.setattr(json_backend, 'serve', Mock(side_effect=FailedError('it broke')))
    assert json_backend.main(['--vehicle', 'bluerov2']) == 1
    assert capsys.readouterr().err == 'it broke\n'


def test_it_listens_where_sitl_sends_unless_told_otherwise() -> None:
    assert json_backend.options_of(['--vehicle', 'bluerov2']).listen == '127.0.0.1:9002'


def test_a_length_in_simulated_time() -> None:
    with backend('--vehicle', 'bluerov2', '--seconds', '0.5') as process:
        peer = SitlPeer(process.port)
        peer.run(0.25)
        peer.count += 3
        peer.run(0.25)
        assert process.ended() == 0
    assert process.said[-1] == '0.500 s, 200 frames, 3 lost'


def test_no_time_sync_is_told() -> None:
    with direct('--vehicle', 'bluerov2', '--no-time-sync') as peer:
        peer.send(peer.packet(NEUTRAL))
        assert b',"no_time_sync":1}' in peer.heard()


def changed(folder: Path, name: str, order: list[int], turned: tuple[int, ...]) -> Path:
    """A vehicle file with its thrusters in another order, some of them turned round."""
    data = yaml.safe_load((ROOT / 'config' / 'vehicles' / f'{name}.yaml').read_text())
    for i in turned:
        one = data['thrusters'][i]
        one['direction'] = [-component for component in one['direction']]
        one['limit'] = one['limit'][::-1]
    for one in data['thrusters'] if turned else ():
        del one['rotor']  # whose curve has the other end ahead
    data['thrusters'] = [data['thrusters'][i] for i in order]
    path = folder / 'mine.yaml'
    path.write_text(yaml.safe_dump(data))
    return path


@pytest.mark.parametrize('name', ['bluerov2', 'bluerov2_heavy'])
def test_motors_are_found_by_place_and_direction(name: str, tmp_path: Path) -> None:
    usual = load_vehicle(name).thrusters
    count = len(usual.names)
    order = [int(i) for i in np.random.default_rng(1).permutation(count)]
    mine = load_vehicle(changed(tmp_path, name, order, (0, count - 1))).thrusters
    motors, text = make_motors(mine, None, 16)
    assert f'FRAME_CONFIG {count // 2 - 2}' in text
    assert text.endswith('T1 reversed, ' + ', '.join(usual.names[1:-1]) + f', T{count} reversed')
    expected, _ = make_motors(usual, None, 16)
    found = mine.matrix @ motors.thrusts(PULSES)
    # turned round, pulse for pulse it pushes the same way, with the other end of the curve
    there = usual.matrix @ expected.thrusts(PULSES)
    assert np.abs(found - there).max() < 0.35 * np.abs(there).max()
    same, _ = make_motors(load_vehicle(changed(tmp_path, name, order, ())).thrusters, None, 16)
    T = usual.matrix[:, order]
    assert T @ same.thrusts(PULSES) == pytest.approx(there)


def test_a_full_pulse_gives_the_limits_of_the_vehicle_file() -> None:
    thrusters = load_vehicle('bluerov2_heavy').thrusters
    motors, _ = make_motors(thrusters, None, None)
    assert motors.thrusts(np.full(32, 1900.0)) == pytest.approx(thrusters.forward, rel=0.01)
    assert motors.thrusts(np.full(32, 1100.0)) == pytest.approx(-thrusters.reverse, rel=0.01)
    weak, _ = make_motors(thrusters, None, 12)
    assert weak.thrusts(np.full(32, 1900.0)) == pytest.approx(0.72 * thrusters.forward, rel=0.05)


AT_18, AT_16 = load_curve('t200_18v'), load_curve('t200_16v')


@pytest.mark.parametrize(
    ('unit', 'commands', 'share'),
    [
        ('pwm_us', [1100, 1500, 1900], 0.5),
        ('percent', [-100, 0, 100], AT_18.thrust(1700) / AT_16.thrusts[-1]),
    ],
)
def test_the_curve_of_a_rotor_counts_where_it_is_of_pulses(
    unit: str, commands: list, share: float, tmp_path: Path
) -> None:
    data = yaml.safe_load((ROOT / 'config' / 'vehicles' / 'bluerov2.yaml').read_text())
    for one in data['thrusters']:
        one |= {'limit': 20.0, 'rotor': {'curve': {unit: commands, 'thrust_n': [-20, 0, 20]}}}
    path = tmp_path / 'mine.yaml'
    path.write_text(yaml.safe_dump(data))
    # at the battery's voltage where none is told; of another unit: a T200's, scaled to the limits
    motors, _ = make_motors(load_vehicle(path).thrusters, None, 18)
    assert motors.thrusts(np.full(32, 1700.0)) == pytest.approx(20.0 * share)
    for one in data['thrusters']:
        one['rotor']['voltage'] = 16.0  # where it has one of its own, the battery's counts as well
    path.write_text(yaml.safe_dump(data))
    found = [
        make_motors(load_vehicle(path).thrusters, None, voltage)[0].thrusts(np.full(32, 1700.0))[0]
        for voltage in (None, 16, 18)
    ]
    assert found[0] == pytest.approx(found[1])
    assert found[2] > 1.02 * found[1]


def test_motors_by_the_option() -> None:
    thrusters = load_vehicle('bluerov2').thrusters
    motors, text = make_motors(thrusters, '2, -T1,3,4,6,5', 16)
    assert 'T2, T1 reversed, T3, T4, T6, T5' in text
    u = motors.thrusts(np.array([1900.0, 1900, 0, 0, 0, 1100] + [0.0] * 26))
    assert u == pytest.approx([-40.2, 51.5, 0, 0, -40.2, 0], rel=0.01)


def test_thrusters_of_no_known_frame_are_taken_in_their_order(tmp_path: Path) -> None:
    path = changed(tmp_path, 'bluerov2', [0, 1, 2, 3, 4], ())
    motors, text = make_motors(load_vehicle(path).thrusters, None, 16)
    assert 'no frame that is known here' in text
    assert motors.channels.tolist() == [0, 1, 2, 3, 4]
    assert not motors.reversed.any()


def test_a_frame_is_matched_only_where_every_sign_is_right(tmp_path: Path) -> None:
    data = yaml.safe_load((ROOT / 'config' / 'vehicles' / 'bluerov2_heavy.yaml').read_text())
    data['thrusters'][4]['position'][0] *= -1  # two thrusters at one corner
    path = tmp_path / 'mine.yaml'
    path.write_text(yaml.safe_dump(data))
    assert 'no frame that is known' in make_motors(load_vehicle(path).thrusters, None, 16)[1]
    assert set(FRAMES) == {6, 8}


def test_unknown_thruster_is_told_with_the_nearest() -> None:
    with pytest.raises(InputError, match='T6'):
        make_motors(load_vehicle('bluerov2').thrusters, 'T1,T2,T3,T4,T5,T66', 16)
