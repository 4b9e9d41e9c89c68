"""Boot time to local time: the quickest exchange counts, a new boot is noticed."""

import numpy as np
import pytest
from boot_clock import ENOUGH, BootClock, Exchange
from navigation import turned
from numpy.testing import assert_allclose

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
        assert clock.add(exchange(1000 * i, 3.0, 9.0))
    for one in more:
        assert clock.add(one)
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


def test_another_boot_is_noticed() -> None:
    clock = known()
    assert not clock.add(exchange(9000, 1.0, 1.0, offset=OFFSET + 8000 * MS))
    assert clock.local(0) is None


def test_attitude_turns_on_with_its_body_rates() -> None:
    q, rates = quaternion(np.array([0.2, -0.3, 1.0])), np.array([0.4, -0.5, 0.6])
    fine, steps = q.copy(), 500
    for _ in range(steps):
        fine += np.array(attitude_rate(fine, np.array([0, 0, 0, *rates]))) * 0.1 / steps
    assert_allclose(turned(q, rates, 0.1), fine, atol=1e-5)
    assert np.linalg.norm(turned(q, rates, 0.1)) == pytest.approx(1.0, abs=1e-12)
