"""What the velocity errors follow, gains and set-points, for many vehicles at once by rollouts."""

from collections.abc import Sequence

import numpy as np

from auv_analysis.report.claim import BOTH
from auv_analysis.report.evidence import Response
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.rollouts import rollouts
from auv_analysis.studies.study.responses import (
    error_columns,
    followed,
    moved_setpoints,
    setpoint_changes,
)
from auv_analysis.studies.study.sensitivity import gain_factors
from auv_analysis.study.unknowns import Variant, changes_of

COUNT = 32  # points of a Sobol' sequence in the gains: enough to order six spreads
SPAN = 2.0
Columns = dict[str, np.ndarray]


def responses_of(
    scenario: Scenario, tried: Sequence[Variant], window: float, threads: int
) -> dict[str, list[Response | None]]:
    """Responses of the two laws for every variant; None where a loop diverges.

    Parameters
    ----------
    scenario : case1 with the shipped vehicle
    tried : variants
    window : length of the runs, s
    threads : as of `rollouts`

    """
    found: dict[str, list[Response | None]] = {law: [None] * len(tried) for law in BOTH}
    for sign in dict.fromkeys(variant.exponent_sign for variant in tried):
        values = {'duration': window, 'disturbance[0].exponent_sign': sign}
        base = changed_scenario(scenario, values)
        places = [i for i, variant in enumerate(tried) if variant.exponent_sign == sign]
        columns = _vehicles([tried[i] for i in places], scenario)
        for law in BOTH:
            answers = _of_law(base, law, columns, len(places), threads)
            for i, answer in zip(places, answers, strict=True):
                found[law][i] = answer
    return found


def _vehicles(tried: Sequence[Variant], scenario: Scenario) -> Columns:
    """Path of the vehicle -> a value for each variant."""
    data = scenario.vehicle_data
    shipped = {
        'vehicle.rigid_body.mass': data['rigid_body']['mass'],
        'vehicle.inertia_matrix': data['inertia_matrix'],
        'vehicle.damping.linear': data['damping']['linear'],
        'vehicle.damping.quadratic': data['damping']['quadratic'],
    }
    each = [{**shipped, **changes_of(variant, scenario)} for variant in tried]
    return {path: np.array([values[path] for values in each], float) for path in shipped}


def _of_law(
    base: Scenario, law: str, vehicles: Columns, count: int, threads: int
) -> list[Response | None]:
    gains, good = _gain_spreads(base, law, vehicles, count, threads)
    errors = []
    for values in setpoint_changes(base):  # one call each: all loops of it share their tables
        changed = changed_scenario(base, values)
        found = rollouts(changed, law, vehicles, threads=threads)
        good &= found['status'] == 'ok'
        errors.append(error_columns(found))
    others = [followed(np.array(errors)[:, i], moved_setpoints(base)) for i in range(count)]
    return [Response(gains[i], others[i]) if good[i] else None for i in range(count)]


def _gain_spreads(
    base: Scenario, law: str, vehicles: Columns, count: int, threads: int
) -> tuple[np.ndarray, np.ndarray]:
    """Spreads (count, 6) of ln(RMS error) over the gains, and (count,) whether all loops ran."""
    from scipy.stats import qmc

    factors = gain_factors(base, law)
    sequence = qmc.Sobol(len(factors.names), rng=np.random.default_rng(0))
    points = SPAN ** (2.0 * sequence.random(COUNT) - 1.0)
    gains = factors.changes(np.tile(points, (count, 1)))
    repeated = {path: np.repeat(value, len(points), axis=0) for path, value in vehicles.items()}
    found = rollouts(factors.scenario, law, {**gains, **repeated}, threads=threads)
    errors = error_columns(found).reshape(count, len(points), 6)
    good = (found['status'] == 'ok').reshape(count, -1).all(axis=1)
    positive = np.all(errors > 0, axis=1)
    spread = np.log(np.where(errors > 0, errors, 1.0)).std(axis=1)
    return np.where(positive, spread, 0.0), good
