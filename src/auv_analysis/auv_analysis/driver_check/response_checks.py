"""Checks of the answer to small wrenches: sign, size, axis and delay."""

from collections.abc import Sequence

import numpy as np

from auv_analysis.driver_check.finding import FAIL, PASS, Finding, judged, unchecked
from auv_analysis.driver_check.plan import Plan
from auv_analysis.driver_check.procedure import Actuation
from auv_analysis.driver_check.trials import Answered
from auv_analysis.output.text import join, number
from auv_dynamics.vehicle import DOFS

GAINS = (0.5, 2.0)  # of the measured over the predicted answer
NOTHING = 0.2  # of it: no answer
SURE = 3.0  # standard errors
VAGUE = 0.25  # standard error of a gain that says too little
PROMPT = 0.3  # s
ELSEWHERE = 0.5  # of the speed of the plan, in an axis where the model has none of it


def response_findings(
    plan: Plan, actuation: Actuation, answers: Sequence[Answered]
) -> list[Finding]:
    """Findings of the trials of a plan."""
    by_dof = {one.heard.trial.dof: one for one in answers}
    findings = [_actuation(plan, actuation)]
    for dof in DOFS:
        id, expected = f'response_{dof}', f'a wrench in {dof} moves it by {GAINS[0]:g} to '
        expected += f'{GAINS[1]:g} times what the model says, the same way'
        if dof in plan.skipped:
            findings.append(unchecked(id, expected, plan.skipped[dof]))
        elif dof not in by_dof:
            findings.append(unchecked(id, expected, actuation.aborted or 'too little odometry'))
        else:
            findings.append(_answer(id, expected, by_dof[dof], plan))
    return [*findings, _delay(findings, answers)]


def _actuation(plan: Plan, actuation: Actuation) -> Finding:
    expected = 'all wrenches of the plan, the last ones zero'
    sizes = [f'{one.trial.dof} {one.trial.size:.3g} {one.trial.unit}' for one in actuation.sent]
    count = sum(len(one.steps) for one in actuation.sent)
    found = f'{count} wrenches ({join(sizes)}), then zero'
    numbers = {'wrenches': count, 'trials': len(plan.trials), 'carried_out': len(actuation.sent)}
    if actuation.aborted:
        found += f'; broken off: {actuation.aborted}'
    advice = 'mend what broke it off, then ask again'
    return judged('actuation', not actuation.aborted, expected, found, advice, **numbers)


def _answer(id: str, expected: str, answer: Answered, plan: Plan) -> Finding:
    response, trial = answer.response, answer.heard.trial
    unit = 'm/s' if trial.axis < 3 else 'rad/s'
    peak, model = response.measured[trial.axis], response.predicted[trial.axis]
    found = (
        f'{number(response.gain)} ± {number(response.error, 1)} times: {number(peak)} {unit} '
        f'for {number(model)}, by {trial.size:.3g} {trial.unit}'
    )
    numbers = {
        'gain': response.gain, 'gain_error': response.error, 'delay_s': response.delay,
        'peak': float(peak), 'peak_predicted': float(model), 'size': trial.size,
    }  # fmt: skip
    if response.error > VAGUE:
        advice = 'noise or drift hides the answer: quieter water, or more --speed'
        return unchecked(id, expected, f'{found}: too vague', advice, **numbers)
    if GAINS[0] <= response.gain <= GAINS[1]:
        return Finding(id, expected, found, PASS, '', numbers)
    other = _elsewhere(answer, plan.speed)
    advice = 'thrust and mass of the vehicle file, the scale of the mapping, or a dead band?'
    if other and abs(response.gain) < GAINS[0]:
        found += f'; it answers in {other}'
        advice = f'{trial.dof} and {other} are exchanged in the mapping of the wrench'
    elif response.gain < -max(NOTHING, SURE * response.error):
        advice = 'the sign is reversed: of this axis of the wrench, or of the velocity'
    elif abs(response.gain) < NOTHING:
        advice = 'no answer: armed, enabled, in the right mode, beyond the dead band of --force?'
    return Finding(id, expected, found, FAIL, advice, numbers)


def _elsewhere(answer: Answered, speed: float) -> str:
    """Degree of freedom that answers in the place of the one that was asked, or an empty text."""
    more = np.abs(answer.response.measured - answer.response.predicted)
    more[answer.heard.trial.axis] = 0.0
    largest = int(np.argmax(more))
    return DOFS[largest] if more[largest] > ELSEWHERE * speed else ''


def _delay(findings: Sequence[Finding], answers: Sequence[Answered]) -> Finding:
    expected = f'an answer within {PROMPT:g} s, to and fro'
    passed = {finding.id for finding in findings if finding.verdict == PASS}
    late = [one.response.delay for one in answers if f'response_{one.heard.trial.dof}' in passed]
    if not late:
        return unchecked('response_delay', expected, 'no answer that is like the model')
    middle, most = float(np.median(late)), max(late)
    found = f'{middle:.2f} s (median of {len(late)}), {most:.2f} s at most'
    advice = 'what waits on the way? a delay takes stability from every gain'
    return judged('response_delay', middle <= PROMPT, expected, found, advice, median_s=middle,
                  largest_s=most)  # fmt: skip
