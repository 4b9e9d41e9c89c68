"""Case 1 on every shipped vehicle: GVC keeps its gains, CL does not, and the sampled bound."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.approved import APPROVE
from helpers.strategies import QUICK, positive_definite
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.report.scenario_text import sampling_warnings
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scaling import SCALE, SLOWER, TOP_SPEED, scaled_case1
from auv_analysis.scenario.templates import scenario_files
from auv_analysis.simulation.simulate import DivergedError
from auv_dynamics import InputError, load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import yaml_text
from auv_dynamics.plant.disturbance import herman2018
from auv_gvc_controller.control.gains import sampled_rate, sampling_warning, state_warning
from auv_gvc_controller.laws.law import make_gains

FOLDER = shipped('scenarios', 'case1').parent
NAMES = sorted(path.stem for path in shipped('vehicles', 'herman2018').parent.glob('*.yaml'))
OTHERS = [name for name in NAMES if name != 'herman2018']
BAND = 0.005  # m/s, rad/s
T = np.linspace(0, 30, 301)
COMMENT = """\
# yaml-language-server: $schema=../../src/auv_dynamics/auv_dynamics/plant/scenario.schema.json
#
# Case 1 of Herman 2018 on {name}: how do the paper's gains perform on another vehicle?
# As in case1: controllers with their gains, duration, step.
# Set-point (35) times {factor}: at most {surge:g} m/s in surge, {heave:g} m/s in heave and
# {yaw:g} rad/s in yaw, for every shipped vehicle. Top speed of {name}: {speed}.
# All six degrees of freedom count as actuated, as in the paper, although a torpedo-shaped
# vehicle has no actuator in heave.
# Disturbance (39): the same acceleration a(t) for every vehicle, F = M a(t).
{scale}
# Generated and checked by tests/analysis/scenario/test_scaling.py.
"""


def scenario_text(scenario: dict[str, Any]) -> str:
    """Text of a scenario file of `scaled_case1`, with what was scaled in its comment."""
    name = Path(scenario['vehicle']).stem
    peaks = {
        dof: entry.get('offset', 0.0) + sum(term['amplitude'] for term in entry['terms'])
        for dof, entry in scenario['setpoint'].items()
    }
    comment = COMMENT.format(
        name=name,
        factor=SLOWER,
        scale='\n'.join(f'# {line}' for line in SCALE),
        speed=TOP_SPEED.get(name, 'not found in its sources'),
        **{dof: round(peak, 6) for dof, peak in peaks.items()},
    )
    return comment + yaml_text(scenario, width=200)


@pytest.fixture(scope='module')
def scaled(tmp_path_factory):
    folder = tmp_path_factory.mktemp('scaled')

    @cache
    def load(name):
        path = folder / f'{name}.yaml'
        path.write_text(scenario_text(scaled_case1(name)), encoding='utf-8')
        return load_scenario(path)

    return load


def after_2_s(run):
    return np.abs(run.nu_d - run.nu)[run.t >= 2.0 - 1e-9].max()


# the files


@pytest.mark.parametrize('name', OTHERS)
def test_the_committed_files_are_current(name):
    path, text = FOLDER / f'case1_{name}.yaml', scenario_text(scaled_case1(name))
    if APPROVE:
        path.write_text(text, encoding='utf-8')
    assert path.read_text(encoding='utf-8') == text, 'run this test with AUV_GVC_APPROVE=1'


def test_the_same_input_gives_the_same_text():
    for name in OTHERS:
        assert scenario_text(scaled_case1(name)) == scenario_text(scaled_case1(name))


@pytest.mark.parametrize('name', OTHERS)
def test_what_is_kept_and_what_is_changed(name):
    case1 = yaml.safe_load((FOLDER / 'case1.yaml').read_text(encoding='utf-8'))
    text = (FOLDER / f'case1_{name}.yaml').read_text(encoding='utf-8')
    ours = yaml.safe_load(text)
    assert ours == scaled_case1(name)
    assert (ours['name'], ours['vehicle']) == (f'case1_{name}', name)
    for key in ('format', 'duration', 'step', 'integrator', 'controllers'):
        assert ours[key] == case1[key]
    assert ours['disturbance']['exponent_sign'] == case1['disturbance']['exponent_sign']
    for part in ('0.6 m/s in surge', '0.8 m/s in heave', '0.05 rad/s in yaw', 'Top speed'):
        assert part in text
    full, half = load_scenario('case1').setpoint, load_scenario(f'case1_{name}').setpoint
    assert_allclose(half.value(T), 0.5 * full.value(T), rtol=1e-14, atol=1e-16)
    assert (np.abs(half.value(T)) <= [0.6, 0, 0.8, 0, 0, 0.05]).all()


@pytest.mark.parametrize('name', NAMES)
def test_every_vehicle_meets_the_same_acceleration(name, scaled):
    scenario = scaled(name)
    a = np.linalg.solve(load_vehicle('herman2018').M, herman2018(T).T).T
    F = scenario.uncertainty.F(T)
    assert_allclose(F, a @ scenario.vehicle.M.T, rtol=0, atol=1e-8 * np.abs(F).max())


def test_the_reference_keeps_its_own_disturbance():
    assert scaled_case1('herman2018')['disturbance']['scale'] == np.eye(6).tolist()
    assert scaled_case1('herman2018_neutral')['disturbance']['scale'] == np.eye(6).tolist()


@pytest.mark.parametrize('smaller', [1.0, 5.0])
def test_a_scenario_of_ones_own_has_gains_for_its_vehicle(smaller, tmp_path, monkeypatch):
    """A BlueROV2 Heavy, and one a fifth as long, of 0.1 kg."""
    data = yaml.safe_load(shipped('vehicles', 'bluerov2_heavy').read_text(encoding='utf-8'))
    powers = np.array([3, 3, 3, 5, 5, 5])
    data['added_mass'] = (np.array(data['added_mass']) * smaller**-powers).tolist()
    data['rigid_body']['mass'] *= smaller**-3
    data['rigid_body']['inertia'] = (np.array(data['rigid_body']['inertia']) * smaller**-5).tolist()
    data['hydrostatics']['volume'] *= smaller**-3
    for part in ('linear', 'quadratic'):
        drag = np.array(data['damping'][part]) * smaller ** (1.0 - powers)
        data['damping'][part] = drag.tolist()
    monkeypatch.chdir(tmp_path)
    Path('mine.yaml').write_text(yaml.safe_dump(data), encoding='utf-8')
    Path('own.yaml').write_text(scenario_files('own', 'mine.yaml')['own.yaml'], encoding='utf-8')
    scenario = changed_scenario(load_scenario('own.yaml'), {'duration': 2.0})
    for name in scenario.controllers:
        run = simulate(scenario, name, hold='zoh')
        assert np.abs(run.nu_d - run.nu).max() < 2.0
    K_D = scenario.gains('cl').k_D[::7]
    reference = load_vehicle('herman2018').M
    expected = 12.0 / np.diag(reference)
    assert_allclose(K_D / np.diag(scenario.vehicle.M), expected, rtol=0.01)


def test_a_vehicle_by_path(tmp_path, monkeypatch):
    text = shipped('vehicles', 'bluerov2').read_text(encoding='utf-8')
    (tmp_path / 'mine.yaml').write_text(text.replace('name: bluerov2', 'name: mine'))
    monkeypatch.chdir(tmp_path)
    scenario = scaled_case1('mine.yaml')
    assert scenario['name'] == 'case1_mine'
    assert scenario['vehicle'] == str(tmp_path / 'mine.yaml')
    (tmp_path / 'elsewhere').mkdir()
    path = tmp_path / 'elsewhere' / 'case1_mine.yaml'
    path.write_text(scenario_text(scenario), encoding='utf-8')
    assert load_scenario(path).vehicle.name == 'mine'


@pytest.mark.parametrize('name', ['Mine / second try', 'm' * 200, 'größer'])
def test_any_name_of_a_vehicle_gives_a_scenario(name, tmp_path):
    data = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
    (tmp_path / 'vehicle.yaml').write_text(yaml.safe_dump(data | {'name': name}), encoding='utf-8')
    path = tmp_path / 'case1.yaml'
    path.write_text(scenario_text(scaled_case1(tmp_path / 'vehicle.yaml')), encoding='utf-8')
    assert load_scenario(path).name.startswith('case1_')


def test_an_unknown_vehicle_is_refused():
    with pytest.raises(InputError, match='expected a file, or one of the shipped vehicles'):
        scaled_case1('nautilus')


# what the gains do


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
@pytest.mark.parametrize('name', NAMES)
def test_gvc_converges_with_the_papers_gains(name, hold, scaled):
    assert after_2_s(simulate(scaled(name), 'gvc', hold)) < BAND


@pytest.mark.parametrize('name', NAMES)
def test_cl_needs_other_gains(name, scaled):
    scenario = scaled(name)
    gvc, cl = (after_2_s(simulate(scenario, law, 'continuous')) for law in ('gvc', 'cl'))
    assert cl > 10 * gvc
    assert cl > 8 * BAND


@pytest.mark.parametrize('name', NAMES)
def test_cl_sampled_diverges_where_the_bound_says_so(name, scaled):
    scenario = scaled(name)
    rate, _ = sampled_rate(12 * np.eye(6), scenario.vehicle.M)
    load = rate * scenario.step
    assert load < 1 or load > 2  # the set is clear-cut at 0.01 s
    if load < 1:
        assert after_2_s(simulate(scenario, 'cl', 'zoh')) < 1.0
        assert sampling_warning(12 * np.eye(6), scenario.vehicle.M, scenario.step) is None
    else:
        assert name == 'lauv'
        with pytest.raises(DivergedError):
            simulate(scenario, 'cl', 'zoh')
        warning = sampling_warning(12 * np.eye(6), scenario.vehicle.M, scenario.step)
        assert 'is unstable' in warning
        assert 'roll' in warning


def resampled(scenario, step, duration=6.0):
    entries = {'step': step, 'duration': round(duration / step) * step}
    return replace(scenario, data=scenario.data | entries)


def turns(run):
    """How often the roll error turns round in its first 40 samples."""
    slope = np.diff((run.nu_d - run.nu)[:40, 3])
    return int((slope[1:] * slope[:-1] < 0).sum())


def test_the_bounds_on_the_lauv(scaled):
    """lambda = 12 / 0.04 = 300 1/s: 0.0033 s and 0.0067 s."""
    scenario = scaled('lauv')
    calm, ringing = (simulate(resampled(scenario, h), 'cl', 'zoh') for h in (0.003, 0.0065))
    assert turns(calm) <= 1
    assert turns(ringing) > 10
    assert after_2_s(ringing) < 1.0
    with pytest.raises(DivergedError):
        simulate(resampled(scenario, 0.0071), 'cl', 'zoh')


# the warning


@pytest.mark.parametrize(
    ('step', 'words'),
    [(0.0033, None), (0.0034, 'rings'), (0.0066, 'rings'), (0.0067, 'is unstable')],
)
def test_sampling_warning_names_the_bound(step, words):
    text = sampling_warning(12 * np.eye(6), load_vehicle('lauv').M, step)
    assert text is words is None or words in text
    if text is not None:
        assert text.startswith(f'lambda_max(M^-1 K_D) * step = {300 * step:.3g}, mostly in roll')
        assert '0.0033 s' in text
        assert ('rings' in text) != ('is unstable' in text)


def test_an_asymmetric_gain_is_judged_by_its_spectral_radius():
    K_D = np.zeros((6, 6))
    K_D[0, 1], K_D[1, 0] = 30.0, -30.0  # eigenvalues +-30 i: its symmetric part is zero
    assert sampled_rate(K_D, np.eye(6))[0] == pytest.approx(30.0)
    assert sampling_warning(K_D, np.eye(6), 0.01) is None
    assert 'rings' in sampling_warning(K_D, np.eye(6), 0.05)
    K_D = np.zeros((6, 6))
    K_D[0, 5] = 1e6  # nilpotent: large, but nothing that is fed back
    assert sampling_warning(K_D, np.eye(6), 0.01) is None


@QUICK
@given(positive_definite(), positive_definite(), st.floats(0.1, 10.0))
def test_the_bound_is_where_the_sampled_loop_begins_to_grow(M, K_D, size):
    """nu_{k+1} = (I - h M^-1 K_D) nu_k, the loop without water, damping and other gains."""
    K_D = size * K_D
    rate, _ = sampled_rate(K_D, M)
    for load, grows in ((0.99, False), (1.98, False), (2.02, True)):
        step = load / rate
        factor = np.eye(6) - step * np.linalg.solve(M, K_D)
        assert (np.abs(np.linalg.eigvals(factor)).max() > 1) == grows
        text = sampling_warning(K_D, M, step)
        assert (text is None) == (load < 1)
        assert grows == (text is not None and 'is unstable' in text)


def test_the_degree_of_freedom_is_that_of_the_energy():
    M = np.diag([1.0, 1.0, 1.0, 1e-3, 1.0, 1.0])
    assert sampled_rate(np.eye(6), M) == (pytest.approx(1000.0), 'roll')
    K_D = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 50.0])
    assert sampled_rate(K_D, np.eye(6)) == (pytest.approx(50.0), 'yaw')
    assert_array_equal(M, np.diag([1.0, 1.0, 1.0, 1e-3, 1.0, 1.0]))


def test_a_gain_that_pushes_is_no_matter_of_sampling():
    assert sampling_warning(-1e5 * np.eye(6), np.eye(6), 0.01) is None


@pytest.mark.parametrize(('step', 'words'), [(0.04, ''), (0.06, 'rings'), (0.11, 'unstable')])
def test_the_filter_of_pid_is_sampled_too(step, words):
    gains = make_gains('pid', {'k_P': 1.0, 'k_I': 0.0, 'k_D': 0.0})
    text = state_warning(gains, step)
    assert words in text if words else text is None
    assert state_warning(make_gains('smc', {'k_D': 1, 'Lambda': 1, 'Gamma': 1}), 10.0) is None


def test_a_scenario_warns_of_its_gains(tmp_path):
    scenario = load_scenario('case1_lauv')
    assert any('controllers.cl' in line and 'unstable' in line for line in scenario.warnings)
    assert not any('controllers.gvc' in line for line in scenario.warnings)


def test_a_scenario_and_its_report_warn_of_the_states_of_a_law():
    pid = {'law': 'pid', 'k_P': 400.0, 'k_I': 50.0, 'k_D': 5.0}
    changes = {'controllers': {'slow': pid}, 'step': 0.11, 'duration': 1.1}
    scenario = changed_scenario(load_scenario('case1_rexrov'), changes)
    (warning,) = [w for w in scenario.warnings if "the law's own states" in w]
    assert 'controllers.slow: ' in warning
    run = simulate(scenario, 'slow', 'zoh')
    said = sampling_warnings({'slow': run}, {'slow': summarize(run)})
    assert [f'controllers.{text}' for text in said] == [warning.partition(': ')[2]]


def test_gains_that_turn_ring_before_they_are_large():
    skew = np.zeros((6, 6))
    skew[0, 1], skew[1, 0] = 10.0, -10.0
    text = sampling_warning(np.eye(6) + skew, np.eye(6), 0.05)
    assert 'complex pair grows by 1.07' in text


def test_one_gain_that_pushes_does_not_hide_another_that_rings():
    K_D = np.diag([-400.0, 300.0, 1, 1, 1, 1])
    assert 'unstable' in sampling_warning(K_D, np.eye(6), 0.01)
