"""Conditional integration: what it does under saturation, against a run without."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.closed_loops import file_of
from numpy.testing import assert_array_equal

from auv_analysis import load_scenario, simulate
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle.thrusters import make_reach
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.control.sampled_law import SampledLaw, anti_windup
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

GAINS = {
    'gvc': {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0},
    'cl': {'k_D': 4000.0, 'k_I': 500.0, 'Lambda': 0.8, 'Gamma': 8000.0},
    'pid': {'k_P': 4000.0, 'k_I': 3000.0, 'k_D': 5.0},
    'smc': {'k_D': 4000.0, 'Lambda': 0.8, 'Gamma': 8000.0},
}
NU_D = {  # a speed that the limits do not allow for 10 s, then rest
    'surge': {
        'offset': 0.6,
        'terms': [{'amplitude': 0.8, 'omega': np.pi / 10, 'phase': 0.0}],
    }
}


def saturated(law: str, **changes):
    """(with, without) of a run that asks for more than 600 N in surge for some seconds."""
    base = load_scenario('case1')
    entry = {'law': law, **GAINS[law]}
    data = base.data | {
        'controllers': {'with': entry, 'without': entry | {'anti_windup': False}},
        'setpoint': NU_D,
        'duration': 20.0,
        'disturbance': [],
        'actuators': {'limit': [600.0, 1e5, 1e5, 1e5, 1e5, 1e5]},
        **changes,
    }
    scenario = replace(base, vehicle=vehicle_from_dict(file_of('rexrov'), 'v'), data=data)
    return [simulate(scenario, name, 'zoh') for name in ('with', 'without')]


@pytest.mark.parametrize('law', ['gvc', 'cl', 'pid', 'smc'])
def test_a_saturated_vehicle_comes_back_sooner(law):
    guarded, wound = saturated(law)
    for run in (guarded, wound):
        assert (np.abs(run.tau[:, 0]) > 600.0).mean() > 0.1, 'the case is one of saturation'
        assert np.abs(run.tau_applied[:, 0]).max() <= 600.0
    guarded_error, wound_error = (np.abs(run.nu_d - run.nu)[:, 0] for run in (guarded, wound))
    late = guarded.t > 10.0
    assert guarded_error[late].mean() < 0.7 * wound_error[late].mean()
    assert np.abs(guarded.law_state[:, 0]).max() < np.abs(wound.law_state[:, 0]).max()


@pytest.mark.parametrize('law', ['gvc', 'cl', 'pid', 'smc'])
def test_without_saturation_it_changes_nothing(law):
    guarded, free = saturated(law, actuators={'limit': 1e6})
    assert_array_equal(guarded.nu, free.nu)
    assert_array_equal(guarded.law_state, free.law_state)


def test_only_integrals_of_cut_axes_stop():
    vehicle = load_vehicle('rexrov')
    gains = make_gains('cl', GAINS['cl'])
    law = SampledLaw(gains, control_model(vehicle), make_reach([1.0] + [1e9] * 5, None))
    nu_d = (1.0, 0.5, 0, 0, 0, 0)
    zero, upright = (0.0,) * 6, (1.0, 0.0, 0.0, 0.0)
    law.sample(0.0, 0.0, zero, upright, nu_d, zero)
    law.sample(0.01, 0.01, zero, upright, nu_d, zero)
    state = law._state
    assert state[0] == state[6] == 0.0, 'surge is cut and pushed further'
    assert state[1] == pytest.approx(0.005)
    assert state[7] == pytest.approx(0.005)


def test_an_integral_that_pulls_back_goes_on():
    vehicle = load_vehicle('rexrov')
    gains = make_gains('cl', GAINS['cl'])
    law = SampledLaw(gains, control_model(vehicle), make_reach([1.0] + [1e9] * 5, None))
    zero, upright = (0.0,) * 6, (1.0, 0.0, 0.0, 0.0)
    law._state[6] = 10.0  # wound up: 80 kN forward
    law.sample(0.0, 0.0, zero, upright, (-0.5, 0, 0, 0, 0, 0), zero)
    law.sample(0.01, 0.01, zero, upright, (-0.5, 0, 0, 0, 0, 0), zero)
    assert law._state[0] == pytest.approx(-0.005)
    assert law._state[6] < 10.0


def test_rounding_of_an_allocation_within_its_limits_stops_nothing():
    vehicle = load_vehicle('bluerov2_heavy')
    values = {'k_D': 5.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 9.0}
    laws = [
        SampledLaw(make_gains('cl', values), control_model(vehicle), reach)
        for reach in (make_reach(None, vehicle.thrusters), None)
    ]
    nu_d = (0.3, -0.2, 0.1, 0.05, -0.02, 0.1)
    for k in range(50):
        answers = {
            law.sample(0.01 * k, 0.01, (0.0,) * 6, (1.0, 0, 0, 0), nu_d, (0.0,) * 6) for law in laws
        }
        assert len(answers) == 1


def test_how_many_states_are_integrals():
    reach = make_reach([1.0] * 6, None)
    counts = {law: anti_windup(make_gains(law, GAINS[law]), reach).integrals for law in GAINS}
    assert counts == {'gvc': 12, 'cl': 12, 'pid': 6, 'smc': 18}
    assert anti_windup(make_gains('cl', GAINS['cl']), None).integrals == 0


@pytest.mark.parametrize('law', ['gvc', 'cl'])
def test_an_axis_that_the_thrusters_cannot_drive_does_not_wind_up(law):
    """The BlueROV2's six thrusters give no pitch of its own: nothing answers, nothing may grow."""
    base = load_scenario('case1_bluerov2')
    entry = {'law': law, 'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
    data = base.data | {
        'controllers': {'with': entry, 'without': entry | {'anti_windup': False}},
        'setpoint': {'surge': {'offset': 0.3}},
        'disturbance': [{'kind': 'harmonic', 'pitch': {'offset': 1.0}}],
        'actuators': {'thrusters': True},
        'duration': 20.0,
    }
    scenario = replace(base, data=data)
    guarded, wound = (simulate(scenario, name, 'zoh') for name in ('with', 'without'))
    pitch = [np.abs(run.tau[:, 4]) for run in (guarded, wound)]
    late = guarded.t > 10.0
    assert pitch[0][late].max() < 0.5 * pitch[1][late].max()
    assert np.abs((guarded.nu_d - guarded.nu)[late, 0]).mean() < 0.02, 'surge still settles'
