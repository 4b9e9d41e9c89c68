"""The sampled loop with delay and actuator lag: its exact frequency response and transitions.

A law answers samples, its wrench is held for a control period h and arrives after a delay, then
the actuators follow with a lag. Nothing is approximated: no Pade polynomial stands for the delay,
and no half period for the hold.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, expm

from auv_dynamics.vehicle.thrusters import Rotor

LEAST_LAG = 1e-9  # s, the least step of a scenario: what is faster follows at once


def behind_rotors(
    A: np.ndarray, B: np.ndarray, rotors: Sequence[Rotor], into: np.ndarray, out: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A and B of a plant behind actuators whose output follows what is asked of them.

    lag a_dot + a = a_d, or a_ddot + 2 zeta omega a_dot + omega^2 a = omega^2 a_d: the deviation
    (a - a_d, a_dot) has the rate F times itself. A small change of a thrust follows its rotor's
    speed, as thrust goes by n |n|.

    Parameters
    ----------
    A, B : (n, n), (n, 6) of the plant
    rotors : p of them; one without a response in time follows at once and has no state
    into : (p, 6) from the wrench asked for to the actuators
    out : (6, p) from the actuators to the wrench delivered

    Returns
    -------
    A, B : (n + q, n + q), (n + q, 6) with the q states of slow actuators behind those of the plant

    Fossen 2021, section 9.5.

    """
    rates = [_rates(rotor) for rotor in rotors]
    sizes = np.array([len(F) for F in rates])
    slow, F = sizes > 0, block_diag(*rates)
    E = np.eye(len(F))[:, (np.cumsum(sizes) - sizes)[slow]]  # outputs among the states
    lagged = np.block([[A, B @ out[:, slow] @ E.T], [np.zeros((len(F), len(A))), F]])
    return lagged, np.vstack([B @ out[:, ~slow] @ into[~slow], -F @ E @ into[slow]])


def _rates(rotor: Rotor) -> np.ndarray:
    """F (q, q) of a rotor, q its order."""
    if rotor.omega:
        return np.array([[0.0, 1.0], [-(rotor.omega**2), -2 * rotor.zeta * rotor.omega]])
    return np.array([[-1 / rotor.lag]]) if rotor.lag > LEAST_LAG else np.zeros((0, 0))


class HeldInput(NamedTuple):
    """x_{k+1} = Phi x_k + newest u_{k-whole} + older u_{k-whole-1}, of a delayed, held input.

    Attributes
    ----------
    delay : s
    whole : periods of it
    newest, older : (n, 6) by how much each of the two wrenches of a period acts in it

    """

    delay: float
    whole: int
    newest: np.ndarray
    older: np.ndarray


