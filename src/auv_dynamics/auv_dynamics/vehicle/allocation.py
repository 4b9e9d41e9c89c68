"""Which wrench thrusters and the limits of axes let through for the one that is commanded."""

from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, select
from auv_dynamics.kernel.six import (
    Numbers,
    Six,
    Vector,
    clipped,
)
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle


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


def make_reach(limit: Any, vehicle: Vehicle | None) -> Reach:
    """Reach of axis limits (1 or 6 numbers, N and N m) and of a vehicle's thrusters, or None."""
    bounds = np.full(6, np.inf) if limit is None else six_numbers(limit)
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


def six_numbers(value: Any) -> np.ndarray:
    """(6,) of one number for all axes, or six."""
    return np.broadcast_to(np.asarray(value, float), 6).copy()


@helper
def thrust(reach: Reach, i: int, tau: Vector) -> Number:
    """u_i of u = T^+ tau in N, without limits."""
    T_inv = reach.T_inv
    return (
        T_inv[i, 0] * tau[0]
        + T_inv[i, 1] * tau[1]
        + T_inv[i, 2] * tau[2]
        + T_inv[i, 3] * tau[3]
        + T_inv[i, 4] * tau[4]
        + T_inv[i, 5] * tau[5]
    )


@helper
def share_within(reach: Reach, tau: Vector) -> Number:
    """Largest share of the thrusts T^+ tau, at most 1, that is within every thruster's limits."""
    share = 1.0
    for i in range(reach.T.shape[1]):
        u = thrust(reach, i, tau)
        most = select(u > 0.0, reach.forward[i], reach.reverse[i])
        over = abs(u) * share > most
        share = select(over, most / select(over, abs(u), 1.0), share)
    return share


@helper
def _delivered_in(reach: Reach, j: int, tau: Vector, share: Number) -> Number:
    total = 0.0 * tau[j]
    for i in range(reach.T.shape[1]):
        total = total + reach.T[j, i] * thrust(reach, i, tau) * share
    return total


@helper
def delivered(reach: Reach, tau: Vector, share: Number) -> Six:
    """T u with u a share of T^+ tau: six floats, N and N m."""
    return (
        _delivered_in(reach, 0, tau, share),
        _delivered_in(reach, 1, tau, share),
        _delivered_in(reach, 2, tau, share),
        _delivered_in(reach, 3, tau, share),
        _delivered_in(reach, 4, tau, share),
        _delivered_in(reach, 5, tau, share),
    )


@helper
def demanded(reach: Reach, tau: Numbers) -> Numbers:
    """What the command asks of the actuators: T T^+ tau, had the thrusters no limits.

    A degree of freedom without a wrench of its own keeps its command: it is never delivered.
    """
    if reach.T.shape[1] == 0:
        return tau
    spanned, own = delivered(reach, tau, 1.0), reach.own
    return (
        select(own[0] > 0.0, spanned[0], tau[0]),
        select(own[1] > 0.0, spanned[1], tau[1]),
        select(own[2] > 0.0, spanned[2], tau[2]),
        select(own[3] > 0.0, spanned[3], tau[3]),
        select(own[4] > 0.0, spanned[4], tau[4]),
        select(own[5] > 0.0, spanned[5], tau[5]),
    )


@helper
def allocated(reach: Reach, tau: Numbers) -> Numbers:
    """T u with u = T^+ tau, scaled down together until every thrust is within its limits."""
    if reach.T.shape[1] == 0:
        return tau
    return delivered(reach, tau, share_within(reach, tau))


@helper
def reachable(reach: Reach, tau: Numbers) -> Six:
    """The wrench that is had for the command tau: thruster allocation, then the axis limits."""
    return clipped(allocated(reach, tau), reach.limit)
