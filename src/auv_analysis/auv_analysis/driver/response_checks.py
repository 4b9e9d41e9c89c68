"""Response checks: sign, axis, size and delay of the response to a wrench, and the watchdog."""

from typing import Any

import numpy as np

from auv_analysis.driver.evidence import CheckResult, DriverRecord, judged, unchecked
from auv_analysis.driver.excitation import MeasuredTrial
from auv_analysis.driver.plan import PULSE
from auv_analysis.driver.response import FINE, NOTHING
from auv_analysis.output.text import join, number
from auv_dynamics.ros.interface import WRENCH_APPLIED
from auv_dynamics.vehicle import DOFS

GAINS = (0.5, 2.0)  # of the measured over the predicted response
VAGUE = 1.0  # of the predicted peak: noise that hides the response
LATEST = PULSE / 2  # s of delay that are looked for
PROMPT = 0.3  # s
ELSEWHERE = 0.5  # of the speed of the plan, in an axis where the model has none of it
LONGEST = 1.0  # s of silence after which a driver must have let go
LITTLE = 0.05  # of the wrench: less is none
DEVIATION = 1.48  # standard deviation by the median one
STEP = 0.2  # s between two times that are tried
CLEAR = 25.0  # how much more often one explanation must be right: the difference in log-likelihood
WATCHDOG = 'give the driver a watchdog: a wrench older than some 0.5 s is zero'
TINY = float(np.finfo(float).tiny)


def actuation(evidence: DriverRecord) -> CheckResult:
    """Wrenches that were sent."""
    excitation = evidence.sent
    expected = 'all wrenches of the plan, the last ones zero'
    sent = excitation.sent
    sizes = [f'{one.trial.dof} {one.trial.size:.3g} {one.trial.unit}' for one in sent]
    count = sum(len(one.steps) for one in sent)
    found = f'{count} wrenches ({join(sizes)}), then zero'
    if excitation.aborted:
        found += f'; broken off: {excitation.aborted}'
    advice = 'mend what broke it off, then ask again'
    numbers = {
        'wrenches': count,
        'trials': len(excitation.plan.trials),
        'carried_out': len(sent),
    }
    return judged(not excitation.aborted, expected, found, advice, **numbers)


def response(dof: str, evidence: DriverRecord) -> CheckResult:
    """Response to a wrench."""
    excitation = evidence.sent
    expected = f'a wrench in {dof} moves it by {GAINS[0]:g} to {GAINS[1]:g} times what the model '
    expected += 'says, the same way'
    if dof in excitation.plan.skipped:
        return unchecked(expected, excitation.plan.skipped[dof])
    measured = next((one for one in evidence.answered if one.trial.dof == dof), None)
    if measured is None:
        return unchecked(expected, excitation.aborted or 'too little odometry')
    found, trial = measured.response, measured.trial
    gain, unit = found.gain, trial.speed_unit
    peak, model = float(found.measured[trial.axis]), float(found.predicted[trial.axis])
    text = f'{number(gain)} times: {number(peak)} {unit} for {number(model)}, '
    text += f'by {trial.size:.3g} {trial.unit}'
    numbers = {
        'gain': gain,
        'delay_s': found.delay,
        'delay_uncertainty_s': found.delay_error,
        'peak': peak,
        'peak_predicted': model,
        'noise': found.residual,
        'noise_at_rest': float(np.sqrt(measured.noise.variance[trial.axis])),
        'size': trial.size,
    }
    other = _elsewhere(measured)
    if found.residual > VAGUE * abs(model) and not found.sign:
        text += f', under a noise of {number(found.residual)}: too vague'
        advice = 'noise or drift hides the response: quieter water, or more --speed'
        return unchecked(expected, text, advice, **numbers)
    advice = 'thrust and mass of the vehicle file, or the scale of the mapping?'
    if gain < GAINS[0]:
        advice = f'the sign is right: a dead band that the driver leaves in, {advice}'
    if other and abs(gain) < GAINS[0]:
        text += f'; it answers in {other}'
        advice = f'{dof} and {other} are exchanged in the mapping of the wrench'
    elif not trial.turns and abs(gain) < (GAINS[0] if found.sign > 0 else NOTHING):
        text += f'; reduced by the dead band of the thrusters, {trial.dead_band:.3g} {trial.unit}'
        return unchecked(expected, text, 'no fault of sign or axis; more --speed', **numbers)
    elif abs(gain) < NOTHING:
        advice = 'no answer: armed, enabled, in the right mode, beyond the dead band of --force?'
    elif not found.sign:
        text += '; undecided: both signs fit, with another inertia, damping or delay'
        advice = 'leave the sign as it is; a truer vehicle file, quieter water or more --speed'
        return unchecked(expected, text, advice, **numbers)
    elif found.sign < 0:
        advice = 'the sign is reversed: of this axis of the wrench, or of the velocity'
    return judged(GAINS[0] <= gain <= GAINS[1], expected, text, advice, **numbers)


def _elsewhere(measured: MeasuredTrial) -> str:
    """Degree of freedom that answers in the place of the one that was asked, or an empty text."""
    more = np.abs(measured.response.measured - measured.response.predicted)
    more[measured.trial.axis] = 0.0
    largest = int(np.argmax(more))
    return DOFS[largest] if more[largest] > ELSEWHERE * measured.trial.speed else ''


