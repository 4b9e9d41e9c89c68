"""What the driver asks a vehicle for when they meet, what it waits for, what it says."""

from types import SimpleNamespace

import pytest
from helpers.mavlink_pair import Booted, Pair
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from vehicle_link import LinkSettings
from wrench_mapping import MANUAL_CONTROL

SET_INTERVAL = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
BY_STICK = LinkSettings(how=MANUAL_CONTROL)


def deaf(pair: Pair, *what: object) -> Pair:
    """A vehicle that takes no messages of a type or commands of a number."""
    receive = pair.autopilot.receive

    def take(message, now) -> None:
        if message.get_type() in what or getattr(message, 'command', None) in what:
            return
        receive(message, now)

    pair.autopilot.receive = take
    return pair


def waits(pair: Pair) -> list[str]:
    return pair.link.waits_for(pair.now)


def told(pair: Pair, *words: str) -> int:
    return sum(all(word in line for word in words) for line in pair.said)


def test_everything_that_is_missing_is_named_at_once() -> None:
    pair = Pair(Booted(position_after=2.0, ready_after=4.0, mode=2), BY_STICK)
    assert waits(pair) == ['a heartbeat of system 1']
    pair.link.pilot.want(True, pair.now)
    pair.run(0.004)
    assert {'AUTOPILOT_VERSION', 'SYSID_MYGCS', 'ATTITUDE', 'LOCAL_POSITION_NED'} <= {*waits(pair)}
    assert {'TIMESYNC', 'a wrench', 'the pilot gain (PilotGain or JS_GAIN_DEFAULT)'} <= {
        *waits(pair)
    }
    pair.run(1.5)
    assert waits(pair) == ['LOCAL_POSITION_NED', 'a wrench', 'mode MANUAL (it is in 2)']
    pair.run(2.0)
    assert waits(pair) == ['a wrench']
    pair.run(0.3, tau=[1.0, 0, 0, 0, 0, 0])
    assert waits(pair) == ['the vehicle to arm: PreArm: Gyros not calibrated']
    assert told(pair, 'vehicle: PreArm: Gyros not calibrated') == 1
    assert told(pair, 'MAV_CMD_COMPONENT_ARM_DISARM: MAV_RESULT_FAILED') == 1
    arming = mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_CRITICAL, b'Arm: Leak')
    pair._downs.send(arming)
    pair.run(0.004, tau=[1.0, 0, 0, 0, 0, 0])
    assert waits(pair)[0].endswith('Arm: Leak')
    pair.run(2.5, tau=[1.0, 0, 0, 0, 0, 0])
    assert waits(pair) == []
    assert pair.autopilot.armed


def test_it_says_that_it_was_not_asked() -> None:
    pair = Pair()
    pair.run(1.0)
    assert waits(pair) == ['~/arm (not asked to arm)']


@pytest.mark.parametrize('refused', [True, False], ids=['refused', 'unanswered'])
def test_messages_come_by_their_older_stream_where_they_must(refused: bool) -> None:
    pair = deaf(Pair(), SET_INTERVAL)
    if refused:
        answer = mavlink.MAVLink_command_ack_message(SET_INTERVAL, mavlink.MAV_RESULT_DENIED)
        take = pair.autopilot.receive
        pair.autopilot.receive = lambda message, now: (
            pair._downs.send(answer)
            if getattr(message, 'command', None) == SET_INTERVAL
            else take(message, now)
        )
    pair.run(5.0)
    assert len(pair.samples) > 40
    asked = {m.req_stream_id for m in pair.sent if m.get_type() == 'REQUEST_DATA_STREAM'}
    assert asked == {2, 3, 6, 10}


def test_a_rate_that_another_ground_station_lowers_is_asked_for_again() -> None:
    pair = Pair()
    pair.run(2.0)
    stream = mavlink.MAV_DATA_STREAM_POSITION
    lower = mavlink.MAVLink_request_data_stream_message(1, 1, stream, 3, 1)
    lower.pack(mavlink.MAVLink(None, srcSystem=255, srcComponent=190))
    pair.autopilot.receive(lower, pair.now - pair.booted)
    before = len(pair.samples)
    pair.run(1.0)
    assert len(pair.samples) - before < 25
    pair.run(2.5)
    before = len(pair.samples)
    pair.run(1.0)
    assert len(pair.samples) - before > 45


