"""What takes time between a command and the applied wrench: delay, lag and slew limit."""

from typing import TYPE_CHECKING

import numpy as np

from auv_dynamics.jit import helper
from auv_dynamics.lanes import Number, clip, select
from auv_dynamics.six import Numbers, Six, Vector, copied, fill_vector, vector

if TYPE_CHECKING:
    from auv_dynamics.actuators import Actuators


@helper
def _servo(applied: Number, command: Number, follow: Number, slew: Number) -> Number:
    """First-order servo with a slew limit, Fossen 2021, section 9.5, over one step."""
    move = follow * (command - applied)
    near = select(follow == 1.0, command, applied + move)
    return select(abs(move) > slew, applied + clip(move, -slew, slew), near)


@helper
def waited(actuators: 'Actuators', k: int, tau: Numbers, state: np.ndarray) -> Numbers:
    """The command that the delay lets through at step k; `state` of `memory` in place."""
    if actuators.delay == 0:
        return tau
    slot = 1 + k % actuators.delay
    command = copied(vector(state[slot], 0))
    fill_vector(state[slot], 0, tau)
    return command


@helper
def fill_slowed(actuators: 'Actuators', c: Vector, a: np.ndarray) -> Six:
    """The wrench c behind lag and slew limit; the applied wrench `a` (6,) in place."""
    follow, slew = actuators.follow, actuators.slew
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
