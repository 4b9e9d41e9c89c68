"""From the commanded wrench to the one that is applied: delay, limits, rotors, slew rate, lag."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, clip, select
from auv_dynamics.kernel.six import (
    Numbers,
    Six,
    Vector,
    clipped,
    copied,
    fill_vector,
    vector,
)
from auv_dynamics.plant.rotors import KEYS, PER_ROW, Rotors, fill_delivered, make_rotors
from auv_dynamics.vehicle.thrusters import (
    SCALED,
    AttainableWrench,
    allocated,
    make_reach,
    six_numbers,
)
from auv_dynamics.vehicle.vehicle import Vehicle

MOST_STEPS = 1_000_000  # of a delay
WHOLE = 1e-6  # of a step: how far a delay may be from a whole number of steps


class Actuators(NamedTuple):
    """The chain from command to applied wrench, per step.

    Attributes
    ----------
    ideal : the command is applied as it is
    reach : attainable wrench set
    slew : (6,) largest change per step, N and N m
    follow : (6,) share of the remaining way that the first-order lag covers in a step
    delay : steps
    rotors : of the thrusters; None: these deliver each thrust at once

    """

    ideal: bool
    reach: AttainableWrench
    slew: np.ndarray
    follow: np.ndarray
    delay: int
    rotors: Rotors | None = None


def make_actuators(
    spec: Mapping[str, Any] | None, vehicle: Vehicle, step: float, file: object
) -> Actuators:
    """Actuators of a checked scenario.

    Parameters
    ----------
    spec : `limit` (N, N m), `rate` (N/s, N m/s), `lag`, `delay` (s), `thrusters`, `saturation` and
        what `make_rotors` takes; None: ideal
    vehicle : whose thrusters are used where `thrusters` is true
    step : control period, s
    file : named in errors

    Raises
    ------
    InputError : a delay that is no multiple of the step, thrusters of a vehicle without any, what
        is asked of thrusters that are not used

    """
    if spec is None:
        return IDEAL
    delay = steps_of(spec.get('delay', 0.0), step, file, 'actuators.delay')
    use_thrusters = bool(spec.get('thrusters', False))
    if use_thrusters and vehicle.thrusters is None:
        expected = f'a vehicle with thrusters, {vehicle.name} has none'
        raise InputError(file, 'actuators.thrusters', expected, 'true')
    for key in ('saturation', *KEYS):
        if not use_thrusters and spec.get(key) not in (None, False):
            raise InputError(file, f'actuators.{key}', 'thrusters: true beside it', None)
    thrusters = vehicle.thrusters if use_thrusters else None
    rotors = None if thrusters is None else make_rotors(spec, thrusters, vehicle.name, step, file)
    lag = float(spec.get('lag', 0.0))
    return Actuators(
        False,
        make_reach(spec.get('limit'), thrusters, spec.get('saturation', SCALED)),
        np.full(6, np.inf) if spec.get('rate') is None else six_numbers(spec['rate']) * step,
        np.full(6, 1.0 if lag == 0 else -np.expm1(-step / lag)),
        delay,
        rotors,
    )


def steps_of(delay: float, step: float, file: object, key: str, least: int = 0) -> int:
    """Number of steps of a delay in s; InputError: no multiple of the step, or too many of them."""
    steps = delay / step
    if abs(steps - round(steps)) > WHOLE or round(steps) < least:
        raise InputError(file, key, f'a multiple of step ({step:g} s)', f'{delay} s')
    if steps > MOST_STEPS:
        raise InputError(file, key, f'at most {MOST_STEPS} steps of {step:g} s', f'{delay} s')
    return round(steps)


IDEAL = Actuators(True, make_reach(None, None), np.full(6, np.inf), np.ones(6), 0)


def memory(actuators: Actuators, *, faults: bool = False) -> np.ndarray:
    """State (1 + delay, 6) at the start: the applied wrench, then the commands under way.

    With rotors that do not follow at once it has more rows: their speeds; with faults one more: the
    last command that arrived.
    """
    turning = actuators.rotors.turning if actuators.rotors else 0
    return np.zeros((1 + actuators.delay - (-turning // PER_ROW) + faults, 6))


@helper
def _servo(applied: Number, command: Number, follow: Number, slew: Number) -> Number:
    """First-order servo with a slew limit, Fossen 2021, section 9.5, over one step."""
    move = follow * (command - applied)
    near = select(follow == 1.0, command, applied + move)
    return select(abs(move) > slew, applied + clip(move, -slew, slew), near)


@helper
def waited(actuators: Actuators, k: int, tau: Numbers, state: np.ndarray) -> Numbers:
    """The command that the delay lets through at step k; `state` of `memory` in place."""
    if actuators.delay == 0:
        return tau
    slot = 1 + k % actuators.delay
    command = copied(vector(state[slot], 0))
    fill_vector(state[slot], 0, tau)
    return command


@helper
def fill_slowed(follow: Vector, slew: Vector, c: Vector, a: np.ndarray) -> Six:
    """The wrench c behind lag and slew limit; the applied wrench `a` (6,) in place."""
    applied = (
        _servo(a[0], c[0], follow[0], slew[0]),
        _servo(a[1], c[1], follow[1], slew[1]),
        _servo(a[2], c[2], follow[2], slew[2]),
        _servo(a[3], c[3], follow[3], slew[3]),
        _servo(a[4], c[4], follow[4], slew[4]),
        _servo(a[5], c[5], follow[5], slew[5]),
    )
    fill_vector(a, 0, applied)
    return applied


@helper
def fill_allocated(
    rotors: Rotors | None, actuators: Actuators, left: np.ndarray | None, k: int, tau: Numbers,
    state: np.ndarray,
) -> Numbers:  # fmt: skip
    """Wrench of the thrusters for the command tau; `rotors` are those of the actuators.

    `left` is what faults leave of each thrust, as of `delivered`. Without rotors the branch is none
    when compiled.
    """
    if rotors is None:
        return allocated(actuators.reach, tau, left)
    return fill_delivered(rotors, actuators.reach, left, k, tau, state[1 + actuators.delay :])


@helper
def fill_applied(actuators: Actuators, k: int, tau: Numbers, state: np.ndarray) -> Numbers:
    """Wrench applied from sample k on for the command tau; `state` of `memory` in place."""
    if actuators.ideal:
        return tau
    command = waited(actuators, k, tau, state)
    c = fill_allocated(actuators.rotors, actuators, None, k, command, state)
    c = clipped(c, actuators.reach.limit)
    return fill_slowed(actuators.follow, actuators.slew, c, state[0])
