"""The plant alone under recorded commands: many variants of a vehicle over many segments."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.kernel import LANES
from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.integrator import TABLEAUS, Tableau
from auv_dynamics.kernel.lanes import (
    align_stack,
    joined,
    mapped,
    of_block,
    packed,
    select,
    with_batch_axis,
)
from auv_dynamics.kernel.six import fill_vector, vector
from auv_dynamics.plant.actuators import fill_slowed
from auv_dynamics.plant.plant import SIZE, fill_plant_step, fill_unit_attitude
from auv_dynamics.plant.uncertainty import PlantModel
from auv_dynamics.vehicle.model import Model
from auv_dynamics.vehicle.vehicle import Vehicle

PARTS = 4  # per thread, so that a slow one is made up for
MEASURED = 10  # quaternion and nu, the columns of a state behind the position


class Variant(NamedTuple):
    """One plant.

    Attributes
    ----------
    truth : coefficients
    allocation : (6, m) wrench of a command; (6, 0): the command is the wrench
    follow : (6,) share of the remaining way that the first-order lag covers in a step
    F : (s, 6) external disturbance at the stages of every step
    current : (s, 6) at the stages of every step; (0, 6) in still water

    """

    truth: PlantModel
    allocation: np.ndarray
    follow: np.ndarray
    F: np.ndarray
    current: np.ndarray


class Segment(NamedTuple):
    """Part of a recording: commands (n, m), measured (n, 10) or, without an observer, (0, 10)."""

    commands: np.ndarray
    measured: np.ndarray


class OpenState(NamedTuple):
    """State carried from step to step: x (13,), applied wrench (6,)."""

    x: np.ndarray
    applied: np.ndarray


class Work(NamedTuple):
    """Workspace: stages (s, 13) and trial (13,) of the integrator, wrench of a command (13,)."""

    stages: np.ndarray
    trial: np.ndarray
    command: np.ndarray


class Settings(NamedTuple):
    """Inputs shared by all variants and segments.

    Attributes
    ----------
    step : s
    every : steps from one row of the result to the next
    settled : the applied wrench begins at that of the first command
    slew : (6,) largest change of the wrench per step: none, in memory lest the compiler, which
        would know it, fused the lag's product with its sum where the plant's step does not
    observer : (10,) gains

    """

    step: float
    every: int
    settled: bool
    slew: np.ndarray
    observer: np.ndarray


@helper
def fill_command(allocation: np.ndarray, command: np.ndarray, wrench: np.ndarray) -> None:
    """Write the wrench (6,) that a command (m,) asks for."""
    count = allocation.shape[1]
    if count == 0:
        fill_vector(wrench, 0, vector(command, 0))
    for i in range(6 if count > 0 else 0):
        wrench[i] = allocation[i, 0] * command[0]
        for j in range(1, count):
            wrench[i] = wrench[i] + allocation[i, j] * command[j]


@helper
def fill_corrected(x: np.ndarray, measured: np.ndarray, observer: np.ndarray) -> None:
    """Move the state x (13,) by observer (measured - x) where there is a measurement.

    The attitude is corrected where all of its quaternion is there, along the shorter way.
    """
    q0, q1, q2, q3 = measured[0], measured[1], measured[2], measured[3]
    if not np.isnan(q0 + q1 + q2 + q3):
        along = q0 * x[3] + q1 * x[4] + q2 * x[5] + q3 * x[6]
        sign = select(along < 0.0, -1.0, 1.0)
        for i in range(4):
            x[3 + i] = x[3 + i] + observer[i] * (sign * measured[i] - x[3 + i])
        fill_unit_attitude(x)
    for i in range(4, MEASURED):
        if not np.isnan(measured[i]):
            x[3 + i] = x[3 + i] + observer[i] * (measured[i] - x[3 + i])


@compiled
def run_open(
    variants: Variant, segments: Segment, settings: Settings, tableau: Tableau, states: OpenState,
    work: Work, seen: np.ndarray, result: np.ndarray, first: int, last: int, lanes: int | None,
) -> None:  # fmt: skip
    """Take the steps of segments and write the states, for blocks `first` to before `last`.

    Segments have a leading axis of S and plain numbers, variants and states one of blocks, see
    `of_block`; `work` has one block, which all use. Block b is of segment b % S. `seen` (blocks,
    13, W) is the memory of the states as numbers, `result` (V, S, rows, 13).
    """
    align_stack(lanes)
    stages, trial, command = of_block(work, 0, lanes)
    for b in range(first, last):
        v, s = b // result.shape[1], b % result.shape[1]
        variant, segment = of_block(variants, v, lanes), of_block(segments, s, None)
        (x, applied), numbers = of_block(states, b, lanes), of_block(seen, b, None)
        at, row = v * numbers.shape[1], 0
        for k in range(segment.commands.shape[0]):
            fill_command(variant.allocation, segment.commands[k], command)
            if settings.settled and k == 0:
                fill_vector(applied, 0, vector(command, 0))
            tau = fill_slowed(variant.follow, settings.slew, vector(command, 0), applied)
            fill_plant_step(
                variant.truth, x, tau, variant.F, variant.current, settings.step, tableau, stages,
                trial,
            )  # fmt: skip
            if segment.measured.shape[0] > 0:
                fill_corrected(x, segment.measured[k], settings.observer)
            if (k + 1) % settings.every == 0:
                for lane in range(min(numbers.shape[1], result.shape[0] - at)):
                    for i in range(SIZE):
                        result[at + lane, s, row, i] = numbers[i, lane]
                row += 1


def open_loop(
    model: Model | Vehicle | Sequence[Vehicle],
    commands: np.ndarray,
    start: np.ndarray,
    step: float,
    *,
    allocation: np.ndarray | None = None,
    follow: np.ndarray | None = None,
    applied: np.ndarray | None = None,
    bias: np.ndarray | None = None,
    current: np.ndarray | None = None,
    observer: np.ndarray | None = None,
    measured: np.ndarray | None = None,
    integrator: str = 'rk4',
    every: int = 1,
    threads: int | None = None,
) -> np.ndarray:
    """States of V variants of a plant under the recorded commands of S segments.

    Over each step of a segment, with the command u_k (m,) of a variant's T (6, m) and follow a,

        tau_k = tau_{k-1} + a (T u_k - tau_{k-1}),  held over the step,
        M nu_dot + C(nu) nu + D(nu) nu + g(eta) = tau_k + bias,  (1) in the water's current,
        x := x + observer (measured_k - x),  where a measurement is there.

    It is the step of the plant node: without an observer the numbers are the same to the last
    bit. Those of a variant do not depend on the other variants, on the segments beside its own or
    on the threads; one that leaves the finite numbers has rows that are not finite, alone.

    Parameters
    ----------
    model : plants: a `Model` with arrays (V, ...) as of `make_model`, a vehicle or several
    commands : (S, n, m) finite, held over each step: N, N m for m = 6 without an allocation
    start : (V or 1, S, 13) position in m (NED), unit quaternion w x y z, nu in m/s and rad/s
    step : s
    allocation : (V or 1, 6, m) T, wrench per command; none: the command is the wrench
    follow : (V or 1, 6) share of the way to the commanded wrench that the applied one covers per
        step, 1 - exp(-step / lag) of a first-order lag; none: all of it
    applied : (V or 1, S, 6) applied wrench before the first step, N and N m; none: T u_0
    bias : (V or 1, 6) constant wrench in the body frame, N and N m
    current : (V or 1, 3) velocity of the water, NED, m/s
    observer : (10,) gains from 0 to 1 of quaternion and nu
    measured : (S, n, 10) quaternion and nu after each step, NaN where they are not known; the
        quaternion counts where all of it is
    integrator : 'rk4', 'ode5' or 'euler'
    every : steps from one row of the result to the next
    threads : how many to use; none: as many as there are cores

    Returns
    -------
    states : (V, S, n // every, 13) after steps every, 2 every, ...

    Raises
    ------
    ValueError : an array of another shape, commands that are not finite, no such integrator

    """
    if integrator not in TABLEAUS:
        raise ValueError(f'integrator: expected {", ".join(TABLEAUS)}, found {integrator!r}')
    if every < 1:
        raise ValueError(f'every: expected a whole number from 1, found {every!r}')
    if (observer is None) != (measured is None):
        raise ValueError('observer: expected together with measured, found one of them')
    plants, tableau = stacked(model), TABLEAUS[integrator]
    stages = len(tableau.b)
    u = _shaped('commands', commands, None, None, 6 if allocation is None else None)
    if not np.isfinite(u).all():
        raise ValueError('commands: expected finite numbers, found others')
    S, n, m = u.shape
    x = _shaped('start', start, None, S, SIZE)
    held = _shaped('applied', applied, None, S, 6, default=0.0)
    of_variants = {
        'allocation': _shaped('allocation', allocation, None, 6, 0 if allocation is None else m),
        'follow': _shaped('follow', follow, None, 6, default=1.0),
        'bias': _shaped('bias', bias, None, 6, default=0.0),
        'current': _shaped('current', current, None, 0 if current is None else 3),
    }
    V = _count({'model': plants.M, 'start': x, 'applied': held, **of_variants})
    rows = 0 if measured is None else n
    segments = Segment(u, _shaped('measured', measured, S, rows, MEASURED))
    gains = _shaped('observer', observer, MEASURED)
    settings = Settings(float(step), int(every), applied is None, np.full(6, np.inf), gains)
    variants = _packed_variants(plants, **of_variants, stages=stages)
    states = OpenState(_by_block(x, V), _by_block(held, V))
    result = np.empty((V, S, n // every, SIZE))

    def run(blocks: range) -> None:
        work = Work(*map(_packed, (np.zeros((1, stages, SIZE)), *np.zeros((2, 1, SIZE)))))
        with np.errstate(all='ignore'):
            run_open(
                variants, segments, settings, tableau, states, work, seen, result,
                blocks.start, blocks.stop, LANES,
            )  # fmt: skip

    seen = states.x.reshape(len(states.x), SIZE, LANES or 1)
    _spread(run, len(seen), threads or len(os.sched_getaffinity(0)))
    return result


def stacked(model: Model | Vehicle | Sequence[Vehicle]) -> Model:
    """Coefficients with a leading axis of one or several vehicles.

    Where some have lift, it is zero for the others, whose last bits may then be others.

    Raises
    ------
    ValueError : no vehicle

    """
    if isinstance(model, Vehicle):
        model = model.model
    if isinstance(model, Model):
        return with_batch_axis(model, 2)
    if not model:
        raise ValueError('model: expected a vehicle, found none')
    models = [with_batch_axis(vehicle.model, 2) for vehicle in model]
    if any(one.lift is not None for one in models):
        none = np.zeros((1, 36))
        models = [one if one.lift is not None else one._replace(lift=none) for one in models]
    return joined(models, [len(one.M) for one in models])


def _shaped(name: str, value: Any, *shape: int | None, default: float = 0.0) -> np.ndarray:
    """An argument as an array of this shape, an axis of None being as long as it is or, absent, 1.

    Without the argument the array is full of the default.
    """
    if value is None:
        return np.full([size if size is not None else 1 for size in shape], default)
    array = np.require(value, float, ('C', 'A', 'W'))  # another kind would be compiled for
    fits = [size in (None, found) for size, found in zip(shape, array.shape, strict=False)]
    if array.ndim != len(shape) or not all(fits):
        expected = ', '.join('any' if size is None else str(size) for size in shape)
        raise ValueError(f'{name}: expected an array of shape ({expected}), found {array.shape}')
    return array


def _count(given: dict[str, np.ndarray]) -> int:
    """Number of variants; each array has a row of each, or one for all."""
    count = max(map(len, given.values()))
    for name, array in given.items():
        if len(array) not in (1, count):
            raise ValueError(f'{name}: expected 1 or {count} variants, found {len(array)}')
    return count


def _packed(value: Any) -> Any:
    return mapped(lambda array: packed(array, LANES), value)


def _packed_variants(
    plants: Model, allocation: np.ndarray, follow: np.ndarray, bias: np.ndarray,
    current: np.ndarray, stages: int,
) -> Variant:  # fmt: skip
    """Blocks of variants, of which each argument has a row or one for all."""
    model = _packed(plants)
    truth = PlantModel(model, _packed(np.zeros((1, 36))), model, exact=False)
    F = np.repeat(0.0 - bias[:, None], stages, axis=1)  # which opposes tau
    flow = np.zeros((len(current), stages if current.shape[1] else 0, 6))
    flow[:, :, : current.shape[1]] = current[:, None]
    return Variant(truth, *map(_packed, (allocation, follow, F, flow)))


def _by_block(values: np.ndarray, count: int) -> np.ndarray:
    """Blocks, a variant's segments one after the other, of values (V or 1, S, k): (B S, k, W)."""
    blocks = packed(np.broadcast_to(values, (count, *values.shape[1:])), LANES)
    return blocks.reshape(-1, *blocks.shape[2:])


def _spread(run: Callable[[range], None], count: int, threads: int) -> None:
    """Run blocks 0 ... count in pieces that threads work on."""
    size = max(1, -(-count // (PARTS * threads)) if threads > 1 else count)
    parts = [range(first, min(first + size, count)) for first in range(0, count, size)]
    if len(parts) < 2:
        list(map(run, parts))
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(run, parts))