@dataclass(frozen=True, eq=False)
class HeldPlant:
    """Plant behind a zero-order hold and a delay, exact at the samples.

    Attributes
    ----------
    A, B : (n, n), (n, 6) of x_dot = A x + B u; its first eight states are what a law sees
    period : h, s, for which u is held
    Phi : (n, n) exp(A h)
    Gamma : (n, 6) by how much a u acts that is held over a period

    """

    A: np.ndarray
    B: np.ndarray
    period: float
    Phi: np.ndarray = field(init=False)
    Gamma: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Transition over one period."""
        for name, matrix in zip(('Phi', 'Gamma'), self._over(self.period), strict=True):
            object.__setattr__(self, name, matrix)

    def _over(self, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """exp(A t) and the integral of exp(A s) B over s from 0 to t."""
        n, k = self.B.shape
        whole = expm(seconds * np.block([[self.A, self.B], [np.zeros((k, n + k))]]))
        return whole[:n, :n], whole[:n, n:]

    def input(self, delay: float) -> HeldInput:
        """Effect of a wrench that comes `delay` s late, any number from 0 up.

        Astrom & Wittenmark 1997, section 2.3.
        """
        whole = int(np.floor(delay / self.period + WHOLE))
        rest = max(delay - whole * self.period, 0.0)
        rest = 0.0 if rest < WHOLE * self.period else rest
        newest = self._over(self.period - rest)[1]
        return HeldInput(delay, whole, newest, self.Gamma - newest)

    def response(self, z: np.ndarray, held: HeldInput) -> np.ndarray:
        """(..., 8, 6) from u to what the law sees, at z = exp(i omega h) (...,)."""
        z = np.asarray(z)[..., None, None]
        forced = held.newest + held.older / z
        return (np.linalg.solve(z * np.eye(len(self.A)) - self.Phi, forced) / z**held.whole)[
            ..., :8, :
        ]


WHOLE = 1e-9  # of a period: a delay nearer than this to a whole number of them is that number


class LinearLaw(NamedTuple):
    """tau_k = by_x x_k + by_state s_k, s_{k+1} = s_k + h (rate_by_x x_k + rate_by_state s_k).

    Attributes
    ----------
    by_x, by_state : (6, 8), (6, m)
    rate_by_x, rate_by_state : (m, 8), (m, m)

    """

    by_x: np.ndarray
    by_state: np.ndarray
    rate_by_x: np.ndarray
    rate_by_state: np.ndarray

    def reached(self, z: np.ndarray, period: float, seen: np.ndarray) -> np.ndarray:
        """(..., 8 + m, 6) from u to what the law sees, `seen`, and to its states."""
        m = len(self.rate_by_x)
        moved = (np.asarray(z) - 1)[..., None, None] * np.eye(m) - period * self.rate_by_state
        states = np.linalg.solve(moved, period * self.rate_by_x @ seen)
        return np.concatenate([seen, states], axis=-2)

    def closed(self, reached: np.ndarray) -> np.ndarray:
        """I + L (..., 6, 6) where u reaches that."""
        return np.eye(6) - np.hstack([self.by_x, self.by_state]) @ reached


@dataclass(frozen=True, eq=False)
class SampledLoop:
    """A law around a held plant, opened where the wrench leaves the law.

    Attributes
    ----------
    plant, law : of the loop
    held : how a wrench acts on the plant, which comes late beside the hold

    """

    plant: HeldPlant
    law: LinearLaw
    held: HeldInput

    def z(self, omega: np.ndarray) -> np.ndarray:
        """exp(i omega h) at rad/s."""
        return np.exp(1j * np.asarray(omega) * self.plant.period)

    def reached(self, omega: np.ndarray) -> np.ndarray:
        """(..., 8 + m, 6) from u to what the law sees and to its states at omega (...,) rad/s."""
        z = self.z(omega)
        return self.law.reached(z, self.plant.period, self.plant.response(z, self.held))

    def sensitivity(self, omega: np.ndarray, reached: np.ndarray | None = None) -> np.ndarray:
        """S = (I + L)^-1 (..., 6, 6) at omega (...,) rad/s; tau = -L u where the loop is open.

        `reached` is that there where it is known. With the loop opened at axis i alone, the others
        closed, its gain is 1/S_ii - 1.

        Skogestad & Postlethwaite 2005, section 2.2.
        """
        known = self.reached(omega) if reached is None else reached
        return np.linalg.inv(self.law.closed(known))

    def closing(self, omega: float, axis: int, extra: float) -> complex:
        """1 + the loop gain of an axis whose wrench comes `extra` s later still."""
        z = self.z(np.array(omega))
        seen = self.plant.response(z, self.held)
        late = self.plant.input(self.held.delay + extra)
        seen[:, axis] = self.plant.response(z, late)[:, axis]
        whole = self.law.closed(self.law.reached(z, self.plant.period, seen))
        others = np.delete(np.delete(whole, axis, 0), axis, 1)
        return complex(np.linalg.det(whole) / np.linalg.det(others))

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Eigenvalues of the transition over a period, in modulus at most 1 where it is stable.

        The transition is that of x, the law's state and past wrenches.
        """
        held, law, h = self.held, self.law, self.plant.period
        n, m = len(self.plant.A), len(law.rate_by_x)
        past = held.whole + bool(held.older.any())
        command = np.hstack([law.by_x, np.zeros((6, n - 8)), law.by_state])
        A = np.zeros((n + m + 6 * past,) * 2)
        A[:n, :n] = self.plant.Phi
        A[n : n + m, :8] = h * law.rate_by_x
        A[n : n + m, n : n + m] = np.eye(m) + h * law.rate_by_state
        for steps, by in ((held.whole, held.newest), (held.whole + 1, held.older)):
            if steps == 0:
                A[:n, : n + m] += by @ command
            elif steps <= past:
                start = n + m + 6 * (steps - 1)
                A[:n, start : start + 6] += by
        if past:
            A[n + m : n + m + 6, : n + m] = command
            A[n + m + 6 :, n + m : -6] = np.eye(6 * (past - 1))
        return np.linalg.eigvals(A)
