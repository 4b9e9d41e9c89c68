"""The sums and largest magnitudes of `moments`, compiled: samples in lanes."""

import numpy as np

from auv_analysis.metrics.signals import (
    DELTA_PI,
    DELTA_XI,
    ENERGY,
    ERROR,
    LUMPED,
    SETPOINT,
    TAU,
    Maps,
    signals,
)  # fmt: skip
from auv_dynamics.kernel import LANES
from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.lanes import of_block
from auv_dynamics.kernel.six import Vector, add, add_products, fill_vector, keep_largest, vector

WIDTH = LANES or 1  # samples that are added side by side


@helper
def add_sample(
    nu: Vector, nu_d: Vector, tau: Vector, f: Vector, F: Vector, maps: Maps, sums: np.ndarray,
    squares: np.ndarray, peaks: np.ndarray,
) -> None:  # fmt: skip
    """Add one sample, or lanes of them, to what (7, 6) is known of those before it.

    Only the sum of the energy, the squares of errors and input, and no peak of the energy are
    ever asked for.
    """
    error, lumped, command, xi, pi, energy, setpoint = signals(nu, nu_d, tau, f, F, maps)
    fill_vector(sums[ENERGY], 0, add(vector(sums[ENERGY], 0), energy))
    add_products(squares[ERROR], error, error)
    add_products(squares[LUMPED], lumped, lumped)
    add_products(squares[TAU], command, command)
    keep_largest(peaks[ERROR], error)
    keep_largest(peaks[LUMPED], lumped)
    keep_largest(peaks[TAU], command)
    keep_largest(peaks[DELTA_XI], xi)
    keep_largest(peaks[DELTA_PI], pi)
    keep_largest(peaks[SETPOINT], setpoint)


@helper
def fill_beside(beside: np.ndarray, first: int, flat: np.ndarray, k: int, lanes: int) -> None:
    """Put six numbers each of the samples from index `k` side by side, from row `first`."""
    for i in range(6):
        for w in range(lanes):
            beside[0, first + i, w] = flat[k + 6 * w + i]


@helper
def fill_signals(
    beside: np.ndarray, nu: np.ndarray, nu_d: np.ndarray, tau: np.ndarray, f: np.ndarray,
    F: np.ndarray, k: int, lanes: int,
) -> None:  # fmt: skip
    """Put the numbers of `lanes` samples from index `k` side by side: (1, 30, WIDTH)."""
    fill_beside(beside, 0, nu, k, lanes)
    fill_beside(beside, 6, nu_d, k, lanes)
    fill_beside(beside, 12, tau, k, lanes)
    fill_beside(beside, 18, f, k, lanes)
    fill_beside(beside, 24, F, k, lanes)


@compiled
def add_samples(
    nu: np.ndarray, nu_d: np.ndarray, tau: np.ndarray, f: np.ndarray, F: np.ndarray, maps: Maps,
    beside: np.ndarray, sums: np.ndarray, squares: np.ndarray, peaks: np.ndarray,
) -> None:  # fmt: skip
    """Add samples, flat arrays (6 n,), to lanes (1, 7, 6, WIDTH): as many at a time as fit.

    `beside` (1, 30, WIDTH) is workspace. Zeros, which fill up the last register, add nothing.
    """
    block, s = of_block(beside, 0, WIDTH), of_block(sums, 0, WIDTH)
    q, p = of_block(squares, 0, WIDTH), of_block(peaks, 0, WIDTH)
    for k in range(0, nu.shape[0], 6 * WIDTH):
        if k + 6 * WIDTH <= nu.shape[0]:
            fill_signals(beside, nu, nu_d, tau, f, F, k, WIDTH)
        else:
            beside[:] = 0.0
            fill_signals(beside, nu, nu_d, tau, f, F, k, (nu.shape[0] - k) // 6)
        add_sample(
            vector(block, 0), vector(block, 6), vector(block, 12), vector(block, 18),
            vector(block, 24), maps, s, q, p,
        )  # fmt: skip


def add_compiled(
    nu: np.ndarray, nu_d: np.ndarray, tau: np.ndarray, f: np.ndarray, F: np.ndarray, maps: Maps,
    sums: np.ndarray, squares: np.ndarray, peaks: np.ndarray,
) -> None:  # fmt: skip
    """Add samples, flat arrays (6 n,), to what (7, 6) is known of those before them."""
    lanes = np.zeros((3, 1, *sums.shape, WIDTH))
    add_samples(nu, nu_d, tau, f, F, maps, np.empty((1, 30, WIDTH)), *lanes)
    sums += lanes[0, 0].sum(axis=-1)
    squares += lanes[1, 0].sum(axis=-1)
    np.maximum(peaks, lanes[2, 0].max(axis=-1), out=peaks)
