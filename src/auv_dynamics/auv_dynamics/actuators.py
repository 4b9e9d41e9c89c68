"""From the commanded wrench to the one that is applied: delay, limits, slew rate and lag."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files import InputError
from auv_dynamics.jit import compiled, helper
from auv_dynamics.signals import DOFS
from auv_dynamics.six import fill_vector, vector
from auv_dynamics.vehicle import Vehicle

MOST_STEPS = 1_000_000  # of a delay
WHOLE = 1e-6  # of a step: how far a delay may be from a whole number of steps


class Reach(NamedTuple):
    """The wrenches that can be had: what a law may know of its actuators.

    Attributes
    ----------
    bounded : whether there is any bound
    limit : (6,) largest absolute wrench per axis, N and N m; inf where there is none
    T_inv, T : (n, 6) pseudo-inverse and (6, n) configuration of the thrusters, n = 0 for none
    reverse, forward : (n,) largest thrust each way, N
    own : (6,) 1 for a degree of freedom that the thrusters give a wrench of its own, else 0

    """

    bounded: bool
    limit: np.ndarray
    T_inv: np.ndarray
    T: np.ndarray
    reverse: np.ndarray
    forward: np.ndarray
    own: np.ndarray


class Actuators(NamedTuple):
    """The chain from command to applied wrench, per step.

    Attributes
    ----------
    ideal : the command is applied as it is
    reach : which wrenches can be had
    slew : (6,) largest change per step, N and N m
    follow : share of the remaining way that the first-order lag covers in a step
    delay : steps

    """

    ideal: bool
    reach: Reach
    slew: np.ndarray
    follow: float
    delay: int


def make_reach(limit: Any, vehicle: Vehicle | None) -> Reach:
    """Reach of axis limits (1 or 6 numbers, N and N m) and of a vehicle's thrusters, or None."""
    bounds = np.full(6, np.inf) if limit is None else _six(limit)
    thrusters = vehicle.thrusters if vehicle is not None else None
    if thrusters is None:
        no, every = np.zeros(0), np.ones(6)
        return Reach(limit is not None, bounds, np.zeros((0, 6)), np.zeros((6, 0)), no, no, every)
    return Reach(
        True,
        bounds,
        np.ascontiguousarray(thrusters.inverse),
        np.ascontiguousarray(thrusters.matrix),
        thrusters.reverse.astype(float),
        thrusters.forward.astype(float),
        np.array([float(dof not in thrusters.unactuated()) for dof in DOFS]),
    )


def make_actuators(
    spec: Mapping[str, Any] | None, vehicle: Vehicle, step: float, file: object
) -> Actuators:
    """Actuators of a checked scenario.

    Parameters
    ----------
    spec : `limit` (N, N m), `rate` (N/s, N m/s), `lag`, `delay` (s), `thrusters`; None: ideal
    vehicle : whose thrusters are used where `thrusters` is true
    step : control period, s
    file : named in errors

    Raises
    ------
    InputError : a delay that is no multiple of the step, thrusters of a vehicle without any

    """
    if spec is None:
        return IDEAL
    delay = float(spec.get('delay', 0.0)) / step
    if abs(delay - round(delay)) > WHOLE:
        expected = f'a multiple of step ({step:g} s)'
        raise InputError(file, 'actuators.delay', expected, f'{spec["delay"]} s')
    if delay > MOST_STEPS:
        expected = f'at most {MOST_STEPS} steps of {step:g} s'
        raise InputError(file, 'actuators.delay', expected, f'{spec["delay"]} s')
    use_thrusters = bool(spec.get('thrusters', False))
    if use_thrusters and vehicle.thrusters is None:
        expected = f'a vehicle with thrusters, {vehicle.name} has none'
        raise InputError(file, 'actuators.thrusters', expected, 'true')
    lag = float(spec.get('lag', 0.0))
    return Actuators(
        False,
        make_reach(spec.get('limit'), vehicle if use_thrusters else None),
        np.full(6, np.inf) if spec.get('rate') is None else _six(spec['rate']) * step,
        1.0 if lag == 0 else float(-np.expm1(-step / lag)),
        round(delay),
    )


