"""The laws at single states: against the reference, by their closed loop, and by limits."""

import subprocess
import sys

import herman_reference as reference
import numpy as np
import pytest
from helpers.needs import needing
from helpers.strategies import QUICK, attitudes, full, gains, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose

from auv_dynamics import load_vehicle
from auv_dynamics.kernel import compile
from auv_dynamics.vehicle.kinematics import quaternion
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.control.gains import body_gains
from auv_gvc_controller.laws.law import SHIPPED, make_gains
from auv_gvc_controller.laws.model import control_model

PAPER = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
STATES = (attitudes(), vectors(), vectors(), vectors(), vectors(12, 2.0))
LAWS = ['cl', 'gvc']  # those of the paper


def ours(law, vehicle, values, eta, nu, nu_d, nu_d_dot, state):
    """(tau, f, rate of the state) by the law's static functions."""
    arguments = (0.0, tuple(nu), tuple(quaternion(eta[3:])), tuple(nu_d), tuple(nu_d_dot), state,
                 make_gains(law, values), control_model(vehicle))  # fmt: skip
    tau, f = SHIPPED[law].wrench(*arguments)
    return np.array(tau), np.array(f), np.array(SHIPPED[law].state_rate(*arguments))


def theirs(law, data, values, eta, nu, nu_d, nu_d_dot, state, flip=''):
    """(tau, f, s) by the oracle, a term of the law with its sign turned where asked."""
    m = reference.vehicle_matrices(data)
    terms = {
        'C': reference.coriolis(m['M'], nu),
        'D': reference.damping(m, nu),
        'g': reference.restoring(m, eta),
    }
    terms |= {name: -term for name, term in terms.items() if name == flip}
    z, sigma = state[:6], state[6:]
    z = -z if flip == 'z' else z
    nu_d_dot = -nu_d_dot if flip == 'nu_d_dot' else nu_d_dot
    one = reference.make_law(m['M'], values | {'law': law})
    tau, s, f = one(nu, nu_d, nu_d_dot, z, sigma, terms['C'], terms['D'], terms['g'])
    if flip == 'f':
        return tau - 2.0 * f, s, -f
    return tau, s, f


@pytest.mark.parametrize('law', LAWS)
@QUICK
@given(vehicles(), gains(), *STATES)
def test_laws_agree_with_the_reference(law, data, values, eta, nu, nu_d, nu_d_dot, state):
    tau, f, rate = ours(law, vehicle_from_dict(data, 'f'), values, eta, nu, nu_d, nu_d_dot, state)
    tau_other, s, f_other = theirs(law, data, values, eta, nu, nu_d, nu_d_dot, state)
    scale = np.abs(tau_other).max() + np.abs(f_other).max() + 1.0
    assert_allclose(tau, tau_other, rtol=0, atol=1e-9 * scale)
    assert_allclose(f, f_other, rtol=0, atol=1e-9 * scale)
    assert_allclose(rate[:6], nu_d - nu, atol=1e-15)
    assert_allclose(rate[6:], s, rtol=0, atol=1e-10 * (1 + np.abs(s).max()))


@pytest.mark.parametrize('flip', ['f', 'C', 'D', 'g', 'z', 'nu_d_dot'])
@pytest.mark.parametrize('law', LAWS)
def test_a_flipped_sign_would_be_noticed(law, flip):
    import yaml

    from auv_dynamics.files.shipped import shipped

    data = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
    state = np.array([0.2, -0.1, 0.3, 0.1, -0.2, 0.1, 0.5, -0.4, 0.3, -0.2, 0.1, 0.6])
    nu, nu_d = np.array([1, -0.5, 0.3, 0.1, -0.2, 0.4]), np.array([0.8, 0.1, 0.5, -0.2, 0.1, 0.3])
    eta, nu_d_dot = np.array([0, 0, 5, 0.3, -0.4, 1.0]), np.array([0.1, 0.2, -0.3, 0.1, 0.2, -0.1])
    arguments = (PAPER, eta, nu, nu_d, nu_d_dot, state)
    tau, f, _ = ours(law, load_vehicle('rexrov'), *arguments)
    right = theirs(law, data, *arguments)
    wrong = theirs(law, data, *arguments, flip=flip)
    assert_allclose(np.concatenate([tau, f]), np.concatenate([right[0], right[2]]), rtol=1e-10)
    assert np.abs(tau - wrong[0]).max() > 1e-3 * np.abs(tau).max()


