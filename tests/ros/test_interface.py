"""What a grid of steps and the numbers of a message must be, at the bounds of what is believed."""

import pytest

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import (
    LARGEST,
    BadMessageError,
    check_finite,
    check_state,
    time_grid,
)


@pytest.mark.parametrize(
    ('step', 'duration', 'step_ns', 'last'),
    [
        (0.01, 0.0, 10**7, None),
        (1e-9, 3e-9, 1, 3),
        (0.3, 0.3, 3 * 10**8, 1),
        (0.1, 1e6, 10**8, 10**7),
        (33935.147, 33935.147, 33_935_147 * 10**6, 1),  # as a float 0.004 ns less
    ],
)
def test_a_grid_counts_its_steps_and_has_no_end_without_a_duration(step, duration, step_ns, last):
    assert time_grid(step, duration, 'f') == (step, step_ns, duration, last)


@pytest.mark.parametrize(
    ('step', 'duration', 'key', 'found'),
    [
        (1e-10, 1.0, 'step', '1e-10 s'),
        (0.0100000001, 1.0, 'step', '0.0100000001 s'),
        (0.01, 0.004, 'duration', '0.004 s'),
        (0.1, 0.25, 'duration', '0.25 s'),
        (0.1, 1000.0001, 'duration', '1000.0001 s'),
    ],
)
def test_steps_of_other_than_whole_nanoseconds_and_a_rest_are_refused(step, duration, key, found):
    with pytest.raises(InputError) as caught:
        time_grid(step, duration, 'f')
    assert (caught.value.key, caught.value.found) == (key, found)


def test_the_largest_number_is_believed_and_none_beyond():
    assert check_finite('wrench', (-LARGEST, 0.0)) == (-LARGEST, 0.0)
    with pytest.raises(BadMessageError, match=r'^wrench: absurd: expected at most 1e'):
        check_finite('wrench', (0.0, 1.001 * LARGEST))


@pytest.mark.parametrize(
    ('norm', 'fits'), [(0.9991, True), (1.0009, True), (0.9989, False), (1.0011, False)]
)
def test_the_norm_of_a_quaternion_may_be_a_thousandth_off(norm, fits):
    x = (0.0, 0.0, 0.0, 0.6 * norm, 0.0, 0.0, -0.8 * norm, *[0.0] * 6)
    if fits:
        assert check_state('odom', x) == x
    else:
        with pytest.raises(BadMessageError, match='odom: orientation: expected a unit quaternion'):
            check_state('odom', x)
