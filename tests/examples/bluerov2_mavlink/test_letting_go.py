"""However the driver lets go, the input that ArduSub would keep for ever becomes neutral."""

from collections.abc import Callable

import numpy as np
import pytest
from ardusub_autopilot import ALT_HOLD, STABILIZE
from helpers.mavlink_pair import Booted, Pair, nothing
from pilot import LEAST, MOST
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from vehicle_link import LinkSettings
from wrench_mapping import MANUAL_CONTROL, OVERRIDE

PUSH = np.array([12.0, 0, 8.0, 0, 0, 1.0])
NEUTRAL = [1500] * 6
INPUTS = {'RC_CHANNELS_OVERRIDE', 'MANUAL_CONTROL'}
OWN: dict[str, Callable[[Pair], object]] = {
    'service': lambda pair: pair.link.pilot.want(False, pair.now),
}
FOREIGN: dict[str, Callable[[Pair], object]] = {
    'ALT_HOLD': lambda pair: pair.autopilot.set_mode(ALT_HOLD),
    'STABILIZE': lambda pair: pair.autopilot.set_mode(STABILIZE),
    'disarmed': lambda pair: pair.autopilot.arm(False, 0),
    'restart': lambda pair: pair.boot(),
}


def inputs(pair: Pair) -> int:
    return sum(message.get_type() in INPUTS for message in pair.sent)


@pytest.mark.parametrize('how', [OVERRIDE, MANUAL_CONTROL])
@pytest.mark.parametrize('way', [*OWN, *FOREIGN])
def test_the_input_becomes_neutral_and_then_nothing_is_sent(way: str, how: str) -> None:
    pair = Pair(link=LinkSettings(how=how)).flown(PUSH)
    assert pair.autopilot.channels != NEUTRAL
    {**OWN, **FOREIGN}[way](pair)
    pair.run(1.5, tau=PUSH)
    assert pair.autopilot.channels == NEUTRAL
    before, mode = inputs(pair), pair.autopilot.mode
    pair.run(1.5, tau=PUSH)
    assert pair.autopilot.channels == NEUTRAL
    assert (inputs(pair), pair.autopilot.mode) == (before, mode), 'nothing is taken back'
    assert np.abs(np.array(pair.autopilot.pulses) - 1500).max() < 100, 'it may stabilise itself'


@pytest.mark.parametrize('way', ['service', 'ALT_HOLD'])
def test_half_of_it_may_be_lost_on_the_way(way: str) -> None:
    pair = Pair().flown(PUSH)
    count = iter(range(10**6))
    pair.up = lambda data: b'' if next(count) % 2 else data
    {**OWN, **FOREIGN}[way](pair)
    pair.run(2.0, tau=PUSH)
    assert pair.autopilot.channels == NEUTRAL


def test_it_goes_on_until_the_motors_are_seen_at_rest() -> None:
    seen, unseen = Pair().flown(PUSH), Pair().flown(PUSH)
    motors = unseen.link._takers.pop('SERVO_OUTPUT_RAW')
    counts = []
    for pair in (seen, unseen):
        before = inputs(pair)
        pair.link.pilot.want(False, pair.now)
        pair.run(0.5, tau=PUSH)
        lights = mavlink.MAVLink_servo_output_raw_message(0, 1, *[1500] * 8)  # outputs 17 to 24
        motors(lights, 0)
        pair.run(2.5, tau=PUSH)
        counts.append(inputs(pair) - before)
    assert LEAST <= counts[0] < MOST
    assert counts[1] == MOST


def test_nothing_is_sent_into_a_vehicle_that_was_never_taken() -> None:
    pair = Pair()
    pair.run(1.0)
    pair.autopilot.set_mode(STABILIZE)
    pair.steer(0.5)
    pair.link.pilot.want(False, pair.now)
    pair.steer(0.5)
    assert inputs(pair) == 0


