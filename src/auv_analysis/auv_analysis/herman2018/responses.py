"""Cross-coupling of the velocity errors: their response to set-points of other DOF."""

import numpy as np

from auv_analysis.herman2018.evidence import ErrorSensitivity
from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.simulate import DivergedError, simulate
from auv_analysis.studies.study.sensitivity import Sensitivity
from auv_dynamics.vehicle import DOFS

STEP = 1.1  # factor by which a set-point is changed
ERROR = 'velocity_error.rms'


def moved_setpoints(scenario: Scenario) -> list[int]:
    """Degrees of freedom whose set-point is ever other than zero."""
    return [i for i, dof in enumerate(DOFS) if _numbers(scenario, dof)]


def setpoint_changes(scenario: Scenario) -> list[dict[str, float]]:
    """Changes for `changed_scenario`: nothing first, then each set-point times `STEP`."""
    each = [_numbers(scenario, DOFS[i]) for i in moved_setpoints(scenario)]
    return [{}, *({path: STEP * value for path, value in numbers.items()} for numbers in each)]


def _numbers(scenario: Scenario, dof: str) -> dict[str, float]:
    """Path -> offset or amplitude of a set-point, those that are not zero."""
    entry = scenario.data['setpoint'].get(dof, {})
    found = {f'setpoint.{dof}.offset': entry.get('offset', 0.0)}
    for j, term in enumerate(entry.get('terms', [])):
        found[f'setpoint.{dof}.terms[{j}].amplitude'] = term['amplitude']
    return {path: value for path, value in found.items() if value != 0.0}


def followed(errors: np.ndarray, moved: list[int]) -> np.ndarray:
    """Relative change of each error per relative change of the set-points of the others.

    Parameters
    ----------
    errors : (1 + m, 6) RMS errors: unchanged, then with each of m set-points changed
    moved : degrees of freedom of these set-points

    Returns
    -------
    followed : (6,) root of the sum of squares over the others

    """
    with np.errstate(divide='ignore', invalid='ignore'):
        change = np.log(errors[1:] / errors[0]) / np.log(STEP)
    change = np.where(np.isfinite(change), change, 0.0)  # an error that is zero throughout
    other = np.array(moved)[:, None] != np.arange(6)
    return np.sqrt((change**2 * other).sum(axis=0))


def rms_errors(run: Run) -> np.ndarray:
    """RMS velocity errors (6,) of a run, m/s and rad/s."""
    return np.sqrt(np.mean((run.nu_d - run.nu) ** 2, axis=0))


def response(
    scenario: Scenario, controller: str, found: Sensitivity, hold: Hold = 'continuous'
) -> ErrorSensitivity | None:
    """What a controller's RMS errors depend on; None where its loops do not all run.

    The set-points are sums of sinusoids; `found` is its sensitivity to the gains.
    """
    if found.refusal:
        return None
    try:
        runs = [
            simulate(changed_scenario(scenario, values), controller, hold)
            for values in setpoint_changes(scenario)
        ]
    except DivergedError:
        return None
    errors = np.stack([rms_errors(run) for run in runs])
    return ErrorSensitivity(found.six(ERROR), followed(errors, moved_setpoints(scenario)))
