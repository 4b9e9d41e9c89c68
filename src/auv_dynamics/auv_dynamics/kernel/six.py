"""Algebra of 6-vectors as tuples, in the order surge, sway, heave, roll, pitch, yaw.

Tuples keep the kernel in registers when it is compiled and readable when it is not. A 6x6 matrix
is a flat row-major array (36,); a triangular one is stored in full and used by its own functions.
"""

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, clip, select

Six = tuple[Number, Number, Number, Number, Number, Number]
Numbers = tuple[Number, ...]
Vector = np.ndarray | Numbers  # what is only read, by index


@helper
def vector(array: Vector, start: int) -> Six:
    """Six numbers of a 1-D array from index `start`."""
    return (
        array[start],
        array[start + 1],
        array[start + 2],
        array[start + 3],
        array[start + 4],
        array[start + 5],
    )


@helper
def fill_vector(array: np.ndarray, start: int, a: Vector) -> None:
    """Write a 6-vector into a 1-D array from index `start`."""
    array[start] = a[0]
    array[start + 1] = a[1]
    array[start + 2] = a[2]
    array[start + 3] = a[3]
    array[start + 4] = a[4]
    array[start + 5] = a[5]


@helper
def copied(a: Vector) -> Six:
    """The same numbers, also where those of `a` are views of lanes that will be overwritten."""
    return (1.0 * a[0], 1.0 * a[1], 1.0 * a[2], 1.0 * a[3], 1.0 * a[4], 1.0 * a[5])


@helper
def add(a: Vector, b: Vector) -> Six:
    """A + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])


@helper
def sub(a: Vector, b: Vector) -> Six:
    """A - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5])


@helper
def clipped(a: Vector, limit: Vector) -> Six:
    """A within -limit ... limit, by component."""
    return (
        clip(a[0], -limit[0], limit[0]),
        clip(a[1], -limit[1], limit[1]),
        clip(a[2], -limit[2], limit[2]),
        clip(a[3], -limit[3], limit[3]),
        clip(a[4], -limit[4], limit[4]),
        clip(a[5], -limit[5], limit[5]),
    )


@helper
def scale(N: Vector, a: Vector) -> Six:
    """N a with the diagonal N (6,)."""
    return (N[0] * a[0], N[1] * a[1], N[2] * a[2], N[3] * a[3], N[4] * a[4], N[5] * a[5])


@helper
def dot(A: np.ndarray, i: int, a: Vector) -> Number:
    """Product of six numbers of a 1-D array from index i with a."""
    return (
        A[i] * a[0]
        + A[i + 1] * a[1]
        + A[i + 2] * a[2]
        + A[i + 3] * a[3]
        + A[i + 4] * a[4]
        + A[i + 5] * a[5]
    )


@helper
def matvec(A: np.ndarray, a: Vector) -> Six:
    """A a with the full matrix A (36,)."""
    return (
        dot(A, 0, a),
        dot(A, 6, a),
        dot(A, 12, a),
        dot(A, 18, a),
        dot(A, 24, a),
        dot(A, 30, a),
    )


@helper
def upper(U: np.ndarray, a: Vector) -> Six:
    """U a with U (36,) upper triangular of unit diagonal."""
    return (
        a[0] + U[1] * a[1] + U[2] * a[2] + U[3] * a[3] + U[4] * a[4] + U[5] * a[5],
        a[1] + U[8] * a[2] + U[9] * a[3] + U[10] * a[4] + U[11] * a[5],
        a[2] + U[15] * a[3] + U[16] * a[4] + U[17] * a[5],
        a[3] + U[22] * a[4] + U[23] * a[5],
        a[4] + U[29] * a[5],
        a[5],
    )


@helper
def upper_T(U: np.ndarray, a: Vector) -> Six:
    """U^T a with U (36,) upper triangular of unit diagonal."""
    return (
        a[0],
        U[1] * a[0] + a[1],
        U[2] * a[0] + U[8] * a[1] + a[2],
        U[3] * a[0] + U[9] * a[1] + U[15] * a[2] + a[3],
        U[4] * a[0] + U[10] * a[1] + U[16] * a[2] + U[22] * a[3] + a[4],
        U[5] * a[0] + U[11] * a[1] + U[17] * a[2] + U[23] * a[3] + U[29] * a[4] + a[5],
    )


@helper
def add_products(total: np.ndarray, a: Vector, b: Vector) -> None:
    """Total += a b, by component and in place."""
    total[0] = total[0] + a[0] * b[0]
    total[1] = total[1] + a[1] * b[1]
    total[2] = total[2] + a[2] * b[2]
    total[3] = total[3] + a[3] * b[3]
    total[4] = total[4] + a[4] * b[4]
    total[5] = total[5] + a[5] * b[5]


@helper
def keep_largest(largest: np.ndarray, a: Vector) -> None:
    """Largest absolute values so far, by component and in place."""
    largest[0] = select(abs(a[0]) > largest[0], abs(a[0]), largest[0])
    largest[1] = select(abs(a[1]) > largest[1], abs(a[1]), largest[1])
    largest[2] = select(abs(a[2]) > largest[2], abs(a[2]), largest[2])
    largest[3] = select(abs(a[3]) > largest[3], abs(a[3]), largest[3])
    largest[4] = select(abs(a[4]) > largest[4], abs(a[4]), largest[4])
    largest[5] = select(abs(a[5]) > largest[5], abs(a[5]), largest[5])
