"""The same random changes for every controller, one closed loop each."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from auv_analysis.runs.run import Hold
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import Batch, run_batch
from auv_analysis.simulation.closed_loop import Tables
from auv_analysis.simulation.rollouts import batch_of
from auv_analysis.simulation.variants import Variants, merged, packed_variants
from auv_analysis.tuning.draws import Spread, drawn
from auv_analysis.tuning.measures import Measures, measures_of
from auv_analysis.tuning.record import Cost


def monte_carlo(
    scenario: Scenario, spread: Spread, samples: int, seed: int, hold: Hold, threads: int,
    progress: Callable[[], None] = lambda: None,
) -> dict[str, Measures]:  # fmt: skip
    """Measures of every controller of a scenario over the same draws.

    Parameters
    ----------
    scenario : with the controllers to compare
    spread : how far the draws go
    samples : number of draws, one at least
    seed : of the draws
    hold : 'continuous' or 'zoh'
    threads : how many draws run at a time
    progress : called after each draw

    Returns
    -------
    measures : controller -> Measures of (samples,); row i is draw i for every controller

    """

    def one(index: int) -> dict[str, Measures]:
        found = of_each(drawn(scenario, spread, seed, index), hold)
        progress()
        return found

    rows = [one(0)]  # alone: it may compile
    with ThreadPoolExecutor(threads) as pool:
        try:
            rows += pool.map(one, range(1, samples))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return {
        name: Measures(*map(np.concatenate, zip(*(row[name] for row in rows), strict=True)))
        for name in scenario.controllers
    }


def of_each(scenario: Scenario, hold: Hold) -> dict[str, Measures]:
    """Measures (1,) of each controller of a scenario; those of one law run in one batch."""
    groups: dict[Any, list[tuple[str, Variants]]] = {}
    row, seeds = np.zeros(1, int), np.array([scenario.data['seed']])
    for name in scenario.controllers:
        variants, _ = packed_variants(scenario, name, {}, row, seeds)
        groups.setdefault(variants.structure, []).append((name, variants))
    known: dict[float, Tables] = {}
    found: dict[str, Measures] = {}
    for members in groups.values():
        batch = replace(batch_of(merged([v for _, v in members]), hold), record=Cost)
        batch = _sharing(batch, known)
        measures = measures_of(run_batch(batch), batch.steps + 1, batch.step)
        for i, (name, _) in enumerate(members):
            found[name] = measures.part(slice(i, i + 1))
    return found


def _sharing(batch: Batch, known: dict[float, Tables]) -> Batch:
    """The batch with tables that are made once for all batches of a scenario."""
    make = batch.shared
    if make is None:
        return batch

    def tables(t: np.ndarray) -> Tables:
        if (at := float(t[0, 0])) not in known:
            known[at] = make(t)
        return known[at]

    return replace(batch, shared=tables)
