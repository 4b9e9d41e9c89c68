"""Closed loops that are measured: Case 1 of any length, and batches in which no two are alike."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from c_reference import Loops, loops, plants

from auv_analysis import load_scenario
from auv_analysis.metrics.settling import band_of
from auv_analysis.scenario.changes import changed_scenario, split
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import Batch
from auv_analysis.simulation.closed_loop import run_continuous
from auv_analysis.simulation.reduction import Figures
from auv_analysis.simulation.rollouts import batch_of
from auv_analysis.simulation.simulate import (
    at_start,
    blocks,
    loop_of,
    tables,
)
from auv_analysis.simulation.variants import packed_variants
from auv_dynamics import load_vehicle
from auv_dynamics.kernel.integrator import TABLEAUS
from auv_dynamics.kernel.lanes import with_batch_axis
from auv_dynamics.plant.plant import initial_state
from auv_dynamics.vehicle.vehicle import make_model

CONTROLLER = 'gvc'
VARIED = (
    'controllers.gvc.k_D', 'controllers.gvc.k_I', 'controllers.gvc.Lambda', 'controllers.gvc.Gamma',
    'vehicle.inertia_matrix[0][0]', 'vehicle.inertia_matrix[5][5]',
    'vehicle.damping.linear[0]', 'vehicle.damping.quadratic[2]', 'vehicle.hydrostatics.volume',
)  # fmt: skip
SPREAD = 0.05  # relative, to either side
SEED = 0
SEGMENTS = 2  # of a recording, 10 s each


def case1(duration: float) -> Scenario:
    """Case 1 of another duration, s."""
    scenario = load_scenario('case1')
    return replace(scenario, data={**scenario.data, 'duration': duration})


def varied(count: int) -> dict[str, np.ndarray]:
    """Gains and coefficients of so many vehicles around those of Case 1: path -> (count,)."""
    scenario, generator = load_scenario('case1'), np.random.default_rng(SEED)
    factors = generator.uniform(1 - SPREAD, 1 + SPREAD, (len(VARIED), count))
    return {
        path: nominal(scenario, path) * factor for path, factor in zip(VARIED, factors, strict=True)
    }


def nominal(scenario: Scenario, path: str) -> Any:
    """What stands at a path of a scenario or its vehicle."""
    first, *rest = split(path)
    value = scenario.vehicle_data if first == 'vehicle' else scenario.data[str(first)]
    for part in rest:
        value = value[part]  # type: ignore[index]  # keys of mappings, indices of lists
    return value


def prepared(scenario: Scenario, changes: dict[str, np.ndarray]) -> Batch:
    """The same closed loops with everything done that comes before the first step."""
    count = len(next(iter(changes.values())))
    seeds = np.zeros(count, int)
    variants, good = packed_variants(scenario, CONTROLLER, changes, np.arange(count), seeds)
    assert good.all(), 'values that no scenario may have'
    known: dict[float, Any] = {}

    def tabulated(t: np.ndarray) -> Any:
        first = float(t[0, 0])
        if first not in known:
            known[first] = tables(scenario, t, None)
        return known[first]

    return replace(batch_of(variants, 'continuous'), shared=tabulated)


def single(scenario: Scenario) -> Callable[[], Figures]:
    """One closed loop, prepared in the same way: a function that runs it and gives its figures."""
    loop = loop_of(scenario, CONTROLLER)
    vehicle, known = with_batch_axis(loop), list(blocks(scenario, 'continuous'))
    motion, work = (with_batch_axis(part) for part in at_start(scenario, loop))
    start, tableau = motion.x.copy(), TABLEAUS[scenario.data['integrator']]
    t = np.arange(scenario.steps + 1) * scenario.step
    band = band_of(np.abs(scenario.setpoint.value(t)).max(axis=0))

    def run() -> Figures:
        motion.x[:] = start
        figures = Figures.start(loop.model, band, scenario.step, np.full)
        kept = with_batch_axis(figures)
        for grid, table in known:
            tables_of = with_batch_axis(table)
            run_continuous(vehicle, tables_of, grid, tableau, motion, work, kept, 0, 1, None)
        return figures

    return run


def open_plants(count: int) -> tuple[dict[str, Any], np.ndarray]:
    """Plants like RexROV under recorded commands: arguments of `open_loop`, the same in C."""
    vehicle, draw = load_vehicle('rexrov'), np.random.default_rng(SEED)
    M, D_linear, D_quadratic = (
        A * draw.uniform(1 - SPREAD, 1 + SPREAD, (count, 1, 1))
        for A in (vehicle.M, vehicle.D_linear, vehicle.D_quadratic)
    )
    hydrostatics = np.tile(vehicle.model.hydrostatics, (count, 1))
    model = make_model(M, D_linear, D_quadratic, hydrostatics)
    follow, bias = draw.uniform(0.1, 0.2, (count, 6)), draw.normal(size=(count, 6))
    commands = draw.normal(scale=5.0, size=(SEGMENTS, 1000, 6)).cumsum(axis=1)
    start = initial_state(np.zeros(6), np.zeros(6))
    given = {
        'model': model, 'commands': commands, 'start': np.tile(start, (1, SEGMENTS, 1)),
        'step': 0.01, 'follow': follow, 'bias': bias,
    }  # fmt: skip
    return given, plants(model, follow, bias)


def in_c(scenario: Scenario, changes: dict[str, np.ndarray]) -> Loops:
    """The same closed loops for the C reference."""
    rows = zip(*changes.values(), strict=True)
    return loops(
        [changed_scenario(scenario, dict(zip(changes, row, strict=True))) for row in rows],
        CONTROLLER,
    )
