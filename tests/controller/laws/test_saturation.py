"""The switching term of SMC inside and outside its boundary layer, axis by axis."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from auv_dynamics.kernel.compile import plain
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.smc import SMC, manifold, saturated

PHI = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
GAINS = {'k_D': 1.0, 'Lambda': 0.5, 'Gamma': 2.0}


@pytest.mark.parametrize('axis', range(6))
@pytest.mark.parametrize('share', [-5.0, -1.01, -0.99, -0.3, 0.0, 0.3, 0.99, 1.01, 5.0])
def test_saturation_of_an_axis_is_its_own(axis, share):
    s = np.eye(6)[axis] * PHI * share
    found = plain(saturated)(tuple(s), np.diag(PHI).ravel())
    assert_allclose(found, np.eye(6)[axis] * np.clip(share, -1.0, 1.0), rtol=1e-12)


def test_the_manifold_is_the_squared_operator_on_the_integral():
    Lambda = np.arange(1.0, 37.0).reshape(6, 6) / 36
    state, nu_err = np.linspace(-1, 2, 18), np.array([1.0, -2.0, 3.0, 4.0, -5.0, 6.0])
    found = plain(manifold)(tuple(nu_err), state, make_gains('smc', GAINS | {'Lambda': Lambda}))
    expected = nu_err + 2 * Lambda @ state[:6] + Lambda @ Lambda @ state[6:12]
    assert_allclose(found, expected, rtol=1e-12)


def test_gains_that_may_be_absent():
    gains = make_gains('smc', GAINS)
    assert_allclose(gains.k_S, np.zeros(36))
    assert_allclose(gains.phi, 0.1 * np.eye(6).ravel())
    gains = make_gains('pid', {'k_P': 1.0, 'k_I': 1.0, 'k_D': 1.0})
    assert_allclose(gains.omega_f, 20.0 * np.eye(6).ravel())
    assert_allclose(gains.k_FF, np.eye(6).ravel())


def test_body_gains_are_those_inside_the_layer():
    k_S = np.arange(1.0, 7.0)
    gains = make_gains('smc', GAINS | {'k_S': k_S, 'phi': PHI})
    K_D, K_f = SMC.body_gains(gains, None)
    assert_allclose(K_D, np.diag(1.0 + k_S / PHI), rtol=1e-12)
    assert_allclose(K_f, 2.0 * np.eye(6))
    full = np.arange(1.0, 37.0).reshape(6, 6)
    K_D, _ = SMC.body_gains(make_gains('smc', GAINS | {'k_S': full, 'phi': PHI}), None)
    assert_allclose(K_D, np.eye(6) + full @ np.diag(1 / PHI), rtol=1e-12)


@pytest.mark.parametrize(
    'phi',
    [
        0.0,
        [1, 1, 1, 1, 1, 0],
        [0, 1, 1, 1, 1, 1],
        [1, 1, -1, 1, 1, 1],
        np.eye(6) + 0.1,
        1.1 * np.eye(6) - 0.1,
    ],
)
def test_a_layer_that_is_no_positive_diagonal_is_refused(phi):
    with pytest.raises(ValueError, match='phi: expected a positive number'):
        make_gains('smc', GAINS | {'phi': phi})


def test_a_layer_so_thin_that_the_gain_is_infinite_is_refused():
    with pytest.raises(ValueError, match='phi: expected a width by which k_S is finite, found'):
        make_gains('smc', GAINS | {'k_S': 1.0, 'phi': 1e-320})


@pytest.mark.parametrize('omega_f', [0.0, -1.0, [1, 2, 3, 0, 5, 6], [1, 2, 3, 4, 5, -6]])
def test_a_filter_that_is_not_stable_is_refused(omega_f):
    with pytest.raises(ValueError, match='omega_f: expected a positive cut-off'):
        make_gains('pid', {'k_P': 1.0, 'k_I': 1.0, 'k_D': 1.0, 'omega_f': omega_f})


def test_a_filter_that_turns_as_it_decays_is_stable():
    omega_f = 2.0 * np.eye(6)
    omega_f[0, 1], omega_f[1, 0] = 9.0, -9.0
    make_gains('pid', {'k_P': 1.0, 'k_I': 1.0, 'k_D': 1.0, 'omega_f': omega_f})
