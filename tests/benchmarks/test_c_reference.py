"""The scalar C reference against the kernel: what is measured against must compute the same."""

import os
import shutil
from dataclasses import replace

import c_reference
import numpy as np
import pytest
from helpers.closed_loops import FULL, SIX, TURNED, file_of
from helpers.needs import need
from loops import open_plants
from numpy.testing import assert_allclose

from auv_analysis import load_scenario, open_loop, simulate, summarize
from auv_analysis.simulation.simulate import DivergedError
from auv_dynamics.plant.plant import unwrapped_eta
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict

SKEWED = {key: (np.array(gain) @ np.triu(np.ones((6, 6)))).tolist() for key, gain in FULL.items()}
MODEL_ERROR = {'kind': 'model_error', 'mass': 0.1, 'added_mass': -0.2, 'damping': 0.3}
CASES = {
    'case1': {'duration': 10.0},
    'case1 in full': {},
    'shorter than the transient': {'duration': 1.0},
    'full gains, six axes': {'duration': 5.0, 'setpoint': SIX, 'initial': TURNED, 'gains': SKEWED},
    'dense vehicle': {'duration': 5.0, 'vehicle': 'rexrov', 'setpoint': SIX, 'initial': TURNED},
}


def changed(vehicle='herman2018', gains=None, **changes):
    base = load_scenario('case1')
    data = base.data | changes
    if gains is not None:
        data['controllers'] = {'gvc': gains | {'law': 'gvc'}}
    return replace(base, vehicle=vehicle_from_dict(file_of(vehicle), 'vehicle.yaml'), data=data)


@pytest.fixture(params=[c_reference.PLAIN, c_reference.NATIVE], ids=' '.join)
def library(request):
    need('gcc', any(map(shutil.which, c_reference.compilers())))
    return c_reference.library(request.param)


def check_log(library, scenario):
    run = simulate(scenario, 'gvc')
    x, tau, f = c_reference.log(library, c_reference.loops([scenario], 'gvc'))
    found = {
        'eta': unwrapped_eta(x[:, :13]), 'nu': x[:, 7:13], 'law_state': x[:, 13:],
        'tau': tau, 'disturbance_estimate': f,
    }  # fmt: skip
    for key, values in found.items():
        expected = getattr(run, key)
        size = max(1.0, np.abs(expected).max())
        assert_allclose(values, expected, rtol=0, atol=1e-9 * size, err_msg=key)
    return run


@pytest.mark.parametrize('case', CASES)
def test_every_logged_value_and_figure_is_the_kernels(case, library):
    scenario = changed(**CASES[case])
    run = check_log(library, scenario)
    summary = summarize(run)
    [figures], diverged = c_reference.rollouts(library, c_reference.loops([scenario], 'gvc'))
    assert diverged == [np.inf]
    for name, found in zip(c_reference.FIGURES, figures, strict=True):
        group, key = name.split('.')
        values = summary[group][key] or [0.0] * 6  # C's figure of no samples
        assert_allclose(found, np.array(values, float), rtol=1e-9, atol=1e-12, err_msg=name)


def test_the_plant_may_differ_from_what_the_law_knows(library):
    errors = [*load_scenario('case1').data['disturbance'], MODEL_ERROR]
    check_log(library, changed('rexrov', duration=5.0, setpoint=SIX, disturbance=errors))


def test_each_loop_of_a_batch_is_itself(library):
    scenarios = [
        changed(vehicle, gains, duration=2.0)
        for vehicle in ('herman2018', 'rexrov')
        for gains in (None, SKEWED)
    ]
    together, _ = c_reference.rollouts(library, c_reference.loops(scenarios, 'gvc'))
    assert len(np.unique(together[:, 0, 0])) == len(scenarios)
    for scenario, figures in zip(scenarios, together, strict=True):
        [alone], _ = c_reference.rollouts(library, c_reference.loops([scenario], 'gvc'))
        np.testing.assert_array_equal(figures, alone)


def test_states_of_the_plant_alone_are_the_kernels(library):
    given, plants = open_plants(5)
    start, commands, step = given['start'][0, 0], given['commands'], given['step']
    expected = open_loop(**given)
    assert np.abs(expected[:, :, -1, 7:]).max() > 0.1
    found = c_reference.open_loop(library, plants, start, commands, step)
    assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    assert len(np.unique(found[:, :, -1, 7])) == found.shape[0] * found.shape[1]


def test_it_says_from_when_on_a_run_is_not_finite(library):
    unstable = changed(gains=load_scenario('case1').gain_values('gvc') | {'k_D': -500.0})
    with pytest.raises(DivergedError) as error:
        simulate(unstable, 'gvc')
    _, [diverged] = c_reference.rollouts(library, c_reference.loops([unstable], 'gvc'))
    assert f'not finite from t = {diverged:g} s' in str(error.value)


def test_a_missing_compiler_is_named_in_one_line(monkeypatch, tmp_path):
    monkeypatch.setitem(os.environ, 'PATH', str(tmp_path))
    monkeypatch.delenv('CC', raising=False)
    with pytest.raises(c_reference.NoCompilerError, match='expected a C compiler') as error:
        c_reference.compiler()
    assert '\n' not in str(error.value)


def test_a_compiler_that_fails_is_named_in_one_line(monkeypatch):
    monkeypatch.setattr(c_reference, 'compiler', lambda: 'false')
    with pytest.raises(c_reference.NoCompilerError, match='expected it to compile'):
        c_reference.library(('-O0',))
