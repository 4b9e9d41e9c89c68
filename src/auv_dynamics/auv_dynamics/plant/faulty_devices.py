"""Sensors and actuators under faults, step by step, by a row of numbers per step.

A row is: what becomes of the wrench (0: it arrives), the age of the newest measurement that has
arrived in steps, a factor per axis (6), an offset per axis (6), a factor and an offset per thruster
(2 n). The rows are those of `fault_rows`.
"""

import numpy as np

from auv_dynamics.kernel.compile import compiled, helper
from auv_dynamics.kernel.lanes import Number, anywhere, select
from auv_dynamics.kernel.six import (
    Numbers,
    Six,
    Vector,
    clipped,
    fill_vector,
)
from auv_dynamics.plant.actuators import Actuators, fill_slowed, waited
from auv_dynamics.plant.faults import FaultShape
from auv_dynamics.vehicle.allocation import Reach, share_within, thrust

SIZE = 13  # of a state
WRENCH, AGE, AXES, THRUSTERS = 0, 1, 2, 14
HELD, ZEROED = 1.0, 2.0  # a lost wrench: the last one is kept; it has been kept for too long


def history_shape(faults: FaultShape) -> tuple[int, int]:
    """Shape of the `history` of `fill_arrived`, with no rows where sensors are never late."""
    return (faults.delay + 2 if faults.delay else 0, SIZE)


@compiled
def fill_arrived(fault: np.ndarray, k: int, history: np.ndarray, measured: np.ndarray) -> None:
    """Write the newest measurement that has arrived at step k into `measured` (13,).

    `history` (delay + 2, 13): a ring of the last measurements, then that of step k.
    """
    size = history.shape[0] - 1
    for n in range(history.shape[1]):
        history[k % size, n] = history[size, n]
    for age in range(size):
        wanted = fault[AGE] == age
        if anywhere(wanted):
            old = history[(k - age) % size]
            for n in range(history.shape[1]):
                measured[n] = select(wanted, old[n], measured[n])


@helper
def _kept_in(fault: np.ndarray, i: int, tau: Vector, held: np.ndarray) -> Number:
    kept = select(fault[WRENCH] == HELD, held[i], 0.0 * tau[i])
    return select(fault[WRENCH] == 0.0, tau[i], kept)


@helper
def fill_heard(fault: np.ndarray, tau: Vector, held: np.ndarray) -> Six:
    """The command that the actuators hear; `held` (6,) is the last one, in place."""
    heard = (
        _kept_in(fault, 0, tau, held),
        _kept_in(fault, 1, tau, held),
        _kept_in(fault, 2, tau, held),
        _kept_in(fault, 3, tau, held),
        _kept_in(fault, 4, tau, held),
        _kept_in(fault, 5, tau, held),
    )
    fill_vector(held, 0, heard)
    return heard


@helper
def _left_in(reach: Reach, fault: np.ndarray, j: int, tau: Vector, share: Number) -> Number:
    n = reach.T.shape[1]
    total = 0.0 * tau[j]
    for i in range(n):
        u = thrust(reach, i, tau) * share
        left = fault[THRUSTERS + i] * u + fault[THRUSTERS + n + i]
        total = total + reach.T[j, i] * left
    return total


@helper
def left_of_thrusters(reach: Reach, fault: np.ndarray, tau: Numbers) -> Numbers:
    """T u', u' what the faults leave of the thrusts; the allocation does not know of them."""
    if reach.T.shape[1] == 0:
        return tau
    share = share_within(reach, tau)
    return (
        _left_in(reach, fault, 0, tau, share),
        _left_in(reach, fault, 1, tau, share),
        _left_in(reach, fault, 2, tau, share),
        _left_in(reach, fault, 3, tau, share),
        _left_in(reach, fault, 4, tau, share),
        _left_in(reach, fault, 5, tau, share),
    )


@helper
def left_of_axes(fault: np.ndarray, c: Vector) -> Six:
    """What the faults of whole axes leave of a wrench."""
    return (
        fault[AXES] * c[0] + fault[AXES + 6],
        fault[AXES + 1] * c[1] + fault[AXES + 7],
        fault[AXES + 2] * c[2] + fault[AXES + 8],
        fault[AXES + 3] * c[3] + fault[AXES + 9],
        fault[AXES + 4] * c[4] + fault[AXES + 10],
        fault[AXES + 5] * c[5] + fault[AXES + 11],
    )


@compiled
def fill_faulty(
    actuators: Actuators, fault: np.ndarray, k: int, tau: Vector, state: np.ndarray
) -> Numbers:
    """`fill_applied` of actuators with faults; the last row of `state` is the last command."""
    heard = fill_heard(fault, tau, state[state.shape[0] - 1])
    command = waited(actuators, k, heard, state)
    reach = actuators.reach
    c = clipped(left_of_thrusters(reach, fault, command), reach.limit)
    return fill_slowed(actuators, left_of_axes(fault, c), state[0])
