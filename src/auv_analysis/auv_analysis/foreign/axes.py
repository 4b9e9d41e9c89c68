"""The axes of a foreign topic: told or refused, never guessed, and turned into NED and FSD."""

from collections.abc import Callable

import numpy as np

from auv_analysis.foreign.signals import Recorded
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.frames import (
    ENU_FLU,
    NED_FSD,
    named_axes,
    swap_attitude,
    swap_body,
    swap_position,
)
from auv_dynamics.vehicle.kinematics import rotation

_SWAPS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    'pose': lambda x: np.concatenate([swap_position(x[:, :3]), swap_attitude(x[:, 3:])], axis=1),
    'twist': swap_body,
    'wrench': swap_body,
    'wrench_applied': swap_body,
    'setpoint': swap_body,
}


def axes_of(found: Recorded, notes: list[str]) -> str:
    """Axes of a topic, by what was said or, if its frame ids all say NED and FSD, by these.

    Parameters
    ----------
    found : the topic
    notes : gets a line where frame ids contradict what was said

    Raises
    ------
    InputError : nothing was said, and the frame ids do not say NED and FSD

    """
    source = found.source
    if source.role == 'thrusters':
        return ''  # thrusts have none: the vehicle file says where they point
    ids = [name for name in (found.frame, found.child) if name]
    if source.frames is None:
        if ids and all(named_axes(name) == NED_FSD for name in ids):
            return NED_FSD
        where = f'{source.topic}: frame_id' if ids else f'{source.topic}: frames'
        shown = ', '.join(repr(name) for name in ids) if ids else 'a type without frame_id'
        expected = f'--frames {NED_FSD} or {ENU_FLU}, since only what is named ned, fsd or frd'
        raise InputError(found.bag, where, f'{expected} is taken as that', shown)
    against = [name for name in ids if named_axes(name) not in (None, source.frames)]
    if against:
        notes.append(f'{source.topic}: frame_id {against[0]} taken as {source.frames}, as told')
    return source.frames


def in_our_axes(rows: np.ndarray, role: str, axes: str) -> np.ndarray:
    """Rows of a role (n, k) in NED and FSD; those of thrusters have no axes."""
    return _SWAPS[role](rows) if axes == ENU_FLU and role in _SWAPS else rows


def from_earth(twist: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """Velocity written in earth axes turned into body axes.

    Parameters
    ----------
    twist : (n, 6) linear and angular velocity of the body, m/s and rad/s, in NED
    attitude : (n, 4) quaternions w, x, y, z, FSD to NED

    Returns
    -------
    nu : (n, 6) in FSD

    """
    R = rotation(attitude)
    return np.concatenate(
        [np.einsum('nji,nj->ni', R, half) for half in (twist[:, :3], twist[:, 3:])], axis=1
    )


def swap_earth(twist: np.ndarray) -> np.ndarray:
    """Velocity (n, 6) in ENU axes to NED axes, or back."""
    return np.concatenate([swap_position(twist[:, :3]), swap_position(twist[:, 3:])], axis=1)