def test_the_pilot_gain_comes_by_its_stream() -> None:
    pair = Pair(Booted(gain=0.7), BY_STICK)
    pair.run(1.0)
    assert pair.link.gain == pytest.approx(0.7)
    assert pair.link.gain_from == 'PilotGain'


def test_or_it_is_the_one_at_boot() -> None:
    pair = deaf(Pair(Booted(gain=0.75), BY_STICK), 'REQUEST_DATA_STREAM')
    pair.run(1.0)
    assert (pair.link.gain, pair.link.gain_from) == (0.75, 'JS_GAIN_DEFAULT')


def test_a_pilot_gain_that_cannot_be_is_refused_and_a_restart_wants_it_anew() -> None:
    pair = Pair(Booted(gain=0.7), BY_STICK)
    pair.run(1.0)
    pair._downs.send(mavlink.MAVLink_named_value_float_message(0, b'PilotGain', 0.0))
    pair.run(0.004)
    assert told(pair, 'refused: PilotGain: expected a number from 0 to 1, found 0.0') == 1
    assert pair.link.gain == pytest.approx(0.7)
    pair.boot()
    deaf(pair, 'REQUEST_DATA_STREAM', 'PARAM_REQUEST_READ').run(2.5)
    assert told(pair, 'vehicle restarted') == 1
    assert pair.link.gain is None


@pytest.mark.parametrize('gain', [0.5, 0.1], ids=['not told', 'beyond its limits'])
def test_without_either_it_waits_and_says_so(gain: float) -> None:
    silent = ['REQUEST_DATA_STREAM'] + ['PARAM_REQUEST_READ'] * (gain == 0.5)
    pair = deaf(Pair(Booted(gain=gain), BY_STICK), *silent)
    pair.link.pilot.want(True, pair.now)
    pair.run(12.0, tau=[1.0, 0, 0, 0, 0, 0])
    assert 'the pilot gain (PilotGain or JS_GAIN_DEFAULT)' in waits(pair)
    assert not [m for m in pair.sent if m.get_type() == 'MANUAL_CONTROL']
    assert told(pair, 'no answer about', 'JS_GAIN_DEFAULT') == (gain == 0.5)


def test_an_old_firmware_is_said_and_a_trial_version_is_named() -> None:
    pair = Pair(Booted(version=(3, 5, 4)))
    pair.run(1.0)
    assert told(pair, 'ArduSub 3.5.4 is older than 4.0: nobody has tried it') == 1
    first = Pair(Booted(version=(4, 0, 0)))
    first.run(1.0)
    assert told(first, 'older than 4.0') == 0
    for kind, name in ((0, ' dev'), (64, ' alpha'), (128, ' beta'), (192, ' rc'), (255, '')):
        sent = int.from_bytes((4, 5, 1, kind), 'big')
        pair.link.profile.take_version(SimpleNamespace(flight_sw_version=sent))
        assert pair.link.profile.firmware == f'ArduSub 4.5.1{name}'


@pytest.mark.parametrize(
    ('version', 'station'), [((4, 1, 0), 'SYSID_MYGCS'), ((4, 7, 0), 'MAV_GCS_SYSID')]
)
def test_the_version_is_read_and_names_of_both_are_known(version: tuple, station: str) -> None:
    pair = Pair(Booted(version=version))
    pair.run(1.0)
    assert pair.link.profile.version == version
    assert pair.link.profile.firmware == f'ArduSub {".".join(map(str, version))}'
    assert pair.link.profile.values[station] == 255.0
    assert not told(pair, 'no answer')


def test_nothing_is_said_of_a_vehicle_as_it_should_be() -> None:
    pair = Pair().flown()
    assert pair.said == []
    assert pair.link.differences == []


