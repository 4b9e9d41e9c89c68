"""Case 1 and the plant alone against scalar C; rollouts on threads, growing, against peers."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import c_reference
import numpy as np
import peers
from loops import CONTROLLER, case1, in_c, open_plants, prepared, varied
from measure import Measured, cost, interleaved, speed

from auv_analysis import open_loop, simulate
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.simulation.batch import run_batch
from auv_analysis.simulation.rollouts import rollouts
from auv_dynamics.vehicle import DOFS

DURATION = 10.0  # s
BATCH = 96
ALONE = Path(__file__).with_name('alone.py')
THREADS_BATCH = 2048
MANY, FEW = 10_000, 100
SAME = 1e-9  # relative, of figures computed by different programs
AGREE = 1e-6  # m/s, rad/s: of a peer's final velocity


def against_c() -> dict[str, Measured]:
    """A batch, and one rollout after the other, per rollout: prepared inputs to figures."""
    scenario, changes = case1(DURATION), varied(BATCH)
    batch, loops = prepared(scenario, changes), in_c(scenario, changes)
    library, native = c_reference.library(), c_reference.library(c_reference.NATIVE)
    check_figures(rollouts(scenario, CONTROLLER, changes), c_reference.rollouts(library, loops)[0])

    subjects = {
        'rollout_vs_c': cost(lambda: run_batch(batch), BATCH),
        'single_vs_c': _alone,
        'native_c_vs_c': _c(native, loops),
    }
    return interleaved(subjects, _c(library, loops), 's')


def _alone() -> float:
    command = [sys.executable, str(ALONE)]
    return float(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)


def _c(library: Any, loops: c_reference.Loops) -> Callable[[], float]:
    return cost(lambda: c_reference.rollouts(library, loops), len(loops.parameters))


def check_figures(ours: dict[str, np.ndarray], theirs: np.ndarray) -> None:
    """Raise ArithmeticError where a figure differs from C's (B, 10, 6)."""
    for i, name in enumerate(c_reference.FIGURES):
        for j, dof in enumerate(DOFS):
            if not np.allclose(
                ours[f'{name}.{dof}'], theirs[:, i, j], rtol=SAME, atol=0, equal_nan=True
            ):
                raise ArithmeticError(f'{name}.{dof}: expected the same as in C, found another')


def open_loop_against_c() -> dict[str, Measured]:
    """Plants that differ, under the same recorded commands: all states of each."""
    library, (given, in_c_form) = c_reference.library(), open_plants(BATCH)
    start, commands, step = given['start'][0, 0], given['commands'], given['step']

    def ours() -> np.ndarray:
        return open_loop(**given, threads=1)

    def theirs() -> np.ndarray:
        return c_reference.open_loop(library, in_c_form, start, commands, step)

    if not np.allclose(ours(), theirs(), rtol=SAME, atol=SAME):
        raise ArithmeticError('openloop_vs_c: expected the same states as in C, found others')
    count = BATCH * len(commands)
    return interleaved({'openloop_vs_c': cost(ours, count)}, cost(theirs, count), 's')


def threads() -> dict[str, Measured]:
    """Two threads against one: rollouts per second of a large batch."""
    batch = prepared(case1(DURATION), varied(THREADS_BATCH))
    return interleaved(
        {'threads_2_vs_1': speed(lambda: run_batch(batch, threads=2), THREADS_BATCH)},
        speed(lambda: run_batch(batch), THREADS_BATCH),
        'rollouts/s',
    )


def growth() -> dict[str, Measured]:
    """Cost of a rollout in a large batch, and of a long horizon; parameters are made as well."""
    many, few, short, long = varied(MANY), varied(FEW), case1(DURATION), case1(10 * DURATION)
    again = MANY // FEW // 10  # so that both last long enough to be timed

    def little() -> None:
        for _ in range(again):
            rollouts(short, CONTROLLER, few)

    def over(scenario: Scenario) -> Callable[[], float]:
        return cost(lambda: rollouts(scenario, CONTROLLER, few))

    large = cost(lambda: rollouts(short, CONTROLLER, many), MANY)
    return {
        **interleaved({'growth_batch': large}, cost(little, FEW * again), 's'),
        **interleaved({'growth_horizon': over(long)}, over(short), 's'),
    }


def against_scipy() -> dict[str, Measured]:
    """Rollouts per second of a batch against those of `solve_ivp`."""
    return _against('rollout_vs_solve_ivp', peers.solve_ivp)


def against_python_control() -> dict[str, Measured]:
    """Rollouts per second of a batch against those of `input_output_response`."""
    return _against('rollout_vs_python_control', peers.python_control)


def _against(key: str, peer: Callable[..., np.ndarray]) -> dict[str, Measured]:
    scenario = case1(DURATION)
    rate, x = peers.closed_loop(scenario, CONTROLLER)
    difference = np.abs(peer(rate, x, DURATION)[7:13] - simulate(scenario, CONTROLLER).nu[-1]).max()
    if not difference < AGREE:
        raise ArithmeticError(f'{key}: expected the same velocity at the end, found {difference:g}')
    batch = prepared(scenario, varied(BATCH))
    ours = speed(lambda: run_batch(batch), BATCH)
    return interleaved({key: ours}, speed(lambda: peer(rate, x, DURATION)), 'rollouts/s')
