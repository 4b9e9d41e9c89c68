"""Fixed-step Runge-Kutta integration: a tableau plus one step function."""

from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import helper, specialised


class Tableau(NamedTuple):
    """Butcher tableau of an explicit method: A (s, s), b (s,), c (s,)."""

    A: np.ndarray
    b: np.ndarray
    c: np.ndarray


def _tableau(rows: list[list[float]], b: list[float]) -> Tableau:
    A = np.zeros((len(b), len(b)))
    for i, row in enumerate(rows, start=1):
        A[i, : len(row)] = row
    return Tableau(A, np.array(b), A.sum(axis=1))


TABLEAUS = {
    # Dormand & Prince 1980, RK5(4)7M, the fifth-order formula: Simulink's ode5
    'ode5': _tableau(
        [
            [1 / 5],
            [3 / 40, 9 / 40],
            [44 / 45, -56 / 15, 32 / 9],
            [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
            [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        ],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ),
    'rk4': _tableau([[1 / 2], [0, 1 / 2], [0, 0, 1]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]),
    'euler': _tableau([], [1.0]),
}


@specialised('system')
def fill_rate(system: Any, stage: int, x: np.ndarray, rate: np.ndarray) -> None:
    """Write x_dot of `system` at `x` and at stage `stage` of the step into `rate`."""
    type(system).fill_rate(system, stage, x, rate)


@helper
def fill_step(
    system: Any,
    x: np.ndarray,
    step: float,
    tableau: Tableau,
    stages: np.ndarray,
    trial: np.ndarray,
) -> None:
    """Advance x (n,) in place by one step of `step` s; `stages` (s, n), `trial` (n,): workspace."""
    count = tableau.b.shape[0]
    fill_stages(system, x, step, tableau, stages, trial, count)
    fill_sum(x, x, step, tableau.b, stages, count)


@helper
def fill_stages(
    system: Any,
    x: np.ndarray,
    step: float,
    tableau: Tableau,
    stages: np.ndarray,
    trial: np.ndarray,
    count: int,
) -> None:
    """Write x_dot at the first `count` stages of a step from x into `stages`.

    The time of a stage is the system's business, which knows its inputs on the grid
    (k + c) * step, so that no time is ever accumulated.
    """
    for s in range(count):
        fill_sum(trial, x, step, tableau.A[s], stages, s)
        fill_rate(system, s, trial, stages[s])


@helper
def fill_sum(
    total: np.ndarray,
    x: np.ndarray,
    step: float,
    weights: np.ndarray,
    stages: np.ndarray,
    count: int,
) -> None:
    """Write x + step * sum of weights[j] stages[j], j below `count`, into `total`."""
    size, odd = x.shape[0], count % 2
    if odd:
        share, rate = step * weights[0], stages[0]
        for i in range(size):
            total[i] = x[i] + share * rate[i]
    else:
        for i in range(size):
            total[i] = x[i]
    for j in range(odd, count, 2):  # two at a time: half as often through memory
        share, rate = step * weights[j], stages[j]
        other_share, other_rate = step * weights[j + 1], stages[j + 1]
        for i in range(size):
            total[i] = total[i] + share * rate[i] + other_share * other_rate[i]


def stage_times(tableau: Tableau, step: float, first: int, count: int) -> np.ndarray:
    """Times of all stages of `count` steps from step `first`: (count, s), s."""
    k = np.arange(first, first + count, dtype=float)
    return (k * step)[:, None] + (tableau.c * step)[None, :]
