"""Small wrenches and the answer to them: each fault of a mapping is told, a healthy one passes."""

from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers.made_odometry import graph
from helpers.simulated_driver import SimulatedDriver, planned

from auv_analysis.driver.checks import CHECKS, document_of
from auv_analysis.driver.checks import judge as judged
from auv_analysis.driver.evidence import (
    FAIL,
    NOT_CHECKED,
    PASS,
    CheckResult,
    DriverRecord,
    Settings,
)
from auv_analysis.driver.excitation import carry_out
from auv_analysis.driver.plan import HELD, LEVEL, PULSE, SWING, UNHEARD, ZERO, Plan, plan_of
from auv_analysis.driver.response import Noise, fit_response, predicted
from auv_analysis.driver.response_checks import command_to_response_delay
from auv_dynamics import Vehicle, load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS

pytestmark = pytest.mark.usefixtures('approved')

AXES = ('surge', 'sway', 'yaw')


def gains(**factors: float):
    """A mapping that multiplies some axes."""
    size = np.array([factors.get(dof, 1.0) for dof in DOFS])
    return lambda tau: size * tau


OTHERWISE = {  # what a right driver of another vehicle than the model's may be
    'quick and late': {'inertia': 0.3, 'delay': 0.3},
    'slow and late': {'inertia': 3.0, 'delay': 0.15},
    'dragging': {'damping': 3.0, 'delay': 0.3},
    'quick, with lag, biased and noisy': {
        'inertia': 0.3,
        'lag': 0.15,
        'delay': 0.1,
        'bias': (0.03, -0.02, 0.01, 0.0, 0.0, 0.0),
        'noise': 3e-3,
    },
}


def exchanged(one: str, other: str):
    order = list(range(6))
    i, j = DOFS.index(one), DOFS.index(other)
    order[i], order[j] = j, i
    return lambda tau: tau[order]


def evidence_of(driver: SimulatedDriver, *axes: str, raised: float = 0.0) -> DriverRecord:
    plan = planned(driver.vehicle, axes, 0.1, None, None, raised)
    excitation = carry_out(driver, plan, 0.5, lambda: False)
    return DriverRecord(graph(), driver.log(), Settings(), excitation)


def judge(driver: SimulatedDriver, *axes: str) -> dict[str, CheckResult]:
    evidence = evidence_of(driver, *axes)
    ids = [id for id, check in CHECKS.items() if check.group == 'response']
    return {finding.id: finding for finding in judged(evidence, ids)}


@pytest.mark.parametrize('vehicle', ['bluerov2_heavy', 'rexrov', 'lauv'])
def test_a_healthy_driver_passes_in_every_axis(vehicle: str) -> None:
    found = judge(SimulatedDriver(vehicle, delay=0.05, noise=1e-3))
    assert {finding.verdict for finding in found.values()} == {PASS}, found
    for dof in DOFS:
        assert found[f'response_{dof}'].numbers['gain'] == pytest.approx(1.0, abs=0.15)
    assert found['response_delay'].numbers['median_s'] == pytest.approx(0.05, abs=0.04)
    assert found['silence'].numbers['ceased_s'] == pytest.approx(0.5, abs=0.2)


def test_a_steady_force_of_the_water_is_no_answer() -> None:
    found = judge(SimulatedDriver(drift=(1.0, -1.0, 0.0, 0.0, 0.0, 0.02), noise=1e-3), *AXES)
    for dof in AXES:
        assert found[f'response_{dof}'].numbers['gain'] == pytest.approx(1.0, abs=0.2)


def test_a_reversed_axis_is_named_and_the_others_pass() -> None:
    found = judge(SimulatedDriver(mapping=gains(sway=-1.0), noise=1e-3), 'surge', 'sway')
    assert found['response_sway'].verdict == FAIL
    assert found['response_sway'].numbers['gain'] == pytest.approx(-1.0, abs=0.1)
    assert 'sign is reversed' in found['response_sway'].advice
    assert found['response_surge'].verdict == PASS
    assert found['response_roll'].verdict == NOT_CHECKED
    assert '--axis' in found['response_roll'].found


def test_exchanged_axes_are_named() -> None:
    found = judge(SimulatedDriver(mapping=exchanged('surge', 'sway'), noise=1e-3), *AXES)
    assert found['response_surge'].verdict == found['response_sway'].verdict == FAIL
    assert 'it answers in sway' in found['response_surge'].found
    assert 'surge and sway are exchanged' in found['response_surge'].advice
    assert found['response_yaw'].verdict == PASS


