"""The loop that is given to the peers is the kernel's."""

import numpy as np
import peers
import pytest
from helpers.closed_loops import TURNED
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, simulate
from auv_dynamics.kernel.integrator import TABLEAUS

DURATION = 0.5


def case1(initial=None):
    scenario = load_scenario('case1')
    scenario.data.update(duration=DURATION, initial=initial or scenario.data['initial'])
    return scenario


def final_velocity(scenario):
    return simulate(scenario, 'gvc').nu[-1]


@pytest.mark.parametrize('initial', [None, TURNED])
def test_its_rate_integrated_by_ode5_is_the_kernels_run(initial):
    scenario, tableau = case1(initial), TABLEAUS['ode5']
    rate, x = peers.closed_loop(scenario, 'gvc')
    for k in range(scenario.steps):
        stages = np.zeros((len(tableau.b), len(x)))
        for s, c in enumerate(tableau.c):
            trial = x + scenario.step * tableau.A[s] @ stages
            stages[s] = rate((k + c) * scenario.step, trial)
        x = x + scenario.step * tableau.b @ stages
        x[3:7] /= np.linalg.norm(x[3:7])
    assert_allclose(x[7:13], final_velocity(scenario), rtol=0, atol=1e-12)


@pytest.mark.parametrize('peer', [peers.solve_ivp, peers.python_control], ids=['scipy', 'control'])
def test_a_peer_ends_where_the_kernel_ends(peer):
    scenario = case1()
    x = peer(*peers.closed_loop(scenario, 'gvc'), DURATION)
    assert_allclose(x[7:13], final_velocity(scenario), rtol=0, atol=1e-6)
