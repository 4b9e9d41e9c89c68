"""Open loop: the wrench is a sum of sines of time, whatever the vehicle does."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.kernel.compile import helper
from auv_dynamics.kernel.lanes import Number, sin
from auv_dynamics.kernel.six import Numbers, Vector
from auv_dynamics.plant.disturbance import Harmonics
from auv_gvc_controller.laws.model import ControlModel

MOST = 6  # sines per degree of freedom: the columns of a matrix of gains


class MULTISINE(NamedTuple):
    """Each (36,) row-major, a row per degree of freedom, a column per sine.

    amplitude in N and N m, omega in rad/s, phase in rad; offset, a diagonal, in N and N m.
    """

    amplitude: np.ndarray
    omega: np.ndarray
    phase: np.ndarray
    offset: np.ndarray

    STATES = 6  # type: ignore[misc]  # all stay zero: numba takes no law that has none
    INTEGRALS = 0  # type: ignore[misc]  # and there is nothing to stop

    @staticmethod
    def wrench(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'MULTISINE', model: ControlModel,
    ) -> tuple[Numbers, Numbers]:  # fmt: skip
        """(tau, 0): offset + sum of amplitude sin(omega t + phase), N and N m, body frame."""
        tau = (
            _axis(t, gains, 0), _axis(t, gains, 1), _axis(t, gains, 2),
            _axis(t, gains, 3), _axis(t, gains, 4), _axis(t, gains, 5),
        )  # fmt: skip
        return tau, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @staticmethod
    def state_rate(
        t: float, nu: Vector, attitude: Vector, nu_d: Vector, nu_d_dot: Vector, state: Vector,
        gains: 'MULTISINE', model: ControlModel,
    ) -> Vector:  # fmt: skip
        """Zero: the law remembers nothing."""
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @staticmethod
    def body_gains(gains: 'MULTISINE', model: ControlModel) -> tuple[np.ndarray, np.ndarray]:
        """(K_D, K_f) (6, 6): nothing is fed back."""
        return np.zeros((6, 6)), np.zeros((6, 6))


@helper
def _axis(t: float, gains: MULTISINE, i: int) -> Number:
    """Wrench of degree of freedom i at t in s."""
    total = gains.offset[7 * i]
    for k in range(6 * i, 6 * i + 6):
        total = total + gains.amplitude[k] * sin(gains.omega[k] * t + gains.phase[k])
    return total


def multisine_gains(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Gains of the law for the `excitation` of a scenario.

    Parameters
    ----------
    spec : DOF word -> {offset, terms}, at most `MOST` terms each; absent degrees of freedom are 0

    Returns
    -------
    gains : as `make_gains` takes them

    """
    wave = Harmonics.from_spec(spec)
    rows = np.zeros((3, 6, MOST))
    for i, terms in enumerate(wave.terms):
        rows[:, i, : len(terms)] = terms.T
    amplitude, omega, phase = rows.tolist()
    return {'amplitude': amplitude, 'omega': omega, 'phase': phase, 'offset': wave.offset.tolist()}
