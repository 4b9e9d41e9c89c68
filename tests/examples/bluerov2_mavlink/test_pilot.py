"""The hand on the vehicle, moment by moment: what it sends, and what it takes for its own."""

import pytest
from pilot import (
    AGAIN,
    ARMING,
    DISARM_AGAIN,
    KEEP_ALIVE,
    LEAST,
    LETTING_GO,
    MANUAL,
    MOST,
    ON_ITS_WAY,
    Deed,
    Pilot,
)
from wrench_mapping import NEUTRAL, PilotAxes

START, FED, DISARM = 10_000_000_000, 500_000_000, 3_000_000_000  # ns
PUSH, OTHER = PilotAxes(forward=0.5), PilotAxes(yaw=-0.2)
ALT_HOLD = 2


def asked() -> Pilot:
    """A vehicle in MANUAL that is to be armed, with a wrench at `START`."""
    pilot = Pilot(FED, DISARM)
    pilot.want(True, START)
    assert (pilot.vehicle(False, MANUAL, START), pilot.why) == ('', '')
    pilot.command(PUSH, START)
    assert pilot.due(START, True, fresh=True) == Deed(True, axes=NEUTRAL), 'not armed yet'
    return pilot


def taken() -> Pilot:
    pilot = asked()
    assert pilot.vehicle(True, MANUAL, START) == ''
    assert pilot.commands
    return pilot


