"""Closed loops of a scenario with many gains, and many scenarios with the same gains: measures."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from auv_analysis.runs.run import Hold
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import run_batch
from auv_analysis.simulation.rollouts import batch_of
from auv_analysis.simulation.variants import packed_variants
from auv_analysis.tuning.measures import Measures, measures_of
from auv_analysis.tuning.record import Cost


def measured(
    scenario: Scenario, controller: str, gains: Mapping[str, np.ndarray], hold: Hold, threads: int
) -> Measures:
    """Measures (B,) of a scenario's closed loop with gains (B, ...)."""
    count = len(next(iter(gains.values()))) if gains else 1
    columns = {f"controllers.'{controller}'.{gain}": v for gain, v in gains.items()}
    rows, seeds = np.arange(count), np.full(count, scenario.data['seed'])
    variants, good = packed_variants(scenario, controller, columns, rows, seeds)
    batch = replace(batch_of(variants, hold), record=Cost)
    found = measures_of(run_batch(batch, threads), batch.steps + 1, batch.step)
    return Measures(*(np.where(good, values, np.nan) for values in found))