@pytest.mark.parametrize(('factor', 'word'), [(0.0, 'no answer'), (3.0, 'scale'), (0.3, 'scale')])
def test_too_little_and_too_much_are_told(factor: float, word: str) -> None:
    found = judge(SimulatedDriver(mapping=gains(surge=factor), noise=1e-3), 'surge')
    assert found['response_surge'].verdict == FAIL
    assert found['response_surge'].numbers['gain'] == pytest.approx(factor, rel=0.2, abs=0.05)
    assert word in found['response_surge'].advice


def test_a_late_answer_is_told() -> None:
    found = judge(SimulatedDriver(delay=0.45, noise=1e-3), *AXES)
    assert found['response_delay'].verdict == FAIL
    assert found['response_delay'].numbers['median_s'] == pytest.approx(0.45, abs=0.04)


def test_noise_that_hides_the_answer_gives_no_verdict() -> None:
    found = judge(SimulatedDriver(noise=0.15), 'surge')
    assert found['response_surge'].verdict == NOT_CHECKED
    assert 'too vague' in found['response_surge'].found
    assert found['silence'].verdict == NOT_CHECKED


@pytest.mark.parametrize('applied', [False, True])
def test_a_driver_without_a_watchdog_fails(applied: bool) -> None:
    found = judge(SimulatedDriver(watchdog=None, applied=applied, noise=1e-3), 'surge')
    assert found['response_surge'].verdict == PASS
    assert found['silence'].verdict == FAIL
    assert 'not within' in found['silence'].found
    assert ('wrench_applied' in found['silence'].found) == applied


def test_a_slow_watchdog_fails_and_what_was_applied_tells_it_exactly() -> None:
    found = judge(SimulatedDriver(watchdog=1.5, applied=True, noise=0.15), 'surge')
    assert found['silence'].verdict == FAIL
    assert found['silence'].numbers['ceased_s'] == pytest.approx(1.5, abs=0.03)


def test_a_slow_watchdog_fails_by_the_motion_as_well() -> None:
    found = judge(SimulatedDriver(watchdog=1.5, noise=1e-3), 'surge')['silence']
    assert found.verdict == FAIL
    assert 'by the motion' in found.found
    assert found.numbers['ceased_s'] == pytest.approx(1.5, abs=0.3)


def test_what_was_applied_tells_nothing_where_it_never_was_the_wrench() -> None:
    driver = SimulatedDriver(mapping=gains(surge=0.0), applied=True, noise=1e-3)
    found = judge(driver, 'surge')['silence']
    assert found.verdict == NOT_CHECKED
    assert 'never showed the wrench' in found.found


def test_what_was_broken_off_fails_and_says_why_the_rest_is_not_told() -> None:
    found = judge(SimulatedDriver(silent_after=2.5), 'surge')
    assert found['actuation'].verdict == FAIL
    assert found['actuation'].numbers['carried_out'] == 1
    for id in ('response_surge', 'silence'):
        assert found[id].verdict == NOT_CHECKED
        assert 'no odometry for 0.5 s' in found[id].found


def test_the_bound_holds_on_the_model_and_caps_are_kept() -> None:
    for name in ('bluerov2_heavy', 'lauv', 'rexrov'):
        vehicle = load_vehicle(name)
        for trial in plan_of(vehicle, (), 0.1, None, None).trials[:-1]:
            back = tuple(-number for number in trial.tau)
            held = [(0.0, PULSE, trial.tau), (PULSE, 2 * PULSE, back)]
            added = predicted(vehicle, np.eye(13)[3], held).added
            assert 0.01 < np.abs(added).max() <= 0.101, (name, trial.dof)
    heavy = load_vehicle('bluerov2_heavy')
    for dofs, last in ((['heave', 'yaw'], 'yaw'), (['pitch', 'heave'], 'heave')):
        plan = plan_of(heavy, dofs, 0.1, None, None)  # ends with what nothing rights
        assert (plan.trials[-1].dof, plan.trials[-1].silent) == (last, True)
    plan: Plan = plan_of(load_vehicle('rexrov'), (), 0.1, 5.0, 2.0)
    assert {trial.size for trial in plan.trials} == {5.0, 2.0}
    assert plan.trials[-1].silent


@pytest.mark.parametrize(('name', 'raised'), [('herman2018', 0.0), ('bluerov2_heavy', 0.5)])
def test_the_bound_holds_whenever_a_driver_lets_go(name: str, raised: float) -> None:
    vehicle = load_vehicle(name)
    plan = plan_of(vehicle, ['roll'], 0.1, None, None, raised)  # swings back
    tau = plan.trials[-1].tau
    for end in np.linspace(HELD, HELD + UNHEARD, 11):
        held = [(0.0, end, tau), (end, end + SWING, ZERO)]
        assert np.abs(predicted(vehicle, LEVEL, held).added).max() <= 1.01 * plan.trials[-1].speed