def sent(pilot: Pilot, first: int, steps: int = 100) -> tuple[list[int], list[int]]:
    """Times after the first at which it disarms, and those at which it sends neutral inputs."""
    deeds = {k: pilot.due(first + k * LETTING_GO // 2, True) for k in range(steps)}
    assert {deed.axes for deed in deeds.values()} <= {None, NEUTRAL}
    return [k for k, one in deeds.items() if one.arm is False], [
        k for k, one in deeds.items() if one.axes is not None
    ]


def test_a_wrench_counts_up_to_its_limit_and_is_sent_at_once_or_again_and_again() -> None:
    pilot = taken()
    assert pilot.due(START + 1, True) == Deed()
    assert pilot.due(START + 1, True, fresh=True) == Deed(axes=PUSH)
    pilot.command(OTHER, START + 2)
    assert pilot.due(START + KEEP_ALIVE, True) == Deed()
    assert pilot.due(START + KEEP_ALIVE + 1, True) == Deed(axes=OTHER)
    assert pilot.due(START + 2 + FED, False) == Deed(axes=OTHER), 'held although not ready'
    assert (pilot.is_fed(START + 2 + FED), pilot.is_fed(START + 3 + FED)) == (True, False)
    assert pilot.due(START + 3 + FED, True, fresh=True) == Deed()
    assert pilot.due(START + 2 + FED + KEEP_ALIVE, True) == Deed(axes=NEUTRAL)
    unheard = taken()
    unheard.silence()
    assert unheard.due(START + KEEP_ALIVE, False) == Deed(axes=NEUTRAL)


def test_silence_beyond_its_limit_disarms_until_a_wrench_comes() -> None:
    pilot = taken()
    assert pilot.due(START + DISARM, True).arm is None
    late = START + DISARM + 1
    found = [pilot.due(late + after, True).arm for after in (0, DISARM_AGAIN - 1, DISARM_AGAIN)]
    assert found == [False, None, False]
    assert not pilot.commands
    pilot.command(OTHER, late + DISARM_AGAIN)
    assert pilot.due(late + DISARM_AGAIN, True, fresh=True) == Deed(axes=OTHER)
    again = late + DISARM_AGAIN + DISARM + 1
    assert pilot.due(again, True).arm is False
    assert pilot.vehicle(False, MANUAL, again) == '', 'as it has asked for'
    pilot.command(PUSH, again + 1)
    assert pilot.due(again + 1, True).arm is True


def test_without_any_wrench_silence_begins_when_it_is_asked() -> None:
    pilot = Pilot(FED, DISARM)
    pilot.want(True, START)
    pilot.vehicle(True, MANUAL, START)  # armed by somebody else
    assert pilot.due(START + DISARM, True) == Deed(axes=NEUTRAL)
    assert pilot.due(START + DISARM + 1, True) == Deed(False)
    again = taken()
    again.want(True, START + 1)
    assert (again.is_fed(START + 1), again.commands) == (False, True)
    assert again.due(START + 1 + KEEP_ALIVE, False) == Deed(), 'it holds nothing any more'
    assert again.due(START + 1 + DISARM, True) == Deed(axes=NEUTRAL)


def test_it_asks_for_mode_and_arms_when_ready_and_not_too_often() -> None:
    pilot = Pilot(FED, DISARM)
    pilot.want(True, START)
    for _ in range(2):
        assert pilot.vehicle(False, ALT_HOLD, START) == '', 'it has not had the mode'
    pilot.command(PUSH, START)
    assert pilot.due(START, False) == Deed()
    found = [pilot.due(START + after, True) for after in (0, AGAIN - 1, AGAIN)]
    assert found == [Deed(mode=True), Deed(), Deed(mode=True)]
    pilot.vehicle(False, MANUAL, START + AGAIN)
    assert pilot.due(START + AGAIN, True) == Deed(axes=NEUTRAL), 'not armed without a wrench'
    pilot.command(PUSH, START + AGAIN)
    assert pilot.due(START + AGAIN, False) == Deed(), 'nor before it is ready'
    armed = [pilot.due(START + AGAIN + after, True).arm for after in (0, AGAIN - 1)]
    pilot.command(PUSH, START + 2 * AGAIN)
    assert [*armed, pilot.due(START + 2 * AGAIN, True).arm] == [True, None, True]


@pytest.mark.parametrize(
    ('armed', 'mode', 'said'),
    [(False, MANUAL, 'disarmed by the vehicle or by somebody else'),
     (True, ALT_HOLD, f'mode {ALT_HOLD} set by somebody else')],
)  # fmt: skip
def test_what_somebody_else_takes_is_left_with_few_neutral_inputs(armed, mode, said) -> None:
    pilot = taken()
    assert pilot.vehicle(armed, mode, START) == f'{said}: not commanded until ~/arm is called'
    assert (pilot.wanted, pilot.why, pilot.commands) == (False, said, False)
    pilot.command(PUSH, START)
    disarms, neutral = sent(pilot, START + LETTING_GO)
    assert (disarms, neutral) == ([], [2 * k for k in range(LEAST)])
    assert not pilot.letting_go
    assert pilot.vehicle(False, ALT_HOLD, START) == '', 'no more of ours'
    pilot.want(True, START)
    assert pilot.vehicle(True, ALT_HOLD, START) == '', 'the mode is anew to be had'
    steered = taken()
    for start in (START, START + 10 * AGAIN):
        steered.let_go('another pilot')
        assert (steered.commands, steered.letting_go) == (False, True)
        assert len(sent(steered, start + LETTING_GO)[1]) == LEAST
        steered.want(True, start)
        assert steered.due(start + 9 * AGAIN, True).axes == NEUTRAL
    silent = taken()
    assert silent.due(START + DISARM + 1, True).arm is False
    assert silent.vehicle(True, ALT_HOLD, START + DISARM + 1) != ''
    assert sent(silent, START + 2 * DISARM)[0] == [], 'somebody else may have it armed'


def test_asked_to_let_go_it_disarms_until_the_vehicle_is_and_its_motors_rest() -> None:
    pilot = taken()
    pilot.want(False, START)
    disarms, neutral = sent(pilot, START + LETTING_GO, 2 * LEAST)
    assert (disarms, neutral) == ([0, 8], [*range(0, 2 * LEAST, 2)])
    pilot.motors(False)
    assert pilot.vehicle(False, MANUAL, START) == ''
    assert pilot.letting_go
    pilot.motors(True)
    assert (pilot.letting_go, pilot.why) == (False, 'asked to disarm')
    unseen = taken()
    unseen.want(False, START)
    unseen.vehicle(False, MANUAL, START)
    for _ in range(LEAST - 1):
        unseen.motors(True)  # as before anything was sent
        sent(unseen, START, 1)
    assert len(sent(unseen, START + LETTING_GO)[1]) == MOST
    never = Pilot(FED, DISARM)
    never.want(True, START)
    never.want(False, START)
    assert (never.letting_go, sent(never, START)) == (False, ([], []))
    never.want(True, START)
    never.vehicle(True, MANUAL, START)  # armed by somebody else
    never.want(False, START)
    assert never.letting_go


@pytest.mark.parametrize(('later', 'disarms'), [(AGAIN - 1, [0]), (AGAIN, [])])
def test_a_vehicle_that_may_be_arming_is_disarmed(later: int, disarms: list[int]) -> None:
    pilot = asked()
    pilot.want(False, START + later)
    assert sent(pilot, START + later + KEEP_ALIVE, 2)[0] == disarms
    if disarms:
        pilot.acknowledged(START + later + KEEP_ALIVE)
        assert sent(pilot, START + later + AGAIN, 2)[0] == disarms, 'it may be the arming that was'
    pilot.want(False, START + later)
    assert not sent(pilot, START + later + 2 * AGAIN, 2)[0], 'not its own any more'


def test_what_is_armed_after_all_is_disarmed_unless_somebody_else_has_taken_it() -> None:
    pilot, taken_over = asked(), asked()
    pilot.want(False, START + AGAIN)
    taken_over.let_go('another pilot')
    for one, disarms in ((pilot, [0, 8]), (taken_over, [])):
        assert sent(one, START + AGAIN + KEEP_ALIVE, 2)[0] == []
        one.acknowledged(START + 2 * AGAIN)
        assert one.armed
        assert sent(one, START + 2 * AGAIN, 10)[0] == disarms
    again = asked()
    again.want(False, START + AGAIN)
    again.want(True, START + AGAIN)
    again.acknowledged(START + 2 * AGAIN)
    assert again.commands


@pytest.mark.parametrize(('later', 'disarms'), [(ARMING - 1, [0, 8]), (ARMING, [])])
def test_a_vehicle_that_has_armed_although_it_was_let_go_is_disarmed_again(later, disarms) -> None:
    pilot = asked()
    pilot.want(False, START + 1)
    assert sent(pilot, START + KEEP_ALIVE, 1)[0] == [0], 'it is lost'
    pilot.vehicle(False, MANUAL, START + KEEP_ALIVE)  # said before it armed
    assert sent(pilot, START + AGAIN, 2)[0] == []
    pilot.vehicle(True, MANUAL, START + later)
    assert sent(pilot, START + 2 * ARMING, 10)[0] == disarms, 'later it is somebody else'


@pytest.mark.parametrize(('later', 'counts'), [(ON_ITS_WAY - 1, False), (ON_ITS_WAY, True)])
def test_an_acknowledgement_is_newer_than_a_heartbeat_on_its_way(later, counts) -> None:
    pilot = asked()
    pilot.acknowledged(START)
    assert pilot.commands
    assert bool(pilot.vehicle(False, MANUAL, START + later)) == counts
    assert pilot.commands is not counts
    gone = taken()
    gone.want(False, START + AGAIN)
    sent(gone, START + AGAIN, 1)
    gone.acknowledged(START + AGAIN)
    assert not gone.armed
    assert sent(gone, START + 2 * AGAIN, 12)[0] == []
    gone.vehicle(True, MANUAL, START + AGAIN + later)
    assert gone.armed == counts


def test_an_acknowledgement_that_may_be_of_something_else_is_not_believed() -> None:
    pilot = asked()
    pilot.silence()
    pilot.acknowledged(START)
    assert not pilot.armed, 'it may have disarmed itself meanwhile'
    early = Pilot(FED, DISARM)
    early.acknowledged(START)
    early.vehicle(True, MANUAL, START + ON_ITS_WAY)
    assert early.armed
    early.acknowledged(START + ON_ITS_WAY)
    assert early.armed, 'it has asked for nothing'


@pytest.mark.parametrize('lost', [False, True])
def test_of_a_vehicle_that_was_not_heard_a_disarming_is_its_failsafe(lost: bool) -> None:
    pilot = taken()
    assert pilot.due(START + DISARM + 1, True).arm is False
    if lost:
        pilot.silence()
    said = pilot.vehicle(False, MANUAL, START + DISARM + 2)
    assert (said != '', pilot.wanted) == (lost, not lost)
    again = taken()
    if lost:
        again.silence()
    assert again.vehicle(True, MANUAL, START) == ''
    assert again.due(START + DISARM + 1, True).arm is False
    assert again.vehicle(False, MANUAL, START + DISARM + 2) == '', 'it was heard before'
