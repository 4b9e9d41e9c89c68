"""The terms of the equation of motion (1): M, C(nu), D(nu), g, as the kernel evaluates them.

Body frame forward-starboard-down, SI units. This is the only place in the workspace where they
are written; `Vehicle.C`, `.D` and `.g` are these functions applied to unit vectors.
"""

from typing import NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number
from auv_dynamics.kernel.six import (
    Six,
    Vector,
    add,
    matvec,
    sub,
)


class Model(NamedTuple):
    """Coefficients of (1), flat float64 arrays.

    Attributes
    ----------
    M, M_inv : (36,) inertia with added mass and its inverse, row-major; kg, kg m, kg m2
    D_linear, D_quadratic : (36,) positive damping, row-major; column j multiplies 1, abs(nu_j)
    hydrostatics : (4,) W - B in N, then W r_G - B r_B in N m
    lift : (36,) positive lift of body and fins, row-major, which multiplies abs(u); None: none

    """

    M: np.ndarray
    M_inv: np.ndarray
    D_linear: np.ndarray
    D_quadratic: np.ndarray
    hydrostatics: np.ndarray
    lift: np.ndarray | None = None


@helper
def coriolis(M: np.ndarray, nu: Vector, x: Vector) -> Six:
    """C(nu) x with Fossen's C = [[0, -S(a)], [-S(a), -S(b)]], (a, b) = M nu, below (8)."""
    a0, a1, a2, b0, b1, b2 = matvec(M, nu)
    return (
        a2 * x[4] - a1 * x[5],
        a0 * x[5] - a2 * x[3],
        a1 * x[3] - a0 * x[4],
        a2 * x[1] - a1 * x[2] + b2 * x[4] - b1 * x[5],
        a0 * x[2] - a2 * x[0] + b0 * x[5] - b2 * x[3],
        a1 * x[0] - a0 * x[1] + b1 * x[3] - b0 * x[4],
    )


@helper
def damping(model: Model, nu: Vector, x: Vector) -> Six:
    """D(nu) x, D = D_linear + D_quadratic diag(abs(nu)) + abs(u) lift; positive D opposes, (1)."""
    drag = (
        abs(nu[0]) * x[0],
        abs(nu[1]) * x[1],
        abs(nu[2]) * x[2],
        abs(nu[3]) * x[3],
        abs(nu[4]) * x[4],
        abs(nu[5]) * x[5],
    )
    linear = matvec(model.D_linear, x)
    return _with_lift(model.lift, nu, x, add(linear, matvec(model.D_quadratic, drag)))


@helper
def _with_lift(lift: np.ndarray | None, nu: Vector, x: Vector, rest: Six) -> Six:
    """The branch is none when compiled: a model without lift is of another type."""
    if lift is None:
        return rest
    u = abs(nu[0])
    return add(rest, matvec(lift, (u * x[0], u * x[1], u * x[2], u * x[3], u * x[4], u * x[5])))


@helper
def down(attitude: Vector) -> tuple[Number, Number, Number]:
    """Direction of gravity in the body frame: the third row of R(q), q = (w, x, y, z)."""
    w, x, y, z = attitude
    return (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))


@helper
def restoring(model: Model, attitude: Vector) -> Six:
    """g(eta): weight at r_G, buoyancy at r_B, on the left-hand side of (1)."""
    d0, d1, d2 = down(attitude)
    heavy = model.hydrostatics[0]
    m0, m1, m2 = model.hydrostatics[1], model.hydrostatics[2], model.hydrostatics[3]
    return (
        -heavy * d0,
        -heavy * d1,
        -heavy * d2,
        m2 * d1 - m1 * d2,
        m0 * d2 - m2 * d0,
        m1 * d0 - m0 * d1,
    )


@helper
def acceleration(model: Model, attitude: Vector, nu: Vector, tau: Vector, F: Vector) -> Six:
    """nu_dot = M^-1 (tau - C(nu) nu - D(nu) nu - g(eta) - F), equation (1)."""
    c = coriolis(model.M, nu, nu)
    d = damping(model, nu, nu)
    g = restoring(model, attitude)
    return matvec(model.M_inv, sub(sub(sub(sub(tau, c), d), g), F))
