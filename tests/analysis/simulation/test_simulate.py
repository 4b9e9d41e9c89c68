"""The paper's numbers, the two holds, and what a simulation must notice."""

import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.simulation.simulate import DivergedError, announce, warm_up
from auv_dynamics import InputError
from auv_dynamics.plant.disturbance import herman2018

SHARES = [22.57, 0.00, 77.34, 0.006, 0.00, 0.081]
# largest absolute errors between 2 s and 10 s in surge, heave and pitch, from vehicle.md
ERRORS = {
    ('case1', 'gvc'): [0.0003, 0.0039, 0.0005],
    ('case1', 'cl'): [0.070, 0.369, 0.029],
    ('case2', 'gvc'): [0.0003, 0.0039, 0.0005],
    ('case2', 'cl'): [0.021, 0.113, 0.027],
}


def changed(name='case1', **entries):
    scenario = load_scenario(name)
    return replace(scenario, data=scenario.data | entries)


@pytest.mark.parametrize(('duration', 'energy'), [(10.0, 528.18), (30.0, 402.5)])
def test_kinetic_energy_of_case_1(duration, energy):
    summary = summarize(simulate(changed(duration=duration), 'gvc'))
    assert summary['kinetic_energy']['mean'] == pytest.approx(energy, rel=0.005)
    assert summary['kinetic_energy']['window'] == [0.0, pytest.approx(duration)]
    if duration == 10.0:
        assert_allclose(summary['kinetic_energy']['shares_percent'], SHARES, atol=0.5)
        assert summary['kinetic_energy']['mean'] == pytest.approx(energy, abs=0.01)
        assert_allclose(summary['kinetic_energy']['shares_percent'], SHARES, atol=0.006)
        assert summary['kinetic_energy']['mean'] == pytest.approx(519.47, rel=0.02)


def test_kinetic_energy_sampled_is_close_to_continuous():
    summary = summarize(simulate(changed(duration=10.0), 'gvc', 'zoh'))
    assert summary['kinetic_energy']['mean'] == pytest.approx(528.18, rel=0.003)


@pytest.mark.parametrize(('name', 'controller'), ERRORS)
def test_largest_errors_after_2_s(name, controller):
    summary = summarize(simulate(changed(name, duration=10.0), controller))
    found = np.array(summary['velocity_error']['max_after_2s'])[[0, 2, 4]]
    expected = np.array(ERRORS[name, controller])
    assert (np.abs(found - expected) <= np.maximum(0.05 * expected, 1e-4)).all(), found


def test_N_as_printed():
    summary = summarize(simulate(changed(duration=0.1), 'gvc'))
    assert_allclose(summary['decomposition']['N'], [300, 500, 500, 40, 175.5, 141.1], atol=0.05)