@pytest.mark.parametrize(
    ('name', 'value', 'words'),
    [
        ('FS_GCS_ENABLE', 0.0, ('FS_GCS_ENABLE is 0, expected 2', 'set 2')),
        ('FS_PILOT_INPUT', 0.0, ('FS_PILOT_INPUT is 0, expected 2',)),
        ('FS_PILOT_TIMEOUT', 0.25, ('FS_PILOT_TIMEOUT is 0.25, expected 0.5 to 3',)),
        ('FS_GCS_TIMEOUT', 20.0, ('FS_GCS_TIMEOUT is 20, expected 0 to 5',)),
        ('ACRO_YAW_P', 4.5, ('ACRO_YAW_P is 4.5, expected 3.375', 'yaw')),
    ],
)
def test_a_failsafe_that_is_off_is_said_once(name: str, value: float, words: tuple) -> None:
    pair = Pair()
    pair.autopilot.parameters[name] = value
    pair.flown()
    assert told(pair, *words) == 1
    assert len(pair.link.differences) == 1


def test_a_throttle_gain_is_said_where_it_matters() -> None:
    for link, count in ((LinkSettings(), 0), (BY_STICK, 1)):
        pair = Pair(None, link)
        pair.autopilot.parameters['JS_THR_GAIN'] = 2.0
        pair.run(1.0)
        assert told(pair, 'JS_THR_GAIN is 2, expected 1') == count


def test_before_4_5_a_joystick_that_was_used_disarms_the_driver_and_it_is_said_before() -> None:
    pair = Pair(Booted(version=(4, 2, 0)))
    pair.run(1.0)
    assert told(pair, 'FS_PILOT_INPUT is 2', 'counts joysticks only') == 1
    pair.flown(tau=[5.0, 0, 0, 0, 0, 0])
    assert pair.autopilot.armed, 'without a joystick it is asleep'
    pair = Pair(Booted(version=(4, 2, 0)))
    pair.steer(0.2)
    pair.link.pilot.want(True, pair.now)
    pair.run(4.0, tau=[5.0, 0, 0, 0, 0, 0])
    assert told(pair, 'vehicle: Lost manual control') == 1
    assert not pair.autopilot.armed


@pytest.mark.parametrize(
    ('name', 'value', 'words'),
    [
        ('SYSID_MYGCS', 254.0, ('SYSID_MYGCS is 254, expected 255', '-p system:=254')),
        ('FRAME_CONFIG', 1.0, ('FRAME_CONFIG is 1, expected 2', '8 thrusters')),
        ('RC_OPTIONS', 34.0, ('RC_OPTIONS has bit 1', 'nobody steers it by MAVLink')),
        ('RC_OVERRIDE_TIME', 0.0, ('RC_OVERRIDE_TIME is 0', 'nobody steers it by MAVLink')),
    ],
)
def test_a_vehicle_that_would_not_obey_or_move_otherwise_is_not_armed(name, value, words) -> None:
    pair = Pair()
    pair.autopilot.parameters[name] = value
    pair.link.pilot.want(True, pair.now)
    pair.run(3.0, tau=[5.0, 0, 0, 0, 0, 0])
    assert told(pair, *words) == 1
    assert all(word in waits(pair)[-1] for word in words)
    assert not pair.autopilot.armed
    assert not [m for m in pair.sent if m.get_type() == 'RC_CHANNELS_OVERRIDE']


@pytest.mark.parametrize(('last', 'taken'), [(255.0, True), (0.0, False)])
def test_from_4_7_on_a_vehicle_may_obey_a_range_of_stations(last: float, taken: bool) -> None:
    pair = Pair(Booted(version=(4, 7, 0)))
    pair.autopilot.parameters |= {'MAV_GCS_SYSID': 250.0, 'MAV_GCS_SYSID_HI': last}
    pair.link.pilot.want(True, pair.now)
    pair.run(3.0, tau=[5.0, 0, 0, 0, 0, 0])
    assert pair.autopilot.armed == taken


def test_after_a_restart_it_asks_again() -> None:
    pair = Pair()
    pair.run(2.0)
    pair.settings = Booted(version=(4, 1, 2))
    pair.boot()
    pair.autopilot.parameters['FS_GCS_ENABLE'] = 0.0
    pair.run(4.0)
    assert pair.link.profile.version == (4, 1, 2)
    assert told(pair, 'FS_GCS_ENABLE is 0') == 1
