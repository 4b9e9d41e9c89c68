"""What attitudes say: tilt, the other order of a quaternion, the angle turned by the body."""

import numpy as np
from scipy.spatial.transform import Rotation

from auv_dynamics.vehicle.kinematics import rotation


def tilt(q: np.ndarray) -> np.ndarray:
    """Angle (n,) in rad between the body's z and that of the earth: quaternions (n, 4) w first."""
    return np.arccos(np.clip(rotation(q)[:, 2, 2], -1.0, 1.0))


def reordered(q: np.ndarray) -> np.ndarray:
    """What was meant by quaternions (n, 4) whose w was written first, into x."""
    return np.roll(q, -1, axis=1)


def inverted(q: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) of the opposite direction: from earth to body."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def turned(q: np.ndarray) -> np.ndarray:
    """Sum (n, 3) of the small turns from one sample to the next, rad, in body axes.

    Its rate is the angular velocity; noise of the attitude is not added up in it but is, but for
    the second order, noise of the result.
    """
    attitude = Rotation.from_quat(q[:, [1, 2, 3, 0]])
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def travelled(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Sum (n, 3) of the small ways from one sample to the next, m, in body axes."""
    R = rotation(q)
    steps = np.einsum('nji,nj->ni', (R[:-1] + R[1:]) / 2.0, np.diff(p, axis=0))
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
