"""What a driver may have meant by its pose and twist: the right reading and the usual mistakes.

Each reading gives a path and the velocity that would be its rate. Earth axes are E times those of
the other convention, body axes S times (`auv_dynamics.vehicle.frames`).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from auv_analysis.driver_check.attitude import inverted, reordered, turned
from auv_analysis.driver_check.motion import Motion
from auv_dynamics.vehicle.frames import swap_body, swap_position
from auv_dynamics.vehicle.kinematics import euler, rotation

Reading = Callable[[Motion], tuple[np.ndarray, np.ndarray]]
CHILD = 'child'


class Hypothesis(NamedTuple):
    """A reading: its name, what it says of the driver, how to mend it, and what it makes of it."""

    name: str
    text: str
    advice: str
    read: Reading


def _turn(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """R(q) v of rows (n, 4) and (n, 3)."""
    return np.einsum('nij,nj->ni', rotation(q), v)


def _flip(v: np.ndarray) -> np.ndarray:
    """S v of rows (n, 3): FLU to FSD, or back."""
    return swap_body(np.concatenate([v, v], axis=1))[:, :3]


def _from_euler_rates(m: Motion) -> np.ndarray:
    """Angular velocity (n, 3) in body axes, if twist.angular were rates of roll, pitch, yaw."""
    phi, theta, _ = euler(m.q).T
    p, t, s = m.nu[:, 3:].T  # rates of phi, theta, psi
    return np.stack(
        [
            p - s * np.sin(theta),
            t * np.cos(phi) + s * np.sin(phi) * np.cos(theta),
            s * np.cos(phi) * np.cos(theta) - t * np.sin(phi),
        ],
        axis=1,
    )


FLU_ADVICE = (
    'turn y and z of the one that is not forward-starboard-down, or send both in ENU and FLU '
    'through frame_converter_node'
)
ENU_ADVICE = 'give position and attitude in NED, or send all in ENU and FLU through '
ENU_ADVICE += 'frame_converter_node'
ORDER_ADVICE = 'orientation has fields x, y, z, w: assign them by name'
INVERSE_ADVICE = 'give the attitude from body to earth: conjugate the quaternion'

LINEAR = (
    Hypothesis(CHILD, 'the axes of child_frame_id', '', lambda m: (m.p, _turn(m.q, m.nu[:, :3]))),
    Hypothesis(
        'world',
        'the axes of header.frame_id, not of child_frame_id',
        'turn twist.linear into the body: R(q)^T v',
        lambda m: (m.p, m.nu[:, :3]),
    ),
    Hypothesis(
        'flu',
        'forward-left-up where the pose is NED and FSD, or the other way round',
        FLU_ADVICE,
        lambda m: (m.p, _turn(m.q, _flip(m.nu[:, :3]))),
    ),
    Hypothesis(
        'world_enu',
        'east-north-up, not the axes of child_frame_id',
        'turn twist.linear into the body, forward-starboard-down',
        lambda m: (m.p, swap_position(m.nu[:, :3])),
    ),
    Hypothesis(
        'position_enu',
        'those of child_frame_id, but the position is east-north-up and the attitude is not',
        ENU_ADVICE,
        lambda m: (m.p, swap_position(_turn(m.q, m.nu[:, :3]))),
    ),
    Hypothesis(
        'attitude_enu',
        'those of child_frame_id, but the attitude is of FLU in ENU and the position is NED',
        ENU_ADVICE,
        lambda m: (m.p, swap_position(_turn(m.q, _flip(m.nu[:, :3])))),
    ),
    Hypothesis(
        'z_up',
        'those of child_frame_id, but z of the position grows upwards',
        'give depth as positive z, not altitude',
        lambda m: (m.p, _turn(m.q, m.nu[:, :3]) * np.array([1.0, 1.0, -1.0])),
    ),
    Hypothesis(
        'w_first',
        'those of child_frame_id, but the quaternion is written w first',
        ORDER_ADVICE,
        lambda m: (m.p, _turn(reordered(m.q), m.nu[:, :3])),
    ),
    Hypothesis(
        'inverse',
        'those of child_frame_id, but the quaternion is that from earth to body',
        INVERSE_ADVICE,
        lambda m: (m.p, _turn(inverted(m.q), m.nu[:, :3])),
    ),
)
ANGULAR = (
    Hypothesis(CHILD, 'the axes of child_frame_id', '', lambda m: (m.turned, m.nu[:, 3:])),
    Hypothesis(
        'degrees',
        'the axes of child_frame_id, but in deg/s',
        'rad/s, always',
        lambda m: (m.turned, np.radians(m.nu[:, 3:])),
    ),
    Hypothesis(
        'flu',
        'forward-left-up where the attitude is of FSD in NED, or the other way round',
        FLU_ADVICE,
        lambda m: (m.turned, _flip(m.nu[:, 3:])),
    ),
    Hypothesis(
        'world',
        'the axes of header.frame_id, not of child_frame_id',
        'turn twist.angular into the body: R(q)^T omega',
        lambda m: (m.turned, _turn(inverted(m.q), m.nu[:, 3:])),
    ),
    Hypothesis(
        'euler_rates',
        'none: these are the rates of roll, pitch and yaw',
        'give p, q, r: the angular velocity in body axes',
        lambda m: (m.turned, _from_euler_rates(m)),
    ),
    Hypothesis(
        'w_first',
        'those of child_frame_id, but the quaternion is written w first',
        ORDER_ADVICE,
        lambda m: (turned(reordered(m.q)), m.nu[:, 3:]),
    ),
    Hypothesis(
        'inverse',
        'those of child_frame_id, but the quaternion is that from earth to body',
        INVERSE_ADVICE,
        lambda m: (turned(inverted(m.q)), m.nu[:, 3:]),
    ),
)
