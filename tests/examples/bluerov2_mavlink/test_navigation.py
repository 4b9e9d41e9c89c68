"""Boot time to local time: the quickest exchange counts, several that agree are believed."""

import numpy as np
import pytest
from helpers.mavlink_pair import SECOND, Pair
from navigation import ENOUGH, KEPT, BootClock, Exchange, Navigation, RestartedError, turned
from numpy.testing import assert_allclose
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from auv_dynamics.vehicle.kinematics import attitude_rate, quaternion

MS = 1_000_000
OFFSET = 12_345 * MS


def exchange(at: int, there: float, back: float, offset: int = OFFSET) -> Exchange:
    """Sent at `at` ms, so many ms on the way there and back."""
    sent = at * MS
    answered = sent + round(there * MS)
    return Exchange(sent, answered - offset, answered + round(back * MS))


def known(*more: Exchange) -> BootClock:
    clock = BootClock()
    for i in range(ENOUGH):
        clock.add(exchange(1000 * i, 3.0, 9.0))
    for one in more:
        clock.add(one)
    return clock


def test_nothing_is_known_before_enough_exchanges() -> None:
    clock = BootClock()
    for i in range(ENOUGH - 1):
        clock.add(exchange(i, 1.0, 1.0))
        assert clock.local(0) is None
    clock.add(exchange(9, 1.0, 1.0))
    assert clock.local(7 * MS) == OFFSET + 7 * MS


def test_wrong_by_at_most_half_the_quickest_round_trip() -> None:
    clock = known()
    assert clock.uncertainty == 0.006
    assert abs(clock.local(0) - OFFSET) <= 0.006 * 1e9
    better = known(exchange(9000, 0.2, 0.4))
    assert abs(better.local(0) - OFFSET) <= 0.0003 * 1e9


def test_a_slow_exchange_is_no_new_boot() -> None:
    clock = known(exchange(9000, 900.0, 1.0))
    assert clock.uncertainty == 0.006


def test_a_single_exchange_of_another_offset_changes_nothing() -> None:
    clock = known()
    for i in range(20):  # every other one
        clock.add(exchange(9000 + 100 * i, 1.0, 1.0, offset=OFFSET + (i % 2) * 8000 * MS))
        assert clock.local(0) == pytest.approx(OFFSET, abs=6 * MS)


def test_several_that_agree_are_another_boot() -> None:
    clock = known()
    boot = OFFSET + 8000 * MS  # 12 s later than the last exchange: it was heard again after 10 s
    for i in range(ENOUGH - 1):
        clock.add(exchange(22_000 + 100 * i, 1.0, 1.0, offset=boot))
    with pytest.raises(RestartedError, match=r'boot time is 2\.2 s'):
        clock.add(exchange(22_500, 1.0, 1.0, offset=boot))
    assert clock.local(0) is None


def test_a_clock_that_stood_still_is_no_other_boot() -> None:
    clock = known(exchange(20_000, 1.0, 1.0))
    for i in range(ENOUGH):
        clock.add(exchange(21_000 + 100 * i, 1.0, 1.0, offset=OFFSET + 300 * MS))
    assert clock.local(0) == OFFSET + 300 * MS


def attitude(ms: int, *numbers: float) -> mavlink.MAVLink_attitude_message:
    return mavlink.MAVLink_attitude_message(ms, *(numbers or [0.0] * 6))


def position(ms: int, *numbers: float) -> mavlink.MAVLink_local_position_ned_message:
    return mavlink.MAVLink_local_position_ned_message(ms, *(numbers or [0.0] * 6))


def test_a_position_without_an_attitude_of_its_time_is_no_odometry() -> None:
    navigation = Navigation(known())
    assert navigation.position(position(800)) is None
    navigation.attitude(attitude(1000))
    given = [navigation.position(position(ms)) for ms in (899, 900, 900, 1100, 1099, 1101)]
    assert [sample is None for sample in given] == [True, False, True, False, True, True]


