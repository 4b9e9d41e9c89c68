"""The signals of which sums and largest magnitudes are kept, each from one sample.

What a signal is stands here once: it takes the numbers of one sample where it is compiled, and
whole columns of a block where it is not.
"""

from typing import Any, NamedTuple

import numpy as np

from auv_analysis.metrics.energy import component
from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.six import Vector, sub, upper, upper_T
from auv_gvc_controller.laws.model import ControlModel

NAMES = ('error', 'lumped_error', 'tau', 'delta_xi', 'delta_pi', 'energy', 'nu_d')
ERROR, LUMPED, TAU, DELTA_XI, DELTA_PI, ENERGY, SETPOINT = range(len(NAMES))


class Maps(NamedTuple):
    """Matrices from nu and tau to the signals: flat, row-major."""

    Upsilon: np.ndarray
    Upsilon_inv: np.ndarray
    N: np.ndarray


def maps_of(model: ControlModel) -> Maps:
    """Maps of a vehicle."""
    return Maps(model.Upsilon, model.Upsilon_inv, model.N)


@helper
def signals(
    nu: Vector, nu_d: Vector, tau: Vector, f: Vector, F: Vector, maps: Any
) -> tuple[Vector, ...]:
    """The signals of `NAMES`, six numbers each: m/s, rad/s; N, N m; J.

    `maps` has the fields of `Maps`. Equations (30) for the energy, (33) and (34).
    """
    xi, N = upper(maps.Upsilon_inv, nu), maps.N
    energy = (
        component(N[0], xi[0]), component(N[1], xi[1]), component(N[2], xi[2]),
        component(N[3], xi[3]), component(N[4], xi[4]), component(N[5], xi[5]),
    )  # fmt: skip
    return (
        sub(nu_d, nu),
        sub(f, F),
        tau,
        sub(xi, nu),
        sub(upper_T(maps.Upsilon, tau), tau),
        energy,
        nu_d,
    )
