"""When a velocity gain is too fast for the control period, against one axis worked out by hand."""

from typing import NamedTuple

import numpy as np
import pytest

from auv_gvc_controller.control.gains import (
    body_gains,
    sampled_rate,
    sampling_warning,
    state_warning,
)
from auv_gvc_controller.laws.cl import CL
from auv_gvc_controller.laws.law import make_gains

M = np.diag([2.0, 4.0, 5.0, 1.0, 10.0, 8.0])


@pytest.mark.parametrize('axis', range(6))
def test_rate_of_the_fastest_axis(axis):
    dof = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')[axis]
    K_D = M + 2.0 * M[axis, axis] * np.diag(np.eye(6)[axis])  # 1/s on all but one, 3/s there
    assert sampled_rate(K_D, M) == (pytest.approx(3.0), dof)
    assert sampled_rate(-K_D, M) == (pytest.approx(3.0), dof)


def test_the_axis_is_that_of_the_energy_and_not_of_the_velocity():
    inertia = np.diag([1.0, 100.0, 1.0, 1.0, 1.0, 1.0])
    mode = np.array([1.0, 0.5, 0.0, 0.0, 0.0, 0.0])  # fastest, and faster in surge
    K_D = inertia @ (0.1 * np.eye(6) + 5.0 * np.outer(mode, mode) / (mode @ mode))
    rate, dof = sampled_rate(K_D, inertia)
    assert rate == pytest.approx(5.1)
    assert dof == 'sway'


def test_a_rotating_mode_has_the_rate_of_its_modulus():
    K_D = np.diag([0.0, 0, 0, 1, 10, 8])
    K_D[:2, :2] = [[0.0, 8.0], [-16.0, 0.0]]
    rate, _ = sampled_rate(K_D, np.diag([2.0, 4, 5, 1, 10, 8]))
    assert rate == pytest.approx(4.0)  # eigenvalues +-4i


@pytest.mark.parametrize(
    ('step', 'words'),
    [
        (0.25, None),  # exactly 1
        (0.2500001, 'above 1 the sampled loop rings'),
        (0.5, 'above 1 the sampled loop rings'),  # exactly 2
        (0.5000001, 'above 2 the sampled loop is unstable'),
    ],
)
def test_bounds_of_the_warning(step, words):
    text = sampling_warning(4.0 * np.eye(6), np.eye(6), step)
    assert text is None if words is None else words in text


def test_the_bound_is_that_of_the_product():
    assert 'is unstable' in sampling_warning(1.5 * np.eye(6), np.eye(6), 1.5)
    assert 'rings' in sampling_warning(1.3 * np.eye(6), np.eye(6), 1.5)
    assert sampling_warning(9.0 * np.eye(6), np.eye(6), 0.1) is None


def test_what_the_warning_says():
    text = sampling_warning(4.0 * M, M, 0.75)
    assert text.startswith('lambda_max(M^-1 K_D) * step = 3, mostly in ')
    assert 'a step of at most 0.25 s' in text


class Own(NamedTuple):
    """A law whose gains have names of its own."""

    zeta: np.ndarray
    STATES = 6

    @staticmethod
    def wrench(t, nu, attitude, nu_d, nu_d_dot, state, gains, model):
        error = np.subtract(nu_d, nu)
        drag = np.abs(nu) * nu  # quadratic: nothing at rest
        return gains.zeta.reshape(6, 6) @ (error + state) + drag, np.zeros(6)


def test_velocity_gain_of_a_users_law_is_measured_at_rest():
    zeta = np.arange(36.0)
    K_D, K_f = body_gains(Own(zeta), None)
    assert np.allclose(K_D.ravel(), zeta, atol=2e-3)  # the step of the differences, by the drag
    assert not K_f.any()
    K_D, _ = body_gains(Own(300 * M.ravel()), None)
    assert 'is unstable' in sampling_warning(K_D, M, 0.01)


def test_velocity_gain_of_a_shipped_law_is_what_it_says():
    full = np.arange(36.0)
    K_D, K_f = body_gains(CL(full, full, full, 2 * full), None)
    assert np.array_equal(K_D.ravel(), full)
    assert np.array_equal(K_f.ravel(), 2 * full)


def test_users_law_that_gives_nothing_finite_at_rest_has_no_velocity_gain():
    assert not body_gains(Own(np.full(36, np.nan)), None)[0].any()


def test_a_complex_pair_that_grows_is_told_before_the_rate_says_so():
    K_D = np.diag([4.0, 4.0, 0.0, 0.0, 0.0, 0.0])
    K_D[0, 1], K_D[1, 0] = 30.0, -30.0  # eigenvalues 4 +- 30i
    growth = np.hypot(1 - 0.04 * 4.0, 0.04 * 30.0)
    text = sampling_warning(K_D, np.eye(6), 0.04)
    assert f'its complex pair grows by {growth:.3g} a sample' in text
    assert sampling_warning(K_D, np.eye(6), 0.001) is None
    assert sampling_warning(-np.eye(6), np.eye(6), 1.0) is None, 'it grows at any step'


def test_the_states_of_a_law_have_a_rate_of_their_own():
    fast = make_gains('pid', {'k_P': 5.0, 'k_I': 1.0, 'k_D': 0.1, 'omega_f': 30.0})
    assert state_warning(fast, 0.01) is None
    assert "the law's own states: rate * step = 3" in state_warning(fast, 0.1)
    assert 'is unstable' in state_warning(fast, 0.1)
    assert state_warning(CL(M, M, M, M), 10.0) is None, 'it has no such states'
    turning = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    turning[0, 5], turning[5, 0] = -40.0, 40.0  # eigenvalues 3.5 +- 39.9i
    fastest = float(np.abs(np.linalg.eigvals(turning)).max())
    gains = make_gains('pid', {'k_P': 5.0, 'k_I': 1.0, 'k_D': 0.1, 'omega_f': turning})
    assert type(gains).own_rate(gains) == pytest.approx(fastest)
    assert f'rate * step = {fastest / 10:.3g}' in state_warning(gains, 0.1)
