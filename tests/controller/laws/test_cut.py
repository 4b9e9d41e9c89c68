"""When an axis counts as cut off by its actuators, and that every integral of it then waits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_dynamics import load_vehicle
from auv_dynamics.kernel.compile import plain
from auv_dynamics.vehicle.thrusters import make_reach
from auv_gvc_controller.control.sampled_law import SampledLaw, cut
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model
from auv_gvc_controller.laws.pid import PID

AXES = pytest.mark.parametrize('axis', range(6))
ZERO, UPRIGHT = (0.0,) * 6, (1.0, 0.0, 0.0, 0.0)


@AXES
@pytest.mark.parametrize('other', range(6))
@pytest.mark.parametrize('size', [1e-3, 1.0, 1e4])
def test_an_axis_is_cut_beyond_the_rounding_of_all(axis, other, size):
    wanted = np.zeros(6)
    wanted[other] += -3.0 * size  # the sum of all counts, by absolute value
    wanted[axis] += 3.0 * size if axis != other else 0.0
    total = np.abs(wanted).sum()
    for share, expected in ((0.0, False), (0.9e-9, False), (1.1e-9, True), (0.5, True)):
        for sign in (1.0, -1.0):
            had = wanted + sign * share * total * np.eye(6)[axis]
            for i in range(6):
                found = plain(cut)(tuple(wanted), tuple(had), i)
                assert found == (expected and i == axis), (share, sign, i)


def test_nothing_wanted_is_not_cut():
    assert not any(plain(cut)(ZERO, ZERO, i) for i in range(6))


@AXES
@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('law', ['cl', 'pid', 'smc'])
def test_integrals_of_the_cut_axis_wait_and_the_others_go_on(law, axis, sign):
    """A diagonal inertia and gains: each axis by itself, all with the same error."""
    values = {'k_D': 50.0, 'Lambda': 0.8, 'Gamma': 9.0} | {
        'cl': {'k_I': 5.0}, 'pid': {'k_P': 50.0, 'k_I': 5.0}, 'smc': {}
    }[law]  # fmt: skip
    if law == 'pid':
        del values['Lambda'], values['Gamma']
    vehicle = load_vehicle('rexrov').changed(
        M=np.diag([10.0, 20.0, 30.0, 4.0, 5.0, 6.0]), D_linear=np.eye(6),
        D_quadratic=np.zeros((6, 6)), weight=0.0, buoyancy=0.0,
    )  # fmt: skip
    limit = np.where(np.arange(6) == axis, 1.0, 1e9)
    laws = [
        SampledLaw(make_gains(law, values), control_model(vehicle), reach)
        for reach in (make_reach(limit, None), None)
    ]
    nu_d = tuple(sign * np.full(6, 0.5))
    for one in laws:
        one.sample(0.0, 0.0, ZERO, UPRIGHT, nu_d, ZERO)
        one.sample(0.01, 0.01, ZERO, UPRIGHT, nu_d, ZERO)
    kept, free = (one._state.copy() for one in laws)
    integrals = {'cl': [0, 1], 'pid': [0], 'smc': [0, 2]}[law]
    for block in integrals:
        assert abs(free[6 * block + axis]) > 1e-3
        assert kept[6 * block + axis] == 0.0
    others = np.arange(len(free)) % 6 != axis
    assert_array_equal(kept[others], free[others])


def test_body_gains_of_pid_are_those_of_a_fast_error():
    rng = np.random.default_rng(3)
    k_P, k_I, k_D, omega_f = (rng.normal(size=(6, 6)) for _ in range(4))
    omega_f = omega_f @ omega_f.T + np.eye(6)
    gains = make_gains('pid', {'k_P': k_P, 'k_I': k_I, 'k_D': k_D, 'omega_f': omega_f})
    K_D, K_f = PID.body_gains(gains, None)
    assert_allclose(K_D, k_P + k_D @ omega_f, rtol=1e-12)
    assert_array_equal(K_f, np.zeros((6, 6)))
