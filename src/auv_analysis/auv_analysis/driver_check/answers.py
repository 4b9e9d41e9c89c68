"""Findings of what was commanded."""

from collections.abc import Sequence

from auv_analysis.driver_check.finding import Finding
from auv_analysis.driver_check.plan import Plan
from auv_analysis.driver_check.procedure import Actuation
from auv_analysis.driver_check.recording import Recording
from auv_analysis.driver_check.response_checks import response_findings
from auv_analysis.driver_check.silence import silence_finding
from auv_analysis.driver_check.trials import Answered, answered, heard_of
from auv_dynamics.vehicle.vehicle import Vehicle


def answers_of(
    vehicle: Vehicle, plan: Plan, actuation: Actuation, recording: Recording
) -> tuple[list[Finding], Sequence[Answered]]:
    """Findings of a plan that was carried out, and the answers behind them.

    Parameters
    ----------
    vehicle : the model
    plan, actuation : what was meant to be sent, and what was
    recording : of all the time

    """
    heard = [(sent.trial, heard_of(sent, recording)) for sent in actuation.sent]
    answers = [answered(vehicle, one) for trial, one in heard if one and not trial.silent]
    silent = next((one for trial, one in heard if trial.silent), None)
    findings = response_findings(plan, actuation, answers)
    return [*findings, silence_finding(vehicle, silent, actuation.aborted)], answers
