"""The link against an ArduSub-like autopilot: what it asks, refuses, lets go and takes up."""

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from ardusub_autopilot import ALT_HOLD
from helpers.mavlink_pair import SECOND, Booted, Pair, nothing
from numpy.testing import assert_allclose
from pilot import MANUAL
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from vehicle_link import LinkSettings, VehicleLink
from wrench_mapping import MANUAL_CONTROL

MOVING = Booted(eta=(1.0, -2.0, 3.0, 0.2, -0.3, 2.0), nu=(0.5, -0.3, 0.2, 0.1, 0.2, -0.3))
PUSH = np.array([10.0, 0, 0, 0, 0, 0])
NEUTRAL = [1500] * 6


def sent(pair: Pair, kind: str) -> list:
    return [message for message in pair.sent if message.get_type() == kind]


def orders(pair: Pair, command: int) -> list:
    return [message for message in sent(pair, 'COMMAND_LONG') if message.command == command]


def said(pair: Pair, *words: str) -> bool:
    return any(all(word in line for word in words) for line in pair.said)


def pulses(pair: Pair) -> list[int]:
    return pair.autopilot.pulses


def test_odometry_is_the_state_of_the_vehicle_at_its_stamp() -> None:
    pair = Pair(MOVING)
    pair.run(2.0)
    assert len(pair.samples) > 60
    sample, plant = pair.samples[-1], pair.autopilot.plant
    behind = pair.now - sample.ns
    assert 0 <= behind <= 40_000_000
    turned = 0.5 * 0.04  # by which it may have moved on since
    assert_allclose(sample.x, plant.x, atol=turned)
    assert np.linalg.norm(sample.x[3:7]) == pytest.approx(1.0, abs=1e-9)
    assert np.abs(np.diff([s.ns for s in pair.samples]) - 0.02 * SECOND).max() <= 0.006 * SECOND


