"""Checks of what was told about a motion against the motion itself: doubts, not decisions."""

import numpy as np

from auv_analysis.foreign.tracks import Track, at_times
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.kinematics import rotation

STILL = 0.02  # m/s: motion below this says nothing about axes
WORSE = 2.0  # times: from here on the other reading fits clearly better


def of_the_motion(pose: Track, twist: Track, other: Track, frame: str) -> list[str]:
    """Notes where the motion contradicts what was told of it.

    Parameters
    ----------
    pose, twist : in NED and FSD, as told
    other : the velocity if its twist_frame were the other one
    frame : the twist_frame as told

    """
    notes = []
    if np.all(pose.rows[:, 2] < 0):
        low, high = -pose.rows[:, 2].max(), -pose.rows[:, 2].min()
        notes.append(
            f'{pose.topic}: the position is {low:.3g} to {high:.3g} m above its origin throughout; '
            'if the vehicle was below it, the earth axes are not those that were told'
        )
    speed, told, otherwise = _misfits(pose, twist, other)
    if speed > STILL and told > WORSE * otherwise:
        right = 'world' if frame == 'child' else 'child'
        notes.append(
            f'{twist.topic}: with twist_frame {frame} the velocity differs from the rate of the '
            f'position by {told:.2g} m/s (median), with twist_frame {right} by {otherwise:.2g}: '
            f'{right} fits better'
        )
    return notes


def _misfits(pose: Track, *velocities: Track) -> tuple[float, ...]:
    """Median speed by the position, and median size of p_dot - R nu of each velocity, m/s."""
    apart = np.diff(pose.ns)
    middle = pose.ns[:-1] + apart // 2
    span = velocities[0].ns[[0, -1]]
    good = (apart <= pose.limit) & (middle >= span[0]) & (middle <= span[1])
    if not good.any():
        return (0.0,) * (1 + len(velocities))
    rate = np.diff(pose.rows[:, :3], axis=0)[good] / (apart[good, None] / NANOSECONDS)
    R = rotation(at_times(pose, middle[good])[:, 3:])
    found = [rate]
    for velocity in velocities:
        nu = at_times(velocity, middle[good])[:, :3]
        found.append(rate - np.einsum('nij,nj->ni', R, nu))
    return tuple(float(np.median(np.linalg.norm(rows, axis=1))) for rows in found)