def test_attitude_is_turned_to_the_time_of_the_position() -> None:
    navigation = Navigation(known())
    navigation.attitude(attitude(1000, 0.0, 0.0, 0.3, 0.0, 0.0, 2.0))
    sample = navigation.position(position(1050, 1.0, 2.0, 3.0, 0.5, 0.0, 0.25))
    assert sample.ns == known().local(1050 * MS)
    body = [0.5 * np.cos(0.4), -0.5 * np.sin(0.4), 0.25, 0.0, 0.0, 2.0]
    half = [np.cos(0.2), 0.0, 0.0, np.sin(0.2)]
    assert_allclose(sample.x, [1.0, 2.0, 3.0, *half, *body], atol=1e-12)


def test_boot_times_that_fall_back_far_are_of_another_boot() -> None:
    navigation = Navigation(known())
    navigation.attitude(attitude(5000))
    navigation.attitude(attitude(4000, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    assert navigation.position(position(5000)).x[3] == 1.0, 'what comes late is not taken'
    with pytest.raises(RestartedError, match='fell back from 5000 ms to 3999 ms'):
        navigation.position(position(3999))
    navigation.reset()
    assert navigation.position(position(5010)) is None, 'its attitude is forgotten'


def test_offsets_agree_as_far_as_the_ways_may_have_been_uneven() -> None:
    one = exchange(0, 3.0, 9.0)  # half the round trips: 6 and 2 ms
    for apart, agrees in ((50 + 6 + 2, True), (50 + 6 + 2 + 1, False)):  # ms
        for sign in (1, -1):
            other = exchange(0, 2.0, 2.0, offset=one.offset + sign * apart * MS)
            assert one.agrees(other) == other.agrees(one) == agrees


def test_exchanges_that_do_not_agree_with_each_other_are_no_boot() -> None:
    clock = known()
    for i in range(2 * ENOUGH):
        clock.add(exchange(22_000 + 100 * i, 1.0, 1.0, offset=OFFSET + (8 + i) * 1000 * MS))
    assert clock.local(0) == known().local(0)
    assert (known().settled, clock.settled) == (True, False)
    clock.add(exchange(30_000, 1.0, 1.0))
    assert clock.settled
    clock.reset()
    assert (clock.settled, clock.uncertainty) == (False, None)


def test_a_quick_exchange_is_forgotten_when_crystals_have_parted() -> None:
    clock = known(exchange(9000, 0.2, 0.4))
    for i in range(KEPT - 1):
        clock.add(exchange(10_000 + 1000 * i, 3.0, 9.0))
    assert clock.uncertainty == 0.0003
    clock.add(exchange(99_000, 3.0, 9.0))
    assert clock.uncertainty == 0.006


@pytest.mark.parametrize('seconds', [0.3, 1.5])
def test_a_vehicle_that_stood_still_is_not_let_go_and_its_stamps_are_of_now_again(seconds) -> None:
    pair = Pair().flown([5.0, 0, 0, 0, 0, 0])
    pair.run(3.0, tau=[5.0, 0, 0, 0, 0, 0])
    pair.stand_still(seconds)
    pair.run(2.0, tau=[5.0, 0, 0, 0, 0, 0])
    assert pair.link.pilot.commands
    assert 0 <= pair.now - pair.samples[-1].ns < 0.05 * SECOND
    assert not [line for line in pair.said if 'restarted' in line]


def test_a_vehicle_that_is_heard_again_late_may_be_another_boot() -> None:
    pair = Pair()
    pair.run(3.0)
    pair.down = pair.up = lambda _: b''
    pair.boot()
    pair.run(6.0)
    pair.down = pair.up = bytes
    pair.run(2.5)
    assert [line for line in pair.said if 'vehicle restarted' in line]
    assert 0 <= pair.now - pair.samples[-1].ns < 0.05 * SECOND


def test_attitude_turns_on_with_its_body_rates() -> None:
    q, rates = quaternion(np.array([0.2, -0.3, 1.0])), np.array([0.4, -0.5, 0.6])
    fine, steps = q.copy(), 500
    for _ in range(steps):
        fine += np.array(attitude_rate(fine, np.array([0, 0, 0, *rates]))) * 0.1 / steps
    assert_allclose(turned(q, rates, 0.1), fine, atol=1e-5)
    assert np.linalg.norm(turned(q, rates, 0.1)) == pytest.approx(1.0, abs=1e-12)
