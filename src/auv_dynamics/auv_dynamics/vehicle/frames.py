"""Frames: ours (NED, forward-starboard-down) to those of ROS (ENU, forward-left-up) and back.

Two frames change at once. The earth frame goes from (north, east, down) to (east, north, up), a
half turn E about the horizontal north-east diagonal; the body frame from forward-starboard-down
(FSD) to forward-left-up (FLU), a half turn S = diag(1, -1, -1) about the forward axis. R(q)
becomes E R(q) S. Half turns are their own inverses: each function here leads from one side to the
other and, applied again, back. None changes its argument.

What is resolved in the body frame (velocity, wrench, the matrices of (1)) takes S alone, what is
resolved in the earth frame takes E alone, an attitude takes both. ENU and FLU are the axes of
REP-103 (Standard Units of Measure and Coordinate Conventions), NED and FSD those of REP-156
(draft: coordinate frame conventions for marine robots) and of Fossen.
"""

import re

import numpy as np

NED_FSD, ENU_FLU = 'ned_fsd', 'enu_flu'
_WORDS = {'ned': NED_FSD, 'fsd': NED_FSD, 'frd': NED_FSD, 'enu': ENU_FLU, 'flu': ENU_FLU}
_S = np.array([1.0, -1.0, -1.0])  # diagonal of S
_S6 = np.concatenate([_S, _S])
_E = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
_E6 = np.kron(np.eye(2), _E)


def _checked(values: np.ndarray, *shape: int) -> np.ndarray:
    values = np.asarray(values, float)
    if values.shape[-len(shape) :] != shape:
        expected = ', '.join(map(str, ('...', *shape)))
        raise ValueError(f'expected shape ({expected}), found {values.shape}')
    return values


def named_axes(frame_id: str) -> str | None:
    """Axes that a frame id names by a word of its own, such as ned in 'world_ned'; else None."""
    parts = re.split(r'[^a-z]+', frame_id.lower())
    named = {_WORDS[part] for part in parts if part in _WORDS}
    return named.pop() if len(named) == 1 else None


def swap_position(p: np.ndarray) -> np.ndarray:
    """Position, or any vector in earth axes: (x, y, z) to (y, x, -z), its own inverse.

    Parameters
    ----------
    p : (..., 3) in NED or in ENU, m

    Returns
    -------
    p : (..., 3) in ENU or in NED, m

    Raises
    ------
    ValueError : another shape

    """
    p = _checked(p, 3)
    return np.stack([p[..., 1], p[..., 0], -p[..., 2]], axis=-1)


def swap_body(a: np.ndarray) -> np.ndarray:
    """Body 6-vector: components 2, 3, 5 and 6 change sign, its own inverse.

    Parameters
    ----------
    a : (..., 6) in FSD or in FLU: nu in m/s and rad/s, nu_dot in m/s2 and rad/s2, tau, F or f in
        N and N m

    Returns
    -------
    a : (..., 6) in FLU or in FSD, unit as given

    Raises
    ------
    ValueError : another shape

    """
    return _checked(a, 6) * _S6


def swap_attitude(q: np.ndarray) -> np.ndarray:
    """Attitude: the quaternion of E R(q) S, its own inverse.

    E is the quaternion (0, 1, 1, 0) / sqrt(2), S is (0, 1, 0, 0); E q S is, up to a sign that makes
    no difference to an attitude, (w + z, x + y, x - y, w - z) / sqrt(2).

    Parameters
    ----------
    q : (..., 4) unit quaternion w, x, y, z: FSD to NED, or FLU to ENU

    Returns
    -------
    q : (..., 4) unit quaternion w, x, y, z: FLU to ENU, or FSD to NED

    Raises
    ------
    ValueError : another shape

    """
    w, x, y, z = np.moveaxis(_checked(q, 4), -1, 0)
    return np.stack([w + z, x + y, x - y, w - z], axis=-1) / np.sqrt(2.0)


def swap_state(x: np.ndarray) -> np.ndarray:
    """Odometry from one frame to the other: position, attitude and body velocity; its own inverse.

    Parameters
    ----------
    x : (..., 13) position in m, quaternion w, x, y, z, nu in m/s and rad/s; NED and FSD, or ENU
        and FLU

    Returns
    -------
    x : (..., 13) the same in ENU and FLU, or in NED and FSD

    Raises
    ------
    ValueError : another shape

    """
    x = _checked(x, 13)
    parts = swap_position(x[..., :3]), swap_attitude(x[..., 3:7]), swap_body(x[..., 7:])
    return np.concatenate(parts, axis=-1)


def swap_body_matrix(A: np.ndarray) -> np.ndarray:
    """Matrix between body 6-vectors: T A T with T = diag(S, S), its own inverse.

    For M, M_RB, M_A, C, the linear and (as abs(nu) is the same on both sides) the quadratic part
    of D, for gains in the body frame, and for the covariance of a twist.

    Parameters
    ----------
    A : (..., 6, 6) in FSD or in FLU, SI

    Returns
    -------
    A : (..., 6, 6) in FLU or in FSD, SI

    Raises
    ------
    ValueError : another shape

    """
    return _checked(A, 6, 6) * np.outer(_S6, _S6)


def swap_earth_matrix(A: np.ndarray) -> np.ndarray:
    """Matrix between 6-vectors in earth axes: T A T with T = diag(E, E), its own inverse.

    For the covariance of a pose, whose rotations are about the fixed axes.

    Parameters
    ----------
    A : (..., 6, 6) in NED or in ENU, SI

    Returns
    -------
    A : (..., 6, 6) in ENU or in NED, SI

    Raises
    ------
    ValueError : another shape

    """
    return _E6 @ _checked(A, 6, 6) @ _E6


def swap_inertia(inertia: np.ndarray) -> np.ndarray:
    """Inertia tensor: S I S, its own inverse; the products Ixy and Ixz change sign, Iyz does not.

    Parameters
    ----------
    inertia : (..., 3, 3) in FSD or in FLU, kg m2

    Returns
    -------
    inertia : (..., 3, 3) in FLU or in FSD, kg m2

    Raises
    ------
    ValueError : another shape

    """
    return _checked(inertia, 3, 3) * np.outer(_S, _S)
