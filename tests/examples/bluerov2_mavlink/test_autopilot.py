"""The simulated autopilot does what was seen of ArduSub itself."""

import shlex
from unittest.mock import Mock

import ardusub_endpoint
import numpy as np
import pytest
from ardusub_autopilot import ALT_HOLD, STABILIZE, Autopilot, Settings
from helpers.mavlink_pair import SECOND, Booted
from numpy.testing import assert_allclose
from pymavlink.dialects.v20 import ardupilotmega as mavlink

MS = 1_000_000


class Bench:
    """An autopilot, what it has sent, and messages as a ground station sends them."""

    def __init__(self, **settings):
        self.sent: list = []
        self.autopilot = Autopilot(Booted(**settings), self.sent.append)
        self.now = 0

    def give(self, message, system: int = 255) -> None:
        data = message.pack(mavlink.MAVLink(None, srcSystem=system, srcComponent=0))
        self.autopilot.receive(*mavlink.MAVLink(None).parse_buffer(data), self.now)

    def override(self, forward: int) -> None:
        self.give(
            mavlink.MAVLink_rc_channels_override_message(1, 1, *[1500] * 4, forward, 1500, 0, 0)
        )

    def stick(self) -> None:
        self.give(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))

    def heartbeat(self) -> None:
        self.give(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    def order(self, command: int, *parameters: float) -> int:
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        self.give(mavlink.MAVLink_command_long_message(1, 1, command, 0, *padded))
        return self.sent[-1].result

    def run(self, seconds: float, *, heard: bool = False) -> None:
        """Let time pass; `heard`: with heartbeats of the ground station."""
        end = self.now + round(seconds * SECOND)
        while self.now < end:
            self.now += MS
            if heard and self.now % SECOND == 0:
                self.heartbeat()
            self.autopilot.advance(self.now)

    def armed(self) -> 'Bench':
        assert self.autopilot.arm(True, self.now) == mavlink.MAV_RESULT_ACCEPTED
        self.run(0.6)
        return self

    def heard(self, kind: str) -> list:
        return [message for message in self.sent if message.get_type() == kind]


def test_from_override_to_motors_20_ms_in_the_middle() -> None:
    bench, delays = Bench().armed(), []
    for i in range(40):
        bench.run(0.1 + 0.0017 * i)
        before, start = bench.autopilot.pulses, bench.now
        bench.override(1600 + i)
        while bench.autopilot.pulses == before:
            bench.run(0.001)
        delays.append((bench.now - start) / MS)
    assert np.median(delays) == pytest.approx(20.0, abs=3.0)
    assert 8.0 < min(delays) < max(delays) < 36.0


def test_the_motors_wait_half_a_second_after_arming() -> None:
    bench = Bench()
    bench.override(1700)
    bench.autopilot.arm(True, 0)
    bench.run(0.45)
    assert bench.autopilot.pulses == [1500] * 8
    bench.run(0.1)
    assert max(bench.autopilot.pulses) > 1650


@pytest.mark.parametrize('release', [0, 65535])
def test_the_last_override_stays_in_every_mode_and_through_a_release(release: int) -> None:
    bench = Bench(version=(4, 2, 0)).armed()
    bench.override(1700)
    bench.run(1.0)
    bench.autopilot.set_mode(ALT_HOLD)
    bench.give(mavlink.MAVLink_rc_channels_override_message(1, 1, *[release] * 8))
    bench.run(5.0, heard=True)
    assert bench.autopilot.armed
    assert max(bench.autopilot.pulses) > 1650


def test_only_the_station_that_it_obeys_steers() -> None:
    bench = Bench().armed()
    message = mavlink.MAVLink_rc_channels_override_message(1, 1, *[1800] * 8)
    bench.give(message, system=254)
    bench.run(0.1)
    assert bench.autopilot.channels == [1500] * 6


@pytest.mark.parametrize(
    ('say', 'version', 'after'),
    [('heartbeat', (4, 2, 0), 2.5), ('override', (4, 2, 0), 2.5), ('heartbeat', (4, 7, 0), 5.0)],
)
def test_a_station_that_falls_silent_is_noticed(say: str, version: tuple, after: float) -> None:
    bench = Bench(version=version).armed()
    for _ in range(10):
        bench.run(1.0)
        bench.heartbeat() if say == 'heartbeat' else bench.override(1700)
    bench.run(after - 0.1)
    assert bench.autopilot.armed
    bench.run(0.2)
    assert not bench.autopilot.armed
    assert bench.autopilot.pulses == [1500] * 8


@pytest.mark.parametrize(
    ('version', 'joystick', 'left'),
    [((4, 2, 0), False, True), ((4, 2, 0), True, False), ((4, 5, 0), True, True)],
)
def test_who_keeps_the_pilot_input_failsafe_quiet(version, joystick: bool, left: bool) -> None:
    bench = Bench(version=version).armed()
    if joystick:
        bench.stick()
    for _ in range(40):
        bench.override(1600)
        bench.run(0.1)
    assert bench.autopilot.armed == left


@pytest.mark.parametrize(('version', 'left'), [((4, 2, 0), True), ((4, 5, 0), False)])
def test_overrides_that_cease(version: tuple, left: bool) -> None:
    bench = Bench(version=version).armed()
    bench.override(1600)
    bench.run(4.0, heard=True)
    assert bench.autopilot.armed == left


def test_other_modes_move_the_motors_by_themselves() -> None:
    pulses = {}
    for mode in (STABILIZE, ALT_HOLD, 19):
        bench = Bench(eta=(0, 0, 0, 0.3, 0, 0), mode=mode).armed()
        pulses[mode] = np.abs(np.array(bench.autopilot.pulses) - 1500).max()
    assert pulses[19] == 0
    assert min(pulses[STABILIZE], pulses[ALT_HOLD]) > 20


def test_depth_is_held() -> None:
    bench = Bench(nu=(0, 0, 0.3, 0, 0, 0)).armed()
    bench.autopilot.set_mode(ALT_HOLD)
    depth = bench.autopilot.plant.x[2]
    bench.run(8.0)
    assert abs(bench.autopilot.plant.x[2] - depth) < 0.2


def test_it_refuses_to_arm_until_it_is_ready_and_says_why() -> None:
    bench = Bench(ready_after=2.0)
    assert bench.order(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_FAILED
    assert bench.heard('STATUSTEXT')[0].text.startswith('PreArm')
    bench.run(2.0)
    assert bench.order(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED


def test_the_position_comes_late_and_its_velocity_may_be_biased() -> None:
    bias = (0.03, -0.02, 0.01)
    bench = Bench(position_after=1.0, velocity_bias=bias, eta=(0, 0, 0, 0, 0, 1.2))
    for message_id in (30, 32):
        assert bench.order(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 20000) == 0
    bench.run(0.9)
    assert bench.heard('ATTITUDE')
    assert not bench.heard('LOCAL_POSITION_NED')
    bench.run(1.0)
    found = bench.heard('LOCAL_POSITION_NED')[-1]
    expected = [np.cos(1.2) * 0.03 + np.sin(1.2) * 0.02, np.sin(1.2) * 0.03 - np.cos(1.2) * 0.02]
    assert_allclose([found.vx, found.vy], expected, atol=1e-3)
    assert abs(found.x) + abs(found.y) < 1e-3, 'the position stands still'


def test_the_pilot_gain_comes_with_its_older_stream_alone() -> None:
    bench = Bench()
    bench.run(3.0)
    assert bench.order(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 251, 500000) == 4  # failed
    bench.run(1.0)
    assert not bench.heard('NAMED_VALUE_FLOAT')
    bench.give(mavlink.MAVLink_request_data_stream_message(1, 1, 2, 2, 1))
    bench.run(1.0)
    assert bench.heard('NAMED_VALUE_FLOAT')[0].name == 'PilotGain'


def test_the_endpoint_hears_every_option(monkeypatch) -> None:
    class MadeError(Exception):
        pass

    made = Mock(side_effect=MadeError)
    port = Mock()
    monkeypatch.setattr(ardusub_endpoint, 'Autopilot', made)
    monkeypatch.setattr(ardusub_endpoint, 'UdpPort', port)
    words = (
        'endpoint --connection udpin:127.0.0.1:9 --system 7 --vehicle bluerov2 --eta 1 2 3 4 5 6 '
        '--thrusters measured --voltage 14 --gain 0.7 --mode ALT_HOLD --firmware 4.2 '
        '--position-after 3 --ready-after 2 --velocity-bias 0.1 0.2 0.3'
    )
    monkeypatch.setattr('sys.argv', shlex.split(words))
    with pytest.raises(MadeError):
        ardusub_endpoint.main()
    assert port.call_args.args[:2] == ('udpin:127.0.0.1:9', 7)
    assert made.call_args.args[0] == Settings(
        vehicle='bluerov2', eta=(1, 2, 3, 4, 5, 6), curve='measured', voltage=14, gain=0.7,
        mode=ALT_HOLD, version=(4, 2, 0), position_after=3, ready_after=2,
        velocity_bias=(0.1, 0.2, 0.3),
    )  # fmt: skip
