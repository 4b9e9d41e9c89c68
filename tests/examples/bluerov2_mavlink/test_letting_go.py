"""However the driver lets go, the input that ArduSub would keep for ever becomes neutral."""

from collections.abc import Callable

import numpy as np
import pytest
from ardusub_autopilot import ALT_HOLD, STABILIZE
from mavlink_pair import Pair, nothing
from pilot import LEAST, MOST
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
    pair.run(2.5, tau=PUSH)
    assert pair.autopilot.channels == NEUTRAL
    before, mode = inputs(pair), pair.autopilot.mode
    pair.run(2.0, tau=PUSH)
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
    unseen.link._takers.pop('SERVO_OUTPUT_RAW')
    counts = []
    for pair in (seen, unseen):
        before = inputs(pair)
        pair.link.pilot.want(False, pair.now)
        pair.run(3.0, tau=PUSH)
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


@pytest.mark.parametrize('phase', [0.0, 0.012])
@pytest.mark.parametrize('every', [0.02, 0.04, 0.052, 0.1])
def test_a_joystick_in_the_same_mode_is_noticed_and_given_way(every: float, phase: float) -> None:
    pair = Pair().flown(PUSH)
    pair.run(phase, PUSH)
    pair.steer(8.0, x=-600, every=every)
    assert any('another pilot steers' in line for line in pair.said)
    before = inputs(pair)
    pair.steer(1.0, x=-600)
    assert inputs(pair) == before
    assert pair.autopilot.channels[4] < 1450
    assert pair.autopilot.armed, 'it is the pilot who has it now'


def test_its_own_inputs_are_no_other_pilot() -> None:
    pair = Pair().flown(PUSH)
    for i in range(20):
        pair.run(0.5, tau=PUSH * np.sin(i))
    count = iter(range(10**6))
    pair.up = lambda data: b'' if next(count) % 3 == 0 else data
    pair.run(3.0, tau=PUSH)
    pair.up = nothing
    pair.run(0.4, tau=PUSH)
    pair.up = bytes
    pair.run(1.0, tau=PUSH)
    assert pair.link.pilot.commands