@pytest.mark.parametrize('law', LAWS)
@QUICK
@given(vehicles(), gains(), vectors(largest=50.0), *STATES)
def test_closed_loop_identity(law, data, values, F, eta, nu, nu_d, nu_d_dot, state):
    # (22), and for CL the same with M for N and 1 for Upsilon
    vehicle = vehicle_from_dict(data, 'f')
    tau, f, rate = ours(law, vehicle, values, eta, nu, nu_d, nu_d_dot, state)
    nu_dot = vehicle.forward_dynamics(eta, nu, tau, F)
    gvc = law == 'gvc'
    U = reference.decompose(vehicle.M)[0] if gvc else np.eye(6)
    inertia = U.T @ vehicle.M @ U
    k_D, k_I, Lambda = (full(values[key]) for key in ('k_D', 'k_I', 'Lambda'))
    s = rate[6:]
    s_dot = np.linalg.solve(U, nu_d_dot - nu_dot + Lambda @ (nu_d - nu))
    resistance = U.T @ (vehicle.C(nu) + vehicle.D(nu)) @ U
    parts = [
        inertia @ s_dot,
        resistance @ s,
        (inertia @ k_D if gvc else k_D) @ s,
        U.T @ k_I @ state[:6],
        U.T @ (f - F),
    ]
    scale = np.abs(U.T @ tau).max() + sum(np.abs(part).max() for part in parts)
    assert_allclose(sum(parts), np.zeros(6), atol=1e-9 * scale)


def check_multiples(M: np.ndarray, model) -> None:
    for K, k in zip(body_gains(make_gains('gvc', PAPER), model), (12.0, 60.0), strict=True):
        assert np.linalg.norm(K - k * M, 2) <= 1e-12 * k * np.linalg.norm(M, 2)


@QUICK
@given(vehicles())
def test_scalar_gains_are_multiples_of_M_in_the_body_frame(data):
    # K_D = 12 M and K_f = 60 M, whatever M is: U^-T N k U^-1 with one number k
    vehicle = vehicle_from_dict(data, 'f')
    check_multiples(vehicle.M, control_model(vehicle))


@pytest.mark.parametrize('name', ['herman2018', 'herman2018_neutral', 'rexrov'])
def test_scalar_gains_of_shipped_vehicles_are_multiples_of_M(name):
    vehicle = load_vehicle(name)
    check_multiples(vehicle.M, control_model(vehicle))


@QUICK
@given(vehicles(), gains())
def test_body_gains_by_their_definition(data, values):
    vehicle = vehicle_from_dict(data, 'f')
    U, N = reference.decompose(vehicle.M)
    U_inv = np.linalg.inv(U)
    found = body_gains(make_gains('gvc', values), control_model(vehicle))
    for K, key in zip(found, ('k_D', 'Gamma'), strict=True):
        expected = U_inv.T @ N @ full(values[key]) @ U_inv
        assert_allclose(K, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    own = body_gains(make_gains('cl', values), control_model(vehicle))
    for K, key in zip(own, ('k_D', 'Gamma'), strict=True):
        assert_allclose(K, full(values[key]))


@QUICK
@given(vectors(), *STATES)
def test_gvc_of_a_diagonal_inertia_is_cl_with_gains_times_N(size, eta, nu, nu_d, nu_d_dot, state):
    N = 1.0 + np.abs(size)
    data = {
        'name': 'diagonal',
        'rigid_body': {'mass': 5.0, 'center_of_gravity': [0.0, 0.1, 0.2]},
        'inertia_matrix': np.diag(N).tolist(),
        'hydrostatics': {'volume': 0.004, 'center_of_buoyancy': [0.1, 0.0, -0.1]},
        'damping': {'linear': [1.0] * 6, 'quadratic': [2.0] * 6},
        'environment': {'water_density': 1000.0, 'gravity': 9.81},
    }
    vehicle, rest = vehicle_from_dict(data, 'f'), (eta, nu, nu_d, nu_d_dot, state)
    scaled = PAPER | {'k_D': (12.0 * N).tolist(), 'Gamma': (60.0 * N).tolist()}
    for one, other in zip(
        ours('gvc', vehicle, PAPER, *rest), ours('cl', vehicle, scaled, *rest), strict=True
    ):
        assert_allclose(one, other, rtol=0, atol=1e-11 * (1 + np.abs(other).max()))


OWN = """
import numba
from auv_dynamics.kernel.six import add
from auv_gvc_controller.laws.gvc import GVC


@numba.njit
def twice(a):
    return add(a, a)


class Own(GVC):
    pass
"""


@needing('numba', compile.JITTED)
def test_what_a_law_compiles_by_itself_calls_the_helpers_of_the_kernel(tmp_path):
    """Numba is told of them when the law is loaded: by then nothing has been compiled."""
    (tmp_path / 'own.py').write_text(OWN)
    script = (
        'from auv_gvc_controller.laws.law import law_class; law_class("own:Own"); '
        'import own; print(own.twice((1.0, 2.0, 3.0, 4.0, 5.0, 6.0)))'
    )
    done = subprocess.run(
        [sys.executable, '-c', script], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == '(2.0, 4.0, 6.0, 8.0, 10.0, 12.0)'