def test_samples_on_the_grid():
    run = simulate(changed(duration=3.0), 'cl')
    assert_array_equal(run.t, np.arange(301) * 0.01)
    for key in ('eta', 'nu', 'nu_d', 'nu_d_dot', 'tau', 'disturbance', 'disturbance_estimate'):
        assert getattr(run, key).shape == (301, 6), key
    assert (run.scenario, run.controller, run.law) == ('case1', 'cl', 'cl')
    assert (run.source, run.step, run.duration) == ('simulate', 0.01, pytest.approx(3.0))
    assert run.gains == {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
    slope = np.gradient(run.nu_d, run.t, axis=0)[1:-1]
    assert_allclose(run.nu_d_dot[1:-1], slope, atol=1e-4)


def test_the_same_scenario_gives_the_same_run():
    scenario = changed(duration=1.0)
    first, again = simulate(scenario, 'gvc', 'zoh'), simulate(scenario, 'gvc', 'zoh')
    assert_array_equal(first.tau, again.tau)
    assert_array_equal(first.eta, again.eta)


@pytest.mark.parametrize('controller', ['gvc', 'cl'])
def test_zoh_tends_to_continuous_at_first_order(controller):
    initial = {'eta': [0.0, 0, 0, 0.2, -0.3, 0.5], 'nu': [0.2, 0.1, -0.2, 0.05, 0.1, -0.1]}
    steps, difference = [0.02, 0.01, 0.005, 0.0025], []
    for step in steps:
        scenario = changed(step=step, duration=2.0, initial=initial)
        exact, sampled = (simulate(scenario, controller, h) for h in ('continuous', 'zoh'))
        difference.append(np.abs(exact.nu[-1] - sampled.nu[-1]).max())
    order = np.polyfit(np.log(steps), np.log(difference), 1)[0]
    assert order == pytest.approx(1.0, abs=0.25)
    assert difference[0] > 1e-6


def test_nothing_is_integrated_before_the_second_sample():
    run = simulate(changed(duration=0.02), 'gvc', 'zoh')
    assert not run.disturbance_estimate[0].any()
    assert run.disturbance_estimate[1].any()


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_equation_1_holds_along_a_run(hold):
    # F is what is left of (1): a disturbance without effect, or of the other sign, shows here
    run = simulate(changed(step=0.001, duration=1.0), 'cl', hold)
    k = 700
    if hold == 'continuous':
        nu_dot, tau = (run.nu[k + 1] - run.nu[k - 1]) / 0.002, run.tau[k]
        eta, nu, F, rounding = run.eta[k], run.nu[k], run.disturbance[k], 1e-2
    else:  # tau is held from k to k + 1: look at the middle
        nu_dot, tau = (run.nu[k + 1] - run.nu[k]) / 0.001, run.tau[k]
        eta, nu, F = (
            (s[k] + s[k + 1]) / 2 for s in (run.eta, run.nu, run.disturbance)
        )  # fmt: skip
        rounding = 1e-2
    left = tau - run.vehicle.inverse_dynamics(eta, nu, nu_dot)
    assert_allclose(left, F, atol=rounding)
    assert_allclose(F, herman2018(np.array([0.7]))[0], atol=0.05)
    assert np.abs(F).max() > 10.0


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_a_disturbance_has_an_effect(hold):
    still = {'setpoint': {}, 'duration': 1.0, 'vehicle': 'herman2018'}
    pushed = [{'kind': 'harmonic', 'sway': {'offset': 100.0}}]
    free, run = (simulate(changed(disturbance=d, **still), 'cl', hold) for d in ([], pushed))
    assert_allclose(free.nu, 0.0, atol=1e-12)
    assert not free.disturbance.any()
    assert run.nu[-1, 1] < -1e-2
    assert_array_equal(run.disturbance, np.tile([0, 100.0, 0, 0, 0, 0], (101, 1)))


def test_velocity_is_in_the_body_frame_with_yaw():
    run = simulate(
        changed(
            setpoint={'surge': {'offset': 1.0}},
            initial={'eta': [0, 0, 0, 0, 0, np.pi / 2], 'nu': [1.0, 0, 0, 0, 0, 0]},
            disturbance=[],
            duration=2.0,
        ),
        'gvc',
    )
    assert_allclose(run.nu, np.tile([1.0, 0, 0, 0, 0, 0], (201, 1)), atol=1e-9)
    assert_allclose(run.eta[-1], [0, 2, 0, 0, 0, np.pi / 2], atol=1e-9)


def test_psi_goes_on_over_pi():
    run = simulate(
        changed(
            setpoint={'yaw': {'offset': 1.0}},
            initial={'eta': [0.0] * 6, 'nu': [0, 0, 0, 0, 0, 1.0]},
            disturbance=[],
            duration=10.0,
        ),
        'gvc',
    )
    assert run.eta[-1, 5] == pytest.approx(10.0, abs=0.1)
    assert np.abs(np.diff(run.eta[:, 5])).max() < 0.02


def test_a_run_through_the_singularity_tracks_as_before():
    initial = {'eta': [0.0] * 6, 'nu': [0, 0, 0, 0, 0.5, 0]}
    turn = {'setpoint': {'pitch': {'offset': 0.5}}, 'duration': 7.0, 'disturbance': []}
    run = simulate(changed(initial=initial, **turn), 'gvc')
    assert np.isfinite(run.eta).all()
    assert np.abs(run.eta[:, 4]).max() == pytest.approx(np.pi / 2, abs=5e-3)
    assert_allclose(run.nu[:, 4], 0.5, atol=1e-6)


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_a_diverging_loop_says_when(hold):
    wild = {'cl': {'law': 'cl', 'k_D': 1e7, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}}
    scenario = changed(controllers=wild, integrator='euler', duration=10.0)
    with pytest.raises(
        DivergedError, match=r'case1, cl: .* diverges, not finite from t = 0\.\d+ s'
    ):
        simulate(scenario, 'cl', hold)


def test_what_cannot_be_simulated():
    scenario = changed(duration=0.1)
    with pytest.raises(InputError, match='controllers: expected one of gvc, cl, found pid'):
        simulate(scenario, 'pid')
    with pytest.raises(ValueError, match="hold: expected continuous or zoh, found 'foh'"):
        simulate(scenario, 'gvc', 'foh')


@pytest.mark.parametrize('hold', ['continuous', 'zoh'])
def test_the_attitude_stays_a_rotation(hold):
    # Euler's method lengthens a quaternion at every step: way made good is speed times step
    moving = {'setpoint': {'surge': {'offset': 1.0}, 'yaw': {'offset': 1.0}}, 'disturbance': []}
    initial = {'eta': [0.0] * 6, 'nu': [1.0, 0, 0, 0, 0, 1.0]}
    scenario = changed(integrator='euler', duration=10.0, initial=initial, **moving)
    run = simulate(scenario, 'gvc', hold)
    way = np.linalg.norm(np.diff(run.eta[:, :3], axis=0), axis=1)
    assert_allclose(way, 0.01 * np.linalg.norm(run.nu[:-1, :3], axis=1), rtol=1e-9)


def test_numbers_that_no_summary_can_hold_end_the_run(tmp_path):
    """A wrench of 1e110 N behind a limiter moves nothing, but it is no result either."""
    path = tmp_path / 'huge.yaml'
    path.write_text(
        'name: huge\nvehicle: rexrov\nduration: 0.1\nstep: 0.01\nsetpoint: {surge: {offset: 1}}\n'
        'actuators: {limit: 10}\n'
        'controllers: {a: {law: cl, k_D: 9.0e+99, k_I: 9.0e+99, Lambda: 9.0e+99, Gamma: 1}}\n'
    )
    with pytest.raises(DivergedError, match='diverges'):
        simulate(load_scenario(path), 'a', 'zoh')


@pytest.mark.parametrize('key', ['actuators', 'sensors'])
def test_devices_of_samples_need_the_hold(key, tmp_path):
    entry = {'actuators': '{limit: 10}', 'sensors': '{drop_out: 0.1}'}[key]
    path = tmp_path / 'case.yaml'
    path.write_text(
        'name: case\nvehicle: rexrov\nduration: 0.1\nstep: 0.01\nsetpoint: {surge: {offset: 1}}\n'
        'controllers: {a: {law: cl, k_D: 9, k_I: 9, Lambda: 9, Gamma: 1}}\n'
        f'{key}: {entry}\n'
    )
    with pytest.raises(InputError, match=f'{key}: expected hold .zoh.'):
        simulate(load_scenario(path), 'a')
    assert simulate(load_scenario(path), 'a', 'zoh').hold == 'zoh'


def test_the_seed_decides_the_noise():
    base = load_scenario('case1')
    sensors = {'velocity_noise': 0.01, 'drop_out': 0.1}
    runs = [
        simulate(replace(base, data=base.data | {'duration': 1.0, 'sensors': sensors, 'seed': s}),
                 'gvc', 'zoh')
        for s in (1, 1, 2)
    ]  # fmt: skip
    np.testing.assert_array_equal(runs[0].nu, runs[1].nu)
    assert np.abs(runs[0].nu_measured - runs[2].nu_measured).max() > 0.005


@pytest.mark.parametrize(
    ('jitted', 'installed', 'cached', 'said'),
    [
        (True, True, True, ''),
        (True, True, False, 'compiling the kernel for this machine, once ...\n'),
        (False, True, False, 'numba is switched off: the kernel runs as plain Python, slower\n'),
        (False, False, False, 'numba is not installed: the kernel runs as plain Python, slower\n'),
    ],
)
def test_what_makes_a_kernel_slow_is_said(
    jitted, installed, cached, said, tmp_path, monkeypatch, capsys
):
    (tmp_path / 'deep').mkdir()
    (tmp_path / 'deep' / f'kernel.{"nbi" if cached else "nbc"}').touch()
    told = {'JITTED': jitted, 'INSTALLED': installed, 'cache_folder': lambda: tmp_path}
    for name, value in told.items():
        monkeypatch.setattr(f'auv_analysis.simulation.simulate.{name}', value)
    announce(load_scenario('case1'), ['gvc', 'cl'])
    assert capsys.readouterr().err == said


def works(seconds: float) -> None:
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def test_a_kernel_that_takes_work_is_announced_and_no_machine_that_is_busy(monkeypatch, capsys):
    scenario = load_scenario('case1')
    warm_up(scenario, [])
    monkeypatch.setattr('auv_analysis.simulation.simulate.NOTICE_AFTER', 0.2)
    for takes, said in (time.sleep, False), (works, True):
        capsys.readouterr()
        plant = lambda *_, takes=takes: takes(0.3)  # noqa: E731
        monkeypatch.setattr('auv_analysis.simulation.simulate.Plant', plant)
        warm_up(scenario, [])
        assert ('kernel ready after ' in capsys.readouterr().err) is said