@pytest.mark.parametrize('mode', [STABILIZE, ALT_HOLD])
def test_a_joystick_that_takes_over_with_a_mode_is_not_hindered(mode: int) -> None:
    pair = Pair().flown(PUSH)
    pair.autopilot.set_mode(mode)
    pair.steer(1.5)
    before = inputs(pair)
    pair.steer(1.0)
    assert inputs(pair) == before
    assert pair.autopilot.channels[4] > 1550
    assert 'set by somebody else' in pair.said[-1]


@pytest.mark.parametrize(
    ('every', 'phase', 'how'),
    [(0.02, 0.0, OVERRIDE), (0.052, 0.012, OVERRIDE), (0.1, 0.0, OVERRIDE), (0.1, 0.012, OVERRIDE),
     (0.04, 0.0, MANUAL_CONTROL), (0.1, 0.012, MANUAL_CONTROL)],
)  # fmt: skip
def test_a_joystick_in_the_same_mode_is_noticed_and_given_way(every, phase, how) -> None:
    pair = Pair(link=LinkSettings(how=how)).flown(PUSH)
    pair.run(phase, PUSH)
    for _ in range(8):
        if pair.link.pilot.commands:
            pair.steer(1.0, x=-600, every=every)
    assert any('another pilot steers' in line for line in pair.said)
    before = inputs(pair)
    pair.steer(1.0, x=-600)
    assert inputs(pair) == before
    assert pair.autopilot.channels[4] < 1450
    assert pair.autopilot.armed, 'it is the pilot who has it now'


@pytest.mark.parametrize(
    ('how', 'gain', 'heave'), [(OVERRIDE, 0.5, 1.0), (MANUAL_CONTROL, 0.5, 1.0),
                               (MANUAL_CONTROL, 0.37, 1.7)],
)  # fmt: skip
def test_its_own_inputs_are_no_other_pilot(how: str, gain: float, heave: float) -> None:
    pair = Pair(Booted(gain=gain), LinkSettings(how=how))
    pair.autopilot.parameters['JS_THR_GAIN'] = heave
    pair.flown(PUSH)
    down = np.array([0.0, 0.0, 6.0, 0.0, 0.0, 0.0])
    for i in range(8):
        pair.run(0.5, tau=PUSH * np.sin(i) + down)
    count = iter(range(10**6))
    pair.up = lambda data: b'' if next(count) % 3 == 0 else data
    pair.run(3.0, tau=PUSH)
    pair.up = nothing
    pair.run(0.4, tau=PUSH)
    pair.up = bytes
    pair.run(1.0, tau=PUSH)
    assert pair.link.pilot.commands


def test_a_vehicle_that_takes_other_inputs_than_those_sent_is_disarmed() -> None:
    pair = Pair(link=LinkSettings(how=MANUAL_CONTROL))
    take = pair.autopilot._takers['MANUAL_CONTROL']

    def with_input_hold(message, now: int) -> None:
        message.x += 300
        take(message, now)

    pair.autopilot._takers['MANUAL_CONTROL'] = with_input_hold
    pair.link.pilot.want(True, pair.now)
    pair.run(1.5, tau=PUSH)
    assert pair.autopilot.armed
    pair.run(4.0, tau=PUSH)
    assert not pair.autopilot.armed, 'nor armed again'
    assert any('not those sent' in line for line in pair.said)


def test_inputs_that_stand_before_it_comes_are_said_once() -> None:
    pair = Pair()
    pair.steer(1.0)
    pair.flown(PUSH)
    assert (
        sum('inputs were (1500, 1500, 1500, 1500, 1620, 1500)' in line for line in pair.said) == 1
    )


def test_another_station_of_its_id_is_said_since_it_hides_a_loss_of_this_one() -> None:
    pair = Pair().flown(PUSH)
    other = mavlink.MAVLink(pair._downs, srcSystem=255, srcComponent=190)
    for _ in range(3):
        other.heartbeat_send(6, 8, 0, 0, 4)
        pair.run(1.0, tau=PUSH)
    assert [text for text in pair.said if 'another station has the id' in text] == pair.said
    assert pair.link.differences == pair.said
    assert pair.link.pilot.commands
