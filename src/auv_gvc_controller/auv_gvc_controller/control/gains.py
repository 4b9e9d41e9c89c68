"""Body-frame gains of a law, and whether they fit the control period."""

from typing import Any

import numpy as np

from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.control.sampled_law import user_law
from auv_gvc_controller.laws.law import SHIPPED
from auv_gvc_controller.laws.model import ControlModel

ROUNDING = 1e-9
DIFFERENCE = 1e-3  # m/s, rad/s
RINGS, UNSTABLE = 1.0, 2.0  # of lambda step, for a velocity loop that is sampled and held


def body_gains(gains: Any, model: ControlModel) -> tuple[np.ndarray, np.ndarray]:
    """K_D and K_f of tau = ... + K_D s + K_f integral(s), step 1 of section 4.2.

    A law says it in a static method `body_gains(gains, model)`. Of a user's law without one, K_D
    is what it does at rest, -d tau / d nu, and K_f its gain Gamma, zero where it has none.

    Parameters
    ----------
    gains : named tuple of a law
    model : what the law knows of the vehicle

    Returns
    -------
    K_D, K_f : (6, 6) body frame; of GVC k M and Gamma M exactly where the gains are scalar

    """
    law = type(gains)
    if hasattr(law, 'body_gains'):
        K_D, K_f = law.body_gains(gains, model)
    else:
        K_D = gains.k_D if law in SHIPPED.values() else velocity_gain(gains, model)
        K_f = getattr(gains, 'Gamma', np.zeros(36))
    return np.reshape(K_D, (6, 6)), np.reshape(K_f, (6, 6))


def velocity_gain(gains: Any, model: ControlModel) -> np.ndarray:
    """-d tau / d nu (6, 6) of a law at rest at t = 0, by differences; zero if it is not finite."""
    zero, state = (0.0,) * 6, np.zeros(type(gains).STATES)

    def tau(nu: np.ndarray) -> np.ndarray:
        arguments = 0.0, tuple(nu.tolist()), (1.0, 0.0, 0.0, 0.0), zero, zero, state.copy()
        answer, _ = type(gains).wrench(*arguments, gains, model)
        return np.asarray(answer, float)

    with np.errstate(all='ignore'), user_law(gains):
        columns = [(tau(-h) - tau(h)) / (2 * DIFFERENCE) for h in DIFFERENCE * np.eye(6)]
    gain = np.stack(columns, axis=1)
    return gain if np.isfinite(gain).all() else np.zeros((6, 6))


def velocity_rates(K_D: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Eigenvalues (..., 6) of M^-1 K_D (..., 6, 6), 1/s: rates of the loop of `sampled_rate`."""
    return np.linalg.eigvals(np.linalg.solve(M, K_D))


def sampled_rate(K_D: np.ndarray, M: np.ndarray) -> tuple[float, str]:
    """Fastest rate of the velocity loop M nu_dot + K_D nu = 0, and the DOF that has most of it.

    Parameters
    ----------
    K_D : (6, 6) velocity gain in the body frame, N s/m ... N m s/rad; need not be symmetric
    M : (6, 6) inertia with added mass, kg ... kg m2

    Returns
    -------
    rate : spectral radius of M^-1 K_D, 1/s
    dof : the degree of freedom with the largest part of the energy of that mode

    """
    eigenvalues, modes = np.linalg.eig(np.linalg.solve(M, K_D))
    fastest = int(np.argmax(np.abs(eigenvalues)))
    energy = np.abs(np.conj(modes[:, fastest]) * (M @ modes[:, fastest]))
    return float(np.abs(eigenvalues[fastest])), DOFS[int(np.argmax(energy))]


def sampling_warning(K_D: np.ndarray, M: np.ndarray, step: float) -> str | None:
    """What happens to a velocity gain that is sampled and held for too long; None: nothing.

    An axis m nu_dot = -k nu, held for h, follows nu_{k+1} = (1 - h k / m) nu_k: it overshoots
    at every sample above h k / m = 1 and grows above 2. Here k / m is the spectral radius of
    M^-1 K_D. An adaptive gain gamma raises the second bound to 2 + h^2 gamma / (2 m).

    Parameters
    ----------
    K_D : (6, 6) velocity gain in the body frame; need not be symmetric
    M : (6, 6) inertia with added mass
    step : s

    """
    eigenvalues = velocity_rates(K_D, M)
    damped = eigenvalues[eigenvalues.real >= 0]  # the others grow at every step, however short
    if len(damped) == 0:
        return None
    rate = float(np.abs(damped).max())
    turning = damped[(damped.imag != 0) & (damped.real > ROUNDING * np.abs(damped))]
    growth = float(np.abs(1 - step * turning).max(initial=0.0))
    _, dof = sampled_rate(K_D, M)
    text = f'lambda_max(M^-1 K_D) * step = {rate * step:.3g}, mostly in {dof}'
    if growth > 1 + ROUNDING and rate * step <= UNSTABLE:
        return (
            f'{text}: its complex pair grows by {growth:.3g} a sample, the sampled loop is unstable'
        )
    return _ringing(text, rate, step)


def state_warning(gains: Any, step: float) -> str | None:
    """The same for a law's own states, which are integrated by Euler's rule between samples.

    A law says how fast they are in a static method `own_rate(gains)`, 1/s.
    """
    if not hasattr(type(gains), 'own_rate'):
        return None
    rate = float(type(gains).own_rate(gains))
    return _ringing(f"the law's own states: rate * step = {rate * step:.3g}", rate, step)


def _ringing(text: str, rate: float, step: float) -> str | None:
    if rate * step <= RINGS:
        return None
    limit, what = (UNSTABLE, 'is unstable') if rate * step > UNSTABLE else (RINGS, 'rings')
    return (
        f'{text}: above {limit:g} the sampled loop {what}; '
        f'a step of at most {RINGS / rate:.2g} s or a smaller gain avoids it'
    )