def command_to_response_delay(evidence: DriverRecord) -> dict[str, Any] | None:
    """Delay from a wrench to the odometry that shows the answer; None where no sign is told.

    Returns
    -------
    delay : ready for JSON; `seconds` and `uncertainty`, the median over the axes, `option`, the
        same for `auv linearize`, and `axes`, degree of freedom -> seconds and uncertainty

    """
    told = [one for one in evidence.answered if one.response.sign]
    # a short pulse bounds the delay that it can tell
    within = [one for one in told if one.response.delay + FINE < one.trial.pulse / 2] or told
    axes = {
        one.trial.dof: {'seconds': one.response.delay, 'uncertainty': one.response.delay_error}
        for one in within
    }
    if not axes:
        return None
    delays, errors = np.array([[*axis.values()] for axis in axes.values()]).T
    # what the model is off by is off in every axis: many of them make it no surer
    scatter = DEVIATION * np.median(np.abs(delays - np.median(delays)))
    seconds, error = float(np.median(delays)), max(np.sqrt((errors**2).mean()), scatter)
    option = f'--delay {seconds:.3g}'
    return {'seconds': seconds, 'uncertainty': float(error), 'option': option, 'axes': axes}


def response_delay(evidence: DriverRecord) -> CheckResult:
    """Delay of the response."""
    expected = f'an answer within {PROMPT:g} s, to and fro'
    delay = command_to_response_delay(evidence)
    if delay is None:
        return unchecked(expected, 'no answer that is like the model')
    seconds, error, axes = delay['seconds'], delay['uncertainty'], delay['axes']
    most = max(axis['seconds'] for axis in axes.values())
    found = f'{seconds:.2f} ± {error:.2f} s (median of {len(axes)}), '
    found += f'{"at least " if most >= LATEST else ""}{most:.2f} s at most; '
    found += f'for gains with margins: auv linearize SCENARIO {delay["option"]}'
    advice = 'what waits on the way? a delay takes stability from every gain'
    numbers = {'median_s': seconds, 'uncertainty_s': error, 'largest_s': most}
    return judged(seconds <= PROMPT, expected, found, advice, **numbers)


def silence(evidence: DriverRecord) -> CheckResult:
    """Zero when commands cease."""
    expected = f'zero within {LONGEST:g} s of the last wrench'
    trial = next((one for one in evidence.trials if one.trial.silent), None)
    if trial is None:
        return unchecked(expected, evidence.sent.aborted or 'too little odometry')
    if (trial.applied_t > trial.silent_from).any():
        return _by_actuators(trial, expected)
    alike = (one.response.scales for one in evidence.answered if one.trial.dof == trial.trial.dof)
    return _by_motion(trial, next(alike, np.ones(2)), expected)


def _by_actuators(trial: MeasuredTrial, expected: str) -> CheckResult:
    t = trial.applied_t - trial.silent_from
    acts = np.abs(trial.applied).max(axis=1) > LITTLE * trial.trial.size
    if not acts[t <= 0].any():
        return unchecked(expected, f'{WRENCH_APPLIED} never showed the wrench')
    ceased, watched = max(float(t[acts].max()), 0.0), float(t.max())
    when = f'not within {watched:.2f}' if acts[-1] else f'zero after {ceased:.2f}'
    found = f'{when} s, by {WRENCH_APPLIED}'
    numbers = {'ceased_s': ceased, 'watched_s': watched}
    return judged(ceased <= LONGEST and not acts[-1], expected, found, WATCHDOG, **numbers)


def _by_motion(trial: MeasuredTrial, scales: np.ndarray, expected: str) -> CheckResult:
    """By the velocity: which time of letting go explains it best, against never letting go.

    Inertia and damping are those, times the model's, of the answer in this axis.
    """
    end = float(trial.t[-1])
    watched = end - trial.silent_from
    times = np.arange(0.0, watched, STEP)
    left = np.array([_unexplained(trial, scales, trial.silent_from + late) for late in times])
    never = _unexplained(trial, scales, end)
    # of normal errors: n/2 times the logarithm of the ratio of the squares
    n, ceased = len(trial.t), float(times[left.argmin()])
    never, best, early = (
        max(float(one), TINY) for one in (never, left.min(), left[times <= LONGEST].min())
    )
    stops, goes_on = n / 2 * float(np.log(never / best)), n / 2 * float(np.log(early / never))
    numbers = {'ceased_s': ceased, 'stops': stops, 'goes_on': goes_on}
    if stops > CLEAR:
        found = f'zero after {ceased:.1f} s, by the motion'
        return judged(ceased <= LONGEST, expected, found, WATCHDOG, **numbers)
    if goes_on > CLEAR:
        found = f'not within {watched:.1f} s, by the motion'
        return judged(False, expected, found, WATCHDOG, **numbers)
    advice = f'publish {WRENCH_APPLIED}, which tells it without a doubt'
    return unchecked(expected, 'the motion does not tell it', advice, **numbers)


def _unexplained(trial: MeasuredTrial, scales: np.ndarray, until: float) -> float:
    """Squares of the velocity that are left if the last wrench acted until a time, s."""
    end = float(trial.t[-1]) + LATEST
    *before, (begin, _, tau) = trial.held
    held = [*before, (begin, until, tau)]
    if until < end:
        held.append((until, end, (0.0,) * 6))
    return trial.response_to(held, scales[None]).squares
