"""The reference filter against the differential equation, and its limits for any input."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from auv_gvc_controller.control.odometry_guard import ZERO
from auv_gvc_controller.control.setpoint_buffer import ReferenceFilter

FREE = (math.inf,) * 6
LIMITS = (3.0,) * 3 + (1.0,) * 3, (0.2,) * 3 + (0.1,) * 3
STEP = (0.5, -4.0, 1.0, 0.0, 2.0, -0.05)


def followed(reference: ReferenceFilter, dt: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    answers = [reference.advance(dt, STEP) for _ in range(round(end / dt))]
    nu_d, nu_d_dot = zip(*answers, strict=True)
    return np.array(nu_d), np.array(nu_d_dot)


@pytest.mark.parametrize('zeta', [0.7, 1.0, 2.0])
def test_without_limits_it_solves_the_equation_to_first_order(zeta: float) -> None:
    omega, r = 2.0, np.array(STEP)

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        v, a = y[:6], y[6:]
        return np.concatenate([a, omega**2 * (r - v) - 2 * zeta * omega * a])

    exact = solve_ivp(rate, (0.0, 1.0), np.zeros(12), rtol=1e-10, atol=1e-12).y[:, -1]
    errors = []
    for dt in (0.01, 0.005):
        nu_d, nu_d_dot = followed(ReferenceFilter(omega, zeta, FREE, FREE), dt, 1.0)
        errors.append(np.abs(np.concatenate([nu_d[-1], nu_d_dot[-1]]) - exact).max())
    assert errors[0] < 0.05 * np.abs(exact).max()
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)


def test_a_step_is_followed_within_the_limits_and_without_overshoot() -> None:
    nu_d, nu_d_dot = followed(ReferenceFilter(1.0, 1.0, *LIMITS), 0.01, 40.0)
    most = np.array([3.0] * 3 + [1.0] * 3)
    assert nu_d[-1] == pytest.approx(np.clip(STEP, -most, most), abs=1e-6)
    assert (np.abs(nu_d_dot).max(axis=0) <= [0.2] * 3 + [0.1] * 3 + np.array(1e-12)).all()
    assert (np.abs(nu_d) <= np.abs(nu_d[-1]) + 1e-9).all()
    assert np.abs(nu_d_dot[:, 1]).max() == pytest.approx(0.2)


values = st.tuples(*[st.floats(-1e300, 1e300) | st.sampled_from([math.inf, -math.inf])] * 6)


@given(
    st.lists(st.tuples(st.floats(0.0, 1e6), values), max_size=20),
    values,
    st.floats(0.01, 20.0),
    st.floats(0.5, 5.0),
)
def test_nothing_goes_beyond_the_limits_and_the_derivative_is_exact(steps, start, omega, zeta):
    reference = ReferenceFilter(omega, zeta, *LIMITS)
    reference.start(start)
    before, slope = reference.advance(0.0, ZERO)
    assert slope == ZERO
    for dt, setpoint in steps:
        nu_d, nu_d_dot = reference.advance(dt, setpoint)
        for v, last, a, fastest, steepest in zip(
            nu_d, before, nu_d_dot, [3.0] * 3 + [1.0] * 3, [0.2] * 3 + [0.1] * 3, strict=True
        ):
            assert abs(v) <= fastest
            assert abs(a) <= steepest * (1 + 1e-9)
            if dt > 1e-6:  # below, the difference is of rounding alone
                assert v - last == pytest.approx(a * dt, abs=1e-12)
        before = nu_d