def test_a_model_too_stiff_to_be_predicted_gets_no_wrench() -> None:
    """Its predictions diverged, and the wrenches that followed from them were not finite."""
    heavy = load_vehicle('bluerov2_heavy')

    def plan(rate: float) -> Plan:
        stiff = heavy.changed(D_linear=rate * heavy.M, D_quadratic=np.zeros((6, 6)))
        return plan_of(stiff, (), 0.1, None, None)

    assert all(0.0 < trial.size < np.inf for trial in plan(399.0).trials)
    with pytest.raises(InputError, match=r': damping: expected .* 2\.5 ms.*, found 2\.4 ms'):
        plan(410.0)


def test_axes_without_thrusters_are_left_out(approved) -> None:
    plan = plan_of(load_vehicle('bluerov2'), (), 0.1, None, None)
    assert set(plan.skipped) == {'pitch'}
    assert 'pitch' not in [trial.dof for trial in plan.trials]
    approved.add([*plan.lines(), *map(' '.join, plan.skipped.items())])


@pytest.mark.parametrize('model_error', OTHERWISE)
def test_a_sign_is_told_whatever_the_model_is_off_by(model_error: str) -> None:
    kind = {'noise': 1e-3, **OTHERWISE[model_error]}
    for sign in (1.0, -1.0):
        driver = SimulatedDriver(mapping=lambda tau, sign=sign: sign * tau, **kind)
        evidence = evidence_of(driver, 'surge', 'roll', 'pitch', 'yaw')
        for trial in evidence.answered:
            found = CHECKS[f'response_{trial.trial.dof}'].finding(evidence)
            assert trial.response.sign == sign, found
            assert ('sign is reversed' in found.advice) == (sign < 0)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_what_fits_both_signs_is_undecided(sign: float) -> None:
    driver = SimulatedDriver(mapping=lambda tau: sign * tau, delay=1.0, noise=3e-3, watchdog=None)
    found = judge(driver, *AXES)
    for dof in AXES:
        one = found[f'response_{dof}']
        assert one.verdict == NOT_CHECKED, one
        assert 'undecided: both signs fit' in one.found
        assert 'reversed' not in one.advice
    assert found['response_delay'].verdict == NOT_CHECKED


def test_the_other_sign_is_tried_as_late_whatever_the_pulse() -> None:
    """The model's own response, 0.95 s late: of 0.5 s pulses it was called reversed."""
    vehicle, pulse, sigma = load_vehicle('bluerov2_heavy'), 0.5, 3e-3
    for trial in plan_of(vehicle, ('roll', 'pitch', 'yaw'), 0.1, None, None, 0.5).trials[:-1]:
        assert trial.pulse == pulse
        back = tuple(-number for number in trial.tau)
        held = [(i * pulse, (i + 1) * pulse, tau) for i, tau in enumerate((ZERO, trial.tau, back))]
        held.append((3 * pulse, 4 * pulse, ZERO))
        model, t = predicted(vehicle, LEVEL, held), np.arange(0.0, 4 * pulse, 0.02)
        nu = np.random.default_rng(0).normal(0.0, sigma, (len(t), 6))
        nu[:, trial.axis] += np.interp(t - 0.95, model.t, model.added[:, trial.axis])
        noise = Noise(np.full(6, sigma**2), np.ones(6))
        found = fit_response(vehicle, LEVEL, held, t, nu, trial.axis, noise, pulse / 2)
        assert found.sign == 0, trial.dof


def test_the_delay_is_measured_and_what_to_do_with_it_is_said() -> None:
    driver = SimulatedDriver(delay=0.12, noise=2e-3)
    evidence = evidence_of(driver, *AXES)
    delay = document_of(evidence, judged(evidence))['command_to_response_delay']
    assert delay['seconds'] == pytest.approx(0.12, abs=3.0 * delay['uncertainty'])
    assert 0.0 < delay['uncertainty'] < 0.05
    assert set(delay['axes']) == set(AXES)
    found = CHECKS['response_delay'].finding(evidence)
    assert f'auv linearize SCENARIO {delay["option"]}' in found.found


def answer(dof: str, delay: float, error: float, pulse: float = 1.0, sign: int = 1) -> Made:
    fit = Made(sign=sign, delay=delay, delay_error=error)
    return Made(trial=Made(dof=dof, pulse=pulse), response=fit)