def test_rate_and_patience_are_those_that_were_asked_for() -> None:
    pair = Pair(MOVING, LinkSettings(rate=20.0, timeout=SECOND // 4))
    pair.run(2.0)
    steps = np.diff([sample.ns for sample in pair.samples])
    assert np.median(steps) == pytest.approx(SECOND // 20, rel=0.15)
    assert pair.link.voltage == 16.0
    pair.down = nothing
    pair.run(0.2)
    assert pair.link.hears()
    pair.run(0.2)
    assert not pair.link.hears()


def test_the_vehicle_is_asked_for_what_is_needed_and_nothing_moves_unasked() -> None:
    pair = Pair()
    pair.run(2.0, tau=PUSH)
    asked = {int(m.param1) for m in orders(pair, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL)}
    assert asked == {0, 1, 30, 32, 36, 65}
    assert not sent(pair, 'REQUEST_DATA_STREAM'), 'all of them were granted'
    assert not sent(pair, 'HEARTBEAT')
    assert not orders(pair, mavlink.MAV_CMD_COMPONENT_ARM_DISARM)
    assert not sent(pair, 'RC_CHANNELS_OVERRIDE')
    assert not pair.autopilot.armed


def test_mode_is_set_and_armed_once_wrenches_come() -> None:
    pair = Pair(Booted(mode=ALT_HOLD))
    pair.link.pilot.want(True, pair.now)
    pair.run(2.0)
    assert (pair.autopilot.mode, pair.autopilot.armed) == (MANUAL, False)
    pair.run(2.0, tau=PUSH)
    assert pair.autopilot.armed
    assert pair.autopilot.plant.x[7] > 0.1


def test_silence_of_the_wrench_is_neutral_then_disarmed_and_arms_again_with_it() -> None:
    pair = Pair().flown(PUSH)
    assert max(pulses(pair)) > 1550
    pair.run(0.8)
    assert pulses(pair) == [1500] * 8
    assert pair.autopilot.armed
    pair.run(3.0)
    assert not pair.autopilot.armed
    pair.run(2.5, tau=PUSH)
    assert pair.autopilot.armed
    assert max(pulses(pair)) > 1550


def test_asked_to_let_go_it_is_neutral_and_disarmed() -> None:
    pair = Pair().flown(PUSH)
    pair.link.pilot.want(False, pair.now)
    pair.run(1.2, tau=PUSH)
    assert not pair.autopilot.armed
    before = len(sent(pair, 'RC_CHANNELS_OVERRIDE'))
    pair.run(2.0, tau=PUSH)
    assert not pair.autopilot.armed
    assert len(sent(pair, 'RC_CHANNELS_OVERRIDE')) == before


def test_a_short_loss_of_the_link_gives_no_odometry_no_old_command_and_recovers() -> None:
    pair = Pair().flown(PUSH)
    pair.down, before = nothing, len(pair.samples)
    pair.run(1.5, tau=PUSH)
    assert len(pair.samples) == before
    assert pulses(pair) == [1500] * 8
    pair.link.command(pair.mapping.axes(PUSH)[0], pair.now)  # of who needs no odometry
    pair.run(0.1)
    assert pulses(pair) == [1500] * 8
    assert said(pair, 'vehicle not heard: neutral')
    pair.down = bytes
    pair.run(0.5, tau=PUSH)
    assert said(pair, 'heard again')
    assert max(pulses(pair)) > 1550
    stamps = [sample.ns for sample in pair.samples]
    assert all(a < b for a, b in pairwise(stamps))


@pytest.mark.parametrize('seconds', [1.8, 4.8])
def test_a_long_loss_is_disarmed_by_the_vehicle_and_wants_to_be_asked_again(seconds) -> None:
    pair = Pair().flown(PUSH)
    pair.up = pair.down = nothing
    pair.run(1.2, tau=PUSH)
    assert max(pulses(pair)) > 1550, 'the last input stays'
    pair.run(seconds, tau=PUSH)
    assert not pair.autopilot.armed, 'the failsafe of ArduSub'
    pair.up, pair.down = bytes, lambda data: b'' if data[7:10] == bytes(3) else data
    pair.run(0.3)  # an acknowledgement comes before a heartbeat, and both before a wrench
    pair.down = bytes
    pair.run(3.0, tau=PUSH)
    assert not pair.autopilot.armed
    assert pair.autopilot.channels == NEUTRAL, 'whoever arms it next finds it at rest'
    assert said(pair, 'disarmed by the vehicle or by somebody else', '~/arm')
    pair.link.pilot.want(True, pair.now)
    pair.run(2.0, tau=PUSH)
    assert pair.autopilot.armed


def test_a_driver_that_stood_still_wants_to_be_asked_again() -> None:
    pair = Pair().flown(PUSH)
    link, waiting = pair.link, []
    pair.link = SimpleNamespace(receive=lambda m, _: waiting.append(m), tick=lambda _: None)
    pair.run(3.5)
    pair.link = link
    for message in waiting[:100]:  # as many as the socket keeps, the oldest
        link.receive(message, pair.now)
    pair.run(2.0, tau=PUSH)
    assert said(pair, 'this driver stood still for 3.5 s')
    assert not pair.autopilot.armed


def test_a_driver_that_was_not_asked_may_stand_still() -> None:
    pair = Pair()
    pair.run(1.0)
    link = pair.link
    pair.link = SimpleNamespace(receive=lambda *_: None, tick=lambda _: None)
    pair.run(3.5)
    pair.link = link
    pair.run(0.1)
    assert not said(pair, 'stood still')


@pytest.mark.parametrize('asked', [False, True])
def test_a_driver_that_follows_a_killed_one_does_not_keep_its_last_input_alive(asked) -> None:
    pair = Pair().flown(PUSH)
    pair.link = VehicleLink(LinkSettings(), pair._ups.send, pair.said.append)
    pair.link.pilot.want(asked, pair.now)
    pair.run(3.0)
    assert pulses(pair) == [1500] * 8
    assert not pair.autopilot.armed or asked


def test_a_restart_of_the_vehicle_is_noticed_and_stamps_go_on() -> None:
    pair = Pair().flown(PUSH)
    pair.run(1.0, tau=PUSH)
    before, last = len(pair.samples), pair.samples[-1].ns
    pair.boot()
    pair.run(3.0, tau=PUSH)
    assert said(pair, 'vehicle restarted')
    assert not pair.autopilot.armed
    after = [sample.ns for sample in pair.samples[before:]]
    assert len(after) > 50
    assert min(after) > last
    assert all(0 <= pair.now - ns <= 4 * SECOND for ns in after)
    assert_allclose(pair.samples[-1].x[7:], pair.autopilot.plant.x[7:], atol=0.01)


def test_of_what_was_sent_to_a_vehicle_that_shows_no_inputs_little_is_kept() -> None:
    pair = Pair()
    pair.down = lambda data: b'' if data[7] == mavlink.MAVLINK_MSG_ID_RC_CHANNELS else data
    pair.flown(PUSH).run(1.8, tau=PUSH)
    assert 90 < len(pair.link._inputs) <= 101, 'of two seconds, at 50 Hz'
    assert max(pulses(pair)) > 1550


def test_messages_of_others_are_dropped_and_counted() -> None:
    pair = Pair(MOVING)
    pair.run(1.0)
    refused, before = pair.link.refused, len(pair.samples)
    stranger = mavlink.MAVLink(None, srcSystem=7, srcComponent=1)
    bad = mavlink.MAVLink_local_position_ned_message(10**6, 9, 9, 9, 9, 9, 9).pack(stranger)
    pair._downs.write(bytes(bad))
    pair.run(0.004)
    assert pair.link.refused == refused + 1
    offset, other = pair.link.clock.local(0), 3000 * SECOND  # of another station's clock
    for i in range(40):
        boot_time = pair.now - pair.booted
        asked = pair.now + (SECOND // 100 if i % 2 else -other)
        pair._downs.send(mavlink.MAVLink_timesync_message(boot_time, asked))
        pair.run(0.004)
    assert pair.link.clock.local(0) == offset
    pair.run(1.0)
    assert len(pair.samples) > before + 40


@pytest.mark.parametrize('spoil', [lambda d: d[:-3] + b'xyz', lambda d: d[: len(d) // 2],
                                   lambda d: b'noise', lambda d: b'\xfd' + d])  # fmt: skip
def test_broken_datagrams_are_counted_and_harm_nothing_behind_them(spoil) -> None:
    pair = Pair(MOVING)
    pair.run(1.0)
    count = iter(range(10**6))
    pair.down = lambda data: spoil(data) if next(count) % 2 else data
    before, refused = len(pair.samples), pair.link.refused
    pair.run(1.0)
    assert pair.link.refused == refused
    assert len(pair.samples) > before
    pair.down = bytes
    pair.run(1.0)
    assert_allclose(pair.samples[-1].x[7:], pair.autopilot.plant.x[7:], atol=0.02)


@pytest.mark.parametrize(
    ('kind', 'part', 'text'),
    [
        ('position', 'vx', 'LOCAL_POSITION_NED: expected finite numbers'),
        ('attitude', 'roll', 'ATTITUDE: expected finite numbers'),
        ('attitude', 'yawspeed', 'ATTITUDE: expected finite numbers'),
        ('parameter', 'param_value', 'PARAM_VALUE: expected a finite RC_OPTIONS'),
    ],
)
def test_numbers_that_are_none_are_refused_and_said(kind, part, text) -> None:
    pair = Pair()
    pair.run(1.0)
    refused, before = pair.link.refused, len(pair.samples)
    message = {
        'position': mavlink.MAVLink_local_position_ned_message(2000, *[0.0] * 6),
        'attitude': mavlink.MAVLink_attitude_message(2000, *[0.0] * 6),
        'parameter': mavlink.MAVLink_param_value_message(b'RC_OPTIONS', 0.0, 9, 1, 0),
    }[kind]
    setattr(message, part, math.nan)
    pair._downs.send(message)
    pair.run(0.004)
    assert pair.link.refused == refused + 1
    assert said(pair, 'refused', text)
    assert all(np.isfinite(sample.x).all() for sample in pair.samples[before:])


def test_a_copter_is_no_submarine() -> None:
    pair = Pair()
    pair._downs.send(mavlink.MAVLink_heartbeat_message(2, 3, 128, 19, 4, 3))
    pair.run(0.004)
    assert said(pair, 'expected a submarine of ArduPilot (12, 3), found (2, 3)')
    assert not pair.link.pilot.armed


def test_manual_control_undoes_the_pilot_gain() -> None:
    pair = Pair(Booted(gain=0.5), LinkSettings(how=MANUAL_CONTROL))
    pair.flown()
    assert (pair.link.gain, pair.link.gain_from) == (0.5, 'PilotGain')
    pair.run(0.4, tau=[8.0, 6.0, 10.0, 0.0, 0.0, 1.0])
    assert len(sent(pair, 'MANUAL_CONTROL')) > 20
    assert not sent(pair, 'RC_CHANNELS_OVERRIDE')
    nu = pair.autopilot.plant.x[7:]
    assert all(nu[i] > 0.05 for i in (0, 1, 2, 5))
    pair.run(0.5, tau=[200.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert pair.share * 200.0 < 40.0, 'a gain of 0.5 leaves a quarter of the thrust'
