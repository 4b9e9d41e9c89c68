"""Sums and largest magnitudes of a run's signals, in one go over its samples.

A signal is formed from the sample at hand and only its sums are kept. What a signal is stands once,
in `signals`: it takes the numbers of one sample where it is compiled, and whole columns of a block
where it is not.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.metrics.energy import component
from auv_analysis.runs.run import Run, Windows
from auv_dynamics.kernel import LANES
from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.lanes import of_block
from auv_dynamics.kernel.six import (
    Vector,
    add,
    add_products,
    fill_vector,
    keep_largest,
    sub,
    upper,
    upper_T,
    vector,
)  # fmt: skip
from auv_gvc_controller.laws.model import ControlModel

NAMES = ('error', 'lumped_error', 'tau', 'delta_xi', 'delta_pi', 'energy', 'nu_d')
ERROR, LUMPED, TAU, DELTA_XI, DELTA_PI, ENERGY, SETPOINT = range(len(NAMES))
WIDTH = LANES or 1  # samples that are added side by side


class Maps(NamedTuple):
    """What leads from nu and tau to the signals: flat, row-major."""

    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray


def maps_of(model: ControlModel) -> Maps:
    """Maps of a vehicle."""
    return Maps(model.Upsilon, model.Upsilon_inv, model.N)


@helper
def signals(
    nu: Vector, nu_d: Vector, tau: Vector, f: Vector, F: Vector, maps: Any
) -> tuple[Vector, ...]:
    """The signals of `NAMES`, six numbers each: m/s, rad/s; N, N m; J.

    `maps` has the fields of `Maps`. Equations (30) for the energy, (33) and (34).
    """
    xi, N = upper(maps.Upsilon_inv, nu), maps.N
    energy = (
        component(N[0], xi[0]), component(N[1], xi[1]), component(N[2], xi[2]),
        component(N[3], xi[3]), component(N[4], xi[4]), component(N[5], xi[5]),
    )  # fmt: skip
    return (
        sub(nu_d, nu),
        sub(f, F),
        tau,
        sub(xi, nu),
        sub(upper_T(maps.Upsilon, tau), tau),
        energy,
        nu_d,
    )


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


def add_columns(
    nu: np.ndarray, nu_d: np.ndarray, tau: np.ndarray, f: np.ndarray, F: np.ndarray, maps: Maps,
    sums: np.ndarray, squares: np.ndarray, peaks: np.ndarray,
) -> None:  # fmt: skip
    """The same without a compiler: the samples as columns."""
    nu, nu_d, tau, f, F = (np.ascontiguousarray(a.reshape(-1, 6).T) for a in (nu, nu_d, tau, f, F))
    for s, signal in enumerate(signals(nu, nu_d, tau, f, F, maps)):
        for i, values in enumerate(signal):
            sums[s, i] += values.sum()
            squares[s, i] += values @ values
            peaks[s, i] = max(peaks[s, i], np.abs(values).max(initial=0.0))


def known_or_zero(values: np.ndarray) -> np.ndarray:
    """The same (n, 6) with zeros for what was not recorded, so that it spoils nothing else."""
    unknown = np.isnan(values[:1]).any(axis=0)
    return np.where(unknown, 0.0, values) if unknown.any() else values


def _zeros() -> np.ndarray:
    return np.zeros((len(NAMES), 6))


@dataclass
class Moments:
    """What is kept of some samples; the rows are those of `NAMES`.

    Attributes
    ----------
    count : number of samples
    first, last : their times, s
    sums, squares, peaks : (7, 6) sums, sums of squares and largest magnitudes

    """

    count: int = 0
    first: float = np.inf
    last: float = -np.inf
    sums: np.ndarray = field(default_factory=_zeros)
    squares: np.ndarray = field(default_factory=_zeros)
    peaks: np.ndarray = field(default_factory=_zeros)

    def add(self, run: Run, maps: Maps) -> None:
        """Add the samples of a block, (n, 6) each."""
        known = run.disturbance_estimate if run.disturbance is None else run.disturbance
        values = run.nu, run.nu_d, run.tau, run.disturbance_estimate, known
        nu, nu_d, tau, f, F = (
            np.ascontiguousarray(known_or_zero(v), float).ravel() for v in values
        )
        self.count += len(run.t)
        self.first, self.last = min(self.first, run.t[0]), max(self.last, run.t[-1])
        add = add_compiled if LANES else add_columns
        add(nu, nu_d, tau, f, F, maps, self.sums, self.squares, self.peaks)

    def joined(self, other: 'Moments') -> 'Moments':
        """What is known of these samples and those of the other."""
        return Moments(
            self.count + other.count,
            min(self.first, other.first),
            max(self.last, other.last),
            self.sums + other.sums,
            self.squares + other.squares,
            np.maximum(self.peaks, other.peaks),
        )

    def mean(self, signal: int) -> np.ndarray:
        """Mean (6,) of a signal."""
        return self.sums[signal] / self.count

    def rms(self, signal: int) -> list[float]:
        """Root mean squares of a signal."""
        return np.sqrt(self.squares[signal] / self.count).tolist()

    def peak(self, signal: int) -> list[float]:
        """Largest magnitudes of a signal."""
        return self.peaks[signal].tolist()


class Tally:
    """Moments of the parts of a run between some times.

    Parameters
    ----------
    maps : of its vehicle
    times : s; a sample at one of them belongs to the part behind it

    """

    def __init__(self, maps: Maps, times: Iterable[float]):
        self._maps, self._windows = maps, Windows(times)
        self._parts = [Moments() for _ in range(self._windows.parts)]

    def add(self, block: Run) -> None:
        """Add the next samples."""
        for i, inside in self._windows.split(block.t):
            self._parts[i].add(block.part(inside), self._maps)

    def between(self, first: float | None = None, last: float | None = None) -> Moments:
        """Moments of the samples from one of the times up to another; None: of the run's end."""
        parts = (self._parts[i] for i in self._windows.between(first, last))
        return reduce(Moments.joined, parts, Moments())