def test_a_delay_is_the_median_of_the_axes_and_as_unsure_as_they_are_apart() -> None:
    some = [answer('surge', 0.1, 0.01), answer('sway', 0.14, 0.03), answer('yaw', 0.42, 0.02)]
    undecided = answer('heave', 0.9, 0.0, sign=0)
    bounded = answer('roll', 0.24, 0.01, pulse=0.5)  # as late as half of its pulse
    delay = command_to_response_delay(Made(answered=[*some, undecided, bounded]))
    axes = {dof: tuple(axis.values()) for dof, axis in delay['axes'].items()}
    assert axes == {'surge': (0.1, 0.01), 'sway': (0.14, 0.03), 'yaw': (0.42, 0.02)}
    assert (delay['seconds'], delay['option']) == (0.14, '--delay 0.14')
    assert delay['uncertainty'] == pytest.approx(1.48 * 0.04)
    one = command_to_response_delay(Made(answered=[answer('yaw', 0.2, 0.03, sign=-1), undecided]))
    assert (one['seconds'], one['uncertainty']) == (0.2, pytest.approx(0.03))
    errors = [answer('surge', 0.2, 0.03), answer('yaw', 0.2, 0.04)]
    two = command_to_response_delay(Made(answered=errors))
    assert two['uncertainty'] == pytest.approx(0.05 / np.sqrt(2.0))
    assert command_to_response_delay(Made(answered=[bounded]))['seconds'] == 0.24
    assert command_to_response_delay(Made(answered=[undecided])) is None


@pytest.mark.parametrize(
    ('delays', 'verdict', 'most'),
    [
        ((0.1, 0.3, 0.49), PASS, '0.49 s at most'),
        ((0.1, 0.31, 0.5), FAIL, 'at least 0.50 s at most'),
    ],
)
def test_a_delay_that_may_be_longer_is_said_to_be(delays, verdict: str, most: str) -> None:
    axes = [answer(dof, delay, 0.01, 2.0) for dof, delay in zip(AXES, delays, strict=True)]
    found = CHECKS['response_delay'].judge(Made(answered=axes))
    assert (found.verdict, found.numbers['largest_s']) == (verdict, delays[-1])
    assert f'(median of 3), {most}; for gains' in found.found


@pytest.mark.parametrize(
    ('until', 'verdict', 'ceased'), [(0.0, PASS, 0.0), (0.9, PASS, 0.9), (1.2, FAIL, 1.2)]
)
def test_what_was_applied_tells_when_a_driver_let_go(until: float, verdict: str, ceased) -> None:
    """At 10 Hz from half a second before the last wrench on; a twentieth of it is none."""
    t = np.arange(-5, 21) / 10.0
    applied = np.zeros((len(t), 6))
    applied[:, 5] = np.where(t <= until, -2.0, 0.09)
    trial = Made(dof='yaw', size=2.0, silent=True)
    one = Made(trial=trial, applied_t=t + 3.0, applied=applied, silent_from=3.0)
    found = CHECKS['silence'].judge(Made(trials=[Made(trial=Made(silent=False)), one]))
    assert (found.verdict, found.numbers['ceased_s']) == (verdict, pytest.approx(ceased))
    assert found.numbers['watched_s'] == pytest.approx(2.0)


def test_noise_is_measured_at_rest() -> None:
    one = judge(SimulatedDriver(noise=0.01), 'sway')['response_sway']
    assert one.verdict == PASS
    assert one.numbers['noise_at_rest'] == pytest.approx(0.01, rel=0.15)


def in_dead_band(vehicle: Vehicle):
    """A mapping by thrusters of which none turns below the thrust that the vehicle file tells."""
    thrusters = vehicle.thrusters
    least = np.array([max(rotor.dead_band) for rotor in thrusters.rotors])

    def acting(tau: np.ndarray) -> np.ndarray:
        u = thrusters.inverse @ tau
        return thrusters.matrix @ np.where(np.abs(u) < least, 0.0, u)

    return acting


def test_pulses_are_above_the_dead_band_of_the_vehicle_file() -> None:
    driver = SimulatedDriver(noise=1e-3)
    driver.take(in_dead_band(driver.vehicle))
    evidence = evidence_of(driver, 'roll', 'yaw', raised=0.5)
    trials = evidence.sent.plan.trials[:-1]
    assert all(trial.size > trial.dead_band > 0.0 for trial in trials)
    assert {trial.pulse for trial in trials} == {PULSE / 2}
    for dof in ('roll', 'yaw'):
        found = CHECKS[f'response_{dof}'].finding(evidence)
        assert found.verdict == PASS, found


def test_a_response_reduced_by_the_dead_band_is_named_as_such() -> None:
    driver = SimulatedDriver(noise=1e-3)
    driver.take(in_dead_band(driver.vehicle))
    for dof in ('roll', 'yaw'):
        found = judge(driver, dof)[f'response_{dof}']
        assert found.verdict == NOT_CHECKED
        assert 'reduced by the dead band of the thrusters' in found.found
        assert 'no fault of sign or axis' in found.advice