def _six(value: Any) -> np.ndarray:
    """(6,) of one number or six."""
    return np.broadcast_to(np.asarray(value, float), 6).copy()


IDEAL = Actuators(True, make_reach(None, None), np.full(6, np.inf), 1.0, 0)


def memory(actuators: Actuators) -> np.ndarray:
    """State (1 + delay, 6) at the start: the applied wrench, then the commands under way."""
    return np.zeros((1 + actuators.delay, 6))


@helper
def _clipped(a, most):
    return min(max(a, -most), most)


@helper
def thrusts(reach, tau):
    """U = T^+ tau (n,) in N, without limits."""
    count = reach.T.shape[1]
    u = np.zeros(count)
    for i in range(count):
        for j in range(6):
            u[i] += reach.T_inv[i, j] * tau[j]
    return u


@helper
def share_within(reach, u):
    """Largest share of the thrusts u, at most 1, that is within every thruster's limits."""
    share = 1.0
    for i in range(u.shape[0]):
        most = reach.forward[i] if u[i] > 0 else reach.reverse[i]
        if abs(u[i]) * share > most:
            share = most / abs(u[i])
    return share


@helper
def delivered(reach, u, share):
    """T u, scaled: six floats, N and N m."""
    total = np.zeros(6)
    for j in range(6):
        for i in range(u.shape[0]):
            total[j] += reach.T[j, i] * u[i] * share
    return vector(total, 0)


@helper
def demanded(reach, tau):
    """What the command asks of the actuators: T T^+ tau, had the thrusters no limits.

    A degree of freedom without a wrench of its own keeps its command: it is never delivered.
    """
    if reach.T.shape[1] == 0:
        return tau
    spanned, own = delivered(reach, thrusts(reach, tau), 1.0), reach.own
    return (
        spanned[0] if own[0] > 0 else tau[0],
        spanned[1] if own[1] > 0 else tau[1],
        spanned[2] if own[2] > 0 else tau[2],
        spanned[3] if own[3] > 0 else tau[3],
        spanned[4] if own[4] > 0 else tau[4],
        spanned[5] if own[5] > 0 else tau[5],
    )


@helper
def allocated(reach, tau):
    """T u with u = T^+ tau, scaled down together until every thrust is within its limits."""
    if reach.T.shape[1] == 0:
        return tau
    u = thrusts(reach, tau)
    return delivered(reach, u, share_within(reach, u))


@helper
def reachable(reach, tau):
    """The wrench that is had for the command tau: thruster allocation, then the axis limits."""
    c = allocated(reach, tau)
    limit = reach.limit
    return (
        _clipped(c[0], limit[0]),
        _clipped(c[1], limit[1]),
        _clipped(c[2], limit[2]),
        _clipped(c[3], limit[3]),
        _clipped(c[4], limit[4]),
        _clipped(c[5], limit[5]),
    )


@helper
def _servo(applied, command, follow, slew):
    """First-order servo with a slew limit, Fossen 2021, section 9.5, over one step."""
    move = follow * (command - applied)
    if abs(move) > slew:
        return applied + _clipped(move, slew)
    if follow == 1.0:
        return command
    return applied + move


@helper
def fill_applied(actuators, k, tau, state):
    """Wrench applied from sample k on for the command tau; `state` of `memory` in place."""
    if actuators.ideal:
        return tau
    command = tau
    if actuators.delay > 0:
        slot = 1 + k % actuators.delay
        command = vector(state[slot], 0)
        fill_vector(state[slot], 0, tau)
    c = reachable(actuators.reach, command)
    a = state[0]
    follow, slew = actuators.follow, actuators.slew
    applied = (
        _servo(a[0], c[0], follow, slew[0]),
        _servo(a[1], c[1], follow, slew[1]),
        _servo(a[2], c[2], follow, slew[2]),
        _servo(a[3], c[3], follow, slew[3]),
        _servo(a[4], c[4], follow, slew[4]),
        _servo(a[5], c[5], follow, slew[5]),
    )
    fill_vector(a, 0, applied)
    return applied


@compiled
def applied_wrench(actuators, k, tau, state):
    """`fill_applied` to be called from Python: one call is one step of the actuators."""
    return fill_applied(actuators, k, tau, state)
