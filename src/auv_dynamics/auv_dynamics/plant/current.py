"""The equation of motion (1) in an ocean current, through the velocity relative to the water."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number
from auv_dynamics.kernel.six import (
    Six,
    Vector,
    add,
    matvec,
)
from auv_dynamics.plant.signals import Harmonics
from auv_dynamics.vehicle.model import Model, acceleration

Current = Callable[[np.ndarray], np.ndarray]  # t (n,) in s -> (n, 6): v_c, v_c_dot in NED
AXES = {'north': 'surge', 'east': 'sway', 'down': 'heave'}


def make_current(specs: Sequence[Mapping[str, Any]]) -> Current | None:
    """Sum of the currents of a checked scenario; None where there is none.

    Parameters
    ----------
    specs : mappings of kind `current`: `velocity` (3,) in m/s, NED, constant; `north`, `east`,
        `down` with offset and terms, as of a harmonic

    Returns
    -------
    current : function of t (n,) in s, gives (n, 6): v_c in m/s and its derivative in m/s2, NED

    """
    if not specs:
        return None
    constant = np.sum([spec.get('velocity', [0.0] * 3) for spec in specs], axis=0, dtype=float)
    waves = [
        Harmonics.from_spec({dof: spec[axis] for axis, dof in AXES.items() if axis in spec})
        for spec in specs
    ]

    def current(t: np.ndarray) -> np.ndarray:
        t = np.asarray(t, float)
        flow = np.zeros((*t.shape, 6))
        flow[..., :3] = constant
        for wave in waves:
            flow[..., :3] += wave.value(t)[..., :3]
            flow[..., 3:] += wave.derivative(t)[..., :3]
        return flow

    return current


def varies(spec: Mapping[str, Any]) -> bool:
    """Whether the current of a mapping changes with time."""
    return any(
        term['amplitude'] != 0 and term['omega'] != 0
        for axis in AXES
        for term in spec.get(axis, {}).get('terms', [])
    )


@helper
def to_body(attitude: Vector, v: Vector) -> tuple[Number, Number, Number]:
    """R(q)^T v: a vector in NED seen in the body frame."""
    w, x, y, z = attitude
    a, b, c = v
    return (
        (1.0 - 2.0 * (y * y + z * z)) * a + 2.0 * (x * y + w * z) * b + 2.0 * (x * z - w * y) * c,
        2.0 * (x * y - w * z) * a + (1.0 - 2.0 * (x * x + z * z)) * b + 2.0 * (y * z + w * x) * c,
        2.0 * (x * z + w * y) * a + 2.0 * (y * z - w * x) * b + (1.0 - 2.0 * (x * x + y * y)) * c,
    )


@helper
def acceleration_in_current(
    model: Model,
    M_RB: np.ndarray,
    attitude: Vector,
    nu: Vector,
    tau: Vector,
    F: Vector,
    flow: Vector,
) -> Six:
    """nu_dot in a current `flow` = (v_c, v_c_dot) in NED.

    (1) in nu_r = nu - (R^T v_c, 0) with M_RB (R^T v_c_dot, 0) on its left-hand side, then
    nu_dot = nu_r_dot + (R^T v_c_dot - omega x R^T v_c, 0). Fossen 2021, section 10.3.
    """
    c0, c1, c2 = to_body(attitude, (flow[0], flow[1], flow[2]))
    a0, a1, a2 = to_body(attitude, (flow[3], flow[4], flow[5]))
    p, q, r = nu[3], nu[4], nu[5]
    nu_r = (nu[0] - c0, nu[1] - c1, nu[2] - c2, p, q, r)
    carried = matvec(M_RB, (a0, a1, a2, 0.0, 0.0, 0.0))
    b = acceleration(model, attitude, nu_r, tau, add(F, carried))
    return (
        b[0] + a0 - (q * c2 - r * c1),
        b[1] + a1 - (r * c0 - p * c2),
        b[2] + a2 - (p * c1 - q * c0),
        b[3],
        b[4],
        b[5],
    )
